#include <gtest/gtest.h>

#include <cstring>
#include <set>
#include <string>

#include "firmware/params/parameters.h"
#include "tests/contract/firmware.h"

namespace
{

TEST(Parameters, TableIsComplete)
{
    std::set<std::string> names;
    for (int id = 0; id < DRIVE_PARAM_COUNT; ++id) {
        const drive_param_info_t &p = drive_param_table[id];
        EXPECT_TRUE(names.insert(p.name).second) << p.name;
        EXPECT_NE(std::string(drive_param_text[id].unit), "") << p.name;
        EXPECT_NE(std::string(drive_param_text[id].help), "") << p.name;
        EXPECT_LT(p.min, p.max) << p.name;
        EXPECT_GE(p.def, p.min) << p.name;
        EXPECT_LE(p.def, p.max) << p.name;
        EXPECT_GE(drive_param_exp10[id], -12) << p.name;
        EXPECT_LE(drive_param_exp10[id], 0) << p.name;
        EXPECT_LT(p.max, INT32_MAX) << p.name; // so that "above" exists
        EXPECT_GT(p.min, INT32_MIN) << p.name;
    }
}

TEST(Parameters, NamesAndMembersAreTheSame)
{
    drive_params_t p = {};
#define PM_PARAM(id, unit_, exponent, least, standard, most, text)                                           \
    drive_param_set(&p, DRIVE_PARAM_##id, 1234);                                                             \
    EXPECT_EQ(p.id, 1234) << #id;                                                                            \
    EXPECT_EQ(std::string(drive_param_table[DRIVE_PARAM_##id].name), #id);                                   \
    p.id = 77;                                                                                               \
    EXPECT_EQ(drive_param_get(&p, DRIVE_PARAM_##id), 77) << #id;
#include "firmware/params/parameters.def"
#undef PM_PARAM
}

TEST(Parameters, EachHasItsOwnPlace)
{
    drive_params_t p;
    for (int id = 0; id < DRIVE_PARAM_COUNT; ++id) {
        std::memset(&p, 0, sizeof p);
        drive_param_set(&p, static_cast<drive_param_id_t>(id), -1);
        for (int other = 0; other < DRIVE_PARAM_COUNT; ++other) {
            EXPECT_EQ(drive_param_get(&p, static_cast<drive_param_id_t>(other)), other == id ? -1 : 0);
        }
    }
}

TEST(Parameters, DefaultsAreTheTableS)
{
    drive_params_t p;
    std::memset(&p, 0xa5, sizeof p);
    drive_params_default(&p);
    for (int id = 0; id < DRIVE_PARAM_COUNT; ++id) {
        EXPECT_EQ(drive_param_get(&p, static_cast<drive_param_id_t>(id)), drive_param_table[id].def)
            << drive_param_table[id].name;
    }
    EXPECT_EQ(p.absent, 0);
}

} // namespace
