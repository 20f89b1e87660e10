/* Processor: system control block, interrupt controller, memory protection. ARMv7-M B3. */
#ifndef REGISTERS_CORE_H
#define REGISTERS_CORE_H

#include "hal/stm32g431/registers/register.h"

typedef struct {
    reg_t CPUID;
    reg_t ICSR;
    reg_t VTOR;
    reg_t AIRCR;
    reg_t SCR;
    reg_t CCR;
    reg8_t SHPR[12]; /* priorities of the exceptions 4 to 15 */
    reg_t SHCSR;
    reg_t CFSR;
    reg_t HFSR;
    reg_t DFSR;
    reg_t MMFAR;
    reg_t BFAR;
} scb_t;

#define SCB_ICSR_PENDSVSET    (1U << 28)
#define SCB_AIRCR_VECTKEY     (0xFFFFU << 16)
#define SCB_AIRCR_SYSRESETREQ (1U << 2)
#define SCB_SHCSR_MEMFAULTENA (1U << 16)
#define SCB_SHCSR_BUSFAULTENA (1U << 17)
#define SCB_SHCSR_USGFAULTENA (1U << 18)
#define SCB_CFSR_MMARVALID    (1U << 7)
#define SCB_CFSR_BFARVALID    (1U << 15)
#define SCB_AIRCR_KEY         0x05FAU

/* indices */
#define SCB_SHPR_PENDSV  10U
#define SCB_SHPR_SYSTICK 11U

typedef struct {
    reg_t ISER[8];
    uint32_t reserved[184];
    reg8_t IPR[240];
} nvic_t;

typedef struct {
    reg_t TYPE;
    reg_t CTRL;
    reg_t RNR;
    reg_t RBAR;
    reg_t RASR;
} mpu_t;

#define MPU_CTRL_ENABLE     (1U << 0)
#define MPU_CTRL_PRIVDEFENA (1U << 2)
#define MPU_RASR_ENABLE     (1U << 0)
#define MPU_RASR_SIZE       (0x1FU << 1) /* bytes: 2 to the power of value + 1 */
#define MPU_RASR_B          (1U << 16)
#define MPU_RASR_C          (1U << 17)
#define MPU_RASR_S          (1U << 18)
#define MPU_RASR_AP         (7U << 24)
#define MPU_RASR_XN         (1U << 28)

typedef struct {
    reg_t CSR;
    reg_t RVR;
    reg_t CVR;
} systick_t;

#define SYSTICK_CSR_ENABLE    (1U << 0)
#define SYSTICK_CSR_TICKINT   (1U << 1)
#define SYSTICK_CSR_CLKSOURCE (1U << 2) /* set: the processor's */

extern systick_t SYSTICK;
extern scb_t SCB;
extern nvic_t NVIC;
extern mpu_t MPU;

enum {
    IRQ_ADC1_2 = 18,
    IRQ_FDCAN1_IT0 = 21,
    IRQ_USART2 = 38,
    IRQ_LAST = IRQ_USART2,
};

#endif
