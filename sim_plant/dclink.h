/* DC link: C dv/dt = (v_source - v)/r_source - i_dc (METHODS.md 0.2 E13).
 *
 * i_dc is what the legs draw through the upper rail. A blocking source (a rectifier) takes no current
 * back, so a braking motor lifts the link. C = 0: stiff, v = v_source. The link cannot go below zero: the
 * diodes of the legs then bridge it. Tests: dclink_test.cpp. */
#ifndef PLANT_DCLINK_H
#define PLANT_DCLINK_H

#include "sim_plant/plant.h"

typedef struct {
    double v_source_V;
    double g_source_S;
    double inv_C_1_F; /* 0: stiff */
    bool blocks;
} dclink_t;

void dclink_init(dclink_t *link, const plant_dclink_t *parameters);

static inline double dclink_rate(const dclink_t *link, double v_dc_V, double i_dc_A)
{
    double i_source_A = (link->v_source_V - v_dc_V) * link->g_source_S;
    if (link->blocks && i_source_A < 0.0) {
        i_source_A = 0.0;
    }
    double rate_V_s = (i_source_A - i_dc_A) * link->inv_C_1_F;
    return v_dc_V <= 0.0 && rate_V_s < 0.0 ? 0.0 : rate_V_s;
}

#endif
