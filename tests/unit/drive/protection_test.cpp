#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/unit/drive/direct.h"

namespace
{

using bench::real;
using direct::current_code;
using direct::Drive;
using direct::voltage_code;

struct Cause {
    drive_fault_t fault;
    std::function<void(Drive &)> raise;
    int within_steps; // periods until the bridge is off
};

// Those that come from the measurement of one period are off in that period; slow ones in the period after
// their millisecond, after the time they must last.
const std::vector<Cause> kCauses = {
    {DRIVE_FAULT_OVER_CURRENT, [](Drive &x) { x.in.i_leg[0] = current_code(0.91); }, 1},
    {DRIVE_FAULT_OVER_CURRENT, [](Drive &x) { x.in.i_leg[1] = current_code(-0.91); }, 1},
    {DRIVE_FAULT_OVER_CURRENT, [](Drive &x) { x.in.i_leg[2] = current_code(0.91); }, 1},
    {DRIVE_FAULT_HARDWARE, [](Drive &x) { x.in.hw_fault = true; }, 1},
    {DRIVE_FAULT_OVER_VOLTAGE, [](Drive &x) { x.in.v_dc = voltage_code(401); }, 1},
    {DRIVE_FAULT_UNDER_VOLTAGE, [](Drive &x) { x.in.v_dc = voltage_code(59); }, 1},
    {DRIVE_FAULT_OVER_TEMPERATURE, [](Drive &x) { x.slow.temperature_dC = 1100; }, 11},
    {DRIVE_FAULT_SENSOR_SUM, [](Drive &x) { x.in.i_leg[0] = x.in.i_leg[1] = current_code(0.06); }, 41},
};

// Steps until the trip, with drive_slow() every tenth.
int steps_to_trip(Drive &x, int most = 1000)
{
    for (int n = 1; n <= most; ++n) {
        x.step();
        if (x.out.trip) {
            return n;
        }
        if (n % 10 == 0) {
            drive_slow(&x.d, &x.slow);
        }
    }
    return most + 1;
}

TEST(Protection, EachCauseSwitchesTheBridgeOffInTime)
{
    for (const Cause &cause : kCauses) {
        Drive x;
        x.start_current_mode();
        ASSERT_EQ(x.state(), DRIVE_RUNNING);
        ASSERT_TRUE(x.driven());
        cause.raise(x);
        EXPECT_LE(steps_to_trip(x), cause.within_steps) << cause.fault;
        EXPECT_TRUE(x.out.trip) << cause.fault;
        EXPECT_FALSE(x.driven()) << cause.fault; // in the same step
        drive_slow(&x.d, &x.slow);
        EXPECT_EQ(x.fault(), cause.fault);
        EXPECT_EQ(x.state(), DRIVE_FAULT);
        EXPECT_EQ(drive_fault_record(&x.d)->fault, cause.fault);
    }
}

TEST(Protection, JustWithinTheLimitsNothingHappens)
{
    Drive x;
    x.start_current_mode();
    x.in.i_leg[0] = current_code(0.89);
    x.in.i_leg[1] = current_code(-0.89);
    x.in.v_dc = voltage_code(399);
    x.slow.temperature_dC = 1099;
    x.run_ms(20);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.in.v_dc = voltage_code(61);
    x.run_ms(20);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
}

TEST(Protection, RecordHasTheValuesOfTheMoment)
{
    Drive x;
    x.start_current_mode();
    const uint32_t before = x.d.period;
    x.slow.temperature_dC = 456;
    x.run_ms(1);
    x.in.i_leg[0] = current_code(0.95);
    x.in.i_leg[1] = current_code(-0.5);
    x.in.i_leg[2] = current_code(-0.45);
    x.in.v_dc = voltage_code(333);
    x.step();
    const pm_angle_t theta = x.d.position.pll.theta;
    // what comes later changes nothing
    x.in.i_leg[0] = current_code(0);
    x.in.v_dc = voltage_code(420);
    x.slow.temperature_dC = 1500;
    x.run_ms(5);
    const drive_fault_record_t *r = drive_fault_record(&x.d);
    EXPECT_EQ(r->fault, DRIVE_FAULT_OVER_CURRENT);
    EXPECT_NEAR(real(r->i.a), 0.95, 1e-4);
    EXPECT_NEAR(real(r->i.b), -0.5, 1e-4);
    EXPECT_NEAR(real(r->i.c), -0.45, 1e-4);
    EXPECT_NEAR(real(r->v_dc) * 450, 333, 0.01);
    EXPECT_EQ(r->temperature_dC, 456);
    EXPECT_EQ(r->period, before + 11);
    EXPECT_EQ(r->theta, theta);
    EXPECT_NE(r->theta, 0U);
}

TEST(Protection, TheFirstFaultStays)
{
    for (const Cause &first : kCauses) {
        Drive x;
        x.start_current_mode();
        first.raise(x);
        steps_to_trip(x);
        const uint32_t period = drive_fault_record(&x.d)->period;
        for (const Cause &later : kCauses) {
            later.raise(x);
            x.run_ms(10);
            EXPECT_EQ(x.fault(), first.fault);
            EXPECT_EQ(drive_fault_record(&x.d)->period, period);
        }
    }
}

TEST(Protection, NothingRestartsByItself)
{
    for (const Cause &cause : kCauses) {
        Drive x;
        x.start_current_mode();
        const drive_in_t good = x.in;
        cause.raise(x);
        steps_to_trip(x);
        x.in = good;
        x.slow.temperature_dC = 250;
        for (int k = 0; k < 1000; ++k) { // enable is still set
            x.run_ms(1);
            ASSERT_FALSE(x.driven()) << cause.fault;
            ASSERT_TRUE(x.out.trip) << cause.fault;
            ASSERT_EQ(x.state(), DRIVE_FAULT) << cause.fault;
        }
        // nor by taking the command away and giving it again
        x.enable(false, DRIVE_MODE_CURRENT);
        x.run_ms(5);
        x.enable(true, DRIVE_MODE_CURRENT);
        x.run_ms(200);
        EXPECT_EQ(x.state(), DRIVE_FAULT) << cause.fault;
    }
}

TEST(Protection, ClearsOnlyWhenDisabledAndTheBreakIsReleased)
{
    Drive x;
    x.start_current_mode();
    x.in.hw_fault = true;
    x.run_ms(1);
    EXPECT_FALSE(drive_clear_fault(&x.d)); // both
    x.enable(false);
    x.run_ms(1);
    EXPECT_FALSE(drive_clear_fault(&x.d)); // still held
    x.in.hw_fault = false;
    x.enable(true);
    x.run_ms(1);
    EXPECT_FALSE(drive_clear_fault(&x.d)); // still enabled
    EXPECT_EQ(x.fault(), DRIVE_FAULT_HARDWARE);
    x.enable(false);
    x.run_ms(1);
    EXPECT_TRUE(drive_clear_fault(&x.d));
    x.run_ms(1);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    EXPECT_EQ(x.state(), DRIVE_OFF);
    EXPECT_FALSE(x.out.trip);
    x.run_ms(50);
    EXPECT_EQ(x.state(), DRIVE_OFF); // and waits
    x.enable(true, DRIVE_MODE_CURRENT);
    x.run_ms(2);
    EXPECT_EQ(x.state(), DRIVE_CALIBRATING);
}

// drive.h: "false: the cause is still there".
TEST(Protection, ClearIsRefusedWhileTheCauseIsThere)
{
    for (const drive_fault_t fault :
         {DRIVE_FAULT_OVER_VOLTAGE, DRIVE_FAULT_UNDER_VOLTAGE, DRIVE_FAULT_OVER_TEMPERATURE}) {
        for (const Cause &cause : kCauses) {
            if (cause.fault == fault) {
                Drive x;
                x.start_current_mode();
                cause.raise(x);
                steps_to_trip(x);
                x.enable(false);
                x.run_ms(2);
                EXPECT_FALSE(drive_clear_fault(&x.d)) << fault;
            }
        }
    }
}

TEST(Protection, BadParametersStay)
{
    drive_params_t p = direct::params();
    p.i_trip = p.i_max;
    Drive x(p);
    x.run_ms(1);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_PARAMETERS);
    EXPECT_EQ(x.state(), DRIVE_FAULT);
    EXPECT_FALSE(drive_clear_fault(&x.d));
    x.enable(true);
    x.run_ms(200);
    EXPECT_FALSE(x.driven());
    EXPECT_EQ(x.state(), DRIVE_FAULT);
}

TEST(Protection, OffsetsOutOfRangeAreFound)
{
    for (const double offset : {0.031, -0.031, 0.029}) { // of 10 A; 0.3 A is the limit
        Drive x;
        x.in.i_leg[1] = current_code(offset);
        x.enable(true);
        x.run_ms(120);
        EXPECT_EQ(x.fault() == DRIVE_FAULT_SENSOR_OFFSET, std::abs(offset) > 0.03) << offset;
    }
}

TEST(Protection, OffsetsWithinRangeAreSubtracted)
{
    Drive x;
    x.in.i_leg[0] = current_code(0.02);
    x.in.i_leg[1] = current_code(-0.015);
    x.enable(true, DRIVE_MODE_CURRENT);
    x.run_ms(120);
    ASSERT_EQ(x.state(), DRIVE_FINDING);
    EXPECT_NEAR(real(x.d.i_abc.a), 0, 1e-6);
    EXPECT_NEAR(real(x.d.i_abc.b), 0, 1e-6);
}

TEST(Protection, NoCurrentMeansAnOpenPhase)
{
    Drive x(direct::params(1));
    x.enable(true);
    x.run_ms(110 + 400);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OPEN_PHASE);
    EXPECT_FALSE(x.driven());
}

TEST(Protection, NoCarrierMeansPositionLost)
{
    Drive x(direct::params(3)); // align, then injection; nothing flows
    x.enable(true);
    x.run_ms(110 + 300 + 10);
    int ms = 0;
    for (; x.fault() == DRIVE_FAULT_NONE && ms < 1000; ++ms) {
        x.run_ms(1);
    }
    EXPECT_EQ(x.fault(), DRIVE_FAULT_POSITION_LOST);
    EXPECT_LE(ms, 60 + 30); // position_test.cpp and t_lost
}

TEST(Protection, CurrentIsDeratedByTemperatureAndVoltage)
{
    Drive x;
    x.run_ms(1);
    const double i_max = 0.5;
    for (const int dC : {250, 900, 950, 1000, 1099}) {
        for (const double v : {300.0, 380.0, 390.0, 399.0}) {
            for (const double omega : {0.2, -0.2}) {
                x.d.temperature_dC = dC;
                x.d.status.v_dc = x.d.v_dc_ahead = bench::fixed(v / 450, 28);
                x.d.position.pll.omega = bench::fixed(omega, 28);
                x.d.status.limits = DRIVE_LIMIT_SPEED; // of the same millisecond: stays
                pm_q_t i_min, i_most;
                protection_current_limits(&x.d, &i_min, &i_most);
                const double hot = std::clamp((1100.0 - dC) / 200, 0.0, 1.0);
                const double high =
                    v > 395 ? -1.0 / 32 : std::min((395.0 - v) / 15, 1.0); // a quarter is left
                const double drives = i_max * hot, brakes = i_max * hot * high;
                // a turn of the sign brakes
                EXPECT_NEAR(real(i_most), omega > 0 ? drives : brakes, 1e-4) << dC << ' ' << v;
                EXPECT_NEAR(real(i_min), omega > 0 ? -brakes : -drives, 1e-4) << dC << ' ' << v;
                EXPECT_EQ((x.d.status.limits & DRIVE_LIMIT_TEMPERATURE) != 0, dC > 900);
                EXPECT_EQ((x.d.status.limits & DRIVE_LIMIT_DC_VOLTAGE) != 0, v > 380);
                EXPECT_NE(x.d.status.limits & DRIVE_LIMIT_SPEED, 0U);
            }
        }
    }
}

// A link that rises is met where it will be in 2 ms, and that is given up within 16 ms; one that falls as it is.
TEST(Protection, BrakingGivesWayToALinkThatRises)
{
    Drive x;
    x.run_ms(1);
    const auto brakes = [&x](double v) {
        x.d.status.v_dc = bench::fixed(v / 450, 28);
        pm_q_t i_min, i_max;
        protection_link(&x.d);
        protection_current_limits(&x.d, &i_min, &i_max);
        return -real(i_min);
    };
    x.d.position.pll.omega = PM_Q(0.2);
    for (int ms = 0; ms < 200; ++ms) {
        brakes(360);
    }
    const double most = brakes(360);
    EXPECT_EQ(most, 0.5);
    EXPECT_NEAR(brakes(368), most * (395 - 384) / 15, 1e-3);
    const double held = brakes(368);
    EXPECT_NEAR(held, most * (395 - (368 + 16 * 15.0 / 16)) / 15, 1e-3); // a 16th less
    for (int ms = 0; ms < 60; ++ms) {
        brakes(368);
    }
    EXPECT_NEAR(brakes(368), most, 1e-6);
    EXPECT_NEAR(brakes(340), most, 1e-6);
}

// In the last quarter a rotor that turns takes a 32nd from the link, one that stands nothing.
TEST(Protection, TheLinkFeedsARotorThatTurnsAlone)
{
    Drive x;
    x.run_ms(1);
    for (const double omega : {0.2, -0.2, 0.0}) {
        x.d.status.v_dc = x.d.v_dc_ahead = bench::fixed(397.0 / 450, 28);
        x.d.position.pll.omega = bench::fixed(omega, 28);
        pm_q_t i_min, i_max;
        protection_current_limits(&x.d, &i_min, &i_max);
        const double least = omega > 0 ? real(i_min) : -real(i_max);
        EXPECT_NEAR(least, omega != 0 ? 0.5 / 32 : 0, 1e-6) << omega;
    }
}

// What may last does so for its time and one call; what is just at its limit never trips.
TEST(Protection, LimitsThemselvesAreAllowed)
{
    const auto calls = [](Drive &x, int most) {
        int n = 0;
        while (x.d.fault == DRIVE_FAULT_NONE && n < most) {
            protection_slow(&x.d);
            ++n;
        }
        return n;
    };
    const auto turning = [] {
        Drive x;
        x.step();
        x.d.state = DRIVE_RUNNING;
        x.d.stage = STAGE_VECTOR;
        x.d.command.mode = DRIVE_MODE_SPEED;
        x.d.position.quality = PM_ONE;
        x.d.i_abc = {0, 0, 0}; // the offsets are not known yet
        return x;
    };
    const protection_config_t c = turning().d.config.protection;
    for (const int sign : {1, -1}) {
        for (const int beyond : {0, 1}) {
            Drive x = turning();
            x.d.i_abc = {sign * c.i_sum, 0, sign * beyond};
            EXPECT_EQ(calls(x, 100), beyond ? 3 : 100);
            EXPECT_EQ(x.d.fault, beyond ? DRIVE_FAULT_SENSOR_SUM : DRIVE_FAULT_NONE);

            // A current that follows from the others makes the sum zero: it neither counts nor starts anew.
            x = turning();
            x.d.i_abc = {sign * c.i_sum, 0, sign * beyond};
            EXPECT_EQ(calls(x, 2), 2);
            x.d.i_abc = {0, 0, 0};
            x.d.completed = x.d.period;
            EXPECT_EQ(calls(x, 5), 5);
            x.d.i_abc = {sign * c.i_sum, 0, sign * beyond};
            x.d.completed = x.d.period - 1;
            EXPECT_EQ(calls(x, 100), beyond ? 1 : 100);

            x = turning();
            x.d.pll.omega = sign * (PM_ONE + beyond);
            EXPECT_EQ(calls(x, 100), beyond ? 1 : 100);
            EXPECT_EQ(x.d.fault, beyond ? DRIVE_FAULT_OVER_SPEED : DRIVE_FAULT_NONE);

            // a stall: current of a stall, the rotor below a speed that its reference is above
            x = turning();
            x.d.i_ref.q = sign * PM_Q(0.4);
            x.d.speed.reference = sign * 2 * c.omega_stall;
            x.d.position.omega_mean = sign * (c.omega_stall - beyond);
            EXPECT_EQ(calls(x, 10000), beyond ? c.stall_ms + 1 : 10000);
            EXPECT_EQ(x.d.fault, beyond ? DRIVE_FAULT_STALL : DRIVE_FAULT_NONE);
            x = turning();
            x.d.i_ref.q = sign * PM_Q(0.4);
            x.d.speed.reference = sign * (c.omega_stall + beyond);
            EXPECT_EQ(calls(x, 10000), beyond ? c.stall_ms + 1 : 10000);
        }
    }
    // Without any quality at once; with little of it, where the observer has the lead alone or injection has slipped, eight times as
    // late.
    for (const int quality : {0, 1, PM_Q(0.375) - 1, PM_Q(0.375)}) {
        for (const int weight : {PM_ONE - 1, PM_ONE}) {
            for (const uint8_t slips : {uint8_t(0), uint8_t(1)}) {
                Drive x = turning();
                x.d.position.quality = quality;
                x.d.position.weight = weight;
                x.d.position.slip.count = slips;
                const bool judged = weight == PM_ONE || slips != 0U;
                const bool lost = quality == 0 || (quality < PM_Q(0.375) && judged);
                const int after_ms = quality == 0 ? c.lost_ms + 1 : 8 * (c.lost_ms + 1);
                EXPECT_EQ(calls(x, 10000), lost ? after_ms : 10000);
                EXPECT_EQ(x.d.fault, lost ? DRIVE_FAULT_POSITION_LOST : DRIVE_FAULT_NONE);
            }
        }
    }
    // It may come and go, not be good for a moment.
    for (const int between : {PM_Q(0.3), PM_Q(0.4)}) {
        Drive x = turning();
        x.d.position.weight = PM_ONE;
        for (int ms = 0; ms < 100; ++ms) {
            x.d.position.quality = ms % 2 == 0 ? 0 : between;
            protection_slow(&x.d);
        }
        EXPECT_EQ(x.d.fault, between < PM_Q(0.375) ? DRIVE_FAULT_POSITION_LOST : DRIVE_FAULT_NONE);
    }
    // Of an imposed vector: only where it has its speed, and turns.
    for (const bool ramps : {false, true}) {
        for (const bool turns : {false, true}) {
            Drive x = turning();
            x.d.stage = STAGE_OPEN_LOOP;
            x.d.forced = true;
            x.d.omega_ramp = turns ? -1 : 0;
            x.d.omega_target = x.d.omega_ramp + (ramps ? 1 : 0);
            x.d.position.weight = PM_ONE;
            x.d.position.quality = 1; // little is not none
            EXPECT_EQ(calls(x, 10000), 10000) << ramps << turns;
            x.d.position.quality = 0;
            const bool judged = turns && !ramps;
            EXPECT_EQ(calls(x, 10000), judged ? c.lost_ms + 1 : 10000) << ramps << turns;
        }
    }
    for (const int32_t dC : {c.temp_trip_dC + 100, c.temp_derate_dC - 1, int{c.temp_derate_dC}}) {
        Drive x = turning();
        x.d.temperature_dC = static_cast<int16_t>(dC);
        pm_q_t i_min, i_max;
        protection_current_limits(&x.d, &i_min, &i_max);
        EXPECT_EQ(i_max, dC > c.temp_trip_dC ? 0 : x.d.config.i_max);
        EXPECT_EQ(i_min, -i_max);
    }
    for (const int32_t dC : {c.temp_trip_dC - 1, int{c.temp_trip_dC}}) {
        Drive x = turning();
        x.d.temperature_dC = static_cast<int16_t>(dC);
        calls(x, 10);
        EXPECT_EQ(x.d.fault == DRIVE_FAULT_OVER_TEMPERATURE, dC == c.temp_trip_dC);
    }
}

// A position is not judged where there is none.
TEST(Protection, CurrentModeHasNoPositionToLose)
{
    Drive x;
    x.step();
    x.d.state = DRIVE_RUNNING;
    x.d.stage = STAGE_VECTOR;
    x.d.i_abc = {0, 0, 0};
    x.d.position.quality = 0;
    x.d.command.mode = DRIVE_MODE_SPEED;
    protection_slow(&x.d);
    EXPECT_GT(x.d.lost, 0);
    x.d.command.mode = DRIVE_MODE_CURRENT;
    protection_slow(&x.d);
    EXPECT_EQ(x.d.lost, 0);
    EXPECT_EQ(x.d.fault, DRIVE_FAULT_NONE);
}

// In control, or turned by a vector at the speed of its ramp; else the rotor has not followed, and shows no third harmonic for that.
TEST(Protection, AMissingThirdHarmonicIsNamedWhereTheRotorTurns)
{
    const struct {
        drive_stage_t stage;
        pm_q_t omega, ramp, square;
        drive_fault_t fault;
    } cases[] = {
        {STAGE_VECTOR, PM_Q(0.3), 0, 0, DRIVE_FAULT_NO_THIRD_HARMONIC},
        {STAGE_VECTOR, PM_Q(0.3), 0, PM_ONE, DRIVE_FAULT_POSITION_LOST},
        {STAGE_OPEN_LOOP, PM_Q(0.23), PM_Q(0.3), 0, DRIVE_FAULT_NO_THIRD_HARMONIC},
        {STAGE_OPEN_LOOP, PM_Q(0.22), PM_Q(0.3), 0, DRIVE_FAULT_POSITION_LOST},
        {STAGE_OPEN_LOOP, PM_Q(-0.3), PM_Q(-0.3), PM_ONE, DRIVE_FAULT_POSITION_LOST},
    };
    for (const auto &at : cases) {
        Drive x;
        x.d.stage = at.stage;
        x.d.config.position.traits_high = SOURCE_THIRD_TURN;
        x.d.position.pll.omega = at.omega;
        x.d.position.omega_mean = at.omega;
        x.d.position.square = at.square;
        x.d.omega_ramp = at.ramp;
        EXPECT_EQ(protection_fault_of_lost(&x.d), at.fault) << at.omega << ' ' << at.square;
    }
}

// A vector in control waits for it for its time; an imposed one does not.
TEST(Protection, AThirdHarmonicThatStaysAwayIsAFault)
{
    const struct {
        drive_stage_t stage;
        unsigned ms;
        drive_fault_t fault;
    } cases[] = {{STAGE_VECTOR, POSITION_ABSENT_MS, DRIVE_FAULT_NONE},
                 {STAGE_VECTOR, POSITION_ABSENT_MS + 1U, DRIVE_FAULT_NO_THIRD_HARMONIC},
                 {STAGE_OPEN_LOOP, POSITION_ABSENT_MS + 1U, DRIVE_FAULT_NONE}};
    for (const auto &at : cases) {
        Drive x;
        x.step();
        x.d.stage = at.stage;
        x.d.state = DRIVE_RUNNING;
        x.d.i_abc = {0, 0, 0};
        x.d.position.quality = PM_ONE;
        x.d.position.absent_ms = static_cast<uint16_t>(at.ms);
        protection_slow(&x.d);
        EXPECT_EQ(x.d.fault, at.fault) << at.ms;
    }
}

// One by one, where the control period has seen that something is beyond its limit.
TEST(Protection, StepNamesTheCause)
{
    const struct {
        pm_q_t i, v_dc;
        bool hw_fault;
        drive_fault_t fault;
    } cases[] = {{0, bench::fixed(300.0 / 450, 28), false, DRIVE_FAULT_NONE},
                 {PM_Q(0.95), bench::fixed(300.0 / 450, 28), false, DRIVE_FAULT_OVER_CURRENT},
                 {0, bench::fixed(401.0 / 450, 28), false, DRIVE_FAULT_OVER_VOLTAGE},
                 {0, bench::fixed(59.0 / 450, 28), false, DRIVE_FAULT_UNDER_VOLTAGE},
                 {0, bench::fixed(300.0 / 450, 28), true, DRIVE_FAULT_HARDWARE}};
    for (const auto &at : cases) {
        for (const bool live : {true, false}) {
            Drive x;
            x.d.stage = live ? STAGE_VECTOR : STAGE_OFF;
            x.d.state = live ? DRIVE_RUNNING : DRIVE_OFF;
            x.d.i_abc = {at.i, -at.i, 0};
            x.d.status.v_dc = at.v_dc;
            x.d.hw_fault = at.hw_fault;
            protection_step(&x.d);
            EXPECT_EQ(x.d.fault, live || at.hw_fault ? at.fault : DRIVE_FAULT_NONE) << at.fault;
        }
    }
}

// A stall is one of a control that should turn the rotor with that much current; each condition by itself.
TEST(Protection, WhatIsNoStall)
{
    for (int missing = 0; missing < 5; ++missing) {
        Drive x;
        x.step();
        x.d.state = missing == 1 ? DRIVE_STOPPING : DRIVE_RUNNING;
        x.d.stage = missing == 2 ? STAGE_OPEN_LOOP : STAGE_VECTOR;
        x.d.command.mode = DRIVE_MODE_SPEED;
        x.d.i_abc = {0, 0, 0};
        x.d.status.limits = DRIVE_LIMIT_VOLTAGE;
        x.d.i_ref.q = missing == 4 ? PM_Q(0.29) : PM_Q(0.31);
        x.d.position.quality = PM_ONE;
        x.d.speed.reference = missing == 3 ? 0 : PM_Q(0.5);
        for (int ms = 0; ms < 3000; ++ms) {
            protection_slow(&x.d);
        }
        EXPECT_EQ(x.d.fault, missing == 0 ? DRIVE_FAULT_STALL : DRIVE_FAULT_NONE) << missing;
    }
}

// i^2 through a low-pass: at twice the current that is borne for good, from cold, after t ln(4 / (4 - 1.1025)).
TEST(Protection, WindingsAreOverloadedInEveryModeAfterTheirTime)
{
    drive_params_t p = direct::params();
    p.t_winding = 10;
    p.i_rated = 2000; // full scale is 10 A
    for (const drive_stage_t stage : {STAGE_PROCEDURE, STAGE_OPEN_LOOP, STAGE_VECTOR}) {
        for (const double share : {2.0, 1.04}) {
            Drive x(p);
            x.d.state = DRIVE_RUNNING;
            x.d.stage = stage;
            x.d.i_ab = {static_cast<pm_q_t>(std::lround(0.2 * share * PM_ONE * std::cos(0.7))),
                        static_cast<pm_q_t>(std::lround(0.2 * share * PM_ONE * std::sin(0.7)))};
            int ms = 0;
            for (; ms < 200000 && x.d.fault == DRIVE_FAULT_NONE; ++ms) {
                protection_heat(&x.d);
            }
            const double expected_ms = 1e4 * std::log(share * share / (share * share - 1.05 * 1.05));
            if (share < 1.05) {
                EXPECT_EQ(x.d.fault, DRIVE_FAULT_NONE);
                continue;
            }
            EXPECT_EQ(x.d.fault, DRIVE_FAULT_OVERLOAD);
            EXPECT_NEAR(ms, expected_ms, 0.005 * expected_ms);
            // cools with the bridge off, also in the fault
            const pm_q_t hot = x.d.heat;
            for (ms = 0; ms < 10000; ++ms) {
                drive_slow(&x.d, &x.slow);
            }
            EXPECT_NEAR(x.d.heat, hot * std::exp(-1.0), 0.01 * hot);
        }
    }
}

// R i^2 of all phases: a zero-sequence current i_0 counts as sqrt(2) i_0 of the vector, what two sets have apart as itself.
TEST(Protection, CurrentsBesideTheVectorHeatToo)
{
    const auto square = [](const std::function<void(drive_t &)> &change) {
        Drive x(direct::params());
        x.d.state = DRIVE_RUNNING;
        x.d.stage = STAGE_VECTOR;
        change(x.d);
        protection_heat(&x.d);
        return x.d.heat;
    };
    const auto vector = [](double share) {
        return [share](drive_t &d) { d.i_ab.alpha = static_cast<pm_q_t>(share * PM_ONE); };
    };
    const pm_q_t zero = square([](drive_t &d) { d.open_winding.i = PM_ONE / 4; });
    const pm_q_t apart = square([](drive_t &d) { d.two_sets.z = {PM_ONE / 4, PM_ONE / 8}; });
    EXPECT_NEAR(zero, square(vector(std::sqrt(2.0) / 4)), 2);
    EXPECT_NEAR(apart, square(vector(std::hypot(1.0 / 4, 1.0 / 8))), 2);
    EXPECT_GT(zero, 0);
}

// The same of the bridge, which another board bears better or worse: i_bridge, t_bridge.
TEST(Protection, TheBridgeIsOverloadedAfterItsTime)
{
    drive_params_t p = direct::params();
    p.t_bridge = 5000;
    p.i_rated = 8000; // the windings bear more
    p.i_bridge = 2000;
    for (const double share : {2.0, 1.04}) {
        Drive x(p);
        x.d.state = DRIVE_RUNNING;
        x.d.stage = STAGE_VECTOR;
        x.d.i_ab = {static_cast<pm_q_t>(std::lround(0.2 * share * PM_ONE)), 0};
        int ms = 0;
        for (; ms < 100000 && x.d.fault == DRIVE_FAULT_NONE; ++ms) {
            protection_heat(&x.d);
        }
        if (share < 1.05) {
            EXPECT_EQ(x.d.fault, DRIVE_FAULT_NONE);
            continue;
        }
        const double expected_ms = 5e3 * std::log(share * share / (share * share - 1.05 * 1.05));
        EXPECT_EQ(x.d.fault, DRIVE_FAULT_BRIDGE_OVERLOAD);
        EXPECT_NEAR(ms, expected_ms, 0.005 * expected_ms);
    }
}

// Three quarters of rated current or of its torque, and no speed: a stall. Less may hold a rotor for good.
TEST(Protection, AStallInTorqueControl)
{
    const struct {
        double i_q, torque; // of what counts
        int slow;
        bool stall;
    } cases[] = {{0, 0, 1, false},       {1.01, 0, 1, true}, {-1.01, 0, 1, true}, {1.01, 0, 0, false},
                 {0.99, 0.99, 1, false}, {0, 1.01, 1, true}, {0, -1.01, 1, true}, {0, 1.01, 0, false}};
    for (const auto &at : cases) {
        Drive x;
        x.step();
        x.d.state = DRIVE_RUNNING;
        x.d.stage = STAGE_VECTOR;
        x.d.command.mode = DRIVE_MODE_TORQUE;
        x.d.i_abc = {0, 0, 0};
        x.d.position.quality = PM_ONE;
        const double i_stall = bench::real(x.d.config.protection.i_stall);
        EXPECT_NEAR(i_stall, 0.75 * 0.4, 1e-6); // of 4 A, 10 A
        x.d.i_ref.q = bench::fixed(at.i_q * i_stall, 28);
        x.d.torque_target = bench::fixed(at.torque * i_stall * bench::real(x.d.config.machine.psi_m), 28);
        x.d.position.omega_mean = x.d.config.protection.omega_stall - at.slow;
        for (int ms = 0; ms < 3000; ++ms) {
            protection_slow(&x.d);
        }
        EXPECT_EQ(x.d.fault, at.stall ? DRIVE_FAULT_STALL : DRIVE_FAULT_NONE)
            << at.i_q << ' ' << at.torque << ' ' << at.slow;
    }
}

// What may flow at all is a stall, too, where it is less.
TEST(Protection, ASmallCurrentLimitIsAStall)
{
    drive_params_t p = direct::params();
    p.i_max = 2500;
    p.i_open_loop = 2000;
    EXPECT_NEAR(bench::real(Drive(p).d.config.protection.i_stall), 0.25 * 15 / 16, 1e-6);
}

// In speed control the same current is a stall only where the rotor should turn: zero speed holds a load.
TEST(Protection, RatedCurrentAtZeroSpeedIsAStallOnlyOnTheWayToAnother)
{
    for (const bool wanted : {false, true}) {
        Drive x;
        x.step();
        x.d.state = DRIVE_RUNNING;
        x.d.stage = STAGE_VECTOR;
        x.d.command.mode = DRIVE_MODE_SPEED;
        x.d.i_abc = {0, 0, 0};
        x.d.position.quality = PM_ONE;
        x.d.i_ref = {-x.d.config.protection.i_stall, x.d.config.protection.i_stall / 8};
        x.d.speed.reference = x.d.config.protection.omega_stall + (wanted ? 1 : 0);
        for (int ms = 0; ms < 3000; ++ms) {
            protection_slow(&x.d);
        }
        EXPECT_EQ(x.d.fault, wanted ? DRIVE_FAULT_STALL : DRIVE_FAULT_NONE);
    }
}

TEST(Protection, EveryFaultHasAText)
{
    for (int f = 0; f < DRIVE_FAULT_COUNT; ++f) {
        EXPECT_STRNE(drive_fault_text(static_cast<drive_fault_t>(f)), "unknown");
        EXPECT_STRNE(drive_fault_text(static_cast<drive_fault_t>(f)), "");
    }
    EXPECT_STREQ(drive_fault_text(DRIVE_FAULT_COUNT), "unknown");
}

} // namespace
