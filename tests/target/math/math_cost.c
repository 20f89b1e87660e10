/* Every primitive once as a function, for count.py: arguments in registers, vectors through pointers, so a
 * count includes loads, stores and the return. See docs/decisions/001-signal-format.md. */
#include "firmware/math/filter.h"
#include "firmware/math/num.h"
#include "firmware/math/pi.h"
#include "firmware/math/pll.h"
#include "firmware/math/root.h"
#include "firmware/math/sogi.h"
#include "firmware/math/trig.h"

#define COST(result, name, ...)                                                                              \
    result cost_##name(__VA_ARGS__);                                                                         \
    __attribute__((noinline)) result cost_##name(__VA_ARGS__)

COST(pm_q_t, nothing, pm_q_t x)
{
    return x;
}

COST(pm_q_t, mul, pm_q_t x, pm_q_t y)
{
    return pm_mul(x, y);
}

COST(pm_q_t, mul_sat, pm_q_t x, pm_q_t y)
{
    return pm_mul_sat(x, y);
}

COST(pm_q_t, frac, pm_q_t x, pm_frac_t k)
{
    return pm_frac(x, k);
}

COST(void, dir, pm_angle_t angle, pm_dir_t *r)
{
    *r = pm_dir(angle);
}

COST(void, clarke, pm_q_t a, pm_q_t b, pm_q_t c, pm_ab_t *r)
{
    *r = pm_clarke((pm_abc_t){a, b, c});
}

COST(void, clarke_inverse, pm_q_t alpha, pm_q_t beta, pm_abc_t *r)
{
    *r = pm_clarke_inverse((pm_ab_t){alpha, beta});
}

COST(void, park, pm_q_t alpha, pm_q_t beta, const pm_dir_t *dir, pm_dq_t *r)
{
    *r = pm_park((pm_ab_t){alpha, beta}, *dir);
}

COST(void, park_inverse, pm_q_t d, pm_q_t q, const pm_dir_t *dir, pm_ab_t *r)
{
    *r = pm_park_inverse((pm_dq_t){d, q}, *dir);
}

/* With a limit of its own, as a controller that stands alone. */
COST(pm_wide_t, pi, pm_pi_t *self, const pm_pi_config_t *c, pm_q_t e, pm_wide_t limit)
{
    const pm_wide_t u = pm_pi_output(self, c, e, 0);
    const pm_wide_t limited = pm_clamp(u, -limit, limit);
    pm_pi_update(self, c, e, limited - u);
    return limited;
}

COST(void, pll, pm_pll_t *self, const pm_pll_config_t *c, pm_q_t eps)
{
    pm_pll_predict(self, c);
    pm_pll_correct(self, c, eps);
}

COST(pm_q_t, lp1, pm_q_t *y, pm_q_t x, pm_frac_t k)
{
    return pm_lp1(y, x, k);
}

COST(void, sogi, pm_sogi_t *self, const pm_dir_t *dir, pm_frac_t k, pm_q_t x)
{
    pm_sogi_step(self, *dir, k, x);
}

COST(int32_t, per_volt, pm_q_t v)
{
    return pm_per_volt(v);
}

/* So that no call is dropped for an unused result. */
static volatile int32_t sink;

static void use(const void *words, unsigned count)
{
    for (const int32_t *w = words; count > 0U; --count) {
        sink = *w++;
    }
}

static void use_num(pm_num_t x)
{
    use(&x, 2);
}

/* Spread over 32 bits; the values do not matter as long as all sizes and signs occur. */
static uint32_t next(void)
{
    static uint32_t x = 1U;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    return x;
}

static int32_t any(void)
{
    const uint32_t size = next() % 31U;
    return (int32_t)next() >> size;
}

int main(void)
{
    static pm_pi_t pi;
    static pm_pll_t pll;
    static pm_q_t y;
    static pm_sogi_t sogi;
    static pm_biquad_t biquad;
    const pm_pi_config_t pi_config = {PM_GAIN(2.0), PM_GAIN(0.1), PM_UNIT(0.05)};
    const pm_pll_config_t pll_config = {PM_FRAC(0.05), PM_FRAC(0.004), PM_Q(0.5)};
    const pm_biquad_config_t biquad_config = {1 << 25, 1 << 26, 1 << 25, -(1 << 29), 1 << 27};
    for (int k = 0; k < 400; ++k) {
        const pm_q_t x = any() >> 3, z = any() >> 3; /* within +-1 */
        pm_dir_t dir;
        pm_ab_t ab;
        pm_abc_t abc;
        pm_dq_t dq;
        sink = cost_nothing(x);
        sink = cost_mul(x, z);
        sink = cost_mul_sat(x, z);
        sink = cost_frac(x, z);
        cost_dir(next(), &dir);
        use(&dir, 2);
        cost_clarke(x, z, -x - z, &ab);
        use(&ab, 2);
        cost_clarke_inverse(x, z, &abc);
        use(&abc, 3);
        cost_park(x, z, &dir, &dq);
        use(&dq, 2);
        cost_park_inverse(x, z, &dir, &ab);
        use(&ab, 2);
        sink = cost_pi(&pi, &pi_config, x, PM_WIDE(0.8));
        cost_pll(&pll, &pll_config, x);
        sink = cost_lp1(&y, x, PM_FRAC(0.01));
        cost_sogi(&sogi, &dir, PM_FRAC(0.01), x);
        sink = pm_biquad_step(&biquad, &biquad_config, x);
        sink = (int32_t)pm_atan2(x, z);
        sink = pm_sqrt(x < 0 ? -x : x);
        sink = pm_hypot(x, z);
        sink = pm_div(x, (z < 0 ? -z : z) + 1);
        sink = pm_ratio(x < 0 ? -x : x, PM_ONE);
        sink = cost_per_volt(PM_Q(1.7));
        const pm_num_t a = pm_num(any() | 1), b = pm_num(any() | 1);
        use_num(pm_num_add(a, b));
        use_num(pm_num_mul(a, b));
        use_num(pm_num_div(a, b));
        use_num(pm_num_sqrt(a));
    }
    return 0;
}
