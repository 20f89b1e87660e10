#include "firmware/drive/drive_parts.h"

#include "firmware/math/compiler.h"
#include "firmware/math/trig.h"

/* Injection settles on the position of the pulses, without torque. */
#define SETTLE_MS 30
/* More for one whose carrier lies along axes of the stator: it detects I_p first (injection/stationary.h). */
#define SETTLE_STATOR_MS 60
/* Standstill that ends a stop. */
#define STILL_MS 20

static void enter(drive_t *drive, drive_state_t state, drive_stage_t stage)
{
    drive->state = state;
    drive->stage = stage;
    drive->state_ms = 0;
    drive->still_ms = 0;
}

PM_RARE static void switch_off(drive_t *drive)
{
    procedure_abort(drive);
    enter(drive, DRIVE_OFF, STAGE_OFF);
}

/* Called from drive_slow() itself: what begins needs the deepest stack of all. */
PM_RARE static void begin_step(drive_t *drive)
{
    sequence_t *self = &drive->sequence;
    self->begins = false;
    drive->state_ms = 0;
    drive->still_ms = 0;
    drive->stall_ms = 0;
    drive->lost_ms = 0;
    drive->sum_ms = 0;
    const sequence_step_t *step = sequence_step((sequence_id_t)self->id, self->step);
    procedure_id_t id =
        (procedure_id_t)sequence_procedure(step, drive->config.find, config_pole(&drive->config));
#if PM_HAS(saliency_map)
    if (id == PROCEDURE_identify && drive->command.routines == (uint8_t)COMMISSIONING_SALIENCY) {
        id = PROCEDURE_saliency_map;
    }
#endif
    procedure_begin(drive, id);
}

static void begin_sequence(drive_t *drive)
{
    uint8_t id = drive->config.start;
    if (drive->command.mode == DRIVE_MODE_CURRENT) {
        id = (uint8_t)SEQUENCE_align;
    } else if (drive->command.mode == DRIVE_MODE_IDENTIFY) {
        id = (uint8_t)SEQUENCE_identify;
    } else {
        /* as configured */
    }
    drive->sequence = (sequence_t){.id = id, .begins = true};
    drive->status.refusal = (drive_refusal_t){0};
    drive->round = false;
}

/* The rotor stands at theta: injection takes over. */
static void begin_injection(drive_t *drive, pm_angle_t theta)
{
    position_reset(&drive->position, &drive->config.position, theta, drive->i_ab, true);
    regulator_reset(&drive->regulator, &drive->config.regulator, (pm_dq_t){0, 0}, (pm_dq_t){0, 0}, 0);
    reference_reset(drive, 0);
    drive->stage = STAGE_VECTOR;
    drive->state_ms = 0;
}

/* Current and voltage stay as they are; both have other coordinates in the frame that was put right. */
PM_RARE static void turn_frame(drive_t *drive, pm_angle_t turn, pm_dq_t v)
{
    const pm_dir_t dir = pm_dir(turn);
    const pm_dq_t i = pm_park((pm_ab_t){.alpha = drive->status.i.d, .beta = drive->status.i.q}, dir);
    const pm_dq_t now = pm_park((pm_ab_t){.alpha = v.d, .beta = v.q}, dir);
    regulator_reset(&drive->regulator, &drive->config.regulator, now, i, drive->position.pll.omega);
    reference_reset(drive, i.q);
    if (drive->position.slip.count > SLIP_MOST) {
        drive_trip(drive, DRIVE_FAULT_POSITION_LOST);
    }
}

#if SEQUENCE_HAS_POLARITY
/* A step of the start has run on top of injection, which goes on; at the other pole, if that is the north. The observer,
 * which has followed neither, starts from there. */
PM_RARE static void go_on(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const pm_angle_t theta = drive->sequence.theta;
    const bool south = pm_abs(pm_angle_diff(theta, drive->position.pll.theta)) > (int32_t)PM_TURN(0.25);
    const pm_angle_t turn = south ? PM_TURN(0.5) : 0U;
    const pm_dq_t v = {.d = pm_narrow(drive->voltage.v.d), .q = pm_narrow(drive->voltage.v.q)};
    position_turn(&drive->position, &c->position, turn, drive->i_ab);
    turn_frame(drive, turn, v);
    drive->status.theta = drive->position.pll.theta;
    drive->state = DRIVE_RUNNING;
}
#endif

#if PM_HAS(flying_start) || PM_HAS(six_step)
/* The rotor is known, and i_q flows: the EMF is the voltage that keeps it, from the period that has begun on. */
PM_RARE static void take_over(drive_t *drive, const pm_pll_t *known, pm_q_t i_q)
{
    const drive_config_t *c = &drive->config;
    position_take(&drive->position, &c->position, known);
    const pm_q_t v_top = pm_unit(drive->status.v_dc, c->v_share);
    const pm_q_t emf = pm_mul(known->omega, c->machine.psi_m);
    const pm_dq_t v = {.d = 0, .q = pm_clamp(emf, -v_top, v_top)};
    regulator_reset(&drive->regulator, &c->regulator, v, (pm_dq_t){0, i_q}, known->omega);
    reference_reset(drive, i_q);
    const int32_t turn = pm_omega_to_angle(known->omega, c->k_theta);
    const pm_angle_t middle = known->theta + (pm_angle_t)pm_half(turn);
    const pm_dq_t e = {.d = 0, .q = emf};
    drive->v_acting = pm_park_inverse(e, pm_dir(middle));
    drive->v_next = pm_park_inverse(e, pm_dir(middle + (pm_angle_t)turn));
    drive->status.theta = known->theta;
    drive->i_open = 0;
}
#endif

#if PM_HAS(flying_start)
/* Where the link has less than the EMF, the current that weakens the field is wanted at once; any other comes little by
 * little. At a speed where neither source sees the rotor it is held by a vector along its d-axis. */
PM_RARE static void begin_caught(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    drive->sequence.begins = false;
    const pm_pll_t caught = {.theta = drive->sequence.theta, .omega = drive->sequence.omega};
    const bool imposed = !c->position.injects && pm_abs(caught.omega) < c->position.omega_low;
    if (imposed) {
        open_loop_start(drive);
    }
    take_over(drive, &caught, 0);
    const pm_q_t v_top = pm_unit(drive->status.v_dc, c->v_share);
    const pm_q_t over = pm_abs(pm_mul(caught.omega, c->machine.psi_m)) - (v_top - v_top / 20);
    if (over > 0) {
        const pm_q_t x = pm_mul(pm_abs(caught.omega), c->machine.L_d);
        drive->field_weakening.i_d = -pm_min(pm_div(over, x), c->field_weakening.i_max);
        drive->i_ref.d = drive->field_weakening.i_d;
    }
    drive->theta_open = caught.theta;
    drive->omega_ramp = caught.omega;
    drive->omega_open = caught.omega;
    drive->i_open = imposed ? 0 : pm_mul(c->i_d_light, drive->position.weight);
    drive->stage = imposed ? STAGE_OPEN_LOOP : STAGE_VECTOR;
    drive->state = DRIVE_RUNNING;
    drive->state_ms = 0;
}
#endif

/* The sequence has come to its end: injection from there on, or the open loop that aligned the rotor. */
static void begin_running(drive_t *drive)
{
#if SEQUENCE_HAS_POLARITY
    if (drive->stage == STAGE_VECTOR) {
        go_on(drive);
        return;
    }
#endif
    if (drive_injects(drive) && drive->command.mode != DRIVE_MODE_CURRENT) {
        begin_injection(drive, drive->sequence.theta);
    } else {
        drive->state = DRIVE_RUNNING;
    }
}

/* A step that this start or this board does without. */
static bool is_passed_over(const drive_t *drive, uint8_t procedure)
{
    if (procedure == (uint8_t)PROCEDURE_charge) {
        return drive->config.charge_periods == 0U;
    }
#if PM_HAS(flying_start)
    return procedure == (uint8_t)PROCEDURE_flying_start &&
           (!drive->config.flying_start.on || drive->command.mode == DRIVE_MODE_CURRENT);
#else
    return procedure == (uint8_t)PROCEDURE_flying_start;
#endif
}

static uint32_t next_step(const drive_t *drive, uint32_t from)
{
    uint32_t next = from;
    while (next < SEQUENCE_STEPS &&
           is_passed_over(drive, sequence_step((sequence_id_t)drive->sequence.id, next)->procedure)) {
        next++;
    }
    return next;
}

/* A procedure has come to its end, this way or that. */
static void advance(drive_t *drive, pm_procedure_t result)
{
    sequence_t *self = &drive->sequence;
    const sequence_id_t id = (sequence_id_t)self->id;
    const uint32_t next = next_step(drive, sequence_next(sequence_step(id, self->step), result));
    const bool rests = self->procedure == (uint8_t)PROCEDURE_flying_start && result == PM_FAILED_NOT_TURNING;
    if (result != PM_DONE && !rests) {
        drive->round = drive->round || result == PM_FAILED_SALIENCY;
        drive->status.refusal = (drive_refusal_t){.procedure = self->procedure, .reason = (uint8_t)result};
    }
    self->procedure = (uint8_t)PROCEDURE_NONE;
    switch (next) {
    case SEQUENCE_FAULT:
        drive_trip(drive,
                   result == PM_FAILED_OFFSET ? DRIVE_FAULT_SENSOR_OFFSET : DRIVE_FAULT_POSITION_NOT_FOUND);
        break;
    case SEQUENCE_RUN:
        begin_running(drive);
        break;
    case SEQUENCE_WAIT:
        drive->stage = STAGE_OFF;
        break;
    default:
        self->step = (uint8_t)next;
        self->begins = true;
        break;
    }
}

/* Injection finds its way from where the rotor stands. */
PM_RARE static void settle(drive_t *drive)
{
    position_slow(&drive->position, &drive->config.position, drive->i_ab, drive->status.i);
    drive->i_ref = (pm_dq_t){0, 0};
    const bool stator = (drive->config.position.traits & SOURCE_STATOR) != 0U;
    if (drive->state_ms >= (stator ? SETTLE_STATOR_MS : SETTLE_MS)) {
        reference_reset(drive, 0);
        drive->state = DRIVE_RUNNING;
    }
}

/* The end of the command ends it at once: there is no speed that the drive knows. Then the legs are off
 * already, also when the command has come back meanwhile, to which another start belongs. */
static void start(drive_t *drive)
{
    const bool working = drive->sequence.procedure != (uint8_t)PROCEDURE_NONE;
    if (!drive->command.enable || (working && drive->stage == STAGE_OFF)) {
        switch_off(drive);
    } else if (working) {
#if SEQUENCE_HAS_POLARITY
        if (drive->stage == STAGE_VECTOR) {
            position_slow(&drive->position, &drive->config.position, drive->i_ab, drive->status.i);
        }
#endif
        const pm_procedure_t result = procedure_slow(drive);
        if (result != PM_RUNNING) {
            advance(drive, result);
        }
    } else if (drive->stage == STAGE_VECTOR) {
        settle(drive);
    } else {
        /* waits until enable is taken back */
    }
}

PM_APART static void resolve_slip(drive_t *drive) /* its stack is not that of the others */
{
    const drive_config_t *c = &drive->config;
    const pm_dq_t v = {.d = pm_narrow(drive->voltage.v.d), .q = pm_narrow(drive->voltage.v.q)};
    const pm_angle_t turn =
        position_resolve_slip(&drive->position, &c->position, &c->machine, v, drive->status.i, drive->i_ab);
    if (turn != 0U) {
        turn_frame(drive, turn, v);
    }
}

#if PM_HAS(six_step)
/* The vector goes on at the rotor's angle with the current that flows. */
PM_RARE static void begin_vector(drive_t *drive)
{
    const pm_dq_t i = drive->status.i;
    const pm_pll_t pll = drive->pll;
    take_over(drive, &pll, i.q);
    drive->stage = STAGE_VECTOR;
}

/* The rotor has gone astray: what a start does behind the calibration, which looks for one that turns first. */
PM_RARE static void begin_again(drive_t *drive)
{
    begin_sequence(drive);
    drive->sequence.step = (uint8_t)next_step(drive, 1);
    drive->stage = STAGE_OFF;
    drive->state = DRIVE_FINDING;
}

/* No current is led into a rotor that may turn at speed, unless it is looked for first. */
static bool may_look(const drive_t *drive)
{
    return !is_passed_over(drive, (uint8_t)PROCEDURE_flying_start);
}

PM_RARE static void try_again(drive_t *drive, drive_fault_t fault)
{
    if (drive->state == DRIVE_STOPPING) {
        switch_off(drive);
    } else if (drive->block_tries >= drive->config.block.tries) {
        drive_trip(drive, fault);
    } else {
        drive->block_tries++;
        begin_again(drive);
    }
}

static void run_block(drive_t *drive)
{
    switch (block_slow(drive)) {
    case BLOCK_SLOW:
        if (!drive->config.block.from_rest) {
            begin_vector(drive);
        } else if (drive->state == DRIVE_STOPPING) {
            switch_off(drive);
        } else {
            begin_again(drive);
        }
        break;
    case BLOCK_LOST:
        if (may_look(drive)) {
            try_again(drive, DRIVE_FAULT_POSITION_LOST);
        } else {
            drive_trip(drive, DRIVE_FAULT_POSITION_LOST);
        }
        break;
    case BLOCK_STALLED:
        try_again(drive, DRIVE_FAULT_STALL);
        break;
    default:
        break;
    }
}
#endif

static void run(drive_t *drive)
{
#if PM_HAS(six_step)
    if (drive->stage == STAGE_SIX_STEP) {
        run_block(drive);
        return;
    }
    if (drive->stage == STAGE_OPEN_LOOP && block_from_rest(drive)) {
        return;
    }
#endif
    const position_config_t *c = &drive->config.position;
    position_slow(&drive->position, c, drive->i_ab, drive->status.i);
    if (drive->stage == STAGE_OPEN_LOOP) {
        open_loop_slow(drive);
        return;
    }
    reference_vector(drive);
#if PM_HAS(carrier_rest)
    if (drive->config.rest.after_ms != 0U) {
        rest_slow(drive);
    }
#endif
#if PM_HAS(six_step)
    if (block_may_begin(drive)) {
        block_begin(drive);
        return;
    }
#endif
    /* without injection nothing shows the position at low speed */
    if (!drive_injects(drive) && pm_abs(drive->speed.reference) < c->omega_low &&
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
        switch_off(drive);
        return;
    }
    switch (drive->state) {
    case DRIVE_OFF:
        if (enable) {
            PM_IN_IMAGE(six_step, drive->block_tries = 0;)
            begin_sequence(drive);
        }
        break;
    case DRIVE_CALIBRATING:
    case DRIVE_FINDING:
        start(drive);
        break;
    case DRIVE_RUNNING:
        if (drive->command.mode == DRIVE_MODE_IDENTIFY) {
            start(drive);
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

/* A procedure that is not part of a start has currents of its own, and goes on with the command that it began
 * with. */
static bool is_alone(const drive_t *drive)
{
    return drive->stage == STAGE_PROCEDURE && drive->state == DRIVE_RUNNING;
}

/* Of a rotor that turns without current control nothing is known. */
static void report_nothing(drive_t *drive)
{
    drive_status_t *s = &drive->status;
    if (!is_alone(drive)) {
        drive->i_ref = (pm_dq_t){0, 0};
        s->i = (pm_dq_t){0, 0};
    }
    drive->pll = (pm_pll_t){.theta = 0}; /* the step copies the angle from there */
    s->omega = 0;
    s->omega_ref = 0;
    s->weight = 0;
    s->quality = 0;
    s->slips = 0;
}

static void report(drive_t *drive)
{
    drive_status_t *s = &drive->status;
    s->state = drive->fault == DRIVE_FAULT_NONE ? drive->state : DRIVE_FAULT;
    s->fault = drive->fault;
    if (drive->stage < STAGE_SIX_STEP) {
        report_nothing(drive);
    } else if (drive->stage == STAGE_SIX_STEP) {
        s->omega = drive->pll.omega;
        s->omega_ref = drive->speed.reference;
        s->weight = PM_ONE;
        s->quality = PM_ONE;
        s->slips = 0;
    } else {
        s->omega = drive->position.pll.omega;
        s->omega_ref = drive->stage == STAGE_OPEN_LOOP ? drive->omega_ramp : drive->speed.reference;
        s->weight = drive->position.weight;
        s->quality = drive->position.quality;
        s->slips = drive->position.slip.count;
        s->limits |= s->slips != 0U ? (uint32_t)DRIVE_LIMIT_SLIP : 0U;
    }
    s->i_ref = drive->i_ref;
    s->v = drive->v_next;
}

void drive_slow(drive_t *drive, const drive_slow_in_t *in)
{
    drive->temperature_dC = in->temperature_dC;
    drive->status.limits = drive->voltage.limited || drive->modulator.limited != 0 ? DRIVE_LIMIT_VOLTAGE : 0U;
    drive->voltage.limited = false;
    drive->modulator.limited = 0;
    protection_heat(drive);
    protection_phases(drive);
    if (drive->fault == DRIVE_FAULT_NONE) {
        if (!drive->references_ready && !is_alone(drive)) {
            reference_take(drive);
            drive->references_ready = true;
        }
        drive->state_ms = (uint16_t)(drive->state_ms + (drive->state_ms < UINT16_MAX ? 1U : 0U));
        move(drive);
        if (drive->stage == STAGE_VECTOR) {
            resolve_slip(drive);
        }
#if PM_HAS(flying_start)
        if (drive->sequence.begins && drive->sequence.step == (uint8_t)SEQUENCE_CAUGHT) {
            begin_caught(drive);
        }
#endif
        if (drive->sequence.begins) {
            begin_step(drive);
        }
        protection_slow(drive);
    }
    if (drive->fault != DRIVE_FAULT_NONE) {
        procedure_abort(drive);
        drive->state = DRIVE_FAULT;
        if (drive->stage == STAGE_SHORT) {
            fault_short_slow(drive);
        } else {
            drive->stage = STAGE_OFF;
        }
    }
    drive_prepare(drive);
    report(drive);
}
