/* The registers as ordinary memory, and what the port has from files that are not under test here. */
#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/processor.h"
#include "hal/stm32g431/registers/analog.h"
#include "hal/stm32g431/registers/clock.h"
#include "hal/stm32g431/registers/core.h"
#include "hal/stm32g431/registers/fdcan.h"
#include "hal/stm32g431/registers/gpio.h"
#include "hal/stm32g431/registers/tim.h"
#include "hal/stm32g431/registers/usart.h"

adc_t ADC1, ADC2;
adc_common_t ADC12_COMMON;
opamp_t OPAMP1, OPAMP2, OPAMP3;
comp_t COMP1, COMP2, COMP4;
dac_t DAC3;
tim_t TIM1, TIM2, TIM3, TIM4;
gpio_t GPIOA, GPIOB, GPIOC;
fdcan_t FDCAN1;
fdcan_ram_t FDCANRAM1;
usart_t USART2;
rcc_t RCC;
flash_t FLASH;
syscfg_t SYSCFG;
pwr_t PWR;
dbgmcu_t DBGMCU;
vrefint_t VREFINT;

hal_t port_hal;
uint32_t port_store[HAL_STORE_PAGES][HAL_STORE_PAGE_SIZE / 4U];

bool port_image_sound(void)
{
    return true;
}

void processor_lock(void)
{
}

void processor_unlock(void)
{
}

void processor_barrier(void)
{
}

void clock_delay(uint32_t time_us)
{
    (void)time_us;
}

bool clock_await(const reg_t *word, uint32_t mask, uint32_t value, uint32_t most_us)
{
    (void)most_us;
    return (*word & mask) == value;
}

void system_interrupt(uint32_t irq, uint8_t priority)
{
    (void)irq;
    (void)priority;
}

void system_watchdog_period(uint32_t time_ms)
{
    (void)time_ms;
}
