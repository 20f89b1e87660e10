/* Without libgpiod */
#include "hal/linux/gpio_line.h"

#include <stdio.h>

gpio_line_t *gpio_line_open(const char *name, gpio_use_t use, char *error, size_t error_size)
{
    (void)use;
    snprintf(error, error_size,
             "GPIO line %s: this build has no libgpiod (tools/setup, then configure again)", name);
    return NULL;
}

void gpio_line_close(gpio_line_t *line)
{
    (void)line;
}

bool gpio_line_set(gpio_line_t *line, bool active)
{
    (void)line;
    (void)active;
    return false;
}

int gpio_line_get(gpio_line_t *line)
{
    (void)line;
    return -1;
}

int gpio_line_edges(gpio_line_t *line)
{
    (void)line;
    return -1;
}
