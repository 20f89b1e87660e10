// The carrier at standstill: firmware/drive/rest.h, without a motor.
#include <gtest/gtest.h>

#include <cmath>

#include "firmware/drive/drive_parts.h"
#include "firmware/drive/rest.h"
#include "tests/unit/drive/direct.h"

namespace
{

constexpr int kAfter_ms = 20;

// Injection leads, at standstill, nothing wanted.
struct Resting : direct::Drive {
    explicit Resting(int32_t rest_ms = kAfter_ms) : Drive(params(rest_ms))
    {
        step();
        d.command.enable = true;
        d.command.mode = DRIVE_MODE_SPEED;
        command.enable = true;
        command.mode = DRIVE_MODE_SPEED;
        d.state = DRIVE_RUNNING;
        d.stage = STAGE_VECTOR;
        d.i_abc = {0, 0, 0};
        position_reset(&d.position, &d.config.position, &direct::kAtRest, {0, 0}, true);
    }

    static drive_params_t params(int32_t rest_ms)
    {
        drive_params_t p = direct::params(1);
        p.injection_rest = rest_ms;
        return p;
    }

    // Milliseconds until the carrier is as wanted.
    int until(bool carrier, int most)
    {
        for (int ms = 0; ms < most; ++ms) {
            if (d.carrier == carrier) {
                return ms;
            }
            drive_slow(&d, &slow);
        }
        return most;
    }
};

TEST(Rest, TheCarrierGoesOffAfterItsTime)
{
    Resting x;
    drive_slow(&x.d, &x.slow);
    ASSERT_TRUE(x.d.carrier);
    EXPECT_NEAR(x.until(false, 100), kAfter_ms, 2);
    EXPECT_EQ(x.d.i_ref.q, 0);
    EXPECT_EQ(x.d.position.gains.ki, 0);
    EXPECT_EQ(x.d.position.gains.kp_turn, 0);
}

TEST(Rest, ItStaysOnWithoutTheParameter)
{
    Resting x(0);
    drive_slow(&x.d, &x.slow);
    EXPECT_EQ(x.until(false, 200), 200);
}

TEST(Rest, ACommandBringsItBackWithinFiveMilliseconds)
{
    Resting x;
    drive_slow(&x.d, &x.slow);
    ASSERT_LT(x.until(false, 100), 100);
    x.command.speed_mrad_s = 5000;
    drive_command(&x.d, &x.command);
    EXPECT_LE(x.until(true, 100), 5);
    EXPECT_NE(x.d.position.gains.ki, 0);
    EXPECT_EQ(x.until(false, 300), 300);
}

TEST(Rest, AnEmfBringsItBack)
{
    Resting x;
    drive_slow(&x.d, &x.slow);
    ASSERT_LT(x.until(false, 100), 100);
    x.d.voltage.v.q = pm_widen(2 * x.d.config.rest.emf); // seen through 10 ms: ln 2 of them
    EXPECT_LE(x.until(true, REST_LOOK_MS), 15);
}

TEST(Rest, ItLooksNowAndThen)
{
    Resting x;
    drive_slow(&x.d, &x.slow);
    ASSERT_LT(x.until(false, 100), 100);
    for (int n = 0; n < 3; ++n) {
        EXPECT_NEAR(x.until(true, 200), REST_LOOK_MS, 3) << n;
        EXPECT_NEAR(x.until(false, 200), REST_AWAKE_MS, 3) << n;
    }
}

// What the load has needed for longer than the filter's time, either way.
TEST(Rest, ACurrentThatIsNeededKeepsItOn)
{
    for (const double share : {0.9, -0.9, 1.1, -1.1}) {
        Resting x;
        const auto i_q = static_cast<pm_q_t>(share * x.d.config.rest.i_q);
        x.d.rest.mean.q = i_q;
        for (int ms = 0; ms < 3 * kAfter_ms && !x.d.position.rests; ++ms) {
            x.d.i_ref.q = i_q;
            rest_slow(&x.d);
        }
        EXPECT_EQ(x.d.position.rests, std::abs(share) < 1) << share;
    }
}

TEST(Rest, InTorqueModeZeroTorqueIsNothing)
{
    Resting x;
    x.command.mode = x.d.command.mode = DRIVE_MODE_TORQUE;
    drive_command(&x.d, &x.command);
    drive_slow(&x.d, &x.slow);
    EXPECT_NEAR(x.until(false, 100), kAfter_ms, 2);
    x.command.torque_uNm = 500000;
    drive_command(&x.d, &x.command);
    EXPECT_LE(x.until(true, 100), 5);
}

TEST(Rest, ATurningRotorKeepsItOn)
{
    Resting x;
    for (int ms = 0; ms < 200; ++ms) {
        drive_slow(&x.d, &x.slow);
        x.d.position.pll.omega = 2 * x.d.config.rest.omega;
    }
    EXPECT_TRUE(x.d.carrier);
}

TEST(Rest, ARampToZeroKeepsItOn)
{
    Resting x;
    for (int ms = 0; ms < 100; ++ms) {
        x.d.speed.reference = PM_ONE / 8;
        drive_slow(&x.d, &x.slow);
        ASSERT_TRUE(x.d.carrier);
    }
}

TEST(Rest, AStopKeepsItOn)
{
    Resting x;
    x.d.state = DRIVE_STOPPING;
    x.command.enable = false;
    drive_command(&x.d, &x.command);
    x.command.enable = x.d.command.enable = true;
    for (int ms = 0; ms < 100 && x.d.state == DRIVE_STOPPING; ++ms) {
        drive_slow(&x.d, &x.slow);
        EXPECT_FALSE(x.d.position.rests);
        x.d.position.pll.omega = 4 * x.d.config.protection.omega_stall;
    }
}

// The mean is of the EMF while it rests and of the current while it does not: awake, it begins with none.
TEST(Rest, WhatTheEmfWasIsNoCurrent)
{
    Resting x;
    drive_slow(&x.d, &x.slow);
    ASSERT_LT(x.until(false, 100), 100);
    x.d.voltage.v.q = pm_widen(2 * x.d.config.rest.emf);
    ASSERT_LE(x.until(true, REST_LOOK_MS), 15);
    EXPECT_EQ(x.d.rest.mean.q, 0);
}

TEST(Rest, AnObserverThatLeadsHasNoCarrierToRest)
{
    Resting x;
    for (int ms = 0; ms < 3 * kAfter_ms; ++ms) {
        x.d.position.inject = false;
        rest_slow(&x.d);
        EXPECT_EQ(x.d.rest.ms, 0);
    }
    EXPECT_FALSE(x.d.position.rests);
}

} // namespace
