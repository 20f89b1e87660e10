#include "hal/sim/port.h"

/* Since the last measurement, or still. */
static bool comparators_tripped(hal_t *hal)
{
    double after_s;
    bool broke = plant_broke(hal->plant, &after_s);
    return broke || plant_break_held(hal->plant);
}

void hal_measure(hal_t *hal, drive_in_t *in)
{
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        in->i_leg[leg] = hal->adc.i_leg[leg];
    }
    in->v_dc = hal->adc.v_dc;
    in->hw_fault = comparators_tripped(hal) || hal->hw_fault;
    if (in->hw_fault) {
        hal_bridge_off(hal);
    }
}

void hal_measure_slow(hal_t *hal, hal_slow_t *slow)
{
    *slow =
        (hal_slow_t){.temperature_dC = hal->temperature_dC, .temperature_missing = hal->temperature_missing};
}
