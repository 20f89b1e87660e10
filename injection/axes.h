/* Test voltages along the three axes of the stator in turn, each with its opposite, and the saliency that
 * their answers show together (METHODS.md 4.6): the common part of inform.h and pwm_excitation.h.
 *
 * In period p the voltage points along u_p, a unit vector. With a = e^{j 120}, twelve make a round:
 *   u = 1, -1, a, -a, a^2, -a^2,  -1, 1, -a, a, -a^2, a^2
 * The change of current that it makes, of flux F, with the rotor at theta:
 *   c_p = F [L_sa u_p + K e^{j (2 theta + theta_m)} u_p*] / D
 * and what EMF, resistance and fundamental voltage add, the same for a vector and its opposite. A window of a
 * round (window.h) leaves of all that
 *   y   = mean(c_p u_p)  = I_n e^{j (2 theta + theta_m)},  I_n = F K / D
 *   I_p = mean(c_p u_p*) = F L_sa / D
 * each free of the other, of the fundamental and of an offset. The samples of y are 6 periods old in the
 * mean:
 *   eps = gain(i_q) Im[y e^{-j 2 theta^} e^{j (12 omega T_s - theta_m)}],  gain = 1 / (2 I_n)
 * eps is exact for small errors and 1/2 sin 2e beyond. misfit: the measured I_p against I_p(i_q), relative.
 *
 * The second half of the round begins each pair with the other sign: were it always the same, the current
 * would lie aside of its fundamental in one direction of each axis, and saturation and inverter would show
 * it. Measured on IPM-1000 without load with INFORM of 70 V: mean error 0.6 degrees instead of 0.2
 * (docs/methods_notes.md).
 *
 * The axes do not follow the estimate: whatever it is, the carrier is the same. The first fourteen steps
 * after a reset give eps = 0. 75 instructions a period, of which 44 are the window; turn and gain at 1 kHz. */
#ifndef INJECTION_AXES_H
#define INJECTION_AXES_H

#include "firmware/math/window.h"
#include "firmware/params/types.h"
#include "injection/carrier.h"
#include "injection/saliency.h"
#include "injection/source.h"

#ifdef __cplusplus
extern "C" {
#endif

#define AXES_ROUND 12U

typedef struct {
    saliency_config_t saliency;
    pm_q_t lag; /* 6 T_s w_base: rad per unit of speed */
} axes_config_t;

typedef struct {
    window_t window;
    pm_dir_t asked[2]; /* u of the last period and of the one before: the latter is answered now */
    pm_dir_t turn;     /* e^{j (12 omega T_s - theta_m)} */
    int32_t gain;      /* rad per unit of current, Q20 */
    pm_ab_t y;         /* stationary frame */
    pm_q_t eps;
    pm_q_t misfit;
    carrier_phase_t phase;
    uint16_t warm; /* periods until the window holds nothing but answers */
} axes_t;

void axes_reset(axes_t *self, const axes_config_t *config);

/* One period: `change` is c, the answer to the u of two calls ago. Returns the u of the coming period. */
pm_dir_t axes_step(axes_t *self, const axes_config_t *config, pm_dir_t dir, pm_ab_t change);

/* The period that has just been answered was the second of a pair: the current is where it was before the
 * pair. */
static inline bool axes_pair_done(const axes_t *self)
{
    return (self->phase.at & 1U) == 0U;
}

void axes_slow(axes_t *self, const axes_config_t *config, const obs_in_t *in);
obs_out_t axes_last(const axes_t *self);

/* axes_config.c; flux: of one test voltage, Wb. */
void make_axes(maker_t *m, axes_config_t *c, pm_num_t flux);
pm_num_t axes_pll_max(const maker_t *m);                  /* largest bandwidth of the position loop, Hz */
pm_num_t axes_amplitude(const maker_t *m, pm_num_t flux); /* I_n without load, A */

#ifdef __cplusplus
}
#endif

#endif
