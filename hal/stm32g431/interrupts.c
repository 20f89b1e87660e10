/* Interrupt handlers named in the vector table of startup.c. Leg states are applied before anything else, so
 * that they change at the same instant of every period. */
#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/registers/analog.h"
#include "hal/stm32g431/registers/tim.h"

void port_control(void)
{
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    if (measure_is_within()) {
        measure_take_sample();
        return;
    }
#endif
#if PORT_BY_COM
    bridge_begin_period();
#else
    TIM1.CCER = port_hal.legs;
#endif
    ADC1.ISR = ADC_ISR_JEOS;
    app_control(port_hal.app);
}

void port_monitor(void)
{
    app_monitor(port_hal.app);
}

void port_slow(void)
{
    app_slow(port_hal.app);
}
