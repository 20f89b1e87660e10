/* Common part of the three EMF observers: the EMF from the voltage equation, its amplitude, the error signal
 * (METHODS.md 2.3, 3.2.3).
 *
 * Change of the magnet's flux over the period from k-1 to k, exact for a constant L:
 *   T e    = T v - R T (i(k) + i(k-1))/2 - L (i(k) - i(k-1))
 * It lies on the q-axis of the middle of the period. The mean of two periods is used, which cancels a carrier
 * of half the sampling frequency; it lies w T before k. In the present frame:
 *   eps    = -E_d / (w psi_ref)
 *   misfit = 1 - E_q / (w psi_ref)
 * psi_ref is psi_a of model.h and what that lacks, followed within a band: an error of psi_m moves no angle.
 * Below omega_min the error signal fades with the EMF instead of rising with the noise; while another source
 * leads, below omega_tied, so that voltage errors act as in a flux that is tied to the position. Then, below
 * resistance.omega, R is adapted to the difference
 *   E_q - w psi_a - (L_q - L_d) p i_q = (R - R^) i_q
 * The speed compared with that limit is the lagging one: the loop's own dips below it for moments in which
 * w psi_a is too small, and R would grow by 5 %.
 *
 * L, w T, w T (L_q - L_d), 1 / (w psi_ref) and R T are renewed at 1 kHz. Nothing is integrated, so nothing
 * drifts and nothing needs to be tied.
 *
 * The speed in w (L_q - L_d) J i closes a second loop:
 *   eps = error - c (w^ - w),   c = (L_q - L_d) i_q / (w psi)
 * While braking c < 0; with the loop's own speed that is unstable below w_n |c w| / (2 zeta), 14 % of rated
 * speed on IPM-1000 at full load. With a speed that lags by one radian of rotation it is stable everywhere
 * (c w < 1); under an acceleration a this costs an angle of c a / w. */
#ifndef OBSERVERS_EMF_H
#define OBSERVERS_EMF_H

#include "firmware/math/pair.h"
#include "observers/model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    observer_model_t model;
    observer_resistance_t resistance;
    pm_frac_t k_filter;  /* low-pass of the EMF, per period */
    pm_gain_t lag;       /* of the filter in the stationary frame, emf_machine_t: (2 - k) / k, Q26 */
    int32_t rate;        /* 1 / (T w_base), Q20 */
    pm_gain_t slow_rate; /* the same of a slow step, Q26 */
    pm_q_t slow_step;    /* a slow step's T w_base */
    pm_gain_t speed_lag; /* of the loop's speed behind a ramp, while another source leads; slow steps */
    pm_q_t omega_min;    /* least speed of the error signal while the observer leads ... */
    pm_q_t omega_tied;   /* ... and while it does not */
} emf_config_t;

typedef struct {
    pm_ab_t i;          /* current at k-1 */
    pm_ab_t change;     /* T e of the last period, Q28 */
    int32_t step;       /* T w_base, Q32 */
    int32_t drop;       /* R T/2, Q32 */
    int32_t inductance; /* of the change of current, Q28 */
    int32_t cross;      /* w T (L_q - L_d)/2, Q32 */
    int32_t turn;       /* tangent of the angle by which the EMF lies behind k, Q30 */
    int32_t inverse;    /* 1 / (w T psi_ref), Q17, sign of w */
    int32_t rate;       /* 1 / (T w_base), Q20 */
    pm_dq_t e;          /* T e, filtered, in the present frame, Q31 */
    pm_q_t psi_ref;
    pm_q_t psi_a;       /* what of it is the model's */
    pm_q_t R;           /* adapted */
    pm_q_t i_q, omega;  /* of the last slow step */
    pm_q_t omega_cross; /* speed of the cross-coupling */
} emf_t;

/* The machine in the form of one observer. */
typedef struct {
    pm_q_t L;        /* of the change of current */
    pm_q_t saliency; /* L_q - L_d: the cross-coupling that L leaves */
    pm_gain_t lag;   /* of filter and half a period, tan = lag tan(w T/2): 1 in the rotor's frame */
} emf_machine_t;

emf_machine_t emf_salient(const emf_config_t *config, const obs_in_t *in, pm_gain_t lag);

void emf_reset(emf_t *self, const emf_config_t *config, const emf_machine_t *machine, const obs_in_t *in);
void emf_frame_step(emf_t *self, const emf_config_t *config, const obs_in_t *in, obs_out_t *out);
void emf_slow(emf_t *self, const emf_config_t *config, const emf_machine_t *machine, const obs_in_t *in,
              pm_q_t weight);
obs_out_t emf_last(const emf_t *self);

/* T e of the voltage equation, Q28; *sum: current at both ends, added. Stores the current for the next
 * period. */
static inline pm_ab_t emf_change(emf_t *self, const obs_in_t *in, pm_ab_t *sum)
{
    const pm_ab_t past = pm_pair_ab(&self->i);
    const pm_pair_t k = pm_pair(&self->step, &self->drop);
    const int32_t L = self->inductance;
    sum->alpha = in->i.alpha + past.alpha;
    sum->beta = in->i.beta + past.beta;
    pm_ab_t e;
    e.alpha = pm_mulh_sub(pm_mulh(in->v.alpha, k.first), sum->alpha, k.second);
    e.beta = pm_mulh_sub(pm_mulh(in->v.beta, k.first), sum->beta, k.second);
    e.alpha = pm_mulh_sub(e.alpha, pm_small(in->i.alpha - past.alpha), L);
    e.beta = pm_mulh_sub(e.beta, pm_small(in->i.beta - past.beta), L);
    self->i = in->i;
    return e;
}

/* Of two periods: 2 T e, Q28. */
static inline pm_ab_t emf_pair(emf_t *self, pm_ab_t change)
{
    const pm_ab_t past = pm_pair_ab(&self->change);
    self->change = change;
    const pm_ab_t sum = {change.alpha + past.alpha, change.beta + past.beta};
    return sum;
}

/* Turns e from the q-axis of its own instant into the present frame. */
static inline pm_dq_t emf_turned(const emf_t *self, pm_dq_t e)
{
    pm_dq_t r;
    r.d = e.d - pm_shl(pm_mulh(e.q, self->turn), 2);
    r.q = e.q + pm_shl(pm_mulh(e.d, self->turn), 2);
    return r;
}

/* A share of the amplitude, limited to +-1; x in Q31. */
static inline pm_q_t emf_relative(const emf_t *self, int32_t x)
{
    return pm_shl(pm_sat(pm_mulh(x, self->inverse), 16), PM_Q_BITS - 16);
}

static inline void emf_describe(const emf_t *self, pm_dq_t e, obs_out_t *out)
{
    out->eps = -emf_relative(self, e.d);
    out->misfit = pm_min(PM_ONE - emf_relative(self, e.q), PM_ONE);
    out->vector.d = pm_shl(pm_mulh(e.d, self->rate), PM_Q_BITS - 19); /* Q31 by Q20 */
    out->vector.q = pm_shl(pm_mulh(e.q, self->rate), PM_Q_BITS - 19);
}

void make_emf(maker_t *m, emf_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
