/* Which of two poles: what the methods of chapter 8 share (METHODS.md 8.1 to 8.4; METHODS-ADDENDUM.md B (b)).
 *
 * A magnet saturates the core, so that L_d falls with the current that adds to its flux. What shows that is a
 * difference, of two currents or two answers to a carrier, that a linear machine makes zero. Of n values x:
 *   mean   = sum x / n
 *   noise  = root(sum (x - mean)^2) / n,   but no less than what the current's noise i_noise makes of it
 *   margin = (|mean| - allowance) / noise
 * A polarity is sure from PULSES_SURE, five sigma, on; below, the machine or the carrier is refused. The noise that
 * is known sets the floor, as the spread of a few values may be small by chance. The allowance is what a machine that
 * does not saturate may show: share of the answer, each method has its own.
 *
 * Whether L_d falls with the magnetising or, where the magnet's own flux holds bridges saturated, with the
 * demagnetising current, nothing that is measured at rest can tell: the parameter L_d_falls says it, and the
 * opposite of the truth gives the opposite pole with a good margin. The EMF finds that later (drive/slip.h). What is seen at
 * the neutral goes by dL_0 / di_d, too, and has a parameter of its own, zero_falls.
 *
 * n a power of two, at most 256; |x| < 0.125. polarity_noise() about 400 instructions, at 1 kHz.
 * Tests: tests/unit/injection/polarity_test.cpp. */
#ifndef INJECTION_POLARITY_H
#define INJECTION_POLARITY_H

#include "firmware/params/types.h"
#include "injection/pulses.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int64_t sum, square; /* Q28, Q56 */
    uint16_t count;
} polarity_mean_t;

typedef struct {
    pm_q_t i_d;        /* d_current: in either direction */
    pm_q_t noise;      /* of one value, by that of the converter */
    pm_q_t h_d;        /* expected answer of the carrier, a current or a voltage at the neutral */
    uint16_t block_ms; /* so long lie values apart that have nothing in common */
    uint16_t values;   /* of secondary_current, half of them of each direction of d_current: a power of two */
    bool reversed;     /* the answer falls with the magnetising current */
} polarity_config_t;

void polarity_add(polarity_mean_t *self, pm_q_t x);
pm_q_t polarity_mean(const polarity_mean_t *self);
pm_q_t polarity_noise(const polarity_mean_t *self); /* of the mean, by the spread of the values */

/* Of one value is left of a mean of `count`: 1 / root(count). */
pm_q_t polarity_rest(pm_q_t noise, uint32_t count);

/* PM_DONE: `mean` is beyond its noise, *north says whether it is positive where it should be. */
pm_procedure_t polarity_judge(const polarity_config_t *config, pm_q_t mean, pm_q_t allowance, pm_q_t noise,
                              pm_sigma_t *margin, bool *north);

/* What it looks at. */
typedef struct {
    uint32_t periods; /* after which a value has nothing in common with the one before: a carrier's, or 1 */
    pm_q_t noise;     /* of one value, in the unit of h_d */
    pm_q_t h_d;
    bool reversed;
} polarity_carrier_t;

/* A carrier along d whose answer is a current: of n samples, of which a window gives the amplitude, or 1, the difference
 * of two. */
polarity_carrier_t polarity_by_current(maker_t *m, uint32_t n, pm_q_t h_d);

void make_polarity(maker_t *m, const polarity_carrier_t *carrier, polarity_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
