#include "firmware/drive/procedures/procedure.h"

#include <stddef.h>

#include "firmware/drive/drive_parts.h"
#include "firmware/math/image.h"
#include "firmware/math/measure.h"

#define PM_METHOD(name, help, traits, needs) PM_CHECK_NEEDS(name, needs)
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD

_Static_assert(offsetof(position_t, pll) == 0 && offsetof(procedure_t, pll) == 0,
               "drive->pll is that of whichever has the place");

#define STATE_BARE    DRIVE_CALIBRATING
#define STATE_LEGS    DRIVE_FINDING
#define STATE_CONTROL DRIVE_FINDING
#define STATE_ALONE   DRIVE_RUNNING

static drive_state_t state_of(procedure_id_t id)
{
    static const uint8_t states[PROCEDURE_COUNT] = {
        DRIVE_OFF,
#define PM_METHOD(name, help, traits, needs) STATE_##traits,
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    };
    return (drive_state_t)states[id];
}

/* Position control by injection runs already, and is what the procedure begins with. */
static bool goes_on(const drive_t *drive, procedure_id_t id)
{
#if SEQUENCE_HAS_POLARITY
    const bool by_voltage = PM_HAS(secondary_voltage) && id == PROCEDURE_secondary_voltage;
    return drive->stage == STAGE_VECTOR &&
           (id == PROCEDURE_d_current || id == PROCEDURE_secondary_current || by_voltage);
#else
    (void)drive;
    (void)id;
    return false;
#endif
}

void procedure_begin(drive_t *drive, procedure_id_t id)
{
    drive->state = state_of(id);
    drive->sequence.procedure = (uint8_t)id;
    if (!goes_on(drive, id)) {
        drive->stage = STAGE_PROCEDURE;
        drive->procedure = (procedure_t){.result = PM_RUNNING};
    }
    switch (id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case PROCEDURE_##name : procedure_##name##_begin(drive); break;)
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    case PROCEDURE_NONE:
    case PROCEDURE_COUNT:
    default:
        break;
    }
    if (drive->stage == STAGE_PROCEDURE) { /* not of what current control has commanded */
        drive->v_next = (pm_ab_t){0, 0};
    }
}

pm_procedure_t procedure_slow(drive_t *drive)
{
    switch ((procedure_id_t)drive->sequence.procedure) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case PROCEDURE_##name : return procedure_##name##_slow(drive);)
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    case PROCEDURE_NONE:
    case PROCEDURE_COUNT:
    default:
        return PM_RUNNING;
    }
}

bool procedure_without_current(const drive_t *drive)
{
    const uint8_t id = drive->sequence.procedure;
    const bool by_voltage = PM_HAS(secondary_voltage) && id == (uint8_t)PROCEDURE_secondary_voltage;
    return id == (uint8_t)PROCEDURE_lock || id == (uint8_t)PROCEDURE_secondary_current || by_voltage;
}

bool procedure_without_angle(const drive_t *drive)
{
#if PM_HAS(lock)
    return drive->sequence.procedure == (uint8_t)PROCEDURE_lock && lock_looks(&drive->beside.lock);
#else
    (void)drive;
    return false;
#endif
}

void procedure_report(drive_t *drive, commissioning_state_t state, commissioning_reason_t reason)
{
    commissioning_report_t *report = &drive->commissioning_report;
    report->state = (uint8_t)state;
    report->reason = (uint8_t)reason;
    if (state != COMMISSIONING_FAILED) {
        report->progress = state == COMMISSIONING_DONE ? 100U : 0U;
    }
}

void procedure_expect(drive_t *drive)
{
    if (drive->command.enable && drive->command.mode == DRIVE_MODE_IDENTIFY) {
        procedure_report(drive, COMMISSIONING_RUNNING, COMMISSIONING_NO_REASON);
    } else if (drive->commissioning_report.state == (uint8_t)COMMISSIONING_RUNNING) {
        procedure_report(drive, COMMISSIONING_FAILED, COMMISSIONING_ABORTED);
    } else {
        /* the report of the last one stands */
    }
}

void procedure_abort(drive_t *drive)
{
    const procedure_id_t id = (procedure_id_t)drive->sequence.procedure;
    drive->sequence.procedure = (uint8_t)PROCEDURE_NONE;
    switch (id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case PROCEDURE_##name : procedure_##name##_abort(drive); break;)
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    case PROCEDURE_NONE:
    case PROCEDURE_COUNT:
    default:
        break;
    }
    if (drive->commissioning_report.state == (uint8_t)COMMISSIONING_RUNNING) { /* begun or not */
        procedure_report(drive, COMMISSIONING_FAILED, COMMISSIONING_ABORTED);
    }
}
