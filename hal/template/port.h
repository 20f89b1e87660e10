/* Copy this folder to hal/<your port>; docs/porting.md leads through it in a day.
 *
 * struct hal: what your port keeps between calls, and nothing else. The application allocates none: there is
 * one, that hal_instance() hands out. Every function does something safe until you have written it: the
 * bridge stays off, hal_init() refuses. */
#ifndef TEMPLATE_PORT_H
#define TEMPLATE_PORT_H

#include "hal/hal.h"

#ifdef __cplusplus
extern "C" {
#endif

struct hal {
    app_t *app;   /* from hal_start(), for the interrupts */
    bool refused; /* by hal_init(): the bridge must not be armed */
};

/* Your vector table names these three; see system.c. */
void port_control(void);
void port_monitor(void);
void port_slow(void);

#ifdef __cplusplus
}
#endif

#endif
