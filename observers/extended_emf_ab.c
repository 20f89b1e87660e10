#include "observers/extended_emf_ab.h"

#include "firmware/math/root.h"

/* Without w (L_q - L_d) J i; `sum`: current at both ends, added. */
static inline pm_ab_t without_saliency(const emf_t *emf, pm_ab_t change, pm_ab_t sum)
{
    pm_ab_t r;
    r.alpha = pm_mulh_add(change.alpha, sum.beta, emf->cross);
    r.beta = pm_mulh_sub(change.beta, sum.alpha, emf->cross);
    return r;
}

void extended_emf_ab_reset(extended_emf_ab_t *self, const extended_emf_ab_config_t *config,
                           const obs_in_t *in)
{
    emf_t *emf = &self->emf;
    const emf_machine_t machine = emf_salient(config, in, config->lag);
    emf_reset(emf, config, &machine, in);
    const pm_ab_t twice = {.alpha = pm_shl(in->i.alpha, 1), .beta = pm_shl(in->i.beta, 1)};
    emf->change = without_saliency(emf, emf->change, twice);
    /* the value that emf_turned() turns into the EMF of the reset: e (1 - j t) / (1 + t^2) */
    const pm_q_t t = emf->turn / 4;
    const pm_q_t shrink = pm_div(PM_ONE, PM_ONE + pm_mul(t, t));
    const pm_q_t q = pm_mul(emf->e.q, shrink);
    self->e = pm_park_inverse((pm_dq_t){.d = pm_mul(q, t), .q = q}, in->dir);
    self->e = (pm_ab_t){.alpha = pm_shl(self->e.alpha, 1), .beta = pm_shl(self->e.beta, 1)};
}

void extended_emf_ab_step(extended_emf_ab_t *self, const extended_emf_ab_config_t *config, const obs_in_t *in,
                          obs_out_t *out)
{
    emf_t *emf = &self->emf;
    pm_ab_t sum;
    const pm_ab_t change = emf_change(emf, in, &sum);
    const pm_ab_t twice = emf_pair(emf, without_saliency(emf, change, sum));
    const pm_ab_t new = {.alpha = pm_shl(pm_sat(twice.alpha, 26), 3),
                         .beta = pm_shl(pm_sat(twice.beta, 26), 3)};
    pm_ab_t e = pm_pair_ab(&self->e);
    e.alpha = pm_mulh_add(e.alpha, pm_sub_sat(new.alpha, e.alpha), config->k_filter);
    e.beta = pm_mulh_add(e.beta, pm_sub_sat(new.beta, e.beta), config->k_filter);
    self->e = e;
    emf->e = emf_turned(emf, pm_park_half(e, in->dir));
    emf_describe(emf, emf->e, out);
}

void extended_emf_ab_slow(extended_emf_ab_t *self, const extended_emf_ab_config_t *config, const obs_in_t *in,
                          const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    const emf_machine_t machine = emf_salient(config, in, config->lag);
    emf_slow(&self->emf, config, &machine, in, weight);
}
