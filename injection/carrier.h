/* What a source of position adds to the voltage: excitations, each with the voltage of a period in the
 * stationary frame (METHODS.md 4.3.1 to 4.4.3).
 *
 *   square     +-V_h along d of the estimated frame, alternating each period: f_h = f_pwm / 2
 *   pulsating  V_h cos phi along d, phi = 2 pi k / N: f_h = f_pwm / N, whole N
 *   rotating   V_h e^{j phi} in the estimated frame, phi likewise. Seen from
 *              the stator it turns with omega_h + omega; in the estimated frame all amplitudes are constant,
 *              so that a window of N samples nulls what it must at any speed.
 *   axis       V_h along an axis of the stator, whatever the estimate (axes.h).
 *   anti-rotating  V_h along e^{j (90 degrees - 2 theta)}, an axis that turns back at twice the speed
 *              (METHODS.md 6.4.1).
 * `ahead` is half of the direction of the estimated frame in the middle of the period in which the voltage
 * acts; amplitudes are Q30, below 2. Two products for the square wave, three for the pulsating one, six for the
 * rotating one. A carrier knows nothing of how its answer is read. Tests: tests/unit/injection. */
#ifndef INJECTION_CARRIER_H
#define INJECTION_CARRIER_H

#include "firmware/math/frames.h"
#include "firmware/math/trig.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Voltage x (Q30) along d, as a signal. */
static inline pm_ab_t carrier_along_d(int32_t x, pm_half_dir_t ahead)
{
    pm_ab_t v;
    v.alpha = pm_mulh(x, ahead.cos);
    v.beta = pm_mulh(x, ahead.sin);
    return v;
}

/* Phase of a carrier of whole periods: k of N. */
typedef struct {
    uint16_t at;
} carrier_phase_t;

/* N periods make a turn; the angle is the same every N periods to the last bit. */
static inline pm_angle_t carrier_angle(const carrier_phase_t *self, pm_angle_t step)
{
    return (pm_angle_t)self->at * step;
}

static inline void carrier_advance(carrier_phase_t *self, uint16_t n)
{
    self->at = (uint16_t)(self->at + 1U);
    if (self->at >= n) {
        self->at = 0;
    }
}

/* Voltage of amplitude x (Q30) along d, swinging with the cosine of `phase`, as a signal. */
static inline pm_ab_t carrier_pulsating(int32_t x, pm_dir_t phase, pm_half_dir_t ahead)
{
    return carrier_along_d(pm_unit(x, phase.cos), ahead);
}

/* Voltage of amplitude x (Q30) at `phase` before d, as a signal. */
static inline pm_ab_t carrier_rotating(int32_t x, pm_dir_t phase, pm_half_dir_t ahead)
{
    const pm_dq_t v = {pm_unit(x, phase.cos), pm_unit(x, phase.sin)};
    return pm_park_inverse_quarter(v, ahead);
}

/* Voltage x (Q28) along an axis of the stator, as a signal. */
static inline pm_ab_t carrier_along(pm_q_t x, pm_dir_t axis)
{
    const pm_ab_t v = {pm_unit(x, axis.cos), pm_unit(x, axis.sin)};
    return v;
}

/* Voltage x (Q30) along the axis that turns back at twice the speed of the frame, as a signal. */
static inline pm_ab_t carrier_anti_rotating(int32_t x, pm_half_dir_t ahead)
{
    const int32_t half_sin = pm_mulh(ahead.sin, ahead.cos); /* of twice the angle, Q28 */
    const int32_t cos = pm_mulh_sub(pm_mulh(ahead.cos, ahead.cos), ahead.sin, ahead.sin);
    const pm_ab_t v = {pm_shl(pm_mulh(x, half_sin), 3), pm_shl(pm_mulh(x, cos), 2)};
    return v;
}

#ifdef __cplusplus
}
#endif

#endif
