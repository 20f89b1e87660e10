#include "sim_plant/lags.h"

#include <math.h>

void lags_init(lags_t *lags, const plant_sensor_t *sensor, int legs)
{
    bool in_line = sensor->shunt == PLANT_IN_LINE;
    *lags = (lags_t){.zero_s = sensor->v_zero_full_scale_V > 0.0 ? sensor->v_zero_filter_s : 0.0,
                     .current_s = in_line ? sensor->i_filter_s : 0.0,
                     .between = sensor->v_zero_between,
                     .dc_s = sensor->i_dc_full_scale_A > 0.0 ? sensor->i_dc_filter_s : 0.0};
    for (int first = 0; first < legs; first += 3) {
        double sum = 0.0;
        for (int k = first; k < first + 3; k++) {
            sum += 1.0 / (1.0 + sensor->v_zero_network_error[k]);
        }
        for (int k = first; k < first + 3; k++) {
            lags->unequal[k] = 1.0 / (1.0 + sensor->v_zero_network_error[k]) / sum - 1.0 / 3.0;
        }
    }
}

double lags_zero_V(const lags_t *lags, int set, double v_zero_V, const double v_leg_V[],
                   const double v_neutral_V[])
{
    if (lags->between && set == 0) {
        return v_neutral_V[0] - v_neutral_V[1];
    }
    for (int k = 3 * set; k < 3 * set + 3; k++) {
        v_zero_V += lags->unequal[k] * v_leg_V[k];
    }
    return v_zero_V;
}

static void advance(double *y, double gap, double late, double before, double after)
{
    *y += (before - *y) * gap + (after - before) * late;
}

void lags_advance(lags_t *lags, double duration_s, const lagged_t *before, const lagged_t *after)
{
    if (duration_s <= 0.0) {
        return;
    }
    if (lags->zero_s > 0.0) {
        double constants = duration_s / lags->zero_s;
        double gap = -expm1(-constants);
        for (int set = 0; set < PLANT_SETS; set++) {
            advance(&lags->y.v_zero_V[set], gap, 1.0 - gap / constants, before->v_zero_V[set],
                    after->v_zero_V[set]);
        }
    }
    if (lags->current_s > 0.0) {
        double constants = duration_s / lags->current_s;
        double gap = -expm1(-constants);
        for (int k = 0; k < PLANT_LEGS; k++) {
            advance(&lags->y.i_A[k], gap, 1.0 - gap / constants, before->i_A[k], after->i_A[k]);
        }
    }
    if (lags->dc_s > 0.0) {
        double constants = duration_s / lags->dc_s;
        double gap = -expm1(-constants);
        advance(&lags->y.i_dc_A, gap, 1.0 - gap / constants, before->i_dc_A, after->i_dc_A);
    }
}
