/* Over either version of libgpiod */
#include "hal/linux/gpio_line.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "hal/linux/gpio_backend.h"

gpio_line_t *gpio_line_open(const char *name, gpio_use_t use, char *error, size_t error_size)
{
    gpio_name_t parsed;
    if (!gpio_name_parse(name, &parsed, error, error_size)) {
        return NULL;
    }
    gpio_line_t *line = gpio_backend_request(&parsed, use);
    if (line == NULL) {
        snprintf(error, error_size, "GPIO line %s: %s", name, strerror(errno));
    }
    return line;
}
