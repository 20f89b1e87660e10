// A locked machine on its inverter that pulses are tried on: sim_plant, which shares no code with the firmware.
#ifndef TESTS_UNIT_INJECTION_PULSE_RIG_H
#define TESTS_UNIT_INJECTION_PULSE_RIG_H

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "injection/boundary_detection.h"
#include "injection/dc_link_pulses.h"
#include "injection/pulses.h"
#include "sim_plant/plant.h"
#include "tests/contract/bench.h"
#include "tests/support/plants.h"

namespace pulse_rig
{

using bench::Base;
using bench::fixed;
using bench::kDegree;
using bench::real;

constexpr int kPositions = 120;

struct Rig {
    plant_config_t plant;
    Base base;
    double i_pulse_A, L_d_H, L_q_H;
    double noise_A = 5e-3;
};

// Gains 1 + gain, 1, 1 - gain: what shows most.
inline Rig ipm(double gain)
{
    plant_config_t c = plants::ipm_1000();
    c.mech.locked = true;
    c.inverter.c_leg_F = 0.5e-9;
    c.sensor.seed = 0;
    c.sensor.gain_error[0] = gain;
    c.sensor.gain_error[2] = -gain;
    return {c, bench::kIpmBase, 4.0, 43e-3, 75e-3};
}

inline Rig spm(double gain)
{
    Rig r = ipm(gain);
    const plant_config_t own = plants::spm_400();
    r.plant.machine = own.machine;
    r.plant.inverter = own.inverter;
    r.plant.inverter.dead_time_s = 2e-6;
    r.plant.inverter.c_leg_F = 2e-9;
    r.plant.dclink = own.dclink;
    r.plant.sensor.v_full_scale_V = own.sensor.v_full_scale_V;
    r.base = bench::kSpmBase;
    r.L_d_H = 3.0e-3;
    r.L_q_H = 3.3e-3;
    return r;
}

// Nothing but the machine: what the formulas speak of.
inline Rig ideal(Rig r)
{
    r.plant.inverter.dead_time_s = 0.0;
    r.plant.inverter.c_leg_F = 0.0;
    r.plant.inverter.v_switch_V = 0.0;
    r.plant.inverter.v_diode_V = 0.0;
    r.plant.dclink.r_source_ohm = 0.0;
    r.plant.dclink.c_F = 0.0;
    r.plant.sensor.bits = 0;
    r.plant.sensor.noise_lsb = 0;
    r.plant.sensor.gain_error[0] = 0;
    r.plant.sensor.gain_error[2] = 0;
    return r;
}

// DESIGN.md: i_pulse along d by whole periods; half of the saliency.
inline pulses_config_t config(const Rig &r)
{
    const double per_period = 2.0 / 3 * r.plant.dclink.v_source_V * r.base.period_s;
    const double exact = r.i_pulse_A * r.L_d_H / per_period;
    const double whole = std::max(1.0, std::round(exact));
    pulses_config_t c = {};
    c.periods = static_cast<uint16_t>(whole);
    c.timeout = static_cast<uint16_t>(8 * whole + 50);
    c.duty = fixed(std::min(1.0, exact / whole), 28);
    c.i_zero = fixed(5 * r.noise_A / r.base.i_A, 28);
    c.s_min = fixed(0.5 * (r.L_q_H - r.L_d_H) / (r.L_q_H + r.L_d_H), 28);
    c.i_noise = fixed(r.noise_A / r.base.i_A, 28);
    const double v_dc = r.plant.dclink.v_source_V, C = r.plant.inverter.c_leg_F;
    const double edges_A = 4.0 / 3 * whole * r.plant.inverter.dead_time_s * v_dc / r.L_d_H;
    c.i_bridge = fixed((edges_A + 2 * v_dc * std::sqrt(C / r.L_d_H)) / r.base.i_A, 28);
    return c;
}

inline pm_abc_t currents(const plant_adc_t &adc)
{
    const auto of = [&adc](int leg) { return fixed((adc.i_leg[leg] - 32768) / 32768.0, 28); };
    return {of(0), of(1), of(2)};
}

struct Result {
    pm_procedure_t state = PM_RUNNING;
    double theta_rad = 0, error_deg = 0, margin = 0;
    double turned_Nms = 0;          // integral of the torque
    int periods = 0, computing = 0; // of the pulses, and after them
    double i_most_A = 0;
};

// Where a method leaves what it has found.
template <typename State> const pulses_found_t &found_of(const State &self)
{
    return self.train.found;
}

inline const pulses_found_t &found_of(const boundary_detection_t &self)
{
    return self.pulses.train.found;
}

inline const pulses_found_t &found_of(const dc_link_pulses_t &self)
{
    return self.found;
}

// Everything that the converters say in the period of a step, for methods that take more than the currents.
inline plant_adc_t seen;

// A method: its state and its two functions.
template <typename State> struct Method {
    pm_procedure_t (*step)(State *, const pulses_config_t *, pm_abc_t, pulses_out_t *);
    pm_procedure_t (*find)(State *, const pulses_config_t *);
};

template <typename State>
Result find(const Method<State> &method, const Rig &r, const pulses_config_t &c, double theta_rad,
            uint64_t seed = 1)
{
    plant_config_t config = r.plant;
    config.sensor.seed = seed;
    const char *error = nullptr;
    const std::unique_ptr<plant_t, void (*)(plant_t *)> plant(plant_create(&config, theta_rad, &error),
                                                              &plant_destroy);
    EXPECT_EQ(error, nullptr);
    State self = {};
    Result result;
    while (result.state == PM_RUNNING && result.periods < 5000) {
        plant_adc_t adc;
        plant_sample(plant.get(), &adc);
        pulses_out_t out;
        seen = adc;
        result.state = method.step(&self, &c, currents(adc), &out);
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
    if (result.state == PM_DONE) {
        const int per_ms = static_cast<int>(std::lround(1e-3 / r.base.period_s));
        do {
            result.state = method.find(&self, &c);
            result.computing += per_ms;
        } while (result.state == PM_RUNNING);
        result.theta_rad = bench::rad(found_of(self).theta);
        result.margin = found_of(self).margin / 256.0;
        result.error_deg = bench::wrapped(theta_rad - result.theta_rad) / kDegree;
    }
    return result;
}

struct Grid {
    double mean_deg = 0, most_deg = 0, least_margin = 1e9;
    int done = 0, right_pole = 0, wrong_pole = 0, periods = 0; // a pole that was refused is neither
};

template <typename State> Grid grid(const Method<State> &method, const Rig &r, int positions = kPositions)
{
    Grid g;
    const pulses_config_t c = config(r);
    for (int k = 0; k < positions; ++k) {
        const Result x =
            find(method, r, c, (k + 0.37) * 2 * bench::kPi / positions, static_cast<uint64_t>(k) + 1);
        g.done += x.state == PM_DONE ? 1 : 0;
        g.right_pole += x.state == PM_DONE && std::abs(x.error_deg) < 90 ? 1 : 0;
        g.wrong_pole += x.state == PM_DONE && std::abs(x.error_deg) >= 90 ? 1 : 0;
        g.mean_deg += std::abs(x.error_deg) / positions;
        g.most_deg = std::max(g.most_deg, std::abs(x.error_deg));
        g.least_margin = std::min(g.least_margin, x.margin);
        g.periods = std::max(g.periods, x.periods);
    }
    ::testing::Test::RecordProperty("mean_deg", std::to_string(g.mean_deg));
    ::testing::Test::RecordProperty("most_deg", std::to_string(g.most_deg));
    ::testing::Test::RecordProperty("least_margin", std::to_string(g.least_margin));
    return g;
}

template <typename State>
void expect_grid(const Method<State> &method, const Rig &r, double mean_deg, double most_deg,
                 int positions = kPositions)
{
    const Grid g = grid(method, r, positions);
    EXPECT_EQ(g.done, positions);
    EXPECT_EQ(g.right_pole, positions);
    EXPECT_LE(g.mean_deg, mean_deg);
    EXPECT_LE(g.most_deg, most_deg);
}

// Half of what the data say, whatever the link's voltage is: a machine with two thirds of it is found, with two fifths refused.
template <typename State> void expect_saliency_of_the_data(const Method<State> &method, Rig r)
{
    const double told = (r.L_q_H - r.L_d_H) / (r.L_q_H + r.L_d_H);
    pulses_config_t c = config(r);
    for (const double link : {1.0, 0.7}) {
        Rig at = r;
        at.plant.dclink.v_source_V *= link;
        for (const double theta : {0.1, 1.0, 1.9, 2.8}) {
            c.s_min = fixed(0.5 * told / 0.67, 28);
            EXPECT_NE(find(method, at, c, theta).state, PM_FAILED_SALIENCY) << theta << " " << link;
            c.s_min = fixed(0.5 * told / 0.4, 28);
            EXPECT_EQ(find(method, at, c, theta).state, PM_FAILED_SALIENCY) << theta << " " << link;
        }
    }
}

} // namespace pulse_rig

#endif
