#include "hal/sim/port.h"

#include <math.h>

/* The comparators of a board look at the currents themselves, not at the converter's codes. */
static bool comparators_trip(const hal_t *hal)
{
    if (hal->i_break_A <= 0.0) {
        return false;
    }
    plant_truth_t truth;
    plant_truth_windings(hal->plant, &truth);
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        if (fabs(truth.i_A[leg]) > hal->i_break_A) {
            return true;
        }
    }
    return false;
}

void hal_measure(hal_t *hal, drive_in_t *in)
{
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        in->i_leg[leg] = hal->adc.i_leg[leg];
    }
    in->v_dc = hal->adc.v_dc;
    in->hw_fault = hal->hw_fault || comparators_trip(hal);
    if (in->hw_fault) {
        hal_bridge_off(hal);
    }
}

void hal_measure_slow(hal_t *hal, hal_slow_t *slow)
{
    *slow =
        (hal_slow_t){.temperature_dC = hal->temperature_dC, .temperature_missing = hal->temperature_missing};
}
