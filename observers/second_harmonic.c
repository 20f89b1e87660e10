#include "observers/second_harmonic.h"

#include "firmware/math/image.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#if !PM_HAS(second_harmonic)

/* Left out; second_harmonic_config.c refuses it. */
void second_harmonic_reset(second_harmonic_t *self)
{
    (void)self;
}

pm_q_t second_harmonic_step(second_harmonic_t *self, const second_harmonic_config_t *config, pm_dir_t dir,
                            pm_q_t eps)
{
    (void)self;
    (void)config;
    (void)dir;
    return eps;
}

void second_harmonic_slow(second_harmonic_t *self, const second_harmonic_config_t *config, pm_q_t omega,
                          pm_q_t weight)
{
    (void)self;
    (void)config;
    (void)omega;
    (void)weight;
}

#else

/* Time constant, in ms, with which the estimate fades while it does not learn. */
#define FADE 20

void second_harmonic_reset(second_harmonic_t *self)
{
    *self = (second_harmonic_t){.turn = {.cos = PM_UNIT_MAX, .sin = 0}};
}

/* Twice the angle, Q30. */
static pm_half_dir_t twice(pm_dir_t dir)
{
    return pm_dir_sum(dir, dir);
}

/* With x = 2 theta and y = a cos x + b sin x the resonator's other state is q = a sin x - b cos x, which is its own inverse. */
void second_harmonic_change(second_harmonic_t *self, second_harmonic_id_t from, second_harmonic_id_t to,
                            pm_angle_t theta)
{
    if (from == SECOND_HARMONIC_STAYS || to == SECOND_HARMONIC_STAYS) {
        second_harmonic_reset(self);
        return;
    }
    const pm_dq_t mirrored = {.d = self->a, .q = -self->b};
    const pm_ab_t turned = pm_park_inverse(mirrored, pm_dir(2U * theta));
    self->a = turned.alpha;
    self->b = turned.beta;
}

static pm_q_t notch(second_harmonic_t *self, pm_dir_t dir, pm_q_t eps)
{
    const pm_half_dir_t at = twice(dir);
    const pm_q_t known = pm_shl(pm_mulh_add(pm_mulh(self->a, at.cos), self->b, at.sin), 2);
    const pm_q_t left = eps - known;
    const pm_q_t c = pm_frac(left, self->gain_cos);
    const pm_q_t s = pm_frac(left, self->gain_sin);
    /* (cos, sin)(2 theta + phi) */
    const pm_q_t a = pm_mulh_sub(pm_mulh(c, at.cos), s, at.sin);
    const pm_q_t b = pm_mulh_add(pm_mulh(c, at.sin), s, at.cos);
    self->a = pm_sat(self->a + pm_shl(a, 2), PM_Q_BITS);
    self->b = pm_sat(self->b + pm_shl(b, 2), PM_Q_BITS);
    return left;
}

static pm_q_t resonator(second_harmonic_t *self, pm_q_t eps)
{
    const pm_q_t left = eps - self->a;
    const pm_ab_t next = {.alpha = self->a + pm_frac(left, self->gain_cos),
                          .beta = self->b + pm_frac(left, self->gain_sin)};
    const pm_dq_t turned = {.d = next.alpha, .q = next.beta};
    const pm_ab_t y = pm_park_inverse(turned, self->turn);
    self->a = pm_sat(y.alpha, PM_Q_BITS);
    self->b = pm_sat(y.beta, PM_Q_BITS);
    return left;
}

pm_q_t second_harmonic_step(second_harmonic_t *self, const second_harmonic_config_t *config, pm_dir_t dir,
                            pm_q_t eps)
{
    if (config->id == SECOND_HARMONIC_NOTCH) {
        return notch(self, dir, eps);
    }
    return resonator(self, eps);
}

/* Learning gains from the angle of S at w = 2 omega, which is that of
 *   (w^2 - k_i) + j (k_p w - k_1 / w)
 * In the notch it is added in the direction of rotation, in the resonator against it; both reverse with the
 * speed. */
static void learn(second_harmonic_t *self, const second_harmonic_config_t *config, pm_q_t omega)
{
    const pm_q_t w = pm_shl(pm_min(pm_abs(omega), PM_Q(1.4)), 1);
    const pm_q_t in_phase = pm_mul(w, w) - config->k_i;
    const pm_q_t ahead = pm_mul_sat(config->k_p, w) - pm_div(config->k_1, w);
    const pm_q_t size = pm_max(pm_hypot(in_phase, ahead), 1);
    self->gain_cos = pm_shl(pm_mulh(pm_div(in_phase, size), config->mu), 4);
    self->gain_sin = pm_shl(pm_mulh(pm_div(ahead, size), config->mu), 4);
    if ((omega < 0) == (config->id == SECOND_HARMONIC_NOTCH)) {
        self->gain_sin = -self->gain_sin;
    }
}

void second_harmonic_slow(second_harmonic_t *self, const second_harmonic_config_t *config, pm_q_t omega,
                          pm_q_t weight)
{
    if (weight == PM_ONE && pm_abs(omega) > config->omega_least) {
        learn(self, config, omega);
    } else {
        self->gain_cos = 0;
        self->gain_sin = 0;
        self->a -= self->a / FADE;
        self->b -= self->b / FADE;
    }
    const pm_q_t step = pm_frac(omega, config->t_s);
    self->turn = pm_dir((pm_angle_t)pm_rad_to_angle(pm_shl(step, 1)));
}

#endif
