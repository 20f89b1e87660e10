/* Reference frames and the transforms between them (METHODS.md 0.1, rows 2 and 3).
 *
 * Amplitude-invariant Clarke, Park with the d-axis at the given angle:
 *   alpha = a - (a + b + c) / 3       d =  alpha cos + beta sin
 *   beta  = (b - c) / sqrt(3)         q = -alpha sin + beta cos
 * Each frame is a type of its own, so mixing them does not compile. A common part of the three phases
 * drops out of Clarke. The caller keeps abc within +-2.6, alpha-beta into abc within +-4 and vectors to be
 * turned shorter than 8; beyond, sums overflow (the host sanitizers stop there) and turned vectors wrap.
 * Error for an exact direction, in LSB of Q28: Clarke 1, inverse 2, Park 3.
 * Cost: docs/decisions/001-signal-format.md. Tests: tests/unit/math/frames_test.cpp. */
#ifndef PM_MATH_FRAMES_H
#define PM_MATH_FRAMES_H

#include "firmware/math/fixed.h"

typedef struct {
    pm_q_t a, b, c;
} pm_abc_t;

typedef struct {
    pm_q_t alpha, beta;
} pm_ab_t;

typedef struct {
    pm_q_t d, q;
} pm_dq_t;

/* Direction of an angle. */
typedef struct {
    pm_unit_t cos, sin;
} pm_dir_t;

/* The same halved: Q30. */
typedef struct {
    int32_t cos, sin;
} pm_half_dir_t;

/* Factors near one are written as one minus a fraction: a single SMMLSR, and no lost bit. */
static inline pm_ab_t pm_clarke(pm_abc_t x)
{
    const pm_q_t difference = x.b - x.c;
    pm_ab_t r;
    r.alpha = pm_mulh_sub(x.a, x.a + x.b + x.c, PM_FRAC(0.333333333333333333));
    r.beta = pm_mulh_sub(difference, difference, PM_FRAC(0.422649730810374236)); /* 1 - 1/sqrt(3) */
    return r;
}

static inline pm_abc_t pm_clarke_inverse(pm_ab_t x)
{
    const pm_q_t y = pm_mulh_sub(x.beta, x.beta, PM_FRAC(0.133974596215561353)); /* 1 - sqrt(3)/2 */
    pm_abc_t r;
    r.a = x.alpha;
    r.b = y - (x.alpha >> 1);
    r.c = -x.alpha - r.b; /* the sum is zero to the last bit */
    return r;
}

/* Half of pm_park(), for callers whose next product can include the factor two. */
static inline pm_dq_t pm_park_half(pm_ab_t x, pm_dir_t r)
{
    pm_dq_t y;
    y.d = pm_mulh_add(pm_mulh(x.alpha, r.cos), x.beta, r.sin);
    y.q = pm_mulh_sub(pm_mulh(x.beta, r.cos), x.alpha, r.sin);
    return y;
}

static inline pm_dq_t pm_park(pm_ab_t x, pm_dir_t r)
{
    pm_dq_t y = pm_park_half(x, r);
    y.d = pm_shl(y.d, 1);
    y.q = pm_shl(y.q, 1);
    return y;
}

static inline pm_ab_t pm_park_inverse(pm_dq_t x, pm_dir_t r)
{
    pm_ab_t y;
    y.alpha = pm_shl(pm_mulh_sub(pm_mulh(x.d, r.cos), x.q, r.sin), 1);
    y.beta = pm_shl(pm_mulh_add(pm_mulh(x.d, r.sin), x.q, r.cos), 1);
    return y;
}

/* Direction of the sum of two angles, halved. */
static inline pm_half_dir_t pm_dir_sum(pm_dir_t a, pm_dir_t b)
{
    pm_half_dir_t r;
    r.cos = pm_mulh_sub(pm_mulh(a.cos, b.cos), a.sin, b.sin);
    r.sin = pm_mulh_add(pm_mulh(a.sin, b.cos), a.cos, b.sin);
    return r;
}

/* Angle from one direction to another in rad, Q28; error below 2.5e-5 up to 0.2 rad, monotonous up to a
 * quarter turn. */
static inline pm_q_t pm_dir_turn(pm_dir_t from, pm_dir_t to)
{
    const int32_t s = pm_mulh_sub(pm_mulh(to.sin, from.cos), to.cos, from.sin); /* sine, Q30 */
    const int32_t cube = pm_mulh(s, pm_shl(pm_mulh(s, s), 2));                  /* Q28 */
    return pm_mulh_add(s >> 2, cube, PM_FRAC(0.166666666666666667));
}

/* A quarter of pm_park_inverse(): in Q28 for x in Q30. */
static inline pm_ab_t pm_park_inverse_quarter(pm_dq_t x, pm_half_dir_t r)
{
    pm_ab_t y;
    y.alpha = pm_mulh_sub(pm_mulh(x.d, r.cos), x.q, r.sin);
    y.beta = pm_mulh_add(pm_mulh(x.d, r.sin), x.q, r.cos);
    return y;
}

#endif
