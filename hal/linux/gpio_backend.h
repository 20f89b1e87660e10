/* Interface between gpio_line.c, gpio_name.c and the version of libgpiod; not for users of gpio_line.h. */
#ifndef HAL_LINUX_GPIO_BACKEND_H
#define HAL_LINUX_GPIO_BACKEND_H

#include "hal/linux/gpio_line.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Of "CHIP:OFFSET[!]" */
typedef struct {
    char chip[64];
    unsigned offset;
    bool active_low;
} gpio_name_t;
bool gpio_name_parse(const char *name, gpio_name_t *parsed, char *error, size_t error_size);

/* NULL: errno says why. */
gpio_line_t *gpio_backend_request(const gpio_name_t *name, gpio_use_t use);

#ifdef __cplusplus
}
#endif

#endif
