/* What hal.h promises, as checks that any port can run: on the host with the port sim, on a processor as an
 * image of its own (hal_contract_main.c). Results go to the port's console:
 *
 *   PASS name | FAIL name: why ... | DONE failed of total
 *
 * No motor and no supply are needed; the bridge is armed for a moment with all legs floating, all
 * low, and, where the port can hold them, all high: keep the motor off. Takes 1.5 s of the port's time. */
#ifndef TESTS_HAL_CONTRACT_H
#define TESTS_HAL_CONTRACT_H

#include "hal/hal.h"

/* What the board is expected to be; the rest follows from hal.h. */
typedef struct {
    hal_config_t config;
    uint32_t period_us;
    uint32_t channels;        /* NEEDS_...: what it has to declare */
    void (*idle)(hal_t *hal); /* lets time pass; on a processor hal_idle() */
    void (*cut)(hal_t *hal);  /* a break of an instant, as a comparator makes it; NULL: not to be had */
} hal_contract_t;

/* Returns the number of failed checks. */
int hal_contract_run(hal_t *hal, const hal_contract_t *contract);

/* `cut` of a board, in a file beside this one; its build sets PM_CONTRACT_CUT to that name. */
void stm32g431_cut(hal_t *hal);

#endif
