/* The start: the sequence of procedures that finds the rotor, and what follows it. */
#include "firmware/drive/drive_parts.h"

#include "firmware/math/compiler.h"
#include "firmware/math/trig.h"

/* Injection settles on the position of the pulses, without torque. */
#define SETTLE_MS 30
/* More for one whose carrier lies along axes of the stator: it detects I_p first (injection/stationary.h). */
#define SETTLE_STATOR_MS 60
/* Called from drive_slow() itself: what begins needs the deepest stack of all. */
PM_RARE static void begin_procedure(drive_t *drive)
{
    sequence_t *self = &drive->sequence;
    self->begins = false;
    drive->state_ms = 0;
    drive->still_ms = 0;
    drive->stall_ms = 0;
    drive->lost = 0;
    drive->sum_ms = 0;
    const sequence_step_t *step = sequence_step((sequence_id_t)self->id, self->step);
    procedure_id_t id =
        (procedure_id_t)sequence_procedure(step, drive->config.find, config_pole(&drive->config));
#if PM_HAS(saliency_map)
    if (id == PROCEDURE_identify && drive->command.routines == (uint8_t)COMMISSIONING_SALIENCY) {
        id = PROCEDURE_saliency_map;
    }
#endif
#if PM_HAS(zero_inductance)
    if (id == PROCEDURE_identify && drive->command.routines == (uint8_t)COMMISSIONING_NEUTRAL) {
        id = PROCEDURE_zero_inductance;
    }
#endif
    procedure_begin(drive, id);
}

void start_begin(drive_t *drive)
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
    follow_reset(&drive->follow, &drive->config.machine);
}

void start_injection(drive_t *drive, pm_angle_t theta)
{
    const pm_pll_t rests = {.theta = theta};
    position_reset(&drive->position, &drive->config.position, &rests, drive->i_ab, true);
    regulator_reset(&drive->regulator, &drive->config.regulator, (pm_dq_t){0, 0}, (pm_dq_t){0, 0}, 0);
    reference_reset(drive, 0);
    drive->stage = STAGE_VECTOR;
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
    drive_turn_frame(drive, turn, v);
    drive->status.theta = drive->position.pll.theta;
    drive->state = DRIVE_RUNNING;
}
#endif

#if PM_HAS(flying_start)
/* The current along d is wanted at once, since dead time shows most where the legs' currents are about zero, as far as its flux,
 * of which an observer takes for an angle what L_q is not known to, is small beside psi_m; where the link has less than the EMF,
 * the one that weakens the field. At a speed where neither source sees the rotor it is held by a vector along its d-axis. */
PM_RARE static void begin_caught(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    drive->sequence.begins = false;
    const pm_pll_t caught = {.theta = drive->sequence.theta, .omega = drive->sequence.omega};
    const bool imposed = !c->position.injects && pm_abs(caught.omega) < c->position.omega_low;
    if (imposed) {
        open_loop_begin(drive);
        drive->i_vector = c->open_loop.i;
    }
    drive_take_over(drive, &caught, 0);
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
    const pm_q_t light = pm_mul(c->i_d_light, drive->position.weight);
    drive->i_open = imposed ? 0 : pm_max(light - pm_div(c->machine.psi_m / 16, c->machine.L_q), 0);
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
        start_injection(drive, drive->sequence.theta);
        drive->state_ms = 0;
    } else {
        drive->state = DRIVE_RUNNING;
    }
}

/* A step that this start or this board does without. */
bool start_passes_over(const drive_t *drive, uint8_t procedure)
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
           start_passes_over(drive, sequence_step((sequence_id_t)drive->sequence.id, next)->procedure)) {
        next++;
    }
    return next;
}

static drive_fault_t fault_of(pm_procedure_t result)
{
    switch (result) {
    case PM_FAILED_OFFSET:
        return DRIVE_FAULT_SENSOR_OFFSET;
    case PM_FAILED_OPEN:
        return DRIVE_FAULT_OPEN_PHASE;
    default:
        return DRIVE_FAULT_POSITION_NOT_FOUND;
    }
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
        drive_trip(drive, fault_of(result));
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
void start_slow(drive_t *drive)
{
    const bool working = drive->sequence.procedure != (uint8_t)PROCEDURE_NONE;
    if (!drive->command.enable || (working && drive->stage == STAGE_OFF)) {
        drive_switch_off(drive);
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

#if PM_HAS(six_step)
/* The rotor has gone astray: what a start does behind the calibration, which looks for one that turns first. */
PM_RARE void start_again(drive_t *drive)
{
    start_begin(drive);
    drive->rests = false;
    drive->sequence.step = (uint8_t)next_step(drive, 1);
    drive->stage = STAGE_OFF;
    drive->state = DRIVE_FINDING;
}
#endif

PM_RARE void start_step(drive_t *drive)
{
#if PM_HAS(flying_start)
    if (drive->sequence.step == (uint8_t)SEQUENCE_CAUGHT) {
        begin_caught(drive);
        return;
    }
#endif
    begin_procedure(drive);
}
