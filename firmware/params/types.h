/* What a configuration is made from, and what its making says: for headers. The list of the parameters is not
 * in it, so that a new parameter concerns nobody who includes this. With the list: parameters.h; to make a
 * configuration: maker.h. */
#ifndef PARAMS_TYPES_H
#define PARAMS_TYPES_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/math/num.h"

typedef struct drive_params drive_params_t; /* SI values; parameters.h */
typedef struct maker maker_t;               /* maker.h */
typedef uint32_t drive_param_id_t;          /* DRIVE_PARAM_name of parameters.h */

/* Bases. A signal in SI is its per-unit value times the base. */
typedef struct {
    pm_num_t v;      /* V: full scale of the DC-link channel */
    pm_num_t i;      /* A: full scale of the current channels */
    pm_num_t omega;  /* rad/s electrical: over-speed limit */
    pm_num_t psi;    /* Wb = v / omega */
    pm_num_t torque; /* Nm = 1.5 P psi i */
    pm_num_t t_s;    /* s: control period */
} drive_base_t;

typedef struct {
    bool ok;
    drive_param_id_t param; /* first parameter refused */
    const char *reason;     /* static text */
} drive_result_t;

#endif
