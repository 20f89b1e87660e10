/* Third harmonic by its zero crossings (METHODS.md 11.4.2, row 128): a crossing of the third harmonic's flux says where the rotor
 * is, the last two how fast it turns, and in between the position goes on at that speed.
 *
 *   theta_k = (+-90 degrees + n 360 degrees) / 3                at a crossing, every 60 degrees
 *   omega^  = (theta_k - theta_k-1) / t_d
 *   theta^  = theta_k + omega^ (t - t_k)
 *   eps     = theta^ - theta
 * The flux is that of third_integration.h with shift and lag taken out, without psi^, with h = g and g = 3/4 third_drift; the
 * crossing is located between two samples by its slope, v_zero. omega^ is the mean of the last 60 degrees, so that under a ramp a the angle falls behind by up to
 *   a t_d^2
 * with position_observer 1, by which the position is this one; the PLL smooths it. The turn of theta between two periods is seen
 * in its direction. While another source leads, theta^ is theta.
 *
 * Called each period; the result belongs to k. One division at a crossing. Tests: tests/unit/observers/third_test.cpp,
 * tests/scenario/third_crossings.yaml. */
#ifndef OBSERVERS_THIRD_CROSSINGS_H
#define OBSERVERS_THIRD_CROSSINGS_H

#include "observers/third_integration.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef third_integration_config_t third_crossings_config_t;

typedef struct {
    third_integration_t flux;
    pm_dir_t dir;     /* of theta at k-1 */
    pm_q_t ahead;     /* theta^ - theta, rad */
    pm_q_t turn;      /* of theta^ in a period, rad */
    pm_q_t travelled; /* by theta since the last crossing, rad */
    pm_q_t error;     /* theta_k - theta there, rad */
    int32_t periods;  /* since then */
    bool above;       /* the flux is positive */
} third_crossings_t;

void third_crossings_reset(third_crossings_t *self, const third_crossings_config_t *config,
                           const obs_in_t *in);
void third_crossings_step(third_crossings_t *self, const third_crossings_config_t *config, const obs_in_t *in,
                          obs_out_t *out);
obs_out_t third_crossings_last(const third_crossings_t *self);
void third_crossings_tie(third_crossings_t *self, const third_crossings_config_t *config);
void third_crossings_slow(third_crossings_t *self, const third_crossings_config_t *config, const obs_in_t *in,
                          const obs_out_t *out, pm_q_t weight);

void make_third_crossings(maker_t *m, third_crossings_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
