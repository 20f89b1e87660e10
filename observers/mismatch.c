#include "observers/mismatch.h"

#include "firmware/math/filter.h"
#include "firmware/math/image.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#if !PM_HAS(mismatch)

/* Left out; mismatch_config.c refuses it. */
pm_q_t mismatch_step(const mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *config,
                     const mismatch_in_t *in, pm_q_t weight, pm_q_t eps)
{
    (void)self;
    (void)window;
    (void)config;
    (void)in;
    (void)weight;
    return eps;
}

void mismatch_slow(mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *config,
                   const mismatch_in_t *in)
{
    (void)self;
    (void)window;
    (void)config;
    (void)in;
}

#else

/* Means of speed and current: 256 ms. */
#define K_MEAN PM_FRAC(1.0 / 256)
/* Distance from the angle of constant speed: 0.1 rad. */
#define AWAY   ((int32_t)PM_TURN(0.0159))
/* Least speed for k_d. */
#define LEAST  PM_Q(1.0 / 64)
/* Steps of the pause. */
#define REST   60000U

/* The current of the window's axis. */
static pm_q_t current_of(uint8_t axis, const mismatch_in_t *in)
{
#if PM_HAS(two_sets)
    if (axis == (uint8_t)MISMATCH_APART) {
        return in->apart;
    }
#endif
    return axis == (uint8_t)MISMATCH_Q_AXIS ? in->i.q : in->i.d;
}

pm_q_t mismatch_step(const mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *config,
                     const mismatch_in_t *in, pm_q_t weight, pm_q_t eps)
{
    pm_q_t learnt = mismatch_eps(self, in->i);
    PM_IN_IMAGE(two_sets, learnt += pm_mul(self->k_a, in->apart);)
    const pm_q_t left = eps + pm_mul(weight, learnt);
    if (window != NULL) {
        const pm_angle_t seen = in->pll->theta + (pm_angle_t)pm_rad_to_angle(left);
        window->theta += (pm_angle_t)pm_omega_to_angle(window->omega, in->k_theta);
        window->x += (pm_angle_t)(pm_angle_diff(seen, window->theta) / 16);
        window->i += current_of(mismatch_axis(window, config), in) / 16;
    }
    return left;
}

static void begin_window(mismatch_window_t *self, pm_angle_t x)
{
    self->count = 0;
    self->theta += x;
    self->angle = (pm_ab_t){0, 0};
    self->current = (pm_ab_t){0, 0};
}

/* Q30: the current is small. */
static pm_ab_t lifted(pm_ab_t x)
{
    return (pm_ab_t){.alpha = pm_shl_sat(x.alpha, 3, 31), .beta = pm_shl_sat(x.beta, 3, 31)};
}

static pm_q_t real_product(pm_ab_t a, pm_ab_t b)
{
    return pm_mulh2(a.alpha, b.alpha, a.beta, b.beta);
}

/* Oscillation of the rotor, rad per base current: -swing times the flux that makes the torque. */
static pm_q_t rotor(const mismatch_config_t *config, uint8_t axis, pm_dq_t i)
{
    const observer_model_t *model = &config->model;
    const pm_q_t flux = axis == (uint8_t)MISMATCH_Q_AXIS ? observer_active_flux(model, i)
                                                         : pm_mul(model->L_d - model->L_q, i.q);
    return -pm_shl(pm_sat(pm_mulh(flux, config->swing), 19), 12);
}

#if PM_HAS(two_sets)
/* No torque, no swing of the rotor. Each kind of window converges from its own first one. */
static void learn_apart(mismatch_t *self, const mismatch_window_t *window, const mismatch_config_t *config,
                        pm_q_t g)
{
    const pm_q_t change = g / (4 + (int32_t)((window->windows - MISMATCH_IN_PHASE) / 4U));
    self->k_a = pm_sat(self->k_a + change, PM_Q_BITS);
    if (window->windows >= MISMATCH_TRACKS) {
        self->k.q = pm_sat(self->k.q + pm_mul_sat(change, config->alike), PM_Q_BITS);
    }
}
#endif

static void learn(mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *config,
                  const mismatch_in_t *in)
{
    const pm_ab_t current = lifted(window->current);
    const pm_q_t square = real_product(current, current);
    if (square < pm_mul(config->i, config->i) / 4) {
        return;
    }
    const pm_q_t g = pm_div(real_product(lifted(window->angle), current), square);
    const uint8_t axis = mismatch_axis(window, config);
#if PM_HAS(two_sets)
    if (axis == (uint8_t)MISMATCH_APART) {
        learn_apart(self, window, config, -g);
        window->windows++;
        return;
    }
#endif
    const pm_q_t change = (rotor(config, axis, in->i) - g) / (4 + (int32_t)(window->windows / 4U));
    if (axis == (uint8_t)MISMATCH_Q_AXIS) {
        self->k.q = pm_sat(self->k.q + change, PM_Q_BITS);
    } else {
        self->k_omega = pm_mul(pm_sat(self->k.d + change, PM_Q_BITS), in->pll->omega);
    }
    window->windows++;
}

/* A step of the window; x: angle relative to constant speed. */
static void collect(mismatch_window_t *self, const mismatch_config_t *config, pm_angle_t x, pm_q_t i)
{
    const uint32_t step = UINT32_MAX / config->samples;
    const pm_dir_t dir = pm_dir(step * self->count + step / 2U);
    if (self->count >= config->samples) {
        const pm_unit_t share = PM_UNIT_MAX / (int32_t)(MISMATCH_PERIODS / 2U * config->samples);
        const pm_ab_t w = {.alpha = pm_unit(dir.cos, share), .beta = pm_unit(dir.sin, share)};
        const pm_q_t rad = pm_angle_to_rad((int32_t)x);
        self->angle.alpha = pm_mulh_add(self->angle.alpha, rad, w.alpha);
        self->angle.beta = pm_mulh_add(self->angle.beta, rad, w.beta);
        self->current.alpha = pm_mulh_add(self->current.alpha, i, w.alpha);
        self->current.beta = pm_mulh_add(self->current.beta, i, w.beta);
    }
    const pm_q_t injected = pm_unit(config->i, dir.cos);
    self->injected = self->windows % 2U == 0U ? injected : -injected;
    self->count++;
}

/* Mean over the step's control periods. */
static int32_t mean(int32_t sum, const mismatch_config_t *config)
{
    return pm_shl(sum / (int32_t)config->periods, 4);
}

/* At least two turns of the rotor in a period of the injection, so that k_d is observable. */
static bool turns(const mismatch_config_t *config, const mismatch_in_t *in)
{
    const int32_t two = INT32_MAX / (config->samples * config->periods);
    return config->id != (uint8_t)MISMATCH_D_AXIS ||
           pm_abs(pm_omega_to_angle(in->pll->omega, in->k_theta)) / 4 > two;
}

static void begin_again(mismatch_window_t *self, const mismatch_config_t *config, pm_angle_t x)
{
    begin_window(self, x);
    self->windows = 0;
    self->i_record = self->i_q;
    self->id = config->id;
}

static void listen(mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *config,
                   const mismatch_in_t *in)
{
    (void)pm_lp1(&window->omega, in->pll->omega, K_MEAN);
    (void)pm_lp1(&window->i_q, in->i.q, K_MEAN);
    const pm_angle_t x = (pm_angle_t)mean((int32_t)window->x, config);
    const pm_q_t i = mean(window->i, config);
    window->x = 0;
    window->i = 0;
    const bool other = window->id != config->id || pm_abs(window->i_q - window->i_record) > config->i;
    if (other || window->count > REST || !turns(config, in)) {
        begin_again(window, config, x);
    } else if (window->windows >= MISMATCH_WINDOWS) {
        window->count++;
    } else if (pm_abs((int32_t)x) > AWAY) {
        begin_window(window, x);
    } else {
        collect(window, config, x, i);
        if (window->count == (MISMATCH_PERIODS + 1U) * config->samples) {
            learn(self, window, config, in);
            begin_window(window, x);
        }
    }
}

void mismatch_slow(mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *config,
                   const mismatch_in_t *in)
{
    const pm_q_t omega = in->pll->omega;
    const pm_q_t k_d = pm_sat(pm_div(self->k_omega, pm_max(pm_abs(omega), LEAST)), PM_Q_BITS);
    self->k.d = omega < 0 ? -k_d : k_d;
    if (window != NULL) {
        window->injected = 0;
    }
    if (config->id == (uint8_t)MISMATCH_OFF) {
        *self = (mismatch_t){.k_omega = 0};
    } else if (window != NULL) {
        listen(self, window, config, in);
    }
}

#endif
