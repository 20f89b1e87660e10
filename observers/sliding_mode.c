#include "observers/sliding_mode.h"

#include "firmware/math/pair.h"
#include "firmware/math/root.h"

/* Within the boundary layer s is the voltage times this many periods. */
#define LAYER ((int32_t)(1 / SLIDING_MODE_STEP))

/* Delay of z, in periods, behind the mean EMF of the period that ends at the sample. Half a period is due to
 * that mean; the boundary layer adds the delay of its pole. The switching functions react to the sign alone
 * and are ahead of their input (tests/unit/observers/sliding_mode_test.cpp). */
static pm_q_t delay(sliding_mode_function_t function)
{
    switch (function) {
    case SLIDING_MODE_SIGN:
        return PM_Q(0.35);
    case SLIDING_MODE_SUPER_TWISTING:
        return PM_Q(-0.6);
    case SLIDING_MODE_SATURATION:
    case SLIDING_MODE_SIGMOID:
    default:
        return PM_Q((1 - SLIDING_MODE_STEP) / SLIDING_MODE_STEP + 0.5);
    }
}

/* Factor F that compensates the lag, z through the low-pass being e / F:
 *   F = (1 + j x b + x^2 b / 2) (1 + j x d - x^2 d^2 / 2)
 *   x = omega T_s
 *   b = 1 / k_lp - 1
 * d is the delay. */
static void set_lead(sliding_mode_t *self, const sliding_mode_config_t *config, pm_q_t omega)
{
    const pm_q_t x = pm_frac(omega, config->model.t_s);
    const pm_q_t bx = pm_sub_sat(pm_div(x, config->k_lp / 16), x);
    const pm_q_t dx = pm_mul(x, delay(config->function));
    self->lead_real = PM_ONE + pm_mul_sat(bx, pm_half(x) - dx) - pm_half(pm_mul(dx, dx));
    self->lead_imag = pm_add_sat(bx, dx);
}

static void set_gain(sliding_mode_t *self, const sliding_mode_config_t *config, pm_q_t emf)
{
    const pm_q_t K = config->k_base + pm_mul_sat(config->k_speed, emf);
    self->K = pm_clamp(K, PM_Q(0.001), PM_ONE);
    /* Q20 over Q28 to Q20 */
    self->steepness = pm_div(config->slope, self->K + pm_half(self->K));
}

/* Lambda = 1.5 omega^2 psi_a, and at least that of omega_min. */
static void set_twist(sliding_mode_t *self, const sliding_mode_config_t *config, pm_q_t speed, pm_q_t psi)
{
    const pm_q_t limit = pm_max(speed, config->omega_min);
    const pm_q_t change = pm_mul_sat(pm_mul(limit, limit), psi);
    const pm_q_t Lambda = change + pm_half(change);
    self->lambda = pm_shl(pm_sat(pm_mul(Lambda, PM_Q(2.25)), 27), 4);
    self->twist = pm_frac(pm_mul(Lambda, PM_Q(1.1)), config->model.t_s);
}

/* Terms that depend on current and speed, which change little within a millisecond. */
static void set_operating_point(sliding_mode_t *self, const sliding_mode_config_t *config, pm_q_t omega,
                                pm_dq_t i_dq, pm_q_t omega_min)
{
    const observer_model_t *model = &config->model;
    const pm_q_t L_q = pm_clamp(observer_L_q(model, i_dq), PM_Q(0.01), PM_Q(3.99));
    const pm_q_t psi = pm_max(observer_active_flux(model, i_dq), PM_Q(0.01));
    const pm_q_t speed = pm_min(pm_abs(omega), PM_Q(2.0));
    const pm_q_t reach = pm_max(speed, omega_min);
    self->inductance = pm_shl(L_q, 1);
    self->half_decay = pm_small(pm_half(pm_div(pm_frac(model->R, model->t_s), L_q)));

    /* 2 / (reach psi) times omega / reach; Q20 */
    const pm_q_t share = pm_div(speed, reach);
    const pm_q_t inverse = pm_div(PM_ONE / 128, pm_max(pm_mul(reach, psi), PM_Q(0.001)));
    const pm_q_t per_emf = pm_mul_sat(inverse, share);
    self->per_emf = omega < 0 ? -per_emf : per_emf;
    self->expected = pm_mul(share, share);
    set_lead(self, config, omega);
    set_gain(self, config, pm_mul(speed, psi));
    set_twist(self, config, speed, psi);
}

/* Steady state at this speed and current. */
void sliding_mode_reset(sliding_mode_t *self, const sliding_mode_config_t *config, const obs_in_t *in)
{
    *self = (sliding_mode_t){0};
    set_operating_point(self, config, in->omega, in->i_dq, config->omega_min);
    const pm_q_t emf = pm_mul(in->omega, observer_active_flux(&config->model, in->i_dq));
    self->vector = (pm_dq_t){.d = 0, .q = emf / 32};
    self->z = pm_park_inverse((pm_dq_t){.d = 0, .q = emf}, in->dir);
    self->w = self->z;
    const pm_q_t real = self->lead_real, imag = self->lead_imag;
    const pm_q_t square = pm_add_sat(pm_mul_sat(real, real), pm_mul_sat(imag, imag));
    const pm_dq_t lagging = {.d = pm_div(pm_mul(emf, imag), square), .q = pm_div(pm_mul(emf, real), square)};
    self->e = pm_park_inverse(lagging, in->dir);
    const pm_ab_t layer = {.alpha = pm_frac(self->z.alpha, config->model.t_s),
                           .beta = pm_frac(self->z.beta, config->model.t_s)};
    self->y.alpha = pm_shl(pm_mulh(in->i.alpha, self->inductance), 3) + LAYER * layer.alpha;
    self->y.beta = pm_shl(pm_mulh(in->i.beta, self->inductance), 3) + LAYER * layer.beta;
}

static inline pm_q_t sign_of(pm_q_t s, pm_q_t K)
{
    return s > 0 ? K : (s < 0 ? -K : 0);
}

static inline pm_q_t limited(pm_q_t x, pm_q_t K)
{
    return pm_clamp(x, -K, K);
}

static inline pm_q_t sigmoid(const sliding_mode_t *self, pm_q_t s)
{
    const pm_q_t x = pm_small_gain(pm_small(s), self->steepness);
    const pm_q_t factor = PM_Q(1.5) - pm_half(pm_mul(x, x));
    return pm_mul(pm_mul(x, self->K), factor);
}

static inline pm_q_t twisted(const sliding_mode_t *self, pm_q_t *w, pm_q_t s)
{
    const int32_t square = pm_mulh(pm_magnitude(s), self->lambda); /* Q28 */
    const pm_q_t root = pm_shl(pm_root_twice(square), PM_Q_BITS / 2 - 1);
    const pm_q_t next = s < 0 ? *w - self->twist : *w + self->twist;
    *w = pm_sat(next, PM_Q_BITS);
    return s < 0 ? next - root : next + root;
}

static inline pm_ab_t switched(sliding_mode_t *self, const sliding_mode_config_t *config, pm_ab_t s)
{
    pm_ab_t z;
    switch (config->function) {
    case SLIDING_MODE_SIGN:
        z = (pm_ab_t){.alpha = sign_of(s.alpha, self->K), .beta = sign_of(s.beta, self->K)};
        break;
    case SLIDING_MODE_SIGMOID:
        z = (pm_ab_t){.alpha = sigmoid(self, s.alpha), .beta = sigmoid(self, s.beta)};
        break;
    case SLIDING_MODE_SUPER_TWISTING:
        z.alpha = twisted(self, &self->w.alpha, s.alpha);
        z.beta = twisted(self, &self->w.beta, s.beta);
        break;
    case SLIDING_MODE_SATURATION:
    default:
        z.alpha = limited(pm_small_gain(pm_small(s.alpha), config->slope), self->K);
        z.beta = limited(pm_small_gain(pm_small(s.beta), config->slope), self->K);
        break;
    }
    return z;
}

/* L_q (i^ - i) after a period with the mean current of its ends. Beyond the range of y the position is lost
 * anyway. */
static inline pm_q_t advance(const sliding_mode_t *self, pm_q_t *y, pm_q_t v, pm_q_t i, pm_frac_t t_s)
{
    const pm_q_t next = pm_frac_add(*y, v, t_s);
    *y = pm_sat(pm_mulh_sub(next, next + *y, self->half_decay), PM_Q_BITS + 1);
    return *y - pm_shl(pm_mulh(i, self->inductance), 3);
}

/* Relative to the amplitude of the EMF; within +-1 of the base, halved to fit. */
static inline pm_q_t relative(const sliding_mode_t *self, int32_t e)
{
    return pm_small_gain(pm_shl(pm_sat(e, 23), 8), self->per_emf);
}

static inline void describe(const sliding_mode_t *self, pm_dq_t vector, obs_out_t *out)
{
    out->vector = (pm_dq_t){.d = pm_shl(vector.d, 5), .q = pm_shl(vector.q, 5)};
    out->eps = -relative(self, vector.d);
    out->misfit = pm_sat(relative(self, vector.q) - self->expected, PM_Q_BITS);
}

void sliding_mode_step(sliding_mode_t *self, const sliding_mode_config_t *config, const obs_in_t *in,
                       obs_out_t *out)
{
    const pm_frac_t t_s = config->model.t_s;
    pm_ab_t s;
    s.alpha = advance(self, &self->y.alpha, in->v.alpha - self->z.alpha, in->i.alpha, t_s);
    s.beta = advance(self, &self->y.beta, in->v.beta - self->z.beta, in->i.beta, t_s);
    self->z = switched(self, config, s);

    pm_ab_t e = pm_pair_ab(&self->e);
    e.alpha = pm_frac_add(e.alpha, self->z.alpha - e.alpha, config->k_lp);
    e.beta = pm_frac_add(e.beta, self->z.beta - e.beta, config->k_lp);
    self->e = e;

    const pm_dq_t half = pm_park_half(e, in->dir); /* Q27 */
    const pm_pair_t lead = pm_pair(&self->lead_real, &self->lead_imag);
    const pm_dq_t vector = {.d = pm_mulh_sub(pm_mulh(half.d, lead.first), half.q, lead.second),
                            .q = pm_mulh_add(pm_mulh(half.q, lead.first), half.d, lead.second)};
    self->vector = vector;
    describe(self, vector, out);
}

obs_out_t sliding_mode_last(const sliding_mode_t *self)
{
    obs_out_t out;
    describe(self, self->vector, &out);
    return out;
}

void sliding_mode_tie(sliding_mode_t *self, const sliding_mode_config_t *config)
{
    (void)self;
    (void)config;
}

void sliding_mode_slow(sliding_mode_t *self, const sliding_mode_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    set_operating_point(self, config, in->omega, in->i_dq,
                        weight == 0 ? config->omega_tie : config->omega_min);
}
