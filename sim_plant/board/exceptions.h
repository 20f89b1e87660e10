/* Entry to and return from exceptions: ARMv7-M ARM B1.5.6 to B1.5.14. Frames are saved at once, the
 * floating-point part too where the hardware may put it off. */
#ifndef BOARD_EXCEPTIONS_H
#define BOARD_EXCEPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "sim_plant/board/cpu.h"
#include "sim_plant/board/nvic.h"

nvic_masks_t exceptions_masks(const cpu_t *cpu);
int exceptions_priority(const cpu_t *cpu); /* of execution, masks included */
int exceptions_next(const cpu_t *cpu);     /* to be taken now; 0: none */
bool exceptions_wake(const cpu_t *cpu);    /* something that ends WFI: PRIMASK does not hold it back */

void exceptions_enter(cpu_t *cpu, int exception);
void exceptions_return(cpu_t *cpu, uint32_t exc_return);

/* A synchronous exception of the present instruction: pends it, or what it escalates to; may lock up. */
void exceptions_raise(cpu_t *cpu, int exception);
void exceptions_raise_usage(cpu_t *cpu, uint32_t status); /* with that bit of CFSR */

#endif
