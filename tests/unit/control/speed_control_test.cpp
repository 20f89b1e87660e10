#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "tests/contract/bench.h"
#include "tests/unit/math/samples.h"

namespace
{

using bench::fixed;
using bench::real;

// Wide numbers, 2^-22, a few roundings per call; the loop's memory is some 100 calls.
constexpr double kStep = 4 * 0x1p-22;
constexpr double kTrajectory = 1e-4;
// The feed-forward carries the ramp: what remains is the delay of one call.
constexpr double kRampError = 0.02;

// IPM-1000: 6 Hz, 0.01 kg m2, 3 pole pairs.
constexpr double kBandwidth = 2 * bench::kPi * 6, kJ_kgm2 = 0.01, kPairs = 3, kPsi_Wb = 0.236;
constexpr double kSlow_s = 1e-3, kSlope_rad_s2 = 200;

double per_torque() // A per rad/s2 electrical
{
    return kJ_kgm2 / (1.5 * kPairs * kPairs * kPsi_Wb);
}

speed_control_config_t config()
{
    const double kp = kBandwidth * per_torque() * bench::kIpmBase.omega_rad_s / bench::kIpmBase.i_A;
    const double ki = kp * kBandwidth / 4 * kSlow_s;
    const double slope = kSlope_rad_s2 * kPairs;
    return {{fixed(kp, 26), fixed(ki, 26), fixed(ki / kp, 31)},
            fixed(slope * kSlow_s / bench::kIpmBase.omega_rad_s, 28),
            fixed(slope * per_torque() / bench::kIpmBase.i_A, 28)};
}

// The law of the header in double precision.
struct Law {
    speed_control_config_t c;
    double reference = 0, integral = 0;
    bool limited = false;

    double step(double target, double omega, double i_min, double i_max)
    {
        const double slope = real(c.slope);
        const double move = std::clamp(target - reference, -slope, slope);
        reference += move;
        const double ramping =
            std::abs(move) > slope - 0x1p-30 ? std::copysign(real(c.i_per_slope), move) : 0;
        const double e = reference - omega;
        const double u = real(c.pi.kp, 26) * e + integral + ramping;
        const double limited_u = std::clamp(u, i_min, i_max);
        integral += real(c.pi.ki, 26) * e + real(c.pi.kb, 31) * (limited_u - u);
        limited = limited_u != u;
        return limited_u;
    }
};

struct Shaft {
    double omega = 0;

    void run(double i_q, double load = 0) // per-unit currents, one call
    {
        omega += (i_q - load) * bench::kIpmBase.i_A / per_torque() * kSlow_s / bench::kIpmBase.omega_rad_s;
    }
};

double step(speed_control_t &self, const speed_control_config_t &c, double target, double omega, double i_min,
            double i_max, bool *limited = nullptr)
{
    bool held = false;
    const pm_q_t i = speed_control_step(&self, &c, fixed(target, 28), fixed(omega, 28), fixed(i_min, 28),
                                        fixed(i_max, 28), &held);
    if (limited != nullptr) {
        *limited = held;
    }
    return real(i);
}

TEST(SpeedControl, FollowsTheDoubleModel)
{
    const speed_control_config_t c = config();
    speed_control_t self = {};
    speed_control_reset(&self, 0, 0);
    Law law = {c};
    Shaft a, b;
    samples::Random random;
    int held = 0;
    for (int k = 0; k < 6000; ++k) {
        const double target = k < 2000 ? 0.5 : (k < 4000 ? -0.4 : 0.1);
        const double load = k > 1000 && k < 3000 ? -0.25 : 0.25;
        const double i_max = k > 3500 ? 0.2 : 0.4; // derated
        const double i = step(self, c, target, a.omega, -0.4, i_max);
        const double model = law.step(target, b.omega, -0.4, i_max);
        held += law.limited ? 1 : 0;
        a.run(i, load);
        b.run(model, load);
        ASSERT_NEAR(i, model, kTrajectory) << k;
        ASSERT_NEAR(a.omega, b.omega, kTrajectory) << k;
    }
    EXPECT_GT(held, 100);
}

// What the voltage leaves of the current that is wanted, either way; with it the speed passes by the target as it would from that
// current, without it as from the limit.
TEST(SpeedControl, IntegralFollowsWhatFlowsWhereVoltageDoesNotSuffice)
{
    const speed_control_config_t c = config();
    const double kLimit = 0.8, kFlows = 0.2, kTarget = 0.3, kStands = 0.2;
    for (const double sign : {1.0, -1.0}) {
        std::map<bool, double> passed;
        for (const bool follows : {false, true}) {
            speed_control_t self = {};
            speed_control_reset(&self, 0, 0);
            double i = 0.0;
            for (int k = 0; k < 5000; ++k) { // held below the target
                i = step(self, c, sign * kTarget, sign * kStands, -kLimit, kLimit);
                if (follows) {
                    speed_control_follow(&self, &c, fixed(i, 28), fixed(sign * kFlows, 28));
                }
            }
            const double wound = real(self.pi.integral, 22);
            EXPECT_NEAR(sign * wound, follows ? kFlows : kLimit, 1e-3);
            Shaft shaft{sign * kStands};
            for (int k = 0; k < 2000; ++k) { // and let go
                i = step(self, c, sign * kTarget, shaft.omega, -kLimit, kLimit);
                shaft.run(i);
                passed[follows] = std::max(passed[follows], sign * shaft.omega - kTarget);
            }
        }
        EXPECT_LT(passed[true], 0.5 * passed[false]);
    }
    // what flows beyond the current that is wanted, or against it, is no lack of voltage
    speed_control_t self = {};
    for (const auto &[i, flows, to] :
         {std::array{0.2, 0.5, 0.2}, {0.2, -0.3, 0.0}, {-0.2, -0.5, -0.2}, {-0.2, 0.3, 0.0}}) {
        speed_control_reset(&self, 0, fixed(i, 28));
        for (int k = 0; k < 5000; ++k) {
            speed_control_follow(&self, &c, fixed(real(self.pi.integral, 22), 28), fixed(flows, 28));
        }
        EXPECT_NEAR(real(self.pi.integral, 22), to, 1e-3) << i << " " << flows;
    }
}

TEST(SpeedControl, ReferenceIsARamp)
{
    const speed_control_config_t c = config();
    speed_control_t self = {};
    speed_control_reset(&self, fixed(0.1, 28), 0);
    const double slope = real(c.slope);
    for (int k = 1; k <= 2000; ++k) {
        step(self, c, -0.3, 0, -1, 1);
        ASSERT_NEAR(real(self.reference), std::max(0.1 - k * slope, -0.3), k * 0x1p-28) << k;
    }
    EXPECT_EQ(self.reference, fixed(-0.3, 28));
}

TEST(SpeedControl, FeedForwardAcceleratesWithoutAnError)
{
    for (const double target : {0.5, -0.5}) {
        const speed_control_config_t c = config();
        speed_control_config_t without = c;
        without.i_per_slope = 0;
        double worst[2] = {0, 0};
        for (const bool fed : {true, false}) {
            speed_control_t self = {};
            Shaft shaft;
            for (int k = 0; k < 300; ++k) {
                shaft.run(step(self, fed ? c : without, target, shaft.omega, -1, 1));
                worst[fed ? 0 : 1] =
                    std::max(worst[fed ? 0 : 1], std::abs(real(self.reference) - shaft.omega));
            }
        }
        EXPECT_LE(worst[0], kRampError * worst[1] + 2 * real(c.slope));
        // without it the proportional part needs the whole acceleration: i/kp, less what the integral gives
        EXPECT_GE(worst[1], 0.5 * real(c.i_per_slope) / real(c.pi.kp, 26));
    }
}

TEST(SpeedControl, OutputStaysWithinItsLimits)
{
    const speed_control_config_t c = config();
    speed_control_t self = {};
    samples::Random random;
    for (int k = 0; k < 20000; ++k) {
        const double i_min = random.within(-0.8, 0), i_max = random.within(0, 0.8);
        bool limited;
        const double i =
            step(self, c, random.within(-1, 1), random.within(-1.2, 1.2), i_min, i_max, &limited);
        ASSERT_GE(i, i_min - 0x1p-22);
        ASSERT_LE(i, i_max + 0x1p-22);
        if (i > i_min + 0x1p-21 && i < i_max - 0x1p-21) {
            ASSERT_FALSE(limited);
        }
    }
}

// Two poles at half the bandwidth: a step of the load is a hump without undershoot, and back.
TEST(SpeedControl, LoadStepIsAHump)
{
    const speed_control_config_t c = config();
    speed_control_t self = {};
    Shaft shaft;
    double lowest = 0, highest = 0;
    const double load = 0.3;
    for (int k = 0; k < 1500; ++k) {
        shaft.run(step(self, c, 0, shaft.omega, -1, 1), load);
        lowest = std::min(lowest, shaft.omega);
        highest = std::max(highest, shaft.omega);
    }
    // (s + w/2)^2: dip a t e^(-w t/2) at t = 2/w
    const double a = load * bench::kIpmBase.i_A / per_torque() / bench::kIpmBase.omega_rad_s;
    EXPECT_NEAR(-lowest, a * 2 / kBandwidth / std::exp(1.0), 0.05 * -lowest);
    EXPECT_NEAR(highest, 0, 0.01 * -lowest);
    EXPECT_NEAR(shaft.omega, 0, 0.01 * -lowest);
}

// Against a current limit for long, then released: no overshoot beyond that of the model without a limit.
TEST(SpeedControl, RecoversFromTheLimit)
{
    const speed_control_config_t c = config();
    speed_control_t self = {};
    Shaft shaft;
    double highest = 0;
    bool held = false;
    for (int k = 0; k < 4000; ++k) {
        const double i_max = 0.1; // a third of what the ramp asks for
        bool limited;
        shaft.run(step(self, c, 0.3, shaft.omega, -0.1, i_max, &limited));
        held = held || limited;
        highest = std::max(highest, shaft.omega);
    }
    EXPECT_TRUE(held);
    EXPECT_LE(highest, 0.3 * 1.05);
    EXPECT_NEAR(shaft.omega, 0.3, 1e-3);
    EXPECT_LE(std::abs(real(self.pi.integral, 22)), 0.1 + real(c.i_per_slope));
}

TEST(SpeedControl, ResetTakesOverWithoutABump)
{
    const speed_control_config_t c = config();
    speed_control_t self = {};
    speed_control_reset(&self, fixed(0.25, 28), fixed(0.13, 28));
    EXPECT_NEAR(step(self, c, 0.25, 0.25, -1, 1), 0.13, kStep);
    EXPECT_EQ(self.reference, fixed(0.25, 28));
}

TEST(SpeedControl, CornersDoNotOverflow)
{
    speed_control_config_t c = {{PM_GAIN(29.9), PM_GAIN(29.9), PM_UNIT_MAX}, PM_Q(1.0), PM_Q(4.0)};
    for (int corner = 0; corner < 4; ++corner) {
        speed_control_t self = {};
        const double target = (corner & 1) != 0 ? 1.25 : -1.25;
        const double omega = (corner & 2) != 0 ? 1.25 : -1.25;
        for (int k = 0; k < 2000; ++k) {
            const double i = step(self, c, target, omega, -1, 1);
            ASSERT_LE(std::abs(i), 1.0);
        }
    }
}

// A machine without load and friction: the law in double precision, and what the header says of it.
TEST(SpeedControl, TorqueDrivesToASpeedAndNoFurther)
{
    const speed_control_config_t c = config();
    for (const double way : {1.0, -1.0}) {
        for (const double i_q : {0.02, 0.1, 0.4}) {
            const double top = 0.7, kp = 2 * real(c.pi.kp, 26), ki = 4 * real(c.pi.ki, 26);
            speed_control_t self{};
            Shaft shaft;
            double last = 0, before = 0, most = 0;
            for (int ms = 0; ms < 20000; ++ms) {
                const double omega = way * shaft.omega;
                const double got = real(
                    speed_control_below(&self, &c, fixed(top, 28), fixed(omega, 28), fixed(way * i_q, 28)));
                const double e = top - shaft.omega;
                double expected = i_q;
                if (e < top / 2) {
                    expected =
                        std::clamp(std::max(last + kp * (before - shaft.omega) + ki * e, kp * e), 0.0, i_q);
                }
                ASSERT_NEAR(way * got, expected, 1e-4) << ms;
                last = way * got;
                before = shaft.omega;
                shaft.run(way * got);
                most = std::max(most, shaft.omega);
            }
            const double slope = i_q * bench::kIpmBase.i_A / per_torque() / bench::kIpmBase.omega_rad_s;
            EXPECT_GE(shaft.omega, top - 1e-3); // it coasts beyond, without friction
            EXPECT_LT(most - top, 0.16 * slope / (2 * kBandwidth)) << i_q;
            EXPECT_GT(most - top, 0.08 * slope / (2 * kBandwidth)) << i_q;
        }
    }
}

// What drives the machine on is not braked, a load that takes the torque has it whole, and the other way is free.
TEST(SpeedControl, LimitOfSpeedTakesTorqueBackOnly)
{
    const speed_control_config_t c = config();
    const pm_q_t top = fixed(0.7, 28), i_q = fixed(0.3, 28);
    speed_control_t self{};
    EXPECT_EQ(speed_control_below(&self, &c, top, fixed(0.3, 28), i_q),
              i_q); // below half of it, whatever J was told
    for (int ms = 0; ms < 2000; ++ms) {
        EXPECT_GE(speed_control_below(&self, &c, top, fixed(0.8, 28), i_q), 0);
    }
    EXPECT_EQ(speed_control_below(&self, &c, top, fixed(0.8, 28), i_q), 0);
    EXPECT_EQ(speed_control_below(&self, &c, top, fixed(0.8, 28), -i_q), -i_q);
    for (int ms = 0; ms < 2000; ++ms) {
        speed_control_below(&self, &c, top, fixed(0.69, 28), i_q);
    }
    EXPECT_EQ(speed_control_below(&self, &c, top, fixed(0.69, 28), i_q), i_q);
    EXPECT_EQ(speed_control_below(&self, &c, top, fixed(-4.0, 28), i_q), i_q);
    EXPECT_EQ(speed_control_below(&self, &c, top, fixed(4.0, 28), i_q), 0);
}

} // namespace
