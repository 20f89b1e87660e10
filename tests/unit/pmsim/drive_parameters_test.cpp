#include "tools/pmsim/drive_parameters.h"

#include <gmock/gmock.h>

#include "firmware/params/parameters.h"
#include "tests/unit/pmsim/support.h"

namespace pmsim
{
namespace
{

using testing::HasSubstr;
using testing::MatchesRegex;

drive_params_t defaults()
{
    drive_params_t params;
    drive_params_default(&params);
    return params;
}

std::string error_for(const std::string &name, const std::string &value)
{
    drive_params_t params = defaults();
    return error_of([&] { read_parameter(params, name, Value::from_text(value, "f.yaml")); });
}

TEST(DriveParameters, SiBecomesTheStoredInteger)
{
    drive_params_t params = defaults();
    read_parameter(params, "L_d", Value::from_text("12.0e-6", "f.yaml"));
    EXPECT_EQ(params.L_d, 12000);
    read_parameter(params, "L_dqh_rated", Value::from_text("-0.0066", "f.yaml"));
    EXPECT_EQ(params.L_dqh_rated, -6600000);
    read_parameter(params, "pole_pairs", Value::from_text("21", "f.yaml"));
    EXPECT_EQ(params.pole_pairs, 21);
}

// What pmsim params prints can be put back.
TEST(DriveParameters, EveryLimitAndDefaultSurvivesARoundTrip)
{
    for (int i = 0; i < DRIVE_PARAM_COUNT; ++i) {
        const auto id = static_cast<drive_param_id_t>(i);
        const drive_param_info_t &info = drive_param_table[i];
        for (const int32_t raw : {info.min, info.def, info.max}) {
            drive_params_t params = defaults();
            set_parameter_si(params, id, parameter_si(id, raw));
            EXPECT_EQ(drive_param_get(&params, id), raw) << info.name;
        }
    }
}

TEST(DriveParameters, UnknownName)
{
    EXPECT_EQ(error_for("flux_bandwith", "30"),
              "f.yaml:1:1: unknown drive parameter \"flux_bandwith\"; did you mean \"flux_bandwidth\"?");
}

TEST(DriveParameters, OutOfRange)
{
    EXPECT_THAT(error_for("pole_pairs", "0"),
                HasSubstr("f.yaml:1:1: pole_pairs = 0 is out of range 1 ... 50"));
    EXPECT_THAT(error_for("R_s", "1e9"), HasSubstr("R_s = 1e+09 ohm is out of range"));
    EXPECT_THAT(error_for("commutation", "9"),
                MatchesRegex("f.yaml:1:1: commutation = 9 is out of range 0 ... 1: 0 [^;]+; 1 [^;]+"));
    EXPECT_THAT(error_for("R_s", "nan"), HasSubstr("finite"));
}

TEST(DriveParameters, BetweenTwoSteps)
{
    EXPECT_THAT(error_for("pole_pairs", "3.4"),
                HasSubstr("pole_pairs = 3.4 cannot be stored: the step is 1"));
    EXPECT_EQ(error_for("R_s", "0.1234567"), "no error"); // less than 1 % off
}

TEST(DriveParameters, WhatTheTimerDecidesIsRefused)
{
    EXPECT_EQ(error_for("f_pwm", "8000"),
              "f.yaml:1:1: \"f_pwm\" follows from the inverter: set inverter.f_pwm_Hz");
}

} // namespace
} // namespace pmsim
