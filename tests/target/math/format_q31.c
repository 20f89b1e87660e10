/* Q31 of a full scale of 4 pu: one more bit than Q29 signals, but no guard bits, so every sum saturates.
 * Products keep the truncated upper half (SMMUL) and are doubled. */
#include "firmware/math/fixed.h"
#include "firmware/math/trig.h"
#include "tests/target/math/formats.h"

typedef int32_t q31_t;

typedef struct {
    q31_t psi_alpha, psi_beta, i_d, i_q, integral_d, integral_q, u_alpha, u_beta;
} state_t;

typedef struct {
    q31_t kp; /* divided by 4 */
    q31_t ki, kb, k_flux, leak, r, limit;
} config_t;

typedef struct {
    q31_t i_a, i_b, i_c, v_alpha, v_beta, d_ref, q_ref;
    uint32_t theta;
} in_t;

static state_t state;
static config_t config;

#if defined(__ARM_FEATURE_DSP)
static inline q31_t half(q31_t a, q31_t b)
{
    q31_t r;
    __asm__("smmul %0, %1, %2" : "=r"(r) : "r"(a), "r"(b));
    return r;
}
#else
static inline q31_t half(q31_t a, q31_t b)
{
    return (q31_t)(((int64_t)a * b) >> 32);
}
#endif

static inline q31_t mul(q31_t a, q31_t b)
{
    return pm_shl(half(a, b), 1);
}

static inline q31_t integrate(q31_t psi, q31_t v, q31_t i, const config_t *c)
{
    const q31_t emf = pm_sub_sat(v, mul(i, c->r));
    return pm_sub_sat(pm_add_sat(psi, mul(emf, c->k_flux)), mul(psi, c->leak));
}

static inline q31_t control(q31_t *integral, q31_t e, const config_t *c)
{
    const q31_t p = pm_shl(pm_sat(half(e, c->kp), 28), 3); /* kp / 4 and half */
    const q31_t u = pm_add_sat(p, *integral);
    const q31_t limited = pm_clamp(u, -c->limit, c->limit);
    const q31_t i = pm_add_sat(*integral, mul(e, c->ki));
    *integral = pm_add_sat(i, mul(pm_sub_sat(limited, u), c->kb));
    return limited;
}

void kernel_q31(state_t *s, const config_t *c, const in_t *in);

__attribute__((noinline)) void kernel_q31(state_t *s, const config_t *c, const in_t *in)
{
    const q31_t third = 715827883, root = 1239850262; /* 1/3, 1/sqrt(3) */
    const q31_t bc = pm_add_sat(mul(in->i_b, third), mul(in->i_c, third));
    const q31_t i_alpha = pm_sub_sat(mul(in->i_a, 2 * third), bc);
    const q31_t i_beta = pm_sub_sat(mul(in->i_b, root), mul(in->i_c, root));

    s->psi_alpha = integrate(s->psi_alpha, in->v_alpha, i_alpha, c);
    s->psi_beta = integrate(s->psi_beta, in->v_beta, i_beta, c);

    const pm_dir_t dir = pm_dir(in->theta);
    s->i_d = pm_add_sat(mul(i_alpha, dir.cos), mul(i_beta, dir.sin));
    s->i_q = pm_sub_sat(mul(i_beta, dir.cos), mul(i_alpha, dir.sin));
    const q31_t u_d = control(&s->integral_d, pm_sub_sat(in->d_ref, s->i_d), c);
    const q31_t u_q = control(&s->integral_q, pm_sub_sat(in->q_ref, s->i_q), c);
    s->u_alpha = pm_sub_sat(mul(u_d, dir.cos), mul(u_q, dir.sin));
    s->u_beta = pm_add_sat(mul(u_d, dir.sin), mul(u_q, dir.cos));
}

static q31_t q31(double x)
{
    return (q31_t)(x * 0x1p31);
}

static q31_t signal(double x) /* full scale 4 */
{
    return (q31_t)(x * 0x1p29);
}

static void reset(bool leak)
{
    state = (state_t){0};
    config = (config_t){q31(FORMAT_KP / 4),          q31(FORMAT_KI), q31(FORMAT_KB),      q31(FORMAT_K_FLUX),
                        leak ? q31(FORMAT_LEAK) : 0, q31(FORMAT_R),  signal(FORMAT_LIMIT)};
}

static format_out_t step(const format_in_t *in)
{
    const in_t fixed = {signal(in->i_a),    signal(in->i_b),   signal(in->i_c),   signal(in->v_alpha),
                        signal(in->v_beta), signal(in->d_ref), signal(in->q_ref), in->theta};
    kernel_q31(&state, &config, &fixed);
    return (format_out_t){state.psi_alpha * 0x1p-29, state.psi_beta * 0x1p-29, state.i_d * 0x1p-29,
                          state.i_q * 0x1p-29,       state.u_alpha * 0x1p-29,  state.u_beta * 0x1p-29};
}

const format_t format_q31 = {"Q31, SMMUL, saturating", reset, step};
