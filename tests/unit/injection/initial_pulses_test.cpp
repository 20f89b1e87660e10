#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "sim_plant/plant.h"
#include "tests/contract/bench.h"
#include "tests/support/plants.h"

namespace
{

using bench::Base;
using bench::fixed;
using bench::kDegree;
using bench::real;

// METHODS.md 9.3.3 (e), with a 12-bit converter, noise and gain errors of 1 %.
constexpr double kIpmMean_deg = 2, kIpmMost_deg = 5;
constexpr double kSpmMean_deg = 4, kSpmMost_deg = 8;
// Without noise and gain error what remains is sin 3 theta of the saturation, which the vector sums cancel.
constexpr double kIdeal_deg = 0.5;
constexpr int kPositions = 120;

// A locked machine on its inverter: sim_plant, which shares no code with the firmware.
struct Rig {
    plant_config_t plant;
    Base base;
    double i_pulse_A, L_d_H, L_q_H;
    double noise_A = 5e-3;
};

Rig ipm()
{
    plant_config_t c = plants::ipm_1000();
    c.mech.locked = true;
    c.sensor.seed = 0;
    c.sensor.gain_error[0] = 0.01;
    c.sensor.gain_error[1] = -0.01;
    return {c, bench::kIpmBase, 4.0, 43e-3, 75e-3};
}

Rig spm()
{
    Rig r = ipm();
    const plant_config_t own = plants::spm_400();
    r.plant.machine = own.machine;
    r.plant.inverter = own.inverter;
    r.plant.dclink = own.dclink;
    r.plant.sensor.v_full_scale_V = own.sensor.v_full_scale_V;
    r.base = bench::kSpmBase;
    r.L_d_H = 3.0e-3;
    r.L_q_H = 3.3e-3;
    return r;
}

// initial_pulses.h and DESIGN.md: i_pulse along d by whole periods; limits against noise and a fourth of 2
// theta.
initial_pulses_config_t config(const Rig &r)
{
    const double per_period = 2.0 / 3 * r.plant.dclink.v_source_V * r.base.period_s;
    const double exact = r.i_pulse_A * r.L_d_H / per_period;
    const double whole = std::max(1.0, std::round(exact));
    initial_pulses_config_t c = {};
    c.periods = static_cast<uint16_t>(whole);
    c.timeout = static_cast<uint16_t>(8 * whole + 50);
    c.duty = fixed(std::min(1.0, exact / whole), 28);
    c.i_zero = fixed(5 * r.noise_A / r.base.i_A, 28);
    c.y_min = fixed(0.75 * (r.L_q_H - r.L_d_H) / r.L_q_H * r.i_pulse_A / r.base.i_A, 28);
    c.w_min = fixed(10 * r.noise_A / r.base.i_A, 28);
    return c;
}

pm_ab_t current(const plant_adc_t &adc)
{
    double i[3];
    for (int leg = 0; leg < 3; ++leg) {
        i[leg] = (adc.i_leg[leg] - 32768) / 32768.0;
    }
    return bench::ab({(2 * i[0] - i[1] - i[2]) / 3, (i[1] - i[2]) / std::sqrt(3.0)});
}

struct Result {
    pm_procedure_t state;
    double theta_rad;
    double error_deg;
    double turned_Nms; // integral of the torque
    int periods;
    double i_most_A;
};

Result find(const Rig &r, const initial_pulses_config_t &c, double theta_rad, uint64_t seed = 1)
{
    plant_config_t config = r.plant;
    config.sensor.seed = seed;
    const char *error = nullptr;
    const std::unique_ptr<plant_t, void (*)(plant_t *)> plant(plant_create(&config, theta_rad, &error),
                                                              &plant_destroy);
    EXPECT_EQ(error, nullptr);
    initial_pulses_t self;
    initial_pulses_reset(&self);
    Result result = {PM_RUNNING, 0, 0, 0, 0, 0};
    while (result.state == PM_RUNNING && result.periods < 5000) {
        plant_adc_t adc;
        plant_sample(plant.get(), &adc);
        initial_pulses_out_t out;
        result.state = initial_pulses_step(&self, &c, current(adc), &out);
        plant_pwm_t pwm = {};
        for (int leg = 0; leg < 3; ++leg) {
            pwm.compare[leg][0] =
                static_cast<uint32_t>(std::lround(real(out.duty[leg]) * config.inverter.timer_counts));
            pwm.compare[leg][1] = pwm.compare[leg][0];
            pwm.driven[leg] = out.driven;
        }
        plant_set_pwm(plant.get(), &pwm);
        plant_run_period(plant.get());
        plant_truth_t truth;
        plant_truth(plant.get(), &truth);
        result.turned_Nms += truth.torque_Nm * r.base.period_s;
        result.i_most_A = std::max(result.i_most_A, std::hypot(truth.i_d_A, truth.i_q_A));
        ++result.periods;
    }
    result.theta_rad = bench::rad(self.theta);
    result.error_deg = bench::wrapped(theta_rad - result.theta_rad) / kDegree;
    return result;
}

struct Grid {
    double mean_deg = 0, most_deg = 0;
    int done = 0, right_pole = 0;
};

Grid grid(const Rig &r)
{
    Grid g;
    const initial_pulses_config_t c = config(r);
    for (int k = 0; k < kPositions; ++k) {
        const Result x = find(r, c, (k + 0.37) * 2 * bench::kPi / kPositions, static_cast<uint64_t>(k) + 1);
        g.done += x.state == PM_DONE ? 1 : 0;
        g.right_pole += std::abs(x.error_deg) < 90 ? 1 : 0;
        g.mean_deg += std::abs(x.error_deg) / kPositions;
        g.most_deg = std::max(g.most_deg, std::abs(x.error_deg));
    }
    ::testing::Test::RecordProperty("mean_deg", std::to_string(g.mean_deg));
    ::testing::Test::RecordProperty("most_deg", std::to_string(g.most_deg));
    return g;
}

TEST(InitialPulses, FindsIpm1000)
{
    const Grid g = grid(ipm());
    EXPECT_EQ(g.done, kPositions);
    EXPECT_EQ(g.right_pole, kPositions);
    EXPECT_LE(g.mean_deg, kIpmMean_deg);
    EXPECT_LE(g.most_deg, kIpmMost_deg);
}

TEST(InitialPulses, FindsSpm400)
{
    const Grid g = grid(spm());
    EXPECT_EQ(g.done, kPositions);
    EXPECT_EQ(g.right_pole, kPositions);
    EXPECT_LE(g.mean_deg, kSpmMean_deg);
    EXPECT_LE(g.most_deg, kSpmMost_deg);
}

TEST(InitialPulses, ExactOnAnIdealInverter)
{
    Rig r = ipm();
    r.plant.inverter.dead_time_s = 0.0;
    r.plant.inverter.v_switch_V = 0.0;
    r.plant.inverter.v_diode_V = 0.0;
    r.plant.dclink.r_source_ohm = 0.0;
    r.plant.dclink.c_F = 0.0;
    r.plant.sensor.bits = 0;
    r.plant.sensor.noise_lsb = 0;
    r.plant.sensor.gain_error[0] = 0;
    r.plant.sensor.gain_error[1] = 0;
    for (int k = 0; k < 24; ++k) {
        const Result x = find(r, config(r), k * 15 * kDegree);
        ASSERT_EQ(x.state, PM_DONE);
        EXPECT_NEAR(x.error_deg, 0, kIdeal_deg) << k;
    }
}

// A pulse and its opposite turn the rotor back and forth; the current is what was asked for.
TEST(InitialPulses, TorqueAveragesOutAndCurrentKeepsToItsPeak)
{
    const Rig r = ipm();
    for (const double theta : {0.2, 1.1, 2.5}) {
        const Result x = find(r, config(r), theta);
        const double one_pulse = 1.5 * 3 * 0.236 * r.i_pulse_A * x.periods * r.base.period_s / 12;
        EXPECT_LE(std::abs(x.turned_Nms), 0.25 * one_pulse) << theta;
        EXPECT_LE(x.i_most_A, 1.15 * r.i_pulse_A); // saturation lets it rise a little faster
        EXPECT_GE(x.i_most_A, 0.8 * r.i_pulse_A);
        EXPECT_LE(x.periods, 6 * (2 * config(r).periods + 5)); // as the header says
    }
}

// Duties: the pulse's leg high against the others, or low against them; never both switches of all legs.
TEST(InitialPulses, SequenceIsSixPulsesInPairs)
{
    initial_pulses_config_t c = config(ipm());
    initial_pulses_t self;
    initial_pulses_reset(&self);
    std::vector<int> patterns;
    pm_procedure_t state = PM_RUNNING;
    int driven = 0;
    bool was_driven[2] = {false, false}; // by the last two calls; current flows at the end of a driven period
    for (int k = 0; k < 1000 && state == PM_RUNNING; ++k) {
        initial_pulses_out_t out;
        const pm_q_t current = was_driven[1] ? PM_ONE / 10 : 0;
        state = initial_pulses_step(&self, &c, {current, 0}, &out);
        was_driven[1] = was_driven[0];
        was_driven[0] = out.driven;
        if (!out.driven) {
            driven = 0;
            continue;
        }
        int pattern = 0;
        for (int leg = 0; leg < 3; ++leg) {
            EXPECT_TRUE(out.duty[leg] == 0 || out.duty[leg] == c.duty);
            pattern |= (out.duty[leg] != 0 ? 1 : 0) << leg;
        }
        if (driven++ == 0) {
            patterns.push_back(pattern);
        }
        EXPECT_LE(driven, c.periods);
        EXPECT_EQ(pattern, patterns.back());
    }
    patterns.resize(6);
    EXPECT_EQ(patterns, (std::vector<int>{1, 6, 2, 5, 4, 3}));
}

// Commanded in n calls, a pulse acts from the second on and ends at the call after the last one's period.
TEST(InitialPulses, TakesTheCurrentAtTheEndOfThePulse)
{
    const initial_pulses_config_t c = config(ipm());
    const pm_q_t kStep = PM_ONE / 100; // a current that grows from call to call, above i_zero
    initial_pulses_t self;
    initial_pulses_reset(&self);
    for (int call = 0; call <= c.periods + 1; ++call) {
        initial_pulses_out_t out;
        EXPECT_EQ(self.w.alpha, 0) << call;
        initial_pulses_step(&self, &c, {kStep * call, 0}, &out);
        EXPECT_EQ(out.driven, call < c.periods) << call;
    }
    EXPECT_EQ(self.w.alpha, kStep * (c.periods + 1));
    EXPECT_NEAR(self.y.alpha, kStep * (c.periods + 1), 2);
}

TEST(InitialPulses, FailsWithoutSaliency)
{
    Rig r = ipm();
    r.plant.machine.L_q0_H = r.plant.machine.L_d0_H = 50e-3;
    r.plant.machine.c_A_Wb5 = 0;
    for (const double theta : {0.0, 0.8, 2.0}) {
        EXPECT_EQ(find(r, config(r), theta).state, PM_FAILED_SALIENCY) << theta;
    }
}

TEST(InitialPulses, FailsWithoutPolarity)
{
    Rig r = ipm();
    r.plant.machine = {6.0, 43e-3, 75e-3, 0.0, 0.236, 3}; // salient, not saturating
    for (const double theta : {0.0, 0.8, 2.0}) {
        EXPECT_EQ(find(r, config(r), theta).state, PM_FAILED_POLARITY) << theta;
    }
}

// A current that does not end: a stuck sensor, a short circuit.
TEST(InitialPulses, FailsWhenTheCurrentDoesNotFall)
{
    const initial_pulses_config_t c = config(ipm());
    initial_pulses_t self;
    initial_pulses_reset(&self);
    pm_procedure_t state = PM_RUNNING;
    int periods = 0;
    while (state == PM_RUNNING && periods < 10000) {
        initial_pulses_out_t out;
        state = initial_pulses_step(&self, &c, bench::ab({0.2, 0.1}), &out);
        ++periods;
        if (periods > c.periods + 2) {
            EXPECT_FALSE(out.driven);
        }
    }
    EXPECT_EQ(state, PM_FAILED_TIMEOUT);
    EXPECT_LE(periods, c.periods + c.timeout + 4);
}

// An open winding: no current rises. The header promises a reason; whatever it is, it must not be a position.
TEST(InitialPulses, FindsNothingWithoutCurrent)
{
    Rig r = ipm();
    r.plant.machine.L_d0_H *= 1e4;
    r.plant.machine.L_q0_H *= 1e4;
    r.plant.machine.c_A_Wb5 = 0;
    const Result x = find(r, config(r), 0.5);
    EXPECT_NE(x.state, PM_DONE);
    EXPECT_NE(x.state, PM_RUNNING);
}

// initial_pulses.h: "fails with a reason when the current does not rise or fall in time". It says SALIENCY.
TEST(InitialPulses, FailsWhenTheCurrentDoesNotRise)
{
    Rig r = ipm();
    r.plant.machine.L_d0_H *= 1e4;
    r.plant.machine.L_q0_H *= 1e4;
    r.plant.machine.c_A_Wb5 = 0;
    EXPECT_EQ(find(r, config(r), 0.5).state, PM_FAILED_TIMEOUT);
}

} // namespace
