#include "observers/emf.h"

#include "observers/model_config.h"

/* The EMF contains the loop's speed, whose ripple R must not follow: 64 ms. */
#define FOLLOW pm_num_ratio(1, 64)

/* lag: (2 - k) / k, k = w T / (1 + w T). */
static void make_emf_filter(maker_t *m, emf_config_t *c)
{
    const pm_num_t w = pm_num_mul(angular(m, DRIVE_PARAM_emf_bandwidth), m->base.t_s);
    const pm_num_t k = pm_num_div(w, pm_num_add(pm_num(1), w));
    c->k_filter = gain(m, k, FRAC_BITS, DRIVE_PARAM_emf_bandwidth);
    c->lag = fixed(m, pm_num_div(pm_num_sub(pm_num(2), k), k), GAIN_BITS, DRIVE_PARAM_emf_bandwidth);
}

/* Of a period, of a slow step, of the loop: 2 zeta / w_n. */
static void make_emf_rates(maker_t *m, emf_config_t *c)
{
    const pm_num_t period = pm_num_mul(m->base.t_s, m->base.omega);
    const pm_num_t slow = pm_num_mul(m->t_slow, m->base.omega);
    const pm_num_t loop = pm_num_mul(angular(m, DRIVE_PARAM_injection_bandwidth), m->t_slow);
    c->rate = fixed(m, pm_num_div(pm_num(1), period), SMALL_BITS, DRIVE_PARAM_f_pwm);
    c->slow_rate = fixed(m, least(pm_num_div(pm_num(1), slow), pm_num(31)), GAIN_BITS, DRIVE_PARAM_f_pwm);
    c->slow_step = fixed(m, slow, Q_BITS, DRIVE_PARAM_speed_trip);
    c->speed_lag = fixed(m, least(pm_num_div(pm_num_ratio(9, 5), loop), pm_num(31)), GAIN_BITS,
                         DRIVE_PARAM_injection_bandwidth);
}

void make_emf(maker_t *m, emf_config_t *c)
{
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    make_model(m, &c->model);
    make_resistance(m, &c->resistance, pm_num_div(FOLLOW, square(i_rated)));
    make_emf_filter(m, c);
    make_emf_rates(m, c);
    c->omega_min = speed(m, DRIVE_PARAM_speed_low) / 2;
    c->omega_tied =
        fixed(m, least(pm_num_div(OBSERVER_TIE, m->base.omega), pm_num(1)), Q_BITS, DRIVE_PARAM_speed_trip);
}
