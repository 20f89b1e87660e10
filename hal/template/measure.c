/* Converters. Step 4 of docs/porting.md. */
#include "hal/template/port.h"

/* What beside leg currents and DC-link voltage your converters deliver and your timer does: NEEDS_... of
 * firmware/math/measure.h. A method that needs more is refused by name. Declare nothing before it works. */
uint32_t hal_channels(const hal_t *hal)
{
    (void)hal;
    return 0U;
}

/* Codes left-aligned in 16 bits, mid-scale without current, rising with a current into the motor: turn the
 * sign here if the amplifier does, and saturate. hw_fault: the break has acted since the last call, or is
 * active. */
void hal_measure(hal_t *hal, drive_in_t *in)
{
    (void)hal;
    /* in->more: each member whose channel hal_channels() declares, for example under
     * #if PM_CARRIES(NEEDS_TERMINALS), so that an image without it pays nothing */
    *in = (drive_in_t){.i_leg = {0x8000U, 0x8000U, 0x8000U}, .v_dc = 0, .hw_fault = true};
}

/* The last conversion of each, and the start of the next; never waits. temperature_missing beyond what the
 * sensor can give: a broken wire must not look cold. reference_off: by a second reference, as processors have it. */
void hal_measure_slow(hal_t *hal, hal_slow_t *slow)
{
    (void)hal;
    *slow = (hal_slow_t){.temperature_missing = true};
}
