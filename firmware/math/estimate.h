/* Input and output of every position source: fundamental-model observers and injection alike.
 *
 * A source compares the measurement with the present position and reports by how much that position lags the
 * rotor; drive/position.c closes the loop. So a source has no angle of its own that could disagree.
 * All values belong to the sample instant k. A source that speaks on events only (SOURCE_EVENTS) gives eps = 0
 * in the periods between, and eps times the periods since its last event when one comes. */
#ifndef PM_MATH_ESTIMATE_H
#define PM_MATH_ESTIMATE_H

#include "firmware/math/frames.h"
#include "firmware/math/measure.h"

/* Traits of a source, a sum; they stand in its row of a list. */
enum {
    SOURCE_HALF_TURN = 1,  /* eps is the same half a turn on: it cannot tell the poles apart */
    SOURCE_THIRD_TURN = 2, /* eps is the same a third of a turn on */
    SOURCE_EVENTS = 4,     /* speaks in some periods only */
    SOURCE_ONE_WAY = 8,    /* its carrier turns one way: mirrored inputs do not give mirrored outputs */
    SOURCE_STATOR = 16,    /* its carrier stands in the stator: turned inputs do not give the same outputs */
    SOURCE_IN_MEAN = 32,   /* eps is right in the mean over a sixth of a turn only */
    SOURCE_IN_REFERENCE = 64, /* its carrier is in the reference of the current, not in the voltage */
};

#if PM_CARRIES(PM_MEASURED)
/* What was measured in [k-1, k) and at k beside the currents at k and the DC link. A source reads what its
 * row of a list needs; whether it was measured at all, `codes` says. */
typedef struct {
    const pm_measure_t *codes; /* full scales are those of the channel */
#if PM_HAS(pwm_excitation)
    pm_ab_t i_sample[PM_SAMPLES]; /* per-unit; where codes->sampled says so */
#endif
#if PM_HAS(zero_vector)
    const pm_q_t *v_dc; /* at k, per-unit */
#endif
#if PM_CARRIES(NEEDS_NEUTRAL)
    pm_q_t
        v_zero; /* mean of the terminals minus star point at k, behind its RC, per-unit (drive/neutral.h) */
#if PM_CARRIES(NEEDS_SECOND_SET)
    pm_q_t v_zero_second; /* the same of a second set, 30 degrees on; */
    pm_ab_t apart;        /* half of what the first set has more current than it, at k */
#endif
#endif
} obs_more_t;
#endif

typedef struct {
    pm_ab_t v;    /* mean voltage over [k-1, k), per-unit: what the bridge applied, dead time compensated */
    pm_ab_t i;    /* current at k */
    pm_dir_t dir; /* direction of the present position theta(k) */
    pm_q_t omega; /* present electrical speed */
    pm_dq_t i_dq; /* fundamental current at k in the present frame */
#if PM_CARRIES(PM_MEASURED)
    const obs_more_t *more; /* of a step; NULL otherwise */
#endif
} obs_in_t;

typedef struct {
    pm_q_t eps;     /* theta_rotor - theta, rad in Q28, exact for small errors, limited to +-1 */
    pm_q_t misfit;  /* disagreement of model and measurement, relative; 0 = perfect, see each source */
    pm_dq_t vector; /* the vector that carries the position, in the present frame: flux, EMF or HF current */
} obs_out_t;

#endif
