/* Speed control (row 5): reference ramp, PI with acceleration feed-forward, q-axis current out.
 *
 *   kp = w_s J / (1.5 P^2 psi_m)
 *   ki = kp w_s T / 4                        T: the step of 1 ms
 * per-unit: two real poles at half the bandwidth w_s when the current loop is fast. While the current limit
 * acts, the integral follows it (back-calculation); where the voltage does not suffice for i_q, what flows. Runs at 1 kHz.
 *
 * A torque drives up to a speed and no further, by another such PI of twice the bandwidth, so that it acts late:
 *   e      = top - |omega|
 *   |i_q| <= 2 kp e + sum of 4 ki e            the sum and the whole at least zero: it brakes nothing
 * Below half of the speed nothing is taken back. A machine without a load slows its acceleration down from where it
 * would be at that speed in 1 / (2 w_s), and passes by a seventh of that way and what the speed's estimate lags.
 * Tests: tests/unit/control/speed_control_test.cpp. */
#ifndef CONTROL_SPEED_CONTROL_H
#define CONTROL_SPEED_CONTROL_H

#include "firmware/math/frames.h"
#include "firmware/math/pi.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_pi_config_t pi;  /* speed error -> i_q */
    pm_q_t slope;       /* change of the reference per call */
    pm_q_t i_per_slope; /* i_q that accelerates by `slope` per call */
} speed_control_config_t;

typedef struct {
    pm_pi_t pi;
    pm_q_t reference; /* after the ramp */
} speed_control_t;

void speed_control_reset(speed_control_t *self, pm_q_t omega, pm_q_t i_q);

/* i_min <= result <= i_max; *limited: one of them acts. */
pm_q_t speed_control_step(speed_control_t *self, const speed_control_config_t *config, pm_q_t target,
                          pm_q_t omega, pm_q_t i_min, pm_q_t i_max, bool *limited);

/* For i_q, the last result, the voltage does not suffice: of i, the integral follows what has its sign, up to itself. */
void speed_control_follow(speed_control_t *self, const speed_control_config_t *config, pm_q_t i_q, pm_q_t i);

/* i_q, or what of it does not drive beyond +-top. The PI is left ready for speed control. */
pm_q_t speed_control_below(speed_control_t *self, const speed_control_config_t *config, pm_q_t top,
                           pm_q_t omega, pm_q_t i_q);

void make_speed_control(maker_t *m, speed_control_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
