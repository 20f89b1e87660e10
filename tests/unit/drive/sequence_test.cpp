// The sequence of a start, alone and as the drive follows it: every failure at every step, enable taken back
// and faults at any instant. A procedure's result is put in its place; no motor.
#include <gtest/gtest.h>

#include "tests/unit/drive/direct.h"

namespace
{

using direct::Drive;

drive_params_t without_fallback()
{
    drive_params_t p = direct::params(1);
    p.start_fallback = 0;
    return p;
}

uint32_t next(sequence_id_t id, uint32_t step, pm_procedure_t result)
{
    return sequence_next(sequence_step(id, step), result);
}

// A step of its own for the polarity.
bool poles(sequence_id_t id)
{
    return id == SEQUENCE_pole || id == SEQUENCE_pole_align;
}

TEST(Sequence, LeadsWhereItSays)
{
    for (int id = 0; id < SEQUENCE_COUNT; ++id) {
        const auto sequence = static_cast<sequence_id_t>(id);
        const bool looks = id != SEQUENCE_identify;
        EXPECT_EQ(sequence_step(sequence, 0)->procedure, PROCEDURE_calibrate);
        EXPECT_EQ(next(sequence, 0, PM_DONE), looks ? 1U : 2U);
        if (looks) {
            EXPECT_EQ(sequence_step(sequence, 1)->procedure, PROCEDURE_flying_start);
            EXPECT_EQ(next(sequence, 1, PM_DONE), uint32_t(SEQUENCE_CAUGHT));
            EXPECT_EQ(next(sequence, 1, PM_FAILED_NOT_TURNING), 2U);
            EXPECT_EQ(next(sequence, 1, PM_FAILED_TIMEOUT), uint32_t(SEQUENCE_FAULT));
        }
        EXPECT_EQ(sequence_step(sequence, 2)->procedure, PROCEDURE_charge);
        EXPECT_EQ(next(sequence, 2, PM_DONE), 3U);
        for (int reason = PM_DONE + 1; reason < PM_PROCEDURE_COUNT; ++reason) {
            const auto result = static_cast<pm_procedure_t>(reason);
            EXPECT_EQ(next(sequence, 0, result), uint32_t(SEQUENCE_FAULT)) << id << ' ' << reason;
            uint32_t expected = SEQUENCE_FAULT;
            if (id == SEQUENCE_identify) {
                expected = SEQUENCE_WAIT;
            } else if ((reason == PM_FAILED_POLARITY || reason == PM_FAILED_NOT_TURNING) &&
                       (id == SEQUENCE_pulses_align || poles(sequence))) {
                expected = poles(sequence) ? 4 : 5;
            } else if (reason == PM_FAILED_SALIENCY && id == SEQUENCE_pulses_align) {
                expected = 4;
            } else if (reason == PM_FAILED_SALIENCY && id == SEQUENCE_pole_align) {
                expected = 5;
            }
            EXPECT_EQ(next(sequence, 3, result), expected) << id << ' ' << reason;
        }
        const uint32_t done = id == SEQUENCE_identify ? uint32_t(SEQUENCE_WAIT) : uint32_t(SEQUENCE_RUN);
        EXPECT_EQ(next(sequence, 3, PM_DONE), poles(sequence) ? 4U : done);
    }
    for (const sequence_id_t id : {SEQUENCE_pole, SEQUENCE_pole_align}) {
        EXPECT_EQ(sequence_step(id, 4)->procedure, SEQUENCE_POLE);
        EXPECT_EQ(next(id, 4, PM_DONE), uint32_t(SEQUENCE_RUN));
        EXPECT_EQ(next(id, 4, PM_FAILED_POLARITY), id == SEQUENCE_pole ? uint32_t(SEQUENCE_FAULT) : 6U);
        EXPECT_EQ(next(id, 4, PM_FAILED_TIMEOUT), uint32_t(SEQUENCE_FAULT));
    }
    for (const auto &[id, align] : {std::pair{SEQUENCE_pulses_align, 4U}, {SEQUENCE_pole_align, 5U}}) {
        EXPECT_EQ(sequence_step(id, align)->procedure, PROCEDURE_align);
        EXPECT_EQ(sequence_step(id, align + 1)->procedure, PROCEDURE_torque_polarity);
        for (const uint32_t step : {align, align + 1}) {
            EXPECT_EQ(next(id, step, PM_DONE), uint32_t(SEQUENCE_RUN));
            EXPECT_EQ(next(id, step, PM_FAILED_NOT_TURNING), uint32_t(SEQUENCE_FAULT));
        }
        EXPECT_EQ(next(id, align + 1, PM_FAILED_TURNED), align);
    }
}

// Calibrated, with the pulses at work.
Drive in_pulses(const drive_params_t &p)
{
    Drive x(p);
    x.enable(true);
    for (int ms = 0; ms < 120 && x.d.sequence.procedure != PROCEDURE_initial_pulses; ++ms) {
        x.run_ms(1);
    }
    EXPECT_EQ(x.d.sequence.procedure, PROCEDURE_initial_pulses);
    EXPECT_EQ(x.state(), DRIVE_FINDING);
    return x;
}

TEST(Sequence, ARefusalIsAFaultOrLeadsToTheFallBack)
{
    for (const bool fall_back : {false, true}) {
        for (int reason = PM_DONE + 1; reason < PM_PROCEDURE_COUNT; ++reason) {
            Drive x = in_pulses(fall_back ? direct::params(1) : without_fallback());
            x.d.procedure.result = static_cast<pm_procedure_t>(reason);
            x.run_ms(1);
            EXPECT_EQ(drive_status(&x.d)->refusal.procedure, PROCEDURE_initial_pulses);
            EXPECT_EQ(drive_status(&x.d)->refusal.reason, reason);
            const bool round = reason == PM_FAILED_SALIENCY;
            // the pulses themselves never say PM_FAILED_NOT_TURNING: for the sequence it is of the same kind
            if (fall_back && (reason == PM_FAILED_POLARITY || reason == PM_FAILED_NOT_TURNING)) {
                EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
                EXPECT_EQ(x.d.sequence.procedure, PROCEDURE_torque_polarity);
                EXPECT_EQ(x.d.stage, STAGE_VECTOR);
                EXPECT_TRUE(x.d.position.carrier);
                continue;
            }
            if (fall_back && round) {
                EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
                EXPECT_EQ(x.d.sequence.procedure, PROCEDURE_align);
                EXPECT_EQ(x.d.stage, STAGE_OPEN_LOOP);
                x.run_ms(301);
                // the vector turns a machine that has no saliency
                EXPECT_EQ(x.d.stage, STAGE_OPEN_LOOP);
                EXPECT_FALSE(x.d.position.carrier);
                EXPECT_EQ(x.d.sequence.procedure, PROCEDURE_NONE);
                continue;
            }
            const drive_fault_t fault = reason == PM_FAILED_OFFSET ? DRIVE_FAULT_SENSOR_OFFSET
                                        : reason == PM_FAILED_OPEN ? DRIVE_FAULT_OPEN_PHASE
                                                                   : DRIVE_FAULT_POSITION_NOT_FOUND;
            EXPECT_EQ(x.fault(), fault) << reason;
            EXPECT_EQ(drive_fault_record(&x.d)->refusal.procedure, PROCEDURE_initial_pulses);
            EXPECT_EQ(drive_fault_record(&x.d)->refusal.reason, reason);
            x.step();
            EXPECT_FALSE(x.driven());
            EXPECT_TRUE(x.out.trip);
        }
    }
}

TEST(Sequence, AnotherStartForgetsTheRefusal)
{
    Drive x = in_pulses(direct::params(1));
    x.d.procedure.result = PM_FAILED_POLARITY;
    x.run_ms(1);
    ASSERT_EQ(drive_status(&x.d)->refusal.reason, PM_FAILED_POLARITY);
    x.enable(false);
    x.run_ms(1);
    x.enable(true);
    x.run_ms(1);
    EXPECT_EQ(drive_status(&x.d)->refusal.reason, 0);
    EXPECT_EQ(drive_status(&x.d)->refusal.procedure, PROCEDURE_NONE);
}

// What the start has found of the saliency holds for its run: the observer's hand-over brings no carrier, and low speed
// leads back to the open loop. The next start looks again.
TEST(Sequence, ARoundMachineRunsWithoutInjectionUntilTheNextStart)
{
    Drive x = in_pulses(direct::params(1));
    x.d.procedure.result = PM_FAILED_SALIENCY;
    x.run_ms(302);
    ASSERT_EQ(x.d.stage, STAGE_OPEN_LOOP);
    x.d.stage = STAGE_VECTOR;
    x.d.position.pll.omega = 0;
    x.d.speed.reference = 0;
    x.run_ms(1);
    EXPECT_EQ(x.d.stage, STAGE_OPEN_LOOP);
    x.command.coast = true;
    x.enable(false);
    x.run_ms(1);
    ASSERT_EQ(x.state(), DRIVE_OFF);
    x.enable(true);
    for (int ms = 0; ms < 120 && x.d.sequence.procedure != PROCEDURE_initial_pulses; ++ms) {
        x.run_ms(1);
    }
    EXPECT_EQ(x.d.sequence.procedure, PROCEDURE_initial_pulses);
    x.d.procedure.result = PM_FAILED_POLARITY;
    x.run_ms(302);
    EXPECT_TRUE(x.d.position.carrier);
}

struct Start {
    const char *name;
    drive_params_t params;
    drive_mode_t mode;
};

drive_params_t lock_and(int32_t polarity)
{
    drive_params_t p = direct::params(1);
    p.position_find = 1;
    p.polarity = polarity;
    return p;
}

drive_params_t three_phase_and_sine()
{
    drive_params_t p = direct::params(1);
    p.position_find = 2;
    p.polarity = 3;
    p.injection = INJECTION_pulsating_sine;
    p.injection_bandwidth = 7000;
    p.speed_bandwidth = 2000;
    return p;
}

drive_params_t looking()
{
    drive_params_t p = direct::params(1);
    p.flying_start = 1;
    return p;
}

const Start kStarts[] = {
    {"look", looking(), DRIVE_MODE_SPEED},
    {"lock, pulses", lock_and(1), DRIVE_MODE_SPEED},
    {"lock, current", lock_and(2), DRIVE_MODE_SPEED},
    {"three phases", three_phase_and_sine(), DRIVE_MODE_SPEED},
    {"pulses", direct::params(1), DRIVE_MODE_SPEED},
    {"align", direct::params(3), DRIVE_MODE_SPEED},
    {"open loop", direct::params(2), DRIVE_MODE_SPEED},
    {"current", direct::params(1), DRIVE_MODE_CURRENT},
    {"identify", direct::params(1), DRIVE_MODE_IDENTIFY},
};

// At each millisecond of the start and in the middle of it; currents follow the pulses a little, so that
// these go on.
void at_each_instant(void (*act)(Drive &, const char *))
{
    for (const Start &start : kStarts) {
        for (int ms = 1; ms < 460; ms += ms < 101 ? 50 : 3) {
            Drive x(start.params);
            x.command.current_mA = 1000;
            x.enable(true, start.mode);
            x.run_ms(ms);
            x.step();
            x.step();
            if (x.fault() == DRIVE_FAULT_NONE) {
                act(x, start.name);
            }
        }
    }
}

TEST(Sequence, EnableTakenBackOpensTheBridge)
{
    at_each_instant([](Drive &x, const char *name) {
        if (x.state() == DRIVE_RUNNING && x.command.mode != DRIVE_MODE_IDENTIFY) {
            return; // has started: stops by its ramp
        }
        x.enable(false, x.command.mode);
        x.run_ms(1);
        EXPECT_EQ(x.state(), DRIVE_OFF) << name;
        for (int k = 0; k < 20; ++k) {
            x.step();
            ASSERT_FALSE(x.driven()) << name;
        }
        EXPECT_EQ(x.d.sequence.procedure, PROCEDURE_NONE);
    });
}

// Within a millisecond: the start that was under way is not gone on with.
TEST(Sequence, EnableThatComesBackStartsAnew)
{
    at_each_instant([](Drive &x, const char *name) {
        const bool legs = x.d.stage == STAGE_PROCEDURE;
        x.enable(false, x.command.mode);
        x.step();
        EXPECT_TRUE(!legs || !x.driven()) << name;
        x.enable(true, x.command.mode);
        x.run_ms(2);
        if (legs) {
            EXPECT_EQ(x.state(), DRIVE_CALIBRATING) << name;
            EXPECT_FALSE(x.driven()) << name;
        }
    });
}

TEST(Sequence, AFaultOpensTheBridgeInThePeriod)
{
    at_each_instant([](Drive &x, const char *name) {
        x.in.hw_fault = true;
        x.step();
        EXPECT_FALSE(x.driven()) << name;
        EXPECT_TRUE(x.out.trip) << name;
        x.run_ms(1);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_HARDWARE) << name;
        EXPECT_EQ(x.d.sequence.procedure, PROCEDURE_NONE) << name;
        x.in.hw_fault = false;
        x.run_ms(2);
        EXPECT_FALSE(x.driven()) << name;
    });
}

TEST(Sequence, OverCurrentOpensTheBridgeUnlessNothingIsKnownOfIt)
{
    at_each_instant([](Drive &x, const char *name) {
        const bool bare = x.state() == DRIVE_CALIBRATING;
        x.in.i_leg[1] = direct::current_code(0.95);
        x.step();
        EXPECT_FALSE(x.driven()) << name;
        EXPECT_EQ(x.out.trip, !bare && x.state() != DRIVE_OFF) << name;
    });
}

// The rotating voltage drives the legs, at which nothing else would show without a motor.
TEST(Sequence, TheRotatingVoltageIsAtTheLegs)
{
    drive_params_t p = direct::params(1);
    p.position_find = 2;
    Drive x(p);
    x.enable(true);
    for (int ms = 0; ms < 120 && x.d.sequence.procedure != PROCEDURE_three_phase_hf; ++ms) {
        x.run_ms(1);
    }
    ASSERT_EQ(x.d.sequence.procedure, PROCEDURE_three_phase_hf);
    bool driven = false, apart = false;
    for (int k = 0; k < 100; ++k) {
        x.step();
        driven = driven || x.driven();
        apart = apart || (x.driven() && x.out.compare[0][0] != x.out.compare[1][0]);
    }
    EXPECT_TRUE(driven);
    EXPECT_TRUE(apart);
}

} // namespace
