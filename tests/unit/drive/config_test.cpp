#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "firmware/params/parameters.h"
#include "method_gains.h" // made by CMake: tests/unit/*/*_gains.h of all methods
#include "tests/contract/observers.h"
#include "tests/unit/math/samples.h"

namespace
{

using bench::kPi;
using bench::real;

// Rounding of pm_num_t is 1e-9 an operation; the rest is the format's half LSB.
constexpr double kRelative = 1e-6;
constexpr int kDraws = 100000;

drive_params_t defaults()
{
    drive_params_t p;
    drive_params_default(&p);
    return p;
}

drive_config_t configure(const drive_params_t &p)
{
    drive_config_t c = {};
    const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_TRUE(r.ok) << r.reason;
    return c;
}

double value(pm_num_t x)
{
    return std::ldexp(x.m, x.e);
}

TEST(Config, DefaultsAreAccepted)
{
    drive_config_t c = {};
    const drive_params_t p = defaults();
    const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_TRUE(r.ok);
    EXPECT_TRUE(c.injection);
    EXPECT_EQ(c.start, SEQUENCE_pulses_align);
}

TEST(Config, RefusesAndNamesWhatIsOutOfRange)
{
    for (int id = 0; id < DRIVE_PARAM_COUNT; ++id) {
        const drive_param_info_t &info = drive_param_table[id];
        for (const int32_t x : {info.min - 1, info.max + 1, INT32_MIN, INT32_MAX}) {
            drive_params_t p = defaults();
            drive_param_set(&p, static_cast<drive_param_id_t>(id), x);
            drive_config_t c = {};
            const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
            EXPECT_FALSE(r.ok) << info.name;
            EXPECT_EQ(r.param, id) << info.name;
            EXPECT_NE(std::string(r.reason), "") << info.name;
        }
    }
}

// SI values in the table's units.
using Changes = std::vector<std::pair<drive_param_id_t, double>>;

drive_params_t changed(const Changes &changes)
{
    drive_params_t p = defaults();
    for (const auto &[id, si] : changes) {
        drive_param_set(&p, id, static_cast<int32_t>(std::lround(si / std::pow(10, drive_param_exp10[id]))));
    }
    return p;
}

double told(const drive_params_t &p, drive_param_id_t id)
{
    return drive_param_get(&p, id) * std::pow(10, drive_param_exp10[id]);
}

struct Cross {
    const char *what;
    Changes changes;
    drive_param_id_t named;
};

const std::vector<Cross> kCrosses = {
    {"pulses and injection with L_q below L_d",
     {{DRIVE_PARAM_L_d, 80e-3}, {DRIVE_PARAM_start_method, 1}},
     DRIVE_PARAM_start_method},
    {"align and injection with L_q below L_d",
     {{DRIVE_PARAM_L_d, 80e-3}, {DRIVE_PARAM_start_method, 3}},
     DRIVE_PARAM_start_method},
    {"cross inductance of an active machine", {{DRIVE_PARAM_L_dqh_rated, -50e-3}}, DRIVE_PARAM_L_dqh_rated},
    {"injection without saliency",
     {{DRIVE_PARAM_L_d, 75e-3}, {DRIVE_PARAM_start_method, 1}},
     DRIVE_PARAM_start_method},
    {"align and injection without saliency",
     {{DRIVE_PARAM_L_d, 75e-3}, {DRIVE_PARAM_start_method, 3}},
     DRIVE_PARAM_start_method},
    {"speed_high at speed_low", {{DRIVE_PARAM_speed_high, 21}}, DRIVE_PARAM_speed_high},
    {"hand-over above the highest speed",
     {{DRIVE_PARAM_start_method, 2}, {DRIVE_PARAM_speed_high, 150.001}},
     DRIVE_PARAM_speed_high},
    {"trip above the converter", {{DRIVE_PARAM_i_trip, 10.001}}, DRIVE_PARAM_i_trip},
    {"trip at i_max", {{DRIVE_PARAM_i_trip, 5}}, DRIVE_PARAM_i_trip},
    {"over-voltage above the converter", {{DRIVE_PARAM_v_dc_max, 451}}, DRIVE_PARAM_v_dc_max},
    {"more voltage than the board bears", {{DRIVE_PARAM_v_limit, 399}}, DRIVE_PARAM_v_dc_max},
    {"more current than the board bears", {{DRIVE_PARAM_i_limit, 4.9}}, DRIVE_PARAM_i_max},
    {"dead time too short for the board", {{DRIVE_PARAM_dead_time_least, 2.1e-6}}, DRIVE_PARAM_dead_time},
    {"carrier too slow for the board", {{DRIVE_PARAM_f_pwm_least, 10001}}, DRIVE_PARAM_f_pwm},
    {"carrier too fast for the board", {{DRIVE_PARAM_f_pwm_most, 9999}}, DRIVE_PARAM_f_pwm},
    {"derating at over-voltage", {{DRIVE_PARAM_v_dc_derate, 400}}, DRIVE_PARAM_v_dc_derate},
    {"derating at under-voltage",
     {{DRIVE_PARAM_v_dc_min, 250}, {DRIVE_PARAM_v_dc_derate, 250}},
     DRIVE_PARAM_v_dc_derate},
    {"nominal below under-voltage",
     {{DRIVE_PARAM_v_dc_nominal, 60}, {DRIVE_PARAM_v_injection, 10}},
     DRIVE_PARAM_v_dc_nominal},
    {"nominal above derating", {{DRIVE_PARAM_v_dc_nominal, 380}}, DRIVE_PARAM_v_dc_nominal},
    {"under-voltage below the modulator's range", {{DRIVE_PARAM_v_dc_min, 28}}, DRIVE_PARAM_v_dc_min},
    {"temperature derating at trip", {{DRIVE_PARAM_temp_derate, 110}}, DRIVE_PARAM_temp_derate},
    {"over-speed at speed_max", {{DRIVE_PARAM_speed_trip, 150}}, DRIVE_PARAM_speed_trip},
    {"open-loop current above i_max", {{DRIVE_PARAM_i_open_loop, 5.1}}, DRIVE_PARAM_i_open_loop},
    {"pulses above the trip", {{DRIVE_PARAM_i_pulse, 9.1}}, DRIVE_PARAM_i_pulse},
    {"carrier leaves no voltage", {{DRIVE_PARAM_v_injection, 150}}, DRIVE_PARAM_v_injection},
    {"carrier within what dead time and devices take", // 4/3 of 6 V and 1 V
     {{DRIVE_PARAM_start_method, 1}, {DRIVE_PARAM_v_injection, 9.33}},
     DRIVE_PARAM_v_injection},
    {"amplifiers that settle longer than half a period",
     {{DRIVE_PARAM_t_settle, 8e-6}, {DRIVE_PARAM_f_pwm, 30000}, {DRIVE_PARAM_timer_counts, 2833}},
     DRIVE_PARAM_t_settle},
    {"switches held above low-side shunts",
     {{DRIVE_PARAM_regulator, REGULATOR_finite_set},
      {DRIVE_PARAM_start_method, 2},
      {DRIVE_PARAM_t_settle, 1.3e-6}},
     DRIVE_PARAM_regulator},
};

TEST(Config, RefusesWhatCannotBeTogether)
{
    for (const Cross &x : kCrosses) {
        const drive_params_t p = changed(x.changes);
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_FALSE(r.ok) << x.what;
        if (!r.ok) {
            EXPECT_EQ(std::string(drive_param_table[r.param].name), drive_param_table[x.named].name)
                << x.what;
        }
    }
}

// With injection there is a position at all speeds; block commutation from the align goes on without the observer.
TEST(Config, AHandOverAboveTheHighestSpeedIsRefusedWhereOpenLoopLeadsToIt)
{
    const Changes above = {{DRIVE_PARAM_speed_high, 150.001}};
    struct {
        const char *what;
        Changes changes;
        bool accepted;
    } const cases[] = {
        {"injection", {{DRIVE_PARAM_start_method, 1}}, true},
        {"injection after the align", {{DRIVE_PARAM_start_method, 3}}, true},
        {"at the highest speed", {{DRIVE_PARAM_start_method, 2}, {DRIVE_PARAM_speed_high, 150}}, true},
        {"no saliency", {{DRIVE_PARAM_L_q, 43e-3}}, false},
        {"blocks from the align",
         {{DRIVE_PARAM_start_method, 2}, {DRIVE_PARAM_commutation, 1}, {DRIVE_PARAM_six_step_start, 1}},
         true},
        {"blocks behind the observer",
         {{DRIVE_PARAM_start_method, 2},
          {DRIVE_PARAM_commutation, 1},
          {DRIVE_PARAM_six_step_start, 0},
          {DRIVE_PARAM_six_step_speed, 160}},
         false},
    };
    for (const auto &x : cases) {
        Changes changes = above;
        changes.insert(changes.end(), x.changes.begin(), x.changes.end());
        const drive_params_t p = changed(changes);
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_EQ(r.ok, x.accepted) << x.what << ": " << r.reason;
        if (!x.accepted) {
            EXPECT_EQ(r.param, DRIVE_PARAM_speed_high) << x.what;
            EXPECT_STREQ(r.reason, "must not be above speed_max without injection") << x.what;
        }
    }
}

TEST(Config, SourcesAndObserversThatDoNotGoTogetherAreRefused)
{
    const struct {
        int32_t injection, observer, start_method;
        const char *reason;
    } cases[] = {
        {INJECTION_random_square, OBSERVER_mras_current, 1, "has the spectrum"},
        {INJECTION_random_square, OBSERVER_mras_voltage, 1, "has the spectrum"},
        {INJECTION_random_square, OBSERVER_mras_simple, 1, "has the spectrum"},
        {INJECTION_random_square, OBSERVER_ekf_reduced, 1, ""},
        {INJECTION_pulsating_square, OBSERVER_mras_current, 1, ""},
        {INJECTION_random_square, OBSERVER_mras_current, 2, ""}, // open loop: no carrier
    };
    for (const auto &x : cases) {
        const drive_params_t p = changed({{DRIVE_PARAM_injection, static_cast<double>(x.injection)},
                                          {DRIVE_PARAM_observer, static_cast<double>(x.observer)},
                                          {DRIVE_PARAM_start_method, static_cast<double>(x.start_method)}});
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_EQ(r.ok, x.reason[0] == '\0') << x.injection << ' ' << x.observer << ": " << r.reason;
        if (!r.ok) {
            EXPECT_EQ(r.param, DRIVE_PARAM_injection);
            EXPECT_EQ(std::string(r.reason).rfind(x.reason, 0), 0U) << r.reason;
        }
    }
}

TEST(Config, RefusesWhatDoesNotFitItsFormat)
{
    // kp = w_c L / (V/A) beyond 32 of Q26
    const drive_params_t p = changed({{DRIVE_PARAM_current_bandwidth, 5000},
                                      {DRIVE_PARAM_L_d, 0.1},
                                      {DRIVE_PARAM_L_q, 0.3},
                                      {DRIVE_PARAM_start_method, 2}});
    drive_config_t c = {};
    const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_FALSE(r.ok);
    EXPECT_EQ(r.param, DRIVE_PARAM_current_bandwidth);
}

// A number of the configuration against its formula in double precision.
struct Check {
    const char *name;
    int32_t got;
    int bits;
    double expected;
};

// The defaults are IPM-1000 (METHODS.md 14 and its machine file), 10 kHz, 450 V, 10 A, 180 rad/s.
std::vector<Check> ipm_1000(const drive_config_t &c)
{
    const double V = 450, I = 10, P = 3, W = 180 * P, T = 1e-4, slow = 1e-3;
    const double R = 6, L_d = 43e-3, L_q = 75e-3, psi = 0.236, i_r = 4.0 / I, J = 0.01;
    const double Z = V / I, Lb = V / W / I, Pb = V / W;
    const double w_c = 2 * kPi * 500, w_s = 2 * kPi * 4, w_p = 2 * kPi * 25;
    const double inertia = J / (1.5 * P * P * psi);
    const double kp_s = w_s * inertia * W / I;
    const double flux = 70 * T;
    const double g0 = I / (flux * (L_q - L_d) / (L_d * L_q));
    const double Ld = 42.55e-3, Lq = 57.32e-3, Ldq = -4.466e-3;
    const double gr = std::min(I * (Ld * Lq - Ldq * Ldq) / (flux * (Lq - Ld + 2 * Ldq * Ldq / Lq)), 2.5 * g0);
    const double full = Ldq / Lq, half = -0.0378;
    const double per_period = 2.0 / 3 * 300 * T, exact = 4 * L_d / per_period;
    return {
        {"dead", c.modulator.dead, 20, 2e-6 * 10e3},
        {"drop", c.modulator.drop, 28, 1 / V},
        {"per_zone", c.modulator.per_zone[0], 20, I / 0.03},
        {"per_swing", c.modulator.per_zone[1], 20, I / (flux / (4 * L_d))},
        {"d.kp", c.regulator.synchronous_pi.d.kp, 26, w_c * L_d / Z},
        {"d.ki", c.regulator.synchronous_pi.d.ki, 26, w_c * R * T / Z},
        {"d.kb", c.regulator.synchronous_pi.d.kb, 31, R * T / L_d},
        {"q.kp", c.regulator.synchronous_pi.q.kp, 26, w_c * L_q / Z},
        {"q.ki", c.regulator.synchronous_pi.q.ki, 26, w_c * R * T / Z},
        {"q.kb", c.regulator.synchronous_pi.q.kb, 31, R * T / L_q},
        {"L_d", c.machine.L_d, 28, L_d / Lb},
        {"L_q", c.machine.L_q, 28, L_q / Lb},
        {"psi_m", c.machine.psi_m, 28, psi / Pb},
        {"speed kp", c.speed.pi.kp, 26, kp_s},
        {"speed ki", c.speed.pi.ki, 26, kp_s * w_s * slow / 4},
        {"speed kb", c.speed.pi.kb, 31, w_s * slow / 4},
        {"slope", c.speed.slope, 28, 200 * P * slow / W},
        {"i_per_slope", c.speed.i_per_slope, 28, 200 * P * inertia / I},
        {"mtpa h", c.mtpa.h, 28, psi / (2 * (L_q - L_d)) / I},
        {"fw k", c.field_weakening.k, 32, std::min(0.4, 2 * kPi * 20 * slow / (L_d / Lb))},
        {"fw i_max", c.field_weakening.i_max, 28, 3 / I},
        {"flux R", c.position.observer.active_flux.model.R, 28, R / Z},
        {"flux L_d", c.position.observer.active_flux.model.L_d, 28, L_d / Lb},
        {"flux L_q", c.position.observer.active_flux.model.L_q, 28, L_q / Lb},
        {"flux L_q2", c.position.observer.active_flux.model.L_q2, 28, (70.835e-3 - L_q) / Lb / (i_r * i_r)},
        {"flux psi_m", c.position.observer.active_flux.model.psi_m, 28, psi / Pb},
        {"flux t_s", c.position.observer.active_flux.model.t_s, 32, T * W},
        {"flux g", c.position.observer.active_flux.g, 32, 0.5 * T * W},
        {"flux k_seed", c.position.observer.active_flux.k_seed, 32, 300 * T},
        {"flux k_R", c.position.observer.active_flux.resistance.k, 26, 300 / 8.0 / (W * i_r * i_r)},
        {"flux omega_R", c.position.observer.active_flux.resistance.omega, 28, 10.5 * P / W},
        {"flux drop_R", c.position.observer.active_flux.resistance.drop, 28, R / Z * i_r / 8},
        {"omega_low", c.position.omega_low, 28, 21 * P / W},
        {"omega_high", c.position.omega_high, 28, 40 * P / W},
        {"per_span", c.position.per_span, 20, W / (19 * P)},
        {"pll_low kp", c.position.pll_low.kp_turn, 32, 1.8 * w_p * T * 2 / kPi},
        {"pll_low ki", c.position.pll_low.ki, 32, w_p * w_p * T / W},
        {"pll_high kp", c.position.pll_high.kp_turn, 32, 1.8 * w_p * T * 2 / kPi},
        {"pll_high ki", c.position.pll_high.ki, 32, w_p * w_p * T / W},
        {"k_theta", c.k_theta, 30, 16 * W * T / (2 * kPi)},
        {"v_h", c.position.injection.pulsating_square.v_h, 28, 70 / V},
        {"gain_0", c.position.injection.pulsating_square.saliency.gain_0, 20, g0},
        {"gain_2", c.position.injection.pulsating_square.saliency.gain_2, 16, (gr - g0) / (i_r * i_r)},
        {"lambda_1", c.position.injection.pulsating_square.saliency.lambda_1, 28, (4 * half - full) / i_r},
        {"lambda_2", c.position.injection.pulsating_square.saliency.lambda_2, 28,
         2 * (full - 2 * half) / (i_r * i_r)},
        {"half_step", c.position.injection.pulsating_square.half_step, 32, T * W / 2},
        {"h_d", c.position.injection.pulsating_square.h_d, 28, flux / L_d / I},
        {"h_d_inverse", c.position.injection.pulsating_square.h_d_inverse, 20, I * L_d / flux},
        {"pulse duty", c.pulses.duty, 28, exact / std::round(exact)},
        {"i_zero", c.pulses.i_zero, 28, 5 * 5e-3 / I},
        {"s_min", c.pulses.s_min, 28, 0.5 * (L_q - L_d) / (L_q + L_d)},
        {"i_noise", c.pulses.i_noise, 28, 5e-3 / I},
        {"i_bridge", c.pulses.i_bridge, 28, 4.0 / 3 * std::round(exact) * 2e-6 * 300 / L_d / I},
        {"open-loop i", c.open_loop.i, 28, 2 / I},
        {"open-loop slope", c.open_loop.slope, 28, 50 * P * slow / W},
        {"heat_max", c.protection.heat_max, 28, std::pow(1.05 * 4 / I, 2)},
        {"k_heat", c.protection.k_heat, 32, slow / 60},
        {"i_trip_squared", c.protection.i_trip_squared, 24, 81 / (I * I)},
        {"v_dc_span", static_cast<int32_t>(c.protection.v_dc_span), 28, (400 - 60) / V},
        {"v_dc_max", c.protection.v_dc_max, 28, 400 / V},
        {"v_dc_min", c.protection.v_dc_min, 28, 60 / V},
        {"v_dc_derate", c.protection.v_dc_derate, 28, 380 / V},
        {"offset_max", c.protection.offset_max, 15, 0.3 / I},
        {"omega_stall", c.protection.omega_stall, 28, 150 * P / W / 50},
        {"i_sum", c.protection.i_sum, 28, 0.1},
        {"i_max", c.i_max, 28, 5 / I},
        {"i_d_light", c.i_d_light, 28, 0.2 / I},
        {"omega_max", c.omega_max, 28, 150 * P / W},
        {"v_share", c.v_share, 31, 0.98 / std::sqrt(3.0)},
    };
}

TEST(Config, EmfObserversAreMadeFromTheSameMachine)
{
    for (const observer_id_t id : {OBSERVER_extended_emf, OBSERVER_extended_emf_ab}) {
        const drive_config_t c = configure(changed({{DRIVE_PARAM_observer, id}}));
        ASSERT_EQ(c.position.observer.id, id);
        const emf_config_t &e = c.position.observer.extended_emf;
        const active_flux_config_t flux = configure(changed({})).position.observer.active_flux;
        EXPECT_EQ(std::memcmp(&e.model, &flux.model, sizeof e.model), 0);
        const double T = 1e-4, W = 540, w = 2 * kPi * 300 * T, k = w / (1 + w);
        EXPECT_NEAR(e.k_filter, std::ldexp(k, 32), 16);
        EXPECT_NEAR(e.lag, std::ldexp((2 - k) / k, 26), 16);
        EXPECT_NEAR(e.rate, std::ldexp(1 / (T * W), 20), 1);
        EXPECT_NEAR(e.slow_rate, std::ldexp(1 / (1e-3 * W), 26), 1);
        EXPECT_NEAR(e.slow_step, std::ldexp(1e-3 * W, 28), 1);
        EXPECT_NEAR(e.speed_lag, std::ldexp(1.8 / (2 * kPi * 25 * 1e-3), 26), 16);
        EXPECT_NEAR(e.omega_min, std::ldexp(10.5 * 3 / W, 28), 1);
        EXPECT_NEAR(e.omega_tied, std::ldexp(300 / W, 28), 1);
        EXPECT_NEAR(e.resistance.k, std::ldexp(1 / (64 * 0.4 * 0.4), 26), 16);
    }
}

// L_q = L_q_rated where maximum torque per ampere is at rated current, and psi_q / i_q of the given L_qd
// beside it.
TEST(Config, CrossCouplingIsThatOfTheTwoPointsGiven)
{
    const double i_r = 0.4, half = 0.2, Lb = 450.0 / 540 / 10, h = 0.236 / (2 * 32e-3) / 10;
    const double i_mtpa = h - std::hypot(h, i_r);
    for (const double mtpa : {1, 0}) {
        const auto params = changed({{DRIVE_PARAM_L_qd_weak, -5.49e-3},
                                     {DRIVE_PARAM_L_qd_strong, -7.87e-3},
                                     {DRIVE_PARAM_mtpa, mtpa}});
        const observer_model_t &m = configure(params).position.observer.active_flux.model;
        const auto apparent_H = [&](double i_d) {
            return std::ldexp(observer_L_q(&m, {static_cast<pm_q_t>(std::ldexp(i_d, 28)), PM_Q(0.4)}), -28) *
                   Lb;
        };
        EXPECT_NEAR(apparent_H(mtpa != 0 ? i_mtpa : 0), 70.835e-3, 1e-8);
        EXPECT_NEAR(i_r * (apparent_H(-half) - apparent_H(0)), 5.49e-3 * half, 1e-8);
        EXPECT_NEAR(i_r * (apparent_H(half) - apparent_H(0)), -7.87e-3 * half, 1e-8);
    }
    const observer_model_t off =
        configure(changed({{DRIVE_PARAM_L_qd_weak, -5.49e-3}, {DRIVE_PARAM_saturation_comp, 0}}))
            .position.observer.active_flux.model;
    EXPECT_EQ(off.L_qd, 0);
    EXPECT_EQ(off.L_qd2, 0);
}

TEST(Config, AnObserverForRoundMachinesRefusesSaliency)
{
    drive_config_t c;
    for (const double L_d : {43e-3, 120e-3}) {
        const drive_params_t params =
            changed({{DRIVE_PARAM_observer, OBSERVER_back_emf}, {DRIVE_PARAM_L_d, L_d}});
        const drive_result_t result = drive_configure(&c, &params, PM_CHANNELS);
        EXPECT_FALSE(result.ok);
        EXPECT_EQ(result.param, DRIVE_PARAM_observer);
    }
}

// Flux-intensifying machines: both inductances where they stand in the equations, no i_d and no injection.
TEST(Config, LqBelowLdIsAccepted)
{
    const drive_config_t c = configure(changed({{DRIVE_PARAM_L_d, 120e-3}}));
    EXPECT_FALSE(c.injection);
    EXPECT_EQ(c.start, SEQUENCE_align);
    EXPECT_EQ(c.mtpa.h, 0);
    EXPECT_GT(c.machine.L_d, c.machine.L_q);
    for (int32_t observer = 0; observer < OBSERVER_COUNT; observer++) {
        drive_params_t p = changed({{DRIVE_PARAM_L_d, 80e-3}});
        p.observer = observer;
        p.psi_3 = 7080000; // for those that need it
        bench::give_second_set(p, observer);
        if (observer == OBSERVER_zero_vector) {
            p.speed_high = p.speed_trip / 5 * 2;
            p.speed_max = p.speed_trip / 2;
        }
        drive_config_t one = {};
        const drive_result_t r = drive_configure(&one, &p, PM_CHANNELS);
        EXPECT_TRUE(r.ok) << observer << ' ' << drive_param_table[r.param].name << ' ' << r.reason;
    }
}

// What the vector's own movement shows as a swing, and how fast it may yield then: at once for round machines, two fifths where
// saliency takes 4/9 of the flux.
TEST(Config, AVectorYieldsAsItsOwnMovementAllows)
{
    for (const double L_q : {43e-3, 50e-3, 75e-3, 300e-3, 30e-3}) {
        const drive_params_t p = changed({{DRIVE_PARAM_L_q, L_q}, {DRIVE_PARAM_L_d, 43e-3}});
        drive_config_t c = {};
        drive_configure(&c, &p, PM_CHANNELS); // of what is refused besides, this is made all the same
        const double pole_pairs = p.pole_pairs, psi = told(p, DRIVE_PARAM_psi_m), J = told(p, DRIVE_PARAM_J);
        const double swing =
            std::sqrt(1.5 * pole_pairs * pole_pairs * psi * told(p, DRIVE_PARAM_i_open_loop) / J);
        const double turn = swing * 1e-3, corners = std::min(6 * turn, 0.8);
        const double flux = std::min(std::abs(L_q - 43e-3) * told(p, DRIVE_PARAM_i_max), 4.0 / 9 * psi);
        const double g = told(p, DRIVE_PARAM_open_loop_damping) * corners / (turn * psi) * 0.75 * flux;
        EXPECT_NEAR(c.open_loop.k_yield / 32768.0, std::min(1.0, 1.5 / (1 + g)), 1e-4) << L_q;
    }
}

TEST(Config, TheParameterNamesEveryObserverOfTheList)
{
    EXPECT_EQ(drive_param_table[DRIVE_PARAM_observer].min, 0);
    EXPECT_EQ(drive_param_table[DRIVE_PARAM_observer].max, OBSERVER_COUNT - 1);
}

TEST(Config, IsTheFormulasForIpm1000)
{
    const drive_config_t c = configure(defaults());
    for (const Check &x : ipm_1000(c)) {
        EXPECT_NEAR(real(x.got, x.bits), x.expected,
                    kRelative * std::abs(x.expected) + std::ldexp(1.0, -x.bits))
            << x.name;
    }
    EXPECT_NEAR(value(c.base.v), 450, 450 * kRelative);
    EXPECT_NEAR(value(c.base.i), 10, 10 * kRelative);
    EXPECT_NEAR(value(c.base.omega), 540, 540 * kRelative);
    EXPECT_NEAR(value(c.base.psi), 450.0 / 540, kRelative);
    EXPECT_NEAR(value(c.base.torque), 1.5 * 3 * 450.0 / 540 * 10, 40 * kRelative);
    EXPECT_NEAR(value(c.base.t_s), 1e-4, 1e-4 * kRelative);
    EXPECT_EQ(c.pulses.periods, std::lround(4 * 43e-3 / (2.0 / 3 * 300 * 1e-4)));
    EXPECT_EQ(c.modulator.counts, 8500);
    EXPECT_GT(c.modulator.per_zone[0], 0);
    EXPECT_EQ(c.open_loop.align_ms, 300);
    EXPECT_NEAR(c.open_loop.sweep * 0x1p-32, 0.5 / 300, 1e-6);
    EXPECT_EQ(c.protection.stall_ms, 1000);
    EXPECT_EQ(c.protection.lost_ms, 30);
    EXPECT_EQ(c.protection.temp_derate_dC, 900);
    EXPECT_EQ(c.protection.temp_trip_dC, 1100);
    // a sine of the saliency map answers a quarter of its period and 1.5 periods of the PWM later
    EXPECT_NEAR(c.saliency_map.sine.lag, 1.5 * c.saliency_map.sine.step + 0x40000000, 2);
}

// Limits that may be reached.
TEST(Config, UpToTheLimitIsAccepted)
{
    configure(changed({{DRIVE_PARAM_i_trip, 10}}));
    configure(changed({{DRIVE_PARAM_v_dc_max, 450}}));
    configure(changed({{DRIVE_PARAM_i_open_loop, 5}}));
    configure(changed({{DRIVE_PARAM_i_pulse, 9}}));
}

// Twice the zone of dead time, eight times the noise or a 64th of rated current, whichever is most; squared.
TEST(Config, OpenPhaseIsJudgedAboveWhatIsNotKnown)
{
    const double A = 1 / 10.0;
    const auto judged = [](const Changes &x) { return real(configure(changed(x)).protection.judged); };
    const Changes none = {
        {DRIVE_PARAM_leg_capacitance, 0}, {DRIVE_PARAM_comp_zone, 0.02}, {DRIVE_PARAM_i_noise, 1e-3}};
    EXPECT_NEAR(judged(none), std::pow(4 * A / 64, 2), 1e-6);
    Changes zone = none, noise = none;
    zone[1].second = 0.3;
    noise[2].second = 0.05;
    EXPECT_NEAR(judged(zone), std::pow(0.6 * A, 2), 1e-6);
    EXPECT_NEAR(judged(noise), std::pow(0.4 * A, 2), 1e-6);
    // with a carrier what dead time takes, over the gain of current control; at most two of the base
    const auto with_carrier = [&](double dead_s) {
        const drive_config_t c =
            configure(changed({none[0], none[1], none[2], {DRIVE_PARAM_dead_time, dead_s}}));
        const double gain = 2 * M_PI * 500 * 43e-3 * real(c.position.current_low, 31);
        const double expected = std::pow(std::max(dead_s * 10e3 * 300 / gain * A, 4 * A / 64), 2);
        EXPECT_NEAR(real(c.protection.judged_carrier), expected, 1e-6) << dead_s;
        EXPECT_NEAR(real(c.protection.judged), std::pow(4 * A / 64, 2), 1e-6) << dead_s;
    };
    with_carrier(2e-6);
    with_carrier(5e-6);
}

// What half of the lost voltage may turn a tied observer by counts 0.15 at most: IPM-1000 is sure of its EMF, a
// bridge of five times the dead time is not.
TEST(Config, ATiedObserverCountsAsFarAsItsVoltageIsKnown)
{
    EXPECT_EQ(configure(defaults()).position.tied_share, PM_UNIT_MAX);
    const double lost = 10e-6 * 10e3 * 300 + 1;
    EXPECT_NEAR(real(configure(changed({{DRIVE_PARAM_dead_time, 10e-6}})).position.tied_share, 31),
                0.3 * 2 * M_PI * 25 * 0.236 / lost, 1e-6);
}

TEST(Config, SwitchesSwitch)
{
    EXPECT_EQ(configure(changed({{DRIVE_PARAM_mtpa, 0}})).mtpa.h, 0);
    EXPECT_EQ(configure(changed({{DRIVE_PARAM_dead_time_comp, 0}})).modulator.per_zone[0], 0);
    EXPECT_EQ(configure(changed({{DRIVE_PARAM_dead_time_comp, 0}})).modulator.ripple, 0);
    // T_s / (4 L edge) V; with 0.03 A at most 0.94 of it, at half of 400 V
    EXPECT_EQ(configure(changed({})).modulator.ripple, 0);
    EXPECT_NEAR(real(configure(changed({{DRIVE_PARAM_comp_zone, 0.02}})).modulator.ripple, 18),
                1e-4 / (2 * (43e-3 + 75e-3)) * 450 / 0.02, 1e-4);
    EXPECT_EQ(configure(changed({{DRIVE_PARAM_saturation_comp, 0}})).position.observer.active_flux.model.L_q2,
              0);
    EXPECT_EQ(configure(changed({{DRIVE_PARAM_resistance_adaptation, 0}}))
                  .position.observer.active_flux.resistance.k,
              0);
    const drive_config_t c = configure(changed({{DRIVE_PARAM_cross_coupling_comp, 0}}));
    EXPECT_EQ(c.position.injection.pulsating_square.saliency.lambda_1, 0);
    EXPECT_EQ(c.position.injection.pulsating_square.saliency.lambda_2, 0);
    EXPECT_EQ(configure(changed({{DRIVE_PARAM_i_fw_max, 0}})).field_weakening.i_max, 0);
}

// MTPA is left out below a saliency of 1 % of L_q.
TEST(Config, NegligibleSaliencyIsNone)
{
    for (const double share : {0.008, 0.009, 0.011, 0.02}) {
        const double L_q_H = 0.2;
        drive_params_t p = defaults();
        p.start_method = 2;
        p.L_q = p.L_q_rated = static_cast<int32_t>(std::lround(L_q_H * 1e9));
        p.L_d = static_cast<int32_t>(std::lround((1 - share) * L_q_H * 1e9));
        const mtpa_config_t c = configure(p).mtpa;
        const double h = p.psi_m * 1e-9 / (2 * share * L_q_H) / 10;
        if (share > 0.01) {
            EXPECT_NEAR(real(c.h), h, 1e-4 * h) << share;
        } else {
            EXPECT_LT(h, 8) << "the test needs a case that the format could hold";
            EXPECT_EQ(c.h, 0) << share;
        }
    }
}

// Where the current follows its voltage within a period, L < R T, the integral follows the limit by no more than the whole.
TEST(Config, AWindingThatFollowsWithinAPeriodIsNotRefused)
{
    const double R = 5, L = 0.4e-3, T = 1e-4, Z = 450.0 / 10;
    const drive_config_t c = configure(changed({{DRIVE_PARAM_R_s, R},
                                                {DRIVE_PARAM_L_d, L},
                                                {DRIVE_PARAM_L_q, L},
                                                {DRIVE_PARAM_L_q_rated, L},
                                                {DRIVE_PARAM_L_dh_rated, L},
                                                {DRIVE_PARAM_L_qh_rated, L},
                                                {DRIVE_PARAM_L_dqh_rated, 0},
                                                {DRIVE_PARAM_start_method, 2}}));
    const pm_pi_config_t d = c.regulator.synchronous_pi.d;
    EXPECT_NEAR(real(d.ki, 26), 2 * kPi * 500 * R * T / Z, kRelative);
    EXPECT_NEAR(real(d.kp, 26), 2 * kPi * 500 * L / Z, kRelative);
    EXPECT_NEAR(real(d.kb, 31), 15.0 / 16, kRelative);
}

// Deadbeat responds like a first-order lag of one period: f_pwm / 2 pi. While a source needs current control to be slow, the
// share of the bandwidth that it is given is in proportion.
TEST(Config, BandwidthOfDeadbeatIsThatOfItsPeriod)
{
    const auto share = [](double regulator) {
        return real(configure(changed({{DRIVE_PARAM_injection, INJECTION_pulsating_sine},
                                       {DRIVE_PARAM_regulator, regulator},
                                       {DRIVE_PARAM_current_bandwidth, 500},
                                       {DRIVE_PARAM_start_method, 1}}))
                        .position.current_low,
                    31);
    };
    const double slow = share(REGULATOR_synchronous_pi), deadbeat = share(REGULATOR_deadbeat);
    ASSERT_LT(slow, 0.999);
    EXPECT_NEAR(deadbeat / slow, 500 / (10e3 / (2 * kPi)), 1e-4);
}

TEST(Config, SlidingGainIsOfTheNominalLink)
{
    for (const double gain : {0.02, 0.05, 0.3}) {
        const drive_params_t p =
            changed({{DRIVE_PARAM_observer, OBSERVER_sliding_mode}, {DRIVE_PARAM_sliding_gain, gain}});
        EXPECT_NEAR(real(configure(p).position.observer.sliding_mode.k_base),
                    gain * p.v_dc_nominal * 1e-3 / 450, kRelative);
    }
}

// second_harmonic.h takes the loop's gains: 2 zeta w_n with a damping of 0.9, and w_n^2, per unit.
TEST(Config, SecondHarmonicHasTheGainsOfTheLoop)
{
    const drive_params_t p = changed({{DRIVE_PARAM_second_harmonic, 1}, {DRIVE_PARAM_flux_bandwidth, 30}});
    const second_harmonic_config_t c = configure(p).position.second_harmonic;
    const double w_n = 2 * kPi * 30 / 540;
    EXPECT_NEAR(real(c.k_p), 2 * 0.9 * w_n, kRelative);
    EXPECT_NEAR(real(c.k_i), w_n * w_n, kRelative);
    EXPECT_EQ(c.k_1, 0);
}

// What a configuration was before does not matter: with other parameters in the same memory.
TEST(Config, NothingIsLeftOfTheOneBefore)
{
    const drive_params_t plain = changed({{DRIVE_PARAM_saturation_comp, 0}, {DRIVE_PARAM_mtpa, 0}});
    drive_config_t c = configure(defaults());
    ASSERT_NE(c.position.observer.active_flux.model.L_q2, 0);
    ASSERT_NE(c.mtpa.h, 0);
    ASSERT_TRUE(drive_configure(&c, &plain, PM_CHANNELS).ok);
    EXPECT_EQ(c.position.observer.active_flux.model.L_q2, 0);
    EXPECT_EQ(c.mtpa.h, 0);
}

// 1.3.2.1: legs at the bottom, the middle one still seen: 2/3 of the share of the period that is left.
TEST(Config, LowSideShuntsBoundTheVoltage)
{
    for (const double f_pwm : {10e3, 20e3, 40e3}) {
        const drive_params_t in_line =
            changed({{DRIVE_PARAM_voltage_limit, 1.1547}, {DRIVE_PARAM_f_pwm, f_pwm}});
        drive_params_t below = in_line;
        drive_param_set(&below, DRIVE_PARAM_t_settle, 1300);
        const double dead = 2e-6 * f_pwm;
        const double lost = dead + 1.0 / 60; // the device drop at the smallest link voltage
        const double top = 1 - 2 * f_pwm * 3.3e-6 - dead - 2 * lost - 0x1p-11;
        EXPECT_NEAR(std::ldexp(configure(in_line).v_share, -31), 2.0 / 3, 1e-4);
        EXPECT_NEAR(std::ldexp(configure(below).v_share, -31), 2.0 / 3 * top, 3e-5) << f_pwm;
    }
}

// The flux of a pulse is that asked for, at a duty that leaves the currents to be seen.
TEST(Config, PulsesAreAsLongAsTheirFluxAsks)
{
    for (const double t_settle : {0.0, 1.3e-6, 5e-6}) {
        for (double i_pulse = 0.4; i_pulse < 4; i_pulse *= 1.07) {
            const drive_params_t p = changed({{DRIVE_PARAM_t_settle, t_settle},
                                              {DRIVE_PARAM_i_pulse, i_pulse},
                                              {DRIVE_PARAM_start_method, 1},
                                              {DRIVE_PARAM_f_pwm, 20e3}});
            const pulses_config_t c = configure(p).pulses;
            const double whole = p.i_pulse * 1e-3 * p.L_d * 1e-9 / (2.0 / 3 * p.v_dc_nominal * 1e-3 / 20e3);
            const double top = t_settle > 0 ? 1 - 2 * 20e3 * (2e-6 + t_settle) : 1;
            ASSERT_LE(real(c.duty), top + 1e-5) << t_settle << ' ' << i_pulse;
            ASSERT_NEAR(real(c.duty) * c.periods, whole, 3e-4 * whole) << t_settle << ' ' << i_pulse;
        }
    }
}

TEST(Config, DcLinkPulsesNeedALinkThatShowsThem)
{
    const auto refused = [](int32_t R_mohm, int32_t C_nF) {
        drive_params_t p;
        drive_params_default(&p);
        p.position_pulses = 4;
        p.dc_resistance = R_mohm;
        p.dc_capacitance = C_nF;
        drive_config_t c = {};
        return drive_configure(&c, &p, PM_CHANNELS);
    };
    EXPECT_TRUE(refused(10000, 100000).ok);
    EXPECT_EQ(refused(1, 100000).param, DRIVE_PARAM_dc_resistance);
    EXPECT_EQ(refused(10000, 1000000000).param, DRIVE_PARAM_dc_capacitance);
}

// An upper switch that is held closed shows a low-side shunt nothing. Those that are not: up to all that leaves b = 2 f_pwm (T_dt +
// t_settle) of a period, or twice that.
TEST(Config, ABlockPatternThatHidesTheCurrentIsRefused)
{
    for (int32_t pattern = 0; pattern <= 5; ++pattern) {
        for (const int32_t t_settle : {0, 1300}) {
            drive_params_t p;
            drive_params_default(&p);
            p.commutation = 1;
            p.pattern = pattern;
            p.f_pwm = 20000;
            p.dead_time = 500;
            p.t_settle = t_settle;
            drive_config_t c = {};
            const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
            const bool holds = pattern >= 2 && pattern <= 4;
            ASSERT_EQ(r.ok, t_settle == 0 || !holds) << pattern << ' ' << r.reason;
            if (!r.ok) {
                EXPECT_EQ(r.param, DRIVE_PARAM_pattern);
                continue;
            }
            const double b = t_settle == 0 ? 0 : 2 * 20e3 * 1.8e-6;
            const pattern_config_t &made = c.block.six_step.pattern;
            EXPECT_EQ(made.low_side, t_settle != 0);
            EXPECT_NEAR(std::ldexp(c.block.current.most, -28), pattern == 0 ? 1 - 2 * b : 1, 1e-5);
            EXPECT_NEAR(std::ldexp(made.shown, -28),
                        pattern == 0 && b != 0 ? 0 : 1 - (pattern == 5 ? 2 : 1) * b, 1e-5);
        }
    }
}

TEST(Config, ACarrierThatTheLegsCannotMakeAboutHalfDutyIsRefused)
{
    const auto refused = [](int32_t v_injection_mV, int32_t t_settle_ns = 0) {
        drive_params_t p;
        drive_params_default(&p);
        p.start_method = 1;
        p.position_find = 2;
        p.polarity = 3;
        p.injection = 4;
        p.f_pwm = t_settle_ns != 0 ? 40000 : 10000;
        p.dead_time = t_settle_ns != 0 ? 1000 : 2000;
        p.f_injection = p.f_pwm * 50; // N = 20
        p.t_settle = t_settle_ns;
        p.v_injection = v_injection_mV;
        drive_config_t c = {};
        return drive_configure(&c, &p, PM_CHANNELS);
    };
    EXPECT_TRUE(refused(100000).ok);
    EXPECT_EQ(refused(200000).param, DRIVE_PARAM_v_injection);
    // Low-side shunts that see nothing for 4 us behind an edge leave 0.68 of a period: 0.18 of the 300 V about half duty.
    const drive_result_t shunts = refused(57000, 3000);
    EXPECT_EQ(shunts.param, DRIVE_PARAM_v_injection) << shunts.reason;
    EXPECT_NE(std::string(shunts.reason).find("half duty"), std::string::npos) << shunts.reason;
    EXPECT_TRUE(refused(51000, 3000).ok) << refused(51000, 3000).reason;
}

// 4/3 of 6 V of dead time and 1 V of a device. Left to itself the drive then starts without injection.
TEST(Config, ACarrierThatDeadTimeTakesDoesNotLead)
{
    const auto made = [](int32_t start_method, int32_t v_injection_mV) {
        drive_params_t p;
        drive_params_default(&p);
        p.start_method = start_method;
        p.v_injection = v_injection_mV;
        drive_config_t c = {};
        const drive_result_t result = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_EQ(result.ok || result.param == DRIVE_PARAM_v_injection, true) << result.reason;
        return result.ok ? c.injection : -1;
    };
    for (const int32_t asked : {1, 3}) {
        EXPECT_EQ(made(asked, 9333), -1);
        EXPECT_EQ(made(asked, 9334), 1);
    }
    EXPECT_EQ(made(0, 9333), 0);
    EXPECT_EQ(made(2, 9333), 0);
}

// The edges of a square wave's legs: half up to an eighth of the swing and half up to all of it; one part up to half of the swing where
// that eighth is inside of the zone without a carrier; that zone where the half is too.
TEST(Config, ASquareWaveHasItsOwnZones)
{
    const auto made = [](double comp_zone) {
        return configure(changed({{DRIVE_PARAM_v_injection, 100}, {DRIVE_PARAM_comp_zone, comp_zone}}))
            .modulator;
    };
    const double swing = 100 * 1e-4 / (2 * 43e-3); // 0.116 A
    const auto edge = [](const modulator_config_t &c) { return 10 / (c.per_zone[1] * 0x1p-20); };
    EXPECT_NEAR(edge(made(0.012)), swing / 8, 1e-4);
    EXPECT_EQ(made(0.012).far[1], 2);
    EXPECT_EQ(made(0.012).far[0], 0);
    EXPECT_NEAR(edge(made(0.02)), swing / 2, 1e-4);
    EXPECT_EQ(made(0.02).far[1], 0);
    EXPECT_NEAR(edge(made(0.06)), 0.06, 1e-4);
    EXPECT_EQ(made(0.06).far[1], 0);
}

// Without dead time there is nothing that the capacitance of a leg could give back.
TEST(Config, CapacitanceOfALegNeedsADeadTime)
{
    const auto far = [](double dead_time_s) {
        return configure(changed({{DRIVE_PARAM_leg_capacitance, 2e-9}, {DRIVE_PARAM_dead_time, dead_time_s}}))
            .modulator.far[0];
    };
    EXPECT_EQ(far(0), 0);
    EXPECT_NE(far(2e-6), 0);
}

TEST(Config, StartFollowsTheMachine)
{
    const auto start = [](const Changes &x) {
        const drive_config_t c = configure(changed(x));
        return std::make_pair(c.injection, sequence_id_t(c.start));
    };
    EXPECT_EQ(start({}), std::make_pair(true, SEQUENCE_pulses_align));
    EXPECT_EQ(start({{DRIVE_PARAM_start_fallback, 0}}), std::make_pair(true, SEQUENCE_pulses));
    EXPECT_EQ(start({{DRIVE_PARAM_L_d, 74e-3}}), std::make_pair(false, SEQUENCE_align));   // no saliency
    EXPECT_EQ(start({{DRIVE_PARAM_i_noise, 0.1}}), std::make_pair(false, SEQUENCE_align)); // not seen
    EXPECT_EQ(start({{DRIVE_PARAM_start_method, 1}}), std::make_pair(true, SEQUENCE_pulses_align));
    EXPECT_EQ(start({{DRIVE_PARAM_start_method, 2}}), std::make_pair(false, SEQUENCE_align));
    EXPECT_EQ(start({{DRIVE_PARAM_start_method, 3}}), std::make_pair(true, SEQUENCE_align));
}

// Parameter sets drawn at random: a fourth over the whole ranges, the others around the defaults, so that
// many are accepted.
class Draw
{
  public:
    drive_params_t next()
    {
        drive_params_t p = defaults();
        const bool wide = n_++ % 4 == 0;
        const double share = random_.within(0.02, 0.5);
        for (int id = 0; id < DRIVE_PARAM_COUNT; ++id) {
            const drive_param_info_t &x = drive_param_table[id];
            double v = x.def;
            if (wide) {
                if (random_.within(0, 1) < 0.3) { // logarithmic where the range has decades
                    const double lo = std::max(1.0, static_cast<double>(x.min));
                    v = x.max > 100 && x.min >= 0 ? lo * std::pow(x.max / lo, random_.within(0, 1))
                                                  : random_.within(x.min, x.max);
                }
            } else if (random_.within(0, 1) < share) {
                const double spread = random_.within(0, 1) < 0.2 ? 100 : 2;
                v = x.def * std::pow(spread, random_.within(-1, 1));
            }
            if (x.max == 1 || x.max == 3) {
                v = std::floor(random_.within(0, x.max + 1));
            }
            v = std::clamp(v, static_cast<double>(x.min), static_cast<double>(x.max));
            drive_param_set(&p, static_cast<drive_param_id_t>(id), static_cast<int32_t>(v));
        }
        p.winding = n_ % 8 == 3 ? 1 : 0;
        if (p.winding == 1) { // most else would be refused for what a star alone has
            p.L_0 = std::max(p.L_0, p.L_d / 2);
            p.start_method = 2;
            p.flying_start = p.commutation = p.t_settle = p.regulator = 0;
        }
        return p;
    }

  private:
    samples::Random random_;
    int n_ = 0;
};

using gains::Names;

Names observer_must_be_positive(const observer_config_t &o)
{
    switch (o.id) {
#define PM_METHOD(x, help, traits, needs)                                                                    \
    case OBSERVER_##x:                                                                                       \
        return gains::must_be_positive(o.x);
#include "observers/observers.def"
#undef PM_METHOD
    default:
        return {};
    }
}

Names injection_must_be_positive(const injection_config_t &i)
{
    switch (i.id) {
#define PM_METHOD(x, help, traits, needs)                                                                    \
    case INJECTION_##x:                                                                                      \
        return gains::must_be_positive(i.x);
#include "injection/injections.def"
#undef PM_METHOD
    default:
        return {};
    }
}

Names regulator_must_be_positive(const regulator_config_t &r)
{
    switch (r.id) {
#define PM_METHOD(x, help, traits, needs)                                                                    \
    case REGULATOR_##x:                                                                                      \
        return gains::must_be_positive(r.x);
#include "firmware/control/regulators.def"
#undef PM_METHOD
    default:
        return {};
    }
}

// What must be above zero in any configuration that is accepted.
Names must_be_positive(const drive_config_t &c)
{
    Names x = {
        {"counts", c.modulator.counts},
        {"L_d", c.machine.L_d},
        {"L_q", c.machine.L_q},
        {"psi_m", c.machine.psi_m},
        {"speed kb", c.speed.pi.kb},
        {"speed slope", c.speed.slope},
        {"fw k", c.field_weakening.k},
        {"pll_low kp", c.position.pll_low.kp_turn},
        {"pll_low ki", c.position.pll_low.ki},
        {"pll_high kp", c.position.pll_high.kp_turn},
        {"pll_high ki", c.position.pll_high.ki},
        {"k_theta", c.k_theta},
        {"per_span", c.position.per_span},
        {"open-loop i", c.open_loop.i},
        {"open-loop slope", c.open_loop.slope},
        {"open-loop sweep", c.open_loop.sweep},
        {"i_max", c.i_max},
        {"omega_max", c.omega_max},
        {"omega_stall", c.protection.omega_stall},
        {"i_trip_squared", c.protection.i_trip_squared},
        {"heat_max", c.protection.heat_max},
        {"k_heat", c.protection.k_heat},
    };
    for (const Names &names :
         {observer_must_be_positive(c.position.observer), regulator_must_be_positive(c.regulator)}) {
        x.insert(x.end(), names.begin(), names.end());
    }
    if (c.position.loop.id == LOOP_SIMPLIFIED_EKF) {
        x.push_back({"K_1", c.position.loop.k_acceleration});
    }
    if (c.position.second_harmonic.id != SECOND_HARMONIC_STAYS) {
        x.push_back({"second harmonic mu", c.position.second_harmonic.mu});
        x.push_back({"second harmonic k_p", c.position.second_harmonic.k_p});
    }
    if (c.position.mismatch.id != MISMATCH_OFF) {
        x.push_back({"mismatch samples", c.position.mismatch.samples - 8}); // 100 Hz, steps of 1.1 ms
        x.push_back({"mismatch current", c.position.mismatch.i});
    }
    if (c.injection) {
        const Names names = injection_must_be_positive(c.position.injection);
        x.insert(x.end(), names.begin(), names.end());
    }
    if (c.start != SEQUENCE_align) {
        x.push_back({"pulse periods", c.pulses.periods});
        x.push_back({"pulse duty", c.pulses.duty});
        x.push_back({"pulse timeout beyond the pulse", c.pulses.timeout - c.pulses.periods});
        x.push_back({"s_min", c.pulses.s_min});
    }
    return x;
}

// Gain of the injection loop at a current: it must not turn round below the current limit.
double injection_gain(const drive_config_t &c, double i_q)
{
    const auto at = [i_q](const saliency_config_t &s) {
        return real(s.gain_0, 20) + real(s.gain_2, 16) * i_q * i_q;
    };
    switch (c.position.injection.id) {
#define PM_METHOD(x, help, traits, needs)                                                                    \
    case INJECTION_##x:                                                                                      \
        return at(gains::saliency_of(c.position.injection.x));
#include "injection/injections.def"
#undef PM_METHOD
    default:
        return 0;
    }
}

struct Survey {
    int accepted = 0, injecting = 0, open = 0;
    std::map<std::string, int> bad, known;
};

Survey survey(int draws)
{
    Draw draw;
    Survey s;
    for (int n = 0; n < draws; ++n) {
        const drive_params_t p = draw.next();
        drive_config_t c = {};
        if (!drive_configure(&c, &p, PM_CHANNELS).ok) {
            continue;
        }
        ++s.accepted;
        for (const auto &[name, x] : must_be_positive(c)) {
            s.bad[name] += x <= 0 ? 1 : 0;
        }
        s.known["speed kp"] += c.speed.pi.kp <= 0 ? 1 : 0;
        s.known["speed ki"] += c.speed.pi.ki <= 0 ? 1 : 0;
        if (c.winding == WINDING_OPEN) {
            ++s.open;
            s.bad["k_p of the zero sequence"] += c.open_winding.k_p <= 0 ? 1 : 0;
            s.bad["k_r of the zero sequence"] += c.open_winding.k_r <= 0 ? 1 : 0;
        }
        if (c.injection) {
            ++s.injecting;
            const double i_rated = p.i_rated / static_cast<double>(p.i_full_scale);
            s.known["injection gain at i_rated"] += injection_gain(c, i_rated) <= 0 ? 1 : 0;
        }
    }
    return s;
}

// The formulas of observers/mras.h, loop.h, speed.h and second_harmonic.h for IPM-1000.
TEST(Config, ModelReferenceLoopAndSpeed)
{
    const double W = 3 * 180.0, T = 1e-4, w_n = 2 * M_PI * 25, r = 0.7067 * w_n;
    for (const observer_id_t id : {OBSERVER_mras_current, OBSERVER_mras_voltage, OBSERVER_mras_simple}) {
        const drive_config_t c = configure(changed({{DRIVE_PARAM_observer, id},
                                                    {DRIVE_PARAM_position_observer, LOOP_SIMPLIFIED_EKF},
                                                    {DRIVE_PARAM_second_harmonic, SECOND_HARMONIC_NOTCH},
                                                    {DRIVE_PARAM_speed_estimator, SPEED_COMBINED}}));
        ASSERT_EQ(c.position.observer.id, id);
        const mras_config_t &m = c.position.observer.mras_current;
        const active_flux_config_t flux = configure(changed({})).position.observer.active_flux;
        EXPECT_EQ(std::memcmp(&m.model, &flux.model, sizeof m.model), 0);
        EXPECT_NEAR(real(m.k, 32), 2 * M_PI * 50 * T, 1e-8);
        EXPECT_NEAR(real(m.emf_min), 21.0 * 3 / W / 4 * real(m.model.psi_m), 1e-7);
        EXPECT_NEAR(real(m.turn, 32), std::min(0.49, 1e-3 * W / (2 * (75e-3 - 43e-3) * 4 / 0.236 + 0.2)),
                    1e-6);
        EXPECT_NEAR(real(c.position.loop.k_acceleration, 36), r * r * r * T * T / W, 1e-9);
        EXPECT_NEAR(real(c.position.pll_high.ki, 32), 2 * r * r * T / W, 1e-8);
        EXPECT_NEAR(real(c.position.pll_high.kp_turn, 32), 2 * r * T * 2 / M_PI, 1e-8);
        EXPECT_NEAR(real(c.position.second_harmonic.k_p), 2 * r / W, 1e-7);
        EXPECT_NEAR(real(c.position.second_harmonic.k_i), 2 * r * r / W / W, 1e-7);
        EXPECT_NEAR(real(c.position.second_harmonic.k_1), std::pow(r / W, 3), 1e-7);
        EXPECT_NEAR(real(c.position.second_harmonic.mu, 32), 40 * T, 1e-8);
        EXPECT_NEAR(real(c.position.speed.per_turn, 26), 2 * M_PI / (6e-3 * W), 1e-6);
        EXPECT_NEAR(real(c.position.speed.k_mean, 32), 2 * M_PI * 5e-3, 1e-8);
    }
}

// observers/mismatch.h for IPM-1000: 40 Hz are 25 steps of 1 kHz, 30 Hz become 1 / 33 ms.
TEST(Config, CorrectionOfWrongParameters)
{
    EXPECT_FALSE(configure(changed({})).position.corrects);
    for (const auto &[frequency, samples] : {std::pair{40.0, 25}, {30.0, 33}, {2.0, 500}, {100.0, 10}}) {
        const drive_config_t c = configure(changed({{DRIVE_PARAM_mismatch_correction, MISMATCH_Q_AXIS},
                                                    {DRIVE_PARAM_mismatch_frequency, frequency}}));
        const mismatch_config_t &m = c.position.mismatch;
        EXPECT_TRUE(c.position.corrects);
        EXPECT_EQ(m.id, MISMATCH_Q_AXIS);
        EXPECT_EQ(m.periods, 10);
        EXPECT_EQ(m.samples, samples);
        EXPECT_NEAR(real(m.i), 0.04, 1e-8);
        const double w = 2 * M_PI / (samples * 1e-3), psi = 450 / (3 * 180.0);
        const double swing = 1.5 * 9 * psi * 10 / (0.01 * w * w);
        EXPECT_NEAR(real(m.swing, 20), swing, 1e-6 + 1e-8 * swing) << frequency;
    }
    const drive_params_t light = changed({{DRIVE_PARAM_mismatch_correction, MISMATCH_Q_AXIS},
                                          {DRIVE_PARAM_mismatch_frequency, 2},
                                          {DRIVE_PARAM_J, 1e-6}});
    drive_config_t c;
    EXPECT_EQ(drive_configure(&c, &light, PM_CHANNELS).param, DRIVE_PARAM_mismatch_frequency);
}

TEST(Config, TheArctangentLeavesNothingToLearnASecondHarmonicFrom)
{
    const drive_params_t params = changed({{DRIVE_PARAM_position_observer, LOOP_ARCTANGENT},
                                           {DRIVE_PARAM_second_harmonic, SECOND_HARMONIC_NOTCH}});
    drive_config_t c;
    const drive_result_t result = drive_configure(&c, &params, PM_CHANNELS);
    EXPECT_FALSE(result.ok);
    EXPECT_EQ(result.param, DRIVE_PARAM_second_harmonic);
}

// A gimbal's winding on the drive board, whose scales are those of another kind of motor: impedances far above their ratio,
// 0.57 ohm. The base of the voltages grows, as far as v_dc_min leaves it.
drive_params_t gimbal(double R_ohm, double L_H, double v_dc_min_V)
{
    return changed({{DRIVE_PARAM_i_full_scale, 60.156},
                    {DRIVE_PARAM_v_full_scale, 34.283},
                    {DRIVE_PARAM_v_dc_nominal, 24},
                    {DRIVE_PARAM_v_dc_min, v_dc_min_V},
                    {DRIVE_PARAM_v_dc_derate, 28},
                    {DRIVE_PARAM_v_dc_max, 30},
                    {DRIVE_PARAM_pole_pairs, 11},
                    {DRIVE_PARAM_R_s, R_ohm},
                    {DRIVE_PARAM_L_d, L_H},
                    {DRIVE_PARAM_L_q, L_H},
                    {DRIVE_PARAM_L_q_rated, L_H},
                    {DRIVE_PARAM_L_dh_rated, L_H},
                    {DRIVE_PARAM_L_qh_rated, L_H},
                    {DRIVE_PARAM_L_dqh_rated, 0},
                    {DRIVE_PARAM_cross_half, 0},
                    {DRIVE_PARAM_psi_m, 0.012},
                    {DRIVE_PARAM_J, 2e-5},
                    {DRIVE_PARAM_i_rated, 1},
                    {DRIVE_PARAM_i_max, 1.2},
                    {DRIVE_PARAM_i_trip, 5},
                    {DRIVE_PARAM_i_open_loop, 0.6},
                    {DRIVE_PARAM_i_pulse, 1},
                    {DRIVE_PARAM_i_fw_max, 0},
                    {DRIVE_PARAM_speed_max, 100},
                    {DRIVE_PARAM_speed_trip, 130},
                    {DRIVE_PARAM_speed_low, 8},
                    {DRIVE_PARAM_speed_high, 14},
                    {DRIVE_PARAM_start_method, 2},
                    {DRIVE_PARAM_device_drop, 0},
                    {DRIVE_PARAM_v_injection, 2},
                    {DRIVE_PARAM_i_noise, 0.012},
                    {DRIVE_PARAM_dead_time, 0.5e-6}});
}

TEST(Config, GimbalsAreAccepted)
{
    for (const double v_dc_min : {8.6, 12.0, 17.2}) {
        for (const double R : {4.0, 8.0, 12.0, 16.0, 20.0}) {
            for (const double L : {0.2e-3 * R, 2e-3, 4e-3, 10e-3}) { // of two periods and more
                if (L < 0.2e-3 * R) {
                    continue;
                }
                const drive_params_t p = gimbal(R, L, v_dc_min);
                drive_config_t c = {};
                const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
                const double most_ohm =
                    34.283 / 60.156 * (v_dc_min < 17 ? 4 : 8); // of a base of 4 or 8 times full scale
                if (R > 8 * most_ohm || L * 130 * 11 > 4 * most_ohm) {
                    EXPECT_EQ(r.param, R > 8 * most_ohm ? DRIVE_PARAM_R_s : DRIVE_PARAM_L_q) << R << ' ' << L;
                    EXPECT_NE(std::string(r.reason).find("raise v_dc_min"), std::string::npos);
                    continue;
                }
                ASSERT_TRUE(r.ok) << R << ' ' << L << ' ' << drive_param_table[r.param].name << ' '
                                  << r.reason;
                const double shift = 28 - 16 - c.protection.v_bits, v = 34.283 * std::pow(2, shift);
                EXPECT_NEAR(bench::real(c.machine.R_s), R / (v / 60.156), 1e-5);
                EXPECT_NEAR(bench::real(c.machine.psi_m), 0.012 / (v / (130 * 11)), 1e-6);
                EXPECT_NEAR(bench::real(c.protection.v_dc_max), 30 / v, 1e-6);
                EXPECT_GE(bench::real(c.protection.v_dc_min), 1.0 / 16);
                // a code of the link is the voltage that it stands for
                EXPECT_NEAR(std::ldexp(30 / 34.283 * 65536, c.protection.v_bits - 28), 30 / v, 1e-6);
            }
        }
    }
}

// Of a motor with rated current at a third to a sixtieth of the channels: L_q + (L_q_rated - L_q) (i/i_rated)^2.
TEST(Config, AnInductanceThatFallsToATenthIsHeldAtAnyScale)
{
    const double L_q = 75e-3, L_q_rated = 7.5e-3, L_base = 450.0 / (180 * 3) / 10;
    for (const double i_rated : {3.3, 1.0, 0.33, 0.17}) {
        const drive_config_t c = configure(changed({{DRIVE_PARAM_L_q_rated, L_q_rated},
                                                    {DRIVE_PARAM_L_dh_rated, 10e-3},
                                                    {DRIVE_PARAM_L_qh_rated, 5e-3},
                                                    {DRIVE_PARAM_L_dqh_rated, 0},
                                                    {DRIVE_PARAM_cross_half, 0},
                                                    {DRIVE_PARAM_start_method, 2},
                                                    {DRIVE_PARAM_i_rated, i_rated},
                                                    {DRIVE_PARAM_i_max, 1.25 * i_rated},
                                                    {DRIVE_PARAM_i_fw_max, 0},
                                                    {DRIVE_PARAM_i_open_loop, 0.8 * i_rated},
                                                    {DRIVE_PARAM_i_pulse, i_rated}}));
        const observer_model_t &model = c.position.observer.active_flux.model;
        for (const double share : {0.0, 0.25, -0.5, 1.0, -1.0}) {
            const pm_dq_t i = {0, bench::fixed(share * i_rated / 10, 28)};
            EXPECT_NEAR(bench::real(observer_L_q(&model, i)) * L_base,
                        L_q + (L_q_rated - L_q) * share * share, 0.002 * L_q)
                << i_rated << ' ' << share;
        }
        for (const double share : {1.2, 1.5, 3.0}) { // never through zero
            const pm_dq_t i = {0, bench::fixed(std::min(share * i_rated / 10, 1.9), 28)};
            EXPECT_NEAR(bench::real(observer_L_q(&model, i)) * L_base, L_q / 16, 1e-6) << i_rated;
        }
    }
}

// What only methods that are off would use refuses nothing.
TEST(Config, ASlowMachineIsRefusedOnlyByTheMethodThatCannotHoldIt)
{
    const Changes slow = {
        {DRIVE_PARAM_i_full_scale, 20}, {DRIVE_PARAM_speed_trip, 12},        {DRIVE_PARAM_speed_max, 10},
        {DRIVE_PARAM_speed_low, 2},     {DRIVE_PARAM_speed_high, 4},         {DRIVE_PARAM_L_d, 1},
        {DRIVE_PARAM_L_q, 1},           {DRIVE_PARAM_L_q_rated, 1},          {DRIVE_PARAM_L_dh_rated, 1},
        {DRIVE_PARAM_L_qh_rated, 1},    {DRIVE_PARAM_current_bandwidth, 50}, {DRIVE_PARAM_start_method, 2}};
    for (const int32_t estimate : {SPEED_LOOP, SPEED_DIFFERENCE, SPEED_EMF_RATIO}) {
        drive_params_t p = changed(slow);
        p.speed_estimator = estimate;
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_EQ(r.ok, estimate != SPEED_EMF_RATIO) << estimate << ' ' << drive_param_table[r.param].name;
    }
}

TEST(Config, RandomSetsAreRefusedOrMakeSense)
{
    const Survey s = survey(kDraws);
    EXPECT_GT(s.accepted, kDraws / 20);
    EXPECT_GT(s.injecting, kDraws / 50);
    EXPECT_GT(s.open, kDraws / 200);
    for (const auto &[name, count] : s.bad) {
        EXPECT_EQ(count, 0) << name << " of " << s.accepted;
    }
}

// Accepted with a gain of zero or below: reported.
TEST(Config, RandomSetsHaveNoDeadGain)
{
    const Survey s = survey(kDraws);
    for (const auto &[name, count] : s.known) {
        EXPECT_EQ(count, 0) << name << " of " << s.accepted;
    }
}

// The saliency is gone, or turned round, at rated current: the gain of the injection loop stays positive, the current below that.
TEST(Config, InjectsBelowTheCurrentThatTurnsTheSaliencyRound)
{
    for (const double L_qh : {20e-3, 42.55e-3}) {
        const drive_params_t p = changed({{DRIVE_PARAM_L_qh_rated, L_qh}, {DRIVE_PARAM_L_dqh_rated, 0}});
        const drive_config_t c = configure(p);
        EXPECT_TRUE(c.injection) << L_qh;
        EXPECT_GT(injection_gain(c, real(c.i_max)), 0) << L_qh;
        EXPECT_LT(c.i_injection, c.i_max) << L_qh;
    }
}

} // namespace
