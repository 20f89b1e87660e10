// bridge.h through the plant: dead time, drops, diodes, floating legs.
#include "rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace
{

using rig::pi;

// METHODS.md 5.6.1.1 allows 3 % against the textbook formula; with the drops of each path written out it is
// exact but for the ripple of the current in r_on.
constexpr double formula_tolerance = 0.001;
// Closed forms: events found to 1e-9 of a step, integration to 1e-6.
constexpr double closed_form = 2e-6;
// The reference takes implicit Euler steps of 50 ns: an event is up to a step late, 36 V / 3.24 mH * 50 ns =
// 0.6 mA of some amperes.
constexpr double euler = 2e-4;

plant_config_t locked_spm()
{
    plant_config_t c = rig::spm_400_linear();
    c.mech.locked = true;
    return c;
}

// Mean voltage error of phase A (in alpha) when A carries sign * 3 A and B, C the return.
double alpha_error_V(const plant_config_t &config, double sign, double *i_A)
{
    rig::Plant plant(config);
    double wanted_V = sign * 3.0 * (config.machine.R_s_ohm + config.inverter.r_on_ohm);
    double duty = 0.0;
    for (int pass = 0; pass < 6; pass++) { // to the current, whatever the error is
        plant_pwm_t pwm = rig::pwm(0.5 + duty, 0.5 - 0.5 * duty, 0.5 - 0.5 * duty);
        plant.run(pwm, 2000);
        duty += (wanted_V - plant.truth().i_A[0] * wanted_V / (sign * 3.0)) /
                (1.5 * config.dclink.v_source_V) * 1.5;
    }
    plant_pwm_t pwm = rig::pwm(0.5 + duty, 0.5 - 0.5 * duty, 0.5 - 0.5 * duty);
    plant.run(pwm, 3000);
    plant_truth_t t = plant.truth();
    *i_A = t.i_A[0];
    double d_A = 1.0 * pwm.compare[0][0] / rig::counts, d_B = 1.0 * pwm.compare[1][0] / rig::counts;
    return t.v_mean_alpha_V - 2.0 / 3.0 * (d_A - d_B) * config.dclink.v_source_V;
}

TEST(DeadTime, MeanVoltageError)
{
    plant_config_t config = locked_spm();
    config.inverter = {10e3, 2e-6, 0.8, 0.6, 0.01, rig::counts};
    double lost = 2e-6 * 10e3;
    for (double sign : {1.0, -1.0}) {
        double i_A;
        double error = alpha_error_V(config, sign, &i_A);
        ASSERT_NEAR(i_A, sign * 3.0, 0.05);
        // each leg loses V_dc t_d f and its drops against its current: A by 1, B and C by 1 the other way
        double leg_V = 36.0 * lost + 0.8 * (1.0 - 2.0 * lost) + 0.6 * 2.0 * lost;
        double expected = -sign * 4.0 / 3.0 * leg_V - 0.01 * i_A;
        RecordProperty(sign > 0 ? "relative_error_plus" : "relative_error_minus",
                       std::to_string(error / expected - 1.0));
        EXPECT_NEAR(error, expected, formula_tolerance * std::fabs(expected));
    }
}

TEST(DeadTime, NoneNoError)
{
    plant_config_t config = locked_spm();
    double i_A;
    EXPECT_NEAR(alpha_error_V(config, 1.0, &i_A), 0.0, 1e-6);
}

// A small positive current dies within the dead time and stays at zero until the next switch closes.
TEST(DeadTime, ClampsASmallCurrentToZero)
{
    plant_config_t config = locked_spm();
    config.inverter = {10e3, 4e-6, 0.0, 0.7, 0.0, rig::counts};
    rig::Plant plant(config);
    plant_pwm_t pwm = rig::pwm(0.7, 0.5, 0.5);
    // one period from rest: A closes 4 us after 15 us, B and C 4 us after 25 us; A opens at 85 us, B and C at
    // 75 us. Stop in the first interval with A alone on its upper switch.
    plant.run(pwm);
    plant.at(18.9e-6);
    EXPECT_EQ(plant.truth().i_A[0], 0.0);
    plant_truth_t rising = plant.at(21e-6);
    EXPECT_NEAR(rising.i_A[0], 2.0 / 3.0 * 36.0 / 3.24e-3 * 2e-6, 1e-5);
    // B and C return their current through their upper diodes from 25 us on: the current decays on 0.7 V
    plant_truth_t top = plant.at(25e-6);
    double i_top = 2.0 / 3.0 * 36.0 / 3.24e-3 * 6e-6;
    EXPECT_NEAR(top.i_A[0], i_top, 1e-4);
    plant_truth_t decaying = plant.at(28e-6);
    EXPECT_NEAR(decaying.i_A[0], i_top - 2.0 / 3.0 * 0.7 / 3.24e-3 * 3e-6, 2e-4);
    EXPECT_NEAR(decaying.v_leg_V[1], 36.7, 1e-9);
}

TEST(DeadTime, CurrentThatReachesZeroInTheDeadTimeStaysZero)
{
    plant_config_t config = locked_spm();
    config.machine.R_s_ohm = 0.0;
    config.inverter = {10e3, 4e-6, 0.0, 0.7, 0.0, rig::counts};
    rig::Plant plant(config);
    // A pulses for 5 - 4 = 1 us, B and C stay low
    plant_pwm_t pwm = rig::pwm(0.05, 0.0, 0.0);
    plant.run(pwm);
    double L = 3.24e-3, up = 2.0 / 3.0 * 36.0 / L * 1e-6; // from 51.5 us to 52.5 us
    EXPECT_NEAR(plant.at(52.5e-6).i_A[0], up, 1e-9);
    double zero = 52.5e-6 + up / (2.0 / 3.0 * 0.7 / L); // would take 51 us: ends when the lower switch closes
    ASSERT_GT(zero, 56.5e-6);
    EXPECT_NEAR(plant.at(56.5e-6).i_A[0], up - 2.0 / 3.0 * 0.7 / L * 4e-6, 1e-9);

    // B and C high instead: what A's pulse of a low level leaves, 36 V take back at once
    rig::Plant high(config);
    plant_pwm_t notch = rig::pwm(0.95, 1.0, 1.0);
    high.run(notch);
    high.run(notch);
    // low switch of A closed from 4 us before 2.5 us past the boundary: swallowed; no current at all
    EXPECT_EQ(high.truth().i_A[0], 0.0);

    // A low-side pulse of 1 us, then 4 us of dead time with 36.7 V against a current built by 36 V
    notch = rig::pwm(0.95, 1.0, 1.0);
    notch.compare[0][0] = rig::counts;          // high until
    notch.compare[0][1] = 9 * rig::counts / 10; // 95 us: lower switch from 99 us to 100 us
    rig::Plant pulse(config);
    pulse.run(notch);
    EXPECT_EQ(pulse.at(99e-6).i_A[0], 0.0);
    pulse.run(notch);
    EXPECT_NEAR(pulse.truth().i_A[0], -up, 1e-9);
    EXPECT_NEAR(pulse.at(0.5e-6).i_A[0], -up + 2.0 / 3.0 * 0.7 / L * 0.5e-6, 1e-9);
}

TEST(BridgeOff, NoCurrentWhileTheEmfIsBelowTheLink)
{
    plant_config_t config = rig::ipm_1000_real();
    rig::Plant plant(config, 0.3);
    plant_set_speed(plant, 200.0); // line EMF 245 V of 300 V
    for (int k = 0; k < 1000; k++) {
        plant.run(rig::all_off());
        plant_truth_t t = plant.truth();
        for (double i : t.i_A) {
            ASSERT_EQ(i, 0.0);
        }
        ASSERT_EQ(t.torque_Nm, 0.0);
    }
    EXPECT_EQ(plant.truth().e_in_J, 0.0);
    EXPECT_NEAR(plant.truth().e_field_J, 0.0, 1e-15);
}

// A linear round machine on legs and diodes, by implicit Euler in 50 ns steps: in each, every combination of
// the undriven legs being open, on their lower or on their upper diode is tried until one contradicts
// nothing. It knows no events.
class DiodeBridge
{
  public:
    enum Leg { open, low, high, driven_low, driven_high };
    static constexpr double h = 50e-9;

    DiodeBridge(const plant_config_t &config, double omega_mech, double theta_e)
        : c(config), w(config.machine.pole_pairs * omega_mech), theta(theta_e)
    {
    }

    std::array<double, 3> i_A{};
    double e_in_J = 0.0;

    // gate[k]: driven_low, driven_high, or open for a leg left to its diodes
    void step(const std::array<Leg, 3> &gate)
    {
        theta += h * w;
        std::array<double, 3> e;
        for (size_t k = 0; k < 3; k++) {
            e[k] = -w * c.machine.psi_m_Wb * std::sin(theta - static_cast<double>(k) * 2 * pi / 3);
        }
        for (int combination = 0; combination < 27; combination++) {
            std::array<Leg, 3> leg = {Leg(combination % 3), Leg(combination / 3 % 3), Leg(combination / 9)};
            bool repeats = false;
            for (size_t k = 0; k < 3; k++) {
                repeats = repeats || (gate[k] != open && leg[k] != open);
                leg[k] = gate[k] != open ? gate[k] : leg[k];
            }
            if (!repeats && fits(leg, e)) {
                return;
            }
        }
        FAIL() << "no combination fits";
    }

  private:
    double rail_V(Leg leg) const
    {
        double v_d = c.inverter.v_diode_V, v_dc = c.dclink.v_source_V;
        return leg == low ? -v_d : leg == high ? v_dc + v_d : leg == driven_high ? v_dc : 0.0;
    }

    bool fits(const std::array<Leg, 3> &leg, const std::array<double, 3> &e)
    {
        double l = c.machine.L_d0_H / h, r = c.machine.R_s_ohm + c.inverter.r_on_ohm;
        double star = 0.0; // potential of the star point
        int tied = 0;
        for (size_t k = 0; k < 3; k++) {
            if (leg[k] != open) {
                star += rail_V(leg[k]) - e[k] + l * i_A[k];
                tied++;
            }
        }
        star = tied > 0 ? star / tied : 0.0;
        std::array<double, 3> next{};
        double highest = -1e9, lowest = 1e9, i_dc = 0.0;
        for (size_t k = 0; k < 3; k++) {
            if (leg[k] == open) {
                double u = star + e[k] - l * i_A[k];
                highest = std::max(highest, u);
                lowest = std::min(lowest, u);
                continue;
            }
            next[k] = (rail_V(leg[k]) - star - e[k] + l * i_A[k]) / (l + r);
            if ((leg[k] == low && next[k] < 0.0) || (leg[k] == high && next[k] > 0.0)) {
                return false;
            }
            i_dc += leg[k] == high || leg[k] == driven_high ? next[k] : 0.0;
        }
        bool beyond = tied == 0 ? highest - lowest > rail_V(high) - rail_V(low)
                                : highest > rail_V(high) || lowest < rail_V(low);
        if (beyond || (tied == 1 && std::count_if(leg.begin(), leg.end(),
                                                  [](Leg x) { return x == low || x == high; }) == 1)) {
            return false;
        }
        i_A = next;
        e_in_J += h * c.dclink.v_source_V * i_dc;
        return true;
    }

    plant_config_t c;
    double w, theta;
};

struct Comparison {
    double worst = 0.0, peak = 0.0;
    int idle = 0;
    int conducting = 0;

    void add(const plant_truth_t &t, const std::array<double, 3> &reference)
    {
        for (size_t k = 0; k < 3; k++) {
            worst = std::max(worst, std::fabs(t.i_A[k] - reference[k]));
            peak = std::max(peak, std::fabs(t.i_A[k]));
            idle += t.i_A[k] == 0.0;
            conducting += t.i_A[k] != 0.0;
        }
    }
};

class Rectifier : public testing::TestWithParam<double>
{
};

// From discontinuous conduction, where all three legs start and stop by themselves, to three diodes at a
// time.
TEST_P(Rectifier, FollowsAnEnumeratedDiodeBridge)
{
    plant_config_t config = rig::spm_400_linear();
    config.inverter.v_diode_V = 0.7;
    config.inverter.r_on_ohm = 0.02;
    double omega_mech = GetParam() * (36.0 + 1.4) / (std::sqrt(3.0) * 5 * 77.6e-3);
    rig::Plant plant(config);
    plant_set_speed(plant, omega_mech);
    DiodeBridge reference(config, omega_mech, 0.0);
    Comparison comparison;
    for (int k = 0; k < 150; k++) {
        plant.run(rig::all_off());
        for (int step = 0; step < 2000; step++) {
            reference.step({DiodeBridge::open, DiodeBridge::open, DiodeBridge::open});
        }
        comparison.add(plant.truth(), reference.i_A);
    }
    plant_truth_t t = plant.truth();
    RecordProperty("worst_over_peak", std::to_string(comparison.worst / comparison.peak));
    RecordProperty("peak_A", std::to_string(comparison.peak));
    EXPECT_GT(comparison.conducting, 100);
    EXPECT_GT(comparison.peak, 0.01);
    EXPECT_LT(comparison.worst, euler * comparison.peak);
    EXPECT_LT(t.e_in_J, 0.0); // into the link
    EXPECT_NEAR(t.e_in_J, reference.e_in_J, 5e-3 * std::fabs(t.e_in_J));
}

INSTANTIATE_TEST_SUITE_P(EmfOverLink, Rectifier, testing::Values(1.02, 1.1, 1.5, 3.0));

struct Pattern {
    const char *name;
    double omega_mech;
    double duty[PLANT_LEGS]; // negative: not driven
    double dead_time_s;
};

class Legs : public testing::TestWithParam<Pattern>
{
};

// Driven, undriven and dead legs together: six-step operation with an open leg, one driven leg alone, and
// currents small enough to die in the dead time.
TEST_P(Legs, FollowAnEnumeratedBridge)
{
    const Pattern &pattern = GetParam();
    plant_config_t config = rig::spm_400_linear();
    config.inverter.v_diode_V = 0.7;
    config.inverter.dead_time_s = pattern.dead_time_s;
    config.inverter.timer_counts = 1000;
    plant_pwm_t pwm = rig::pwm(std::fabs(pattern.duty[0]), std::fabs(pattern.duty[1]),
                               std::fabs(pattern.duty[2]), config.inverter.timer_counts);
    for (int k = 0; k < PLANT_LEGS; k++) {
        pwm.driven[k] = pattern.duty[k] >= 0.0;
    }
    rig::Plant plant(config, 0.5);
    plant_set_speed(plant, pattern.omega_mech);
    plant.run(pwm);
    ASSERT_EQ(plant.truth().i_A[0], 0.0);
    DiodeBridge reference(config, pattern.omega_mech, plant.truth().theta_e_rad);
    Comparison comparison;
    constexpr int steps = 2000, look = 50; // of a period
    for (int k = 0; k < 100; k++) {
        for (int n = 0; n < steps; n++) {
            double t = (n + 0.5) * DiodeBridge::h;
            std::array<DiodeBridge::Leg, 3> gate{};
            for (size_t leg = 0; leg < 3; leg++) {
                // high, low, or within the dead time after either edge; a driven leg starts with one too
                double rise = 50e-6 * (1.0 - pattern.duty[leg]), fall = 50e-6 * (1.0 + pattern.duty[leg]);
                bool edges = pattern.duty[leg] > 0.0;
                bool dead = (edges && t > rise && t < rise + pattern.dead_time_s) ||
                            (edges && t > fall && t < fall + pattern.dead_time_s) ||
                            (k == 0 && t < pattern.dead_time_s);
                gate[leg] = pattern.duty[leg] < 0.0 || dead ? DiodeBridge::open
                            : t > rise && t < fall          ? DiodeBridge::driven_high
                                                            : DiodeBridge::driven_low;
            }
            reference.step(gate);
            if (n % look == look - 1 && n < steps - 1) {
                comparison.add(plant.at((n + 1) * DiodeBridge::h), reference.i_A);
            }
        }
        plant.run(pwm);
        comparison.add(plant.truth(), reference.i_A);
    }
    RecordProperty("worst_over_peak", std::to_string(comparison.worst / comparison.peak));
    RecordProperty("peak_A", std::to_string(comparison.peak));
    EXPECT_GT(comparison.conducting, 100);
    EXPECT_GT(comparison.idle, 100) << "no leg ever floated";
    EXPECT_LT(comparison.worst, euler * comparison.peak);
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(t.e_in_J, reference.e_in_J,
                5e-3 * std::fabs(t.e_in_J) + euler * comparison.peak * 36.0 * 0.01);
}

INSTANTIATE_TEST_SUITE_P(Operation, Legs,
                         testing::Values(Pattern{"six_step", 40.0, {0.75, 0.0, -0.5}, 2e-6},
                                         Pattern{"six_step_backwards", -40.0, {-0.5, 0.8, 0.25}, 0.0},
                                         Pattern{"one_leg", 60.0, {0.5, -0.5, -0.5}, 2e-6},
                                         Pattern{"one_leg_fast", 53.0, {-0.5, -0.5, 0.5}, 0.0},
                                         Pattern{"dying_in_the_dead_time", 0.5, {0.6, 0.5, 0.4}, 4e-6},
                                         Pattern{"turning_through_zero", 9.0, {0.52, 0.5, 0.48}, 4e-6}),
                         [](const testing::TestParamInfo<Pattern> &test) { return test.param.name; });

// One leg open, two on switches: the open terminal shows the star point and its EMF (METHODS.md 10.3.2.1).
TEST(FloatingLeg, ShowsItsEmf)
{
    plant_config_t config = rig::spm_400_linear();
    rig::Plant plant(config);
    plant_set_speed(plant, 30.0);
    plant_pwm_t pwm = rig::pwm(0.8, 0.0, 0.5);
    pwm.driven[2] = false;
    plant.run(pwm, 50);
    for (int k = 0; k < 50; k++) {
        plant.run(pwm);
        plant_truth_t on = plant.at(50e-6), off;
        double e_C = -30.0 * 5 * 77.6e-3 * std::sin(on.theta_e_rad + 2 * pi / 3);
        ASSERT_GT(18.0 + 1.5 * e_C, 0.0);
        ASSERT_EQ(on.i_A[2], 0.0);
        ASSERT_NEAR(on.i_A[0] + on.i_A[1], 0.0, 1e-9);
        ASSERT_NEAR(on.v_leg_V[2], 18.0 + 1.5 * e_C, 1e-6);
        off = plant.at(99e-6);
        e_C = -30.0 * 5 * 77.6e-3 * std::sin(off.theta_e_rad + 2 * pi / 3);
        if (e_C > 0.0) {
            ASSERT_NEAR(off.v_leg_V[2], 1.5 * e_C, 1e-6);
            ASSERT_EQ(off.i_A[2], 0.0);
        } else if (e_C < -0.1) {
            ASSERT_EQ(off.v_leg_V[2], 0.0); // the lower diode holds it
            ASSERT_GT(off.i_A[2], 0.0);
        }
    }
}

// The same with saliency and saturation, where no formula is at hand: the current simply stays away.
TEST(FloatingLeg, CarriesNoCurrentInASaturatedSalientMachine)
{
    plant_config_t config = rig::ipm_1000();
    config.dclink.v_source_V = 80.0;
    rig::Plant plant(config, 0.5);
    plant_set_speed(plant, 5.0);
    plant_pwm_t pwm = rig::pwm(1.0, 0.0, 0.0);
    pwm.driven[2] = false;
    plant.run(pwm, 400);
    for (int k = 0; k < 1000; k++) {
        plant.run(pwm);
        plant_truth_t t = plant.truth();
        ASSERT_EQ(t.i_A[2], 0.0);
        ASSERT_NEAR(t.i_A[0] + t.i_A[1], 0.0, 1e-9);
        ASSERT_GT(t.v_leg_V[2], 0.0);
        ASSERT_LT(t.v_leg_V[2], 80.0);
    }
    plant_truth_t t = plant.truth();
    EXPECT_GT(std::fabs(t.i_A[0]), 4.0);
    EXPECT_NEAR(t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J, 0.0, 1e-6 * t.e_in_J);
}

// A trip under current: each leg's diode puts the whole link against it; all ends in the time predicted.
TEST(Trip, CurrentDecaysThroughTheDiodes)
{
    plant_config_t config = locked_spm();
    config.inverter = {10e3, 0.0, 0.0, 0.7, 0.02, rig::counts};
    rig::Plant plant(config);
    plant.run(rig::pwm(0.53, 0.485, 0.485), 2000);
    plant_truth_t t0 = plant.truth();
    ASSERT_GT(t0.i_A[0], 2.0);
    plant_trip(plant);
    double R = 0.373 + 0.02, L = 3.24e-3, V = 2.0 / 3.0 * (36.0 + 1.4); // A low, B and C high
    double zero_s = L / R * std::log1p(R * t0.i_A[0] / V);
    auto expected = [&](double t) { return (t0.i_A[0] + V / R) * std::exp(-R / L * t) - V / R; };
    bool died = false;
    for (double start = 0.0; !died; start += 1e-4) {
        for (double t = 0.0; t < 99e-6; t += 1e-6) {
            double i = plant.at(t).i_A[0];
            if (start + t < zero_s) {
                ASSERT_NEAR(i, expected(start + t), closed_form * t0.i_A[0] + 1e-9);
            } else {
                ASSERT_EQ(i, 0.0) << start + t << " of " << zero_s;
                died = true;
            }
        }
        plant.run(rig::all_off());
    }
    plant.run(rig::all_off(), 100);
    for (double i : plant.truth().i_A) {
        EXPECT_EQ(i, 0.0);
    }
}

TEST(Trip, HoldsUntilTheNextPwm)
{
    rig::Plant plant(locked_spm());
    plant_pwm_t pwm = rig::pwm(0.6, 0.5, 0.5);
    plant.run(pwm, 10);
    plant_trip(plant);
    plant_run_period(plant);
    plant_run_period(plant);
    for (int k = 0; k < 20; k++) {
        plant_run_period(plant);
    }
    EXPECT_EQ(plant.truth().i_A[0], 0.0);
    plant.run(pwm);
    EXPECT_EQ(plant.truth().i_A[0], 0.0); // the update delay
    plant_run_period(plant);
    EXPECT_GT(plant.truth().i_A[0], 0.0);
}

// A current creeping through zero under closed switches: the drop turns over without a train of events.
TEST(SwitchDrop, TurnsOverWithTheCurrent)
{
    plant_config_t config = locked_spm();
    config.inverter = {10e3, 0.0, 1.0, 0.7, 0.0, rig::counts};
    rig::Plant plant(config);
    plant.run(rig::pwm(1, 0, 0), 3);
    double i_A = plant.truth().i_A[0];
    ASSERT_GT(i_A, 0.5);
    plant.run(rig::pwm(0, 0, 0), 1);
    plant.run(rig::pwm(0, 0, 0), 500);
    // 4/3 of the drop against the current: zero is reached, and kept
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(t.i_A[0], 0.0, 1e-6 * 77.6e-3 / 3.24e-3); // the tolerance of the integrator
    EXPECT_NEAR(t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J, 0.0, 1e-6 * t.e_in_J);
}

} // namespace
