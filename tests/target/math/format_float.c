/* Single precision on the FPU. The direction comes from a table turned by the rest, as in the firmware. */
#include "tests/target/math/formats.h"

typedef struct {
    float psi_alpha, psi_beta, i_d, i_q, integral_d, integral_q, u_alpha, u_beta;
} state_t;

typedef struct {
    float kp, ki, kb, k_flux, leak, r, limit;
} config_t;

typedef struct {
    float i_a, i_b, i_c, v_alpha, v_beta, d_ref, q_ref;
    uint32_t theta;
} in_t;

typedef struct {
    float cos, sin;
} direction_t;

static state_t state;
static config_t config;
static direction_t table[128];

static inline float clamp(float x, float limit)
{
    return x > limit ? limit : (x < -limit ? -limit : x);
}

static inline direction_t direction(uint32_t angle)
{
    const direction_t near = table[(angle + (1U << 24)) >> 25];
    const float rest = (float)(int32_t)(angle << 7) * 1.14281869e-11F; /* 2 pi / 2^39, cubic term spread */
    const float half = 0.5F * rest;
    return (direction_t){near.cos - rest * (near.sin + half * near.cos),
                         near.sin + rest * (near.cos - half * near.sin)};
}

static inline float integrate(float psi, float v, float i, const config_t *c)
{
    return psi + c->k_flux * (v - c->r * i) - c->leak * psi;
}

static inline float control(float *integral, float e, const config_t *c)
{
    const float u = c->kp * e + *integral;
    const float limited = clamp(u, c->limit);
    *integral += c->ki * e + c->kb * (limited - u);
    return limited;
}

void kernel_float(state_t *s, const config_t *c, const in_t *in);

__attribute__((noinline)) void kernel_float(state_t *s, const config_t *c, const in_t *in)
{
    const float i_alpha = (2.0F * in->i_a - in->i_b - in->i_c) * 0.33333333F;
    const float i_beta = (in->i_b - in->i_c) * 0.57735027F;

    s->psi_alpha = integrate(s->psi_alpha, in->v_alpha, i_alpha, c);
    s->psi_beta = integrate(s->psi_beta, in->v_beta, i_beta, c);

    const direction_t dir = direction(in->theta);
    s->i_d = i_alpha * dir.cos + i_beta * dir.sin;
    s->i_q = i_beta * dir.cos - i_alpha * dir.sin;
    const float u_d = control(&s->integral_d, in->d_ref - s->i_d, c);
    const float u_q = control(&s->integral_q, in->q_ref - s->i_q, c);
    s->u_alpha = u_d * dir.cos - u_q * dir.sin;
    s->u_beta = u_d * dir.sin + u_q * dir.cos;
}

static void reset(bool leak)
{
    double c = 1, s = 0; /* no libm on the target */
    for (int k = 0; k < 128; ++k) {
        table[k] = (direction_t){(float)c, (float)s};
        const double next = c * 0.99879545620517239 - s * 0.049067674327418015;
        s = s * 0.99879545620517239 + c * 0.049067674327418015;
        c = next;
    }
    state = (state_t){0};
    config = (config_t){(float)FORMAT_KP,
                        (float)FORMAT_KI,
                        (float)FORMAT_KB,
                        (float)FORMAT_K_FLUX,
                        leak ? (float)FORMAT_LEAK : 0.0F,
                        (float)FORMAT_R,
                        (float)FORMAT_LIMIT};
}

static format_out_t step(const format_in_t *in)
{
    const in_t single = {(float)in->i_a,    (float)in->i_b,   (float)in->i_c,   (float)in->v_alpha,
                         (float)in->v_beta, (float)in->d_ref, (float)in->q_ref, in->theta};
    kernel_float(&state, &config, &single);
    return (format_out_t){(double)state.psi_alpha, (double)state.psi_beta, (double)state.i_d,
                          (double)state.i_q,       (double)state.u_alpha,  (double)state.u_beta};
}

const format_t format_float = {"float, FPU", reset, step};
