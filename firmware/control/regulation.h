/* What every regulator is given and what it gives: current control between references and voltage. */
#ifndef CONTROL_REGULATION_H
#define CONTROL_REGULATION_H

#include "firmware/math/frames.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_dq_t i, i_ref; /* at k, in the estimated frame */
    pm_q_t omega;     /* electrical */
    pm_q_t v_max;     /* the voltage vector may have this length */
} regulator_in_t;

typedef struct {
    pm_dq_t v;    /* for [k+1, k+2), in the frame at its middle; Q22 */
    bool limited; /* set when it was shortened to v_max; the reader clears it */
} regulator_out_t;

#ifdef __cplusplus
}
#endif

#endif
