#include "firmware/math/pll.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "samples.h"

namespace
{

using samples::q;
using samples::real;

// METHODS.md row 19: a / w_n^2; the sampled loop differs by w_n T_s / 2.
constexpr double kRampError = 0.10;
// Rounding of speed, error and angle step, gathered over the loop's memory; beside it the error that no
// longer moves the speed, 2^-29 / ki.
constexpr double kAngleError_rad = 1e-6;
constexpr double kSpeedError = 1e-5;
// Half of the angle step's resolution, 2^-30 turn.
constexpr double kAngleStep_turn = 0x1p-31;

constexpr double kTurn = 2 * M_PI * 0x1p-32;
constexpr double kPeriod_s = 50e-6;
constexpr double kBase_rad_s = 2 * M_PI * 200;

struct Design {
    double w_n_rad_s, zeta;
};

pm_pll_config_t fixed(const Design &d)
{
    return {static_cast<pm_frac_t>(std::lround(2 * d.zeta * d.w_n_rad_s * kPeriod_s * 2 / M_PI * 0x1p32)),
            static_cast<pm_frac_t>(std::lround(d.w_n_rad_s * d.w_n_rad_s * kPeriod_s / kBase_rad_s * 0x1p32)),
            static_cast<int32_t>(std::lround(16 * kBase_rad_s * kPeriod_s / (2 * M_PI) * 0x1p30))};
}

struct DoublePll {
    Design d;
    double theta = 0, omega = 0; // rad, per-unit

    void step(double truth)
    {
        theta += omega * kBase_rad_s * kPeriod_s;
        const double eps = std::remainder(truth - theta, 2 * M_PI);
        theta += 2 * d.zeta * d.w_n_rad_s * kPeriod_s * eps;
        omega += d.w_n_rad_s * d.w_n_rad_s * kPeriod_s / kBase_rad_s * eps;
    }
};

// eps as the caller makes it from two angles.
double step(pm_pll_t &pll, const pm_pll_config_t &c, double truth_rad)
{
    const double turns = truth_rad / (2 * M_PI);
    const auto truth = static_cast<pm_angle_t>(std::llround((turns - std::floor(turns)) * 0x1p32));
    pm_pll_predict(&pll, &c);
    const pm_q_t eps = pm_angle_to_rad(pm_angle_diff(truth, pll.theta));
    pm_pll_correct(&pll, &c, eps);
    return real(eps);
}

TEST(MathPll, FollowsTheDoubleModel)
{
    for (const Design &d :
         {Design{2 * M_PI * 10, 1.0}, Design{2 * M_PI * 50, 0.707}, Design{2 * M_PI * 200, 1.0}}) {
        const pm_pll_config_t c = fixed(d);
        pm_pll_t pll = {};
        DoublePll model = {d};
        // A step of 1 rad at standstill, then speed ramps as steep as it can follow without a slip.
        const double slew = 0.3 * d.w_n_rad_s * d.w_n_rad_s * kPeriod_s / kBase_rad_s;
        double truth = 1.0, omega = 0, angle = 0, speed = 0;
        for (int k = 0; k < 60000; ++k) {
            const double target = k < 10000 ? 0.0 : (k < 30000 ? 0.5 : -0.3);
            omega += std::clamp(target - omega, -slew, slew);
            truth += omega * kBase_rad_s * kPeriod_s;
            step(pll, c, truth);
            model.step(truth);
            angle = std::max(angle, std::abs(std::remainder(pll.theta * kTurn - model.theta, 2 * M_PI)));
            speed = std::max(speed, std::abs(real(pll.omega) - model.omega));
        }
        EXPECT_LE(angle, kAngleError_rad + 0x1p-29 / (c.ki * 0x1p-32)) << d.w_n_rad_s;
        EXPECT_LE(speed, kSpeedError) << d.w_n_rad_s;
        EXPECT_NEAR(real(pll.omega), -0.3, kSpeedError) << d.w_n_rad_s;
    }
}

TEST(MathPll, RampErrorIsAccelerationOverBandwidthSquared)
{
    const Design d = {2 * M_PI * 40, 0.8};
    const pm_pll_config_t c = fixed(d);
    for (const double acceleration_rad_s2 : {-3000.0, 500.0, 3000.0}) {
        pm_pll_t pll = {};
        double eps = 0;
        for (int k = 1; k <= 8000; ++k) { // 0.4 s
            const double t = k * kPeriod_s;
            eps = step(pll, c, acceleration_rad_s2 * t * t / 2);
        }
        const double expected = acceleration_rad_s2 / (d.w_n_rad_s * d.w_n_rad_s);
        EXPECT_NEAR(eps, expected, std::abs(expected) * kRampError);
    }
}

TEST(MathPll, LocksAcrossTheWrapInBothDirections)
{
    const pm_pll_config_t c = fixed({2 * M_PI * 50, 0.8});
    for (const double omega : {-1.9, 1.9}) {
        pm_pll_t pll = {PM_TURN(0.999), q(omega)};
        double worst = 0;
        for (int k = 0; k < 20000; ++k) {
            const double truth = 0.999 * 2 * M_PI + omega * kBase_rad_s * kPeriod_s * (k + 1);
            worst = std::max(worst, std::abs(step(pll, c, truth)));
        }
        EXPECT_LE(worst, kAngleError_rad) << omega;
    }
}

TEST(MathPll, SpeedSaturatesAtTheLimit)
{
    const pm_pll_config_t c = fixed({2 * M_PI * 200, 1.0});
    pm_pll_t pll = {};
    for (int k = 0; k < 5000; ++k) {
        pm_pll_correct(&pll, &c, q(M_PI));
    }
    EXPECT_EQ(pll.omega, PM_Q(2.0) - 1);
    for (int k = 0; k < 10000; ++k) {
        pm_pll_correct(&pll, &c, q(-M_PI));
    }
    EXPECT_EQ(pll.omega, PM_Q(-2.0));

    pm_pll_config_t largest = c; // the ends of every constant, for the sanitizers
    largest.ki = INT32_MAX;
    largest.kp_turn = INT32_MIN;
    for (const double eps : {M_PI, -M_PI}) {
        for (int k = 0; k < 10; ++k) {
            pm_pll_correct(&pll, &largest, q(eps));
        }
        EXPECT_EQ(pll.omega, eps < 0 ? PM_Q(-2.0) : PM_Q(2.0) - 1);
    }
}

TEST(MathPll, AngleStep)
{
    for (const double base_turn : {0.001, 0.01, 0.1249}) { // per period at base speed
        const auto k_theta = static_cast<int32_t>(std::lround(16 * base_turn * 0x1p30));
        double worst = 0;
        for (double omega = -3.9; omega < 3.9; omega += 0.000317) {
            const double exact = real(q(omega)) * (k_theta * 0x1p-34);
            worst = std::max(worst, std::abs(pm_omega_to_angle(q(omega), k_theta) * 0x1p-32 - exact));
        }
        EXPECT_LE(worst, kAngleStep_turn) << base_turn;
    }
}

} // namespace
