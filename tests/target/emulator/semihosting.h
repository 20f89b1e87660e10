/* Semihosting for programs of tests/target on the emulator: the operations that support/startup.c uses. */
#ifndef EMULATOR_SEMIHOSTING_H
#define EMULATOR_SEMIHOSTING_H

#include <stdbool.h>

#include "sim_plant/board/cpu.h"

typedef struct {
    cpu_t *cpu;
    const char *command_line; /* the program's path and its arguments */
    bool exited;
    int status;
} semihosting_t;

bool semihosting_call(void *semihosting, uint8_t number); /* for cpu_on_breakpoint() */

#endif
