#include "observers/active_flux.h"

#include "firmware/math/root.h"

/* psi_ref stays within this share of the amplitude that the parameters give. */
#define BAND PM_Q(0.5)

static void set_reference(active_flux_t *self, pm_q_t psi)
{
    self->psi_ref = psi;
    self->inverse = pm_div(PM_ONE / 4, psi); /* Q28 of a quarter is Q26 */
}

static inline pm_q_t inductance_q(const active_flux_config_t *config, pm_q_t i_q)
{
    return config->L_q + pm_mul(config->L_q2, pm_mul(i_q, i_q));
}

static pm_q_t nominal(const active_flux_config_t *config, pm_q_t i_d)
{
    return config->psi_m + pm_mul(config->L_d - config->L_q, i_d);
}

void active_flux_reset(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in)
{
    set_reference(self, nominal(config, in->i_dq.d));
    const pm_q_t L_q = inductance_q(config, in->i_dq.q);
    const pm_dq_t psi = {.d = self->psi_ref + pm_mul(L_q, in->i_dq.d), .q = pm_mul(L_q, in->i_dq.q)};
    self->psi = pm_park_inverse(psi, in->dir);
    self->R = config->R;
    self->i = in->i;
    self->k_seed = config->k_seed;
}

void active_flux_step(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in,
                      obs_out_t *out)
{
    const pm_ab_t i_mean = {.alpha = pm_mean(in->i.alpha, self->i.alpha),
                            .beta = pm_mean(in->i.beta, self->i.beta)};
    /* saturating: with the position lost, a voltage at standstill drives the flux up until the fault */
    self->psi.alpha =
        pm_add_sat(self->psi.alpha, pm_frac(in->v.alpha - pm_mul(self->R, i_mean.alpha), config->t_s));
    self->psi.beta =
        pm_add_sat(self->psi.beta, pm_frac(in->v.beta - pm_mul(self->R, i_mean.beta), config->t_s));
    self->i = in->i;

    const pm_dq_t psi = pm_park(self->psi, in->dir);
    const pm_q_t L_q = inductance_q(config, in->i_dq.q);
    const pm_dq_t active = {.d = psi.d - pm_mul(L_q, in->i_dq.d), .q = psi.q - pm_mul(L_q, in->i_dq.q)};
    const pm_q_t error_d = pm_sub_sat(self->psi_ref, active.d);

    const pm_frac_t k_d = pm_shl(pm_mulh(pm_abs(in->omega), config->g), 32 - PM_Q_BITS) + self->k_seed;
    const pm_ab_t correction = pm_park_inverse(
        (pm_dq_t){.d = pm_frac(error_d, k_d), .q = -pm_frac(active.q, self->k_seed)}, in->dir);
    self->psi.alpha = pm_add_sat(self->psi.alpha, correction.alpha);
    self->psi.beta = pm_add_sat(self->psi.beta, correction.beta);

    out->vector = active;
    out->eps = pm_gain_unit(active.q, self->inverse);
    out->misfit = pm_gain_unit(error_d, self->inverse);
}

static void follow_resistance(active_flux_t *self, const active_flux_config_t *config, pm_q_t psi_q,
                              pm_q_t i_q)
{
    const pm_q_t change = pm_narrow(pm_gain(pm_mul(psi_q, i_q), config->k_R));
    self->R = pm_clamp(self->R + change, config->R_min, config->R_max);
}

void active_flux_slow(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight)
{
    const pm_q_t centre = nominal(config, in->i_dq.d);
    if (weight == 0) {
        /* tied to the position, the flux says nothing of the amplitude */
        self->k_seed = config->k_seed;
        set_reference(self, centre);
        if (pm_abs(in->omega) < config->omega_R) {
            follow_resistance(self, config, out->vector.q, in->i_dq.q);
        }
    } else {
        const pm_q_t band = pm_mul(centre, BAND);
        const pm_q_t psi = self->psi_ref + pm_frac(out->vector.d - self->psi_ref, config->k_adapt);
        self->k_seed = 0;
        set_reference(self, pm_clamp(psi, centre - band, centre + band));
    }
}
