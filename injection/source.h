/* What a low-speed source gives beside an observer's output, and what it asks of the rest of the drive. */
#ifndef INJECTION_SOURCE_H
#define INJECTION_SOURCE_H

#include "firmware/math/estimate.h"
#include "firmware/math/image.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A source reads the neutral, or samples between the two halves of a period. */
#define INJECTION_HAS_MORE (PM_CARRIES(PM_MEASURED) && PM_CARRIES(NEEDS_NEUTRAL | NEEDS_HALVES))
#if INJECTION_HAS_MORE
#define INJECTION_IF_MORE(...) __VA_ARGS__
#else
#define INJECTION_IF_MORE(...)
#endif

/* A source has its carrier in the reference of the current, and reads the voltage that makes it. */
#if PM_HAS(current_sine)
#define INJECTION_IF_VOLTAGE(...) __VA_ARGS__
#else
#define INJECTION_IF_VOLTAGE(...)
#endif

typedef struct {
    pm_ab_t i;           /* current at k */
    pm_dir_t dir;        /* direction of the present position theta(k) */
    pm_q_t omega;        /* present electrical speed */
    pm_half_dir_t ahead; /* half of the direction of the estimated frame where the voltage will act */
#if INJECTION_HAS_MORE
    const obs_more_t *more;
#endif
    INJECTION_IF_VOLTAGE(pm_ab_t v;) /* as obs_in_t */
} injection_in_t;

/* What a carrier does to the period [k+1, k+2); what a source does not name is zero. */
typedef struct {
    pm_ab_t v; /* added throughout, per-unit */
    PM_IN_IMAGE(two_sets,
                pm_ab_t apart;) /* what a second set of windings is given beside it (drive/two_sets.h) */
    INJECTION_IF_VOLTAGE(pm_q_t i_ref;) /* added to the reference of the current along d */
#if PM_HAS(counted_carrier)
    pm_dq_t i; /* current of the carrier in the middle of that period, in the estimated frame, where the
                  compensation of dead time is to count it in */
#endif
#if PM_CARRIES(NEEDS_HALVES)
    pm_ab_t split; /* added in the first half, up to the all-high zero vector, and taken away in the second:
                      the mean voltage is what it is without */
#endif
#if PM_HAS(pwm_excitation)
    uint16_t sample_at[PM_SAMPLES]; /* as pm_instants_t; delivered at k+2 */
#endif
} excitation_t;

/* A voltage and nothing else. */
static inline excitation_t excitation_of(pm_ab_t v)
{
    excitation_t e;
    e.v = v;
#if PM_HAS(two_sets)
    e.apart.alpha = 0;
    e.apart.beta = 0;
#endif
    INJECTION_IF_VOLTAGE(e.i_ref = 0;)
#if PM_HAS(counted_carrier)
    e.i.d = 0;
    e.i.q = 0;
#endif
#if PM_CARRIES(NEEDS_HALVES)
    e.split.alpha = 0;
    e.split.beta = 0;
#endif
#if PM_HAS(pwm_excitation)
    for (uint32_t n = 0; n < PM_SAMPLES; n++) {
        e.sample_at[n] = 0;
    }
#endif
    return e;
}

typedef struct {
    pm_q_t eps; /* as obs_out_t */
    pm_dq_t i;  /* current at k in the present frame without the answer to the carrier */
    excitation_t carrier;
} injection_out_t;

/* Asked when configured, in Hz; 0: nothing. */
typedef struct {
    pm_num_t pll_max;     /* largest bandwidth of the position loop; more is refused */
    pm_num_t current_max; /* bandwidth of current control while the carrier is on; faster control is slowed */
    pm_num_t low_pass;    /* of the error signal, where `injection_filter` says none */
    pm_num_t swing;       /* A, by which a leg's edges are off the mean current, mean of two periods */
    pm_num_t comp_zone;   /* A, that the zone of the dead time's compensation must have at least; 0: none */
} injection_limits_t;

#ifdef __cplusplus
}
#endif

#endif
