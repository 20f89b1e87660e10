#include "firmware/drive/procedures/saliency_map.h"
#include "firmware/params/maker.h"

#define PERIODS 20
#define OMEGA   pm_num(188)

/* F = V_h T_s / (2 sin(pi / 20)) */
void make_saliency_map(maker_t *m, saliency_map_config_t *c)
{
    const pm_num_t step = pm_num_mul(si(m, DRIVE_PARAM_v_injection), m->base.t_s);
    const pm_num_t flux = pm_num_mul(step, pm_num_ratio(3196227, 1000000));
    const pm_angle_t a = UINT32_MAX / (uint32_t)PERIODS;
    c->sine = (sine_config_t){.v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v),
                              .per_n = PM_FRAC(1.0 / PERIODS),
                              .step = a,
                              .lag = 3U * (a / 2U) + PM_TURN(0.25),
                              .n = (uint16_t)PERIODS};
    c->flux = fixed(m, pm_num_div(flux, m->base.psi), Q_BITS, DRIVE_PARAM_v_injection);
    c->omega = fixed(m, pm_num_div(OMEGA, m->base.omega), Q_BITS, DRIVE_PARAM_speed_trip);
    c->turn = UINT32_MAX / ((uint32_t)SALIENCY_CIRCLE_AXES * m->slow_divider);
    c->since =
        c->turn * (uint32_t)(PERIODS + 4) / 2U; /* half a window, 1.5 periods, and it is that of the next */
    c->best = m->params->mtpa != 0;
    c->reversed = m->params->L_d_falls != 0;
}
