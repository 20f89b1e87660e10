#include "hal/stm32g431/registers/clock.h"
#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/registers/tim.h"

enum {
    RESET_MHZ = 16,
    HSE_START_US = 10000, /* datasheet: 2 ms typical */
    READY_US = 1000,
    WAIT_STATES = 4,
};

/* The divider takes effect at the next update event, which is made here. */
static void count_microseconds(uint32_t clock_MHz)
{
    TIM2.PSC = clock_MHz - 1U;
    TIM2.EGR = TIM_EGR_UG;
    TIM2.CR1 = TIM_CR1_CEN;
}

uint32_t clock_us(void)
{
    return TIM2.CNT;
}

void clock_delay(uint32_t time_us)
{
    const uint32_t start = clock_us();
    while (clock_us() - start <= time_us) {
    }
}

bool clock_await(const reg_t *word, uint32_t mask, uint32_t value, uint32_t most_us)
{
    const uint32_t start = clock_us();
    while ((*word & mask) != value) {
        if (clock_us() - start > most_us) {
            return (*word & mask) == value;
        }
    }
    return true;
}

static void supply_clocks(void)
{
    RCC.AHB2ENR |= RCC_AHB2ENR_GPIOAEN | RCC_AHB2ENR_GPIOBEN | RCC_AHB2ENR_GPIOCEN | RCC_AHB2ENR_ADC12EN |
                   RCC_AHB2ENR_DAC3EN;
    RCC.APB1ENR1 |= RCC_APB1ENR1_TIM2EN | RCC_APB1ENR1_USART2EN | RCC_APB1ENR1_FDCANEN | RCC_APB1ENR1_PWREN;
    RCC.APB2ENR |= RCC_APB2ENR_SYSCFGEN | RCC_APB2ENR_TIM1EN;
    (void)RCC.APB2ENR; /* a peripheral answers two cycles after its clock was switched on */
    RCC.CCIPR = reg_field(RCC_CCIPR_FDCANSEL, RCC_FDCANSEL_PCLK1);
}

/* 340 MHz from an input of 4 MHz, halved. */
static bool start_pll(bool crystal)
{
    RCC.PLLCFGR = reg_field(RCC_PLLCFGR_PLLSRC, crystal ? RCC_PLLSRC_HSE : RCC_PLLSRC_HSI) |
                  reg_field(RCC_PLLCFGR_PLLM, crystal ? 1U : 3U) | reg_field(RCC_PLLCFGR_PLLN, 85U) |
                  RCC_PLLCFGR_PLLREN;
    RCC.CR |= RCC_CR_PLLON;
    return clock_await(&RCC.CR, RCC_CR_PLLRDY, RCC_CR_PLLRDY, READY_US);
}

/* Above 80 MHz through half the speed, for 1 us at least. */
static bool switch_to_pll(void)
{
    PWR.CR5 &= ~PWR_CR5_R1MODE;
    FLASH.ACR = (FLASH.ACR & ~FLASH_ACR_LATENCY) | reg_field(FLASH_ACR_LATENCY, WAIT_STATES) |
                FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN;
    if (!clock_await(&FLASH.ACR, FLASH_ACR_LATENCY, WAIT_STATES, READY_US)) {
        return false;
    }
    RCC.CFGR = reg_field(RCC_CFGR_HPRE, RCC_HPRE_DIV_2) | reg_field(RCC_CFGR_SW, RCC_SW_PLL);
    if (!clock_await(&RCC.CFGR, RCC_CFGR_SWS, reg_field(RCC_CFGR_SWS, RCC_SW_PLL), READY_US)) {
        RCC.CFGR = reg_field(RCC_CFGR_SW, RCC_SW_HSI);
        return false;
    }
    count_microseconds(PORT_CLOCK_HZ / 2000000U);
    clock_delay(2U);
    RCC.CFGR = reg_field(RCC_CFGR_SW, RCC_SW_PLL);
    count_microseconds(PORT_CLOCK_HZ / 1000000U);
    return true;
}

uint32_t clock_start(bool *from_crystal)
{
    supply_clocks();
    count_microseconds(RESET_MHZ);
    RCC.CR |= RCC_CR_HSEON;
    const bool crystal = clock_await(&RCC.CR, RCC_CR_HSERDY, RCC_CR_HSERDY, HSE_START_US);
    if (!crystal) {
        RCC.CR &= ~RCC_CR_HSEON;
    }
    *from_crystal = crystal;
    if (!start_pll(crystal) || !switch_to_pll()) {
        return RESET_MHZ * 1000000U;
    }
    if (crystal) {
        RCC.CR |= RCC_CR_CSSON;
    }
    return PORT_CLOCK_HZ;
}
