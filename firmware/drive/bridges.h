/* What two bridges do in a period. */
#ifndef DRIVE_BRIDGES_H
#define DRIVE_BRIDGES_H

#include "firmware/control/modulator.h"

/* The values of the parameter `winding`. */
typedef enum {
    WINDING_STAR,
    WINDING_OPEN,     /* open_winding.h */
    WINDING_TWO_SETS, /* two_sets.h */
} winding_id_t;

typedef struct {
    modulator_out_t bridge[2]; /* their legs, in counts */
    pm_ab_t v;                 /* what acts on the machine of the drive's parameters */
} bridges_t;

#endif
