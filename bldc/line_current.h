/* Control of the current that flows in by one leg and out by the other, in block commutation (METHODS.md 1.4.2, row 9).
 *
 *   e = i_ref - i                     i: of the leg that stays across the last commutation, whose current does not dip
 *   v = kp e + integral + emf         voltage between the two legs, 0 ... most v_dc
 *   u = v / v_dc                      patterns.h
 *   kp = 2 w_c L,  ki = 2 w_c R T     two phases in series; w_c: bandwidth
 *   emf = (3 sqrt(3) / pi) psi_m w    mean of 60 degrees; a trapezoid of that fundamental has half a per cent less
 * v does not fall below zero: with complementary pulses a smaller v than the EMF brakes, with diodes the current ceases.
 *
 * With a duty the voltage is given, and the control has what it leaves of a range of currents:
 *   v = duty v_dc      but not below the v of i_ref = i_min, nor above that of i_max
 * In between the back-calculation leads the integral to what the legs take, (duty v_dc - emf) through a low-pass of L / R, which is
 * 2 R i: a limit is taken up without a jump.
 *
 * The fundamental of the blocks is what field orientation calls i_q:
 *   i = (pi / (2 sqrt(3))) i_q
 * so limits, torque and speed control are those of the vector. Called once a period with the current at t_k; acts in
 * [t_k+1, t_k+2). 41 instructions, some 20 more with a duty. Per-unit: Q28, gains as pi.h.
 * Tests: tests/unit/bldc/line_current_test.cpp, tests/scenario/six_step.yaml, six_step_low_side.yaml. */
#ifndef BLDC_LINE_CURRENT_H
#define BLDC_LINE_CURRENT_H

#include "firmware/math/pi.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LINE_OF_Q      PM_Q(0.90689968211710892) /* i / i_q */
#define Q_OF_LINE      PM_Q(1.1026577908435840)
#define LINE_OF_PHASES PM_Q(1.6539866862653761) /* emf / (psi_m w) */

typedef struct {
    pm_pi_config_t pi;
    pm_q_t R_2;  /* of both phases */
    pm_q_t most; /* of u; 1, or what low-side shunts show the current at (patterns.h) */
} line_current_config_t;

typedef struct {
    pm_pi_t pi;
    pm_q_t i_ref, emf; /* of 1 kHz; i_ref: with a duty i_max */
    pm_gain_t per_v;   /* 1 / v_dc */
    pm_q_t u;          /* 0 ... most */
    uint32_t limited;  /* not 0: v has been at an end since it was last cleared */
    bool given;        /* by a duty, */
    bool held;         /* which has given way to i_min or i_max since it was last cleared */
    pm_q_t duty;       /* 0 ... 1 */
    pm_q_t i_span;     /* i_max - i_min */
} line_current_t;

/* i flows already, and is wanted. */
void line_current_reset(line_current_t *self, const line_current_config_t *config, pm_q_t i);

/* 1 kHz; v_dc >= 1/16. */
void line_current_prepare(line_current_t *self, pm_q_t i_ref, pm_q_t emf, pm_q_t v_dc);

/* 1 kHz, behind line_current_prepare() with i_max as i_ref: the voltage is `duty` v_dc, 0 ... 1, as long as the current is not
 * below i_min <= i_max nor above i_max. */
void line_current_give(line_current_t *self, pm_q_t duty, pm_q_t i_min);

void line_current_step(line_current_t *self, const line_current_config_t *config, pm_q_t i, pm_q_t v_dc);

/* Without `most`. */
void make_line_current(maker_t *m, line_current_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
