/* libgpiod 1.x */
#include "hal/linux/gpio_backend.h"

#include <errno.h>
#include <gpiod.h>
#include <stdlib.h>
#include <time.h>

struct gpio_line {
    struct gpiod_chip *chip;
    struct gpiod_line *line;
};

static int request_type(gpio_use_t use)
{
    switch (use) {
    case GPIO_OUTPUT_OFF:
    case GPIO_OUTPUT_ON:
    case GPIO_OPEN_DRAIN:
        return GPIOD_LINE_REQUEST_DIRECTION_OUTPUT;
    case GPIO_EDGES:
        return GPIOD_LINE_REQUEST_EVENT_BOTH_EDGES;
    case GPIO_INPUT:
        break;
    }
    return GPIOD_LINE_REQUEST_DIRECTION_INPUT;
}

gpio_line_t *gpio_backend_request(const gpio_name_t *name, gpio_use_t use)
{
    const struct gpiod_line_request_config request = {
        .consumer = "pmdrive",
        .request_type = request_type(use),
        .flags = (name->active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0) |
                 (use == GPIO_OPEN_DRAIN ? GPIOD_LINE_REQUEST_FLAG_OPEN_DRAIN : 0),
    };
    gpio_line_t *line = calloc(1, sizeof *line);
    if (line == NULL) {
        return NULL;
    }
    line->chip = gpiod_chip_open_lookup(name->chip);
    line->line = line->chip != NULL ? gpiod_chip_get_line(line->chip, name->offset) : NULL;
    if (line->line == NULL || gpiod_line_request(line->line, &request, use == GPIO_OUTPUT_ON) != 0) {
        const int reason = errno;
        line->line = NULL;
        gpio_line_close(line);
        errno = reason;
        return NULL;
    }
    return line;
}

void gpio_line_close(gpio_line_t *line)
{
    if (line == NULL) {
        return;
    }
    if (line->line != NULL) {
        gpiod_line_release(line->line);
    }
    if (line->chip != NULL) {
        gpiod_chip_close(line->chip);
    }
    free(line);
}

bool gpio_line_set(gpio_line_t *line, bool active)
{
    return gpiod_line_set_value(line->line, active ? 1 : 0) == 0;
}

int gpio_line_get(gpio_line_t *line)
{
    return gpiod_line_get_value(line->line);
}

int gpio_line_edges(gpio_line_t *line)
{
    const struct timespec at_once = {0, 0};
    struct gpiod_line_event event;
    int edges = 0;
    for (;;) {
        const int waiting = gpiod_line_event_wait(line->line, &at_once);
        if (waiting < 0 || (waiting > 0 && gpiod_line_event_read(line->line, &event) != 0)) {
            return -1;
        }
        if (waiting == 0) {
            return edges;
        }
        edges++;
    }
}
