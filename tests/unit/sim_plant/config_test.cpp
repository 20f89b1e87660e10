// config.h through plant_create(): values without sense are refused by name.
#include "rig.h"

#include <gtest/gtest.h>

#include <cstring>
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
    {"dR_ohm", [](plant_config_t &c) { c.winding.dR_ohm[2] = -6.1; }},
    {"dR_ohm", [](plant_config_t &c) { c.winding.dR_ohm[5] = nan; }},
    {"dL_H", [](plant_config_t &c) { c.winding.dL_H[1] = nan; }},
    {"dM_H", [](plant_config_t &c) { c.winding.dM_H[1][2] = inf; }},
    {"emf_gain", [](plant_config_t &c) { c.winding.emf_gain[0] = nan; }},
    {"emf_shift_rad", [](plant_config_t &c) { c.winding.emf_shift_rad[4] = inf; }},
    {"winding.sets", [](plant_config_t &c) { c.winding.sets = 3; }},
    {"winding.sets", [](plant_config_t &c) { c.winding.sets = -1; }},
    {"connection must",
     [](plant_config_t &c) {
         const int neither = 2; // as a caller in C could write
         static_assert(sizeof neither == sizeof c.winding.connection);
         std::memcpy(&c.winding.connection, &neither, sizeof neither);
     }},
    {"connection open",
     [](plant_config_t &c) {
         c.winding.connection = PLANT_OPEN;
         c.winding.sets = 2;
         c.winding.L_0_H = 1e-3;
     }},
    {"L_0_H", [](plant_config_t &c) { c.winding.L_0_H = -1e-3; }},
    {"L_0_H", [](plant_config_t &c) { c.winding.connection = PLANT_OPEN; }},
    {"M_d_H", [](plant_config_t &c) { c.winding.M_d_H = nan; }},
    {"M_q_H", [](plant_config_t &c) { c.winding.M_q_H = inf; }},
    {"dL_0_H", [](plant_config_t &c) { c.winding.dL_0_H = nan; }},
    {"L_c0_H", [](plant_config_t &c) { c.winding.L_c0_H = nan; }},
    {"dL_0_d_1_A", [](plant_config_t &c) { c.winding.dL_0_d_1_A = nan; }},
    {"dL_0_q_1_A2", [](plant_config_t &c) { c.winding.dL_0_q_1_A2 = inf; }},
    {"L_c0_q_H_A", [](plant_config_t &c) { c.winding.L_c0_q_H_A = nan; }},
    {"are of a star",
     [](plant_config_t &c) {
         c.winding.connection = PLANT_OPEN;
         c.winding.L_0_H = 1e-3;
         c.winding.L_c0_q_H_A = 1e-6;
     }},
    {"winding.emf must", [](plant_config_t &c) { c.winding.emf[3] = {5, nan, 0.0}; }},
    {"winding.emf must", [](plant_config_t &c) { c.winding.emf[0] = {1001, 0.01, 0.0}; }},
    {"winding.saliency must", [](plant_config_t &c) { c.winding.saliency[0] = {4, 1e-3, 0.0}; }},
    {"winding.saliency must", [](plant_config_t &c) { c.winding.saliency[3] = {-2, 1e-3, 0.0}; }},
    {"winding.saliency must", [](plant_config_t &c) { c.winding.saliency[0] = {6, 1e-3, 0.0}; }},
    {"winding.saliency must", [](plant_config_t &c) { c.winding.saliency[0] = {1001, 1e-3, 0.0}; }},
    {"2, 5, 8, 11 ... and -1, -4, -7, -10 ...",
     [](plant_config_t &c) { c.winding.saliency[0] = {-6, 1e-3, 0.0}; }},
    {"winding.saliency must", [](plant_config_t &c) { c.winding.saliency[0] = {-4, 1e-3, nan}; }},
    {"winding.zero_saliency must", [](plant_config_t &c) { c.winding.zero_saliency[15] = {3, 1e-3, 0.0}; }},
    {"winding.zero_saliency must", [](plant_config_t &c) { c.winding.zero_saliency[0] = {8, inf, 0.0}; }},
    {"cogging must", [](plant_config_t &c) { c.winding.cogging[15] = {6, 0.1, inf}; }},
    {"L_eddy_d_H", [](plant_config_t &c) { c.winding.L_eddy_d_H = -0.1; }},
    {"L_eddy_q_H", [](plant_config_t &c) { c.winding.L_eddy_q_H = nan; }},
    {"R_eddy_ohm", [](plant_config_t &c) { c.winding.R_eddy_ohm = -1.0; }},
    {"winding.alpha", [](plant_config_t &c) { c.winding.alpha_R_1_K = nan; }},
    {"winding.alpha", [](plant_config_t &c) { c.winding.alpha_psi_1_K = inf; }},
    {"inductance is not positive", [](plant_config_t &c) { c.winding.dL_H[0] = -80e-3; }},
    {"inductance is not positive", [](plant_config_t &c) { c.winding.saliency[0] = {-4, 80e-3, 0.0}; }},
    {"inductance is not positive", // at 8.6 degrees, where no phase axis lies
     [](plant_config_t &c) { c.winding.saliency[0] = {23, 44e-3, 0.0}; }},
    {"inductance is not positive",
     [](plant_config_t &c) {
         c.winding.sets = 2;
         c.winding.M_d_H = -50e-3;
     }},
    {"inductance is not positive",
     [](plant_config_t &c) {
         c.winding.connection = PLANT_OPEN;
         c.winding.L_0_H = 1e-3;
         c.winding.dL_0_H = 20e-3;
     }},
    {"J_kgm2", [](plant_config_t &c) { c.mech.J_kgm2 = 0.0; }},
    {"J_kgm2", [](plant_config_t &c) { c.mech.J_kgm2 = -0.01; }},
    {"B_Nms", [](plant_config_t &c) { c.mech.B_Nms = nan; }},
    {"T_coulomb_Nm", [](plant_config_t &c) { c.mech.T_coulomb_Nm = -0.1; }},
    {"J_load_kgm2", [](plant_config_t &c) { c.mech.J_load_kgm2 = -1.0; }},
    {"k_shaft_Nm", [](plant_config_t &c) { c.mech.J_load_kgm2 = 0.01; }},
    {"k_shaft_Nm", [](plant_config_t &c) { c.mech.k_shaft_Nm = 100.0; }},
    {"d_shaft_Nms", [](plant_config_t &c) { c.mech.d_shaft_Nms = 0.1; }},
    {"d_shaft_Nms",
     [](plant_config_t &c) {
         c.mech.J_load_kgm2 = 0.01;
         c.mech.k_shaft_Nm = 100.0;
         c.mech.d_shaft_Nms = -0.1;
     }},
    {"load_Nms and load_Nms2", [](plant_config_t &c) { c.mech.load_Nms = nan; }},
    {"load_Nms and load_Nms2", [](plant_config_t &c) { c.mech.load_Nms2 = inf; }},
    {"load_angle", [](plant_config_t &c) { c.mech.load_angle[3] = {1, inf, 0.0}; }},
    {"load_angle", [](plant_config_t &c) { c.mech.load_angle[0] = {-1, 0.1, 0.0}; }},
    {"f_pwm_Hz", [](plant_config_t &c) { c.inverter.f_pwm_Hz = 0.0; }},
    {"dead_time_s must be finite", [](plant_config_t &c) { c.inverter.dead_time_s = -1e-6; }},
    {"dead_time_s must be less", [](plant_config_t &c) { c.inverter.dead_time_s = 60e-6; }},
    {"turn_on_s and turn_off_s", [](plant_config_t &c) { c.inverter.turn_on_s = -1e-9; }},
    {"turn_on_s and turn_off_s", [](plant_config_t &c) { c.inverter.turn_off_s = nan; }},
    {"turn_on_s with the dead time", [](plant_config_t &c) { c.inverter.turn_on_s = 49e-6; }},
    {"turn_off_s beyond dead time", [](plant_config_t &c) { c.inverter.turn_off_s = 2.1e-6; }},
    {"c_leg_F", [](plant_config_t &c) { c.inverter.c_leg_F = -1e-9; }},
    {"c_leg_F", [](plant_config_t &c) { c.inverter.c_leg_F = inf; }},
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
    {"c_F", [](plant_config_t &c) { c.dclink.c_F = inf; }},
    {"ripple_Hz must", [](plant_config_t &c) { c.dclink.ripple_V = nan; }},
    {"ripple_Hz must", [](plant_config_t &c) { c.dclink.ripple_V = 5.0; }},
    {"ripple_V needs",
     [](plant_config_t &c) {
         c.dclink.c_F = 0.0;
         c.dclink.ripple_V = 5.0;
         c.dclink.ripple_Hz = 100.0;
     }},
    {"r_chopper_ohm must", [](plant_config_t &c) { c.dclink.r_chopper_ohm = -1.0; }},
    {"r_chopper_ohm needs",
     [](plant_config_t &c) {
         c.dclink.c_F = 0.0;
         c.dclink.r_chopper_ohm = 10.0;
     }},
    {"v_chopper_on_V", [](plant_config_t &c) { c.dclink.r_chopper_ohm = 10.0; }},
    {"v_chopper_on_V",
     [](plant_config_t &c) {
         c.dclink.r_chopper_ohm = 10.0;
         c.dclink.v_chopper_on_V = 380.0;
         c.dclink.v_chopper_off_V = 390.0;
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
    {"sensor.shunt", [](plant_config_t &c) { c.sensor.shunt = static_cast<plant_shunt_t>(3); }},
    {"settle_s", [](plant_config_t &c) { c.sensor.settle_s = -1e-6; }},
    {"settle_s", [](plant_config_t &c) { c.sensor.settle_s = 100e-6; }},
    {"full scales", [](plant_config_t &c) { c.sensor.v_leg_full_scale_V = -1.0; }},
    {"full scales", [](plant_config_t &c) { c.sensor.t_full_scale_degC = nan; }},
    {"filter_s", [](plant_config_t &c) { c.sensor.filter_s = -1e-6; }},
    {"hysteresis_V", [](plant_config_t &c) { c.sensor.hysteresis_V = nan; }},
    {"capture_s", [](plant_config_t &c) { c.sensor.capture_s = inf; }},
    {"comparator_reference",
     [](plant_config_t &c) { c.sensor.comparator_reference = static_cast<plant_reference_t>(3); }},
    {"no neutral",
     [](plant_config_t &c) {
         c.sensor.comparator_reference = PLANT_REFERENCE_NEUTRAL;
         c.winding.connection = PLANT_OPEN;
         c.winding.L_0_H = 5e-3;
     }},
    {"i_dc_", [](plant_config_t &c) { c.sensor.i_dc_filter_s = -1e-6; }},
    {"i_dc_", [](plant_config_t &c) { c.sensor.i_dc_offset_A = nan; }},
    {"comparator_offset_V", [](plant_config_t &c) { c.sensor.comparator_offset_V[1] = inf; }},
    {"comparator_blanking_s", [](plant_config_t &c) { c.sensor.comparator_blanking_s = 100e-6; }},
    {"comparator_blanking_s", [](plant_config_t &c) { c.sensor.comparator_blanking_s = -1e-6; }},
    {"divider_error", [](plant_config_t &c) { c.sensor.divider_error[PLANT_LEGS] = -1.0; }},
    {"tolerance", [](plant_config_t &c) { c.tolerance = 0.02; }},
    {"tolerance", [](plant_config_t &c) { c.tolerance = -1e-6; }},
    {"tolerance", [](plant_config_t &c) { c.tolerance = nan; }},
};

INSTANTIATE_TEST_SUITE_P(Config, Refused, testing::ValuesIn(garbage));

// The same value makes sense beside others.
TEST(Config, RelatedValuesAreAcceptedTogether)
{
    plant_config_t config = rig::ipm_1000_real();
    config.machine.pole_pairs = 4;
    config.inverter.turn_on_s = 1e-6;
    config.inverter.turn_off_s = 3e-6; // just as late as the closing switch
    config.winding.connection = PLANT_OPEN;
    config.winding.L_0_H = 5e-3;
    config.winding.dR_ohm[5] = -6.0; // a phase may have none
    config.mech.J_load_kgm2 = 0.02;
    config.mech.k_shaft_Nm = 500.0;
    config.dclink.r_chopper_ohm = 20.0;
    config.dclink.v_chopper_on_V = 400.0;
    config.dclink.v_chopper_off_V = 390.0;
    const char *error = nullptr;
    plant_t *plant = plant_create(&config, 0.0, &error);
    EXPECT_NE(plant, nullptr) << error;
    plant_destroy(plant);
}

TEST(Config, ValidValuesAreAcceptedAndTheAngleMustBeFinite)
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
