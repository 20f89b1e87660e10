/* Every function of firmware/math over the same values, as one number: it must be the same on every machine.
 * Used by tests/unit/math/bits_test.cpp on the host and by math_bits.c on the target. */
#ifndef TESTS_TARGET_MATH_SAME_BITS_H
#define TESTS_TARGET_MATH_SAME_BITS_H

#include "firmware/math/filter.h"
#include "firmware/math/num.h"
#include "firmware/math/pi.h"
#include "firmware/math/pll.h"
#include "firmware/math/root.h"
#include "firmware/math/sogi.h"
#include "firmware/math/trig.h"

typedef struct {
    uint32_t hash, random;
} same_bits_t;

static inline void same_bits_add(same_bits_t *self, int32_t x)
{
    self->hash = (self->hash ^ (uint32_t)x) * 16777619U;
    self->hash ^= self->hash >> 15;
}

static inline void same_bits_num(same_bits_t *self, pm_num_t x)
{
    same_bits_add(self, x.m);
    same_bits_add(self, x.e);
}

static inline int32_t same_bits_word(same_bits_t *self)
{
    self->random ^= self->random << 13;
    self->random ^= self->random >> 17;
    self->random ^= self->random << 5;
    return (int32_t)self->random;
}

/* Every size as often, and the ends of the range now and then. */
static inline int32_t same_bits_any(same_bits_t *self)
{
    const uint32_t kind = (uint32_t)same_bits_word(self) >> 16 & 63U;
    const int32_t x = same_bits_word(self);
    return kind == 63U ? INT32_MAX : (kind == 62U ? INT32_MIN : x >> (kind & 31U));
}

static inline void same_bits_products(same_bits_t *b)
{
    const int32_t x = same_bits_any(b), y = same_bits_any(b), z = same_bits_any(b);
    same_bits_add(b, pm_mulh(x, y));
    same_bits_add(b, pm_mulh_add(z, x, y));
    same_bits_add(b, pm_mulh_sub(z, x, y));
    same_bits_add(b, pm_mul(x, y));
    same_bits_add(b, pm_mul_sat(x, y));
    same_bits_add(b, pm_unit(x, y));
    same_bits_add(b, pm_add_sat(x, y));
    same_bits_add(b, pm_sub_sat(x, y));
    same_bits_add(b, pm_sat(x, 20));
    same_bits_add(b, pm_narrow_sat(x));
    same_bits_add(b, pm_abs(x));
    same_bits_add(b, pm_magnitude(x));
    same_bits_add(b, pm_zone_add(y, x, z));
    same_bits_add(b, pm_zone_sub(y, x, z));
    same_bits_add(b, pm_share_of(x, pm_share_whole(4250)));
    same_bits_add(b, pm_rad_to_angle(x));
    same_bits_add(b, pm_angle_to_rad(x));
}

static inline void same_bits_functions(same_bits_t *b)
{
    const int32_t x = same_bits_any(b), y = same_bits_any(b);
    const int32_t size = y == INT32_MIN ? 1 : (y < 0 ? -y : y);
    same_bits_add(b, (int32_t)pm_atan2(y, x));
    same_bits_add(b, pm_sqrt(x));
    same_bits_add(b, pm_hypot(x, y));
    same_bits_add(b, pm_div(x, y));
    same_bits_add(b, pm_ratio(size >> 1, size | 1));
    same_bits_add(b, pm_per_volt(PM_ONE + (x & (PM_ONE - 1))));
    const pm_dir_t dir = pm_dir((pm_angle_t)x);
    pm_ab_t vector;
    vector.alpha = x / 4;
    vector.beta = y / 4;
    const pm_ab_t ab = pm_clarke(pm_clarke_inverse(pm_park_inverse(pm_park(vector, dir), dir)));
    same_bits_add(b, ab.alpha);
    same_bits_add(b, ab.beta);
    pm_half_dir_t ahead = pm_dir_sum(dir, pm_dir((pm_angle_t)y));
    same_bits_add(b, ahead.cos);
    same_bits_add(b, ahead.sin);
    const pm_ab_t quarter = pm_park_inverse_quarter(pm_park_half(vector, dir), ahead);
    same_bits_add(b, quarter.alpha);
    same_bits_add(b, quarter.beta);
    const pm_num_t p = pm_num_from_fixed(x, 22), q = pm_num_dec(y, -3);
    same_bits_num(b, pm_num_add(p, q));
    same_bits_num(b, pm_num_mul(p, q));
    same_bits_num(b, pm_num_div(p, q));
    same_bits_num(b, pm_num_sqrt(p));
    int32_t fixed;
    same_bits_add(b, pm_num_to_fixed(q, 10, &fixed) ? fixed : 1);
}

typedef struct {
    pm_pi_t pi;
    pm_pll_t pll;
    pm_sogi_t sogi;
    pm_biquad_t biquad;
    pm_q_t y;
} same_bits_loops_t;

static inline void same_bits_loops(same_bits_t *b, same_bits_loops_t *s)
{
    const pm_pi_config_t pi = {PM_GAIN(2.0), PM_GAIN(0.1), PM_UNIT(0.05)};
    const pm_pll_config_t pll = {PM_FRAC(0.05), PM_FRAC(0.004), PM_Q(0.5)};
    const pm_biquad_config_t biquad = {1 << 25, 1 << 26, 1 << 25, -(1 << 29), 1 << 27};
    const pm_q_t x = same_bits_any(b) >> 2;
    const pm_wide_t u = pm_pi_output(&s->pi, &pi, x, x);
    pm_pi_update(&s->pi, &pi, x, pm_clamp(u, -PM_WIDE(1.0), PM_WIDE(1.0)) - u);
    same_bits_add(b, s->pi.integral);
    pm_pll_predict(&s->pll, &pll);
    pm_pll_correct(&s->pll, &pll, x);
    same_bits_add(b, (int32_t)s->pll.theta);
    same_bits_add(b, s->pll.omega);
    pm_sogi_step(&s->sogi, pm_dir(PM_TURN(0.03)), PM_FRAC(0.02), x);
    same_bits_add(b, s->sogi.y);
    same_bits_add(b, s->sogi.q);
    same_bits_add(b, pm_biquad_step(&s->biquad, &biquad, x));
    same_bits_add(b, pm_lp1(&s->y, x, PM_FRAC(0.01)));
}

static inline uint32_t same_bits(int rounds)
{
    same_bits_t b = {2166136261U, 1U};
    same_bits_loops_t loops = {{0}, {0, 0}, {0, 0, 0}, {0, 0}, 0};
    for (int k = 0; k < rounds; ++k) {
        same_bits_products(&b);
        same_bits_functions(&b);
        same_bits_loops(&b, &loops);
    }
    return b.hash;
}

/* What one machine found; a change of any result of firmware/math on purpose changes it. */
#define SAME_BITS_ROUNDS   20000
#define SAME_BITS_EXPECTED 0x227036b1U

#endif
