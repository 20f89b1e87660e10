/* libgpiod 2.x */
#include "hal/linux/gpio_backend.h"

#include <errno.h>
#include <gpiod.h>
#include <stdio.h>
#include <stdlib.h>

struct gpio_line {
    struct gpiod_line_request *request;
    struct gpiod_edge_event_buffer *events;
    unsigned offset;
};

static void set_up(struct gpiod_line_settings *settings, const gpio_name_t *name, gpio_use_t use)
{
    const bool output = use == GPIO_OUTPUT_OFF || use == GPIO_OUTPUT_ON || use == GPIO_OPEN_DRAIN;
    gpiod_line_settings_set_direction(settings,
                                      output ? GPIOD_LINE_DIRECTION_OUTPUT : GPIOD_LINE_DIRECTION_INPUT);
    gpiod_line_settings_set_active_low(settings, name->active_low);
    if (output) {
        gpiod_line_settings_set_output_value(settings, use == GPIO_OUTPUT_ON ? GPIOD_LINE_VALUE_ACTIVE
                                                                             : GPIOD_LINE_VALUE_INACTIVE);
    }
    if (use == GPIO_OPEN_DRAIN) {
        gpiod_line_settings_set_drive(settings, GPIOD_LINE_DRIVE_OPEN_DRAIN);
    }
    if (use == GPIO_EDGES) {
        gpiod_line_settings_set_edge_detection(settings, GPIOD_LINE_EDGE_BOTH);
    }
}

static struct gpiod_line_request *request_line(const gpio_name_t *name, gpio_use_t use)
{
    char path[80];
    snprintf(path, sizeof path, "%s%s", name->chip[0] == '/' ? "" : "/dev/", name->chip);
    struct gpiod_chip *chip = gpiod_chip_open(path);
    struct gpiod_line_settings *settings = gpiod_line_settings_new();
    struct gpiod_line_config *lines = gpiod_line_config_new();
    struct gpiod_request_config *config = gpiod_request_config_new();
    struct gpiod_line_request *request = NULL;
    if (chip != NULL && settings != NULL && lines != NULL && config != NULL) {
        set_up(settings, name, use);
        gpiod_request_config_set_consumer(config, "pmdrive");
        if (gpiod_line_config_add_line_settings(lines, &name->offset, 1, settings) == 0) {
            request = gpiod_chip_request_lines(chip, config, lines);
        }
    }
    const int reason = errno;
    gpiod_request_config_free(config);
    gpiod_line_config_free(lines);
    gpiod_line_settings_free(settings);
    if (chip != NULL) {
        gpiod_chip_close(chip);
    }
    errno = reason;
    return request;
}

gpio_line_t *gpio_backend_request(const gpio_name_t *name, gpio_use_t use)
{
    gpio_line_t *line = calloc(1, sizeof *line);
    if (line == NULL) {
        return NULL;
    }
    line->offset = name->offset;
    line->events = gpiod_edge_event_buffer_new(16);
    line->request = request_line(name, use);
    if (line->request == NULL || line->events == NULL) {
        const int reason = errno;
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
    if (line->request != NULL) {
        gpiod_line_request_release(line->request);
    }
    if (line->events != NULL) {
        gpiod_edge_event_buffer_free(line->events);
    }
    free(line);
}

bool gpio_line_set(gpio_line_t *line, bool active)
{
    const enum gpiod_line_value value = active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
    return gpiod_line_request_set_value(line->request, line->offset, value) == 0;
}

int gpio_line_get(gpio_line_t *line)
{
    return (int)gpiod_line_request_get_value(line->request, line->offset);
}

int gpio_line_edges(gpio_line_t *line)
{
    int edges = 0;
    for (;;) {
        const int waiting = gpiod_line_request_wait_edge_events(line->request, 0);
        if (waiting < 0) {
            return -1;
        }
        if (waiting == 0) {
            return edges;
        }
        const int read = gpiod_line_request_read_edge_events(line->request, line->events, 16);
        if (read < 0) {
            return -1;
        }
        edges += read;
    }
}
