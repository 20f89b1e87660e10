#include "tools/pmsim/machine_variables.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tools/pmsim/machine_file.h"

namespace
{

using pmsim::machine_variables;
using pmsim::Settings;
using pmsim::Setup;

Setup machine(const std::string &name, const pmsim::Settings &settings = {})
{
    Setup setup = pmsim::load_machine_file("sim_plant/machines/" + name);
    apply_settings(setup, settings);
    return setup;
}

double number(const Setup &setup, const std::string &name)
{
    return std::stod(machine_variables(setup).at(name));
}

TEST(MachineVariables, OfTheMachineOfThePictureArePlain)
{
    const pmsim::Variables v = machine_variables(machine("ipm_1000.yaml"));
    EXPECT_EQ(v.at("machine"), "IPM-1000");
    EXPECT_EQ(v.at("salient"), "1");
    EXPECT_EQ(v.at("round"), "0");
    EXPECT_EQ(v.at("pace"), "1");
    EXPECT_EQ(v.at("load_ramp_s"), "0");
    EXPECT_EQ(v.at("start_turn_deg"), "5");
    EXPECT_EQ(v.at("bears"), "1");
}

TEST(MachineVariables, SaliencyIsWhatTheDriveStartsBy)
{
    EXPECT_EQ(number(machine("ipm_1000.yaml", {{"start_method", "2"}}), "salient"), 0);
    EXPECT_EQ(number(machine("estun_emj04apb22.yaml"), "salient"), 0);
    EXPECT_EQ(number(machine("estun_emj04apb22.yaml"), "round"), 1);
}

// The catalogue's motors bear their rated torque; R i of a gimbal motor and the EMF together are above what a lower link has:
// R i (s + drag) + omega psi = 0.95 x 0.98 v_dc / sqrt(3).
TEST(MachineVariables, ALoadIsWhatTheLinkLeaves)
{
    EXPECT_EQ(number(machine("estun_emj04apb22.yaml"), "bears"), 1);
    const double drag = (5e-3 + 1e-5 * 30) / 0.236;
    const double left = (0.95 * 0.98 * 16 / std::sqrt(3.0) - 330 * 14.3e-3) / (8.0 * 1.0) - drag;
    const auto gimbal = machine("gimbal_4108.yaml", {{"dclink.v_source_V", "16"}});
    EXPECT_NEAR(number(gimbal, "bears"), left, 0.011);
    EXPECT_NEAR(number(gimbal, "drag_rel"), drag, 1e-9);
}

// L_q told a tenth too low turns psi - L_q,told i out of the d-axis: on a machine that does not saturate.
TEST(MachineVariables, WhatIsToldWrongIsExpected)
{
    const Settings linear = {{"electrical.c_A_Wb5", "0"}, {"mtpa", "0"}};
    Settings told = linear;
    told.push_back({"L_q", "3.0773e-3"});
    told.push_back({"L_q_rated", "3.0e-3"});
    EXPECT_NEAR(number(machine("spm_400.yaml", told), "told_deg"),
                std::atan(0.1 * 3.0e-3 * 2.325 / (1.5 * 5 * 0.0776) / 0.0776) * 180 / 3.14159265358979, 0.05);
}

TEST(MachineVariables, AStartTurnsARotorWhosePoleSaturationDoesNotShow)
{
    EXPECT_EQ(number(machine("ipm_1000.yaml"), "start_turn_deg"), 5);
    EXPECT_EQ(number(machine("ipm_1000.yaml", {{"electrical.c_A_Wb5", "0"}}), "start_turn_deg"), 35);
    EXPECT_EQ(number(machine("ipm_1000.yaml", {{"start_method", "2"}}), "start_turn_deg"), 120);
}

// 4 T / (J w_s^2) is 0.3 of rated speed on the ramp.
TEST(MachineVariables, ALightRotorIsLoadedSlowly)
{
    const double w_s = 2 * 3.14159265358979 * 15;
    EXPECT_NEAR(number(machine("estun_emj04apb22.yaml"), "load_ramp_s"),
                4 * 1.268 / (3.1e-5 * w_s * w_s * 0.3 * 314.16), 1e-6);
    EXPECT_EQ(number(machine("estun_emj04apb22.yaml", {{"mechanics.J_kgm2", "1.0e-3"}}), "load_ramp_s"), 0);
}

TEST(MachineVariables, PaceFollowsTheSlowestOfTheDrivesRamps)
{
    EXPECT_NEAR(number(machine("ipm_1000.yaml", {{"acceleration", "20"}}), "pace"), 104.72 / 20 / 0.55, 1e-6);
    EXPECT_NEAR(number(machine("ipm_1000.yaml", {{"speed_bandwidth", "2"}}), "pace"), 2, 1e-9);
    const pmsim::Setup slow = machine("grin_all_axle.yaml", {{"open_loop_acceleration", "1"}});
    EXPECT_GT(number(slow, "pace"), 2 * number(machine("grin_all_axle.yaml"), "pace"));
}

} // namespace
