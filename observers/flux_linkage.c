#include "observers/flux_linkage.h"

#include "firmware/math/root.h"
#include "observers/flux.h"

/* x (1 - leak/2 - j turn) */
static inline pm_dq_t restored(const flux_linkage_t *self, pm_dq_t x)
{
    const int32_t loss = self->leak / 2;
    pm_dq_t y;
    y.d = pm_mulh_sub(x.d, x.d, loss) + pm_shl(pm_mulh(x.q, self->turn), 2);
    y.q = pm_mulh_sub(x.q, x.q, loss) - pm_shl(pm_mulh(x.d, self->turn), 2);
    return y;
}

/* Changes the low-pass for the same flux: psi' (1 - leak/2 - j turn) is invariant. */
static void change(flux_linkage_t *self, int32_t leak, int32_t turn)
{
    const pm_ab_t psi = self->flux.psi;
    const pm_dq_t whole = restored(self, (pm_dq_t){.d = psi.alpha, .q = psi.beta});
    self->leak = leak;
    self->turn = turn;
    const pm_q_t c = PM_ONE - pm_mulh(PM_ONE, leak / 2);
    const pm_q_t h = turn / 4;
    const pm_q_t shrink = pm_div(PM_ONE, pm_mul(c, c) + pm_mul(h, h));
    const pm_q_t re = pm_mul(c, shrink), im = pm_mul(h, shrink);
    self->flux.psi = (pm_ab_t){.alpha = pm_sat(pm_mul(whole.d, re) - pm_mul(whole.q, im), 29),
                               .beta = pm_sat(pm_mul(whole.q, re) + pm_mul(whole.d, im), 29)};
}

void flux_linkage_reset(flux_linkage_t *self, const flux_linkage_config_t *config, const obs_in_t *in)
{
    active_flux_reset(&self->flux, &config->flux, in);
    self->leak = 0;
    self->turn = 0;
}

void flux_linkage_step(flux_linkage_t *self, const flux_linkage_config_t *config, const obs_in_t *in,
                       obs_out_t *out)
{
    (void)config;
    active_flux_t *flux = &self->flux;
    const pm_ab_t past = pm_pair_ab(&flux->psi);
    pm_ab_t psi = flux_integrate(flux, in);
    psi.alpha = pm_mulh_sub(psi.alpha, past.alpha, self->leak);
    psi.beta = pm_mulh_sub(psi.beta, past.beta, self->leak);

    pm_dq_t rotor = restored(self, pm_park_half(psi, in->dir));
    rotor.d = pm_mulh_sub(rotor.d, flux->inductance, in->i_dq.d);
    rotor.q = pm_mulh_sub(rotor.q, flux->inductance, in->i_dq.q);
    const pm_dq_t back = {.d = pm_mulh(flux->reference - rotor.d, flux->k_q),
                          .q = pm_mulh(rotor.q, flux->k_q)};
    flux_keep(flux, psi, back, in->dir);
    flux->active = rotor;
    flux_describe(flux, rotor, out);
}

obs_out_t flux_linkage_last(const flux_linkage_t *self)
{
    return active_flux_last(&self->flux);
}

void flux_linkage_tie(flux_linkage_t *self, const flux_linkage_config_t *config)
{
    if (self->turn != 0) {
        change(self, 0, 0);
    }
    active_flux_tie(&self->flux, &config->flux);
}

void flux_linkage_slow(flux_linkage_t *self, const flux_linkage_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight)
{
    active_flux_slow(&self->flux, &config->flux, in, out, weight);
    if (weight == 0) {
        flux_linkage_tie(self, config);
        return;
    }
    const int32_t turn = pm_shl(in->omega < 0 ? -config->g : config->g, 2);
    const int32_t leak = pm_mul(pm_abs(in->omega), config->flux.g);
    if (turn != self->turn) {
        change(self, leak, turn);
    }
    self->leak = leak;
}
