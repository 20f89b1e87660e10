/* What a start consists of: procedures one after the other, and where a refusal leads.
 *
 *   align          calibrate, charge, align
 *   pulses         calibrate, charge, find
 *   pulses_align   calibrate, charge, find; align, if that found no polarity
 *   identify       calibrate, charge, identify
 * find is the procedure of drive_config_t.find. On boards without PM_BOOTSTRAP charge is passed over, without a
 * period of its own.
 * The fall-back is for what alignment can replace: without saliency injection has nothing to go by, and
 * without a current nothing is connected; those are faults in all of them.
 * Tests: tests/unit/drive/sequence_test.cpp. */
#ifndef DRIVE_PROCEDURES_SEQUENCE_H
#define DRIVE_PROCEDURES_SEQUENCE_H

#include <stdbool.h>

#include "firmware/math/frames.h"
#include "firmware/math/procedure.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    SEQUENCE_align,
    SEQUENCE_pulses,
    SEQUENCE_pulses_align,
    SEQUENCE_identify,
    SEQUENCE_COUNT,
} sequence_id_t;

#define SEQUENCE_STEPS 4

/* Where a step leads: the number of another, or one of these. */
enum {
    SEQUENCE_FAULT = SEQUENCE_STEPS,
    SEQUENCE_RUN,  /* the drive runs, from the angle that was found */
    SEQUENCE_WAIT, /* bridge off, until enable is taken back */
};

#define SEQUENCE_ANY  PM_PROCEDURE_COUNT
#define SEQUENCE_FIND 255

typedef struct {
    uint8_t procedure; /* PROCEDURE_... or SEQUENCE_FIND */
    uint8_t done;
    uint8_t refused; /* where it leads when it fails by ... */
    uint8_t reason;  /* ... this, PM_FAILED_... or SEQUENCE_ANY; by another: SEQUENCE_FAULT */
} sequence_step_t;

const sequence_step_t *sequence_step(sequence_id_t id, uint32_t step);
uint8_t sequence_procedure(const sequence_step_t *step, uint8_t find); /* PROCEDURE_... */
uint32_t sequence_next(const sequence_step_t *step, pm_procedure_t result);
uint32_t sequence_needs(sequence_id_t id, uint8_t find); /* NEEDS_...: of all its procedures */

/* The drive's place in it. */
typedef struct {
    uint8_t id, step;
    uint8_t procedure; /* at work, or PROCEDURE_NONE */
    bool begins;       /* the step does, in this millisecond */
    pm_angle_t theta;  /* of the rotor, where the last position finding left it */
    pm_sigma_t margin; /* of that, the smallest */
} sequence_t;

#ifdef __cplusplus
}
#endif

#endif
