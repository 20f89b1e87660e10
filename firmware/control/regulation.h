/* What every regulator is given and what it gives: current control between references and voltage. */
#ifndef CONTROL_REGULATION_H
#define CONTROL_REGULATION_H

#include "firmware/math/frames.h"
#include "firmware/math/image.h"
#include "firmware/math/measure.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Traits of a regulator, a sum; they stand in its row of the list. */
enum {
    REGULATOR_SWITCHES = 1, /* gives a switch state, not a voltage: it ripples, and no carrier can be added */
    REGULATOR_FOLLOWS = 2,  /* within a few periods: a carrier may be in the reference */
};

/* A regulator of switch states is in the program, and its legs can be held. */
#define REGULATION_HOLDS                                                                                     \
    (PM_CARRIES(NEEDS_HELD) && (PM_HAS(finite_set) || PM_HAS(predictive) || PM_HAS(direct_torque)))
#if REGULATION_HOLDS
#define PM_IF_HELD(...) __VA_ARGS__
#else
#define PM_IF_HELD(...)
#endif

typedef struct {
    pm_dq_t i, i_ref; /* at k, in the estimated frame */
    pm_q_t omega;     /* electrical */
    pm_q_t v_max;     /* the voltage vector may have this length */
#if REGULATION_HOLDS
    pm_half_dir_t ahead; /* half of the direction of the frame in the middle of [k+1, k+2) */
    pm_q_t v_dc;
#endif
} regulator_in_t;

typedef struct {
    pm_dq_t v;    /* for [k+1, k+2), in the frame at its middle; Q22 */
    bool limited; /* set when it was shortened to v_max; the reader clears it */
#if REGULATION_HOLDS
    uint16_t legs; /* 0: v is modulated; else PM_LEGS_..., held over the period, and v is their voltage */
#endif
} regulator_out_t;

#ifdef __cplusplus
}
#endif

#endif
