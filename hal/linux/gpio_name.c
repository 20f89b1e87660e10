#include "hal/linux/gpio_backend.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool gpio_name_parse(const char *name, gpio_name_t *parsed, char *error, size_t error_size)
{
    const char *colon = strrchr(name, ':');
    char *end = NULL;
    const unsigned long offset =
        colon != NULL && colon[1] >= '0' && colon[1] <= '9' ? strtoul(colon + 1, &end, 10) : 0;
    const bool low = end != NULL && *end == '!';
    if (end == NULL || end[low ? 1 : 0] != '\0' || colon == name || offset > 4095U ||
        (size_t)(colon - name) >= sizeof parsed->chip) {
        snprintf(error, error_size,
                 "GPIO line %s: CHIP:OFFSET is wanted, e.g. gpiochip0:4, and ! behind for active low", name);
        return false;
    }
    *parsed = (gpio_name_t){.offset = (unsigned)offset, .active_low = low};
    memcpy(parsed->chip, name, (size_t)(colon - name));
    return true;
}
