// Mode duty of block commutation on the plant of a fan: speed by the voltage, ramp, limits, braking, start and refusal.
#include "firmware/drive/block.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/drive/fan.h"

namespace
{

using fan::Fan;
using fan::kRated_rad_s;

constexpr double kPi = 3.141592653589793;
constexpr double kSpeed = 0.02; // the current of 60 degrees is not flat
constexpr double kRamp = 0.002; // of 1 s: two of its steps
constexpr double kPeak_A = 6.0; // tests/scenario/six_step_duty.yaml

// (duty - lost) v_dc = k w + 2 R i + (3 / pi) L p w i, k i = the fan's torque.
double speed_rel(double duty)
{
    const double k_Vs = 0.995 * 3 * std::sqrt(3.0) / kPi * 4 * 7.5e-3;
    double low = 0, high = 1000;
    while (high - low > 1e-3) {
        const double w = (low + high) / 2;
        const double i_A = (1.8e-6 * w * w + 2e-3) / k_Vs;
        const double v_dc_V = 24 - 0.05 * duty * i_A;
        const double v_V = duty * v_dc_V - 0.5e-6 * 20e3 * (v_dc_V + 0.8);
        const double taken_V = k_Vs * w + 2 * 0.41 * i_A + 3 / kPi * 0.5e-3 * 4 * w * i_A;
        (v_V > taken_V ? low : high) = w;
    }
    return low / kRated_rad_s;
}

double u(Fan &x)
{
    return x.drive().block.current.u / double(PM_ONE);
}

void start(Fan &x, double duty, double time_s = 1.3)
{
    x.enable(DRIVE_MODE_DUTY);
    x.duty(duty);
    x.run_s(time_s);
    ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
    ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
}

uint32_t limits_of(Fan &x, int ms)
{
    uint32_t limits = 0;
    for (; ms > 0; --ms) {
        x.run_s(1e-3);
        limits |= drive_status(&x.drive())->limits;
    }
    return limits;
}

TEST(BlockDuty, TheVoltageMakesTheSpeedBothWays)
{
    for (const double duty : {0.4, -0.4, 0.6}) {
        Fan x;
        start(x, duty);
        EXPECT_NEAR(x.omega_rel, std::copysign(speed_rel(std::fabs(duty)), duty),
                    kSpeed * std::fabs(x.omega_rel))
            << duty;
        EXPECT_NEAR(u(x), std::fabs(duty), 1e-6);
        EXPECT_EQ(limits_of(x, 20), 0U);
        EXPECT_GT(duty * drive_status(&x.drive())->i_ref.q, 0) << "it drives the fan";
    }
}

TEST(BlockDuty, FollowsItsRamp)
{
    for (const int32_t ramp_ms : {1000, 100}) {
        Fan x;
        x.params().t_duty = ramp_ms;
        start(x, 0.4);
        const double before = u(x);
        x.duty(0.5);
        x.run_s(0.005);
        EXPECT_NEAR(u(x) - before, 5.0 / ramp_ms, kRamp * 1000 / ramp_ms);
        x.duty(0.4);
        x.run_s(0.2);
        EXPECT_NEAR(u(x), 0.4, 1e-6);
    }
}

// A light rotor follows the voltage at once, and t_60 is known of the last six sectors.
TEST(BlockDuty, RisesByAQuarterOfItselfInASector)
{
    for (const double way : {1.0, -1.0}) {
        Fan x;
        x.params().t_duty = 1;
        start(x, way * 0.1);
        const double before = u(x), sectors_s = std::fabs(x.omega_rel) * kRated_rad_s * 4 * 3 / kPi;
        x.duty(way);
        x.run_s(0.004);
        EXPECT_NEAR(std::log(u(x) / before), 0.25 * sectors_s * 0.004, 0.25 * 0.25 * sectors_s * 0.004);
        x.run_s(0.6);
        EXPECT_NEAR(u(x), 1, 1e-6);
        x.duty(way * 0.5);
        x.run_s(0.002);
        EXPECT_NEAR(x.drive().block.duty / double(PM_ONE), way * 0.5, 1e-6) << "down at once";
    }
}

// From 5 % to all of the voltage within 50 ms, ten times: the largest position error while in blocks, degrees.
double throttled(Fan &x, bool held)
{
    x.params().t_duty = 50;
    start(x, 0.3);
    if (!held) {
        x.drive().config.block.duty_turn = PM_Q_MAX;
    }
    double most = 0;
    for (int n = 0; n < 20 && x.fault() == DRIVE_FAULT_NONE; ++n) {
        x.duty(n % 2 == 0 ? 0.05 : 1);
        x.run_s(0.5);
        most = std::max(most, x.worst_deg);
    }
    return most;
}

TEST(BlockDuty, TheThrottleIsFollowedFromFivePercent)
{
    Fan x;
    EXPECT_LT(throttled(x, true), 45);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    Fan twin; // without what holds the duty
    EXPECT_GT(throttled(twin, false), 120);
}

// Diodes at a light load and a short on time, where the current ceases: the largest position error of 0.2 s, degrees.
double with_diodes(bool both_where_it_must)
{
    Fan x;
    x.params().freewheeling = 0;
    start(x, 0.3);
    x.duty(0.2);
    x.run_s(0.8);
    double most = 0;
    for (int period = 0; period < 4000; ++period) {
        if (!both_where_it_must) {
            x.drive().block.six_step.complementary = false;
        }
        x.run_s(1 / 20e3);
        most = std::max(most, x.worst_deg);
    }
    return most;
}

TEST(BlockDuty, BothSwitchesWhereDiodesLetTheCurrentCease)
{
    EXPECT_LT(with_diodes(true), 1);
    EXPECT_GT(with_diodes(false), 5) << "twin: diodes alone";
}

// Whatever the start needs, and goes on from there.
TEST(BlockDuty, BeginsAtTheVoltageOfTheStart)
{
    Fan x;
    x.params().t_duty = 100000; // 1 % in a second
    x.enable(DRIVE_MODE_DUTY);
    x.duty(0.9);
    for (int ms = 0; ms < 2000 && x.drive().block_ms == 0; ++ms) {
        x.run_s(1e-3);
    }
    ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
    const double first = u(x);
    EXPECT_GT(first, 0.02);
    x.run_s(0.1);
    EXPECT_NEAR(u(x), first, 0.002);
}

TEST(BlockDuty, GivesWayToTheCurrentLimitAndSaysSo)
{
    Fan x;
    x.params().t_duty = 1;
    start(x, 0.3);
    x.duty(1);
    EXPECT_NE(limits_of(x, 20) & DRIVE_LIMIT_CURRENT, 0U);
    EXPECT_LT(u(x), 0.9);
    x.run_s(0.02);
    EXPECT_LT(x.peak_A, kPeak_A);
    EXPECT_GT(x.peak_A, 0.9 * kPi / (2 * std::sqrt(3.0)) * 6) << "all of i_max";
    x.run_s(0.6);
    EXPECT_NEAR(u(x), 1, 1e-6);
    EXPECT_EQ(limits_of(x, 20) & DRIVE_LIMIT_CURRENT, 0U);
}

TEST(BlockDuty, DeratesWithTheOthers)
{
    double peak_A[2];
    for (const int hot : {0, 1}) {
        Fan x;
        x.params().temp_derate = hot != 0 ? 100 : 900; // the plant's sensor says 25 degC of 110
        x.params().t_duty = 1;
        start(x, 0.3, 1.8);
        x.duty(0.9);
        EXPECT_EQ((limits_of(x, 10) & DRIVE_LIMIT_TEMPERATURE) != 0, hot != 0);
        x.run_s(0.01);
        peak_A[hot] = x.peak_A;
    }
    EXPECT_NEAR(peak_A[1] / peak_A[0], 0.85, 0.05); // (110 - 25) / (110 - 10)
}

// Without regeneration the rotor is braked by its fan alone; the link does not rise.
TEST(BlockDuty, RegeneratesNoMoreThanTheLinkAllows)
{
    double omega_rel[2];
    for (const int full : {0, 1}) {
        Fan x;
        x.params().v_dc_derate = full != 0 ? 24500 : 32000;
        x.params().v_dc_max = full != 0 ? 26400 : 36000; // nothing from 25.9 V on
        plant_set_source(x.plant(), 26);
        start(x, 0.8);
        x.duty(0);
        const uint32_t limits = limits_of(x, 100);
        EXPECT_NE(limits & DRIVE_LIMIT_CURRENT, 0U);
        EXPECT_EQ((limits & DRIVE_LIMIT_DC_VOLTAGE) != 0, full != 0);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
        omega_rel[full] = x.omega_rel;
    }
    EXPECT_GT(omega_rel[1], omega_rel[0] + 0.05);
}

TEST(BlockDuty, NothingBrakesToZeroAndHolds)
{
    Fan x;
    start(x, 0.4);
    x.duty(0);
    x.run_s(1.5);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    EXPECT_EQ(x.drive().stage, STAGE_OPEN_LOOP);
    EXPECT_NEAR(x.omega_rel, 0, 1e-3);
    x.duty(0.02); // its speed without a load is below three quarters of six_step_speed
    x.run_s(0.3);
    EXPECT_EQ(x.drive().stage, STAGE_OPEN_LOOP);
    x.duty(-0.4);
    x.run_s(1.2);
    EXPECT_NEAR(x.omega_rel, -speed_rel(0.4), kSpeed * speed_rel(0.4));
}

TEST(BlockDuty, TheOtherSignBrakesAndBeginsAnew)
{
    Fan x;
    start(x, 0.5);
    x.duty(-0.4);
    bool left = false;
    for (int ms = 0; ms < 2600; ++ms) {
        x.run_s(1e-3);
        left = left || x.drive().stage != STAGE_SIX_STEP;
    }
    EXPECT_TRUE(left);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    EXPECT_NEAR(x.omega_rel, -speed_rel(0.4), kSpeed * speed_rel(0.4));
}

void low_side(plant_config_t &c)
{
    c.sensor.shunt = PLANT_LOW_SIDE;
    c.sensor.settle_s = 1.3e-6;
}

void to_full_voltage(Fan &x, int32_t pattern)
{
    x.params().pattern = pattern;
    x.params().t_duty = 300;
    x.enable(DRIVE_MODE_DUTY);
    x.duty(0.3);
    x.run_s(1.0);
    x.duty(1);
    x.run_s(1.4);
}

// Hidden for b = 2 f_pwm (dead time + settling) of a period, tests/scenario/six_step_low_side.yaml.
TEST(BlockDuty, LowSideShuntsShowTheCurrentUpToAllOfTheVoltage)
{
    for (const int32_t pattern : {0, 1, 5}) {
        Fan x(0.17, low_side);
        to_full_voltage(x, pattern);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE) << pattern;
        EXPECT_NEAR(u(x), pattern == 0 ? 1 - 4 * 20e3 * 1.8e-6 : 1, 1e-3) << pattern;
        EXPECT_GT(x.omega_rel, pattern == 0 ? 0.942 : 1.085) << pattern;
    }
}

// Twin: told that they are in the lines, the drive finds a sum that is not zero, or controls what is not there.
TEST(BlockDuty, TwinLowSideShuntsToldInLineAreAFault)
{
    for (const int32_t pattern : {0, 1}) {
        Fan x(0.17, low_side);
        x.params().t_settle = 0;
        to_full_voltage(x, pattern);
        EXPECT_TRUE(x.fault() == DRIVE_FAULT_SENSOR_SUM || x.fault() == DRIVE_FAULT_OVER_CURRENT) << pattern;
    }
}

// freewheeling.h: with a slow sample and four times the inductance, as told, a duty that is taken back brakes with less. Where the high
// leg is chopped, pattern 1, the longest freewheeling is that of even sectors, where the low leg is, pattern 2, of odd ones: as long.
TEST(BlockDuty, TheFreewheelingLimitsWhatItBrakesWith)
{
    const auto braked = [](int32_t pattern, int32_t limit) {
        Fan x;
        x.params().pattern = pattern;
        x.params().freewheeling_limit = limit;
        x.params().t_blank = 20000;
        x.params().L_d = x.params().L_q = 4 * x.params().L_d;
        x.params().t_duty = 100;
        start(x, 0.6, 1.6);
        x.duty(0);
        x.run_s(0.1);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
        return x.omega_rel;
    };
    const double high = braked(1, 1);
    EXPECT_GT(high, braked(1, 0) + 0.02);
    EXPECT_NEAR(braked(2, 1), high, 0.005);
    EXPECT_GT(braked(4, 1), braked(4, 0) + 0.02);
}

TEST(BlockDuty, AStopSlowsDownWithTheAcceleration)
{
    Fan x;
    x.params().acceleration = 200000;
    start(x, 0.4);
    const double before = x.omega_rel;
    x.stop();
    x.run_s(0.2);
    EXPECT_NEAR((before - x.omega_rel) * kRated_rad_s, 40, 6);
    x.run_s(1.2);
    EXPECT_EQ(drive_status(&x.drive())->state, DRIVE_OFF);
    EXPECT_FALSE(x.driven());
}

TEST(BlockDuty, FromTheVectorAtItsSpeed)
{
    for (const double sense : {1.0, -1.0}) {
        Fan x;
        x.params().six_step_start = 0;
        x.params().six_step_speed = 100000;
        x.enable(DRIVE_MODE_DUTY);
        x.duty(0.2 * sense); // 96 rad/s without a load
        x.run_s(1.5);
        EXPECT_EQ(x.drive().stage, STAGE_VECTOR);
        EXPECT_NEAR(x.omega_rel, sense * 0.2 * 24 / (3 * std::sqrt(3.0) / kPi * 4 * 7.5e-3) / kRated_rad_s,
                    0.01);
        x.duty(0.5 * sense);
        x.run_s(1.2);
        EXPECT_EQ(x.drive().stage, STAGE_SIX_STEP);
        EXPECT_NEAR(x.omega_rel, sense * speed_rel(0.5), kSpeed * speed_rel(0.5));
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    }
}

TEST(BlockDuty, AHeldRotorIsAStall)
{
    Fan x;
    x.params().resync_tries = 0;
    plant_set_locked(x.plant(), true);
    x.enable(DRIVE_MODE_DUTY);
    x.duty(0.5);
    x.until_fault_s(5);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_STALL);
    EXPECT_FALSE(x.driven());
}

// Of all that is more than the link it is the link.
TEST(BlockDuty, IsNoMoreThanTheLink)
{
    Fan x;
    x.enable(DRIVE_MODE_DUTY);
    for (const double duty : {1.5, -1.5, 2000.0}) {
        x.duty(duty);
        x.run_s(0.002);
        EXPECT_EQ(x.drive().duty_target, duty < 0 ? -PM_ONE : PM_ONE);
    }
}

TEST(BlockDuty, FieldOrientationDoesNotStartInIt)
{
    Fan x;
    x.params().commutation = 0;
    x.enable(DRIVE_MODE_DUTY);
    x.duty(0.5);
    x.run_s(0.5);
    EXPECT_EQ(drive_status(&x.drive())->state, DRIVE_OFF);
    EXPECT_FALSE(x.driven());
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
}

} // namespace
