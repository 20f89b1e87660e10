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
 * PWM swings the current about its mean, too: at the edges of the leg that the vector v lies along it is off by r,
 *   r = v_dc T_s / (6 L) m (1 - m)
 *   m = |v| / (2/3 v_dc)
 * below the mean where that leg switches on, above it where the leg switches off. A leg with less current than r loses nothing. So
 * where r is beyond the edge of the first part, that goes up to r, and the share of the second part falls as the edge over r.
 * A carrier that swings the current about its mean, from -S to S for the vector in one period and back in the next, has the
 * leg that it lifts most switch on and off at the ends of the swing, and in the next period, when that leg is the lowest, in
 * its middle. So half of what is lost has the sign of the mean current, and half the signs at the ends of the swing:
 *   lost = 1/2 sign(i) + 1/4 (sign(i + S) + sign(i - S))
 * of which the second is none below S. While a carrier is added f is two halves: one up to S / 8, one up to S. Where S / 8
 * is inside of the zone without a carrier it is one part up to S / 2, and where that is too, f is as without. A current
 * along the carrier has none of the second half below S and all of it above, one across it has more the larger it is. So
 * the second half is taken times |i_q| / |i| up to |i| = 0.9 S, in full from 1.15 S on, and linearly between.
 * The returned vector is the one without compensation, which is what the motor then receives. Legs are
 * shares of the period up to the last step, where one saturation keeps each within the timer's counts.
 *
 * Low-side shunts see currents while the lower switch conducts, from dead time and `t_settle` after the last
 * edge until the sample at the centre of the zero vector: a leg is hidden when its on-time is above
 *   top = 1 - 2 f_pwm (T_dt + t_settle)
 * Where the largest of the centred legs would be, all are moved down until the lowest is on for just the dead
 * time and what it may lose, which the motor does not see. If that leg is hidden all the same, two currents are
 * measured and the third follows. The middle leg is seen as long as the vector stays within
 *   2/3 top' v_dc,   top' = top - T_dt f_pwm - 2 lost
 * which is part of the voltage limit, modulator_reach(): all of v_dc/sqrt(3) from top' = 0.866 on. While `carrier` is
 * set the vector is shortened further, so that the largest leg stays below top': the leg that a carrier hides
 * would be another in each period.
 * With t_settle = 0, shunts in the lines, nothing of this happens.
 *
 * modulator_step() once per period; the output holds over the next one, so i is the current expected there.
 * One division. modulator_slow() at 1 kHz with the link voltage, and once before the first step. Range:
 * |v| < 4, v_dc >= 1/16, timer_counts < 2^15. Tests: tests/unit/control/modulator_test.cpp,
 * tests/scenario/overmodulation.yaml. */
#ifndef CONTROL_MODULATOR_H
#define CONTROL_MODULATOR_H

#include "firmware/control/regulation.h"
#include "firmware/math/frames.h"
#include "firmware/math/image.h"
#include "firmware/math/legs.h"
#include "firmware/math/measure.h"
#include "firmware/math/root.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t counts; /* timer counts of half a period */
    int32_t whole;  /* the same for pm_share_of() */
    int32_t top;    /* on-time above which the current of a leg is hidden, Q20; one: never */
    /* pm_mulh(edge / 4, per_zone) = 2^PM_ZONE_BITS; 0: no compensation; [1]: while a carrier is added, another than
     * [0] where that swings the current beyond the zone */
    int32_t per_zone[2];
    int32_t ripple; /* pm_mulh(|v|, ripple) = 2^PM_ZONE_BITS where r / (1 - m) is the edge; 0: r never is */
    uint8_t far[2]; /* quarters of what is lost that the second part has: 0 or 1; with a swing 0 or 2 */
    int32_t dead;   /* share of the period that dead time takes, Q20 */
    pm_q_t drop;    /* device drop */
} modulator_config_t;

typedef struct {
    int32_t hidden; /* legs of the last period's output in bits 8 to 10, of the one before in 0 to 2 */
    int32_t zone_alpha, zone_beta; /* present one: 1 over its edge, sqrt(3)/2 of that */
    int32_t near, far; /* share that dead time and drops take, in two parts, Q33; together below a quarter */
    int32_t limited;   /* not 0 when the vector was shortened: the share of it; the reader clears it */
    pm_unit_t room;    /* share of v_dc up to which the span of centred legs hides none */
    /* of low-side shunts, on-times without compensation, Q20: */
    int32_t seen;    /* the largest leg's up to which its current is seen */
    int32_t lowest;  /* the lowest leg's when they are moved down */
    pm_q_t per_seen; /* with `carrier`, 1 over the on-time of a vector that hides none; else 1 */
    bool carrier;    /* one is added, and none is hidden: the user's choice, before modulator_slow() */
} modulator_t;

typedef struct {
    int32_t on[3]; /* 0 ... counts */
    pm_ab_t v;     /* realised */
} modulator_out_t;

/* v: present vector; i: mean current wanted, of use while a carrier along d is added. */
void modulator_slow(modulator_t *self, const modulator_config_t *config, pm_q_t v_dc, pm_ab_t v, pm_dq_t i);

/* i_quarter: a quarter of the current, Q26. */
void modulator_step(modulator_t *self, const modulator_config_t *config, pm_ab_t v, pm_q_t v_dc,
                    pm_ab_t i_quarter, modulator_out_t *out);

#if PM_CARRIES(NEEDS_BRIDGES)
/* A bridge whose legs may have a common part and whose currents a sum. */
typedef struct {
    pm_ab_t v;
    pm_q_t v_zero;         /* added to each leg */
    pm_ab_t i_quarter;     /* as above */
    pm_q_t i_zero_quarter; /* a quarter of what each leg carries beside it */
} modulator_zero_t;

/* As modulator_step(), with shunts in the lines; where the legs do not reach as far, vector and common part are shortened. Returns the
 * common part that acts. */
pm_q_t modulator_step_zero(modulator_t *self, const modulator_config_t *config, const modulator_zero_t *in,
                           pm_q_t v_dc, modulator_out_t *out);
#endif

/* A period in `hidden`. */
#define MODULATOR_NEXT 256

/* Of a share: what pm_per_volt() may be too large by. */
#define MODULATOR_ROUNDING (PM_SHARE_ONE / 2048)

/* Legs whose current is not valid in the sample between the last two outputs that have begun: a bit each.
 * Once a period, before modulator_step(), while `hidden` is not zero. */
static inline uint32_t modulator_take_hidden(modulator_t *self)
{
    const uint32_t hidden = (uint32_t)self->hidden;
    const uint32_t last = hidden / (uint32_t)MODULATOR_NEXT;
    self->hidden = (int32_t)last;
    return (hidden | last) & 7U;
}

#if REGULATION_HOLDS
/* Voltage that dead time takes in a period from legs that are held, as they go from one state to the next. Of a leg, with f between
 * -1 and 1 by its current i at the edge (comp_zone):
 *   upwards    -T_dt/T_s v_dc min(1, 1 + f)
 *   downwards  +T_dt/T_s v_dc min(1, 1 - f)
 * None without compensation of dead time. */
pm_ab_t modulator_edges(const modulator_t *self, const modulator_config_t *config, uint16_t from, uint16_t to,
                        pm_abc_t i, pm_q_t v_dc);
#endif

#if PM_CARRIES(NEEDS_HALVES)
/* Compare values of both halves, in counts: the first half is given `split` more of voltage and the second as
 * much less, the period as much as before. Where that leaves the carrier's range all legs of the half move
 * together, which the motor does not see; what even then does not fit is cut and flagged. One division. */
void modulator_split(modulator_t *self, const modulator_config_t *config, pm_ab_t split, pm_q_t v_dc,
                     uint16_t (*compare)[2]);
#endif

void make_modulator(maker_t *m, modulator_config_t *c);

/* Share of v_dc within which low-side shunts see two currents in every direction, at the smallest link voltage;
 * PM_UNIT_MAX with shunts in the lines. */
pm_unit_t modulator_reach(maker_t *m, const modulator_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
