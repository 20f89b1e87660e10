// The state machine, alone and closed on the plant.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "tests/support/application.h"
#include "tests/support/plants.h"
#include "tests/unit/drive/direct.h"

namespace
{

using bench::real;
using direct::Drive;

// At the end of a ramp, speed over the last 0.2 s.
constexpr double kSpeed = 0.01;
constexpr double kPosition_deg = 6; // METHODS.md 0.3, the demonstration's own bound

plant_config_t ipm()
{
    plant_config_t c = plants::ipm_1000();
    c.mech.T_coulomb_Nm = 0.02;
    return c;
}

class Closed
{
  public:
    explicit Closed(const plant_config_t &config = ipm(), const drive_params_t &p = direct::params(),
                    double theta_e_rad = 1.0)
        : periods_per_ms_(static_cast<int>(std::lround(config.inverter.f_pwm_Hz * 1e-3))),
          plant_(plant_create(&config, theta_e_rad, &error_), &plant_destroy)
    {
        sim_loop_init(&loop, plant_.get(), &p);
    }

    void command(bool enable, double speed_rad_s, drive_mode_t mode = DRIVE_MODE_SPEED)
    {
        drive_command_t c = {};
        c.enable = enable;
        c.mode = mode;
        c.speed_mrad_s = static_cast<int32_t>(std::lround(1000 * speed_rad_s));
        drive_command(&loop.app.drive, &c);
    }

    void run_ms(int ms)
    {
        for (int k = 0; k < periods_per_ms_ * ms; ++k) {
            sim_loop_step(&loop);
            const bool driven = loop.app.out.legs != PM_LEGS_OFF;
            const drive_state_t s = state();
            if (states.empty() || states.back() != s) {
                states.push_back(s);
            }
            if (s == DRIVE_OFF || s == DRIVE_CALIBRATING || s == DRIVE_FAULT) {
                driven_while_off +=
                    driven && loop.app.drive.period % 10 != 1 ? 1 : 0; // it changes after this step
            }
        }
    }

    drive_state_t state() const
    {
        return drive_status(&loop.app.drive)->state;
    }

    plant_truth_t truth() const
    {
        plant_truth_t t;
        plant_truth(plant_.get(), &t);
        return t;
    }

    plant_t *plant() const
    {
        return plant_.get();
    }

    sim_loop_t loop;
    std::vector<drive_state_t> states;
    int driven_while_off = 0;

  private:
    int periods_per_ms_;
    const char *error_ = nullptr;
    std::unique_ptr<plant_t, void (*)(plant_t *)> plant_;
};

TEST(Drive, PassesThroughItsStates)
{
    drive_params_t p = direct::params();
    p.speed_bandwidth = 6000; // how far the stop swings over is the speed control's
    Closed x(ipm(), p);
    x.run_ms(20);
    x.command(true, 30);
    x.run_ms(800);
    EXPECT_EQ(x.state(), DRIVE_RUNNING);
    EXPECT_NEAR(x.truth().omega_mech_rad_s, 30, kSpeed * 30 + 0.5);
    x.command(false, 30);
    x.run_ms(600);
    EXPECT_EQ(x.states, (std::vector<drive_state_t>{DRIVE_OFF, DRIVE_CALIBRATING, DRIVE_FINDING,
                                                    DRIVE_RUNNING, DRIVE_STOPPING, DRIVE_OFF}));
    EXPECT_EQ(x.driven_while_off, 0);
    EXPECT_NEAR(x.truth().omega_mech_rad_s, 0, 1.0);
    EXPECT_EQ(drive_status(&x.loop.app.drive)->fault, DRIVE_FAULT_NONE);
}

// Off at once, from a turning rotor.
TEST(Drive, WhatIsNotKnownWithTheBridgeOffIsZero)
{
    Closed x;
    x.run_ms(20);
    x.command(true, 30);
    x.run_ms(800);
    const drive_status_t *status = drive_status(&x.loop.app.drive);
    EXPECT_GT(status->omega, 0);
    EXPECT_GT(status->quality, 0);
    drive_trip(&x.loop.app.drive, DRIVE_FAULT_REMOTE_LOST);
    x.run_ms(3);
    EXPECT_NEAR(x.truth().omega_mech_rad_s, 30, 3);
    EXPECT_EQ(status->i.d, 0);
    EXPECT_EQ(status->i.q, 0);
    EXPECT_EQ(status->i_ref.d, 0);
    EXPECT_EQ(status->i_ref.q, 0);
    EXPECT_EQ(status->omega, 0);
    EXPECT_EQ(status->omega_ref, 0);
    EXPECT_EQ(status->theta, 0U);
    EXPECT_EQ(status->quality, 0);
    EXPECT_NE(drive_fault_record(&x.loop.app.drive)->omega, 0); // of the moment, as it was
}

TEST(Drive, WithdrawnEnableStopsTheStart)
{
    for (const int after_ms : {50, 108, 130, 150}) { // while calibrating, in the pulses, settling
        Closed x;
        x.command(true, 30);
        x.run_ms(after_ms);
        x.command(false, 0);
        x.run_ms(150);
        EXPECT_EQ(x.state(), DRIVE_OFF) << after_ms;
        EXPECT_EQ(x.driven_while_off, 0) << after_ms;
    }
}

TEST(Drive, ModeIsLatchedOnlyWhenOff)
{
    Drive x;
    x.start_current_mode();
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    x.enable(true, DRIVE_MODE_TORQUE);
    x.run_ms(50);
    EXPECT_EQ(x.d.command.mode, DRIVE_MODE_CURRENT);
    EXPECT_EQ(x.d.stage, STAGE_OPEN_LOOP);
    x.in.hw_fault = true; // off by the shortest way
    x.enable(false, DRIVE_MODE_TORQUE);
    x.run_ms(1);
    x.in.hw_fault = false;
    x.run_ms(1);
    ASSERT_TRUE(drive_clear_fault(&x.d));
    x.run_ms(1);
    ASSERT_EQ(x.state(), DRIVE_OFF);
    x.enable(true, DRIVE_MODE_TORQUE);
    EXPECT_EQ(x.d.command.mode, DRIVE_MODE_TORQUE);
}

// PWM excitation: halves that differ and a sample between them, from when injection leads; nothing of that stays in the
// output when it has ended.
TEST(Drive, WhatACarrierAsksOfThePeriodIsDone)
{
    drive_params_t p = direct::params(1);
    p.injection = INJECTION_pwm_excitation;
    Closed x(ipm(), p);
    x.command(true, 10);
    x.run_ms(600);
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    const drive_out_t &out = x.loop.app.out;
    EXPECT_NE(out.compare[0][0], out.compare[0][1]);
    EXPECT_EQ(out.instants.sample_at[0], static_cast<uint16_t>(p.timer_counts));
    EXPECT_EQ(out.instants.sample_at[1], 0);
    x.command(true, 60); // the observer leads
    x.run_ms(1500);
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    EXPECT_EQ(out.compare[0][0], out.compare[0][1]);
    EXPECT_EQ(out.instants.sample_at[0], 0);
    x.command(true, 10);
    x.run_ms(1500);
    EXPECT_EQ(out.instants.sample_at[0], static_cast<uint16_t>(p.timer_counts));
    drive_trip(&x.loop.app.drive, DRIVE_FAULT_REMOTE_LOST);
    x.run_ms(1);
    EXPECT_EQ(out.instants.sample_at[0], 0);
}

// The derivative within the zero vectors: ahead of the period's end and behind its beginning in turn, with no carrier.
TEST(Drive, WhatAnObserverAsksOfThePeriodIsDone)
{
    drive_params_t p = direct::params(2);
    direct::make_spm(p);
    p.observer = OBSERVER_zero_vector;
    p.speed_max = 34000;
    p.i_open_loop = 4500;
    Closed x(plants::spm_400(), p);
    const pm_instants_t &instants = x.loop.app.out.instants;
    EXPECT_EQ(instants.sample_at[0], 0);
    x.command(true, 20);
    x.run_ms(2000);
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    const auto whole = static_cast<uint16_t>(2 * p.timer_counts);
    for (int k = 0; k < 10; ++k) {
        const uint16_t before = instants.sample_at[0];
        sim_loop_step(&x.loop);
        const uint16_t one = std::min(before, instants.sample_at[0]);
        const uint16_t other = std::max(before, instants.sample_at[0]);
        EXPECT_GT(one, 0) << k;
        EXPECT_LT(one, whole / 4) << k;
        EXPECT_GT(other, whole - whole / 4) << k;
        EXPECT_LT(other, whole) << k;
        EXPECT_EQ(instants.sample_at[1], 0) << k;
    }
    drive_trip(&x.loop.app.drive, DRIVE_FAULT_REMOTE_LOST);
    x.run_ms(1);
    EXPECT_EQ(instants.sample_at[0], 0);
}

TEST(Drive, TwoThatAskForOneSampleAreRefused)
{
    drive_params_t p = direct::params(1);
    p.observer = OBSERVER_zero_vector;
    p.speed_low = 50000;
    p.speed_high = p.speed_trip / 5 * 2;
    p.speed_max = p.speed_trip / 2;
    drive_config_t c = {};
    EXPECT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
    p.injection = INJECTION_pwm_excitation;
    const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_FALSE(r.ok);
    EXPECT_EQ(r.param, DRIVE_PARAM_injection);
}

// One base register reaches all that a control period of the default sources uses: LDRD's offset ends at 1020.
// Behind them is the window of a sine carrier, or what a source at the neutral keeps of half of one.
TEST(Drive, StateIsSmall)
{
    EXPECT_LE(offsetof(drive_t, position.injection) + sizeof(pulsating_square_t), 1020U);
    // with a source at the neutral, whose last carrier is 160 bytes, what a third harmonic has shown, what the star makes, the
    // pairs of zero_vector.h, levels of direct_torque.h, the mean of voltages that are held, the zero sequence of an open winding,
    // and a second set of windings
    EXPECT_LE(offsetof(drive_t, config.modulator) + sizeof(modulator_config_t),
              1020U + 204U + 160U + 16U + 48U + 4U + 8U + 40U + 80U);
    // 92 bytes of them say which regulator it is, what the machine is, whether the position slips, what a leg loses,
    // what the legs hold, and which of their currents are seen; 24 are the units of a command, instead of seven
    // divisions at 1 kHz, 24 what windings and bridge bear, 16 the short after a fault, 22 the legs that do not conduct,
    // 32 how boundary detection and the DC link's voltage read the pulses of a start, 116 what the other ways to find
    // angle and pole are told, 8 which end of the axis the pulses take for the magnet's, 80 what those keep beside the
    // position sources, 48 how a rotor that turns is caught, 60 what the imposed vector knows of the rotor, 148 how block
    // commutation is configured and what it has learnt, 28 the carrier that rests at standstill, and 228 what the sources at the
    // neutral and the stages of injection are told, 32 what the second harmonic at the neutral is compared with, 56 how the
    // inductances there are measured and were found, 16 where within its zero vectors the current is sampled, 24 what a
    // third harmonic has shown, to both kinds of commutation, 12 the duty of block commutation: command, reference, ramp, 8 the
    // steps of the current that tells the pole by its torque, 28 what unlike resistors of the star make, 4 how far the current
    // of an imposed vector may rise, 48 what the EMF within the zero vectors keeps from one sample to the next, 8 what low-side
    // shunts show in block commutation, 8 what makes the active flux stiff against the speed control, 8 where the DC link was and
    // will be, 8 the levels of direct torque control, 8 the mean of voltages that are held, 80 the zero sequence of an open winding, and
    // 176 a second set of windings, of which 40 are a slower copy of its current control
    EXPECT_LE(sizeof(drive_t), 2752U + sizeof(injection_t) + sizeof(saliency_map_result_t));
}

TEST(Drive, StaysOffWithoutACommand)
{
    Drive x;
    for (int k = 0; k < 200; ++k) {
        x.run_ms(1);
        ASSERT_EQ(x.state(), DRIVE_OFF);
        ASSERT_FALSE(x.driven());
        ASSERT_FALSE(x.out.trip);
    }
}

TEST(Drive, CalibrationTakes1024PeriodsWithTheBridgeOff)
{
    Drive x;
    x.enable(true, DRIVE_MODE_CURRENT);
    x.run_ms(1); // the state machine takes the command
    int periods = 0;
    while (x.d.sequence.procedure == PROCEDURE_calibrate && periods < 5000) {
        x.run_ms(1);
        periods += 10;
        if (x.d.sequence.procedure == PROCEDURE_calibrate) {
            ASSERT_FALSE(x.driven());
        }
    }
    EXPECT_NEAR(periods, 1024, 10);
}

// A rotor whose EMF is above the link: pulses of 5 % of full scale, six times a turn of 180 periods, are no offset. Twin: told as
// noise they are, of their mean.
TEST(Drive, CalibrationWaitsUntilNoCurrentFlows)
{
    for (const bool told_as_noise : {false, true}) {
        drive_params_t p = direct::params();
        p.i_noise = told_as_noise ? static_cast<int32_t>(0.02 * p.i_full_scale * 1000) : p.i_noise;
        Drive x(p);
        x.enable(true, DRIVE_MODE_CURRENT);
        int calibrating = 0;
        for (int ms = 0; ms < 500; ++ms) {
            const double pulse = ms < 300 && ms % 3 == 0 ? 0.05 : 0;
            x.in.i_leg[0] = direct::current_code(0.003 + pulse);
            x.in.i_leg[1] = direct::current_code(-pulse);
            x.run_ms(1);
            if (x.d.sequence.procedure == PROCEDURE_calibrate) {
                calibrating = ms;
                ASSERT_FALSE(x.driven());
            }
        }
        const double mean = told_as_noise ? 0.05 / 3 : 0;
        EXPECT_NEAR(calibrating, told_as_noise ? 102 : 300 + 102, 4);
        EXPECT_NEAR(static_cast<double>(x.d.zero[0] - PM_ONE) / PM_ONE, 0.003 + mean,
                    told_as_noise ? 1e-3 : 1e-4);
        EXPECT_NEAR(static_cast<double>(x.d.zero[1] - PM_ONE) / PM_ONE, -mean, told_as_noise ? 1e-3 : 1e-4);
    }
}

TEST(Drive, CalibrationGivesUpWhereACurrentDoesNotEnd)
{
    Drive x;
    x.enable(true, DRIVE_MODE_CURRENT);
    for (int ms = 0; ms < 7000; ++ms) {
        x.in.i_leg[2] = direct::current_code(ms % 2 == 0 ? 0.02 : 0);
        x.run_ms(1);
        ASSERT_FALSE(x.driven());
    }
    EXPECT_EQ(x.fault(), DRIVE_FAULT_POSITION_NOT_FOUND);
    EXPECT_EQ(drive_fault_record(&x.d)->refusal.procedure, PROCEDURE_calibrate);
    EXPECT_EQ(drive_fault_record(&x.d)->refusal.reason, PM_FAILED_TIMEOUT);
}

// A noisy sensor that is told so is not taken for a current.
TEST(Drive, CalibrationTakesTheNoiseThatIsTold)
{
    for (const bool told : {false, true}) {
        drive_params_t p = direct::params();
        p.i_noise = told ? static_cast<int32_t>(0.01 * p.i_full_scale * 1000) : 1000;
        Drive x(p);
        x.enable(true, DRIVE_MODE_CURRENT);
        for (int ms = 0; ms < 120; ++ms) {
            x.in.i_leg[0] = direct::current_code(ms % 2 == 0 ? 0.03 : -0.03);
            x.run_ms(1);
        }
        EXPECT_EQ(x.d.sequence.procedure == PROCEDURE_calibrate, !told);
    }
}

TEST(Drive, SpeedReferenceIsHeldToItsLimit)
{
    Closed x;
    x.command(true, 500);
    x.run_ms(1400);
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    EXPECT_NEAR(real(drive_status(&x.loop.app.drive)->omega_ref) * 540 / 3, 150, 0.1);
    EXPECT_NE(drive_status(&x.loop.app.drive)->limits & DRIVE_LIMIT_SPEED, 0U);
    EXPECT_EQ(drive_status(&x.loop.app.drive)->fault, DRIVE_FAULT_NONE);
}

// Per-unit references are made once, and anew with other bases.
TEST(Drive, ReferencesFollowCommandAndBases)
{
    direct::Drive x;
    x.command.speed_mrad_s = 54000;
    x.command.current_mA = 2000;
    x.enable(false);
    x.run_ms(1);
    const pm_q_t omega = x.d.omega_target;
    EXPECT_NEAR(static_cast<double>(omega) / PM_ONE, 54.0 * 3 / 540, 1e-6);
    EXPECT_NEAR(static_cast<double>(x.d.i_target) / PM_ONE, 0.2, 1e-6);
    x.command.current_mA = 1000;
    x.enable(false);
    x.run_ms(1);
    EXPECT_EQ(x.d.omega_target, omega);
    EXPECT_NEAR(static_cast<double>(x.d.i_target) / PM_ONE, 0.1, 1e-6);

    drive_params_t p = direct::params();
    p.speed_trip *= 2;
    drive_config_t other = {};
    ASSERT_TRUE(drive_configure(&other, &p, PM_CHANNELS).ok);
    drive_reconfigure(&x.d, &other);
    x.run_ms(1);
    EXPECT_NEAR(2 * x.d.omega_target, omega, 4);
}

TEST(Drive, EstimateIsTheRotor)
{
    Closed x;
    x.command(true, 80);
    x.run_ms(1200);
    double worst = 0;
    for (int k = 0; k < 200; ++k) {
        x.run_ms(1);
        // the status belongs to the sample one period ago
        const plant_truth_t t = x.truth();
        const double theta = t.theta_e_rad - t.omega_mech_rad_s * 3 * 1e-4;
        const double error = bench::wrapped(theta - bench::rad(drive_status(&x.loop.app.drive)->theta));
        worst = std::max(worst, std::abs(error) / bench::kDegree);
    }
    EXPECT_LE(worst, kPosition_deg);
}

// By each train of pulses: the pole that is there, and how sure of it.
TEST(Drive, PulsesFindTheRotorAndSayHowSure)
{
    for (const int32_t train : {0, 1}) {
        for (const double rotor_deg : {20.0, 200.0}) {
            drive_params_t p = direct::params(1);
            p.position_pulses = train;
            Closed x(ipm(), p, rotor_deg * bench::kDegree);
            x.command(true, 0);
            drive_t &d = x.loop.app.drive;
            for (int ms = 0; ms < 500 && x.state() != DRIVE_RUNNING; ++ms) {
                x.run_ms(1);
            }
            EXPECT_NEAR(bench::wrapped(bench::rad(d.sequence.theta) - rotor_deg * bench::kDegree) /
                            bench::kDegree,
                        0, 5)
                << train;
            EXPECT_GE(d.sequence.margin, 5 * PM_SIGMA_ONE) << train;
        }
    }
}

TEST(Drive, LockedRotorIsAStall)
{
    plant_config_t c = ipm();
    c.mech.locked = true;
    drive_params_t p = direct::params();
    p.t_stall = 100;
    Closed x(c, p);
    x.command(true, 100);
    int ms = 0;
    for (; x.state() != DRIVE_FAULT && ms < 3000; ++ms) {
        x.run_ms(1);
    }
    EXPECT_EQ(drive_status(&x.loop.app.drive)->fault, DRIVE_FAULT_STALL);
    EXPECT_EQ(x.driven_while_off, 0);
}

TEST(Drive, RunningAwayIsOverSpeed)
{
    Closed x;
    x.command(true, 140);
    x.run_ms(1300);
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    double speed = x.truth().omega_mech_rad_s;
    while (x.state() == DRIVE_RUNNING && speed < 200) {
        speed += 0.2;
        plant_set_speed(x.plant(), speed);
        x.run_ms(1);
    }
    EXPECT_EQ(drive_status(&x.loop.app.drive)->fault, DRIVE_FAULT_OVER_SPEED);
    EXPECT_NEAR(speed, 180, 4);
}

// The other way round as well.
TEST(Drive, RunningAwayBackwardsIsOverSpeed)
{
    Closed x;
    x.command(true, -140);
    x.run_ms(1300);
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    double speed = x.truth().omega_mech_rad_s;
    ASSERT_LT(speed, -100);
    while (x.state() == DRIVE_RUNNING && speed > -200) {
        speed -= 0.2;
        plant_set_speed(x.plant(), speed);
        x.run_ms(1);
    }
    EXPECT_EQ(drive_status(&x.loop.app.drive)->fault, DRIVE_FAULT_OVER_SPEED);
    EXPECT_NEAR(speed, -180, 4);
}

// Without injection the observer hands back to the open loop when the speed falls below speed_low (21 rad/s), in both
// directions, and the rotor follows the vector; above speed_high (40 rad/s) the observer leads again.
TEST(Drive, ObserverFallsBackToOpenLoopAtLowSpeed)
{
    for (const double way : {1.0, -1.0}) {
        Closed x(ipm(), direct::params(2));
        const drive_t &d = x.loop.app.drive;
        x.command(true, 60 * way);
        x.run_ms(3000);
        ASSERT_EQ(d.stage, STAGE_VECTOR);
        EXPECT_NEAR(x.truth().omega_mech_rad_s, 60 * way, kSpeed * 60);
        x.command(true, 24 * way); // above speed_low nothing changes
        x.run_ms(1500);
        ASSERT_EQ(d.stage, STAGE_VECTOR);
        x.command(true, 12 * way);
        double handed_back = 0;
        double highest = 0;
        for (int ms = 0; ms < 3000; ++ms) {
            x.run_ms(1);
            const double speed = way * x.truth().omega_mech_rad_s;
            if (d.stage == STAGE_OPEN_LOOP && handed_back == 0) {
                handed_back = speed;
            }
            highest = ms > 2000 ? std::max(highest, std::abs(speed - 12)) : 0;
        }
        EXPECT_EQ(d.stage, STAGE_OPEN_LOOP);
        // the estimate lags the ramp of 200 rad/s2 by 2 a / w_n, w_n = 2 pi 25 Hz
        EXPECT_NEAR(handed_back, 21 - 2 * 200 / (2 * bench::kPi * 25), 2);
        EXPECT_LE(highest, 3); // damped, on the vector
        EXPECT_NEAR(way * real(drive_status(&d)->omega_ref) * 540 / 3, 12, 0.01);
        EXPECT_EQ(x.state(), DRIVE_RUNNING);
        x.command(true, 60 * way);
        x.run_ms(3000);
        EXPECT_EQ(d.stage, STAGE_VECTOR);
        EXPECT_NEAR(x.truth().omega_mech_rad_s, 60 * way, kSpeed * 60);
        EXPECT_EQ(drive_status(&d)->fault, DRIVE_FAULT_NONE);
    }
}

// A stop goes through the open loop, too, and ends with the bridge off and a rotor at rest.
TEST(Drive, StopWithoutInjectionEndsInOpenLoop)
{
    Closed x(ipm(), direct::params(2));
    const drive_t &d = x.loop.app.drive;
    x.command(true, 60);
    x.run_ms(3000);
    ASSERT_EQ(d.stage, STAGE_VECTOR);
    x.command(false, 60);
    bool open = false;
    for (int ms = 0; ms < 3000 && x.state() != DRIVE_OFF; ++ms) {
        x.run_ms(1);
        open = open || d.stage == STAGE_OPEN_LOOP;
    }
    EXPECT_TRUE(open);
    EXPECT_EQ(x.state(), DRIVE_OFF);
    EXPECT_NEAR(x.truth().omega_mech_rad_s, 0, 3);
    EXPECT_EQ(drive_status(&d)->fault, DRIVE_FAULT_NONE);
}

// While the carrier is on, current control has the share that injection leaves it, and the modulator passes what is small.
TEST(Drive, ACarrierSlowsCurrentControlDown)
{
    drive_params_t p = direct::params(1);
    p.injection = INJECTION_pulsating_sine; // its window leaves current control less than was asked for
    Drive x(p);
    x.step();
    x.d.stage = STAGE_VECTOR;
    const pm_gain_t kp = x.d.config.regulator.synchronous_pi.d.kp;
    for (const bool on : {true, false}) {
        x.d.position.inject = on;
        x.d.position.weight = PM_ONE / 16 * 15; // the observer leads almost
        drive_prepare(&x.d);
        EXPECT_EQ(x.d.modulator.carrier, on);
        EXPECT_EQ(x.d.regulator_config.synchronous_pi.d.kp < kp, on);
    }
}

// Between the pulses and running injection settles for 30 ms: without torque, and with its slow part at work.
TEST(Drive, InjectionSettlesForThirtyMilliseconds)
{
    Drive x(direct::params(1));
    x.step();
    x.d.command.enable = true;
    x.d.command.mode = DRIVE_MODE_SPEED;
    x.d.state = DRIVE_FINDING;
    x.d.stage = STAGE_VECTOR;
    x.d.state_ms = 0;
    x.d.sequence.procedure = PROCEDURE_NONE;
    x.d.i_abc = {0, 0, 0};
    x.d.i_ref = {PM_Q(0.1), PM_Q(0.1)};
    position_reset(&x.d.position, &x.d.config.position, &direct::kAtRest, {0, 0}, true);
    x.d.position.pll.omega = PM_Q(0.05);
    for (int ms = 1; ms < 30; ++ms) {
        drive_slow(&x.d, &x.slow);
        ASSERT_EQ(x.d.state, DRIVE_FINDING) << ms;
        EXPECT_EQ(x.d.i_ref.d, 0);
        EXPECT_EQ(x.d.i_ref.q, 0);
    }
    EXPECT_NEAR(real(x.d.position.omega_mean), 0.05, 1e-3); // its filter of 5 ms has followed
    drive_slow(&x.d, &x.slow);
    EXPECT_EQ(x.d.state, DRIVE_RUNNING);
    EXPECT_EQ(x.d.speed.reference, PM_Q(0.05)); // from where the rotor is
}

// An identification that another command replaces has failed, and says why; one that has ended keeps its report.
TEST(Drive, AnAbandonedIdentificationIsReported)
{
    for (const int state : {COMMISSIONING_RUNNING, COMMISSIONING_DONE, COMMISSIONING_IDLE}) {
        Drive x;
        x.d.commissioning_report.state = static_cast<uint8_t>(state);
        x.enable(true, DRIVE_MODE_SPEED);
        const bool running = state == COMMISSIONING_RUNNING;
        EXPECT_EQ(x.d.commissioning_report.state, running ? COMMISSIONING_FAILED : state);
        EXPECT_EQ(x.d.commissioning_report.reason, running ? COMMISSIONING_ABORTED : COMMISSIONING_NO_REASON);
    }
}

TEST(Drive, IdentificationBeginsAtNothing)
{
    Drive x;
    x.step();
    x.d.commissioning_report.progress = 55;
    procedure_begin(&x.d, PROCEDURE_identify);
    EXPECT_EQ(x.d.commissioning_report.progress, 0);
}

// Whichever regulator, and with the optional stages between source and loop: the plant turns as commanded.
TEST(Drive, EveryRegulatorTurnsTheMotor)
{
    for (int32_t id = 0; id < REGULATOR_COUNT; ++id) {
        for (const int32_t second_harmonic : {0, 1}) {
            drive_params_t p = direct::params(2);
            p.regulator = id;
            p.second_harmonic = second_harmonic;
            p.f_pwm *= 2; // the finite set has one state per period: 20 kHz
            p.timer_counts = 4250;
            plant_config_t c = ipm();
            c.inverter.f_pwm_Hz = 20e3;
            c.inverter.timer_counts = 4250;
            Closed x(c, p);
            x.command(true, -60);
            x.run_ms(2500);
            double mean = 0;
            for (int ms = 0; ms < 100; ++ms) {
                x.run_ms(1);
                mean += x.truth().omega_mech_rad_s / 100;
            }
            EXPECT_NEAR(mean, -60, kSpeed * 60) << id;
            EXPECT_EQ(x.loop.app.drive.stage, STAGE_VECTOR) << id;
            EXPECT_EQ(drive_status(&x.loop.app.drive)->fault, DRIVE_FAULT_NONE) << id;
        }
    }
}

TEST(Drive, EveryRegulatorSaysWhetherToTrip)
{
    for (int32_t id = 0; id < REGULATOR_COUNT; ++id) {
        drive_params_t p = direct::params(2);
        p.regulator = id;
        direct::Drive x(p);
        x.start_current_mode();
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE) << id;
        EXPECT_TRUE(x.driven()) << id;
        EXPECT_EQ(x.out.trip, 0) << id;
    }
}

// While the motor turns, a set may be exchanged for one in the same units and with the same methods alone: each difference
// by itself, mantissa and exponent.
TEST(Drive, SameFrameLooksAtEachBaseAndMethod)
{
    const Drive x;
    const drive_config_t &c = x.d.config;
    EXPECT_TRUE(drive_same_frame(&c, &c));
    using Change = void (*)(drive_config_t &);
    const Change changes[] = {
        [](drive_config_t &o) { o.base.v.m++; },
        [](drive_config_t &o) { o.base.v.e++; },
        [](drive_config_t &o) { o.base.i.m++; },
        [](drive_config_t &o) { o.base.i.e++; },
        [](drive_config_t &o) { o.base.omega.m++; },
        [](drive_config_t &o) { o.base.omega.e++; },
        [](drive_config_t &o) { o.base.t_s.m++; },
        [](drive_config_t &o) { o.base.t_s.e++; },
        [](drive_config_t &o) { o.pole_pairs.m++; },
        [](drive_config_t &o) { o.pole_pairs.e++; },
        [](drive_config_t &o) { o.modulator.counts++; },
        [](drive_config_t &o) { o.injection = !o.injection; },
        [](drive_config_t &o) { o.regulator.id = static_cast<regulator_id_t>(o.regulator.id + 1); },
        [](drive_config_t &o) {
            o.position.injection.id = static_cast<injection_id_t>(o.position.injection.id + 1);
        },
        [](drive_config_t &o) { o.start++; },
    };
    for (const Change change : changes) {
        drive_config_t other = c;
        change(other);
        EXPECT_FALSE(drive_same_frame(&c, &other));
        EXPECT_FALSE(drive_same_frame(&other, &c));
    }
}

// Coasting opens the bridge at once, in any state, but only when nothing is commanded.
TEST(Drive, CoastOpensTheBridgeWhenDisabled)
{
    Drive x;
    x.start_current_mode();
    x.command.coast = true;
    x.enable(true, DRIVE_MODE_CURRENT);
    x.run_ms(2);
    EXPECT_EQ(x.state(), DRIVE_RUNNING);
    EXPECT_TRUE(x.driven());
    x.enable(false, DRIVE_MODE_CURRENT);
    x.run_ms(1);
    EXPECT_EQ(x.state(), DRIVE_OFF);
    x.step();
    EXPECT_FALSE(x.driven());
}

// A parameter set that was refused is mended while the drive is in its fault.
TEST(Drive, GoodParametersEndTheirFault)
{
    drive_params_t p = direct::params();
    p.i_max = p.i_trip + 1;
    Drive x(p);
    ASSERT_EQ(x.d.fault, DRIVE_FAULT_PARAMETERS);
    const drive_params_t good = direct::params();
    drive_config_t config = {};
    ASSERT_TRUE(drive_configure(&config, &good, PM_CHANNELS).ok);
    x.run_ms(1);
    ASSERT_EQ(x.d.state, DRIVE_FAULT);
    x.enable(true, DRIVE_MODE_SPEED); // of before
    drive_reconfigure(&x.d, &config);
    EXPECT_EQ(x.d.state, DRIVE_OFF); // at once
    x.run_ms(3);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    EXPECT_EQ(x.state(), DRIVE_OFF);
    x.enable(true, DRIVE_MODE_SPEED);
    x.run_ms(1);
    EXPECT_EQ(x.state(), DRIVE_CALIBRATING);
    x.enable(false, DRIVE_MODE_SPEED);
    // another fault stays
    x.in.hw_fault = true;
    x.run_ms(1);
    ASSERT_EQ(x.fault(), DRIVE_FAULT_HARDWARE);
    drive_reconfigure(&x.d, &config);
    EXPECT_EQ(x.d.fault, DRIVE_FAULT_HARDWARE);
}

// Standing still on an imposed angle, a stop must end: open_loop_slow() and stop() count in the same
// still_ms.
TEST(Drive, StopEndsOnAnImposedAngle)
{
    Drive x;
    x.start_current_mode();
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    x.enable(false, DRIVE_MODE_CURRENT);
    x.run_ms(200);
    EXPECT_EQ(x.state(), DRIVE_OFF);
    EXPECT_FALSE(x.driven());
}

// 20 ms of standstill end a stop: the call after them does.
TEST(Drive, StopWaitsForTwentyMillisecondsOfStandstill)
{
    Drive x;
    x.start_current_mode();
    x.enable(false, DRIVE_MODE_CURRENT);
    x.run_ms(1);
    ASSERT_EQ(x.state(), DRIVE_STOPPING);
    int ms = 0;
    for (; x.state() == DRIVE_STOPPING && ms < 1000; ++ms) {
        x.run_ms(1);
    }
    EXPECT_EQ(ms, 21);
}

// A time that goes on for longer than its counter stays at the end, and does not begin anew.
TEST(Drive, TheTimeInAStateDoesNotWrap)
{
    Drive x;
    x.start_current_mode();
    x.d.state_ms = UINT16_MAX;
    x.run_ms(2);
    EXPECT_EQ(x.d.state_ms, UINT16_MAX);
}

// The flag is that of the last millisecond, from the regulator or from the modulator.
TEST(Drive, VoltageLimitIsSaidOnce)
{
    for (const int source : {0, 1, 2, 3}) {
        Drive x;
        x.start_current_mode();
        x.d.voltage.limited = source == 1;
        x.d.modulator.limited = source == 2 ? 1 : source == 3 ? -1 : 0;
        drive_slow(&x.d, &x.slow);
        EXPECT_EQ((drive_status(&x.d)->limits & DRIVE_LIMIT_VOLTAGE) != 0, source != 0) << source;
        drive_slow(&x.d, &x.slow);
        EXPECT_EQ(drive_status(&x.d)->limits & DRIVE_LIMIT_VOLTAGE, 0U) << source;
    }
}

// Without a fault there is nothing to clear, and a machine that is being stopped must go on being stopped.
TEST(Drive, ClearWithoutAFaultChangesNothing)
{
    Closed x;
    x.command(true, 60);
    x.run_ms(800);
    x.command(false, 0);
    x.run_ms(5);
    ASSERT_EQ(x.state(), DRIVE_STOPPING);
    drive_clear_fault(&x.loop.app.drive);
    x.run_ms(2);
    EXPECT_EQ(x.state(), DRIVE_STOPPING);
}

} // namespace
