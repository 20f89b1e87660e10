#include "firmware/drive/procedures/zero_inductance.h"
#include "firmware/params/maker.h"

#if PM_HAS(zero_inductance)

#define PERIODS 20
#define OMEGA   pm_num(31) /* 5 Hz: slower than the rotor swings, so that its EMF damps it */

/* (re + j im) (1 - x q) with q = e^{-j 2 pi / 20} */
static void turn(pm_num_t *re, pm_num_t *im, pm_num_t x)
{
    const pm_num_t cos = pm_num_ratio(951056516, 1000000000);
    const pm_num_t sin = pm_num_ratio(309016994, 1000000000);
    const pm_num_t c = pm_num_sub(pm_num(1), pm_num_mul(x, cos));
    const pm_num_t s = pm_num_mul(x, sin);
    const pm_num_t real = pm_num_sub(pm_num_mul(*re, c), pm_num_mul(*im, s));
    *im = pm_num_add(pm_num_mul(*re, s), pm_num_mul(*im, c));
    *re = real;
}

/* With more, saliency turns the rotor off the axis of the current. */
static pm_q_t most_current(maker_t *m)
{
    const pm_num_t twice = pm_num_mul(pm_num(2), pm_num_sub(si(m, DRIVE_PARAM_L_q), si(m, DRIVE_PARAM_L_d)));
    const pm_num_t i_max = si(m, DRIVE_PARAM_i_max);
    const pm_num_t psi_m = si(m, DRIVE_PARAM_psi_m);
    const bool bound = pm_num_cmp(psi_m, pm_num_mul(i_max, twice)) < 0;
    return fixed(m, pm_num_div(bound ? pm_num_div(psi_m, twice) : i_max, m->base.i), Q_BITS,
                 DRIVE_PARAM_i_max);
}

/* 1 / (1 - q) = 1/2 - j / (2 tan(pi / 20)) */
void make_zero_inductance(maker_t *m, zero_inductance_config_t *c, pm_frac_t decay)
{
    const pm_angle_t step = UINT32_MAX / (uint32_t)PERIODS;
    c->sine = (sine_config_t){.v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v),
                              .per_n = PM_FRAC(1.0 / PERIODS),
                              .step = step,
                              .lag = 3U * (step / 2U) + PM_TURN(0.25),
                              .n = (uint16_t)PERIODS};
    c->i_most = most_current(m);
    c->omega = fixed(m, pm_num_div(OMEGA, m->base.omega), Q_BITS, DRIVE_PARAM_speed_trip);
    const pm_num_t a = pm_num_from_fixed(decay, 31);
    const pm_num_t scale = pm_num_div(mul3(pm_num(2), m->base.t_s, m->base.omega), pm_num_sub(pm_num(1), a));
    pm_num_t re = pm_num_mul(scale, pm_num_ratio(1, 2));
    pm_num_t im = pm_num_neg(pm_num_mul(scale, pm_num_ratio(315687576, 100000000)));
    turn(&re, &im, a);
    c->k = (pm_dq_t){fixed(m, re, Q_BITS, DRIVE_PARAM_neutral_filter),
                     fixed(m, im, Q_BITS, DRIVE_PARAM_neutral_filter)};
    const pm_num_t cotangent = pm_num_ratio(631375151, 100000000);
    c->rho = fixed(m, mul3(pm_num_mul(m->base.t_s, m->base.omega), cotangent, pm_num_ratio(1, 2)), Q_BITS,
                   DRIVE_PARAM_f_pwm);
}

#endif
