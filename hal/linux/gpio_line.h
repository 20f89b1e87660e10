/* A line of a GPIO chip of this computer, the same over libgpiod 1.x and 2.x, for a drive board's enable, its
 * fault output, BOOT0 and NRST. A GPIO line is not a safe torque off.
 *
 *   "gpiochip0:4"   chip by name, path or (1.x) label, and offset
 *   "gpiochip0:4!"  active low
 *
 * All values mean active or on. A line has one owner; closing returns it to the kernel, and whether an output
 * keeps its level then depends on the chip. No function blocks. Tests: tests/unit/hal_linux, and tests/vm
 * with a simulated chip, over both libraries. */
#ifndef HAL_LINUX_GPIO_LINE_H
#define HAL_LINUX_GPIO_LINE_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    GPIO_INPUT,
    GPIO_EDGES, /* an input whose rising and falling edges the kernel queues: 16 of them */
    GPIO_OUTPUT_OFF,
    GPIO_OUTPUT_ON,
    GPIO_OPEN_DRAIN /* output, off at first; never drives high, so others may pull the line low too */
} gpio_use_t;

typedef struct gpio_line gpio_line_t;

/* NULL and a text when there is no such line, it is in use, or this build has no libgpiod. An output has its
 * value from the first moment. */
gpio_line_t *gpio_line_open(const char *name, gpio_use_t use, char *error, size_t error_size);
void gpio_line_close(gpio_line_t *line);

bool gpio_line_set(gpio_line_t *line, bool active); /* false: failed */
int gpio_line_get(gpio_line_t *line);               /* 0, 1, or -1: failed */
int gpio_line_edges(gpio_line_t *line);             /* number of edges removed from the queue; -1: failed */

#ifdef __cplusplus
}
#endif

#endif
