/* What two bridges do in a period. */
#ifndef DRIVE_BRIDGES_H
#define DRIVE_BRIDGES_H

#include "firmware/control/modulator.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The values of the parameter `winding`. */
typedef enum {
    WINDING_STAR,
    WINDING_OPEN,     /* open_winding.h */
    WINDING_TWO_SETS, /* two_sets.h */
} winding_id_t;

/* L / T, per-unit, Q22: up to 512; and its product with a change of the current in a period, within +-4. */
#define BRIDGES_L_BITS 22

static inline pm_q_t bridges_induced(int32_t L, pm_q_t change)
{
    return pm_shl(pm_sat(pm_mulh(change, L), 30 - (32 - BRIDGES_L_BITS)), 32 - BRIDGES_L_BITS);
}

typedef struct {
    modulator_out_t bridge[2]; /* their legs, in counts */
    pm_ab_t v;                 /* what acts on the machine of the drive's parameters */
} bridges_t;

#if PM_CARRIES(NEEDS_BRIDGES)
/* Refuses what drives legs by itself and knows one bridge; config_windings.c. */
void check_one_bridge(maker_t *m);
#endif

#ifdef __cplusplus
}
#endif

#endif
