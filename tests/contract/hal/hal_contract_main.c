/* The contract as an image: its board's own figures stand in the build. */
#include <stddef.h>

#include "tests/contract/hal/hal_contract.h"

#ifndef PM_CONTRACT_CUT
#define PM_CONTRACT_CUT NULL
#endif

int main(void)
{
    const hal_contract_t contract = {
        .config = {.timer_counts = PM_CONTRACT_TIMER_COUNTS,
                   .dead_time_ns = 500,
                   .break_level = 0,
                   .can_kbit_s = 500},
        .period_us = PM_CONTRACT_PERIOD_US,
        .channels = PM_CONTRACT_CHANNELS | PM_BOOTSTRAP,
        .idle = hal_idle,
        .cut = PM_CONTRACT_CUT,
    };
    hal_t *hal = hal_instance();
    (void)hal_contract_run(hal, &contract);
    for (;;) {
        hal_idle(hal);
    }
}
