/* What a low-speed source gives beside an observer's output, and what it asks of the rest of the drive. */
#ifndef INJECTION_SOURCE_H
#define INJECTION_SOURCE_H

#include "firmware/math/estimate.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_ab_t i;           /* current at k */
    pm_dir_t dir;        /* direction of the present position theta(k) */
    pm_q_t omega;        /* present electrical speed */
    pm_half_dir_t ahead; /* half of the direction of the estimated frame where the voltage will act */
} injection_in_t;

typedef struct {
    pm_q_t eps; /* as obs_out_t */
    pm_dq_t i;  /* current at k in the present frame without the answer to the carrier */
    pm_ab_t v;  /* to be added over [k+1, k+2) */
} injection_out_t;

/* Asked when configured, in Hz; 0: nothing. */
typedef struct {
    pm_num_t pll_max;     /* largest bandwidth of the position loop; more is refused */
    pm_num_t current_max; /* bandwidth of current control while the source leads; faster control is slowed */
} injection_limits_t;

#ifdef __cplusplus
}
#endif

#endif
