/* Figures of saliency.h from the machine's incremental inductances: for the makers of the sources. */
#ifndef INJECTION_SALIENCY_CONFIG_H
#define INJECTION_SALIENCY_CONFIG_H

#include "firmware/params/maker.h"
#include "injection/saliency.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_num_t L_d, L_q, L_dq; /* incremental, H */
} inductances_t;

inductances_t inductances_at_zero(const maker_t *m);
inductances_t inductances_at_rated(const maker_t *m);

/* Of V_h over a PWM period, Wb: that of a square wave. */
pm_num_t flux_of_period(const maker_t *m);

/* Current per radian of a source's error signal, for a carrier of the given flux (Wb). */
pm_num_t slope_across(const inductances_t *L, pm_num_t flux);   /* of h_q + lambda h_d */
pm_num_t slope_sequence(const inductances_t *L, pm_num_t flux); /* of the negative sequence: 2 I_n */

/* What a source that reads the current across the carrier needs: gain and lambda. Both makers refuse a machine
 * that has no saliency left at rated current. */
void make_saliency_across(maker_t *m, saliency_config_t *c, pm_num_t flux);

/* What a source needs that asks for a current along d and reads the voltage across: lambda, and as gain the radians per
 * share of the voltage along d, Q20: L_d / (L_q - L_d). */
void make_saliency_held(maker_t *m, saliency_config_t *c);

/* What a source that reads sequences needs: gain, theta_m and I_p. */
void make_saliency_sequence(maker_t *m, saliency_config_t *c, pm_num_t flux);

#ifdef __cplusplus
}
#endif

#endif
