#include "tools/pmsim/methods.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "firmware/params/parameters.h"
#include "tools/pmsim/drive_parameters.h"

namespace pmsim
{
namespace
{

TEST(Methods, EveryRowOfTheBookOnce)
{
    ASSERT_EQ(methods().size(), 152U);
    int row = 0;
    for (const Method &method : methods()) {
        EXPECT_EQ(method.row, ++row);
        EXPECT_FALSE(method.section.empty() || method.name.empty()) << row;
    }
}

TEST(Methods, WhatIsImplementedHasItsParameterAndItsScenario)
{
    for (const Method &method : methods()) {
        if (!method.implemented) {
            EXPECT_EQ(method.parameter + method.scenario, "") << method.row;
            continue;
        }
        EXPECT_TRUE(method.parameter.empty() || method.parameter == "none" ||
                    find_parameter(method.parameter))
            << method.row;
        const bool is_test = method.scenario.find('/') != std::string::npos;
        const std::string proof = is_test ? "tests/unit/" + method.scenario + "_test.cpp"
                                          : "tests/scenario/" + method.scenario + ".yaml";
        EXPECT_TRUE(std::filesystem::exists(proof)) << method.row;
    }
}

} // namespace
} // namespace pmsim
