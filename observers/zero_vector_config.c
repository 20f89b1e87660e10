#include "observers/zero_vector.h"

#include "observers/model_config.h"

#define STEPS     4    /* of the converter, of the least change of current between the two samples */
#define CONVERTER 2048 /* steps of half its range */

/* Distance 2x of the samples at a voltage, as a share of the period: zero_vector.h. */
static pm_num_t distance(const maker_t *m, const zero_vector_config_t *c, pm_num_t v)
{
    const pm_num_t used = pm_num_div(pm_num_mul(pm_num_sqrt(pm_num(3)), v), si(m, DRIVE_PARAM_v_dc_nominal));
    const pm_num_t zero = pm_num_mul(pm_num_ratio(1, 2), pm_num_sub(pm_num(1), used));
    const int32_t counts = c->counts;
    return pm_num_sub(zero, pm_num_ratio((int32_t)c->guard + counts / 128, counts));
}

static pm_num_t emf_at(const maker_t *m, drive_param_id_t speed)
{
    return mul3(si(m, speed), pole_pairs(m), si(m, DRIVE_PARAM_psi_m));
}

/* Four steps of the converter at the speed from which the observer leads alone. */
static void require_steps(maker_t *m, const zero_vector_config_t *c)
{
    const pm_num_t emf = emf_at(m, DRIVE_PARAM_speed_high);
    const pm_num_t time = pm_num_mul(distance(m, c, emf), m->base.t_s);
    const pm_num_t change = pm_num_div(pm_num_mul(emf, time), si(m, DRIVE_PARAM_L_q));
    const pm_num_t steps = pm_num_mul(pm_num_ratio(STEPS, CONVERTER), m->base.i);
    if (pm_num_cmp(change, steps) < 0) {
        refuse(m, DRIVE_PARAM_observer,
               "at speed_high sees less than four steps of the current within a zero vector");
    }
}

static void require_room(maker_t *m, const zero_vector_config_t *c)
{
    const pm_num_t i = si(m, DRIVE_PARAM_i_rated);
    const pm_num_t v_q = pm_num_add(emf_at(m, DRIVE_PARAM_speed_max), pm_num_mul(si(m, DRIVE_PARAM_R_s), i));
    const pm_num_t omega = pm_num_mul(si(m, DRIVE_PARAM_speed_max), pole_pairs(m));
    const pm_num_t v_d = mul3(omega, si(m, DRIVE_PARAM_L_q), i);
    const pm_num_t v = pm_num_sqrt(pm_num_add(square(v_q), square(v_d)));
    if (pm_num_cmp(distance(m, c, v), pm_num_ratio(1, 12)) < 0) {
        refuse(m, DRIVE_PARAM_observer, "at speed_max has no zero vector to take two samples in");
    }
}

static uint16_t counts_of(maker_t *m, pm_num_t time)
{
    const pm_num_t per_period = pm_num_div(pm_num(2 * m->params->timer_counts), m->base.t_s);
    return (uint16_t)fixed(m, pm_num_mul(time, per_period), 0, DRIVE_PARAM_dead_time);
}

void make_zero_vector(maker_t *m, zero_vector_config_t *c)
{
    const pm_num_t dead = si(m, DRIVE_PARAM_dead_time);
    make_emf(m, &c->emf);
    c->emf.k_filter = 2 * pm_min(c->emf.k_filter, PM_FRAC(0.245)); /* a step in every second period */
    c->emf.resistance.k = 0;
    const pm_num_t saliency = pm_num_div(si(m, DRIVE_PARAM_L_q), si(m, DRIVE_PARAM_L_d));
    c->saliency = fixed(m, saliency, Q_BITS, DRIVE_PARAM_L_d);
    const pm_num_t psi = pm_num_div(si(m, DRIVE_PARAM_psi_m), pm_num_mul(saliency, m->base.psi));
    c->emf.model.psi_m = fixed(m, psi, Q_BITS, DRIVE_PARAM_psi_m);
    c->counts = (uint16_t)m->params->timer_counts;
    c->guard = counts_of(m, pm_num_add(dead, si(m, DRIVE_PARAM_t_settle)));
    c->later = counts_of(m, pm_num_mul(pm_num_ratio(1, 2), dead));
    c->v_dc = per_unit(m, DRIVE_PARAM_v_dc_nominal, m->base.v);
    c->lambda = 0;
    if (m->params->cross_coupling_comp != 0) {
        const pm_num_t rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
        const pm_num_t share = pm_num_div(si(m, DRIVE_PARAM_L_dqh_rated), si(m, DRIVE_PARAM_L_qh_rated));
        c->lambda = fixed(m, pm_num_div(share, rated), Q_BITS, DRIVE_PARAM_L_dqh_rated);
    }
    require_steps(m, c);
    require_room(m, c);
}
