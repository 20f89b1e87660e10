/* What a start consists of: procedures one after the other, and where a refusal leads.
 *
 *   align          calibrate, look, charge, align
 *   pulses         calibrate, look, charge, find
 *   pulses_align   calibrate, look, charge, find; align, if that found no saliency, or torque_polarity, if no polarity
 *   identify       calibrate, charge, identify
 *   pole           calibrate, look, charge, find; then, whether that found a polarity or not, pole
 *   pole_align     the same; align, if find found no saliency, or torque_polarity, if pole found none
 * find and pole are the procedures of drive_config_t. look, flying_start.h, catches a rotor that turns, and the drive runs
 * from there; it is passed over, without a period of its own, unless the parameter flying_start is set, and in current
 * mode. So is charge on boards without PM_BOOTSTRAP.
 * The fall-back is for what alignment, or which way a torque turns the rotor, can replace; a rotor that turns by itself is
 * aligned. A machine that shows no saliency is round, whatever it was told: it runs as one without injection does, by open loop
 * and hand-over, until the next start. An image without torque_polarity aligns a machine that shows no polarity, too; where
 * weak magnets or a brake have left that at the wrong pole, the EMF puts it right (slip.h). Without a current nothing is
 * connected: a fault in all of them.
 * Tests: tests/unit/drive/sequence_test.cpp, tests/scenario/start_fallback.yaml, start_round.yaml. */
#ifndef DRIVE_PROCEDURES_SEQUENCE_H
#define DRIVE_PROCEDURES_SEQUENCE_H

#include <stdbool.h>

#include "firmware/math/frames.h"
#include "firmware/math/image.h"
#include "firmware/math/procedure.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    SEQUENCE_align,
    SEQUENCE_pulses,
    SEQUENCE_pulses_align,
    SEQUENCE_identify,
    SEQUENCE_pole,
    SEQUENCE_pole_align,
    SEQUENCE_COUNT,
} sequence_id_t;

/* Whether the image has a step for the polarity alone. */
#define SEQUENCE_HAS_POLARITY                                                                                \
    (PM_HAS(d_current) || PM_HAS(secondary_current) || PM_HAS(secondary_voltage) || PM_HAS(dual_pulses) ||   \
     PM_HAS(three_phase_hf) || PM_HAS(torque_polarity))

#if SEQUENCE_HAS_POLARITY
#define SEQUENCE_STEPS 7
#define SEQUENCE_KINDS SEQUENCE_COUNT
#else
#define SEQUENCE_STEPS 5
#define SEQUENCE_KINDS SEQUENCE_pole /* those before it */
#endif

/* Where a step leads: the number of another, or one of these. */
enum {
    SEQUENCE_FAULT = SEQUENCE_STEPS,
    SEQUENCE_RUN,    /* the drive runs, from the angle that was found */
    SEQUENCE_WAIT,   /* bridge off, until enable is taken back */
    SEQUENCE_CAUGHT, /* the drive runs, from the angle and the speed that were found */
};

#define SEQUENCE_FIND 255
#define SEQUENCE_POLE 254

typedef struct {
    uint8_t procedure; /* PROCEDURE_..., SEQUENCE_FIND or SEQUENCE_POLE */
    uint8_t done;
    uint8_t not_there; /* where PM_FAILED_POLARITY or PM_FAILED_NOT_TURNING leads, */
    uint8_t no_axis;   /* PM_FAILED_SALIENCY, */
    uint8_t other;     /* and every other failure */
} sequence_step_t;

const sequence_step_t *sequence_step(sequence_id_t id, uint32_t step);
uint8_t sequence_procedure(const sequence_step_t *step, uint8_t find, uint8_t pole); /* PROCEDURE_... */
uint32_t sequence_next(const sequence_step_t *step, pm_procedure_t result);
uint32_t sequence_needs(sequence_id_t id, uint8_t find, uint8_t pole); /* NEEDS_...: of all its procedures */

/* The drive's place in it. */
typedef struct {
    uint8_t id, step;
    uint8_t procedure; /* at work, or PROCEDURE_NONE */
    bool begins;       /* the step does, in this millisecond */
    pm_angle_t theta;  /* of the rotor, where the last position finding left it */
    pm_q_t omega;      /* its speed, if it was caught */
    pm_sigma_t margin; /* of that, the smallest */
} sequence_t;

#ifdef __cplusplus
}
#endif

#endif
