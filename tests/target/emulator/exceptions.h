/* Shared by the cases of exceptions.c. */
#ifndef EMULATOR_EXCEPTIONS_H
#define EMULATOR_EXCEPTIONS_H

#include <stddef.h>
#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))
#define NVIC_ISER         REGISTER(0xE000E100U)
#define NVIC_ICER         REGISTER(0xE000E180U)
#define NVIC_ISPR         REGISTER(0xE000E200U)
#define NVIC_ICPR         REGISTER(0xE000E280U)
#define NVIC_IABR         REGISTER(0xE000E300U)
#define NVIC_IPR(irq)     (*(volatile uint8_t *)(uintptr_t)(0xE000E400U + (irq)))
#define ICSR              REGISTER(0xE000ED04U)
#define VTOR              REGISTER(0xE000ED08U)
#define AIRCR             REGISTER(0xE000ED0CU)
#define CCR               REGISTER(0xE000ED14U)
#define SHPR(exception)   (*(volatile uint8_t *)(uintptr_t)(0xE000ED18U + (exception)-4U))
#define SHCSR             REGISTER(0xE000ED24U)
#define CFSR              REGISTER(0xE000ED28U)
#define HFSR              REGISTER(0xE000ED2CU)
#define MMFAR             REGISTER(0xE000ED34U)
#define BFAR              REGISTER(0xE000ED38U)
#define CPACR             REGISTER(0xE000ED88U)
#define MPU_CTRL          REGISTER(0xE000ED94U)
#define MPU_RNR           REGISTER(0xE000ED98U)
#define MPU_RBAR          REGISTER(0xE000ED9CU)
#define MPU_RASR          REGISTER(0xE000EDA0U)
#define STIR              REGISTER(0xE000EF00U)

#define READ_SPECIAL(name)                                                                                   \
    __extension__({                                                                                          \
        uint32_t value_;                                                                                     \
        __asm volatile("mrs %0, " #name : "=r"(value_)::"memory");                                           \
        value_;                                                                                              \
    })
#define WRITE_SPECIAL(name, value) __asm volatile("msr " #name ", %0" ::"r"((uint32_t)(value)) : "memory")
#define SYNC()                     __asm volatile("dsb\n isb" ::: "memory")

enum {
    EXCEPTIONS = 48,
    NMI = 2,
    HARD_FAULT = 3,
    MEM_MANAGE = 4,
    BUS_FAULT = 5,
    USAGE_FAULT = 6,
    SVC = 11,
    PENDSV = 14,
    SYSTICK = 15,
    LOW = 18, /* interrupt lines of the tests; exception 16 more */
    HIGH = 20,
    THIRD = 21,
};

#define PEND_PENDSV  0x10000000U
#define PEND_NMI     0x80000000U
#define PEND_SYSTICK 0x04000000U

typedef struct {
    uint32_t r0, r1, r2, r3, r12, lr, pc, xpsr;
} frame_t;

typedef uint32_t (*action_t)(frame_t *frame, uint32_t exc_return, uint32_t argument);

void note(uint32_t word);
void on(uint32_t exception, action_t action, uint32_t argument);

/* Lines LOW, HIGH and THIRD enabled at those priorities, PendSV lowest. */
void lines(uint8_t low, uint8_t high, uint8_t third);

void case_pend(void);
void case_float_frame(void);
void case_nested(void);
void case_basepri(void);
void case_primask(void);
void case_wait(void);
void case_svc(void);
void case_misaligned(void);
void case_process(void);
void case_basepri_max(void);
void case_groups(void);
void case_state_bits(void);
void case_nmi(void);
void case_faultmask(void);
void case_escalation(void);
void case_undefined(void);
void case_bus(void);
void case_division(void);
void case_unaligned(void);
void case_thumb_lost(void);
void case_bad_return(void);
void case_withdrawn(void);
void case_mpu(void);
void case_guard(void);
void case_chain(void);
void case_levels(void);

#endif
