/* Clocks, power, flash controller, watchdog, debug freeze, identity: RM0440 3, 6, 7, 42, 47, 48; SYSCFG 10.
 */
#ifndef REGISTERS_CLOCK_H
#define REGISTERS_CLOCK_H

#include "hal/stm32g431/registers/register.h"

typedef struct {
    reg_t CR;
    reg_t ICSCR;
    reg_t CFGR;
    reg_t PLLCFGR;
    uint32_t reserved_10[3];
    reg_t CIFR;
    reg_t CICR;
    uint32_t reserved_24[10];
    reg_t AHB2ENR;
    uint32_t reserved_50[2];
    reg_t APB1ENR1;
    reg_t APB1ENR2;
    reg_t APB2ENR;
    uint32_t reserved_64[9];
    reg_t CCIPR;
    uint32_t reserved_8c[2];
    reg_t CSR;
} rcc_t;

#define RCC_CR_HSION          (1U << 8)
#define RCC_CR_HSIRDY         (1U << 10)
#define RCC_CR_HSEON          (1U << 16)
#define RCC_CR_HSERDY         (1U << 17)
#define RCC_CR_CSSON          (1U << 19)
#define RCC_CR_PLLON          (1U << 24)
#define RCC_CR_PLLRDY         (1U << 25)
#define RCC_CFGR_SW           (3U << 0)
#define RCC_CFGR_SWS          (3U << 2)
#define RCC_CFGR_HPRE         (0xFU << 4)
#define RCC_PLLCFGR_PLLSRC    (3U << 0)
#define RCC_PLLCFGR_PLLM      (0xFU << 4)
#define RCC_PLLCFGR_PLLN      (0x7FU << 8)
#define RCC_PLLCFGR_PLLREN    (1U << 24)
#define RCC_PLLCFGR_PLLR      (3U << 25)
#define RCC_CIFR_CSSF         (1U << 8)
#define RCC_CICR_CSSC         (1U << 8)
#define RCC_AHB2ENR_GPIOAEN   (1U << 0)
#define RCC_AHB2ENR_GPIOBEN   (1U << 1)
#define RCC_AHB2ENR_GPIOCEN   (1U << 2)
#define RCC_AHB2ENR_ADC12EN   (1U << 13)
#define RCC_AHB2ENR_DAC3EN    (1U << 18)
#define RCC_APB1ENR1_TIM2EN   (1U << 0)
#define RCC_APB1ENR1_TIM3EN   (1U << 1)
#define RCC_APB1ENR1_TIM4EN   (1U << 2)
#define RCC_APB1ENR1_USART2EN (1U << 17)
#define RCC_APB1ENR1_FDCANEN  (1U << 25)
#define RCC_APB1ENR1_PWREN    (1U << 28)
#define RCC_APB2ENR_SYSCFGEN  (1U << 0)
#define RCC_APB2ENR_TIM1EN    (1U << 11)
#define RCC_CCIPR_FDCANSEL    (3U << 24)
#define RCC_CSR_RMVF          (1U << 23)
#define RCC_CSR_PINRSTF       (1U << 26)
#define RCC_CSR_BORRSTF       (1U << 27)
#define RCC_CSR_SFTRSTF       (1U << 28)
#define RCC_CSR_IWDGRSTF      (1U << 29)
#define RCC_CSR_WWDGRSTF      (1U << 30)

/* values of PLLSRC, SW, HPRE and FDCANSEL */
enum {
    RCC_PLLSRC_HSI = 2,
    RCC_PLLSRC_HSE = 3,
    RCC_SW_HSI = 1,
    RCC_SW_PLL = 3,
    RCC_HPRE_DIV_2 = 8,
    RCC_FDCANSEL_PCLK1 = 2
};

typedef struct {
    reg_t CR1;
    reg_t CR2;
    uint32_t reserved_8[30];
    reg_t CR5;
} pwr_t;

#define PWR_CR2_PVDE   (1U << 0)
#define PWR_CR2_PLS    (7U << 1)
#define PWR_CR5_R1MODE (1U << 8) /* set: no boost */

typedef struct {
    reg_t ACR;
    reg_t PDKEYR;
    reg_t KEYR;
    reg_t OPTKEYR;
    reg_t SR;
    reg_t CR;
    reg_t ECCR;
} flash_t;

#define FLASH_ACR_LATENCY (0xFU << 0)
#define FLASH_ACR_PRFTEN  (1U << 8)
#define FLASH_ACR_ICEN    (1U << 9)
#define FLASH_ACR_DCEN    (1U << 10)
#define FLASH_ACR_DCRST   (1U << 12)
#define FLASH_SR_EOP      (1U << 0)
#define FLASH_SR_OPERR    (1U << 1)
#define FLASH_SR_PROGERR  (1U << 3)
#define FLASH_SR_WRPERR   (1U << 4)
#define FLASH_SR_PGAERR   (1U << 5)
#define FLASH_SR_SIZERR   (1U << 6)
#define FLASH_SR_PGSERR   (1U << 7)
#define FLASH_SR_MISERR   (1U << 8)
#define FLASH_SR_FASTERR  (1U << 9)
#define FLASH_SR_BSY      (1U << 16)
#define FLASH_CR_PG       (1U << 0)
#define FLASH_CR_PER      (1U << 1)
#define FLASH_CR_PNB      (0x7FU << 3)
#define FLASH_CR_STRT     (1U << 16)
#define FLASH_CR_LOCK     (1U << 31)
#define FLASH_ECCR_ECCD   (1U << 31)
#define FLASH_KEYR_KEY1   0x45670123U
#define FLASH_KEYR_KEY2   0xCDEF89ABU

typedef struct {
    reg_t KR;
    reg_t PR;
    reg_t RLR;
    reg_t SR;
} iwdg_t;

#define IWDG_PR_PR    (7U << 0) /* divider: 4 times 2 to the power of value */
#define IWDG_RLR_RL   (0xFFFU << 0)
#define IWDG_SR_PVU   (1U << 0)
#define IWDG_SR_RVU   (1U << 1)
#define IWDG_KR_FEED  0xAAAAU
#define IWDG_KR_OPEN  0x5555U
#define IWDG_KR_START 0xCCCCU

typedef struct {
    reg_t MEMRMP;
    reg_t CFGR1;
    reg_t EXTICR[4];
    reg_t SCSR;
    reg_t CFGR2;
} syscfg_t;

#define SYSCFG_CFGR2_CLL  (1U << 0) /* lock-up of the processor breaks TIM1 */
#define SYSCFG_CFGR2_SPL  (1U << 1) /* as does an error of the memory's parity, */
#define SYSCFG_CFGR2_PVDL (1U << 2) /* a low supply, whose detector cannot be changed any more, */
#define SYSCFG_CFGR2_ECCL (1U << 3) /* and an uncorrectable flash error */

typedef struct {
    reg_t IDCODE;
    reg_t CR;
    reg_t APB1FZR1;
    reg_t APB1FZR2;
    reg_t APB2FZR;
} dbgmcu_t;

#define DBGMCU_APB1FZR1_IWDG (1U << 12)
#define DBGMCU_APB2FZR_TIM1  (1U << 11)

typedef struct {
    reg_t UID[3];
} uid_t;

extern rcc_t RCC;
extern pwr_t PWR;
extern flash_t FLASH;
extern iwdg_t IWDG;
extern syscfg_t SYSCFG;
extern dbgmcu_t DBGMCU;
extern uid_t UID;

#endif
