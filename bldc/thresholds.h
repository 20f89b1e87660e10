/* Thresholds of the zero crossings that make a machine and dividers with tolerances commutate evenly (METHODS.md 10.4; rows
 * 112 to 115).
 *
 * Vertical deviation: a divider of gain 1 + eps moves the terminal by eps v_dc / 2, up and down crossings the opposite
 * way in time. Horizontal: unlike resistances and inductances of the two phases that conduct move the star point by
 *   dv / 2,   dv = (R_H - R_L) i + (L_H - L_L) di/dt
 * which moves up and down crossings of a terminal the same way in time. Two values for each terminal take them off:
 *   threshold upwards    reference + u_V - u_H
 *   threshold downwards  reference + u_V + u_H                    (the other way round where B and C are exchanged)
 * Learnt from the intervals i_0 ... i_5 of a turn T, of which i_5 ends with a crossing of the terminal, u_V after its upward
 * one, u_H after its downward one:
 *   u_V += k_V (3/2) swing D_V / T    D_V = (i_0 + i_1 + i_2) - (i_3 + i_4 + i_5)
 *   u_H += k_H swing D_H / T          D_H = i_2 - i_0 + i_5 - i_3
 * with swing of zero_crossing.h, so that k_V and k_H are the share of a deviation that is taken off in a turn: 0.05
 * settles within 100 turns. Of on times: deviations are others in the off time, whose crossings they are not used for; they are
 * learnt from turns that have none of these. Horizontal deviations show by their differences only: their mean is taken as zero.
 * A rotor that speeds up moves all three alike, 0.3 degrees in a start; thresholds_slow() takes that off.
 *
 * Q28 per-unit; each value is held within +-most. thresholds_learn(): 76 instructions with a division,
 * after a crossing if all six of the last turn are good. thresholds_at(): 17.
 * Tests: tests/unit/bldc/thresholds_test.cpp, six_step_test.cpp. */
#ifndef BLDC_THRESHOLDS_H
#define BLDC_THRESHOLDS_H

#include "bldc/sectors.h"
#include "firmware/math/fixed.h"
#include "firmware/math/measure.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_frac_t k_V; /* (3/2) k_V, 0: none */
    pm_frac_t k_H;
    pm_q_t most; /* of each */
} thresholds_config_t;

typedef struct {
    pm_q_t u_V[PM_LEGS], u_H[PM_LEGS]; /* begin at zero; to be kept from start to start */
} thresholds_t;

/* What the difference of zero_crossing.h, which rises, is at the crossing. */
pm_q_t thresholds_at(const thresholds_t *self, uint32_t sector, bool reverse);

/* After the crossing in `sector`; interval[s] ended with that in sector s. */
void thresholds_learn(thresholds_t *self, const thresholds_config_t *config, uint32_t sector, bool reverse,
                      const uint32_t interval[], uint32_t turn, pm_q_t swing);

/* At 1 kHz: no mean of u_H. */
void thresholds_slow(thresholds_t *self);

#ifdef __cplusplus
}
#endif

#endif
