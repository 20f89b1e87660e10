/* DC link (METHODS.md 0.2 E13):
 *
 *   C dv/dt = (v_s(t) - v)/r_source - i_dc - i_chopper
 *   v_s     = v_source + ripple sin(2 pi ripple_Hz t)
 *
 * i_dc is the current of the legs through the upper rail. A blocking source (a rectifier) takes no current
 * back, so a braking motor raises the link voltage until the chopper burns the energy: on above v_chopper_on,
 * off below v_chopper_off. Without connection the source supplies nothing. C = 0: stiff, v = v_source,
 * whatever else is set. The link cannot go below zero: the diodes of the legs then bridge it.
 * Tests: dclink_test.cpp. */
#ifndef PLANT_DCLINK_H
#define PLANT_DCLINK_H

#include "sim_plant/plant_config.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    double v_source_V;
    double g_source_S;
    double inv_C_1_F; /* 0: stiff */
    bool blocks;
    bool connected;
    bool plain; /* see dclink_plain() */
    bool chopping;
    double ripple_V, ripple_rad_s;
    double g_chopper_S; /* 0: none */
    double v_chopper_on_V, v_chopper_off_V;
} dclink_t;

void dclink_init(dclink_t *link, const plant_dclink_t *parameters);

/* Neither ripple nor chopper: nothing to watch, and time does not matter. */
static inline bool dclink_plain(const dclink_t *link)
{
    return link->plain;
}

/* Ripple at t_s since the start. */
double dclink_ripple_V(const dclink_t *link, double t_s);

static inline double dclink_fed_A(const dclink_t *link, double v_source_V, double v_dc_V)
{
    double i_source_A = (v_source_V - v_dc_V) * link->g_source_S;
    return !link->connected || (link->blocks && i_source_A < 0.0) ? 0.0 : i_source_A;
}

/* Current of the source; 0 for a stiff link, whose source gives just what the legs draw. */
static inline double dclink_source_A(const dclink_t *link, double v_dc_V, double t_s)
{
    double v_source_V = link->v_source_V;
    if (link->ripple_V != 0.0) {
        v_source_V += dclink_ripple_V(link, t_s);
    }
    return dclink_fed_A(link, v_source_V, v_dc_V);
}

static inline double dclink_chopper_A(const dclink_t *link, double v_dc_V)
{
    return link->chopping ? v_dc_V * link->g_chopper_S : 0.0;
}

static inline double dclink_rate(const dclink_t *link, double v_dc_V, double i_dc_A, double t_s)
{
    double i_C_A = dclink_source_A(link, v_dc_V, t_s) - i_dc_A - dclink_chopper_A(link, v_dc_V);
    double rate_V_s = i_C_A * link->inv_C_1_F;
    return v_dc_V <= 0.0 && rate_V_s < 0.0 ? 0.0 : rate_V_s;
}

/* The same of a plain link. */
static inline double dclink_plain_rate(const dclink_t *link, double v_dc_V, double i_dc_A)
{
    double rate_V_s = (dclink_fed_A(link, link->v_source_V, v_dc_V) - i_dc_A) * link->inv_C_1_F;
    return v_dc_V <= 0.0 && rate_V_s < 0.0 ? 0.0 : rate_V_s;
}

/* Above zero once the chopper should toggle, relative to the threshold; dclink_settle() then does it. */
double dclink_excess(const dclink_t *link, double v_dc_V);
void dclink_settle(dclink_t *link, double v_dc_V);

#ifdef __cplusplus
}
#endif

#endif
