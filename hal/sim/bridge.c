#include "hal/sim/port.h"

void hal_bridge_write(hal_t *hal, const drive_out_t *out)
{
    plant_pwm_t pwm = {0};
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        pwm.compare[leg][0] = out->compare[leg][0];
        pwm.compare[leg][1] = out->compare[leg][1];
        pwm.driven[leg] = out->driven[leg] && hal->armed;
    }
    plant_set_pwm(hal->plant, &pwm);
    if (out->trip) {
        hal_bridge_off(hal);
    }
}

bool hal_bridge_arm(hal_t *hal)
{
    hal->armed = hal->configured && !hal->hw_fault && !plant_break_held(hal->plant);
    return hal->armed;
}

/* Hardware does not wait for the update event. */
void hal_bridge_off(hal_t *hal)
{
    if (hal->armed) {
        hal->armed = false;
        plant_trip(hal->plant);
    }
}

bool hal_bridge_armed(const hal_t *hal)
{
    return hal->armed;
}
