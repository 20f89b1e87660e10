/* A sine carrier of whole periods with the window that reads its answer: the common part of rotating_sine.h,
 * pulsating_sine.h and stationary_sine.h (METHODS.md 4.3.1, 4.4.1, 4.4.2, 5.7).
 *
 *   f_h  = f_pwm / N,  a = 2 pi / N,  phi_k = k a: phase of the voltage for [k+1, k+2)
 *   F    = V_h T_s / (2 sin(a / 2)):  flux amplitude at the samples, of a voltage in steps
 *   phi' = phi_k - 1.5 a - omega_h T_x - pi / 2:  phase of the current at k, of a voltage that was commanded 1.5
 *                                     periods ago; T_x, `injection_delay`: what amplifiers and filters add to that
 * A source that reads this phase errs by omega_h / 2 of the delay that it is not told (METHODS.md 5.7, row 64); one that
 * measures the phase of its answer does not.
 * The window takes the current at the phase phi' over a period of the carrier (window.h). For so long after a
 * reset, and until the first answer, it holds other things too and is not to be read.
 *
 * Where it holds (METHODS.md 5.8; rows 65 to 67; predicted by tools/pmdrive/pmdrive/carrier.py, measured in
 * docs/results/safe_area.md; tools/tune.py chooses V_h, f_h and loops by it):
 *   noise  sigma = (I_qu / 2 I_n) sqrt(c 2/3 (sigma_n^2 + 1/12) B / f_pwm)   rad
 *          B     = (K_p^2 + K_i) / (2 (K_p - K_i / w_s)),  K_p = 2 zeta w_n,  K_i = w_n^2
 *          I_qu: step of the converter; sigma_n: noise in steps; c: 2 along d, 1 rotating
 *   load   up to where the second loop through the window is stable. When the estimated frame oscillates at omega_h / 2,
 *          i_f oscillates in it; the window, a whole period of the carrier, passes 2 / pi of that as an answer, and the
 *          position loop turns the frame by it. The loop gain goes with (i_f / I_n) (w_n / omega_h). A low-pass in the
 *          error signal (injection.h) leaves a quarter of it:
 *            w_s = max(omega_h / 8, 4 w_n)
 *
 * The samples in it are (N - 1) / 2 periods old, and so is the mean of the current: current control is slowed
 * while the source leads, to a phase of 0.4 rad, and the position loop may have 0.2 rad: the low-pass lags as well. */
#ifndef INJECTION_SINE_H
#define INJECTION_SINE_H

#include "firmware/math/window.h"
#include "injection/carrier.h"
#include "injection/source.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t v_h;
    pm_frac_t per_n;  /* 1 / N */
    pm_angle_t step;  /* a */
    pm_angle_t ahead; /* 1.5 a: from a sample to the middle of the period in which what it commands acts */
    pm_angle_t lag;   /* 1.5 a + a quarter of a turn, and what injection_delay makes */
    uint16_t n;
} sine_config_t;

typedef struct {
    window_t window;
    carrier_phase_t phase;
    uint16_t warm; /* periods until the window holds nothing but answers to the carrier */
} sine_t;

/* i: the current, in the frame of the window. */
static inline void sine_reset(sine_t *self, const sine_config_t *config, pm_dq_t i)
{
    window_reset(&self->window, config->n, i);
    self->phase.at = 0;
    self->warm = (uint16_t)(config->n + 2U); /* from the first command to the first answer */
}

/* One period; returns phi_k. */
static inline pm_angle_t sine_step(sine_t *self, const sine_config_t *config, pm_dq_t i)
{
    const pm_angle_t phi = carrier_angle(&self->phase, config->step);
    window_step(&self->window, self->phase.at, pm_dir(phi - config->lag), i);
    carrier_advance(&self->phase, config->n);
    return phi;
}

/* The window may be read; once a period. */
static inline bool sine_ready(sine_t *self)
{
    if (self->warm > 0U) {
        self->warm--;
        return false;
    }
    return true;
}

/* V_h as carrier.h takes it. */
static inline int32_t sine_amplitude(const sine_config_t *config)
{
    return pm_shl(config->v_h, 30 - PM_Q_BITS);
}

/* The current that the window holds, without the carrier. */
static inline pm_dq_t sine_mean(const sine_t *self, const sine_config_t *config)
{
    return window_mean(&self->window, config->per_n);
}

/* Of an answer i = h cos(phi' - delta), its h from the window, in phase with e^{j delta}. */
static inline pm_dq_t sine_in_phase(const sine_t *self, const sine_config_t *config, pm_dir_t phase)
{
    const pm_dq_t c = window_cosine(&self->window, config->per_n);
    const pm_dq_t s = window_sine(&self->window, config->per_n);
    pm_dq_t h;
    h.d = pm_shl(pm_mulh2(c.d, phase.cos, s.d, phase.sin), 2); /* of 1/N and of Q31 */
    h.q = pm_shl(pm_mulh2(c.q, phase.cos, s.q, phase.sin), 2);
    return h;
}

/* e^{j delta} from the parts of an answer with the cosine and the sine of phi', 1 kHz: within 0.7 rad, so
 * that a transient of the current does not turn it further than an inverter could. */
pm_dir_t sine_phase(pm_q_t cosine, pm_q_t sine);

/* sine_config.c; make_sine() refuses a frequency that does not fit. */
void make_sine(maker_t *m, sine_config_t *c);
injection_limits_t sine_limits(const maker_t *m);
pm_num_t sine_flux(const maker_t *m);  /* F, Wb */
pm_num_t sine_omega(const maker_t *m); /* omega_h, 1/s */
/* An amplitude of the current at a sample, as x_answer() wants it: the window leaves sqrt(2 / N) of the
 * noise. */
pm_num_t sine_answer(const maker_t *m, pm_num_t amplitude);

#ifdef __cplusplus
}
#endif

#endif
