/* A covariance in fixed point and its correction by one measured state, in Joseph's form
 * (METHODS.md 12.4.1.2).
 *
 * P is the lower triangle by rows, Q30, |P| < 2, in units of the caller's choice. State m is measured with
 * the variance r >= 2^-20; h selects it:
 *   S     = P_mm + r                           < 2
 *   K_i   = P_im / S
 *   kappa = 1 - K_m = r / S
 *   P     = (I - K h) P (I - K h)' + K r K'
 * written element by element, i and j other than m; W is what rounding K and kappa leaves:
 *   W_i   = P_im - K_i S
 *   W_m   = kappa S - r
 *   P_ij <- P_ij - K_i P_mj - K_j W_i
 *   P_im <- kappa P_im - K_i W_m
 *   P_mm <- kappa P_mm - (1 - kappa) W_m
 *
 * Why Joseph: the form is a sum of squares for any gain, so K may be rounded (16 bits from one hardware
 * division) and clamped to +-0.5 without harm to P. The short form P - K S K' would lose positive
 * definiteness at the first such step. What remains is the rounding of P itself, at most 5 LSB per element
 * and correction. As long as each prediction adds more than that to the diagonal, P stays positive definite
 * for ever: PM_KALMAN_LEAST for n states, because the norm of the error matrix is at most n times its
 * largest element. A square-root form would need no such floor, but its prediction orthogonalises 2n vectors
 * with a division each, three times the cost. */
#ifndef PM_MATH_KALMAN_H
#define PM_MATH_KALMAN_H

#include "firmware/math/fixed.h"

#define PM_KALMAN_BITS       30
#define PM_KALMAN_SIZE(n)    ((n) * ((n) + 1) / 2)
#define PM_KALMAN_AT(i, j)   ((i) * ((i) + 1) / 2 + (j)) /* i >= j */
#define PM_KALMAN_MOST_Q     (INT32_C(1) << 24)          /* of process noise, and of r: */
#define PM_KALMAN_MOST_R     (INT32_C(1) << 29)
#define PM_KALMAN_LEAST_R    (INT32_C(1) << 10)
#define PM_KALMAN_LEAST(n)   (16 * (n) * ((n) > 2 ? 2 : 1))
#define PM_KALMAN_STATES_MAX 4

typedef struct {
    int32_t K[PM_KALMAN_STATES_MAX]; /* Q32, +-0.5; that of the measured state is not set */
    int32_t kappa;                   /* Q30 */
} pm_kalman_gain_t;

static inline int32_t pm_kalman_at(const int32_t *P, unsigned i, unsigned j)
{
    return i >= j ? P[PM_KALMAN_AT(i, j)] : P[PM_KALMAN_AT(j, i)];
}

/* 1 / S as a mantissa in Q30 (0.5 ... 1) and a shift, S > 0 in Q30: 16 bits. */
typedef struct {
    int32_t mantissa;
    uint32_t shift;
} pm_kalman_inverse_t;

static inline pm_kalman_inverse_t pm_kalman_inverse(int32_t S)
{
    pm_kalman_inverse_t r;
    r.shift = (uint32_t)__builtin_clz((uint32_t)S | 1U) - 1U;
    r.mantissa = (int32_t)((0x7FFFFFFFU / ((uint32_t)pm_shl(S, r.shift) >> 15)) << 14);
    return r;
}

/* n and m are literals: the loops vanish. */
static inline __attribute__((always_inline)) pm_kalman_gain_t pm_kalman_measure(int32_t *P, unsigned n,
                                                                                unsigned m, int32_t r)
{
    pm_kalman_gain_t g;
    int32_t column[PM_KALMAN_STATES_MAX] = {0};
#pragma GCC unroll 4
    for (unsigned i = 0; i < n; i++) {
        column[i] = pm_kalman_at(P, i, m);
    }
    const int32_t S = column[m] + r;
    const pm_kalman_inverse_t inverse = pm_kalman_inverse(S);
    const int32_t most = INT32_C(0x07FFFFFF) >> inverse.shift;
    g.kappa = pm_shl(pm_mulh(r, inverse.mantissa), 2U + inverse.shift);
    const int32_t W_m = pm_shl(pm_mulh(g.kappa, S), 2) - r;
    P[PM_KALMAN_AT(m, m)] = pm_shl(pm_mulh(g.kappa, column[m]), 2) - W_m + pm_shl(pm_mulh(g.kappa, W_m), 2);
#pragma GCC unroll 4
    for (unsigned i = 0; i < n; i++) {
        if (i == m) {
            continue;
        }
        g.K[i] = pm_shl(pm_clamp(pm_mulh(column[i], inverse.mantissa), -most, most), 4U + inverse.shift);
        const int32_t W_i = pm_mulh_sub(column[i], g.K[i], S);
#pragma GCC unroll 4
        for (unsigned j = 0; j <= i; j++) {
            if (j != m) {
                const int32_t P_ij = P[PM_KALMAN_AT(i, j)];
                P[PM_KALMAN_AT(i, j)] = pm_mulh_sub(pm_mulh_sub(P_ij, g.K[i], column[j]), g.K[j], W_i);
            }
        }
        P[i > m ? PM_KALMAN_AT(i, m) : PM_KALMAN_AT(m, i)] =
            pm_mulh_sub(pm_shl(pm_mulh(g.kappa, column[i]), 2), g.K[i], W_m);
    }
    return g;
}

/* Correction of the measured state by its innovation y: K_m y = (1 - kappa) y. */
static inline int32_t pm_kalman_gained(const pm_kalman_gain_t *g, int32_t y)
{
    return y - pm_shl(pm_mulh(g->kappa, y), 2);
}

/* Keeps the variance of state m below a half when nothing is observed of it for long. Row and column shrink
 * together, so P stays positive definite, which clamping the element would not guarantee. */
static inline __attribute__((always_inline)) void pm_kalman_hold(int32_t *P, unsigned n, unsigned m)
{
    if (P[PM_KALMAN_AT(m, m)] < INT32_C(1) << (PM_KALMAN_BITS - 1)) {
        return;
    }
#pragma GCC unroll 4
    for (unsigned i = 0; i < n; i++) {
        int32_t *p = &P[i >= m ? PM_KALMAN_AT(i, m) : PM_KALMAN_AT(m, i)];
        *p -= *p >> 2;
    }
    P[PM_KALMAN_AT(m, m)] -= P[PM_KALMAN_AT(m, m)] >> 2;
}

#endif
