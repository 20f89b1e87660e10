/* Common part of the third-harmonic sources: what the star point says of three times the position (METHODS.md 11.2.1, 11.4,
 * 11.6.3, 11.6.4, rows 132 to 134).
 *
 *   v_zero = p psi_0 behind an RC,   psi_0 = Re(L e^{j 3 theta}),   L = psi_3 - dL_0/2 i_d - j dL_0/2 i_q
 * dL_0 = L_s2 - M_s2 turns the third harmonic with the load, by atan(dL_0/2 i_q / (psi_3 - dL_0/2 i_d)) / 3: 9.8 degrees
 * on IPM-1000 at 4 A; with dL_0 = 0 that stays in the position. The RC turns and shrinks it by 1 + j x,
 * x = 3 omega RC. Of the pair (y, q), y being v_zero and q what lags it by a quarter of its cycle, the source makes
 *
 *   z      = (q - j y) e^{-j 3 theta} N,   N = (1 + j x) / (3 omega L)
 *   eps    = Im z / 3                       sin(3 (theta_rotor - theta)) / 3
 *   misfit = 1 - Re z
 * A machine without third harmonic shows a misfit of one. R and the inductances of d and q are not used.
 *
 * Unlike phases and dividers add a sine of the frequency of rotation, (1/3) sum dR_X i_X. third_notch takes it out: an
 * amplitude n that stands in the present frame and learns from what the source does not explain,
 *   e = v_zero - y^ - Re(n e^{-j theta}),   n += third_notch |omega| T e e^{j theta}
 * so that it does not turn the third harmonic, as a notch ahead would.
 *
 * eps is the same a third of a turn on (SOURCE_THIRD_TURN): which third it is, the source before has said, and
 * drive/position.h goes on watching the EMF. Below omega_min, four steps of a converter of 12 bits or what the format of N
 * holds, eps fades.
 *
 * N and the rest of the operating point are renewed at 1 kHz. No division in a period. Tests: tests/unit/observers/third_test.cpp,
 * tests/scenario/third_harmonic.yaml. */
#ifndef OBSERVERS_THIRD_H
#define OBSERVERS_THIRD_H

#include "firmware/math/estimate.h"
#include "firmware/math/pair.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Signals are per-unit in Q30, within +-0.5; N is in Q18, z in Q17. */
#define THIRD_Z_BITS 17
#define THIRD_Z_ONE  131072 /* 2^THIRD_Z_BITS */

typedef struct {
    pm_q_t psi_3;    /* per-unit */
    pm_q_t relative; /* dL_0 / (2 psi_3) */
    pm_frac_t t_s;   /* T_s w_base */
    pm_q_t rc;       /* 3 RC w_base */
    pm_q_t omega_min;
    pm_q_t notch; /* bandwidth over |omega|; 0: none */
} third_config_t;

typedef struct {
    pm_dq_t scale;     /* N, Q18 */
    pm_dq_t last;      /* z of the last step, Q17 */
    pm_dq_t notch;     /* n, per-unit, Q30 */
    pm_frac_t k_notch; /* per period */
} third_t;

/* x = 3 omega RC and L / psi_3 at an operating point. */
typedef struct {
    pm_q_t x;
    pm_dq_t l;
} third_point_t;

third_point_t third_point(const third_config_t *config, const obs_in_t *in);

/* 3 |omega|, not below that of omega_min. */
pm_q_t third_speed(const third_config_t *config, pm_q_t omega);

/* q - j y of a rotor at the present position and speed, Q30; d is q, q is -y. */
pm_dq_t third_seed(const third_config_t *config, const obs_in_t *in);

void third_reset(third_t *self, const third_config_t *config, const obs_in_t *in);
void third_slow(third_t *self, const third_config_t *config, const obs_in_t *in);
obs_out_t third_last(const third_t *self);

/* Direction of three times the angle, Q30, within 2^-26:
 *   cos 3 theta = cos theta (4 cos^2 theta - 3)
 *   sin 3 theta = sin theta (4 cos^2 theta - 1) */
static inline pm_half_dir_t third_dir(pm_dir_t dir)
{
    const int32_t four = pm_mulh(dir.cos, dir.cos); /* 4 cos^2 theta in Q28 */
    const pm_half_dir_t r = {pm_shl(pm_mulh(dir.cos, four - 3 * PM_ONE), 3),
                             pm_shl(pm_mulh(dir.sin, four - PM_ONE), 3)};
    return r;
}

/* What is left of the signal without the sine of the frequency of rotation. */
static inline int32_t third_seen(const third_t *self, const obs_in_t *in)
{
#if PM_CARRIES(NEEDS_NEUTRAL)
    const int32_t x = pm_shl(pm_sat(in->more->v_zero, PM_Q_BITS - 1), 30 - PM_Q_BITS);
#else
    const int32_t x = 0;
#endif
    if (self->k_notch == 0) {
        return x;
    }
    return pm_sat(x - pm_shl(pm_mulh_add(pm_mulh(self->notch.d, in->dir.cos), self->notch.q, in->dir.sin), 1),
                  30);
}

/* Learns from e, what the source has not explained of it. */
static inline void third_learn(third_t *self, const obs_in_t *in, int32_t e)
{
    if (self->k_notch != 0) {
        const int32_t k_e = pm_shl(pm_frac(e, self->k_notch), 1);
        self->notch.d = pm_sat(pm_mulh_add(self->notch.d, k_e, in->dir.cos), 29);
        self->notch.q = pm_sat(pm_mulh_add(self->notch.q, k_e, in->dir.sin), 29);
    }
}

static inline void third_describe(pm_dq_t z, obs_out_t *out)
{
    const unsigned lift = PM_Q_BITS - THIRD_Z_BITS;
    const pm_dq_t vector = {pm_shl(pm_sat(z.d, THIRD_Z_BITS + 2), lift),
                            pm_shl(pm_sat(z.q, THIRD_Z_BITS), lift)};
    out->vector = vector;
    out->eps = pm_frac(vector.q, PM_FRAC(1.0 / 3));
    out->misfit = pm_shl(pm_sat(THIRD_Z_ONE - z.d, THIRD_Z_BITS), lift);
}

/* dir: of three times the position. */
static inline void third_compare(third_t *self, pm_half_dir_t dir, int32_t y, int32_t q, obs_out_t *out)
{
    const int32_t a = pm_shl_sat(pm_mulh_sub(pm_mulh(q, dir.cos), y, dir.sin), 3, 30); /* Q31 */
    const int32_t b = pm_shl_sat(pm_mulh_add(pm_mulh(q, dir.sin), y, dir.cos), 3, 30);
    const pm_dq_t n = pm_pair_dq(&self->scale);
    self->last.d = pm_mulh_add(pm_mulh(a, n.d), b, n.q);
    self->last.q = pm_mulh_sub(pm_mulh(a, n.q), b, n.d);
    third_describe(self->last, out);
}

void make_third(maker_t *m, third_config_t *c);

/* RC of the signal, s; of an open winding, whose signal is the mean of a period, half of that. */
pm_num_t third_filter(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
