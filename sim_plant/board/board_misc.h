/* Small things: SYSCFG's break sources and the debugger's freeze bits. RM0440 10, 47.
 */
#ifndef BOARD_MISC_H
#define BOARD_MISC_H

#include "sim_plant/board/board_registers.h"

typedef struct {
    board_registers_t syscfg, debug;
} board_misc_t;

void board_misc_init(board_misc_t *misc, cpu_t *cpu);
void board_misc_reset(board_misc_t *misc);
cpu_device_t board_misc_syscfg(board_misc_t *misc);
cpu_device_t board_misc_debug(board_misc_t *misc);

/* SYSCFG_CFGR2: what breaks TIM1 besides its own inputs. Its write takes effect with the next look at the break. */
bool board_misc_locks_detector(const board_misc_t *misc);
bool board_misc_breaks(const board_misc_t *misc, bool supply_low);
void board_misc_parity_error(board_misc_t *misc); /* found by a read */

/* What stops when the debugger halts the processor. */
bool board_misc_freezes_iwdg(const board_misc_t *misc);
bool board_misc_freezes_tim1(const board_misc_t *misc);

#endif
