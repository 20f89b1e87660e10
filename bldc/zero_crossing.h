/* Instant at which the EMF of the open leg crosses zero, from samples of its terminal (METHODS.md 10.2.3, 10.3.2; rows 110
 * and 111).
 *
 * Terminal against the negative rail, e the phase EMF of the open leg, factor f = 3/2 for a sine, 1 for a trapezoid:
 *   on time                                  v = v_dc / 2 + f e
 *   off time, current through lower diodes   v =            f e
 *   off time, current through upper diodes   v = v_dc     + f e
 * Reference, of the configuration:
 *   ZERO_LINK       that of the three that belongs to the instant of the sample
 *   ZERO_TERMINALS  mean of the three terminals, whatever the instant:  v - mean = (2/3) f e
 *   ZERO_NEUTRAL    the star point, which needs NEEDS_NEUTRAL:          v - v_N = e
 * Towards the crossing the difference y rises (its sign is changed in odd sectors). The sample before the crossing and the
 * one after it, with their instants:
 *   t_z = t_1 + (t_2 - t_1) (-y_1) / (y_2 - y_1)
 * so that the carrier may have any ratio to the speed. Where only one of them tells a distance:
 *   t_z = t - t_60 (x + curve x^3),   x = y / swing <= 3/4,   swing = f e'(0) pi / 3
 * which holds for the late crossing, when the first sample behind the freewheeling is already past it, and for a sample that
 * the rails have cut. swing is what the difference rises by in 60 degrees at the slope of its crossing, t_60 their time;
 * curve is that of a sine, 1.4 degrees at a distance of 30.
 * A sample nearer than `seen` tells neither side until another of its sector was further off: a rotor
 * that stands has no EMF, only noise, which crosses.
 *
 * Freewheeling: until the current of the leg that has gone is zero its diode holds the terminal at the rail beyond the
 * crossing (the upper one in even sectors). Samples within `rail` of that rail are passed over until one shows that the
 * crossing is still to come. Before, `blank` counts after the commutation nothing is looked at: dead time and ringing.
 * A braking current holds it at the other rail, where no on-time sample of an EMF can be: passed over too.
 * Behind it the terminal swings to its EMF with the capacitance of the leg. So a sample that is past the crossing without
 * one ahead of it counts where the crossing is due by then, or where the next one says the same; not further past
 * than 5/8 of the swing, where no rotor in this sector can be.
 * An EMF beyond the rails drives a current through the diode of the open leg in the off time, too, which ceases in the on
 * time: where a crossing would be early by 15 degrees, the samples on both sides of it must agree with the slope of the EMF, else
 * they tell nothing.
 * With both legs high the upper diode holds it above v_dc, and `rail` counts from there upwards: EMFs of either sign are
 * seen, as far as the channel's full scale leaves room. With both low that is beyond a channel which begins at zero: there
 * freewheeling and past look alike at a downward crossing, and a late one is missed. An offset of the channel, or of
 * virtual_third.h the current of the driven legs, may keep it above zero there: within rail / 4 the slope tells from the last
 * sample further off. Of a rotor that is about to start the whole EMF is within `rail` of the lower rail: where it swings by less
 * than 2 rail, from t_60 / 16 behind the commutation on, when its currents have ceased, only rail / 4 of the rail tell nothing.
 * Patterns that look there start by that; without it two of three commutations are those that were expected, which lose a light
 * rotor.
 *
 * A RC filter of the terminals must settle within the on time and does not delay (METHODS-ADDENDUM.md, E20); what a
 * comparator delays is taken off by the commutation.
 *
 * Instants are counts of the carrier's timer that go on from period to period and wrap after 2^32. Voltages in Q28
 * per-unit. Error of the instant: (t_2 - t_1) 2^-15 and a count of 2. zero_crossing_step(): 60 instructions, 78 with
 * a division where it finds a crossing, 60 and a division more where that is a late one. Once a sample.
 * Tests: tests/unit/bldc/zero_crossing_test.cpp, six_step_test.cpp. */
#ifndef BLDC_ZERO_CROSSING_H
#define BLDC_ZERO_CROSSING_H

#include "bldc/sectors.h"
#include "firmware/math/fixed.h"
#include "firmware/math/measure.h"

#ifdef __cplusplus
extern "C" {
#endif

#define ZERO_CURVE_SINE PM_FRAC(0.18277046) /* (pi / 3)^2 / 6 */

typedef enum { ZERO_LINK, ZERO_TERMINALS, ZERO_NEUTRAL } zero_reference_t;

/* Where both driven legs are at the instant of a sample. */
typedef enum { ZERO_LEGS_LOW, ZERO_LEGS_APART, ZERO_LEGS_HIGH } zero_legs_t;

typedef struct {
    zero_reference_t reference;
    pm_q_t rail;     /* nearer than this to a rail a sample tells nothing; METHODS-ADDENDUM.md A2: 0.35 V */
    uint32_t blank;  /* counts after a commutation */
    pm_q_t swing;    /* at base speed, > 0, */
    uint32_t t_60;   /* where this is the time of 60 degrees, counts */
    pm_frac_t curve; /* of a distance y: 0 for a trapezoid; ZERO_CURVE_SINE */
} zero_crossing_config_t;

typedef struct {
    pm_q_t v[PM_LEGS]; /* terminals against the negative rail */
    pm_q_t v_neutral;  /* star point minus mean of the terminals; ZERO_NEUTRAL only */
    pm_q_t v_dc;
} zero_sample_t;

typedef struct {
    uint32_t at; /* instant */
    zero_legs_t legs;
} zero_instant_t;

typedef struct {
    pm_q_t threshold; /* what y is at the crossing in the on time; thresholds.h */
    uint32_t moved;   /* or how far the crossing is behind that of y, counts; phase_compensation.h */
    uint32_t t_60;    /* counts */
    uint32_t at;      /* instant of the crossing, from those before */
    pm_q_t
        seen; /* nearer to the threshold a sample tells nothing until another was further off; 0: it does */
} zero_expected_t;

typedef struct {
    uint8_t sector;
    uint8_t leg; /* the open one */
    bool rising;
    uint32_t open_since; /* instant of the commutation into it */
    uint32_t at; /* instant of the crossing, once found; before, of the last sample ahead of it, or past */
    pm_q_t y;    /* of that sample, < 0 ahead of the crossing */
    bool ahead;  /* there was such a sample, */
    bool cut;    /* and a rail has cut it */
    bool past;   /* a sample was past the crossing, without one ahead of it */
    bool found;
} zero_crossing_t;

/* What the difference rises by in 60 degrees that take t_60, > 0: one division. */
pm_q_t zero_crossing_swing(const zero_crossing_config_t *config, uint32_t t_60);

/* Looks at the open leg of another sector. */
void zero_crossing_open(zero_crossing_t *self, uint32_t sector, bool reverse, uint32_t since);

/* One sample of that sector; true when it has found the crossing. Not after that. */
bool zero_crossing_step(zero_crossing_t *self, const zero_crossing_config_t *config, const zero_sample_t *in,
                        zero_instant_t when, const zero_expected_t *expected);

#ifdef __cplusplus
}
#endif

#endif
