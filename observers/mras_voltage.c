#include "observers/mras_voltage.h"

#include "firmware/math/pair.h"
#include "firmware/math/root.h"

#define ONE_Q24 PM_FRAC(1.0 / 256)

static void set_operating_point(mras_voltage_t *self, const mras_voltage_config_t *config, const obs_in_t *in,
                                pm_q_t least)
{
    const observer_model_t *m = &config->model;
    const pm_q_t psi_a = pm_max(observer_active_flux(m, in->i_dq), PM_Q(1.0 / 128));
    self->drop = m->R / 32;
    self->rise = pm_div(m->L_d, m->t_s); /* a Q28 over a Q32 that is read as Q28: in Q24 */
    self->cross = mras_cross(config, self->omega_f, in->i_dq) / 32;
    self->half = mras_half_turn(config, in->omega);
    self->psi = psi_a / 32;
    self->adapt = pm_min(pm_div(config->k / 16, psi_a), PM_ONE); /* D_q is clamped to 2: no step above 2 */
    self->inverse = mras_inverse(pm_mul(self->omega, psi_a), least);
    self->omega_loop = in->omega;
    self->inverse_omega = mras_inverse(in->omega, least);
}

void mras_voltage_tie(mras_voltage_t *self, const mras_voltage_config_t *config)
{
    (void)config;
    self->adapt = 0;
    self->inverse = 0; /* an imposed position gives no error signal */
    self->inverse_omega = 0;
}

void mras_voltage_reset(mras_voltage_t *self, const mras_voltage_config_t *config, const obs_in_t *in)
{
    *self = (mras_voltage_t){.i = in->i, .omega = in->omega, .omega_f = in->omega};
    set_operating_point(self, config, in, config->emf_min);
    self->adapt = 0;
}

static inline void describe(const mras_voltage_t *self, pm_dq_t difference, obs_out_t *out)
{
    const pm_q_t emf = pm_shl(pm_mulh(self->omega, self->psi), 9);
    out->vector = (pm_dq_t){.d = difference.d, .q = difference.q + emf};
    out->eps = mras_relative(pm_shl(-difference.d, 2), self->inverse);
    out->misfit = mras_relative(pm_shl(pm_sat(self->omega_loop - self->omega, 29), 2), self->inverse_omega);
}

void mras_voltage_step(mras_voltage_t *self, const mras_voltage_config_t *config, const obs_in_t *in,
                       obs_out_t *out)
{
    (void)config;
    const pm_ab_t past = pm_pair_ab(&self->i);
    self->i = in->i;
    const pm_pair_t model = pm_pair(&self->drop, &self->rise);
    pm_ab_t e = {.alpha = pm_mulh(in->v.alpha, ONE_Q24), .beta = pm_mulh(in->v.beta, ONE_Q24)};
    e.alpha = pm_mulh_sub(e.alpha, in->i.alpha + past.alpha, model.first);
    e.alpha = pm_mulh_sub(e.alpha, in->i.alpha - past.alpha, model.second);
    e.beta = pm_mulh_sub(e.beta, in->i.beta + past.beta, model.first);
    e.beta = pm_mulh_sub(e.beta, in->i.beta - past.beta, model.second);

    const pm_pair_t turning = pm_pair(&self->cross, &self->half);
    pm_dq_t d = mras_middle(pm_park_half(e, in->dir), turning.second); /* Q19 */
    d.d = pm_mulh_add(d.d, in->i_dq.q, turning.first);
    d.q = pm_mulh_sub(pm_mulh_sub(d.q, in->i_dq.d, turning.first), self->omega, self->psi);
    const int32_t sum = d.d + self->difference_d;
    self->difference_d = d.d;
    const pm_dq_t held = {.d = pm_shl(pm_sat(sum, 21), 8), .q = pm_shl(pm_sat(d.q, 20), 9)};
    describe(self, held, out);
    self->omega = pm_sat(self->omega + pm_shl(pm_mulh(pm_shl(held.q, 2), self->adapt), 2), 30);
    self->last = *out;
}

obs_out_t mras_voltage_last(const mras_voltage_t *self)
{
    return self->last;
}

void mras_voltage_slow(mras_voltage_t *self, const mras_voltage_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    self->omega_f = mras_speed(config, self->omega_f, in, weight);
    if (weight == 0) {
        self->omega = in->omega;
    }
    set_operating_point(self, config, in, mras_least(config, weight));
    if (weight == 0) {
        self->adapt = 0;
    }
}
