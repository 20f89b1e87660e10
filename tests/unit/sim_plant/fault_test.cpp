// Faults of switches, wires and windings through the plant, and bridges of six legs: currents against
// Kirchhoff and Ohm, and every energy booked.
#include "rig.h"
#include "step_length.h"

#include <gtest/gtest.h>

#include <cmath>

namespace
{

using rig::pi;

// Events and integration: 1e-6 of the scales of the converter and the link.
constexpr double closed_form = 1e-5;

double residual_J(const plant_truth_t &t)
{
    return t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J;
}

plant_config_t locked_spm()
{
    plant_config_t c = rig::spm_400_linear();
    c.mech.locked = true;
    return c;
}

constexpr double R = 0.373, L = 3.24e-3;

// Both switches of a leg in series across the link, beside what the motor draws.
TEST(SwitchFault, ShootThroughDrawsTheLinkOverBothSwitches)
{
    plant_config_t config = locked_spm();
    config.inverter = rig::inverter(10e3, 0.0, 0.0, 0.7, 0.05);
    rig::Plant plant(config);
    plant.run(rig::pwm(0, 0, 0), 3);
    plant_set_leg_fault(plant, 0, PLANT_UPPER_SHORT);
    plant_truth_t before = plant.truth();
    EXPECT_NEAR(before.i_dc_A, 36.0 / 0.1, 1e-6);
    plant.run(rig::pwm(0, 0, 0));
    plant_truth_t after = plant.truth();
    // the midpoint of the two lies at half the link, behind half of r_on: it drives A against B and C
    EXPECT_NEAR(before.v_leg_V[0], 18.0, 1e-9);
    double i_A = 12.0 / (R + 0.05) * -std::expm1(-(R + 0.05) / L * 1e-4);
    EXPECT_NEAR(after.i_A[0], i_A, 0.01 * i_A); // A's own resistance is r_on/2, not r_on
    double through_J = 36.0 * 36.0 / 0.1 * 1e-4;
    EXPECT_NEAR(after.e_device_J - before.e_device_J, through_J, 1e-3 * through_J);
    EXPECT_NEAR(residual_J(after), residual_J(before), 1e-6 * through_J);
}

// A leg that shorts the link discharges its capacitor through both switches, at whatever rate:
//   v = v_end + (v_start - v_end) e^{-t/tau},   tau = C / (g_source + g_through)
// The winding is left out: its time constant is 8 ms, and it never has more than 2 % of the current.
struct Through {
    double r_on_ohm, C_F, r_source_ohm;
};

class ShootThrough : public testing::TestWithParam<Through>
{
};

TEST_P(ShootThrough, DischargesTheLinkAsAnRCDoes)
{
    constexpr double period_s = 1e-4, V = 36.0;
    const Through p = GetParam();
    plant_config_t config = locked_spm();
    config.inverter = rig::inverter(10e3, 0.0, 0.0, 0.0, p.r_on_ohm);
    config.dclink = rig::dclink(V, p.r_source_ohm, p.C_F);
    rig::Plant plant(config);
    plant.run(rig::pwm(0, 0, 0), 3);
    plant_set_leg_fault(plant, 2, PLANT_UPPER_SHORT);
    plant_truth_t before = plant.truth();
    double through_S = 0.5 / std::fmax(p.r_on_ohm, 1e-3), source_S = 1.0 / p.r_source_ohm; // 1 mOhm at least
    double tau_s = p.C_F / (through_S + source_S), end_V = V * source_S / (through_S + source_S);
    auto link_V = [&](double t_s) { return end_V + (V - end_V) * std::exp(-t_s / tau_s); };
    double early_s = 0.7 * tau_s; // of a single step tau_s long their error estimate is zero
    EXPECT_NEAR(plant.at(early_s).v_dc_V, link_V(early_s), 1e-3 * V);
    plant.run(rig::pwm(0, 0, 0));
    plant_truth_t after = plant.truth();
    EXPECT_NEAR(after.v_dc_V, link_V(period_s), 1e-3 * V);
    double a_V = V - end_V, left = std::exp(-period_s / tau_s);
    double heat_J = through_S * (end_V * end_V * period_s + 2.0 * end_V * a_V * tau_s * (1.0 - left) +
                                 0.5 * a_V * a_V * tau_s * (1.0 - left * left));
    EXPECT_NEAR(after.e_device_J - before.e_device_J, heat_J, 2e-3 * heat_J);
    EXPECT_NEAR(residual_J(after), residual_J(before), 1e-6 * heat_J);
    plant.run(rig::pwm(0, 0, 0), 5);
    EXPECT_NEAR(plant.truth().v_dc_V, end_V, 2e-3 * V);
    EXPECT_LT(std::fabs(plant.truth().i_A[2]), 0.5 * V / (1.5 * R)) << "what half the link drives at most";
}

INSTANTIATE_TEST_SUITE_P(Links, ShootThrough,
                         testing::Values(Through{0.0, 47e-6, 0.1}, Through{0.0, 4.7e-6, 0.5},
                                         Through{0.0, 1e-6, 0.1}, Through{0.0, 1e-3, 0.01},
                                         Through{2e-3, 47e-6, 0.1}, Through{5e-3, 10e-6, 0.1},
                                         Through{0.05, 100e-6, 0.1}));

TEST(SwitchFault, ShortedSwitchHoldsItsRail)
{
    rig::Plant plant(locked_spm());
    plant.run(rig::all_off(), 2);
    plant_set_leg_fault(plant, 1, PLANT_UPPER_SHORT);
    plant.run(rig::all_off(), 2);
    EXPECT_NEAR(plant.truth().v_leg_V[1], 36.0, 1e-9);
    plant_set_leg_fault(plant, 1, PLANT_HEALTHY);
    plant.run(rig::all_off(), 2);
    EXPECT_NEAR(plant.truth().v_leg_V[1], 18.0, 1e-9) << "and lets go of it when it is well again";
}

// An upper switch that does not close: its half of the period belongs to the lower diode while current flows
// out of the leg.
TEST(SwitchFault, OpenSwitchLeavesTheDiode)
{
    plant_config_t config = locked_spm();
    rig::Plant plant(config);
    plant.run(rig::pwm(0.6, 0.4, 0.4), 300);
    ASSERT_GT(plant.truth().i_A[0], 1.0);
    plant_set_leg_fault(plant, 0, PLANT_UPPER_OPEN);
    plant_truth_t middle = plant.at(50e-6); // the upper switch is commanded
    EXPECT_GT(middle.i_A[0], 0.5);
    EXPECT_NEAR(middle.v_leg_V[0], 0.0, 1e-9);
    plant.run(rig::pwm(0.6, 0.4, 0.4), 300);
    plant_truth_t t = plant.truth();
    EXPECT_LT(t.i_A[0], 1e-6) << "no current out of a leg that cannot rise";
    EXPECT_NEAR(residual_J(t), 0.0, 1e-6 * t.e_in_J);
}

TEST(WireFault, StopsTheCurrentAndBooksItsEnergy)
{
    plant_config_t config = locked_spm();
    rig::Plant plant(config);
    plant.run(rig::pwm(0.55, 0.48, 0.44), 1000);
    plant_truth_t a = plant.truth();
    ASSERT_GT(a.i_A[0], 1.0);
    plant_set_leg_fault(plant, 0, PLANT_WIRE_OPEN);
    plant_truth_t b = plant.truth();
    // what is left is the current from B to C whose flux the coils of B and C keep: i_B - i_C
    double i_BC = 0.5 * (a.i_A[1] - a.i_A[2]);
    EXPECT_EQ(b.i_A[0], 0.0);
    EXPECT_NEAR(b.i_A[1], i_BC, 1e-9);
    EXPECT_NEAR(b.i_A[2], -i_BC, 1e-9);
    double lost_J = 0.5 * L * 1.5 * a.i_A[0] * a.i_A[0]; // 3/2 L per amplitude along A
    EXPECT_NEAR(b.e_device_J - a.e_device_J, lost_J, 1e-9 * lost_J + 1e-12);
    EXPECT_NEAR(residual_J(b), residual_J(a), 1e-12);
    plant.run(rig::pwm(0.55, 0.48, 0.44), 1000);
    plant_truth_t c = plant.truth();
    EXPECT_EQ(c.i_A[0], 0.0);
    EXPECT_NEAR(c.i_A[1], 36.0 * 0.04 / (2 * R), 5e-3);
    plant_set_leg_fault(plant, 0, PLANT_HEALTHY);
    plant.run(rig::pwm(0.55, 0.48, 0.44), 1000);
    EXPECT_NEAR(plant.truth().i_A[0], a.i_A[0], 1e-4);
}

// A motor with a terminal off shows its EMF there, however far beyond the rails: there are no diodes.
TEST(WireFault, TerminalHasNoDiodes)
{
    plant_config_t config = rig::spm_400_linear();
    rig::Plant plant(config, 0.4);
    plant_set_speed(plant, 120.0);
    plant_set_leg_fault(plant, 2, PLANT_WIRE_OPEN);
    plant.run(rig::pwm(0, 0, 0)); // all off, so far
    bool beyond = false;
    for (int k = 0; k < 200; k++) {
        plant.run(rig::pwm(0, 0, 0));
        plant_truth_t t = plant.truth();
        ASSERT_EQ(t.i_A[2], 0.0);
        double e_C = -120.0 * 5 * 77.6e-3 * std::sin(t.theta_e_rad + 2 * pi / 3);
        ASSERT_NEAR(t.v_leg_V[2], 1.5 * e_C, 1e-6);
        beyond = beyond || t.v_leg_V[2] < -10.0;
    }
    EXPECT_TRUE(beyond);
}

TEST(Short, BetweenPhasesCarriesWhatOhmAsks)
{
    plant_config_t config = locked_spm();
    rig::Plant plant(config);
    plant_set_short(plant, 0, 1, 20.0);
    plant.run(rig::pwm(1, 0, 0), 3000);
    plant_truth_t t = plant.truth();
    double winding_A = 24.0 / R, short_A = 36.0 / 20.0;
    EXPECT_NEAR(t.i_A[0], winding_A + short_A, closed_form * winding_A);
    EXPECT_NEAR(t.i_A[1], -0.5 * winding_A - short_A, closed_form * winding_A);
    EXPECT_NEAR(t.i_A[2], -0.5 * winding_A, closed_form * winding_A);
    EXPECT_NEAR(t.i_dc_A, t.i_A[0], 1e-9 * winding_A);
    EXPECT_NEAR(residual_J(t), 0.0, 1e-6 * t.e_in_J);
    plant_set_short(plant, 0, 1, -1.0);
    EXPECT_NEAR(plant.truth().i_A[0], winding_A, closed_form * winding_A);
    EXPECT_NEAR(residual_J(plant.truth()), residual_J(t), 1e-9 * t.e_in_J);
    plant.run(rig::pwm(1, 0, 0), 10);
    EXPECT_NEAR(plant.truth().i_A[1], -0.5 * winding_A, closed_form * winding_A);
}

// A floating terminal on the negative rail through a resistor: in series with the winding.
TEST(Short, ToTheRailGivesAFloatingLegAPath)
{
    plant_config_t config = locked_spm();
    rig::Plant plant(config);
    plant_set_short(plant, 0, -1, 5.0);
    plant_pwm_t pwm = rig::pwm(0, 1, 0);
    pwm.driven[0] = pwm.driven[2] = false;
    plant.run(pwm, 3000);
    plant_truth_t t = plant.truth();
    double i = 36.0 / (2 * R + 5.0);
    EXPECT_NEAR(t.i_A[1], i, closed_form * i);
    EXPECT_EQ(t.i_A[0], 0.0) << "not through the leg";
    EXPECT_EQ(t.i_A[2], 0.0);
    EXPECT_NEAR(t.v_leg_V[0], 5.0 * i, closed_form * 36.0);
    EXPECT_NEAR(t.v_leg_V[2], 36.0 - R * i, closed_form * 36.0);
    EXPECT_NEAR(residual_J(t), 0.0, 1e-6 * t.e_in_J);
}

TEST(Short, ToTheRailBesideADrivenLeg)
{
    plant_config_t config = locked_spm();
    rig::Plant plant(config);
    plant_set_short(plant, 0, -1, 12.0);
    plant.run(rig::pwm(1, 1, 1), 3);
    EXPECT_NEAR(plant.truth().i_A[0], 3.0, closed_form * 3.0);
    EXPECT_NEAR(plant.truth().i_A[1], 0.0, 1e-9);
}

// Output capacitances would ring with the 1 uH of a short at 10 MHz, for 200 us and longer: steps of some ns. The
// steps must be those of the rest, of which the fastest is the third terminal, 140 kHz with its winding.
constexpr double shortest_step_s = 0.1e-6;
constexpr double c_leg_F = 0.5e-9;

plant_config_t with_capacitances()
{
    plant_config_t c = rig::spm_400_linear();
    c.inverter = rig::inverter(10e3, 1e-6, 0.7, 0.7, 0.0);
    c.inverter.c_leg_F = c_leg_F;
    return c;
}

// Terminals A and B joined and the inverter off: the EMF between them drives
//   i = e_AB / (2 (R + j w L) + R_short),   e_AB = sqrt(3) w psi_m
TEST(Short, OfLegsThatSwingCarriesTheCurrentOfTheEmf)
{
    constexpr double omega_e = 2.0 * pi * 40.0, short_ohm = 0.01;
    rig::Plant plant(with_capacitances());
    plant_set_speed(plant, omega_e / 5.0);
    plant.run(rig::all_off(), 20);
    plant_truth_t before = plant.truth();
    plant_set_short(plant, 0, 1, short_ohm);
    EXPECT_NEAR(residual_J(plant.truth()), residual_J(before), 1e-12);
    plant.run(rig::all_off(), 800); // 9 time constants
    double most_A = 0.0;
    for (int n = 0; n < 250; n++) {
        plant.run(rig::all_off());
        plant_truth_t t = plant.truth();
        EXPECT_NEAR(t.i_A[0], 0.0, 1e-4) << "in winding and short, not in the leg";
        EXPECT_NEAR(t.v_leg_V[0], t.v_leg_V[1], 1.0);
        most_A = std::fmax(most_A, std::sqrt(0.75) * std::hypot(t.i_d_A, t.i_q_A)); // i_a = -i_b, i_c = 0
        ASSERT_GT(step_length_s(plant), shortest_step_s);
    }
    double i_A = std::sqrt(3.0) * omega_e * 77.6e-3 / std::hypot(2.0 * R + short_ohm, 2.0 * omega_e * L);
    EXPECT_NEAR(most_A, i_A, 1e-3 * i_A);
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(residual_J(t), residual_J(before), 1e-5 * t.e_copper_J);
    plant_set_short(plant, 0, 1, -1.0);
    EXPECT_NEAR(residual_J(plant.truth()), residual_J(t), 1e-9 * t.e_copper_J + 1e-12);
    plant.run(rig::all_off(), 80); // against link and EMF
    for (int k = 0; k < 3; k++) {
        EXPECT_NEAR(plant.truth().i_A[k], 0.0, 0.1) << "what its own capacitance takes";
    }
}

// Link and short while A is up and B down, beside the current of the winding, which hardly moves:
//   C dv/dt = (V - v) / r_source - i - i_winding
//   L di/dt = v - R i
TEST(Short, EmptiesTheLinkAndIsSwitchedOff)
{
    constexpr double V = 36.0, short_ohm = 0.01, short_H = 1e-6, C_F = 47e-6, r_source_ohm = 0.1;
    plant_config_t config = with_capacitances();
    config.mech.locked = true;
    config.dclink = rig::dclink(V, r_source_ohm, C_F);
    rig::Plant plant(config);
    plant.run(rig::pwm(1, 0, 0), 3);
    plant_truth_t before = plant.truth();
    plant_set_short(plant, 0, 1, short_ohm);
    double v = before.v_dc_V, i = 0.0, i_winding_A = before.i_A[0], drops_V = 2.0 * 0.7;
    for (int us = 1; us <= 9; us++) {
        for (int n = 0; n < 10000; n++) { // the middle of steps of 0.1 ns
            double v_mid = v + 0.05e-9 / C_F * ((V - v) / r_source_ohm - i - i_winding_A);
            double i_mid = i + 0.05e-9 / short_H * (v - drops_V - short_ohm * i);
            v += 0.1e-9 / C_F * ((V - v_mid) / r_source_ohm - i_mid - i_winding_A);
            i += 0.1e-9 / short_H * (v_mid - drops_V - short_ohm * i_mid);
        }
        plant_truth_t t = plant.at(us * 1e-6);
        EXPECT_NEAR(t.v_dc_V, v, 2e-3 * V);
        EXPECT_NEAR(t.i_A[0], i + i_winding_A, 2e-3 * 250.0);
    }
    EXPECT_GT(i, 150.0);
    EXPECT_LT(v, 0.6 * V);
    plant.run(rig::pwm(0.9, 0.1, 0.5), 20); // and chops it
    plant_trip(plant);
    for (int n = 0; n < 50; n++) {
        plant.run(rig::all_off());
        ASSERT_GT(step_length_s(plant), shortest_step_s);
    }
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(residual_J(t), residual_J(before), 1e-5 * t.e_in_J);
    EXPECT_NEAR(t.v_dc_V, V, 1e-3 * V);
    for (int k = 0; k < 3; k++) {
        EXPECT_NEAR(t.i_A[k], 0.0, 0.1);
    }
}

plant_pwm_t six(const double (&duty)[6])
{
    plant_pwm_t p{};
    for (int k = 0; k < 6; k++) {
        p.compare[k][0] = p.compare[k][1] = static_cast<uint32_t>(std::lround(duty[k] * rig::counts));
        p.driven[k] = true;
    }
    return p;
}

TEST(SixLegs, TwoSetsHaveTheirOwnStars)
{
    plant_config_t config = locked_spm();
    config.winding.sets = 2;
    rig::Plant plant(config);
    plant.run(six({1, 0, 0, 0, 1, 1}), 2000);
    plant_truth_t t = plant.truth();
    const double expected[] = {24.0, -12.0, -12.0, -24.0, 12.0, 12.0};
    for (int k = 0; k < 6; k++) {
        EXPECT_NEAR(t.i_A[k], expected[k] / R, closed_form * 24.0 / R) << k;
    }
    EXPECT_NEAR(t.v_neutral_V[0], 12.0, 1e-6);
    EXPECT_NEAR(t.v_neutral_V[1], 24.0, 1e-6);
    EXPECT_NEAR(t.i_dc_A, 48.0 / R, closed_form * 48.0 / R);
    EXPECT_NEAR(residual_J(t), 0.0, 1e-6 * t.e_in_J);
}

// Each phase between two legs of its own: also what is common to all three drives current.
TEST(SixLegs, OpenWindingHasThreeFreeCurrents)
{
    plant_config_t config = locked_spm();
    config.winding.connection = PLANT_OPEN;
    config.winding.L_0_H = 0.4e-3;
    rig::Plant plant(config);
    plant.run(six({1, 1, 1, 0, 1, 0}), 2000);
    plant_truth_t t = plant.truth();
    const double expected[] = {36.0, 0.0, 36.0};
    for (int k = 0; k < 3; k++) {
        EXPECT_NEAR(t.i_A[k], expected[k] / R, closed_form * 36.0 / R) << k;
        EXPECT_NEAR(t.i_A[k + 3], -expected[k] / R, closed_form * 36.0 / R) << k;
    }
    EXPECT_NEAR(t.i_zero_A, 24.0 / R, closed_form * 36.0 / R);
    EXPECT_NEAR(residual_J(t), 0.0, 1e-6 * t.e_in_J);
}

// L_0 alone limits what a common voltage drives.
TEST(SixLegs, ZeroSequenceRisesWithItsOwnInductance)
{
    plant_config_t config = locked_spm();
    config.winding.connection = PLANT_OPEN;
    config.winding.L_0_H = 0.4e-3;
    rig::Plant plant(config);
    plant.run(six({1, 1, 1, 0, 0, 0}));
    plant_run_period(plant);
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(t.i_zero_A, 36.0 / R * -std::expm1(-R / 0.4e-3 * 1e-4), closed_form * 36.0 / R);
    EXPECT_NEAR(t.i_d_A, 0.0, 1e-9);
    EXPECT_NEAR(t.torque_Nm, 0.0, 1e-9);
}

// A phase of an open winding whose legs are both off, while the others go on.
TEST(SixLegs, OnePhaseOfAnOpenWindingCanFloat)
{
    plant_config_t config = rig::spm_400_linear();
    config.winding.connection = PLANT_OPEN;
    config.winding.L_0_H = 1e-3;
    rig::Plant plant(config, 0.3);
    plant_set_speed(plant, 20.0);
    plant_pwm_t pwm = six({0.7, 0.5, 0.4, 0.4, 0.5, 0.6});
    pwm.driven[1] = pwm.driven[4] = false;
    plant.run(pwm, 500);
    plant_truth_t t = plant.truth();
    EXPECT_EQ(t.i_A[1], 0.0);
    EXPECT_EQ(t.i_A[4], 0.0);
    EXPECT_GT(std::fabs(t.i_A[0]), 1.0);
    EXPECT_NEAR(t.i_A[0], -t.i_A[3], 1e-9);
    EXPECT_NEAR(t.v_leg_V[1] + t.v_leg_V[4], 36.0, 1e-9) << "centred";
    EXPECT_NEAR(residual_J(t), 0.0, 1e-6 * t.e_in_J);
}

} // namespace
