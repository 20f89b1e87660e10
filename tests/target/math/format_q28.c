/* Q28 per-unit, constants in the format that suits them: the firmware's own functions. */
#include "firmware/math/pi.h"
#include "firmware/math/trig.h"
#include "tests/target/math/formats.h"

typedef struct {
    pm_ab_t psi;
    pm_dq_t i;
    pm_pi_t d, q;
    pm_ab_t u;
} state_t;

typedef struct {
    pm_pi_config_t pi;
    pm_frac_t k_flux, leak, r;
    pm_wide_t limit;
} config_t;

typedef struct {
    pm_abc_t i;
    pm_ab_t v;
    pm_dq_t ref;
    pm_angle_t theta;
} in_t;

static state_t state;
static config_t config;

static inline pm_q_t integrate(pm_q_t psi, pm_q_t v, pm_q_t i, const config_t *c)
{
    const pm_q_t emf = pm_mulh_sub(v, i, c->r);
    return pm_mulh_sub(pm_frac_add(psi, emf, c->k_flux), psi, c->leak);
}

static inline pm_q_t control(pm_pi_t *pi, pm_q_t e, const config_t *c)
{
    const pm_wide_t u = pm_pi_output(pi, &c->pi, e, 0);
    const pm_wide_t limited = pm_clamp(u, -c->limit, c->limit);
    pm_pi_update(pi, &c->pi, e, limited - u);
    return pm_narrow(limited);
}

void kernel_q28(state_t *s, const config_t *c, const in_t *in);

__attribute__((noinline)) void kernel_q28(state_t *s, const config_t *c, const in_t *in)
{
    const pm_ab_t i = pm_clarke(in->i);
    s->psi.alpha = integrate(s->psi.alpha, in->v.alpha, i.alpha, c);
    s->psi.beta = integrate(s->psi.beta, in->v.beta, i.beta, c);
    const pm_dir_t dir = pm_dir(in->theta);
    s->i = pm_park(i, dir);
    pm_dq_t u;
    u.d = control(&s->d, in->ref.d - s->i.d, c);
    u.q = control(&s->q, in->ref.q - s->i.q, c);
    s->u = pm_park_inverse(u, dir);
}

static void reset(bool leak)
{
    state = (state_t){0};
    config = (config_t){
        .pi = {.kp = PM_GAIN(FORMAT_KP), .ki = PM_GAIN(FORMAT_KI), .kb = PM_UNIT(FORMAT_KB)},
        .k_flux = PM_FRAC(FORMAT_K_FLUX),
        .leak = leak ? PM_FRAC(FORMAT_LEAK) : 0,
        .r = PM_FRAC(FORMAT_R),
        .limit = PM_WIDE(FORMAT_LIMIT),
    };
}

static pm_q_t q(double x)
{
    return (pm_q_t)(x * 0x1p28);
}

static format_out_t step(const format_in_t *in)
{
    const in_t fixed = {{q(in->i_a), q(in->i_b), q(in->i_c)},
                        {q(in->v_alpha), q(in->v_beta)},
                        {q(in->d_ref), q(in->q_ref)},
                        in->theta};
    kernel_q28(&state, &config, &fixed);
    return (format_out_t){state.psi.alpha * 0x1p-28, state.psi.beta * 0x1p-28, state.i.d * 0x1p-28,
                          state.i.q * 0x1p-28,       state.u.alpha * 0x1p-28,  state.u.beta * 0x1p-28};
}

const format_t format_q28 = {"Q28, upper half", reset, step};
