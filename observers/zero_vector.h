/* EMF from the derivative of the current within a zero vector (METHODS.md 4.6.2, row 48, ZVCD): no voltage is
 * in it, so neither dead time nor the DC link nor the modulator's limit moves the position.
 *
 * While all lower switches conduct, with the current sampled x before and x behind the centre t_k,
 *   T e = -R T i(k) - L_d (T / 2x) (i(t_k + x) - i(t_k - x))
 * lies along the extended EMF of emf.h, which gives error signal, filter and amplitude. Within the zero vector
 * i_q falls at its own rate, so that its amplitude is about w psi_m L_d / L_q; and where L_dq is known, its angle
 * is corrected by
 *   tan = lambda (L_q / L_d + R i_q / (w psi_ref)),   lambda = i_q / i_rated (L_dqh / L_qh)_rated
 * R is not adapted: the amplitude that tells of it lacks what the saliency takes.
 *
 * One further sample a period: in one ahead of t_k, in the next behind t_k, so there is an EMF in every second
 * period. It is worked out there, in the frame and with the current of t_k; in the other period the last error signal is
 * given again. Codes are subtracted before they are scaled: no offset is in them.
 * The lower switches conduct from T_dt behind the last edge on, which compensation of dead time puts up to T_dt / 2
 * later, until T_dt / 2 before the next one: both instants lie T_dt / 2 later than x says, and
 *   x <= T/4 (1 - sqrt(3) |v| / v_dc) - T_dt - t_settle
 * at 1 kHz for the largest voltage of the last millisecond, with T/256 to spare; x is at least T/32. A pair of
 * which a period had more voltage is left out, and as long as none comes the error signal is 0: the loop coasts.
 * Behind 20 missed pairs the misfit is 1. Refused when configured, as `observer`: where w psi_m 2x / L_q without load is
 * below four steps of the converter at `speed_high`, and where x at rated current is below T/24 at `speed_max`.
 *
 * Called each period; the result belongs to k. vector: extended EMF. 132 bytes of state and 96 of configuration, 1,170 of
 * code and 1,680 of its maker; 75 instructions a period with its loop, 98 at most. The samples cost the port and the
 * drive 45 more. Tests: tests/unit/observers/zero_vector_test.cpp, tests/scenario/zero_vector.yaml. */
#ifndef OBSERVERS_ZERO_VECTOR_H
#define OBSERVERS_ZERO_VECTOR_H

#include "observers/emf.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    emf_config_t emf;
    pm_q_t v_dc;     /* nominal */
    pm_q_t lambda;   /* L_dqh / L_qh per i_q; 0: not corrected */
    pm_q_t saliency; /* L_q / L_d */
    uint16_t counts; /* of half a period */
    uint16_t guard;  /* T_dt + t_settle, counts */
    uint16_t later;  /* T_dt / 2, counts */
} zero_vector_config_t;

typedef struct {
    /* of it: i: codes at t_k - x; e: of t_k; turn: by L_dq alone; drop: R T, cross: w T (L_q - L_d), both Q27 */
    emf_t emf;
    pm_q_t eps;    /* of the last pair */
    pm_q_t square; /* largest |v|^2 of a pair since the last slow step, Q24; 0: none yet */
    pm_q_t most;   /* up to which both samples lie within the zero vectors; its complement while `foreign` */
    /* at t_k */
    pm_dir_t dir; /* of the position */
    pm_dq_t i_dq;
    pm_q_t ahead; /* |v|^2 of the period that has ended */
    pm_q_t v_dc;
    /* at 1 kHz */
    int32_t k_alpha, k_beta; /* -L_d T / 2x of the codes' scales, Q28 */
    pm_frac_t k_filter;
    uint16_t x;                /* counts */
    uint16_t at_begin, at_end; /* instants, behind t_k and ahead of t_k+1 */
    uint16_t held;             /* bit 0: the sample at t_k - x is valid */
    uint8_t foreign;           /* pairs on their way that were not asked for with this x */
    uint8_t missed;            /* pairs in sequence */
    bool behind;               /* the next step's sample lies behind t_k-1, otherwise ahead of t_k */
} zero_vector_t;

void zero_vector_reset(zero_vector_t *self, const zero_vector_config_t *config, const obs_in_t *in);
void zero_vector_slow(zero_vector_t *self, const zero_vector_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight);

static inline obs_out_t zero_vector_last(const zero_vector_t *self)
{
    obs_out_t out;
    emf_describe(&self->emf, self->emf.e, &out);
    out.eps = self->eps;
    return out;
}

#if PM_HAS(zero_vector) && PM_CARRIES(NEEDS_SECOND_SAMPLE)
/* The error signal of the pair that is complete. */
pm_q_t zero_vector_pair(zero_vector_t *self, const pm_measure_t *codes, pm_q_t square);

/* 3 i_alpha and sqrt(3) i_beta of a sample, in codes: what offsets do not reach. */
static inline pm_ab_t zero_vector_codes(const pm_measure_t *codes)
{
    const uint16_t *i = codes->i_sample[0];
    const int32_t a = i[0], b = i[1], c = i[2];
    const pm_ab_t x = {2 * a - (b + c), b - c};
    return x;
}

/* Here, so that a caller that only wants eps pays for nothing else. */
static inline void zero_vector_step(zero_vector_t *self, const zero_vector_config_t *config,
                                    const obs_in_t *in, obs_out_t *out)
{
    (void)config;
    const pm_measure_t *codes = in->more->codes;
    const pm_q_t v_squared = pm_mulh_add(pm_mulh(in->v.alpha, in->v.alpha), in->v.beta, in->v.beta);
    if (self->behind) {
        self->eps = zero_vector_pair(self, codes, v_squared);
        self->behind = false;
    } else {
        self->emf.i = zero_vector_codes(codes);
        self->dir = in->dir;
        self->i_dq = in->i_dq;
        self->ahead = v_squared;
        self->v_dc = *in->more->v_dc;
        self->held = codes->sampled;
        self->behind = true;
    }
    *out = zero_vector_last(self);
}
#endif

/* After a step: where in [k+1, k+2) a further sample is wanted, as pm_instants_t. */
static inline uint16_t zero_vector_sample_at(const zero_vector_t *self)
{
    return self->behind ? self->at_end : self->at_begin;
}

static inline void zero_vector_tie(zero_vector_t *self, const zero_vector_config_t *config)
{
    (void)self, (void)config; /* no integrator that could drift */
}

void make_zero_vector(maker_t *m, zero_vector_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
