/* Whether the third harmonic is there, while a rotor starts by its crossings (METHODS.md 11.6.2, row 132). A rotor that is held shows
 * no crossing either; what tells one from the other is the open terminal, whose EMF needs none of the third harmonic:
 *
 *   missing:  swing of v_zero < share * swing of the open terminal,   where the right side is more than `least`
 * Swings are largest less smallest of a mean of eight samples, both since the same instant: one sector, legs in one place, behind
 * the freewheeling and what rings after it. With what a rotor is told,
 *   sine        v_zero swings by 6 psi_3 / psi_m / 1.5 of the terminal in the middle 60 degrees:   share 2 psi_3 / psi_m, half of it
 *   trapezoid   by a third of it:                                                                  share 1/9, a third of it
 * and less where it turns further, by at most 0.6 times. least: sixteen steps of the neutral's channel.
 *
 * third_missing_step(): one sample a period, no division. Tests: tests/unit/bldc/third_missing_test.cpp,
 * tests/scenario/six_step_third_missing.yaml. */
#ifndef BLDC_THIRD_MISSING_H
#define BLDC_THIRD_MISSING_H

#include "bldc/zero_crossing.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t share;
    pm_q_t least; /* per-unit, > 0 */
    pm_q_t rail;  /* zero_crossing.h */
} third_missing_config_t;

typedef struct {
    pm_q_t mean, least, most;
} third_swing_t;

typedef struct {
    third_swing_t terminal, zero;
    uint8_t place;   /* sector and legs of the last sample, */
    uint8_t samples; /* and how many there were of it, up to what settles */
    bool missing;
} third_missing_t;

typedef struct {
    const zero_sample_t *sample;
    pm_q_t v_zero;
    uint8_t sector, leg; /* the open one */
    zero_legs_t legs;
} third_missing_in_t;

void third_missing_step(third_missing_t *self, const third_missing_config_t *config,
                        const third_missing_in_t *in);

#ifdef __cplusplus
}
#endif

#endif
