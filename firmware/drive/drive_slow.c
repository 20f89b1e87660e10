#include "firmware/drive/drive_parts.h"

#include "firmware/math/compiler.h"
#include "firmware/math/trig.h"

/* Standstill that ends a stop. */
#define STILL_MS 20

static void enter(drive_t *drive, drive_state_t state, drive_stage_t stage)
{
    drive->state = state;
    drive->stage = stage;
    drive->state_ms = 0;
    drive->still_ms = 0;
}

PM_RARE void drive_switch_off(drive_t *drive)
{
    procedure_abort(drive);
    enter(drive, DRIVE_OFF, STAGE_OFF);
}

/* Current and voltage stay as they are; both have other coordinates in the frame that was put right. */
PM_RARE void drive_turn_frame(drive_t *drive, pm_angle_t turn, pm_dq_t v)
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

#if PM_HAS(flying_start) || PM_HAS(six_step)
/* The rotor is known, and i_q flows: the EMF is the voltage that keeps it, from the period that has begun on. */
PM_RARE void drive_take_over(drive_t *drive, const pm_pll_t *known, pm_q_t i_q)
{
    const drive_config_t *c = &drive->config;
    const pm_ab_t i = pm_park_inverse((pm_dq_t){0, i_q}, pm_dir(known->theta));
    position_reset(&drive->position, &c->position, known, i, drive_injects(drive));
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

/* Torque has driven the rotor from the wrong side: what was wanted of it is wanted still, and a rotor that turns back for it is
 * braked, by a ramp that begins at rest. */
static void go_the_right_way(drive_t *drive, pm_q_t wanted)
{
    const pm_q_t omega = drive->position.pll.omega;
    speed_control_reset(&drive->speed, (omega < 0) == (wanted < 0) ? omega : 0, wanted);
    drive->i_ref.q = wanted;
}

PM_APART static void resolve_slip(drive_t *drive) /* its stack is not that of the others */
{
    const drive_config_t *c = &drive->config;
    const pm_dq_t v = {.d = pm_narrow(drive->voltage.v.d), .q = pm_narrow(drive->voltage.v.q)};
    const pm_angle_t turn =
        position_resolve_slip(&drive->position, &c->position, &c->machine, v, drive->status.i, drive->i_ab);
    if (turn != 0U) {
        const pm_q_t wanted = drive->i_ref.q;
        drive_turn_frame(drive, turn, v);
        go_the_right_way(drive, wanted);
    }
}

#if PM_HAS(six_step)
/* The vector goes on at the rotor's angle with the current that flows. */
PM_RARE static void begin_vector(drive_t *drive)
{
    const pm_dq_t i = drive->status.i;
    const pm_pll_t pll = drive->pll;
    drive_take_over(drive, &pll, i.q);
    drive->stage = STAGE_VECTOR;
}

/* No current is led into a rotor that may turn at speed, unless it is looked for first. */
static bool may_look(const drive_t *drive)
{
    return !start_passes_over(drive, (uint8_t)PROCEDURE_flying_start);
}

PM_RARE static void try_again(drive_t *drive, drive_fault_t fault)
{
    if (drive->state == DRIVE_STOPPING) {
        drive_switch_off(drive);
    } else if (drive->block_tries >= drive->config.block.tries) {
        drive_trip(drive, fault);
    } else {
        drive->block_tries++;
        start_again(drive);
    }
}

static void run_block(drive_t *drive)
{
    switch (block_slow(drive)) {
    case BLOCK_SLOW:
        if (!drive->config.block.from_rest) {
            begin_vector(drive);
        } else if (drive->state == DRIVE_STOPPING) {
            drive_switch_off(drive);
        } else {
            start_again(drive);
        }
        break;
    case BLOCK_LOST:
        if (may_look(drive) || drive->state == DRIVE_STOPPING) {
            try_again(drive, block_fault(drive, DRIVE_FAULT_POSITION_LOST));
        } else {
            drive_trip(drive, block_fault(drive, DRIVE_FAULT_POSITION_LOST));
        }
        break;
    case BLOCK_STALLED:
        try_again(drive, block_fault(drive, DRIVE_FAULT_STALL));
        break;
    default:
        break;
    }
}
#endif

static void run(drive_t *drive)
{
#if PM_HAS(six_step)
    if (drive_commutates(drive)) {
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
        drive_switch_off(drive);
    }
}

/* A mode that the commutation, or the winding, does not have. */
static bool is_refused(const drive_t *drive)
{
#if PM_CARRIES(NEEDS_BRIDGES)
    if (drive->config.winding != (uint8_t)WINDING_STAR && drive->command.mode == DRIVE_MODE_IDENTIFY) {
        return true;
    }
#endif
#if PM_HAS(six_step)
    return drive->command.mode == DRIVE_MODE_DUTY && !drive->config.block.on;
#else
    (void)drive;
    return false;
#endif
}

static void move(drive_t *drive)
{
    const bool enable = drive->command.enable;
    if (!enable && drive->command.coast) {
        drive_switch_off(drive);
        return;
    }
    switch (drive->state) {
    case DRIVE_OFF:
        if (enable && !is_refused(drive)) {
            PM_IN_IMAGE(six_step, drive->block_tries = 0;)
            start_begin(drive);
        }
        break;
    case DRIVE_CALIBRATING:
    case DRIVE_FINDING:
        start_slow(drive);
        break;
    case DRIVE_RUNNING:
        if (drive->command.mode == DRIVE_MODE_IDENTIFY) {
            start_slow(drive);
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
    } else if (drive_commutates(drive)) {
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
    protection_link(drive);
    protection_phases(drive);
    if (drive->fault == DRIVE_FAULT_NONE) {
        if (!is_alone(drive)) {
            reference_take(drive);
        }
#if PM_HAS(six_step)
        if (drive->command.mode == DRIVE_MODE_DUTY) {
            block_take_duty(drive);
        }
#endif
        drive->state_ms = (uint16_t)(drive->state_ms + (drive->state_ms < UINT16_MAX ? 1U : 0U));
        move(drive);
        if (drive->stage == STAGE_VECTOR) {
            resolve_slip(drive);
        }
        if (drive->sequence.begins) {
            start_step(drive);
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
