/* Position from the voltage that an injected carrier makes between the star point and the mean of the
 * terminals (METHODS.md 6.1 to 6.4; rows 71 to 78): what zero_rotating.h, zero_pulsating.h and
 * zero_anti_rotating.h have in common.
 *
 * Where the mutual inductances of the phases change with the position otherwise than their own,
 * dL_0 = L_s2 - M_s2 is not zero, nor under load its cross-coupling counterpart L_c0:
 *   v_0 = p psi_0 + e_0,  psi_0 = -1/2 Re[c i e^{j 2 theta}],  c = dL_0 - j L_c0
 * and c moves with the current where the iron saturates, r the rated one:
 *   dL_0(i) = dL_0 + (zero_dL_0_d - dL_0) i_d / r + (zero_dL_0_q - dL_0) (i_q / r)^2
 *   L_c0(i) = zero_L_c0 + (zero_L_c0_q - zero_L_c0) i_q / r
 * A carrier V_h r e^{j chi}, r its swing, drives a current with both sequences, so that
 *   v_0 = -A r [cos(2 theta + chi) + kappa cos(4 theta + theta_m - chi)],  A = dL_0 V_h L_sa / (2 D)
 * kappa = K / L_sa, theta_m: saliency.h. v_0 is proportional to the voltage of the instant and none at the
 * zero vector, where the converters sample: an RC of half a PWM period to two is part of the method, and with
 * a = e^{-T_s / RC}
 *   x_k = (y_k - a y_k-1) / (1 - a)       mean over [k-1, k), of the samples y
 *
 * Two forms of what v_0 should be and how it changes with the position, d = x - v_0^ and s = dv_0 / dtheta:
 *   measured  u_k = c(i_k) i_k e^{j 2 theta^_k},  g = (u_k - u_k-1) / T_s:  d = x + 1/2 Re g,  s = Im g
 *   told      the expression above at theta^ with A(i_q), kappa(i_q), theta_m(i_q) of the saliency map
 * The measured form knows c and nothing else: resistance, dead time, delay and load are in the
 * current as in the voltage. c is that of each sample, not of the load: the carrier sees the slope of c i,
 * which has a part that turns with 6 theta. Its basin is +-60 to +-75 degrees for kappa = 0.27, that of the told one +-90.
 *
 * The carrier has N periods, N even, and a swing of the opposite sign half of it later. With h = N / 2,
 *   d~ = d_k - d_k-h,  s~ = s_k - s_k-h     free of what moves slower: EMF, load
 *   eps = sum of h d~ s~ / (h P),  P = mean of s~^2
 *   i_f = (i_k + i_k-h) / 2                 in the estimated frame
 * N = 2 is the square wave. eps is as old as h periods, exact for small errors, and 0 for the first
 * 2 h + 2 periods after a reset. misfit, measured form: sqrt(P) against what it is at A(i_q) without kappa, relative.
 *
 * `zero_form` chooses: from told to measured when eps has stayed below 0.1 rad for 20 ms, and back when its mean is
 * beyond 0.5 rad; or one alone.
 * Against a sine whose answer is a current (docs/results/injection.md), the noise of the position is that of the samples by
 *   2 K / (omega_h dL_0 L_sa)
 * Signals are per unit of 8 |A| without load, which must be at least 0.1 % of the base of voltages.
 * Only in programs that carry the neutral. State 500 bytes. Tests: tests/unit/injection/zero_sequence_test.cpp. */
#ifndef INJECTION_ZERO_SEQUENCE_H
#define INJECTION_ZERO_SEQUENCE_H

#include "firmware/math/filter.h"
#include "firmware/math/image.h"
#include "firmware/math/measure.h"
#include "injection/carrier.h"
#include "injection/saliency.h"
#include "injection/source.h"

#ifdef __cplusplus
extern "C" {
#endif

#define ZERO_HALF_MOST 20U /* h */

typedef enum { ZERO_BEGINS_TOLD, ZERO_TOLD, ZERO_MEASURED, ZERO_NOT_DECOUPLED } zero_form_t;

typedef struct {
    int32_t v_now, v_past;           /* shares of y_k and y_k-1 in x, Q20 */
    int32_t c_re, c_im;              /* c / T_s without a current, Q20, */
    int32_t c_d, c_q, c_cross;       /* and what i_d, i_q^2, i_q of unit current add to it, Q25 */
    int32_t v_h;                     /* Q31 */
    pm_angle_t step;                 /* 2 pi / N */
    uint32_t half;                   /* h */
    pm_unit_t swing[ZERO_HALF_MOST]; /* r of the first half of a carrier that swings with the cosine */
    int32_t power_0;                 /* h P without load, Q24 */
    pm_frac_t k_power;               /* low-pass of P, 1 kHz; 0: none */
    pm_q_t omega_least;              /* below, the source is blind; 0: never */
    uint16_t warm;                   /* slow steps until the window holds nothing but answers */
    uint8_t form;                    /* zero_form_t */
    bool told_first;
    uint32_t anti_rotating; /* 1: this carrier */
    /* the told form */
    saliency_config_t saliency; /* of I_p A is made, and theta_m */
    pm_q_t kappa_0, kappa_2;
    pm_q_t turn6; /* 6 T_s w_base: rad per period and unit of speed */
} zero_config_t;

typedef struct {
    pm_q_t d, s;
    pm_dq_t i;     /* half of the current, frame of its instant */
    int32_t p;     /* d~ s~, Q24 */
    pm_q_t change; /* s~ */
} zero_place_t;

typedef struct {
    pm_ab_t u;   /* c i e^{j 2 theta^} / T_s, Q14 */
    int32_t y;   /* as pm_small() */
    int32_t sum; /* of p */
    pm_q_t eps;
    int32_t gain;       /* 1 / (h P); 0 until the window holds nothing but answers */
    uint32_t at;        /* of the half carrier */
    int32_t sign;       /* of the present half */
    pm_unit_t swing[2]; /* r of the voltages commanded one and two periods ago */
    pm_dq_t told;       /* A kappa e^{j (6 theta^ + theta_m)} */
    pm_dq_t rate;       /* its change in a period */
    pm_q_t a;           /* A(i_q) */
    pm_q_t s_told;      /* amplitude of s, told form */
    uint32_t measured;  /* 1: the form is */
    int32_t power;      /* h P, Q24 */
    pm_q_t eps_mean;
    pm_q_t misfit;
    uint16_t warm;
    uint16_t agree_ms;
    zero_place_t place[ZERO_HALF_MOST];
} zero_t;

#if PM_CARRIES(NEEDS_NEUTRAL)

typedef struct {
    pm_q_t d, s;
} zero_sequence_sample_t;

/* x_k. */
static inline pm_q_t zero_voltage(zero_t *self, const zero_config_t *config, const injection_in_t *in)
{
    const pm_q_t y = in->more->v_zero;
    const int32_t x = pm_mulh_sub(pm_mulh(y, config->v_now), self->y, config->v_past);
    self->y = y;
    return pm_shl(pm_sat(x, 18), PM_Q_BITS - 18);
}

/* dL_0(i) / T_s, Q20; i: half of the current, estimated frame. */
static inline int32_t zero_link_re(const zero_config_t *config, pm_dq_t i)
{
    const int32_t rise = pm_shl(pm_sat(pm_mulh(i.q, config->c_q), 26), 5);
    return pm_mulh_add(pm_mulh_add(config->c_re, i.d, config->c_d), i.q, rise);
}

/* u of the present sample. */
static inline pm_ab_t zero_link(const zero_config_t *config, const injection_in_t *in, pm_dq_t i)
{
    const pm_half_dir_t twice = pm_dir_sum(in->dir, in->dir);
    const int32_t alpha = pm_mulh_sub(pm_mulh(in->i.alpha, twice.cos), in->i.beta, twice.sin); /* Q26 */
    const int32_t beta = pm_mulh_add(pm_mulh(in->i.alpha, twice.sin), in->i.beta, twice.cos);
    const int32_t re = zero_link_re(config, i);
    const int32_t im = pm_mulh_add(config->c_im, i.q, config->c_cross);
    const pm_ab_t u = {pm_mulh_sub(pm_mulh(alpha, re), beta, im), pm_mulh_add(pm_mulh(alpha, im), beta, re)};
    return u;
}

/* The measured form. */
static inline zero_sequence_sample_t zero_measured(zero_t *self, const zero_config_t *config,
                                                   const injection_in_t *in, pm_dq_t i, pm_q_t x)
{
    const pm_ab_t u = zero_link(config, in, i);
    const int32_t re = pm_sat(u.alpha - self->u.alpha, 14);
    const int32_t im = pm_sat(u.beta - self->u.beta, 14);
    self->u = u;
    const zero_sequence_sample_t sample = {x + pm_shl(re, PM_Q_BITS - 15), pm_shl(im, PM_Q_BITS - 14)};
    return sample;
}

/* r of the voltage whose answer comes now; `next` is that of the one that is commanded. */
static inline pm_unit_t zero_swing(zero_t *self, pm_unit_t next)
{
    const pm_unit_t now = self->swing[1];
    self->swing[1] = self->swing[0];
    self->swing[0] = next;
    return now;
}

/* r of a carrier that swings with the cosine, for the coming period. */
static inline pm_unit_t zero_cosine(const zero_t *self, const zero_config_t *config)
{
    return config->swing[self->at] * self->sign;
}

/* Of the carrier, as carrier.h takes it. */
static inline int32_t zero_amplitude(const zero_config_t *config, pm_unit_t r)
{
    return pm_mulh(config->v_h, r);
}

/* Closes the period: d~, s~, eps and the fundamental current; i as zero_link() has it. */
static inline void zero_close(zero_t *self, const zero_config_t *config, pm_dq_t i,
                              zero_sequence_sample_t sample, injection_out_t *out)
{
    const uint32_t at = self->at;
    zero_place_t *place = &self->place[at];
    const pm_dq_t past = place->i;
    const pm_q_t s = sample.s - place->s;
    const int32_t p = pm_mulh(sample.d - place->d, s);
    self->sum += p - place->p;
    place->d = sample.d;
    place->s = sample.s;
    place->i = i;
    place->p = p;
    place->change = s;
    self->at = at + 1U;
    if (at + 1U == config->half) {
        self->at = 0;
        self->sign = -self->sign;
    }
    self->eps = pm_small_gain(pm_shl(pm_sat(self->sum, 28), 3), self->gain);
    out->eps = self->eps;
    out->i.d = i.d + past.d;
    out->i.q = i.q + past.q;
}

#endif

void zero_reset(zero_t *self, const zero_config_t *config, const obs_in_t *in);
void zero_slow(zero_t *self, const zero_config_t *config, const obs_in_t *in);
obs_out_t zero_last(const zero_t *self, const zero_config_t *config);

/* zero_sequence_config.c: for a carrier that swings. */
void make_zero_sequence(maker_t *m, zero_config_t *c);
injection_limits_t zero_limits(const maker_t *m);
pm_num_t zero_answer(const maker_t *m);

/* 8 A, the unit of x, V; of the sign of dL_0. */
pm_num_t zero_unit(const maker_t *m);

/* a of the channel's filter; 0 without one. */
pm_num_t zero_decay(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
