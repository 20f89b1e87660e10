/* Sliding window over one period of a carrier, N samples: mean and complex amplitudes at plus and minus the
 * carrier frequency of a vector x (METHODS.md 4.4.1, row 39).
 *
 *   mean     = 1/N sum x
 *   positive = 1/N sum x e^{-j phi},   the part of x that turns with e^{+j phi}
 *   negative = 1/N sum x e^{+j phi},   the part that turns with e^{-j phi}
 *   cosine   = 1/N sum x cos phi,      half the part of x that swings with cos phi
 *   sine     = 1/N sum x sin phi
 * over the last N samples; phi turns once in N samples and is the same at the same place of the window, to the
 * last bit. Each amplitude is free of the mean, positive and negative of each other, cosine and sine likewise. The sums are exact, so nothing drifts;
 * samples are rounded to 2^-24. Delay (N - 1) / 2 samples.
 *
 * window_reset() fills the window with a constant. window_step() costs 44 instructions, 12 of which are multiply-
 * accumulates of 64 bits; reading an amplitude 6. Range: |x| < 3, N <= WINDOW_MOST.
 * Tests: tests/unit/math/window_test.cpp. */
#ifndef PM_MATH_WINDOW_H
#define PM_MATH_WINDOW_H

#include "firmware/math/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WINDOW_MOST 40

typedef struct {
    pm_dq_t x[WINDOW_MOST]; /* Q24 */
    pm_dq_t sum;            /* Q24 */
    int64_t dc, qs, ds, qc; /* sums of products with cosine and sine, Q55 */
} window_t;

/* N samples of x, which turn with nothing. */
void window_reset(window_t *self, uint16_t n, pm_dq_t x);

/* The sample x takes the place `at` (below N), whose direction is dir = e^{j phi}. */
static inline void window_step(window_t *self, uint16_t at, pm_dir_t dir, pm_dq_t x)
{
    pm_dq_t *place = &self->x[at];
    const pm_dq_t now = {x.d >> 4, x.q >> 4};
    const pm_dq_t change = {now.d - place->d, now.q - place->q};
    *place = now;
    self->sum.d += change.d;
    self->sum.q += change.q;
    self->dc += (int64_t)change.d * dir.cos;
    self->qs += (int64_t)change.q * dir.sin;
    self->ds += (int64_t)change.d * dir.sin;
    self->qc += (int64_t)change.q * dir.cos;
}

/* per_n: 1 / N, Q32. */
static inline pm_dq_t window_mean(const window_t *self, pm_frac_t per_n)
{
    pm_dq_t r;
    r.d = pm_shl(pm_mulh(self->sum.d, per_n), 4);
    r.q = pm_shl(pm_mulh(self->sum.q, per_n), 4);
    return r;
}

static inline pm_q_t window_amplitude(int64_t sum, pm_frac_t per_n)
{
    return pm_shl(pm_sat(pm_mulh((int32_t)(sum >> 32), per_n), 26), 5);
}

static inline pm_dq_t window_negative(const window_t *self, pm_frac_t per_n)
{
    pm_dq_t r;
    r.d = window_amplitude(self->dc - self->qs, per_n);
    r.q = window_amplitude(self->ds + self->qc, per_n);
    return r;
}

static inline pm_dq_t window_cosine(const window_t *self, pm_frac_t per_n)
{
    const pm_dq_t r = {window_amplitude(self->dc, per_n), window_amplitude(self->qc, per_n)};
    return r;
}

static inline pm_dq_t window_sine(const window_t *self, pm_frac_t per_n)
{
    const pm_dq_t r = {window_amplitude(self->ds, per_n), window_amplitude(self->qs, per_n)};
    return r;
}

static inline pm_dq_t window_positive(const window_t *self, pm_frac_t per_n)
{
    pm_dq_t r;
    r.d = window_amplitude(self->dc + self->qs, per_n);
    r.q = window_amplitude(self->qc - self->ds, per_n);
    return r;
}

#ifdef __cplusplus
}
#endif

#endif
