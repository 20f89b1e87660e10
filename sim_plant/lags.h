/* Amplifiers with a bandwidth of their own: the differential channel of each neutral, shunts in line, and the
 * sensor of the link current (METHODS.md 0.2 E8, E12; 11.2).
 *
 * Each is time constant * dy/dt = u - y, solved exactly for an input that moves linearly within the step; a
 * time constant of zero is the input itself. The differential channel of a set looks at
 *
 *   u = sum w_k v_k - v_N,   w_k = 1/(1 + e_k) / sum 1/(1 + e_j)
 *
 * with e_k the relative errors of the resistors of its star network: v_zero_V of plant_truth_t where these
 * are none. Tests: lags_test.cpp. */
#ifndef PLANT_LAGS_H
#define PLANT_LAGS_H

#include "sim_plant/plant.h"

typedef struct {
    double v_zero_V[PLANT_SETS];
    double i_A[PLANT_LEGS];
    double i_dc_A;
} lagged_t;

typedef struct {
    double zero_s, current_s, dc_s; /* 0: none */
    bool between;                   /* the first channel is: v_N1 - v_N2 */
    double unequal[PLANT_LEGS];     /* w_k - 1/3 */
    lagged_t y;
} lags_t;

void lags_init(lags_t *lags, const plant_sensor_t *sensor, int legs);

static inline bool lags_active(const lags_t *lags)
{
    return lags->zero_s > 0.0 || lags->current_s > 0.0 || lags->dc_s > 0.0;
}

/* Input of the differential channel of a set, from its zero sequence, its three terminals and the star points. */
double lags_zero_V(const lags_t *lags, int set, double v_zero_V, const double v_leg_V[],
                   const double v_neutral_V[]);

/* One step with the inputs at its ends. */
void lags_advance(lags_t *lags, double duration_s, const lagged_t *before, const lagged_t *after);

#endif
