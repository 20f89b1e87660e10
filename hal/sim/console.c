#include "hal/sim/port.h"

#include <string.h>

uint32_t hal_console(hal_t *hal, const char *text)
{
    const size_t used = strlen(hal->console);
    const size_t length = strlen(text);
    const size_t room = SIM_CONSOLE - 1U - used;
    const size_t taken = length < room ? length : room;
    memcpy(&hal->console[used], text, taken);
    hal->console[used + taken] = '\0';
    return (uint32_t)taken;
}

void hal_led(hal_t *hal, bool on)
{
    hal->led = on;
}
