/* The exception model of ARMv7-M, observed from inside: every case logs what its handlers see. The log under
 * QEMU's NVIC and under sim_plant/board must be the same, word for word (compare_exceptions.py). */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "tests/target/emulator/exceptions.h"

enum { LOG_MOST = 4096 };

static uint32_t log_words[LOG_MOST];
static volatile uint32_t log_count;

void note(uint32_t word)
{
    if (log_count < LOG_MOST) {
        log_words[log_count] = word;
        log_count++;
    }
}

static action_t actions[EXCEPTIONS];
static uint32_t arguments[EXCEPTIONS];

void on(uint32_t exception, action_t action, uint32_t argument)
{
    actions[exception] = action;
    arguments[exception] = argument;
}

/* Called with the frame and EXC_RETURN; its result is the EXC_RETURN to leave with. */
uint32_t on_exception(frame_t *frame, uint32_t exc_return);
uint32_t on_exception(frame_t *frame, uint32_t exc_return)
{
    const uint32_t number = READ_SPECIAL(ipsr);
    note(0xE0000000U | number);
    note(exc_return);
    note(READ_SPECIAL(control) & 7U);
    note(frame->xpsr & ~0xF0000000U); /* flags depend on what the compiler did before */
    if (number >= 3 && number <= 6) {
        note(frame->pc);
        note(CFSR);
        note(HFSR);
        if ((CFSR & 0x80U) != 0) {
            note(MMFAR);
        }
        if ((CFSR & 0x8000U) != 0) {
            note(BFAR);
        }
        CFSR = CFSR;
        HFSR = HFSR;
    }
    if (actions[number] != NULL) {
        exc_return = actions[number](frame, exc_return, arguments[number]);
    }
    note(0xEF000000U | number);
    return exc_return;
}

__attribute__((naked)) static void handler(void)
{
    __asm volatile("tst lr, #4\n ite eq\n mrseq r0, msp\n mrsne r0, psp\n mov r1, lr\n push {r4, lr}\n"
                   " bl on_exception\n pop {r4, lr}\n bx r0");
}

__attribute__((aligned(512))) static uintptr_t vectors[EXCEPTIONS];

static void install(void)
{
    for (uint32_t i = 0; i < EXCEPTIONS; i++) {
        vectors[i] = (uintptr_t)handler;
    }
    VTOR = (uint32_t)(uintptr_t)vectors;
    SYNC();
}

static void print(void)
{
    for (uint32_t i = 0; i < log_count; i++) {
        printf("%08lx\n", (unsigned long)log_words[i]);
    }
}

int main(void)
{
    static void (*const cases[])(void) = {
        case_pend,      case_float_frame, case_nested,     case_basepri,     case_primask, case_wait,
        case_svc,       case_misaligned,  case_process,    case_basepri_max, case_groups,  case_state_bits,
        case_nmi,       case_faultmask,   case_escalation, case_undefined,   case_bus,     case_division,
        case_unaligned, case_thumb_lost,  case_bad_return, case_withdrawn,   case_mpu,     case_guard,
        case_chain,     case_levels,
    };
    install();
    for (uint32_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        note(0xCA5E0000U | i);
        for (uint32_t k = 0; k < EXCEPTIONS; k++) {
            on(k, NULL, 0);
        }
        cases[i]();
    }
    print();
    return 0;
}
