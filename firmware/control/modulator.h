/* Space-vector modulation with overmodulation (METHODS.md 1.3.2.1, row 4) and dead-time compensation
 * (5.6.1.1).
 *
 * Min-max zero sequence: linear up to v_dc/sqrt(3) in every direction, to the hexagon in its corners. Beyond
 * the hexagon the vector is shortened along its own direction, so the angle is kept; the realised vector is
 * returned. Largest fundamental of a vector that turns evenly: 1.049 v_dc/sqrt(3); how far current control
 * goes is `voltage_limit`. Compensation adds to each leg the on-time that dead time and device drops take from it, with the
 * sign of the leg's current:
 *   +-(T_dt/T_s + V_drop/v_dc) f(|i|),   at most a quarter of the period
 * The capacitance C of a leg gives part of it back, since the current has to move the node: with I_1 = C v_dc
 * / T_dt
 *   f = i / (2 I_1) up to I_1, 1 - I_1 / (2 i) beyond
 * f is made of two linear parts, 3/4 up to 1.7 I_1 and 1/4 up to 8 times that; error 0.07. Without
 * capacitance, or where `comp_zone` is larger than 1.7 I_1, there is one part, up to `comp_zone`.
 * The returned vector is the one without compensation, which is what the motor then receives. Legs are
 * shares of the period up to the last step, where one saturation keeps each within the timer's counts.
 *
 * modulator_step() once per period; the output holds over the next one, so i is the current expected there.
 * One division. modulator_slow() at 1 kHz with the link voltage, and once before the first step. Range:
 * |v| < 4, v_dc >= 1/16, timer_counts < 2^15. Tests: tests/unit/control/modulator_test.cpp,
 * tests/scenario/overmodulation.yaml. */
#ifndef CONTROL_MODULATOR_H
#define CONTROL_MODULATOR_H

#include "firmware/math/frames.h"
#include "firmware/math/measure.h"
#include "firmware/math/root.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t counts;     /* timer counts of half a period */
    int32_t zone_alpha; /* pm_mulh(zone / 4, zone_alpha) = 2^PM_ZONE_BITS */
    int32_t zone_beta;  /* sqrt(3)/2 zone_alpha */
    pm_frac_t far;      /* share of the second part: 1/4 or 0 */
    int32_t dead;       /* share of the period that dead time takes, Q20 */
    pm_q_t drop;        /* device drop */
    bool compensate;
} modulator_config_t;

typedef struct {
    int32_t near, far; /* share that dead time and drops take, in two parts, Q33; together below a quarter */
    int32_t limited;   /* not 0 when the vector was shortened: the share of it; the reader clears it */
} modulator_t;

typedef struct {
    int32_t on[3]; /* 0 ... counts */
    pm_ab_t v;     /* realised */
    bool limited;  /* the vector was shortened */
} modulator_out_t;

void modulator_slow(modulator_t *self, const modulator_config_t *config, pm_q_t v_dc);

/* i_quarter: a quarter of the current, Q26. */
void modulator_step(modulator_t *self, const modulator_config_t *config, pm_ab_t v, pm_q_t v_dc,
                    pm_ab_t i_quarter, modulator_out_t *out);

#if PM_CARRIES(NEEDS_HALVES)
/* Compare values of both halves, in counts: the first half is given `split` more of voltage and the second as
 * much less, the period as much as before. Where that leaves the carrier's range all legs of the half move
 * together, which the motor does not see; what even then does not fit is cut and flagged. One division. */
void modulator_split(modulator_t *self, const modulator_config_t *config, pm_ab_t split, pm_q_t v_dc,
                     uint16_t (*compare)[2]);
#endif

void make_modulator(maker_t *m, modulator_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
