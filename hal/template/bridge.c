/* PWM timer, dead time, break. Step 3 of docs/porting.md: with a scope and without a supply on the bridge. */
#include "hal/template/port.h"

/* 1. compare values into preload registers, so that they take effect at the update event, which is the centre
 * of the all-low vector
 * 2. keep the legs' states for the next control interrupt, or preload them
 * 3. out->trip: off, now */
void hal_bridge_write(hal_t *hal, const drive_out_t *out)
{
    if (out->trip != 0U) {
        hal_bridge_off(hal);
    }
}

/* Enable the outputs unless a break flag is set. Do not clear it here: hal_measure() does, when it has reported
 * the break. */
bool hal_bridge_arm(hal_t *hal)
{
    return !hal->refused && hal_bridge_armed(hal);
}

/* All six switches open, by one store that no interrupt can split. */
void hal_bridge_off(hal_t *hal)
{
    (void)hal;
}

/* The timer's own bit, which the break clears, not a copy. */
bool hal_bridge_armed(const hal_t *hal)
{
    (void)hal;
    return false;
}
