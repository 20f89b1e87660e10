// The plant against independent machines: linear, saturating, with every effect of the windings, two sets,
// open winding.
#include "beside_reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace validation
{
namespace
{

// Everything that a real winding has beyond the ideal one: E3, E4, E5, cogging.
void add_all_effects(plant_config_t &c)
{
    double L_H = c.machine.L_d0_H;
    double psi_Wb = c.machine.psi_m_Wb;
    plant_winding_t &w = c.winding;
    w.L_0_H = 0.5 * L_H;
    w.dL_0_H = 0.04 * L_H;
    w.L_c0_H = 0.01 * L_H;
    w.emf[0] = {3, 0.03 * psi_Wb, 0.1};
    w.emf[1] = {5, 0.02 * psi_Wb, -0.2};
    w.emf[2] = {7, 0.01 * psi_Wb, 0.3};
    w.saliency[0] = {-4, 0.03 * L_H, 0.4};
    w.saliency[1] = {8, 0.02 * L_H, -0.5};
    w.zero_saliency[0] = {-4, 0.05 * L_H, -0.7};
    w.zero_saliency[1] = {5, 0.02 * L_H, 0.8};
    w.cogging[0] = {6, 0.05, 0.6};
    for (int k = 0; k < PLANT_LEGS; k++) {
        double unlike = 0.01 * (k * k % 5 - 2);
        w.dR_ohm[k] = 3.0 * unlike * c.machine.R_s_ohm;
        w.dL_H[k] = unlike * L_H;
        w.dM_H[k / 3][k % 3] = -0.5 * unlike * L_H;
        w.emf_gain[k] = unlike;
        w.emf_shift_rad[k] = -0.7 * unlike;
    }
}

class Ode : public ::testing::TestWithParam<Speed>
{
};
INSTANTIATE_TEST_SUITE_P(Speeds, Ode, ::testing::Values(Speed::imposed, Speed::free),
                         [](const auto &speed) { return std::string(name(speed.param)); });

TEST_P(Ode, LinearMachineInPhaseCoordinates)
{
    report(std::string("ode_linear_") + name(GetParam()), in_phases(ipm_linear(), ipm_rated_A, GetParam()),
           ipm_rated_A, "0.1");
}

TEST_P(Ode, LinearMachineWithAllWindingEffects)
{
    plant_config_t config = ipm_linear();
    add_all_effects(config);
    report(std::string("ode_effects_") + name(GetParam()), in_phases(config, ipm_rated_A, GetParam()),
           ipm_rated_A, "E3 E4 E5 E15");
}

TEST_P(Ode, EnergyFormInRotorFrame)
{
    plant_config_t config = ipm_saturating();
    report(std::string("ode_energy_form_") + name(GetParam()),
           in_dq(config, energy_form(config.machine), config.machine.psi_m_Wb, GetParam()), ipm_rated_A,
           "E1 E2");
}

TEST_P(Ode, EnergyFormWithAllWindingEffects)
{
    plant_config_t config = ipm_saturating();
    add_all_effects(config);
    report(std::string("ode_energy_form_effects_") + name(GetParam()),
           in_phases(config, ipm_rated_A, GetParam(), reference::inverse(energy_form(config.machine))),
           ipm_rated_A, "E1 to E5 E15");
}

TEST_P(Ode, EnergyFormWithEddyLoop)
{
    plant_config_t config = ipm_saturating();
    config.winding.L_eddy_d_H = 0.2;
    config.winding.L_eddy_q_H = 0.3;
    config.winding.R_eddy_ohm = 150.0;
    report(std::string("ode_eddy_") + name(GetParam()),
           in_dq(config, energy_form(config.machine), config.machine.psi_m_Wb, GetParam()), ipm_rated_A,
           "E19");
}

// Two sets with all that there is: saturation, eddy loops, mutual inductance, asymmetry, harmonics.
TEST_P(Ode, TwoSetsWithEverything)
{
    plant_config_t config = dtp_linear(0.3);
    config.machine.c_A_Wb5 = 2.7e5;
    add_all_effects(config);
    config.winding.L_eddy_d_H = 15e-3;
    config.winding.L_eddy_q_H = 20e-3;
    config.winding.R_eddy_ohm = 12.0;
    report(std::string("ode_two_sets_everything_") + name(GetParam()),
           in_phases(config, 4.0, GetParam(), reference::inverse(energy_form(config.machine))), 4.0,
           "E1 to E5 E15 E16 E19");
}

TEST_P(Ode, TwoSetsAgainstSixPhases)
{
    for (double mutual : {0.0, 0.3, 0.7}) {
        plant_config_t config = dtp_linear(mutual);
        report("ode_two_sets_M" + std::to_string(std::lround(10 * mutual)) + "_" + name(GetParam()),
               in_phases(config, 4.0, GetParam()), 4.0, "7.2.1.1");
    }
}

TEST_P(Ode, TwoSetsWithAllWindingEffects)
{
    plant_config_t config = dtp_linear(0.3);
    add_all_effects(config);
    report(std::string("ode_two_sets_effects_") + name(GetParam()), in_phases(config, 4.0, GetParam()), 4.0,
           "E3 E4 E5 E16");
}

TEST_P(Ode, TwoSaturatingSets)
{
    plant_config_t config = dtp_linear(0.3);
    config.machine.c_A_Wb5 = 2.7e5;
    report(std::string("ode_two_sets_saturating_") + name(GetParam()),
           in_phases(config, 4.0, GetParam(), reference::inverse(energy_form(config.machine))), 4.0,
           "E1 E16");
}

TEST_P(Ode, OpenWinding)
{
    plant_config_t config = open_winding();
    report(std::string("ode_open_") + name(GetParam()), in_phases(config, 4.0, GetParam()), 4.0, "7.3.1");
    add_all_effects(config);
    report(std::string("ode_open_effects_") + name(GetParam()), in_phases(config, 4.0, GetParam()), 4.0,
           "E3 E4 E5 E17");
}

// Halving the tolerance must not move a figure by more than a tenth of its bound.
TEST_P(Ode, IndependentOfTolerance)
{
    plant_config_t config = ipm_saturating();
    double current[2], angle[2];
    for (int k = 0; k < 2; k++) {
        config.tolerance = k == 0 ? 1e-6 : 0.5e-6;
        Deviation d = in_dq(config, energy_form(config.machine), config.machine.psi_m_Wb, GetParam());
        current[k] = d.current_A / ipm_rated_A;
        angle[k] = d.angle_rad;
    }
    reference::measured(std::string("tolerance_current_") + name(GetParam()),
                        std::fabs(current[1] - current[0]), 0.1 * bound_current, "of_rated", "step size");
    reference::measured(std::string("tolerance_angle_") + name(GetParam()), std::fabs(angle[1] - angle[0]),
                        0.1 * bound_angle_rad, "rad", "step size");
}

} // namespace
} // namespace validation
