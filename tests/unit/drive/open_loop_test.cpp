#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/drive/direct.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::real;
using direct::Drive;

constexpr double kAngle_deg = 0.01;
// pm_atan2() 0.0018 degree, frames 3 LSB, integrals 2^-22.
constexpr double kVector = 1e-4;

// IPM-1000's defaults: 2 A, 300 ms, 50 rad/s2, 10 A and 540 rad/s.
constexpr double kCurrent = 0.2, kSlope = 50 * 3 * 1e-3 / 540;
constexpr double kMost = 0.236 / (9.0 / 4 * (75e-3 - 43e-3)) / 10; // (L_q - L_d) i is 4/9 of psi_m
constexpr int kAlign_ms = 300;

Drive started()
{
    Drive x(direct::params(2));
    x.d.command.mode = DRIVE_MODE_SPEED;
    x.d.state = DRIVE_FINDING;
    procedure_begin(&x.d, PROCEDURE_align);
    return x;
}

void slow(Drive &x, int ms)
{
    for (int k = 0; k < ms; ++k) {
        if (x.d.sequence.procedure == PROCEDURE_align) {
            if (procedure_slow(&x.d) == PM_DONE) {
                x.d.sequence.procedure = PROCEDURE_NONE;
            }
        } else {
            open_loop_slow(&x.d);
        }
    }
}

// With the EMF of a rotor that lags behind by so much.
void slow_with(Drive &x, int ms, double lag_deg = 0, double share = 1)
{
    for (int k = 0; k < ms; ++k) {
        const double emf = real(x.d.omega_ramp) * real(x.d.config.machine.psi_m) * share;
        const pm_machine_t &m = x.d.config.machine;
        const double i = real(x.d.i_open), drop = i * real(x.d.follow.R);
        const double reactive = real(x.d.omega_ramp) * i * (real(m.L_d) + real(m.L_q)) / 2;
        x.d.voltage.v = {bench::fixed(drop + emf * std::sin(lag_deg * kDegree), PM_WIDE_BITS),
                         bench::fixed(reactive + emf * std::cos(lag_deg * kDegree), PM_WIDE_BITS)};
        slow(x, 1);
    }
}

// What current control gives next while the current is what it should be, in its frame.
Complex next_voltage(const drive_t &d, pm_dq_t i, pm_q_t omega)
{
    regulator_t regulator = d.regulator;
    const regulator_in_t in = {i, i, omega, PM_ONE, {1 << 30, 0}, PM_ONE};
    regulator_out_t out = {};
    regulator_step(&regulator, &d.config.regulator, &in, &out);
    return {real(out.v.d, PM_WIDE_BITS), real(out.v.q, PM_WIDE_BITS)};
}

TEST(OpenLoop, AlignSweepsAQuarterTurnIntoPlace)
{
    Drive x = started();
    EXPECT_EQ(x.d.theta_open, PM_TURN(0.75));
    double last = -90;
    for (int ms = 1; ms < kAlign_ms; ++ms) {
        slow(x, 1);
        const double angle = bench::rad(x.d.theta_open) / kDegree;
        EXPECT_NEAR(angle, std::min(0.0, -90 + 180.0 * ms / kAlign_ms), kAngle_deg + 1e-3 * ms) << ms;
        EXPECT_GE(angle, last) << ms;
        last = angle;
        EXPECT_EQ(x.d.omega_ramp, 0);
    }
    EXPECT_NEAR(bench::rad(x.d.theta_open), 0, kAngle_deg * kDegree); // and stays
}

// Whatever ran before: without current, voltage and speed.
TEST(OpenLoop, BeginsWithNothing)
{
    Drive x(direct::params(2));
    x.d.omega_ramp = x.d.omega_open = x.d.emf_open = x.d.i_open = PM_Q(0.3);
    x.d.agree_ms = 7;
    x.d.i_ref = {PM_Q(0.1), PM_Q(-0.2)};
    x.d.position.quality = 0;
    regulator_reset(&x.d.regulator, &x.d.config.regulator, {PM_Q(0.2), PM_Q(-0.3)}, {PM_Q(0.1), 0},
                    PM_Q(0.5));
    open_loop_start(&x.d);
    EXPECT_EQ(x.d.stage, STAGE_OPEN_LOOP);
    EXPECT_EQ(x.d.theta_open, PM_TURN(0.75));
    for (const pm_q_t begins :
         {x.d.omega_ramp, x.d.omega_open, x.d.emf_open, x.d.i_open, x.d.i_ref.d, x.d.i_ref.q}) {
        EXPECT_EQ(begins, 0);
    }
    EXPECT_EQ(x.d.agree_ms, 0);
    EXPECT_EQ(x.d.position.quality, PM_ONE);
    EXPECT_NEAR(std::abs(next_voltage(x.d, {0, 0}, 0)), 0, kVector);
}

TEST(OpenLoop, CurrentRampsToItsValue)
{
    Drive x = started();
    for (int ms = 1; ms < 200; ++ms) {
        slow(x, 1);
        EXPECT_NEAR(real(x.d.i_ref.d), std::min(kCurrent, kCurrent * ms / 50), 1e-6) << ms;
        EXPECT_EQ(x.d.i_ref.q, 0);
    }
}

TEST(OpenLoop, SpeedRampsAfterTheAlign)
{
    for (const double target : {0.3, -0.3}) {
        Drive x = started();
        x.d.omega_target = bench::fixed(target, 28);
        slow(x, kAlign_ms - 1);
        EXPECT_EQ(x.d.omega_ramp, 0);
        for (int ms = 1; ms < 1500; ++ms) {
            slow_with(x, 1);
            ASSERT_NEAR(real(x.d.omega_ramp), std::copysign(std::min(ms * kSlope, 0.3), target), 1e-5) << ms;
        }
    }
}

// In torque mode the open loop only serves to reach the speed at which the observer takes over, a quarter above speed_high, in the
// direction of the torque; at most speed_max (150 rad/s).
TEST(OpenLoop, TorqueModeGoesBeyondSpeedHigh)
{
    for (const double torque : {0.1, -0.1}) {
        for (const double high : {40.0, 130.0}) {
            Drive x = started();
            x.d.command.mode = DRIVE_MODE_TORQUE;
            x.d.torque_target = bench::fixed(torque, 28);
            x.d.config.position.omega_high = bench::fixed(high * 3 / 540, 28);
            x.d.config.position.omega_low = x.d.config.position.omega_high - 1; // no hand-over before
            slow_with(x, kAlign_ms + 8000);
            EXPECT_NEAR(real(x.d.omega_ramp), std::copysign(std::min(1.25 * high, 150.0) * 3 / 540, torque),
                        1e-5);
        }
    }
}

// Nothing is commanded beyond speed_max (150 rad/s).
TEST(OpenLoop, SpeedIsLimited)
{
    for (const double way : {1.0, -1.0}) {
        Drive x = started();
        x.d.config.position.omega_high = PM_Q(2.0); // no hand-over
        x.d.omega_target = bench::fixed(way * 1.5, 28);
        slow_with(x, kAlign_ms + 8000);
        EXPECT_NEAR(real(x.d.omega_ramp), way * 150 * 3 / 540, 1e-5);
    }
}

// The voltage across the vector shows the speed of a rotor that swings: the vector yields, and more so at the
// quarter period than for a speed that stays, which is no swinging.
TEST(OpenLoop, VectorYieldsToASwingingRotor)
{
    Drive x = started();
    slow(x, kAlign_ms);
    x.d.voltage.v.q = PM_WIDE(0.01);
    slow(x, 1);
    EXPECT_LT(x.d.omega_open, x.d.omega_ramp);
    slow(x, 500);
    EXPECT_NEAR(real(x.d.omega_open), real(x.d.omega_ramp), 1e-3);
    x.d.voltage.v.q = 0;
    slow(x, 1);
    EXPECT_GT(x.d.omega_open, x.d.omega_ramp);
}

// A movement of the vector alone moves the current across a rotor that stands still, by L_q: with (L_q - L_d) i of 4/9 psi_m, the most
// that i_most lets, and L_q another 15 % larger, that must die out, where the vector once turned to and fro by 5 degrees in each millisecond.
TEST(OpenLoop, VectorDoesNotYieldToItsOwnMovement)
{
    Drive x = started();
    slow(x, kAlign_ms);
    const pm_machine_t &m = x.d.config.machine;
    const double i = kMost, R = real(x.d.follow.R);
    x.d.i_open = x.d.i_vector = bench::fixed(i, 28);
    x.d.status.i = bench::dq({i, 0});
    x.d.omega_ramp = 0;
    x.d.omega_open = PM_Q(0.02);
    for (int ms = 0; ms < 120; ++ms) {
        const double across = real(x.d.omega_open) * 1.15 * real(m.L_q) * i;
        x.d.voltage.v = {bench::fixed(R * i, PM_WIDE_BITS), bench::fixed(across, PM_WIDE_BITS)};
        open_loop_hold(&x.d);
    }
    EXPECT_NEAR(real(x.d.omega_open), 0, 1e-4);
}

TEST(OpenLoop, CurrentModeTakesTheCurrentAskedForUpToTheLimit)
{
    for (const double asked : {0.05, -0.1, 2.0}) {
        Drive x = started();
        x.d.command.mode = DRIVE_MODE_CURRENT;
        x.d.i_target = bench::fixed(asked, 28);
        slow(x, 1000);
        EXPECT_NEAR(real(x.d.i_ref.d), std::min(std::abs(asked), 0.5), 1e-6) << asked;
    }
}

TEST(OpenLoop, StoppingLeadsToStandstill)
{
    Drive x = started();
    x.d.omega_target = PM_Q(0.2);
    slow(x, 1000);
    EXPECT_GT(x.d.omega_ramp, PM_Q(0.15));
    x.d.state = DRIVE_STOPPING;
    slow(x, 1000);
    EXPECT_EQ(x.d.omega_ramp, 0);
}

// In the frame of the phases.
Complex current_vector(const Drive &x)
{
    const bool open = x.d.stage == STAGE_OPEN_LOOP;
    return bench::complex(x.d.i_ref) *
           std::polar(1.0, bench::rad(open ? x.d.theta_open : x.d.position.pll.theta));
}

// The observer agrees, the rotor lags the vector by a load angle: the vectors of current and voltage must not
// jump.
TEST(OpenLoop, HandOverKeepsCurrentAndVoltage)
{
    for (const double lag_deg : {0.0, 25.0, -60.0}) {
        Drive x = started();
        x.d.omega_target = PM_Q(0.5);
        slow_with(x, kAlign_ms + 1000, lag_deg);
        ASSERT_EQ(x.d.stage, STAGE_OPEN_LOOP); // nothing has agreed so far
        x.d.position.quality = PM_ONE;
        x.d.position.pll.omega = x.d.omega_ramp;
        x.d.position.pll.theta = x.d.theta_open - bench::turns(lag_deg * kDegree);
        x.d.voltage.v = {bench::fixed(-0.05, PM_WIDE_BITS), bench::fixed(0.12, PM_WIDE_BITS)};
        const Complex u = Complex{-0.05, 0.12} * std::polar(1.0, bench::rad(x.d.theta_open));
        const Complex i = current_vector(x);
        follow_again(&x.d.follow, FOLLOW_STANDS); // the voltage above is no load, for 30 ms
        int ms = 0;
        for (; x.d.stage == STAGE_OPEN_LOOP && ms < 100; ++ms) {
            x.d.position.pll.omega = x.d.omega_ramp;
            slow(x, 1);
        }
        ASSERT_EQ(x.d.stage, STAGE_VECTOR);
        EXPECT_NEAR(ms, 21, 1); // agreed for 20 ms
        EXPECT_NEAR(std::abs(current_vector(x) - i), 0, kVector) << lag_deg;
        const Complex v = next_voltage(x.d, x.d.i_ref, x.d.position.pll.omega);
        EXPECT_NEAR(std::abs(v * std::polar(1.0, bench::rad(x.d.position.pll.theta)) - u), 0, kVector)
            << lag_deg;
        EXPECT_EQ(x.d.speed.reference, x.d.position.pll.omega);
        EXPECT_NEAR(real(x.d.speed.pi.integral, 22), real(x.d.i_ref.q), kVector);

        // what is left on the d-axis fades by a sixteenth each ms, beside what the load asks for
        double left = real(x.d.i_ref.d);
        for (int n = 0; n < 200; ++n) {
            reference_vector(&x.d);
            left *= 15.0 / 16;
            Drive plain = x;
            plain.d.i_open = 0;
            reference_vector(&plain.d);
            Drive next = x;
            reference_vector(&next.d);
            EXPECT_NEAR(real(x.d.i_open), left, kVector) << n;
            EXPECT_NEAR(real(next.d.i_ref.d - plain.d.i_ref.d), left * 15 / 16, kVector) << n;
        }
    }
}

// What damps swings of the rotor follows each sample of the voltage: an observer that began at the speed of one was lost.
TEST(OpenLoop, AnObserverBeginsAtTheSpeedOfTheRamp)
{
    for (const double sign : {1.0, -1.0}) {
        Drive x = started();
        x.d.omega_target = PM_Q(0.5 * sign);
        slow_with(x, kAlign_ms, 0);
        while (std::abs(x.d.omega_ramp) < x.d.config.position.omega_high) {
            slow_with(x, 1);
            x.d.omega_open = 3 * x.d.omega_ramp;
            drive_prepare(&x.d);
            EXPECT_EQ(x.d.forced, std::abs(x.d.omega_ramp) < x.d.config.position.omega_high);
            EXPECT_EQ(x.d.position.pll.omega, x.d.forced ? x.d.omega_open : x.d.omega_ramp);
        }
        EXPECT_FALSE(x.d.forced);
    }
}

// Half a second of waiting for it, from omega_high (0.222) on, is the most.
TEST(OpenLoop, NoHandOverWithoutAgreement)
{
    for (const int what : {0, 1, 2}) {
        Drive x = started();
        x.d.omega_target = what == 2 ? PM_Q(0.2) : PM_Q(0.5); // below omega_high
        slow(x, kAlign_ms);
        int ms = 0;
        for (; ms < 2000 && x.d.fault == DRIVE_FAULT_NONE; ++ms) {
            ASSERT_EQ(x.d.stage, STAGE_OPEN_LOOP) << what;
            x.d.position.quality = what == 0 ? PM_Q(0.4) : PM_ONE;
            x.d.position.pll.omega = what == 1 ? x.d.omega_ramp / 2 : x.d.omega_ramp;
            slow_with(x, 1);
        }
        EXPECT_EQ(x.d.fault, what == 2 ? DRIVE_FAULT_NONE : DRIVE_FAULT_POSITION_LOST);
        EXPECT_NEAR(ms, what == 2 ? 2000 : 40 * 3 / 540.0 / kSlope + 500, 3);
    }
}

// A rotor that does not answer: once more from standstill, after a rest with the most current that saliency lets it, then a fault.
// The vector that the user gave is not tried again.
TEST(OpenLoop, ARotorThatStandsIsTriedOnceMoreWithTheLargestCurrent)
{
    for (const drive_mode_t mode : {DRIVE_MODE_SPEED, DRIVE_MODE_TORQUE, DRIVE_MODE_CURRENT}) {
        Drive x = started();
        x.d.command.mode = mode;
        x.d.omega_target = PM_Q(0.3);
        x.d.torque_target = PM_Q(0.1);
        x.d.i_target = PM_Q(0.2);
        x.d.status.v_dc = PM_Q(0.5);
        slow_with(x, kAlign_ms - 1, 0, 0);
        int ms = 0;
        int tries = 1;
        for (pm_q_t before = 0; x.d.fault == DRIVE_FAULT_NONE && ms < 2000; ++ms) {
            drive_prepare(&x.d); // the turn of a period
            slow_with(x, 1, 0, 0);
            if (x.d.omega_ramp < before) {
                tries++;
                EXPECT_EQ(x.d.omega_ramp, 0);
                EXPECT_LT(ms, 300);
                EXPECT_EQ(x.d.i_vector, x.d.config.open_loop.i_most);
                slow_with(x, 100, 0, 0);
                ms += 100;
                EXPECT_EQ(x.d.omega_ramp, 0);
                EXPECT_EQ(x.d.i_open, x.d.config.open_loop.i_most);
            }
            before = x.d.omega_ramp;
        }
        EXPECT_EQ(x.d.fault, DRIVE_FAULT_STALL);
        EXPECT_EQ(tries, mode == DRIVE_MODE_CURRENT ? 1 : 2);
        EXPECT_LT(ms, 800);
    }
}

// One that follows and then stands has a load that no current moves.
TEST(OpenLoop, ARotorThatFallsOutIsNotTriedAgain)
{
    Drive x = started();
    x.d.omega_target = PM_Q(0.2);
    slow_with(x, kAlign_ms);
    slow_with(x, 1000);
    ASSERT_TRUE(x.d.follow.follows);
    ASSERT_EQ(x.d.fault, DRIVE_FAULT_NONE);
    for (int ms = 0; ms < 200; ++ms) {
        drive_prepare(&x.d);
        slow_with(x, 1, 0, 0);
    }
    EXPECT_EQ(x.d.fault, DRIVE_FAULT_STALL);
    EXPECT_FALSE(x.d.tried);
}

// Beyond 40 degrees of lag more current, as much as saliency lets it; back to i_open_loop below 24; not in current mode.
TEST(OpenLoop, CurrentFollowsTheLoad)
{
    for (const double way : {1.0, -1.0}) {
        Drive x = started();
        x.d.omega_target = bench::fixed(0.2 * way, 28);
        slow_with(x, kAlign_ms + 900, 30);
        EXPECT_NEAR(real(x.d.i_ref.d), kCurrent, 1e-6);
        slow_with(x, 300, 50);
        EXPECT_NEAR(real(x.d.i_ref.d), kMost, 1e-6);
        slow_with(x, 300, -30); // for a moment, on its way, there is no load
        EXPECT_NEAR(real(x.d.i_ref.d), kMost, 0.03);
        slow_with(x, 1000, -10);
        EXPECT_NEAR(real(x.d.i_ref.d), kCurrent, 1e-6);
        slow_with(x, 300, -50);
        EXPECT_NEAR(real(x.d.i_ref.d), kMost, 1e-6);
    }
}

// Back below omega_low: the imposed vector makes the torque that there was, with twice the current that it takes and half of
// i_open_loop (0.2), at least i_open_loop, at most i_max (0.5).
TEST(OpenLoop, ResumeKeepsTorqueAndVoltage)
{
    for (const Complex i : {Complex{-0.05, 0.2}, Complex{0.1, -0.15}, Complex{0, 0.01}, Complex{0, 0.45}}) {
        Drive x = started();
        x.d.stage = STAGE_VECTOR;
        x.d.position.pll.theta = PM_TURN(0.9);
        x.d.position.pll.omega = PM_Q(0.05);
        x.d.status.i = bench::dq(i);
        x.d.voltage.v = {bench::fixed(-0.03, PM_WIDE_BITS), bench::fixed(0.08, PM_WIDE_BITS)};
        open_loop_resume(&x.d);
        EXPECT_EQ(x.d.stage, STAGE_OPEN_LOOP);
        EXPECT_EQ(x.d.omega_ramp, PM_Q(0.05));
        const double rotor = 0.9 * 2 * bench::kPi, frame = bench::rad(x.d.theta_open);
        const Complex wanted = real(x.d.i_open) * std::polar(1.0, frame - rotor);
        EXPECT_NEAR(wanted.imag(), i.imag(), kVector);
        EXPECT_GT(wanted.real(), 0);
        EXPECT_NEAR(real(x.d.i_open), std::clamp(2 * std::abs(i.imag()) + 0.1, 0.2, 0.5), kVector);
        const Complex u = Complex{-0.03, 0.08} * std::polar(1.0, rotor - frame);
        const pm_dq_t present = bench::dq(i * std::polar(1.0, rotor - frame));
        EXPECT_NEAR(std::abs(next_voltage(x.d, present, x.d.omega_ramp) - u), 0, kVector);
    }
}

// A magnet told a tenth too strong shows a tenth less EMF than the speed, before and after: no swing, to which the vector would yield.
TEST(OpenLoop, WhatIsToldWrongIsNoSwingOfTheVectorResumed)
{
    Drive x = started();
    slow(x, kAlign_ms);
    const pm_machine_t &m = x.d.config.machine;
    const double omega = 0.1, R = real(x.d.follow.R), emf = 0.9 * omega * real(m.psi_m);
    const Complex i = {0, 0.01};
    x.d.stage = STAGE_VECTOR;
    x.d.position.pll.omega = bench::fixed(omega, 28);
    x.d.status.i = bench::dq(i);
    x.d.voltage.v = {bench::fixed(-omega * real(m.L_q) * i.imag(), PM_WIDE_BITS),
                     bench::fixed(R * i.imag() + emf, PM_WIDE_BITS)};
    open_loop_resume(&x.d);
    const double vector = real(x.d.i_open);
    x.d.status.i = bench::dq({vector, 0});
    x.d.voltage.v = {bench::fixed(R * vector, PM_WIDE_BITS),
                     bench::fixed(omega * real(m.L_d) * vector + emf, PM_WIDE_BITS)};
    open_loop_hold(&x.d);
    EXPECT_NEAR(real(x.d.omega_open), omega, 0.01 * omega);
    x.d.emf_open = 0;
    open_loop_hold(&x.d);
    EXPECT_GT(std::abs(real(x.d.omega_open) - omega), 0.05 * omega) << "of which the vector would run ahead";
}

// Where an observer gives up the lead the current steps to that of the vector. For 5 ms the voltage is that of L, no sign of a swing
// or of a lag. Without those 5 ms the vector yields to it, and the lag is seen where there is none.
TEST(OpenLoop, TheStepOfTheCurrentIsNoSwing)
{
    for (const bool settles : {true, false}) {
        Drive x = started();
        slow(x, kAlign_ms);
        const pm_machine_t &m = x.d.config.machine;
        const double omega = 0.1, R = real(x.d.follow.R), emf = omega * real(m.psi_m);
        x.d.omega_target = bench::fixed(omega, 28);
        x.d.stage = STAGE_VECTOR;
        x.d.position.pll.omega = bench::fixed(omega, 28);
        x.d.voltage.v = {0, bench::fixed(emf, PM_WIDE_BITS)};
        open_loop_resume(&x.d);
        EXPECT_EQ(x.d.i_ref.d, x.d.i_open) << "from the first period on";
        EXPECT_EQ(x.d.i_ref.q, 0);
        x.d.rest_ms = settles ? x.d.rest_ms : 0;
        double yields = 0, lag_deg = 0;
        for (int ms = 1; ms < 100; ++ms) {
            const double step = ms > 5 ? 0 : 0.3, i = real(x.d.i_open), reactive = real(m.L_d) * i;
            x.d.status.i = bench::dq({i, 0});
            x.d.voltage.v = {bench::fixed(R * i + step, PM_WIDE_BITS),
                             bench::fixed(real(x.d.omega_open) * reactive + emf - step, PM_WIDE_BITS)};
            slow(x, 1);
            yields = std::max(yields, std::abs(real(x.d.omega_open) - omega));
            lag_deg = std::max(lag_deg, std::abs(bench::rad(x.d.follow.lag)) / kDegree);
        }
        if (settles) {
            EXPECT_LT(yields, 0.01 * omega);
            EXPECT_LT(lag_deg, 10);
        } else {
            EXPECT_GT(yields, 0.05 * omega);
            EXPECT_GT(lag_deg, 45);
        }
    }
}

// The observer falls back to the open loop only without injection, and when both reference and estimate are below
// omega_low (0.117 of the base), whichever way they turn.
TEST(OpenLoop, FallsBackWhenReferenceAndEstimateAreSlow)
{
    const struct {
        double reference, estimate;
        int start;
        bool back;
    } cases[] = {{0.11, 0.11, 2, true},  {-0.11, -0.11, 2, true}, {0.12, 0.11, 2, false},
                 {0.11, 0.12, 2, false}, {-0.12, 0.11, 2, false}, {0.11, -0.12, 2, false},
                 {0.11, 0.11, 1, false}};
    for (const auto &at : cases) {
        Drive x(direct::params(at.start));
        x.command.enable = true;
        x.command.mode = DRIVE_MODE_SPEED;
        x.command.speed_mrad_s = static_cast<int32_t>(std::lround(at.reference * 540e3 / 3));
        drive_command(&x.d, &x.command);
        x.step(); // measures the DC link
        x.d.state = DRIVE_RUNNING;
        x.d.stage = STAGE_VECTOR;
        x.d.sequence.procedure = PROCEDURE_NONE;
        position_reset(&x.d.position, &x.d.config.position, &direct::kAtRest, {0, 0}, true);
        x.d.position.pll.omega = bench::fixed(at.estimate, 28);
        x.d.speed.reference = bench::fixed(at.reference, 28);
        drive_slow(&x.d, &x.slow);
        EXPECT_EQ(x.d.stage == STAGE_OPEN_LOOP, at.back) << at.reference << " " << at.estimate;
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    }
}

} // namespace
