/* From reset to main(), and the last-resort handlers. No other file runs before memory is ready. */
#include <stddef.h>

#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/processor.h"
#include "hal/stm32g431/registers/clock.h"
#include "hal/stm32g431/registers/core.h"
#include "hal/stm32g431/registers/tim.h"

PM_CHECK_BOARD(PORT_CHANNELS)

#define STACK_PAINT 0xC5C5C5C5U
enum {
    EXCEPTION_RESET = 1,
    EXCEPTION_NMI = 2,
    EXCEPTION_PENDSV = 14,
    EXCEPTION_SYSTICK = 15,
    EXCEPTIONS = 16
};

/* Places, from the link script */
extern uint32_t port_stack_guard[], port_stack_bottom[], port_stack_top[];
extern uint32_t port_data[], port_data_end[], port_data_load[];
extern uint32_t port_bss[], port_bss_end[];
extern uint32_t port_ccm[], port_ccm_begin[], port_ccm_end[], port_ccm_load[];
extern uint32_t port_flash[], port_seal[], port_ram[];

int main(void);

port_grave_t port_grave __attribute__((section(".noinit")));

/* The bridge first, by one store that needs no stack; the other bits of that register are locked. Then a
 * fresh stack: the old one may be the cause, and nobody returns to it. */
__attribute__((naked)) static void fault_entry(void)
{
    __asm volatile("movw r0, #:lower16:(TIM1 + 0x44)\n\t"
                   "movt r0, #:upper16:(TIM1 + 0x44)\n\t"
                   "movs r1, #0\n\t"
                   "str r1, [r0]\n\t"
                   "mov r0, sp\n\t"
                   "mrs r1, ipsr\n\t"
                   "movw r2, #:lower16:port_stack_top\n\t"
                   "movt r2, #:upper16:port_stack_top\n\t"
                   "mov sp, r2\n\t"
                   "b port_fault");
}

typedef void (*handler_t)(void);

/* Until the vectors in CCM SRAM are set: nothing else is enabled. */
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    handler_t reset, nmi, fault;
} FIRST_VECTORS = {port_stack_top, port_reset, port_nmi, fault_entry};

__attribute__((used)) void port_fault(const uint32_t *frame, uint32_t exception)
{
    hal_last_words_t words = {.cause = exception, .status = SCB.CFSR};
    /* r0 to r3, r12, lr, pc, xPSR, if they could be stacked at all */
    if (frame >= port_stack_bottom && frame + 8 <= FIRST_VECTORS.stack) {
        words.lr = frame[5];
        words.pc = frame[6];
    }
    if ((words.status & SCB_CFSR_MMARVALID) != 0U) {
        words.address = SCB.MMFAR;
    } else if ((words.status & SCB_CFSR_BFARVALID) != 0U) {
        words.address = SCB.BFAR;
    } else {
        /* the fault was no access */
    }
    port_bury(&words);
}

/* The crystal has stopped, flash has a read error, or the memory one of parity, which neither of the two words shows.
 * With the bridge off an error of flash is a page of the store whose writing was interrupted: no reason to stop,
 * because the reader checks it. */
void port_nmi(void)
{
    const bool armed = (TIM1.BDTR & TIM_BDTR_MOE) != 0U;
    TIM1.BDTR = 0U;
    const uint32_t flash = FLASH.ECCR;
    if ((flash & FLASH_ECCR_ECCD) != 0U && !armed) {
        FLASH.ECCR = flash;
        return;
    }
    const hal_last_words_t words = {.cause = EXCEPTION_NMI, .status = RCC.CIFR, .address = flash};
    RCC.CICR = RCC_CICR_CSSC;
    port_bury(&words);
}

/* Read without wait states. Aligned to the power of two above its size. */
__attribute__((section(".vectors_ccm"), aligned(256))) static handler_t vectors[EXCEPTIONS + IRQ_LAST + 1];

static void set_vectors(void)
{
    for (uint32_t n = 0; n < sizeof vectors / sizeof vectors[0]; ++n) {
        vectors[n] = FIRST_VECTORS.fault;
    }
    vectors[EXCEPTION_RESET] = FIRST_VECTORS.reset;
    vectors[EXCEPTION_NMI] = FIRST_VECTORS.nmi;
    vectors[EXCEPTION_PENDSV] = port_slow;
    vectors[EXCEPTION_SYSTICK] = port_monitor;
    vectors[EXCEPTIONS + IRQ_ADC1_2] = port_control;
    vectors[EXCEPTIONS + IRQ_FDCAN1_IT0] = port_can_received;
    vectors[EXCEPTIONS + IRQ_USART2] = port_console_sent;
    SCB.VTOR = (uint32_t)(uintptr_t)vectors;
    SCB.SHCSR = SCB_SHCSR_MEMFAULTENA | SCB_SHCSR_BUSFAULTENA | SCB_SHCSR_USGFAULTENA;
}

static uint32_t words_between(const volatile uint32_t *from, const uint32_t *to)
{
    return ((uint32_t)(uintptr_t)to - (uint32_t)(uintptr_t)from) / sizeof *to;
}

/* Volatile: no call of memcpy, which may itself be among what is copied. */
static void copy(volatile uint32_t *to, const uint32_t *end, const uint32_t *from)
{
    for (uint32_t n = 0; n < words_between(to, end); ++n) {
        to[n] = from[n];
    }
}

static void fill(volatile uint32_t *to, const uint32_t *end, uint32_t value)
{
    for (uint32_t n = 0; n < words_between(to, end); ++n) {
        to[n] = value;
    }
}

/* CRC-32 of IEEE 802.3, reflected: what four bits do to the rest. */
static const uint32_t CRC_OF_NIBBLE[16] = {
    0x00000000U, 0x1DB71064U, 0x3B6E20C8U, 0x26D930ACU, 0x76DC4190U, 0x6B6B51F4U, 0x4DB26158U, 0x5005713CU,
    0xEDB88320U, 0xF00F9344U, 0xD6D6A3E8U, 0xCB61B38CU, 0x9B64C2B0U, 0x86D3D2D4U, 0xA00AE278U, 0xBDBDF21CU,
};

bool port_image_sound(void)
{
    uint32_t crc = UINT32_MAX;
    for (uint32_t n = 0; n < words_between(port_flash, port_seal); ++n) {
        crc ^= port_flash[n];
        for (uint32_t nibble = 0; nibble < 8U; ++nibble) {
            crc = (crc >> 4) ^ CRC_OF_NIBBLE[crc & 15U];
        }
    }
    return port_seal[0] == ~crc && port_seal[1] == crc;
}

enum { NO_ACCESS = 0, READ_WRITE = 1, READ_ONLY = 5 };

typedef struct {
    const void *base;
    uint32_t log2_size;
    uint32_t access;
    bool execute;
} region_t;

/* Later regions have priority. Uncovered addresses (peripherals) keep the processor's default attributes. */
static void protect_memory(void)
{
    const region_t regions[] = {
        {NULL, 28, NO_ACCESS, false}, /* null pointers, up to the first memory */
        {port_flash, 17, READ_ONLY, true},
        {port_store[0], 12, READ_WRITE, false},
        {port_ccm, 14, READ_ONLY, true},
        {port_ram, 15, READ_WRITE, false},
        {port_stack_guard, 5, NO_ACCESS, false},
    };
    for (uint32_t n = 0; n < sizeof regions / sizeof regions[0]; ++n) {
        const region_t *r = &regions[n];
        MPU.RNR = n;
        MPU.RBAR = (uint32_t)(uintptr_t)r->base;
        MPU.RASR = reg_field(MPU_RASR_AP, r->access) | reg_field(MPU_RASR_SIZE, r->log2_size - 1U) |
                   MPU_RASR_C | MPU_RASR_ENABLE | (r->execute ? 0U : MPU_RASR_XN);
    }
    MPU.CTRL = MPU_CTRL_ENABLE | MPU_CTRL_PRIVDEFENA;
    processor_barrier();
}

__attribute__((noreturn)) void port_reset(void)
{
    const uint32_t *stack;
    __asm volatile("mov %0, sp" : "=r"(stack));
    fill(port_stack_bottom, stack, STACK_PAINT);
    copy(port_ccm_begin, port_ccm_end, port_ccm_load);
    copy(port_data, port_data_end, port_data_load);
    fill(port_bss, port_bss_end, 0U);
    if ((RCC.CSR & RCC_CSR_BORRSTF) != 0U) {
        port_grave.magic = 0U; /* never written, so its parity is wrong */
    }
    set_vectors();
    protect_memory();
    (void)main();
    for (;;) {
        processor_wait();
    }
}
