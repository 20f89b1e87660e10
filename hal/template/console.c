/* Serial port and light. The first thing that shows life: after step 1 of docs/porting.md. */
#include "hal/template/port.h"

/* Into a ring that an interrupt empties; returns how many characters had room. Never waits. */
uint32_t hal_console(hal_t *hal, const char *text)
{
    (void)hal;
    uint32_t count = 0;
    while (text[count] != '\0') {
        ++count;
    }
    return count;
}

void hal_led(hal_t *hal, bool on)
{
    (void)hal;
    (void)on;
}
