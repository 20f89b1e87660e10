#include "observers/mras_simple.h"

#include "firmware/math/pair.h"
#include "firmware/math/root.h"

/* A signal (+-4) times 1/E in Q22, as Q24 (+-128). */
static int32_t over_emf(pm_q_t x, int32_t inverse)
{
    return pm_shl(pm_sat(pm_mulh(pm_shl(pm_sat(x, 30), 1), inverse), 26), 5);
}

static void set_operating_point(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in,
                                pm_q_t least)
{
    const observer_model_t *m = &config->model;
    self->emf = pm_mul(self->omega, observer_active_flux(m, in->i_dq));
    const int32_t inverse = mras_inverse(self->emf, least);
    self->inverse = over_emf(PM_ONE, inverse);
    self->resistive = over_emf(m->R, inverse);
    const int32_t per_change = pm_div(observer_L_q(m, in->i_dq), m->t_s); /* L_q / T_s, Q24 */
    self->reactive = pm_shl(pm_sat(pm_mulh(per_change, inverse), 25), 6);
    const pm_q_t v_q = self->emf + pm_mul(m->R, in->i_dq.q);
    self->offset = pm_mulh(pm_mulh(v_q, mras_half_turn(config, self->omega)), self->inverse);
}

void mras_simple_tie(mras_simple_t *self, const mras_simple_config_t *config)
{
    (void)config;
    self->inverse = 0; /* an imposed position gives no error signal */
    self->offset = 0;
    self->resistive = 0;
    self->reactive = 0;
}

/* The period before is assumed to be of the steady state. */
void mras_simple_reset(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in)
{
    *self = (mras_simple_t){.i = in->i, .omega = in->omega};
    set_operating_point(self, config, in, config->emf_min);
    const int32_t half_turn = mras_half_turn(config, in->omega);
    const pm_q_t v_q = self->emf + pm_mul(config->model.R, in->i_dq.q);
    self->v_d = pm_half(pm_mul(config->model.R, in->i_dq.d) + pm_mulh(v_q, half_turn));
}

static inline void describe(const mras_simple_t *self, pm_q_t eps, obs_out_t *out)
{
    out->vector = (pm_dq_t){.d = -pm_mul(eps, self->emf), .q = self->emf};
    out->eps = eps;
    out->misfit = 0;
}

/* Along the d-axis, half. */
static inline int32_t along(pm_ab_t x, pm_dir_t dir)
{
    return pm_mulh_add(pm_mulh(x.alpha, dir.cos), x.beta, dir.sin);
}

void mras_simple_step(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in,
                      obs_out_t *out)
{
    (void)config;
    const pm_ab_t past = pm_pair_ab(&self->i);
    self->i = in->i;
    const pm_ab_t change = {.alpha = in->i.alpha - past.alpha, .beta = in->i.beta - past.beta};
    const int32_t v_d = along(in->v, in->dir);
    const int32_t rise = along(change, in->dir);
    const pm_pair_t before = pm_pair(&self->v_d, &self->rise);
    self->v_d = v_d;
    self->rise = rise;
    const pm_pair_t voltage = pm_pair(&self->inverse, &self->offset);
    const pm_pair_t current = pm_pair(&self->resistive, &self->reactive);
    int32_t eps = pm_mulh_sub(voltage.second, v_d + before.first, voltage.first);
    eps = pm_mulh_add(eps, in->i_dq.d, current.first);
    eps = pm_mulh_add(eps, pm_shl(rise + before.second, 4), current.second);
    self->eps = pm_shl(pm_sat(eps, 20), PM_Q_BITS - 20);
    describe(self, self->eps, out);
}

obs_out_t mras_simple_last(const mras_simple_t *self)
{
    obs_out_t out;
    describe(self, self->eps, &out);
    return out;
}

void mras_simple_slow(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    self->omega = mras_speed(config, self->omega, in, weight);
    set_operating_point(self, config, in, mras_least(config, weight));
}
