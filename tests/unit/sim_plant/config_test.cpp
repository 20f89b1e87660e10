// config.h through plant_create(): values without sense are refused by name.
#include "rig.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

namespace
{

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

struct Garbage {
    const char *field; // that the message must name
    std::function<void(plant_config_t &)> spoil;
};

class Refused : public testing::TestWithParam<Garbage>
{
};

TEST_P(Refused, WithTheNameOfTheField)
{
    plant_config_t config = rig::ipm_1000_real();
    GetParam().spoil(config);
    const char *error = nullptr;
    EXPECT_EQ(plant_create(&config, 0.0, &error), nullptr);
    ASSERT_NE(error, nullptr);
    EXPECT_NE(std::string(error).find(GetParam().field), std::string::npos) << error;
}

const Garbage garbage[] = {
    {"R_s_ohm", [](plant_config_t &c) { c.machine.R_s_ohm = -1.0; }},
    {"R_s_ohm", [](plant_config_t &c) { c.machine.R_s_ohm = nan; }},
    {"L_d0_H", [](plant_config_t &c) { c.machine.L_d0_H = 0.0; }},
    {"L_q0_H", [](plant_config_t &c) { c.machine.L_q0_H = nan; }},
    {"L_q0_H", [](plant_config_t &c) { c.machine.L_q0_H = inf; }},
    {"c_A_Wb5", [](plant_config_t &c) { c.machine.c_A_Wb5 = -1.0; }},
    {"psi_m_Wb", [](plant_config_t &c) { c.machine.psi_m_Wb = -0.1; }},
    {"pole_pairs", [](plant_config_t &c) { c.machine.pole_pairs = 0; }},
    {"J_kgm2", [](plant_config_t &c) { c.mech.J_kgm2 = 0.0; }},
    {"J_kgm2", [](plant_config_t &c) { c.mech.J_kgm2 = -0.01; }},
    {"B_Nms", [](plant_config_t &c) { c.mech.B_Nms = nan; }},
    {"T_coulomb_Nm", [](plant_config_t &c) { c.mech.T_coulomb_Nm = -0.1; }},
    {"f_pwm_Hz", [](plant_config_t &c) { c.inverter.f_pwm_Hz = 0.0; }},
    {"dead_time_s", [](plant_config_t &c) { c.inverter.dead_time_s = -1e-6; }},
    {"dead_time_s", [](plant_config_t &c) { c.inverter.dead_time_s = 60e-6; }},
    {"v_switch_V", [](plant_config_t &c) { c.inverter.v_switch_V = nan; }},
    {"v_diode_V", [](plant_config_t &c) { c.inverter.v_diode_V = -0.5; }},
    {"r_on_ohm", [](plant_config_t &c) { c.inverter.r_on_ohm = inf; }},
    {"timer_counts", [](plant_config_t &c) { c.inverter.timer_counts = 0; }},
    {"v_source_V", [](plant_config_t &c) { c.dclink.v_source_V = -300.0; }},
    {"r_source_ohm", [](plant_config_t &c) { c.dclink.r_source_ohm = nan; }},
    {"r_source_ohm", [](plant_config_t &c) { c.dclink.r_source_ohm = 0.0; }},
    {"c_F", [](plant_config_t &c) { c.dclink.c_F = -1e-6; }},
    {"source_blocks",
     [](plant_config_t &c) {
         c.dclink.c_F = 0.0;
         c.dclink.source_blocks = true;
     }},
    {"bits", [](plant_config_t &c) { c.sensor.bits = 17; }},
    {"bits", [](plant_config_t &c) { c.sensor.bits = -1; }},
    {"i_full_scale_A", [](plant_config_t &c) { c.sensor.i_full_scale_A = 0.0; }},
    {"v_full_scale_V", [](plant_config_t &c) { c.sensor.v_full_scale_V = nan; }},
    {"noise_lsb", [](plant_config_t &c) { c.sensor.noise_lsb = -1.0; }},
    {"gain_error", [](plant_config_t &c) { c.sensor.gain_error[2] = nan; }},
    {"offset_A", [](plant_config_t &c) { c.sensor.offset_A[1] = inf; }},
    {"delay_s", [](plant_config_t &c) { c.sensor.delay_s = 100e-6; }},
    {"delay_s", [](plant_config_t &c) { c.sensor.delay_s = nan; }},
    {"tolerance", [](plant_config_t &c) { c.tolerance = -1e-6; }},
    {"tolerance", [](plant_config_t &c) { c.tolerance = nan; }},
};

INSTANTIATE_TEST_SUITE_P(Config, Refused, testing::ValuesIn(garbage));

TEST(Config, SoundValuesAreTakenAndTheAngleMustBeFinite)
{
    plant_config_t config = rig::ipm_1000_real();
    const char *error = "?";
    plant_t *plant = plant_create(&config, 1.0, &error);
    EXPECT_NE(plant, nullptr);
    EXPECT_EQ(error, nullptr);
    plant_destroy(plant);
    EXPECT_EQ(plant_create(&config, nan, &error), nullptr);
    EXPECT_EQ(plant_create(&config, nan, nullptr), nullptr); // a caller may not care why
}

} // namespace
