/* Third harmonic as a continuous signal (METHODS.md 11.4.3, row 129): a second-order generalised integrator at three times the
 * loop's speed makes the pair of third.h from v_zero.
 *
 *   y, q    firmware/math/sogi.h at 3 omega, k = third_gain
 * At constant speed without a lag; a change of the rotor's speed against the loop's passes with 2 / (3 k omega). The state
 * stands in the stator, so that a correction of the loop acts on eps at once. Under a ramp of acceleration a the loop errs by
 *   a / w_n^2 + 2 zeta a / (w_n 3/2 k omega)
 *
 * Called each period; the result belongs to k. Tests: tests/unit/observers/third_test.cpp, tests/scenario/third_harmonic.yaml. */
#ifndef OBSERVERS_THIRD_SOGI_H
#define OBSERVERS_THIRD_SOGI_H

#include "firmware/math/sogi.h"
#include "observers/third.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    third_config_t third;
    pm_q_t k;
} third_sogi_config_t;

typedef struct {
    third_t third;
    pm_dir_t turn;  /* of 3 omega T */
    pm_frac_t k;    /* k 3 omega T */
    pm_sogi_t sogi; /* per-unit, Q30 */
} third_sogi_t;

void third_sogi_reset(third_sogi_t *self, const third_sogi_config_t *config, const obs_in_t *in);
void third_sogi_step(third_sogi_t *self, const third_sogi_config_t *config, const obs_in_t *in,
                     obs_out_t *out);
obs_out_t third_sogi_last(const third_sogi_t *self);
void third_sogi_tie(third_sogi_t *self, const third_sogi_config_t *config);
void third_sogi_slow(third_sogi_t *self, const third_sogi_config_t *config, const obs_in_t *in,
                     const obs_out_t *out, pm_q_t weight);

void make_third_sogi(maker_t *m, third_sogi_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
