#include "firmware/drive/drive_parts.h"

/* Injection settles on the position of the pulses, without torque. */
#define SETTLE_MS 30
/* Standstill that ends a stop. */
#define STILL_MS 20

static void enter(drive_t *drive, drive_state_t state, drive_stage_t stage)
{
    drive->state = state;
    drive->stage = stage;
    drive->state_ms = 0;
    drive->still_ms = 0;
}

static void switch_off(drive_t *drive)
{
    enter(drive, DRIVE_OFF, STAGE_OFF);
}

static void begin_calibration(drive_t *drive)
{
    drive->start.calibration = (calibration_t){0};
    enter(drive, DRIVE_CALIBRATING, STAGE_CALIBRATE);
}

static void begin_finding(drive_t *drive)
{
    const bool pulses = !drive->config.align_first && drive->command.mode != DRIVE_MODE_CURRENT;
    initial_pulses_reset(&drive->start.pulses);
    drive->pulses_state = PM_RUNNING;
    drive->stall_ms = 0;
    drive->lost_ms = 0;
    drive->sum_ms = 0;
    if (pulses) {
        enter(drive, DRIVE_FINDING, STAGE_PULSES);
    } else {
        enter(drive, DRIVE_FINDING, STAGE_OFF);
        open_loop_start(drive);
    }
}

static void finish_calibration(drive_t *drive)
{
    if (drive->start.calibration.count < DRIVE_OFFSET_PERIODS) {
        return;
    }
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        if (pm_abs(drive->zero[x] - PM_ONE) > pm_shl(drive->config.protection.offset_max, PM_Q_BITS - 15)) {
            drive_trip(drive, DRIVE_FAULT_SENSOR_OFFSET);
            return;
        }
    }
    if (drive->command.mode == DRIVE_MODE_IDENTIFY) {
        drive->state = DRIVE_RUNNING;
        drive->sum_ms = 0;
        commissioning_start(drive);
    } else {
        begin_finding(drive);
    }
}

/* The rotor stands at theta: injection takes over. */
static void begin_injection(drive_t *drive, pm_angle_t theta)
{
    position_reset(&drive->position, &drive->config.position, theta, drive->i_ab, true);
    current_control_reset(&drive->current, (pm_dq_t){0, 0});
    reference_reset(drive, 0);
    drive->stage = STAGE_VECTOR;
    drive->state_ms = 0;
}

static void finish_pulses(drive_t *drive)
{
    if (drive->pulses_state == PM_DONE) {
        begin_injection(drive, drive->start.pulses.theta);
    } else if (drive->pulses_state != PM_RUNNING) {
        drive_trip(drive, DRIVE_FAULT_POSITION_NOT_FOUND);
    }
}

static void finish_align(drive_t *drive)
{
    if (drive->config.injection && drive->command.mode != DRIVE_MODE_CURRENT) {
        begin_injection(drive, drive->theta_open);
    } else {
        drive->state = DRIVE_RUNNING;
    }
}

static void find(drive_t *drive)
{
    switch (drive->stage) {
    case STAGE_PULSES:
        finish_pulses(drive);
        break;
    case STAGE_OPEN_LOOP:
        open_loop_slow(drive);
        if (drive->state_ms >= drive->config.open_loop.align_ms) {
            finish_align(drive);
        }
        break;
    default:
        position_slow(&drive->position, &drive->config.position, drive->i_ab, drive->status.i);
        drive->i_ref = (pm_dq_t){0, 0};
        if (drive->state_ms >= SETTLE_MS) {
            reference_reset(drive, 0);
            drive->state = DRIVE_RUNNING;
        }
        break;
    }
}

/* Withdrawing the command ends it at once: the speed is not known, so there is no ramp. */
static void identify(drive_t *drive, bool enable)
{
    commissioning_slow(drive);
    if (!enable) {
        commissioning_abort(drive);
        switch_off(drive);
    }
}

static void run(drive_t *drive)
{
    const position_config_t *c = &drive->config.position;
    position_slow(&drive->position, c, drive->i_ab, drive->status.i);
    if (drive->stage == STAGE_OPEN_LOOP) {
        open_loop_slow(drive);
        return;
    }
    reference_vector(drive);
    /* without injection nothing shows the position at low speed */
    if (!c->injection && pm_abs(drive->speed.reference) < c->omega_low &&
        pm_abs(drive->position.pll.omega) < c->omega_low) {
        open_loop_resume(drive);
    }
}

static void stop(drive_t *drive)
{
    run(drive);
    const pm_q_t omega = drive->stage == STAGE_OPEN_LOOP ? drive->omega_ramp : drive->position.pll.omega;
    const bool ended = drive->stage == STAGE_OPEN_LOOP || drive->speed.reference == 0;
    const bool still = ended && pm_abs(omega) < drive->config.protection.omega_stall;
    drive->still_ms = still ? (uint16_t)(drive->still_ms + 1U) : 0U;
    if (drive->still_ms > STILL_MS) {
        switch_off(drive);
    }
}

static void move(drive_t *drive)
{
    const bool enable = drive->command.enable;
    if (!enable && drive->command.coast) {
        commissioning_abort(drive);
        switch_off(drive);
        return;
    }
    switch (drive->state) {
    case DRIVE_OFF:
        if (enable) {
            begin_calibration(drive);
        }
        break;
    case DRIVE_CALIBRATING:
        if (enable) {
            finish_calibration(drive);
        } else {
            switch_off(drive);
        }
        break;
    case DRIVE_FINDING:
        if (enable) {
            find(drive);
        } else {
            switch_off(drive);
        }
        break;
    case DRIVE_RUNNING:
        if (drive->command.mode == DRIVE_MODE_IDENTIFY) {
            identify(drive, enable);
            break;
        }
        run(drive);
        if (!enable) {
            drive->state = DRIVE_STOPPING;
            drive->still_ms = 0;
        }
        break;
    case DRIVE_STOPPING:
        stop(drive);
        break;
    case DRIVE_FAULT:
    default:
        break;
    }
}

/* Nothing is known of a rotor that turns without current control. */
static void report_nothing(drive_t *drive)
{
    drive_status_t *s = &drive->status;
    if (drive->stage != STAGE_IDENTIFY) { /* which has currents of its own */
        drive->i_ref = (pm_dq_t){0, 0};
        s->i = (pm_dq_t){0, 0};
    }
    drive->position.pll = (pm_pll_t){.theta = 0}; /* the step copies the angle from there */
    s->omega = 0;
    s->omega_ref = 0;
    s->weight = 0;
    s->quality = 0;
}

static void report(drive_t *drive)
{
    drive_status_t *s = &drive->status;
    s->state = drive->fault == DRIVE_FAULT_NONE ? drive->state : DRIVE_FAULT;
    s->fault = drive->fault;
    if (drive->stage < STAGE_OPEN_LOOP) {
        report_nothing(drive);
    } else {
        s->omega = drive->position.pll.omega;
        s->omega_ref = drive->stage == STAGE_OPEN_LOOP ? drive->omega_ramp : drive->speed.reference;
        s->weight = drive->position.weight;
        s->quality = drive->position.quality;
    }
    s->i_ref = drive->i_ref;
    s->v = drive->v_next;
}

void drive_slow(drive_t *drive, const drive_slow_in_t *in)
{
    drive->temperature_dC = in->temperature_dC;
    drive->status.limits = drive->current.limited || drive->modulator.limited ? DRIVE_LIMIT_VOLTAGE : 0U;
    drive->current.limited = false;
    drive->modulator.limited = false;
    if (drive->fault == DRIVE_FAULT_NONE) {
        if (!drive->taken && drive->stage != STAGE_IDENTIFY) { /* which goes on with what it began with */
            reference_take(drive);
            drive->taken = true;
        }
        drive->state_ms = (uint16_t)(drive->state_ms + (drive->state_ms < UINT16_MAX ? 1U : 0U));
        move(drive);
        protection_slow(drive);
    }
    if (drive->fault != DRIVE_FAULT_NONE) {
        commissioning_abort(drive);
        drive->state = DRIVE_FAULT;
        drive->stage = STAGE_OFF;
    }
    drive_prepare(drive);
    report(drive);
}
