/* Common part of the model reference adaptive systems (METHODS.md 12.2, rows 137 to 139).
 *
 * Reference: the machine. Adjustable: its model in the present frame, with the extended EMF (2.3.2), so that
 * round and salient machines are one case:
 *   v = (R + p L_d) i + w_f (L_q - L_d) J i + (0, E)
 *   E = omega psi_a
 *   J = [0 -1; 1 0]
 * Changes of current are formed in the stationary frame, so a correction of the position causes no step in
 * them. What was measured over [k-1, k) belongs to its middle: it is turned by omega T_s / 2 into the frame
 * of k. The error signal is the mean of two periods: an error of L_d leaves a carrier of half the sampling
 * rate in it, which would otherwise reach the limit of +-1, and noise of a current sample enters it times
 * L_d/T_s.
 *
 * The error signal is divided by E through the factor
 *   E / max(|E|, emf_min)^2
 * so its sign is right in both directions and it fades to zero at standstill, where there is no EMF. The
 * factor is renewed at 1 kHz. While another source leads, emf_tied stands for emf_min, so that voltage errors act as in a flux that
 * is tied to the position.
 *
 * Wrong parameters (3.5.1, row 28), d = machine minus model: the angle errs, to first order, by
 *   asin[(dR i_d - omega dL_q i_q) / (omega psi_a)]
 * L_d and psi_m move no angle. R is the parameter and is not adapted: at low speed, a square-wave carrier and
 * p i_q leave more on the q-axis than the resistive drop.
 *
 * The reactive term needs the speed of the loop, which moves with the error signal. With
 *   c = (L_q - L_d) i_q / E
 * both diverge at the rate 1 / (c - tau) unless the speed reaches the model through a lag tau > c. So w_f
 * lags by n radians of the rotor, tau = n / omega with n > (L_q - L_d) i_q / psi_a; under an acceleration a
 * this costs a tau c. */
#ifndef OBSERVERS_MRAS_H
#define OBSERVERS_MRAS_H

#include "observers/model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    observer_model_t model;
    pm_frac_t k;     /* bandwidth of the adapted quantity times T_s, Q32 */
    pm_q_t emf_min;  /* > 0: below this |E| the error signal fades ... */
    pm_q_t emf_tied; /* ... and below this, at least as much, while another source leads */
    pm_frac_t turn;  /* w_base T_slow / n: radians per slow step over those of the lag, Q32, < 0.5 */
} mras_config_t;

/* E / max(|E|, least)^2, Q22 (+-512). */
int32_t mras_inverse(pm_q_t E, pm_q_t least);

/* Of these the one that the weight asks for. */
static inline pm_q_t mras_least(const mras_config_t *config, pm_q_t weight)
{
    return weight == 0 ? config->emf_tied : config->emf_min;
}

/* w_f of the next slow step. */
pm_q_t mras_speed(const mras_config_t *config, pm_q_t filtered, const obs_in_t *in, pm_q_t weight);

/* w_f (L_q(i) - L_d), Q28. */
pm_q_t mras_cross(const mras_config_t *config, pm_q_t omega, pm_dq_t i);

/* omega T_s / 2, Q32. */
static inline int32_t mras_half_turn(const mras_config_t *config, pm_q_t omega)
{
    return pm_shl(pm_mulh(omega, config->model.t_s), 3);
}

/* From the frame of k into that of the middle of the period before. */
static inline pm_dq_t mras_middle(pm_dq_t x, int32_t half_turn)
{
    pm_dq_t y;
    y.d = pm_mulh_sub(x.d, x.q, half_turn);
    y.q = pm_mulh_add(x.q, x.d, half_turn);
    return y;
}

/* A voltage, Q30, relative to E, limited to +-1; 20 fractional bits. */
static inline pm_q_t mras_relative(int32_t voltage, int32_t inverse)
{
    return pm_shl(pm_sat(pm_mulh(voltage, inverse), 20), PM_Q_BITS - 20);
}

void make_mras(maker_t *m, mras_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
