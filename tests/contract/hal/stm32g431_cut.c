/* A break by the timer's event generation: flag and main output as from a comparator. RM0440 28.6.6 */
#include "hal/stm32g431/registers/tim.h"
#include "tests/contract/hal/hal_contract.h"

void stm32g431_cut(hal_t *hal)
{
    (void)hal;
    TIM1.EGR = TIM_EGR_BG;
}
