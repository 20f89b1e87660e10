/* 16-bit signals of a full scale of 4 pu with 32-bit accumulators, as on 16-bit DSPs: 16 x 16
 * multiplications, rounding back to 16 bits, saturation of every stored signal. */
#include "firmware/math/fixed.h"
#include "tests/target/math/formats.h"

typedef struct {
    int32_t psi_alpha, psi_beta, integral_d, integral_q; /* accumulators, Q31 of full scale */
    int16_t i_d, i_q, u_alpha, u_beta;
} state_t;

typedef struct {
    int16_t kp; /* Q13 */
    int16_t ki, kb, k_flux, leak, r, limit;
} config_t;

typedef struct {
    int16_t i_a, i_b, i_c, v_alpha, v_beta, d_ref, q_ref;
    uint16_t theta; /* 2^16 per turn */
} in_t;

typedef struct {
    int16_t cos, sin;
} direction_t;

static state_t state;
static config_t config;

static int16_t q15_table[1024 + 256]; /* sine, and a quarter more so that the cosine can be read from it */

static inline int32_t sat16(int32_t x)
{
    return pm_sat(x, 15);
}

/* Q30 of a sum of products to Q15. */
static inline int16_t narrow(int32_t x)
{
    return (int16_t)sat16((x + (1 << 14)) >> 15);
}

/* The nearest of 1024 steps of a turn; 10 bits are an error of 0.003. */
static inline direction_t direction(uint16_t angle)
{
    const uint32_t index = ((uint32_t)angle + 32U) >> 6 & 1023U;
    return (direction_t){q15_table[index + 256U], q15_table[index]};
}

static inline int32_t integrate(int32_t psi, int16_t v, int16_t i, const config_t *c)
{
    const int16_t emf = (int16_t)sat16(v - ((i * c->r + (1 << 14)) >> 15));
    const int16_t old = (int16_t)(psi >> 16);
    return pm_add_sat(psi, pm_shl(emf * c->k_flux - old * c->leak, 1));
}

static inline int16_t control(int32_t *integral, int16_t e, const config_t *c)
{
    const int32_t u = ((e * c->kp + (1 << 12)) >> 13) + (*integral >> 16);
    const int32_t limited = pm_clamp(u, -c->limit, c->limit);
    const int32_t excess = sat16(limited - u);
    *integral = pm_add_sat(*integral, pm_shl(e * c->ki + excess * c->kb, 1));
    return (int16_t)limited;
}

void kernel_q15(state_t *s, const config_t *c, const in_t *in);

__attribute__((noinline)) void kernel_q15(state_t *s, const config_t *c, const in_t *in)
{
    const int16_t third = 10923, root = 18919; /* 1/3, 1/sqrt(3) */
    const int16_t i_alpha = narrow(in->i_a * 2 * third - (in->i_b + in->i_c) * third);
    const int16_t i_beta = narrow((in->i_b - in->i_c) * root);

    s->psi_alpha = integrate(s->psi_alpha, in->v_alpha, i_alpha, c);
    s->psi_beta = integrate(s->psi_beta, in->v_beta, i_beta, c);

    const direction_t dir = direction(in->theta);
    s->i_d = narrow(i_alpha * dir.cos + i_beta * dir.sin);
    s->i_q = narrow(i_beta * dir.cos - i_alpha * dir.sin);
    const int16_t u_d = control(&s->integral_d, (int16_t)sat16(in->d_ref - s->i_d), c);
    const int16_t u_q = control(&s->integral_q, (int16_t)sat16(in->q_ref - s->i_q), c);
    s->u_alpha = narrow(u_d * dir.cos - u_q * dir.sin);
    s->u_beta = narrow(u_d * dir.sin + u_q * dir.cos);
}

static int16_t q15(double x)
{
    return (int16_t)(x * 0x1p15 + (x < 0 ? -0.5 : 0.5));
}

static int16_t signal(double x) /* full scale 4 */
{
    return q15(x / 4);
}

/* No libm on the target: turned step by step in double, good to 1e-12. */
static void make_table(void)
{
    double c = 1, s = 0;
    for (int k = 0; k < 1024 + 256; ++k) {
        q15_table[k] = (int16_t)(s * 32767 + (s < 0 ? -0.5 : 0.5));
        const double next = c * 0.99998117528260114 - s * 0.0061358846491544753;
        s = s * 0.99998117528260114 + c * 0.0061358846491544753;
        c = next;
    }
}

static void reset(bool leak)
{
    make_table();
    state = (state_t){0};
    config = (config_t){q15(FORMAT_KP / 4),          q15(FORMAT_KI), q15(FORMAT_KB),      q15(FORMAT_K_FLUX),
                        leak ? q15(FORMAT_LEAK) : 0, q15(FORMAT_R),  signal(FORMAT_LIMIT)};
}

static format_out_t step(const format_in_t *in)
{
    const in_t fixed = {
        signal(in->i_a),    signal(in->i_b),   signal(in->i_c),   signal(in->v_alpha),
        signal(in->v_beta), signal(in->d_ref), signal(in->q_ref), (uint16_t)((in->theta + 0x8000U) >> 16)};
    kernel_q15(&state, &config, &fixed);
    return (format_out_t){state.psi_alpha * 0x1p-29, state.psi_beta * 0x1p-29, state.i_d * 0x1p-13,
                          state.i_q * 0x1p-13,       state.u_alpha * 0x1p-13,  state.u_beta * 0x1p-13};
}

const format_t format_q15 = {"Q15, 16-bit signals", reset, step};
