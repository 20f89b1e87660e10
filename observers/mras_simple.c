#include "observers/mras_simple.h"

#include "firmware/math/pair.h"

/* A signal (+-4) times 1/E in Q22, as Q24 (+-128). */
static int32_t over_emf(pm_q_t x, int32_t inverse)
{
    return pm_shl(pm_sat(pm_mulh(pm_shl(pm_sat(x, 30), 1), inverse), 26), 5);
}

/* How far the steady v_q leans into v_d of the frame at the end of a period. */
static pm_q_t lean(const mras_simple_t *self, const mras_simple_config_t *config, pm_dq_t i)
{
    const observer_model_t *m = &config->model;
    const pm_q_t v_q = pm_mul(self->omega, m->psi_m + pm_mul(m->L_d, i.d)) + pm_mul(m->R, i.q);
    return pm_mulh(v_q, mras_half_turn(config, self->omega));
}

static void set_operating_point(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in)
{
    const observer_model_t *m = &config->model;
    const pm_q_t reactance = pm_mul_sat(self->omega, observer_L_q(m, in->i_dq.q));
    self->emf = pm_mul(self->omega, observer_active_flux(m, in->i_dq.d));
    const int32_t inverse = mras_inverse(config, self->emf);
    self->inverse = over_emf(PM_ONE, inverse);
    self->resistive = over_emf(m->R, inverse);
    self->reactive = over_emf(reactance, inverse);
    self->offset = pm_mulh(lean(self, config, in->i_dq), self->inverse);
}

void mras_simple_tie(mras_simple_t *self, const mras_simple_config_t *config)
{
    (void)self;
    (void)config;
}

void mras_simple_reset(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in)
{
    *self = (mras_simple_t){.omega = in->omega};
    set_operating_point(self, config, in);
    /* v_d of the steady state, so that the first mean is one */
    const observer_model_t *m = &config->model;
    const pm_q_t reactance = pm_mul(in->omega, observer_L_q(m, in->i_dq.q));
    const pm_q_t v_d =
        pm_mul(m->R, in->i_dq.d) - pm_mul(reactance, in->i_dq.q) + lean(self, config, in->i_dq);
    self->v_d = pm_half(v_d);
}

static inline void describe(const mras_simple_t *self, pm_q_t eps, obs_out_t *out)
{
    out->vector = (pm_dq_t){.d = -pm_mul(eps, self->emf), .q = self->emf};
    out->eps = eps;
    out->misfit = 0;
}

void mras_simple_step(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in,
                      obs_out_t *out)
{
    (void)config;
    const int32_t v_d = pm_mulh_add(pm_mulh(in->v.alpha, in->dir.cos), in->v.beta, in->dir.sin); /* Q27 */
    const pm_pair_t current = pm_pair(&self->resistive, &self->reactive);
    const pm_pair_t voltage = pm_pair(&self->inverse, &self->offset);
    int32_t eps = pm_mulh_sub(voltage.second, v_d + self->v_d, voltage.first);
    eps = pm_mulh_add(eps, in->i_dq.d, current.first);
    eps = pm_mulh_sub(eps, in->i_dq.q, current.second);
    self->v_d = v_d;
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
    set_operating_point(self, config, in);
}
