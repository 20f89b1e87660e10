/* Q24 for everything: one format for signals and constants, the 64-bit product is put together again by
 * shifts. */
#include "firmware/math/fixed.h"
#include "firmware/math/trig.h"
#include "tests/target/math/formats.h"

typedef int32_t q24_t;

typedef struct {
    q24_t psi_alpha, psi_beta, i_d, i_q, integral_d, integral_q, u_alpha, u_beta;
} state_t;

typedef struct {
    q24_t kp, ki, kb, k_flux, leak, r, limit;
} config_t;

typedef struct {
    q24_t i_a, i_b, i_c, v_alpha, v_beta, d_ref, q_ref;
    uint32_t theta;
} in_t;

static state_t state;
static config_t config;

static inline q24_t mul(q24_t a, q24_t b)
{
    return (q24_t)(((int64_t)a * b) >> 24);
}

/* Two products are added at full length before the shift. */
static inline q24_t mul2(q24_t a, q24_t b, q24_t c, q24_t d)
{
    return (q24_t)(((int64_t)a * b + (int64_t)c * d) >> 24);
}

static inline q24_t integrate(q24_t psi, q24_t v, q24_t i, const config_t *c)
{
    return psi + mul2(v - mul(i, c->r), c->k_flux, psi, -c->leak);
}

static inline q24_t control(q24_t *integral, q24_t e, const config_t *c)
{
    const q24_t u = mul(e, c->kp) + *integral;
    const q24_t limited = pm_clamp(u, -c->limit, c->limit);
    *integral += mul2(e, c->ki, limited - u, c->kb);
    return limited;
}

void kernel_q24(state_t *s, const config_t *c, const in_t *in);

__attribute__((noinline)) void kernel_q24(state_t *s, const config_t *c, const in_t *in)
{
    const q24_t third = 5592405, root = 9686330; /* 1/3, 1/sqrt(3) */
    const q24_t i_alpha = mul(2 * in->i_a - in->i_b - in->i_c, third);
    const q24_t i_beta = mul(in->i_b - in->i_c, root);

    s->psi_alpha = integrate(s->psi_alpha, in->v_alpha, i_alpha, c);
    s->psi_beta = integrate(s->psi_beta, in->v_beta, i_beta, c);

    const pm_dir_t dir = pm_dir(in->theta);
    const q24_t cos = dir.cos >> 7, sin = dir.sin >> 7;
    s->i_d = mul2(i_alpha, cos, i_beta, sin);
    s->i_q = mul2(i_beta, cos, -i_alpha, sin);
    const q24_t u_d = control(&s->integral_d, in->d_ref - s->i_d, c);
    const q24_t u_q = control(&s->integral_q, in->q_ref - s->i_q, c);
    s->u_alpha = mul2(u_d, cos, -u_q, sin);
    s->u_beta = mul2(u_d, sin, u_q, cos);
}

static q24_t q(double x)
{
    return (q24_t)(x * 0x1p24 + (x < 0 ? -0.5 : 0.5));
}

static void reset(bool leak)
{
    state = (state_t){0};
    config =
        (config_t){q(FORMAT_KP), q(FORMAT_KI),   q(FORMAT_KB), q(FORMAT_K_FLUX), leak ? q(FORMAT_LEAK) : 0,
                   q(FORMAT_R),  q(FORMAT_LIMIT)};
}

static format_out_t step(const format_in_t *in)
{
    const in_t fixed = {q(in->i_a),    q(in->i_b),   q(in->i_c),   q(in->v_alpha),
                        q(in->v_beta), q(in->d_ref), q(in->q_ref), in->theta};
    kernel_q24(&state, &config, &fixed);
    return (format_out_t){state.psi_alpha * 0x1p-24, state.psi_beta * 0x1p-24, state.i_d * 0x1p-24,
                          state.i_q * 0x1p-24,       state.u_alpha * 0x1p-24,  state.u_beta * 0x1p-24};
}

const format_t format_q24 = {"Q24, SMULL and shifts", reset, step};
