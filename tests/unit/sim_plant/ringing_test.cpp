// Losses across the windings damp a floating leg with output capacitance: against the parallel RLC circuit.
#include "rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace
{

constexpr double L = 25e-6, C = 2e-9, V = 24.0; // BLDC-HS, 580 kHz
constexpr double L_leg = 1.5 * L;               // of a leg against the two others
constexpr double r_winding = 280.0, R_leg = 1.5 * r_winding;
constexpr double terminal_V = 1e-4 * V;      // some twenty steps a period to 1e-6 of the link each
constexpr double balance = 1e-4;             // of what the capacitance takes
constexpr double long_terminal_V = 1e-5 * V; // after 11 swings
constexpr double long_balance = 2e-4;

plant_config_t bldc_hs(double r_winding_ohm)
{
    plant_config_t c{};
    c.machine = {0.0, L, L, 0.0, 1.25e-3, 1};
    c.mech.J_kgm2 = 2e-6;
    c.mech.locked = true;
    c.inverter = rig::inverter(40e3, 0.0, 0.0, 0.5, 0.0);
    c.inverter.c_leg_F = C;
    c.dclink = rig::dclink(V);
    c.sensor.i_full_scale_A = 40.0;
    c.sensor.v_full_scale_V = 40.0;
    c.winding.r_winding_ohm = r_winding_ohm;
    return c;
}

// A to the upper rail and B to the lower one, C released at 0 V without current: it swings about V/2.
plant_pwm_t step()
{
    plant_pwm_t pwm = rig::pwm(1.0, 0.0, 0.0);
    pwm.driven[2] = false;
    return pwm;
}

double swing_V(double t_s, double conductance_S)
{
    double alpha = 0.5 * conductance_S / C;
    double omega = std::sqrt(1.0 / (L_leg * C) - alpha * alpha);
    return 0.5 * V *
           (1.0 - std::exp(-alpha * t_s) * (std::cos(omega * t_s) - alpha / omega * std::sin(omega * t_s)));
}

void expect_swing(const plant_config_t &config, double conductance_S)
{
    rig::Plant plant(config);
    plant.run(step());
    double lowest_V = V, highest_V = 0.0;
    for (int n = 1; n <= 40; n++) { // 4 us, 2.3 periods
        plant_truth_t t = plant.at(n * 0.1e-6);
        EXPECT_NEAR(t.v_leg_V[2], swing_V(n * 0.1e-6, conductance_S), terminal_V) << n;
        lowest_V = std::fmin(lowest_V, n > 9 ? t.v_leg_V[2] : V); // behind the first peak
        highest_V = std::fmax(highest_V, t.v_leg_V[2]);
        double residual_J = t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J;
        EXPECT_NEAR(residual_J, 0.0, balance * C * V * V) << n;
    }
    EXPECT_EQ(highest_V > 0.95 * V, conductance_S == 0.0);
    EXPECT_EQ(lowest_V < 0.05 * V, conductance_S == 0.0);
}

// Where nobody looks in between, a step of the series is a quarter of a swing: the same circuit, and as well balanced. Losses go
// with the square of the swing, at twice its frequency.
TEST(Ringing, InLongSteps)
{
    for (double conductance_S : {1.0 / R_leg, 0.0}) {
        rig::Plant plant(bldc_hs(conductance_S > 0.0 ? r_winding : 0.0));
        plant.run(step());
        for (int n = 1; n <= 20; n++) {
            plant_truth_t t = plant.at(n * 1e-6);
            EXPECT_NEAR(t.v_leg_V[2], swing_V(n * 1e-6, conductance_S), long_terminal_V) << n;
            double residual_J = t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J;
            EXPECT_NEAR(residual_J, 0.0, long_balance * C * V * V) << n;
        }
    }
}

// At 80,000 r/min, with a saliency of 10 %, the EMF and the inductance of the leg move during a swing: against the general way.
TEST(Ringing, OfATurningRotor)
{
    plant_config_t config = bldc_hs(r_winding);
    config.machine.L_q0_H = 1.1 * L;
    config.mech.locked = false;
    rig::Plant series(config);
    config.winding.dR_ohm[0] = 1e-12;
    rig::Plant general(config);
    plant_set_speed(series, 8377.6);
    plant_set_speed(general, 8377.6);
    series.run(step());
    general.run(step());
    for (int n = 1; n <= 20; n++) {
        EXPECT_NEAR(series.at(n * 1e-6).v_leg_V[2], general.at(n * 1e-6).v_leg_V[2], terminal_V) << n;
    }
}

TEST(Ringing, FollowsTheRlcCircuit)
{
    double Q = R_leg * std::sqrt(C / L_leg);
    ASSERT_NEAR(Q, 3.0, 0.1);
    expect_swing(bldc_hs(r_winding), 1.0 / R_leg);
}

TEST(Ringing, GoesOnWithoutLosses)
{
    expect_swing(bldc_hs(0.0), 0.0);
}

// By the general way, which unlike phases take.
TEST(Ringing, OfUnlikePhases)
{
    plant_config_t config = bldc_hs(r_winding);
    config.winding.dR_ohm[0] = 1e-12;
    expect_swing(config, 1.0 / R_leg);
}

// What is left after a period of the PWM is the voltage of an inductive divider, and the loss that of the
// resistors: 1.5 |v|^2 / r_winding, |v| = 2/3 V for A against B with C between them: v_A - mean = V/2.
TEST(Ringing, SettlesAndHeats)
{
    plant_config_t config = bldc_hs(r_winding);
    rig::Plant plant(config);
    plant.run(step(), 2);
    plant_truth_t a = plant.truth();
    EXPECT_NEAR(a.v_leg_V[2], 0.5 * V, 1e-3 * V);
    plant.run(step());
    plant_truth_t b = plant.truth();
    double loss_J = 2.0 * 0.25 * V * V / r_winding * plant.period_s();
    EXPECT_NEAR(b.e_copper_J - a.e_copper_J, loss_J, 1e-4 * loss_J);
}

TEST(Ringing, NeedsOutputCapacitance)
{
    plant_config_t config = bldc_hs(r_winding);
    config.inverter.c_leg_F = 0.0;
    EXPECT_THROW(rig::Plant plant(config), std::invalid_argument);
}

} // namespace
