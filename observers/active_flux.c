#include "observers/active_flux.h"

#include "firmware/math/root.h"
#include "observers/flux.h"

/* To the formats of the state: Q28 to Q29, to Q30, Q32 to Q34. */
static int32_t to_inductance(pm_q_t L)
{
    return pm_shl(pm_sat(L, PM_Q_BITS + 2), 1);
}

static int32_t to_drop(pm_q_t R_t)
{
    return pm_shl(pm_sat(R_t, PM_Q_BITS + 1), 2);
}

static int32_t to_feedback(pm_frac_t k)
{
    return pm_shl(pm_sat(k, 29), 2);
}

static void set_reference(active_flux_t *self, pm_q_t psi)
{
    self->psi_ref = psi;
    self->reference = pm_frac(psi, PM_FRAC(0.125)); /* Q28 to Q25 */
    self->inverse = pm_div(PM_ONE / 4, psi);        /* Q28 of a quarter is Q26 */
}

/* Terms that depend on current, speed and temperature, which change little within a millisecond. */
static void set_operating_point(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in)
{
    const pm_q_t L_q = observer_L_q(&config->model, in->i_dq);
    self->drop = to_drop(pm_frac(self->R, config->model.t_s));
    self->inductance = pm_add_sat(to_inductance(L_q), self->drop / 4); /* R T_s / 2 */
    self->k_d = pm_add_sat(to_feedback(pm_mul(pm_abs(in->omega), config->g)), self->k_q);
}

/* Also between two slow steps, which renew k_d. */
void active_flux_tie(active_flux_t *self, const active_flux_config_t *config)
{
    const int32_t k_q = to_feedback(config->k_seed);
    self->k_d = pm_add_sat(self->k_d - self->k_q, k_q);
    self->k_q = k_q;
    self->k_t = 0;
}

/* The observer leads. */
static void untie(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in)
{
    const pm_q_t load = flux_relative(self, pm_mulh(self->inductance, in->i_dq.q));
    const pm_q_t half = pm_clamp(in->omega < 0 ? -load : load, -PM_ONE / 4, PM_ONE / 2);
    const pm_q_t turn = config->g == 0 ? 0 : pm_mul(in->omega, half) * 2;
    self->k_q = 0;
    self->k_t = to_feedback(pm_mul(turn, config->model.t_s));
}

void active_flux_reset(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in)
{
    self->R = config->model.R;
    self->step = config->model.t_s / 4;
    self->psi_a = observer_active_flux(&config->model, in->i_dq);
    set_reference(self, self->psi_a);
    self->k_d = 0;
    self->k_q = 0;
    active_flux_tie(self, config);
    set_operating_point(self, config, in);
    const pm_dq_t drawn = {.d = pm_mulh(self->inductance, in->i_dq.d),
                           .q = pm_mulh(self->inductance, in->i_dq.q)};
    /* Q25, and Q26 by the factor two of the transform */
    const pm_dq_t psi = {.d = pm_shl(self->reference + drawn.d, 1), .q = pm_shl(drawn.q, 1)};
    self->psi = pm_park_inverse(psi, in->dir);
    self->active = (pm_dq_t){.d = self->reference, .q = 0};
    self->i = in->i;
}

void active_flux_step(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in,
                      obs_out_t *out)
{
    (void)config;
    const pm_ab_t psi = flux_integrate(self, in);
    pm_dq_t active = pm_park_half(psi, in->dir);
    const pm_pair_t model = pm_pair(&self->inductance, &self->reference);
    active.d = pm_mulh_sub(active.d, model.first, in->i_dq.d);
    active.q = pm_mulh_sub(active.q, model.first, in->i_dq.q);

    const int32_t lack = model.second - active.d;
    const pm_pair_t k = pm_pair(&self->k_q, &self->k_t);
    pm_dq_t back;
    back.q = pm_mulh_sub(pm_mulh(active.q, k.first), lack, k.second);
    back.d = pm_mulh(lack, self->k_d);
    flux_keep(self, psi, back, in->dir);
    self->active = active;
    flux_describe(self, active, out);
}

obs_out_t active_flux_last(const active_flux_t *self)
{
    obs_out_t out;
    flux_describe(self, self->active, &out);
    return out;
}

void active_flux_slow(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight)
{
    pm_q_t psi;
    if (weight == 0) {
        /* while tied to the position, the flux gives no amplitude */
        active_flux_tie(self, config);
        psi = observer_active_flux(&config->model, in->i_dq);
        self->psi_a = psi;
        self->R = observer_resistance(&config->resistance, &config->model, self->R, in->omega, out->vector.q,
                                      in->i_dq.q);
    } else {
        untie(self, config, in);
        const pm_q_t lack = pm_sub_sat(self->psi_ref, out->vector.d);
        psi = observer_amplitude(&config->model, in->i_dq, self->psi_ref, lack, &self->psi_a);
    }
    set_reference(self, psi);
    set_operating_point(self, config, in);
}
