// Block commutation in the drive, firmware/drive/block.h: start, end, loss and search on the plant of a fan, with switching
// bridge, dead time, leg capacitance and converter. The plant says where the rotor is.
#include "firmware/drive/block.h"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "firmware/params/parameters.h"
#include "tests/unit/drive/fan.h"

namespace
{

using fan::Fan;
using fan::kRated_Nm;
using fan::kRated_rad_s;

constexpr double kAngle_deg = 1;
constexpr double kVirtual_deg = 1.5; // tests/scenario/six_step_virtual.yaml

// A channel at the star point, behind 1 kHz.
void star_point(plant_config_t &c)
{
    c.sensor.v_zero_full_scale_V = 5;
    c.sensor.v_zero_filter_s = 159e-6;
    c.sensor.v_zero_noise_lsb = 0.5;
    c.sensor.v_zero_offset_V = 0.02;
}

TEST(Block, StartsFromRestByTheCrossingsBothWays)
{
    for (const double direction : {1.0, -1.0}) {
        Fan x;
        x.enable();
        x.speed_rel(0.4 * direction);
        x.run_s(1.2);
        ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
        ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
        x.run_s(0.1);
        EXPECT_NEAR(x.omega_rel, 0.4 * direction, 0.02 * 0.4);
        EXPECT_LT(x.worst_deg, kAngle_deg);
        EXPECT_EQ(x.drive().block_tries, 0);
        EXPECT_GT(direction * drive_status(&x.drive())->i.q, 0) << "it drives the fan";
        EXPECT_EQ(drive_status(&x.drive())->quality, PM_ONE);
    }
}

// Torque of the fan 1.8e-6 w^2, and its friction.
TEST(Block, TorqueModeTurnsTheFanAtTheSpeedOfItsTorque)
{
    for (const double direction : {1.0, -1.0}) {
        Fan x;
        x.enable(DRIVE_MODE_TORQUE);
        x.torque_rel(0.2 * direction);
        x.run_s(2.0);
        const double omega = std::sqrt((0.2 * kRated_Nm - 2e-3) / 1.8e-6);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
        EXPECT_NEAR(x.omega_rel, direction * omega / kRated_rad_s, 0.03 * 0.492);
    }
}

void commutates_by(int32_t crossings, void (*change)(plant_config_t &), double within_deg)
{
    for (const double direction : {1.0, -1.0}) {
        Fan x(1.0, change);
        x.params().zero_reference = crossings;
        x.enable();
        x.speed_rel(0.4 * direction);
        x.run_s(1.3);
        ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
        ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
        x.run_s(0.1);
        EXPECT_NEAR(x.omega_rel, 0.4 * direction, 0.02 * 0.4);
        EXPECT_LT(x.worst_deg, within_deg);
    }
}

TEST(Block, CommutatesByTheThirdHarmonicOfTheStarPoint)
{
    commutates_by(CROSSINGS_third_harmonic, star_point, kAngle_deg);
}

TEST(Block, CommutatesByTheThirdHarmonicOfTheTerminals)
{
    commutates_by(CROSSINGS_virtual_third, nullptr, kVirtual_deg);
}

// Told a trapezoid, a sine starts and shows none of its third harmonic. Twins: a trapezoid that is held shows nothing at all, and
// by the terminals the sine's start finds its crossings.
TEST(Block, AThirdHarmonicThatIsNotThereIsAFaultOfItsOwn)
{
    constexpr auto kSine = [](plant_config_t &c) {
        star_point(c);
        for (plant_harmonic_t &harmonic : c.winding.emf) {
            harmonic = {};
        }
    };
    for (const double direction : {1.0, -1.0}) {
        Fan x(1.0, kSine);
        x.params().zero_reference = CROSSINGS_third_harmonic;
        x.enable();
        x.speed_rel(0.5 * direction);
        x.until_fault_s(5);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NO_THIRD_HARMONIC);
        EXPECT_FALSE(x.driven());
    }
    Fan held(1.0, star_point);
    held.params().zero_reference = CROSSINGS_third_harmonic;
    held.params().resync_tries = 1;
    plant_set_locked(held.plant(), true);
    held.enable();
    held.speed_rel(0.5);
    held.until_fault_s(5);
    EXPECT_EQ(held.fault(), DRIVE_FAULT_STALL);
    Fan terminals(1.0, kSine);
    terminals.enable();
    terminals.speed_rel(0.5);
    terminals.run_s(1.3);
    EXPECT_EQ(terminals.fault(), DRIVE_FAULT_NONE);
    EXPECT_NEAR(terminals.omega_rel, 0.5, 0.01);
}

// Every condition by itself, of a drive that fulfils all of them.
TEST(Block, TheVectorGivesTheRotorOnlyWhereTheObserverIsSureOfIt)
{
    Fan x;
    x.params().six_step_start = 0;
    x.params().six_step_speed = 157080; // half of rated speed
    x.enable();
    x.speed_rel(0.45);
    x.run_s(1.5);
    ASSERT_EQ(x.drive().stage, STAGE_VECTOR);
    ASSERT_FALSE(block_may_begin(&x.drive())) << "too slow";
    x.drive().config.block.omega_on = x.drive().config.block.omega_on / 4 * 3;
    ASSERT_TRUE(block_may_begin(&x.drive()));
    const struct {
        const char *what;
        void (*change)(drive_t &);
    } without[] = {
        {"commutation", [](drive_t &d) { d.config.block.on = false; }},
        {"state", [](drive_t &d) { d.state = DRIVE_STOPPING; }},
        {"mode", [](drive_t &d) { d.command.mode = DRIVE_MODE_CURRENT; }},
        {"weight", [](drive_t &d) { d.position.weight = PM_ONE - 1; }},
        {"quality", [](drive_t &d) { d.position.quality = PM_Q(0.5); }},
        {"speed", [](drive_t &d) { d.pll.omega = -d.config.block.omega_on + 1; }},
    };
    for (const auto &at : without) {
        drive_t d = x.drive();
        at.change(d);
        EXPECT_FALSE(block_may_begin(&d)) << at.what;
    }
    x.drive().pll.omega = -x.drive().pll.omega;
    EXPECT_TRUE(block_may_begin(&x.drive())) << "either direction";
}

// A rotor that the vector has turned was no stall, however soon it is lost.
TEST(Block, LostBehindTheVectorIsThePosition)
{
    Fan x;
    x.params().six_step_start = 0;
    x.params().six_step_speed = 157080;
    x.params().resync_tries = 0;
    x.params().flying_start = 0;
    x.enable();
    x.speed_rel(0.6);
    for (int ms = 0; ms < 3000 && x.drive().stage != STAGE_SIX_STEP; ++ms) {
        x.run_s(1e-3);
    }
    ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
    x.run_s(5e-3);
    ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
    ASSERT_LT(x.drive().block_ms, 40);
    x.drive().block.six_step.lost = true;
    x.run_s(2e-3);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_POSITION_LOST);
    EXPECT_FALSE(x.driven());
}

// The first crossings of a start say a speed that no rotor has so soon.
TEST(Block, AnOverSpeedAtOnceFromRestIsAStall)
{
    Fan x;
    x.params().resync_tries = 0;
    x.enable();
    x.speed_rel(0.4);
    for (int ms = 0; ms < 2000 && x.drive().stage != STAGE_SIX_STEP; ++ms) {
        x.run_s(1e-3);
    }
    ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
    x.run_s(2e-3);
    ASSERT_NE(x.drive().block.six_step.commutation.young, 0);
    ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.drive().block.six_step.commutation.sum =
        static_cast<uint32_t>(x.drive().config.block.six_step.commutation.turn_base / 2);
    x.run_s(2e-3);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_STALL);
    EXPECT_FALSE(x.driven());
}

// A torque asks for no speed: the other way it goes on below three quarters of six_step_speed, where a speed begins anew.
TEST(Block, ATorqueTheOtherWayBrakesAsFarAsCrossingsShow)
{
    constexpr double kEnd = 0.75 * 100 / kRated_rad_s;
    for (const drive_mode_t mode : {DRIVE_MODE_TORQUE, DRIVE_MODE_SPEED}) {
        Fan x;
        x.params().six_step_speed = 100000;
        x.enable(mode);
        x.torque_rel(0.2);
        x.speed_rel(0.4);
        x.run_s(1.5);
        ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
        ASSERT_GT(x.omega_rel, 1.3 * kEnd);
        x.torque_rel(-0.2);
        x.speed_rel(-0.4);
        double last = 1;
        for (int ms = 0; ms < 1000 && x.drive().stage == STAGE_SIX_STEP; ++ms) {
            last = x.omega_rel;
            x.run_s(1e-3);
        }
        if (mode == DRIVE_MODE_TORQUE) {
            EXPECT_LT(last, 0.6 * kEnd);
        } else {
            EXPECT_NEAR(last, kEnd, 0.02);
        }
        x.run_s(2.0);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
        EXPECT_LT(x.omega_rel, -0.35);
    }
}

// Looked at in each period, before a leg is written.
TEST(Block, WhatIsBeyondItsLimitOpensTheBridgeInThePeriod)
{
    const struct {
        void (*raise)(drive_t &, drive_in_t &);
        drive_fault_t fault;
    } cases[] = {
        {[](drive_t &, drive_in_t &in) { in.hw_fault = true; }, DRIVE_FAULT_HARDWARE},
        {[](drive_t &, drive_in_t &in) { in.i_leg[0] = 65535; }, DRIVE_FAULT_OVER_CURRENT},
        {[](drive_t &, drive_in_t &in) { in.v_dc = 65535; }, DRIVE_FAULT_OVER_VOLTAGE},
    };
    for (const auto &at : cases) {
        Fan x;
        x.enable();
        x.speed_rel(0.4);
        x.run_s(1.3);
        ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
        drive_in_t in = x.seen();
        drive_out_t out = {};
        drive_step(&x.drive(), &in, &out);
        EXPECT_NE(out.legs, PM_LEGS_OFF);
        at.raise(x.drive(), in);
        drive_step(&x.drive(), &in, &out);
        EXPECT_EQ(out.legs, PM_LEGS_OFF) << at.fault;
        EXPECT_EQ(out.trip, 1U) << at.fault;
        EXPECT_EQ(x.drive().fault, at.fault);
    }
}

TEST(Block, HoldsTheRotorWhileNoSpeedIsWanted)
{
    Fan x;
    x.enable();
    x.speed_rel(0);
    x.run_s(0.8);
    EXPECT_EQ(x.drive().stage, STAGE_OPEN_LOOP);
    EXPECT_NEAR(x.omega_rel, 0, 1e-3);
    EXPECT_TRUE(x.driven());
    x.speed_rel(0.05); // below three quarters of six_step_speed
    x.run_s(0.2);
    EXPECT_EQ(x.drive().stage, STAGE_OPEN_LOOP);
    x.speed_rel(0.4);
    x.run_s(0.8);
    EXPECT_EQ(x.drive().stage, STAGE_SIX_STEP);
    EXPECT_NEAR(x.omega_rel, 0.4, 0.01);
}

TEST(Block, AReversalEndsItAndBeginsAnew)
{
    Fan x;
    x.turn(60000);
    x.speed_rel(-0.2);
    bool left = false;
    for (int ms = 0; ms < 2600; ++ms) {
        x.run_s(1e-3);
        left = left || x.drive().stage != STAGE_SIX_STEP;
    }
    EXPECT_TRUE(left);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    EXPECT_EQ(x.drive().stage, STAGE_SIX_STEP);
    EXPECT_NEAR(x.omega_rel, -0.2, 0.01);
}

// Braked slowly enough that crossings tell the speed, it ends at three quarters of six_step_speed; braked fast it is lost below
// that, which ends it as well, also where no rotor that turns is looked for.
TEST(Block, AStopSwitchesOffAtTheLowerLimit)
{
    for (const auto &[acceleration, flying_start] :
         {std::pair{60000, 1}, std::pair{300000, 1}, std::pair{60000, 0}, std::pair{300000, 0}}) {
        Fan x;
        x.params().flying_start = flying_start;
        x.turn(acceleration);
        x.stop();
        for (int ms = 0; ms < 1500 && drive_status(&x.drive())->state != DRIVE_OFF; ++ms) {
            x.run_s(1e-3);
        }
        EXPECT_EQ(drive_status(&x.drive())->state, DRIVE_OFF);
        if (acceleration < 100000) {
            EXPECT_NEAR(x.omega_rel, 0.75 * 30 / kRated_rad_s, 0.01);
        }
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
        EXPECT_FALSE(x.driven());
    }
}

// Slower than three quarters of six_step_speed is no reason to end while the command wants more.
TEST(Block, OnceItFollowsItStays)
{
    Fan x;
    x.params().six_step_speed = 100000;
    x.enable();
    x.speed_rel(0.4);
    bool follows = false;
    for (int ms = 0; ms < 1300; ++ms) {
        x.run_s(1e-3);
        const bool six_step = x.drive().stage == STAGE_SIX_STEP;
        EXPECT_TRUE(six_step || !follows) << ms;
        follows = follows || six_step;
    }
    EXPECT_NEAR(x.omega_rel, 0.4, 0.01);
}

// With diodes for the off time, where the voltage says nothing of the speed.
TEST(Block, DiodesCarryTheOffTime)
{
    Fan x;
    x.params().pattern = 3;
    x.params().freewheeling = 0;
    x.enable();
    x.speed_rel(0.7);
    x.run_s(1.3);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    EXPECT_EQ(x.drive().stage, STAGE_SIX_STEP);
    EXPECT_NEAR(x.omega_rel, 0.7, 0.02);
}

TEST(Block, ARotorThatIsHeldIsAStallAfterItsTries)
{
    double last_s = 0;
    for (const int32_t tries : {0, 2}) {
        Fan x;
        x.params().resync_tries = tries;
        plant_set_locked(x.plant(), true);
        x.enable();
        x.speed_rel(0.4);
        const double time_s = x.until_fault_s(5);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_STALL);
        EXPECT_FALSE(x.driven());
        EXPECT_EQ(x.drive().block_tries, tries);
        EXPECT_GT(time_s, last_s + 0.3 * tries) << "each with an align";
        last_s = time_s;
    }
}

// A held rotor whose noise was taken for crossings: lost so soon it never turned, later it has.
TEST(Block, LostWithin40MillisecondsOfItsStartIsAStall)
{
    for (const auto &[ms, fault] : {std::pair{38, DRIVE_FAULT_STALL}, {45, DRIVE_FAULT_POSITION_LOST}}) {
        Fan x;
        x.params().resync_tries = 0;
        x.params().flying_start = 0;
        x.enable();
        x.speed_rel(0.4);
        x.run_s(1.3);
        ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
        ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
        x.drive().block_ms = static_cast<uint16_t>(ms);
        x.drive().block.six_step.lost = true;
        x.run_s(0.002);
        EXPECT_EQ(x.fault(), fault) << ms;
        EXPECT_FALSE(x.driven());
    }
}

// Crossings that noise makes may say any speed; what the legs say of the EMF tells it from a rotor that is too fast.
TEST(Block, AnOverSpeedThatTheVoltageBeliesIsNone)
{
    for (const auto &[ms, fault] : {std::pair{20, DRIVE_FAULT_STALL}, {45, DRIVE_FAULT_POSITION_LOST}}) {
        Fan x;
        x.params().resync_tries = 0;
        x.params().flying_start = 0;
        x.enable();
        x.speed_rel(0.4);
        x.run_s(1.3);
        ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
        ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
        x.drive().block_ms = static_cast<uint16_t>(ms);
        x.drive().block.six_step.commutation.sum /= 5;
        x.run_s(0.002);
        EXPECT_EQ(x.fault(), fault) << ms;
        EXPECT_FALSE(x.driven());
    }
}

// A tenth of an ampere, and a ripple of more: the current turns in each period, and dead time takes nothing of the voltage, where
// otherwise it may take more than half of the EMF.
TEST(Block, ACurrentBelowItsRippleDoesNotBelieTheCrossings)
{
    Fan x(1.0, [](plant_config_t &c) {
        c.machine.L_d0_H = c.machine.L_q0_H = 50e-6;
        c.inverter.dead_time_s = 2.5e-6;
    });
    drive_params_t &p = x.params();
    p.L_d = p.L_q = p.L_q_rated = p.L_dh_rated = p.L_qh_rated = 50000;
    x.enable();
    x.speed_rel(0.12);
    x.run_s(1.5);
    ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
    plant_set_load(x.plant(), -0.008);
    x.run_s(0.5);
    EXPECT_LT(drive_status(&x.drive())->i.q, 0);
    EXPECT_EQ(x.drive().stage, STAGE_SIX_STEP);
    EXPECT_EQ(x.drive().block_tries, 0);
}

TEST(Block, ARotorThatIsThrownBeyondItsTripIsAnOverSpeed)
{
    Fan x;
    x.enable();
    x.speed_rel(1);
    x.run_s(1.5);
    ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
    for (int ms = 0; ms < 400 && x.fault() == DRIVE_FAULT_NONE; ++ms) {
        plant_set_speed(x.plant(), (1 + 0.002 * ms) * kRated_rad_s);
        x.run_s(1e-3);
    }
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OVER_SPEED);
    EXPECT_FALSE(x.driven());
}

TEST(Block, AStartThatIsCalledOffIsNotTriedAgain)
{
    Fan x;
    plant_set_locked(x.plant(), true);
    x.enable();
    x.speed_rel(0.4);
    for (int ms = 0; ms < 2000 && x.drive().stage != STAGE_SIX_STEP; ++ms) {
        x.run_s(1e-3);
    }
    ASSERT_EQ(x.drive().stage, STAGE_SIX_STEP);
    x.stop();
    x.run_s(0.5);
    EXPECT_EQ(drive_status(&x.drive())->state, DRIVE_OFF);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    EXPECT_EQ(x.drive().block_tries, 0);
}

// Blocked while it runs: the crossings are gone at once.
TEST(Block, LostSynchronismIsAFaultWithoutTheSearch)
{
    Fan x;
    x.params().flying_start = 0;
    x.enable();
    x.speed_rel(0.4);
    x.run_s(1.2);
    plant_set_locked(x.plant(), true);
    EXPECT_LT(x.until_fault_s(1), 0.1);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_POSITION_LOST);
    EXPECT_FALSE(x.driven());
}

TEST(Block, ARotorThatIsThrownIsFoundAgain)
{
    for (const double speed : {1.0, 0.2}) {
        Fan x;
        x.enable();
        x.speed_rel(0.5);
        x.run_s(1.1);
        plant_set_speed(x.plant(), speed * kRated_rad_s);
        x.run_s(0.05);
        plant_free_speed(x.plant());
        x.run_s(1.3);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE) << speed;
        EXPECT_EQ(x.drive().stage, STAGE_SIX_STEP) << speed;
        x.run_s(0.1);
        EXPECT_NEAR(x.omega_rel, 0.5, 0.01) << speed;
        EXPECT_LT(x.worst_deg, kAngle_deg) << speed;
    }
}

TEST(Block, FromTheVectorAtItsSpeedAndBackAtThreeQuarters)
{
    Fan x;
    x.params().six_step_start = 0;
    x.params().six_step_speed = 157080; // half of rated speed
    x.enable();
    x.speed_rel(0.45);
    x.run_s(1.5);
    EXPECT_EQ(x.drive().stage, STAGE_VECTOR);
    x.speed_rel(0.6);
    x.run_s(0.7);
    EXPECT_EQ(x.drive().stage, STAGE_SIX_STEP);
    x.run_s(0.1);
    EXPECT_LT(x.worst_deg, kAngle_deg);
    x.speed_rel(0.42);
    x.run_s(0.7);
    EXPECT_EQ(x.drive().stage, STAGE_SIX_STEP) << "above three quarters of it";
    x.speed_rel(0.34);
    x.run_s(0.7);
    EXPECT_EQ(x.drive().stage, STAGE_VECTOR);
    EXPECT_NEAR(x.omega_rel, 0.34, 0.01);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
}

TEST(Block, CurrentModeIsTheVectors)
{
    Fan x;
    x.enable(DRIVE_MODE_CURRENT);
    x.current_A(1);
    x.run_s(0.8);
    EXPECT_NE(x.drive().stage, STAGE_SIX_STEP);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
}

// At half of the link's voltage the speed cannot be reached: it says so.
TEST(Block, TheEndOfTheVoltageIsSaid)
{
    Fan x;
    x.enable();
    x.speed_rel(0.4);
    x.run_s(1.2);
    EXPECT_EQ(drive_status(&x.drive())->limits & DRIVE_LIMIT_VOLTAGE, 0U);
    plant_set_source(x.plant(), 13);
    x.speed_rel(1.0);
    uint32_t limits = 0;
    for (int ms = 0; ms < 1500; ++ms) {
        x.run_s(1e-3);
        limits |= drive_status(&x.drive())->limits;
    }
    EXPECT_NE(limits & DRIVE_LIMIT_VOLTAGE, 0U);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    EXPECT_LT(x.omega_rel, 0.95);
}

TEST(Block, WithoutTorqueItIsHeld)
{
    Fan x;
    x.enable(DRIVE_MODE_TORQUE);
    x.torque_rel(0);
    x.run_s(0.6);
    EXPECT_EQ(x.drive().stage, STAGE_OPEN_LOOP);
    EXPECT_NEAR(x.omega_rel, 0, 1e-3);
    x.stop();
    x.run_s(0.2);
    EXPECT_EQ(drive_status(&x.drive())->state, DRIVE_OFF);
}

// theta_f + w (t_blank + T) <= 30 degrees: with a slow sample and four times the inductance, as told, less current is left,
// least where the incoming leg is chopped.
TEST(Block, TheFreewheelingLimitsTheCurrent)
{
    const auto most = [](int32_t pattern, int32_t limit) {
        Fan x;
        x.params().pattern = pattern;
        x.params().freewheeling_limit = limit;
        x.params().t_blank = 20000;
        x.params().L_d = x.params().L_q = 4 * x.params().L_d;
        x.enable(DRIVE_MODE_TORQUE);
        x.torque_rel(0.2);
        x.run_s(0.8);
        x.torque_rel(0.8);
        x.run_s(0.2);
        EXPECT_EQ(x.drive().stage, STAGE_SIX_STEP);
        return x.drive().i_ref.q / double(PM_ONE);
    };
    const double all = most(1, 0), high_leg = most(1, 1), last_60 = most(4, 1);
    EXPECT_NEAR(all, 0.4, 0.01) << "of 10 A, the torque's 4 A";
    EXPECT_LT(high_leg, 0.9 * all);
    EXPECT_GT(high_leg, 0);
    EXPECT_GT(last_60, 0);
    EXPECT_NE(last_60, high_leg);
}

drive_result_t verdict(const drive_params_t &p)
{
    static drive_config_t c;
    c = {};
    return drive_configure(&c, &p, PM_CHANNELS);
}

TEST(Block, BlindIsTheTurnInBlankingAndAPeriod)
{
    Fan x;
    drive_config_t c = {};
    ASSERT_TRUE(drive_configure(&c, &x.params(), PM_CHANNELS).ok);
    const double base_1_s = c.block.blind / double(PM_ONE) / (16e-6 + 1.0 / 20e3);
    EXPECT_NEAR(c.block.omega_on / double(PM_ONE) * base_1_s, 4 * 30, 0.1); // electrical
}

TEST(Block, WhatItCannotDoIsRefused)
{
    Fan x;
    ASSERT_TRUE(verdict(x.params()).ok);
    drive_params_t heavy = x.params();
    heavy.J *= 4;
    heavy.i_open_loop = 100; // mA: 0.15 s for 30 degrees
    EXPECT_EQ(verdict(heavy).param, DRIVE_PARAM_i_open_loop);
    heavy.six_step_start = 0;
    heavy.six_step_speed = heavy.speed_high;
    EXPECT_TRUE(verdict(heavy).ok) << verdict(heavy).reason;
    heavy.six_step_speed = heavy.speed_high - 1;
    EXPECT_EQ(verdict(heavy).param, DRIVE_PARAM_six_step_speed);
}

// A sine's third harmonic is a figure of its own; a trapezoid has that of its shape, and terminals need none.
TEST(Block, AThirdHarmonicThatIsNotKnownIsRefused)
{
    Fan x;
    drive_params_t p = x.params();
    p.zero_reference = CROSSINGS_third_harmonic;
    p.psi_3 = 0;
    EXPECT_TRUE(verdict(p).ok) << verdict(p).reason;
    p.emf_shape = 0;
    EXPECT_EQ(verdict(p).param, DRIVE_PARAM_psi_3);
    p.zero_reference = CROSSINGS_virtual_third;
    EXPECT_TRUE(verdict(p).ok) << verdict(p).reason;
}

// The drive board has no samples within the period yet.
TEST(Block, ABoardWithoutItsChannelsRefusesIt)
{
    Fan x;
    for (const uint32_t channel : {NEEDS_TERMINALS, NEEDS_SECOND_SAMPLE, NEEDS_COMMUTATE}) {
        drive_config_t c = {};
        EXPECT_EQ(drive_configure(&c, &x.params(), PM_CHANNELS & ~channel).param, DRIVE_PARAM_commutation)
            << channel;
    }
}

} // namespace
