#include "firmware/drive/position.h"

#include "firmware/math/compiler.h"
#include "firmware/math/trig.h"

/* Optional stages: one branch per period for all of them. */
PM_RARE static pm_q_t corrected_eps(position_t *self, const position_config_t *config, const pm_ab_t *v,
                                    pm_dq_t i, pm_q_t eps)
{
    if (config->speed.id != (uint8_t)SPEED_LOOP) {
        speed_collect(&self->speed, pm_park(*v, pm_dir(self->pll.theta)).q);
    }
    if (config->second_harmonic.id != SECOND_HARMONIC_STAYS) {
        eps = second_harmonic_step(&self->second_harmonic, &config->second_harmonic, pm_dir(self->pll.theta),
                                   eps);
    }
    if (config->mismatch.id != (uint8_t)MISMATCH_OFF) {
        const mismatch_in_t at = {.pll = &self->pll,
                                  .k_theta = self->gains.k_theta,
                                  .i = i,
                                  PM_IN_IMAGE(two_sets, .apart = self->apart)};
        eps =
            mismatch_step(&self->mismatch, position_window(self), &config->mismatch, &at, self->weight, eps);
    }
    return loop_eps(&self->loop, &config->loop, &self->pll, &self->gains, eps);
}

void position_step(position_t *self, const position_config_t *config, const position_in_t *at,
                   position_out_t *out)
{
    const pm_ab_t i = at->i;
    pm_pll_t pll = self->pll;
    pm_pll_predict(&pll, &self->gains);
    const pm_dir_t dir = pm_dir(pll.theta);
    const pm_half_dir_t frame_ahead = pm_dir_sum(dir, pm_pair_dir(at->ahead));
    const bool inject = self->inject;
    pm_dq_t i_dq;
    pm_q_t low_eps = 0;
    if (inject) {
        const injection_in_t raw = {.i = i,
                                    .dir = dir,
                                    .omega = pll.omega,
                                    .ahead = frame_ahead,
                                    INJECTION_IF_MORE(.more = at->more, ) INJECTION_IF_VOLTAGE(.v = *at->v)};
        injection_out_t low;
        injection_step(&self->injection, &config->injection, &raw, &low);
        i_dq.d = low.i.d; /* by members, so that it stays in registers */
        i_dq.q = low.i.q;
        low_eps = low.eps;
        out->carrier = low.carrier;
    } else {
        i_dq = pm_park(i, dir);
    }
    const obs_in_t in = {.v = pm_pair_ab(at->v),
                         .i = i,
                         .dir = dir,
                         .omega = pll.omega,
                         .i_dq = i_dq,
                         PM_IF_MEASURED(.more = at->more)};
    obs_out_t high;
    observer_step(&self->observer, &config->observer, &in, &high);
#if PM_HAS(zero_vector)
    if (config->observer.id == OBSERVER_zero_vector) {
        self->sample_at = zero_vector_sample_at(&self->observer.zero_vector);
    }
#endif
    pm_q_t eps = high.eps;
    if (inject) {
        eps = low_eps + pm_mul(self->weight, eps - low_eps);
    }
    if (pm_rarely(config->corrects)) {
        self->pll = pll; /* through memory, so that otherwise it stays in registers */
        PM_IN_IMAGE(two_sets, self->apart = pm_park(at->more->apart, dir).q;)
        eps = corrected_eps(self, config, at->v, i_dq, eps);
        pll = self->pll;
    }
    pm_pll_correct(&pll, &self->gains, eps);
    self->pll = pll;
    out->ahead = frame_ahead;
    out->i = i_dq;
    out->omega = pll.omega;
}
