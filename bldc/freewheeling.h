/* How far the rotor turns while the current of the leg that has gone decays, predicted (METHODS.md 10.5.1, 10.5.3 to
 * 10.5.5; rows 116, 118, 119, 120), and the current up to which that leaves the crossing to be seen (10.5.2, 10.6; rows
 * 117, 121).
 *
 *   theta_f = omega (L / R) ln(1 + 3 R i / x)
 *   x = u v_dc + 2 E          the leg that has come is chopped:     H_PWM_L_ON into odd sectors, H_ON_L_PWM into even
 *                             ones, PWM_ON
 *   x = (2 - u) v_dc + 2 E    it is not:                            the other half of these, ON_PWM
 *   x = v_dc + 2 E            both are:                             H_PWM_L_PWM, alternating or not
 * i before the commutation, L of a phase less mutual, E flat top of a trapezoid; a sine has 1.5 E_m for 2 E. E is
 * that of the commutation: at rated speed, where it turns on meanwhile, the formula is some 8 % short. Computed as
 *   theta_f = 2 omega L w / R (1 + w^2/3 + w^4/5 + w^6/7),   w = 3 R i / (2 x + 3 R i)
 * within 0.1 % of the formula for 3 R i <= 2 x.
 *
 * Crossings are seen in time while theta_f + omega (t_blank + t_sample) < 30 degrees. Solved for the current, at that
 * angle less blanking and sample:
 *   i = (x theta / (3 omega L)) (1 + e/2 + e^2/6 + e^3/24),   e = R theta / (omega L)
 * within 1 % for e <= 1; beyond, below the true one, so on the safe side.
 *
 * A current that flows back, while the machine brakes, is led to the other rail, and there
 *   x = (2 - share) v_dc - 2 E           share: the factor of v_dc above
 * With u v_dc = 2 E that is nothing where the leg that has come is not chopped: the current of the one that has gone decays by that
 * leg's own EMF alone, which falls from E:
 *   e = E (1 - k theta)                  k = 1.8: trapezoid 1.91, sine 1.73
 * The current that brakes with the crossing seen is then
 *   i = theta (v + k E theta) / (3 omega L)
 * with v = 0, where the leg that has come is chopped 2 (v_dc - 2 E), where both are v_dc - 2 E. R is left out: the
 * decaying current's drop makes good what u v_dc is less than 2 E. Trapezoid within 11 %; a sine bears a quarter to a half more.
 *
 * Per-unit in Q28, angles in rad Q28. Two divisions, braking one; for 1 kHz.
 * Tests: tests/unit/bldc/freewheeling_test.cpp. */
#ifndef BLDC_FREEWHEELING_H
#define BLDC_FREEWHEELING_H

#include "bldc/patterns.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t R, L; /* per-unit, of base impedance and inductance; < 2 */
    pm_q_t emf;  /* 2 E at base speed; < 4 */
} freewheeling_config_t;

typedef struct {
    pattern_id_t pattern;
    uint32_t sector; /* that has been entered */
    pm_q_t u, v_dc;
    pm_q_t omega; /* > 0 */
} freewheeling_in_t;

/* theta_f after the commutation with current i >= 0. */
pm_q_t freewheeling_angle(const freewheeling_config_t *config, const freewheeling_in_t *in, pm_q_t i);

/* i of which theta_f is the angle, 0 ... 1 rad; saturates. */
pm_q_t freewheeling_current(const freewheeling_config_t *config, const freewheeling_in_t *in, pm_q_t angle);

/* The same of a current that brakes. */
pm_q_t freewheeling_braking(const freewheeling_config_t *config, const freewheeling_in_t *in, pm_q_t angle);

void make_freewheeling(maker_t *m, freewheeling_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
