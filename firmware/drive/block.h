/* Block commutation in the drive: the branch of drive_step() beside the vector's, STAGE_SIX_STEP (METHODS.md 1.4.2, 10.2.3;
 * rows 9, 108).
 *
 * six_step_start says what leads to it:
 *   0  Start, open loop and what is slower than six_step_speed are those of the vector path. From that speed on, with the flux
 *      observer alone in charge, the rotor's angle and speed are given to bldc/six_step.h, and the current goes on at what
 *      it was: i = (pi / (2 sqrt(3))) i_q
 *   1  The align of the vector path leaves the rotor at rest. With i_open_loop as i_q it turns its first 30 degrees in
 *        t_30 = root(2 (pi / 6) J / (1.5 p^2 psi_m i_q))
 *      and shows its crossings from then on. After START_CROSSINGS that belong together the speed control has it. A rotor that
 *      is wanted slower than 3/4 of six_step_speed, or the other way, begins anew with the align.
 * From then on angle and speed come from the zero crossings:
 *   theta = theta of the last crossing + (t - t_z) / turn
 * The voltage must be that of the speed, on average: (u - lost) v_dc - 2 R i within half of the EMF of the last turn or the last
 * sector, with what the dead time of one or both legs takes, else crossings are believed that are none, as of a rotor that was
 * stopped. A current below half of its largest ripple,
 *   v_dc T / (16 L)     one leg chops
 *   v_dc T / (8 L)      both do
 * may change its sign within each period: dead time then takes anything from -lost to lost, and that much more is allowed.
 * Where diodes carry the off time u v_dc is not the voltage, and this is not looked at.
 *
 * A turn whose crossings are not where they belong ends it (missed_crossings): all legs off in the same period. With
 * flying_start the rotor is looked for, caught by the vector path and given back; without, or after resync_tries, the fault
 * is POSITION_LOST. A start whose crossings do not come, or are believed for no longer than 40 ms as those that noise makes
 * of a held rotor, is tried again, as often, and then the fault is STALL. By the third harmonic of a rotor that turns and shows none
 * (third_missing.h) either is NO_THIRD_HARMONIC.
 *
 * Current limit: i_max, derated as the vector's, and with freewheeling_limit what leaves the crossing to be seen:
 *   theta_f(i) + w (t_blank + T) <= 30 degrees             (freewheeling.h)
 * in mode duty also of a current that brakes: a duty that is taken back asks for all there is.
 *
 * Mode duty: u = |duty| (patterns.h), after a ramp of t_duty from 0 to 1, in place of what the current wants. It rises by a quarter of
 * itself in a sector at most: a light rotor follows it within the turn whose sectors it is timed by. Steadily, with the dead time's
 * share `lost`,
 *   (u - lost) v_dc = (3 sqrt(3) / pi) psi_m w + 2 R i + (3 / pi) L w i
 * of which the last is what commutation takes, L i in each 60 degrees.
 * The current stays within the limits above, and the duty gives way (DRIVE_LIMIT_CURRENT, line_current.h). A duty for the other
 * direction brakes with u = 0 down to 3/4 of six_step_speed, from where the start goes on in that direction; none brakes to there and
 * holds the rotor. At rest, and where the vector turns the rotor, the speed that the duty is without a load is what is wanted:
 *   w = duty v_dc / ((3 sqrt(3) / pi) psi_m)
 * A stop slows down with `acceleration`, as in the other modes. With field orientation the drive does not start in this mode.
 *
 * block_step(): one period, currents and DC link have been checked. block_slow(): 1 kHz.
 * Tests: tests/unit/drive/block_test.cpp, block_duty_test.cpp, tests/scenario/six_step.yaml, six_step_patterns.yaml, six_step_duty.yaml,
 * bldc_demo.yaml. */
#ifndef DRIVE_BLOCK_H
#define DRIVE_BLOCK_H

#include "bldc/freewheeling.h"
#include "bldc/line_current.h"
#include "bldc/six_step.h"
#include "firmware/math/pll.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    bool on;          /* commutation = six_step */
    uint8_t tries;    /* resync_tries */
    bool limit;       /* freewheeling_limit */
    bool from_rest;   /* six_step_start = 1 */
    uint32_t t_30;    /* counts */
    pm_q_t i_start;   /* as i_q */
    pm_q_t duty_step; /* change of the duty per call of 1 kHz, ... */
    pm_q_t duty_turn; /* ... and, while it rises, of one by itself at base speed */
    pm_q_t omega_on;  /* six_step_speed ... */
    pm_q_t omega_off; /* ... and 3/4 of it */
    pm_q_t per_code;  /* per-unit volts of a terminal at full scale */
    pm_q_t lost;      /* share of v_dc that dead time takes from a driving current */
    pm_q_t blind;     /* rad at base speed in t_blank and a period, Q28 */
    six_step_config_t six_step;
    line_current_config_t current;
    freewheeling_config_t freewheeling;
    pm_q_t ripple; /* half of the current's, the largest, at a v_dc of one */
} block_config_t;

typedef struct {
    pm_pll_t pll; /* begins position_t, too */
    six_step_t six_step;
    line_current_t current;
    uint32_t now;      /* counts at t_k */
    uint32_t rate;     /* of the angle, per count */
    pm_q_t i;          /* at t_k */
    pm_q_t duty;       /* mode duty: after the ramp, negative for the other direction */
    uint16_t wrong_ms; /* for which the voltage has spoken against the speed */
#if PM_CARRIES(NEEDS_NEUTRAL)
    third_missing_t missing;
#endif
} block_t;

void make_block(maker_t *m, block_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
