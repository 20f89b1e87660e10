/* Fault codes and the record of the first fault. A fault is latched; the step that finds it drives nothing, or shorts
 * the motor (fault_short.h). */
#ifndef DRIVE_FAULT_H
#define DRIVE_FAULT_H

#include "firmware/math/frames.h"
#include "firmware/math/procedure.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    DRIVE_FAULT_NONE,
#define PM_FAULT(name, text) DRIVE_FAULT_##name,
#include "firmware/drive/fault.def"
#undef PM_FAULT
    DRIVE_FAULT_COUNT
} drive_fault_t;

/* What a start has failed by, or gone another way. */
typedef struct {
    uint8_t procedure; /* PROCEDURE_..., 0: none */
    uint8_t reason;    /* PM_FAILED_... */
} drive_refusal_t;

typedef struct {
    drive_fault_t fault;
    pm_abc_t i;       /* per-unit, as measured */
    pm_q_t v_dc;      /* per-unit */
    pm_q_t omega;     /* per-unit, estimated, electrical */
    pm_angle_t theta; /* estimated */
    int32_t temperature_dC;
    uint32_t period;         /* control periods since drive_init */
    drive_refusal_t refusal; /* of the last start */
} drive_fault_record_t;

const char *drive_fault_text(drive_fault_t fault);

#ifdef __cplusplus
}
#endif

#endif
