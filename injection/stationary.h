/* A carrier along a fixed axis of the stator, and the part I_p of its answer that is the same for all
 * positions: the common part of stationary_sine.h and stationary_square.h (METHODS.md 4.4.2.2, 4.4.3.2, row
 * 41).
 *
 * The answer to a carrier of flux F along the axis g, alpha (0) or beta (90 degrees), in the stationary
 * frame:
 *   c   = I_p e^{j g} + I_n e^{j (2 theta + theta_m - g)},  I_p = F L_sa / D,  I_n = F K / D
 * Only I_n shows the position; an error of I_p moves it by (dI_p / 2 I_n) sin 2 theta. So I_p is detected
 * first, on alpha, on beta and on both once more, eight values at 1 kHz each; I_n cancels, but for what the
 * rotor turns by in the time t between:
 *   found = mean of (c along g - I_n omega t sin 2 theta^) / I_p(i_q)
 * Not I_n cos 2 theta^ of each: the estimate moves with the error that I_p makes, and would hide all of it at
 * 45 degrees. Then the carrier stays on alpha, and I_p follows the load as the saliency map does:
 *   I_p = found I_p(i_q)                                (saliency.h)
 * It is detected after a reset at a speed with |omega| t < 0.5, unless the configuration says that it is not to
 * be. Faster, as where an observer hands back, what was found before stands; found = 1 where nothing was. */
#ifndef INJECTION_STATIONARY_H
#define INJECTION_STATIONARY_H

#include "firmware/math/estimate.h"
#include "firmware/params/types.h"
#include "injection/saliency.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t i_n;      /* without load */
    int32_t between; /* t w_base: rad per unit of speed, Q20 */
    bool find;
} stationary_config_t;

typedef struct {
    pm_q_t found;     /* a sum while it is found */
    uint16_t finding; /* values left; 0: found */
} stationary_t;

/* self: what it was, or zeros. omega: per-unit. */
void stationary_reset(stationary_t *self, const stationary_config_t *config, pm_q_t omega);

/* 1 kHz, while finding: the answer along the axis, position and speed, and I_p(i_q). True when the axis
 * changes with it. */
bool stationary_find(stationary_t *self, const stationary_config_t *config, pm_q_t along, const obs_in_t *in,
                     pm_q_t i_p);

static inline bool stationary_finding(const stationary_t *self)
{
    return self->finding > 0U;
}

#define STATIONARY_VALUES 32U
#define STATIONARY_ON_ONE 8U /* axis, then on the other; both powers of two */

static inline bool stationary_on_beta(const stationary_t *self)
{
    return self->finding > 0U && ((self->finding - 1U) & STATIONARY_ON_ONE) == 0U;
}

/* x along the axis. */
static inline pm_ab_t stationary_axis(const stationary_t *self, int32_t x)
{
    const bool beta = stationary_on_beta(self);
    const pm_ab_t v = {beta ? 0 : x, beta ? x : 0};
    return v;
}

/* A vector of the stator that belongs to alpha, for the axis. */
static inline pm_ab_t stationary_on(const stationary_t *self, pm_dq_t x)
{
    const bool beta = stationary_on_beta(self);
    const pm_ab_t v = {beta ? -x.q : x.d, beta ? x.d : x.q};
    return v;
}

/* I_p detected, of that of the map. */
static inline pm_q_t stationary_i_p(const stationary_t *self, pm_q_t i_p)
{
    return stationary_finding(self) ? i_p : pm_mul(self->found, i_p);
}

/* What of x, in the frame of dir, is along the axis. */
static inline pm_q_t stationary_along(const stationary_t *self, pm_dq_t x, pm_dir_t dir)
{
    const pm_ab_t v = pm_park_inverse(x, dir);
    return stationary_on_beta(self) ? v.beta : v.alpha;
}

/* The answer without I_p, in the frame of dir, as if the carrier were on alpha: I_n e^{j (2 e + theta_m)}. */
static inline pm_dq_t stationary_turned(const stationary_t *self, pm_dq_t x, pm_dir_t dir)
{
    const pm_ab_t v = {x.d, x.q};
    const pm_dq_t r = pm_park(v, dir);
    const pm_dq_t on_beta = {-r.q, r.d};
    return stationary_on_beta(self) ? on_beta : r;
}

/* stationary_config.c; slope: 2 I_n without load, A; settling: periods after a change of the axis without a
 * value. */
void make_stationary(maker_t *m, stationary_config_t *c, pm_num_t slope, uint16_t settling);

#ifdef __cplusplus
}
#endif

#endif
