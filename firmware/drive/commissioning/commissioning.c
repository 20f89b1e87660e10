/* The sequence of the identification. */
#include "firmware/drive/commissioning/commissioning.h"

#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/math/filter.h"
#include "firmware/math/root.h"

#define HOLD_MS 500U
#define REST_MS 1000U

enum {
    SWEEP,
    LEVELS,
    REST,
    SMALL_D,
    HOLD_1,
    SMALL_Q,
    HOLD_2,
    UP,
    FULL,
    LESS,
    DOWN,
    HOLD_3,
    RATED_Q,
    END,
};

pm_q_t commissioning_current(const drive_t *drive)
{
    return pm_clamp(pm_abs(drive->i_target), drive->config.i_max / 16, drive->config.i_max);
}

/* k_theta is 16 / (2 pi) of it, Q30. */
pm_q_t commissioning_period(const drive_t *drive)
{
    return pm_frac(drive->config.k_theta, PM_FRAC(0.0981747704));
}

static pm_q_t assumed_loss(const drive_t *drive)
{
    const modulator_config_t *m = &drive->config.modulator;
    return m->drop + pm_frac(drive->status.v_dc, pm_shl(m->dead, 32 - PM_SHARE_BITS));
}

/* Values that a routine needs and that are not to be identified come from the last results, else from the
 * parameters. */
static void know(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    const commissioning_result_t *r = &drive->commissioning_report.result;
    const drive_config_t *c = &drive->config;
    self->L_d = r->L_d != 0 ? r->L_d : c->machine.L_d;
    self->L_q = r->L_q != 0 ? r->L_q : c->machine.L_q;
    self->lost = r->R != 0 ? r->lost : assumed_loss(drive);
    self->R = r->R != 0 ? r->R : c->machine.R_s;
    commissioning_set_gains(drive);
}

static bool is_wanted(uint8_t routines, uint32_t phase)
{
    const bool turning = (routines & ((uint8_t)COMMISSIONING_FLUX | (uint8_t)COMMISSIONING_MECHANICS)) != 0U;
    const bool inductance = (routines & (uint8_t)COMMISSIONING_INDUCTANCE) != 0U;
    switch (phase) {
    case LEVELS:
        return (routines & (uint8_t)COMMISSIONING_RESISTANCE) != 0U;
    case REST: /* the levels give it otherwise */
        return inductance && (routines & (uint8_t)COMMISSIONING_RESISTANCE) == 0U;
    case SMALL_D:
    case HOLD_1:
    case SMALL_Q:
    case HOLD_3:
    case RATED_Q:
        return inductance;
    case HOLD_2:
    case UP:
    case FULL:
    case LESS:
    case DOWN:
        return turning;
    default:
        return true;
    }
}

static void enter(drive_t *drive, uint8_t phase)
{
    identify_t *self = &drive->procedure.identify;
    self->phase = phase;
    self->part = 0;
    self->ms = 0;
    commissioning_clear_sums(self);
    switch (phase) {
    case SWEEP:
        sweep_enter(drive);
        break;
    case LEVELS:
        levels_enter(drive);
        break;
    case SMALL_D:
        inductance_enter(drive, false, false);
        break;
    case SMALL_Q:
        inductance_enter(drive, true, false);
        break;
    case RATED_Q:
        inductance_enter(drive, true, true);
        break;
    case HOLD_1:
    case HOLD_2:
    case HOLD_3:
        if (self->kind != (uint8_t)KIND_CURRENT) {
            commissioning_start_current(drive);
        }
        break;
    case UP:
        rotation_enter(drive);
        break;
    default:
        break;
    }
}

/* On the sweep's voltage, by whose current the resistance damps a rotor that swings. */
static phase_result_t come_to_rest(const drive_t *drive)
{
    return (phase_result_t){.done = drive->procedure.identify.ms > REST_MS};
}

/* The vector returns the rotor to phase A; then the rotor has time to come to rest. */
static phase_result_t hold(drive_t *drive, bool full)
{
    identify_t *self = &drive->procedure.identify;
    const pm_q_t i = full ? commissioning_current(drive) : commissioning_current(drive) / 2;
    const int32_t left = pm_angle_diff(0U, drive->theta_open);
    const int32_t most = (int32_t)(PM_TURN(0.5) / HOLD_MS);
    drive->theta_open += (pm_angle_t)pm_clamp(left, -most, most);
    self->ms = left == 0 ? self->ms : 0U;
    drive->i_ref.d = pm_approach(drive->i_ref.d, i, i / 64 + 1);
    return (phase_result_t){.done = self->ms > HOLD_MS};
}

static phase_result_t phase_slow(drive_t *drive)
{
    switch (drive->procedure.identify.phase) {
    case SWEEP:
        return sweep_slow(drive);
    case LEVELS:
        return levels_slow(drive);
    case SMALL_D:
        return inductance_slow(drive, false, false);
    case SMALL_Q:
        return inductance_slow(drive, true, false);
    case RATED_Q:
        return inductance_slow(drive, true, true);
    case REST:
        return come_to_rest(drive);
    case HOLD_1:
    case HOLD_3:
        return hold(drive, true);
    case HOLD_2:
        return hold(drive, false);
    case UP:
        return rotation_up(drive);
    case FULL:
        return rotation_full(drive);
    case LESS:
        return rotation_less(drive);
    case DOWN:
    default:
        return rotation_down(drive);
    }
}

void procedure_identify_begin(drive_t *drive)
{
    commissioning_report_t *report = &drive->commissioning_report;
    report->routines = drive->command.routines == 0U ? (uint8_t)COMMISSIONING_ALL : drive->command.routines;
    procedure_report(drive, COMMISSIONING_RUNNING, COMMISSIONING_NO_REASON);
    drive->omega_open = 0;
    know(drive);
    enter(drive, SWEEP);
}

/* The report's reasons in the order of those of all procedures. */
static pm_procedure_t reason_of(commissioning_reason_t reason)
{
    return (pm_procedure_t)((uint32_t)PM_FAILED_NO_CURRENT + (uint32_t)reason -
                            (uint32_t)COMMISSIONING_NO_CURRENT);
}

pm_procedure_t procedure_identify_slow(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    self->ms++;
    const phase_result_t result = phase_slow(drive);
    if (result.failed != COMMISSIONING_NO_REASON) {
        procedure_report(drive, COMMISSIONING_FAILED, result.failed);
        return reason_of(result.failed);
    }
    if (result.done) {
        uint8_t next = self->phase;
        do {
            next++;
        } while (!is_wanted(drive->commissioning_report.routines, next));
        drive->commissioning_report.progress = (uint8_t)(100U * (uint32_t)next / (uint32_t)END);
        if (next == (uint8_t)END) {
            procedure_report(drive, COMMISSIONING_DONE, COMMISSIONING_NO_REASON);
            return PM_DONE;
        }
        enter(drive, next);
    }
    return PM_RUNNING;
}

void procedure_identify_abort(drive_t *drive)
{
    (void)drive; /* procedure_abort() reports it */
}
