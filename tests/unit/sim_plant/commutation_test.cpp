// E7 through the plant: a leg with output capacitance commutates at the pace of its current.
#include "rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace
{

using rig::pi;

constexpr double R = 0.373, L = 3.24e-3, V = 36.0;
constexpr double L_leg = 1.5 * L; // of a leg against the two others
// The integrator keeps terminals to 1e-6 of the link, and lands 1e-4 of it short of a diode.
constexpr double terminal_V = 2e-3;

double residual_J(const plant_truth_t &t)
{
    return t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J;
}

// Lossless but for the winding; A carries the current, B and C return it.
plant_config_t capacitive(double c_leg_F, double dead_time_s)
{
    plant_config_t c = rig::spm_400_linear();
    c.mech.locked = true;
    c.inverter = rig::inverter(10e3, dead_time_s, 0.0, 0.0, 0.0);
    c.inverter.c_leg_F = c_leg_F;
    return c;
}

// A falls at 80 us, B and C stay at half the duty of a period that ends at 75 us
plant_pwm_t with_current(double amperes)
{
    double v = 1.5 * R * amperes / V; // of A against B and C
    return rig::pwm(0.5 + v, 0.5, 0.5);
}

// At high current the terminal falls by I/C, and the lower diode takes over: no loss.
TEST(Commutation, TakesChargeOverCurrent)
{
    constexpr double C = 20e-9;
    rig::Plant plant(capacitive(C, 2e-6));
    plant_pwm_t pwm = with_current(5.0);
    plant.run(pwm, 2000);
    double edge_s = 50e-6 * (1.0 + static_cast<double>(pwm.compare[0][1]) / rig::counts);
    plant_truth_t a = plant.at(edge_s);
    ASSERT_GT(a.i_A[0], 2.0);          // of 5, after the dead time's error
    double takes_s = C * V / a.i_A[0]; // some 0.3 us
    for (double share : {0.25, 0.5, 0.75}) {
        // the current of an inductance that is large against the time: falls by less than 1e-3
        EXPECT_NEAR(plant.at(edge_s + share * takes_s).v_leg_V[0], V * (1.0 - share), 1e-3 * V) << share;
    }
    plant_truth_t b = plant.at(edge_s + 1.01 * takes_s);
    EXPECT_NEAR(b.v_leg_V[0], 0.0, terminal_V);
    plant_truth_t c = plant.at(edge_s + 3e-6);
    EXPECT_NEAR(c.e_device_J - a.e_device_J, 0.0, 1e-4 * C * V * V) << "soft";
    EXPECT_NEAR(residual_J(c), residual_J(a), 1e-6 * V * a.i_A[0] * 3e-6);
}

// At low current the dead time ends half way: the switch discharges what is left, and that energy is lost.
TEST(Commutation, HardSwitchingLosesWhatIsLeftInTheCapacitance)
{
    constexpr double C = 20e-9;
    rig::Plant plant(capacitive(C, 2e-6));
    plant_pwm_t pwm = with_current(0.2);
    plant.run(pwm, 2000);
    double edge_s = 50e-6 * (1.0 + static_cast<double>(pwm.compare[0][1]) / rig::counts);
    plant_truth_t a = plant.at(edge_s);
    plant_truth_t b = plant.at(edge_s + 2e-6 - 1e-12);
    ASSERT_GT(b.v_leg_V[0], 5.0);
    EXPECT_NEAR(b.v_leg_V[0], V - 0.5 * (a.i_A[0] + b.i_A[0]) * 2e-6 / C, 0.02 * V);
    plant_truth_t c = plant.at(edge_s + 2e-6 + 1e-12);
    EXPECT_NEAR(c.v_leg_V[0], 0.0, 1e-9);
    double lost_J = 0.5 * C * b.v_leg_V[0] * b.v_leg_V[0];
    EXPECT_NEAR(c.e_device_J - b.e_device_J, lost_J, 1e-6 * lost_J);
    EXPECT_NEAR(c.e_in_J, b.e_in_J, 1e-12) << "the lower rail draws nothing from the link";
    EXPECT_NEAR(residual_J(c), residual_J(a), 1e-5 * lost_J); // the integration of the swing
}

// Upwards the link delivers C V dV, of which half is lost when the terminal starts from the other rail.
TEST(Commutation, ChargingTakesTwiceItsEnergyFromTheLink)
{
    constexpr double C = 10e-9;
    rig::Plant plant(capacitive(C, 0.0));
    plant.run(rig::pwm(0, 0, 0), 3);
    plant_truth_t a = plant.truth();
    plant_pwm_t pwm = rig::pwm(0.5, 0.5, 0.5); // all three at once: no current
    plant.run(pwm);
    plant.run(pwm);
    plant_truth_t b = plant.truth();
    EXPECT_NEAR(b.i_A[0], 0.0, 1e-9);
    EXPECT_NEAR(b.e_in_J - a.e_in_J, 3 * C * V * V, 1e-12);
    EXPECT_NEAR(b.e_device_J - a.e_device_J, 3 * C * V * V, 1e-12) << "half up, half down again";
    EXPECT_NEAR(residual_J(b), residual_J(a), 1e-12);
}

// A soft link feels the charge.
TEST(Commutation, TakesItsChargeFromTheLink)
{
    constexpr double C = 10e-9;
    plant_config_t config = capacitive(C, 0.0);
    config.dclink = rig::dclink(V, 1e6, 1e-6); // no source to speak of
    rig::Plant plant(config);
    plant.run(rig::pwm(0, 0, 0), 3);
    double before_V = plant.truth().v_dc_V;
    plant_pwm_t pwm = rig::pwm(0.5, 0.5, 0.5);
    plant.run(pwm);
    plant.run(pwm);
    EXPECT_NEAR(plant.truth().v_dc_V, before_V - 3 * C * V / 1e-6, 2e-2 * 3 * C * V / 1e-6);
}

// An undriven terminal swings with the winding at 1/(2 pi sqrt(1.5 L C)): released from the lower rail by a
// current into the leg, it goes up a half wave and comes back to its diode.
TEST(Commutation, UndrivenTerminalRingsWithTheWinding)
{
    constexpr double C = 100e-9;
    plant_config_t config = capacitive(C, 0.0);
    config.machine.R_s_ohm = 0.0;
    rig::Plant plant(config);
    plant_pwm_t pwm = rig::pwm(0, 0, 0);
    pwm.compare[1][0] = pwm.compare[1][1] = 100; // B and C up for 1.19 us
    pwm.compare[2][0] = pwm.compare[2][1] = 100;
    plant.run(pwm);
    plant_pwm_t off = rig::pwm(0, 0, 0);
    off.driven[0] = false;
    plant.run(off);
    plant_truth_t a = plant.truth();
    double i = -a.i_A[0];
    ASSERT_NEAR(i, V / L_leg * 2 * 50e-6 * 100 / rig::counts, 1e-6);
    double w = 1.0 / std::sqrt(L_leg * C), peak_V = i * std::sqrt(L_leg / C);
    ASSERT_LT(peak_V, 0.9 * V);
    ASSERT_LT(pi / w, 99e-6) << "the half wave fits a period";
    for (double t : {0.2, 0.5, 0.8, 0.98}) {
        plant_truth_t at = plant.at(t * pi / w);
        EXPECT_NEAR(at.v_leg_V[0], peak_V * std::sin(t * pi), terminal_V) << t;
        EXPECT_NEAR(at.i_A[0], -i * std::cos(t * pi), 3e-4 * i) << t;
    }
    plant_truth_t b = plant.at(1.01 * pi / w);
    EXPECT_NEAR(b.v_leg_V[0], 0.0, terminal_V);
    EXPECT_NEAR(b.i_A[0], i, 1e-3 * i) << "in the lower diode";
    EXPECT_NEAR(residual_J(b), residual_J(a), 3e-4 * 0.5 * L_leg * i * i);
}

} // namespace
