#include "observers/mras_current.h"

#include "firmware/math/pair.h"
#include "firmware/math/root.h"

#define ONE_Q30 PM_FRAC(0.25)

static void set_operating_point(mras_current_t *self, const mras_current_config_t *config, const obs_in_t *in,
                                pm_q_t least)
{
    const observer_model_t *m = &config->model;
    const pm_q_t rise = pm_div(m->t_s / 16, m->L_d); /* T_s / L_d */
    const pm_q_t r = pm_mul_sat(rise, m->R) / 2;
    const pm_q_t b = pm_div(rise, PM_ONE + r);
    self->keep = pm_shl(pm_sat(pm_div(PM_ONE - r, PM_ONE + r), PM_Q_BITS), 2);
    self->drive = pm_shl(pm_sat(b, PM_Q_BITS + 1), 2);
    self->response = self->drive / 2;
    self->cross =
        pm_shl(pm_sat(pm_mul_sat(b, mras_cross(config, self->omega_f, in->i_dq)), PM_Q_BITS + 2), 1);
    self->half = mras_half_turn(config, in->omega);
    self->emf_per_change = pm_div(PM_ONE / 16, b); /* Q28 of a sixteenth is Q24 */
    self->adapt = pm_shl(pm_sat(pm_mulh(self->emf_per_change, config->k), 26), 4); /* < 4 */
    self->emf_model = pm_mul(in->omega, observer_active_flux(m, in->i_dq));
    self->inverse_model = mras_inverse(self->emf_model, least);
    self->inverse = mras_inverse(self->emf, least);
}

void mras_current_tie(mras_current_t *self, const mras_current_config_t *config)
{
    (void)config;
    self->adapt = 0;
    self->inverse = 0; /* an imposed position gives no error signal */
    self->inverse_model = 0;
}

void mras_current_reset(mras_current_t *self, const mras_current_config_t *config, const obs_in_t *in)
{
    *self = (mras_current_t){.i = in->i, .omega_f = in->omega};
    self->emf = pm_mul(in->omega, observer_active_flux(&config->model, in->i_dq));
    set_operating_point(self, config, in, config->emf_min);
    self->adapt = 0;
}

static inline void describe(const mras_current_t *self, pm_dq_t change, obs_out_t *out)
{
    /* Q24, clamped to +-2 and +-4 */
    const int32_t e_d = pm_sat(pm_mulh(change.d, self->emf_per_change), 25);
    const int32_t e_q = pm_sat(pm_mulh(change.q, self->emf_per_change), 26);
    out->vector = (pm_dq_t){.d = pm_shl(-e_d, 4), .q = pm_sat(self->emf - pm_shl(e_q, 4), 30)};
    out->eps = mras_relative(pm_shl(e_d, 6), self->inverse);
    out->misfit = mras_relative(pm_shl(pm_sat(self->emf_model - self->emf, 29), 2), self->inverse_model);
}

void mras_current_step(mras_current_t *self, const mras_current_config_t *config, const obs_in_t *in,
                       obs_out_t *out)
{
    (void)config;
    const pm_ab_t past = pm_pair_ab(&self->i);
    self->i = in->i;
    const pm_pair_t predict = pm_pair(&self->keep, &self->drive);
    const pm_ab_t stationary = {
        .alpha = pm_mulh_sub(pm_mulh_sub(pm_mulh(in->i.alpha, ONE_Q30), past.alpha, predict.first),
                             in->v.alpha, predict.second),
        .beta = pm_mulh_sub(pm_mulh_sub(pm_mulh(in->i.beta, ONE_Q30), past.beta, predict.first), in->v.beta,
                            predict.second),
    };
    const pm_pair_t turning = pm_pair(&self->cross, &self->half);
    pm_dq_t change = mras_middle(pm_park_half(stationary, in->dir), turning.second); /* Q25 */
    change.d = pm_mulh_sub(change.d, in->i_dq.q, turning.first);
    change.q = pm_mulh_add(pm_mulh_add(change.q, in->i_dq.d, turning.first), self->emf, self->response);
    const int32_t d = change.d + self->change_d;
    self->change_d = change.d;
    change.d = pm_shl(pm_sat(d, 25), 6); /* the mean of two */
    change.q = pm_shl(pm_sat(change.q, 24), 7);
    describe(self, change, out);
    self->emf = pm_sat(pm_mulh_sub(self->emf, change.q, self->adapt), 30);
    self->last = *out;
}

obs_out_t mras_current_last(const mras_current_t *self)
{
    return self->last;
}

void mras_current_slow(mras_current_t *self, const mras_current_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    self->omega_f = mras_speed(config, self->omega_f, in, weight);
    if (weight == 0) {
        self->emf = pm_mul(in->omega, observer_active_flux(&config->model, in->i_dq));
    }
    set_operating_point(self, config, in, mras_least(config, weight));
    if (weight == 0) {
        self->adapt = 0;
    }
}
