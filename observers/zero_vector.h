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
 * period, w T old when it is there, as that of emf.h. The lower switches conduct from T_dt behind the last edge
 * on, which compensation of dead time puts up to T_dt / 2 later, until T_dt / 2 before the next one: both instants lie
 * T_dt / 2 later than x says, and
 *   x <= T/4 (1 - sqrt(3) |v| / v_dc) - T_dt - t_settle
 * at 1 kHz for the largest voltage of the last millisecond, with T/256 to spare; x is at least T/32. A pair of
 * which a period had more voltage is left out, and as long as none comes the error signal is 0: the loop coasts.
 * Behind 20 missed pairs the misfit is 1. Refused when configured, as `observer`: where w psi_m 2x / L_q without load is
 * below four steps of the converter at `speed_high`, and where x at rated current is below T/24 at `speed_max`.
 *
 * Called each period; the result belongs to k. vector: extended EMF. 100 bytes of state and 96 of configuration, 1,110 of
 * code and 1,680 of its maker; 122 instructions a period with its loop, 152 at most. The samples cost the port and the
 * drive 50 more. Tests: tests/unit/observers/zero_vector_test.cpp, tests/scenario/zero_vector.yaml. */
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
    emf_t emf;
    pm_ab_t before;  /* current at t_k - x */
    pm_q_t square;   /* largest |v|^2 since the last slow step, Q24; 0: none yet ... */
    pm_q_t most;     /* ... and up to which both samples lie within the zero vectors */
    pm_q_t v_dc;     /* of the last period */
    uint16_t x;      /* counts */
    uint8_t foreign; /* not 0: the sample was not asked for with this x */
    uint8_t missed;  /* pairs in sequence */
    bool behind;     /* the next step's sample lies behind t_k-1, otherwise ahead of t_k */
    bool held;       /* `before` is valid */
} zero_vector_t;

void zero_vector_reset(zero_vector_t *self, const zero_vector_config_t *config, const obs_in_t *in);
void zero_vector_step(zero_vector_t *self, const zero_vector_config_t *config, const obs_in_t *in,
                      obs_out_t *out);
void zero_vector_slow(zero_vector_t *self, const zero_vector_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight);

/* After a step, for [k+1, k+2); as observer_sample_at() says. */
static inline uint32_t zero_vector_sample_at(const zero_vector_t *self, const zero_vector_config_t *config)
{
    const uint32_t x = self->x, later = config->later;
    return self->behind ? 2U * config->counts - x + later : x + later;
}

static inline obs_out_t zero_vector_last(const zero_vector_t *self)
{
    return emf_last(&self->emf);
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
