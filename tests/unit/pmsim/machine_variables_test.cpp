#include "tools/pmsim/machine_variables.h"

#include <gtest/gtest.h>

#include "tools/pmsim/machine_file.h"

namespace
{

using pmsim::machine_variables;
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
    EXPECT_EQ(v.at("pole_deg"), "120");
}

TEST(MachineVariables, SaliencyIsWhatTheDriveStartsBy)
{
    EXPECT_EQ(number(machine("ipm_1000.yaml", {{"start_method", "2"}}), "salient"), 0);
    EXPECT_EQ(number(machine("estun_emj04apb22.yaml"), "salient"), 0);
    EXPECT_EQ(number(machine("estun_emj04apb22.yaml"), "round"), 1);
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
