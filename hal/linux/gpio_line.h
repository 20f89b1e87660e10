/* A line of a GPIO chip of this computer, the same over libgpiod 1.x and 2.x. Beside a drive board: its
 * enable, its fault output, BOOT0 and NRST. A GPIO line is not a safe torque off.
 *
 *   "gpiochip0:4"   chip by name, path or (1.x) label, and offset
 *   "gpiochip0:4!"  active low */
#ifndef HAL_LINUX_GPIO_LINE_H
#define HAL_LINUX_GPIO_LINE_H

#include <stdbool.h>
#include <stddef.h>

typedef enum { GPIO_OUTPUT_LOW, GPIO_OUTPUT_HIGH, GPIO_INPUT, GPIO_EDGES } gpio_use_t;

typedef struct gpio_line gpio_line_t;

/* NULL and a text when there is no such line, it is taken, or this build has no libgpiod. */
gpio_line_t *gpio_line_open(const char *name, gpio_use_t use, char *error, size_t error_size);
void gpio_line_close(gpio_line_t *line);

bool gpio_line_set(gpio_line_t *line, bool active); /* false: failed */
int gpio_line_get(gpio_line_t *line);               /* 0, 1, or -1: failed */
int gpio_line_edges(gpio_line_t *line); /* taken from the queue, none: 0; -1: failed. Does not block. */

/* "CHIP:OFFSET[!]"; for the implementations. */
typedef struct {
    char chip[64];
    unsigned offset;
    bool active_low;
} gpio_name_t;
bool gpio_name_parse(const char *name, gpio_name_t *parsed, char *error, size_t error_size);

#endif
