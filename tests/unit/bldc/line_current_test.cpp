// Current of two legs in double precision: a line of 2 R, 2 L and an EMF, sampled once a period, with the delay of the drive.
#include "bldc/line_current.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "tests/unit/bldc/rig.h"

namespace
{

using bldc_rig::fixed;
using bldc_rig::real;

// BLDC-FAN, per-unit of 40 V and 10 A.
constexpr double kBase_V = 40, kBase_A = 10, kT_s = 50e-6;
constexpr double kR_ohm = 0.4, kL_H = 0.5e-3, kV_dc = 24;
constexpr double kBandwidth = 2 * bldc_rig::kPi * 800;
constexpr double kRest_A = 0.01;
constexpr double kIntegral_V = 0.02; // 2^-23 / ki of an error

line_current_config_t config()
{
    const double kp = 2 * kBandwidth * kL_H * kBase_A / kBase_V;
    const double ki = 2 * kBandwidth * kR_ohm * kT_s * kBase_A / kBase_V;
    return {{fixed(kp, 26), fixed(ki, 26), fixed(ki / kp, 31)},
            fixed(2 * kR_ohm * kBase_A / kBase_V, 28),
            PM_ONE};
}

struct Line {
    line_current_config_t c = config();
    line_current_t self = {};
    double i_A = 0, u = 0, emf_V;

    explicit Line(double emf, double flows_A = 0) : i_A(flows_A), emf_V(emf)
    {
        line_current_reset(&self, &c, fixed(flows_A / kBase_A, 28));
        u = (emf_V + 2 * kR_ohm * flows_A) / kV_dc;
    }
    void want(double i)
    {
        line_current_prepare(&self, fixed(i / kBase_A, 28), fixed(emf_V / kBase_V, 28),
                             fixed(kV_dc / kBase_V, 28));
    }
    void give(double duty, double i_min, double i_max)
    {
        want(i_max);
        line_current_give(&self, fixed(duty, 28), fixed(i_min / kBase_A, 28));
    }
    void period()
    {
        line_current_step(&self, &c, fixed(i_A / kBase_A, 28), fixed(kV_dc / kBase_V, 28));
        const double decay = std::exp(-kR_ohm / kL_H * kT_s);
        i_A = i_A * decay + (u * kV_dc - emf_V) / (2 * kR_ohm) * (1 - decay);
        u = real(self.u); // acts from the next period on
    }
};

// Short of the link's, and the integral goes no further: what is wanted next is reached at once.
TEST(LineCurrent, KeepsTheVoltageAtWhatTheShuntsShow)
{
    Line line(20.0);
    line.c.most = fixed(0.85, 28);
    line.want(5);
    for (int k = 0; k < 4000; ++k) {
        line.period();
        ASSERT_LE(line.u, 0.85);
    }
    EXPECT_NEAR(line.i_A, (0.85 * kV_dc - 20) / (2 * kR_ohm), kRest_A);
    EXPECT_TRUE(line.self.limited);
    line.give(0.95, 0, 5);
    line.period();
    EXPECT_NEAR(line.u, 0.85, 1e-7);
    line.give(0.8, -5, 5);
    line.period();
    EXPECT_EQ(line.self.u, fixed(0.8, 28));
}

// Down to a sixteenth of full scale, also one that falls between two milliseconds.
TEST(LineCurrent, ASmallLinkIsUsedWhole)
{
    const line_current_config_t c = config();
    for (const double v_dc : {0.0625, 0.1, 0.13, 0.6, 1.0}) {
        line_current_t self = {};
        line_current_reset(&self, &c, 0);
        line_current_prepare(&self, fixed(0.3, 28), fixed(v_dc / 2, 28), fixed(v_dc, 28));
        line_current_step(&self, &c, fixed(0.3, 28), fixed(v_dc, 28));
        EXPECT_NEAR(real(self.u), 0.5, 1e-5) << v_dc;
        line_current_step(&self, &c, fixed(-2, 28), fixed(v_dc, 28));
        EXPECT_NEAR(real(self.u), 1, 1e-5) << v_dc;
        line_current_step(&self, &c, fixed(-2, 28), fixed(2 * v_dc, 28));
        EXPECT_EQ(self.u, PM_ONE) << v_dc;
    }
}

TEST(LineCurrent, ReachesItsReferenceWithTheBandwidth)
{
    Line x(8);
    x.want(3);
    int rise = 0;
    for (int k = 0; k < 200; ++k) {
        x.period();
        rise = rise == 0 && x.i_A > 3 * 0.63 ? k : rise;
        ASSERT_LT(x.i_A, 3 * 1.15);
    }
    EXPECT_NEAR(x.i_A, 3, kRest_A);
    EXPECT_NEAR(rise * kT_s, 1 / kBandwidth, 2 * kT_s); // and the delay of a period
    EXPECT_FALSE(x.self.limited);
}

TEST(LineCurrent, GoesOnAtTheCurrentThatFlows)
{
    Line x(8, 2);
    x.want(2);
    for (int k = 0; k < 50; ++k) {
        x.period();
        ASSERT_NEAR(x.i_A, 2, kRest_A) << k;
    }
}

TEST(LineCurrent, BrakesDownToNoVoltageAndComesBack)
{
    Line x(4);
    x.want(-9); // 4 V over 0.8 ohm is 5 A
    for (int k = 0; k < 400; ++k) {
        x.period();
        ASSERT_GE(x.self.u, 0);
    }
    EXPECT_NEAR(x.i_A, -5, kRest_A);
    EXPECT_TRUE(x.self.limited);
    x.want(1);
    for (int k = 0; k < 100; ++k) {
        x.period();
    }
    EXPECT_NEAR(x.i_A, 1, 0.05); // no integral has wound up meanwhile
}

TEST(LineCurrent, GivesNoMoreThanTheLink)
{
    Line x(20);
    x.want(8); // 4 V over 0.8 ohm is 5 A
    for (int k = 0; k < 400; ++k) {
        x.period();
        ASSERT_LE(x.self.u, PM_ONE);
    }
    EXPECT_NEAR(x.i_A, 5, kRest_A);
    EXPECT_TRUE(x.self.limited);
}

// The voltage is the duty's to the bit, and the current what it makes.
TEST(LineCurrent, ADutyIsTheVoltage)
{
    Line x(8);
    for (int k = 0; k < 400; ++k) {
        x.give(0.4, -9, 9);
        x.period();
        ASSERT_EQ(x.self.u, fixed(0.4, 28));
    }
    EXPECT_NEAR(x.i_A, (0.4 * kV_dc - 8) / (2 * kR_ohm), kRest_A);
    EXPECT_NEAR(real(x.self.pi.integral) * 64 * kBase_V, 2 * kR_ohm * x.i_A, kIntegral_V);
    EXPECT_FALSE(x.self.held);
    EXPECT_FALSE(x.self.limited);
}

// 11 A and -7 A are what the voltage would make.
TEST(LineCurrent, ADutyGivesWayToEitherEnd)
{
    for (const auto &[duty, end_A] : {std::pair{0.7, 3.0}, {0.1, -2.0}}) {
        Line x(8);
        x.give(1.0 / 3, -2, 3);
        x.period();
        ASSERT_FALSE(x.self.held);
        for (int k = 0; k < 400; ++k) {
            x.give(duty, -2, 3);
            x.period();
            ASSERT_LT(x.i_A, 3 * 1.15);
            ASSERT_GT(x.i_A, -2 * 1.15);
        }
        EXPECT_NEAR(x.i_A, end_A, kRest_A);
        EXPECT_TRUE(x.self.held);
        x.self.held = false;
        for (int k = 0; k < 400; ++k) {
            x.give(0.35, -2, 3);
            x.period();
        }
        EXPECT_EQ(x.self.u, fixed(0.35, 28));
        EXPECT_NEAR(x.i_A, 0.5, kRest_A);
    }
}

// What an EMF above the link forces back is no less than nothing and no more than the link.
TEST(LineCurrent, NoCurrentLimitIsBeyondTheLink)
{
    Line x(28);
    for (int k = 0; k < 400; ++k) {
        x.give(0.5, -1, 9);
        x.period();
        ASSERT_LE(x.self.u, PM_ONE);
    }
    EXPECT_NEAR(x.i_A, -5, kRest_A);
    EXPECT_TRUE(x.self.held);
    EXPECT_TRUE(x.self.limited);
}

// A reference after a duty is followed as before.
TEST(LineCurrent, AReferenceEndsTheDuty)
{
    Line x(8);
    x.give(0.4, -9, 9);
    for (int k = 0; k < 200; ++k) {
        x.period();
    }
    const double before_A = x.i_A;
    x.want(before_A);
    for (int k = 0; k < 100; ++k) {
        x.period();
        ASSERT_NEAR(x.i_A, before_A, kRest_A) << k;
    }
}

// The fundamental of blocks of 120 degrees, and the torque of both.
TEST(LineCurrent, ALineOfItsShareHasTheFundamentalOfQ)
{
    EXPECT_NEAR(real(LINE_OF_Q), bldc_rig::kPi / (2 * std::sqrt(3.0)), 1e-8);
    EXPECT_NEAR(real(LINE_OF_Q) * real(Q_OF_LINE), 1, 1e-8);
    EXPECT_NEAR(real(LINE_OF_PHASES) * real(LINE_OF_Q), 1.5, 1e-7);
}

// The millisecond without a duty: the current is controlled again.
TEST(LineCurrent, ADutyHoldsUntilTheNextMillisecond)
{
    Line line(8);
    line.give(0.6, -20, 20);
    line.period();
    EXPECT_NEAR(line.u, 0.6, 1e-7);
    line.want(12); // of 8 that the duty would leave
    for (int k = 0; k < 200; ++k) {
        line.period();
    }
    EXPECT_NEAR(line.i_A, 12, kRest_A);
}

} // namespace
