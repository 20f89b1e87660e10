/* Interrupts: priorities, masks, nesting, frames. */
#include "tests/target/emulator/exceptions.h"

void lines(uint8_t low, uint8_t high, uint8_t third)
{
    NVIC_IPR(LOW) = low;
    NVIC_IPR(HIGH) = high;
    NVIC_IPR(THIRD) = third;
    SHPR(PENDSV) = 0xF0;
    SHPR(SYSTICK) = 0xF0;
    SHPR(SVC) = 0;
    NVIC_ISER = 1U << LOW | 1U << HIGH | 1U << THIRD;
}

static void pend(uint32_t set)
{
    NVIC_ISPR = set;
    SYNC();
}

void case_pend(void)
{
    lines(0x80, 0x40, 0xC0);
    pend(1U << LOW);
    note(1);
    STIR = HIGH;
    SYNC();
    note(2);
    ICSR = PEND_SYSTICK;
    SYNC();
}

/* A handler that uses the FPU must not show in the registers of what it interrupts. */
static uint32_t dirty_float(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)frame;
    (void)argument;
    __asm volatile("vmov.f32 s0, #31.0\n vmov.f32 s7, #5.0\n vmov.f32 s15, #7.0\n" ::: "s0", "s7", "s15");
    note(READ_SPECIAL(control) & 7U);
    return exc_return;
}

void case_float_frame(void)
{
    CPACR |= 0xFU << 20;
    SYNC();
    on(16 + LOW, dirty_float, 0);
    uint32_t a, b, c, control, status;
    __asm volatile(
        "vmov.f32 s0, #1.0\n vmov.f32 s7, #2.0\n vmov.f32 s15, #3.0\n vcmp.f32 s0, s7\n mrs %3, control\n"
        " str %5, [%6]\n dsb\n isb\n vmov %0, s0\n vmov %1, s7\n vmov %2, s15\n vmrs %4, fpscr"
        : "=&r"(a), "=&r"(b), "=&r"(c), "=&r"(control), "=&r"(status)
        : "r"(1U << LOW), "r"(&NVIC_ISPR)
        : "s0", "s7", "s15", "memory");
    note(control & 7U);
    note(a);
    note(b);
    note(c);
    note(status);
    WRITE_SPECIAL(control, 0);
    SYNC();
    pend(1U << LOW);
}

static uint32_t pend_higher(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)frame;
    ICSR = PEND_PENDSV;
    pend(argument);
    note(0x10);
    return exc_return;
}

void case_nested(void)
{
    on(16 + LOW, pend_higher, 1U << HIGH | 1U << THIRD);
    pend(1U << LOW);
}

void case_basepri(void)
{
    WRITE_SPECIAL(basepri, 0x80);
    pend(1U << LOW);
    note(1);
    pend(1U << HIGH);
    note(2);
    pend(1U << THIRD);
    WRITE_SPECIAL(basepri, 0xC0);
    SYNC();
    note(3);
    WRITE_SPECIAL(basepri, 0);
    SYNC();
}

void case_primask(void)
{
    __asm volatile("cpsid i" ::: "memory");
    ICSR = PEND_PENDSV | PEND_SYSTICK;
    pend(1U << LOW | 1U << HIGH | 1U << THIRD);
    note(1);
    __asm volatile("cpsie i\n isb" ::: "memory");
    note(2);
}

void case_wait(void)
{
    __asm volatile("cpsid i" ::: "memory");
    pend(1U << HIGH);
    __asm volatile("wfi" ::: "memory");
    note(1);
    __asm volatile("cpsie i\n isb" ::: "memory");
    note(2);
    __asm volatile("sev\n wfe" ::: "memory");
    note(3);
}

static uint32_t call(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)argument;
    note(((const uint16_t *)(uintptr_t)frame->pc)[-1]);
    note(frame->r0);
    frame->r0 = frame->r0 * 2 + 1;
    return exc_return;
}

static uint32_t supervisor(uint32_t x)
{
    register uint32_t r0 __asm("r0") = x;
    __asm volatile("svc #5" : "+r"(r0)::"memory");
    return r0;
}

static uint32_t call_from_handler(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)frame;
    note(supervisor(argument));
    return exc_return;
}

void case_svc(void)
{
    on(SVC, call, 0);
    note(supervisor(21));
    on(16 + LOW, call_from_handler, 7);
    pend(1U << LOW);
}

/* The stack is off by a word: entry aligns the frame, return undoes it. */
void case_misaligned(void)
{
    uint32_t before, after;
    __asm volatile("mov %0, sp\n sub sp, #4\n str %2, [%3]\n dsb\n isb\n add sp, #4\n mov %1, sp"
                   : "=&r"(before), "=&r"(after)
                   : "r"(1U << LOW), "r"(&NVIC_ISPR)
                   : "memory");
    note(before - after);
    CCR &= ~(1U << 9); /* STKALIGN */
    SYNC();
    __asm volatile("mov %0, sp\n sub sp, #4\n str %2, [%3]\n dsb\n isb\n add sp, #4\n mov %1, sp"
                   : "=&r"(before), "=&r"(after)
                   : "r"(1U << LOW), "r"(&NVIC_ISPR)
                   : "memory");
    note(before - after);
    CCR |= 1U << 9;
    SYNC();
}

void case_process(void)
{
    static uint8_t stack[512] __attribute__((aligned(8)));
    on(SVC, call, 0);
    on(16 + LOW, pend_higher, 1U << HIGH);
    WRITE_SPECIAL(psp, (uintptr_t)stack + sizeof stack);
    WRITE_SPECIAL(control, READ_SPECIAL(control) | 2U);
    SYNC();
    pend(1U << LOW);
    const uint32_t result = supervisor(4);
    const uint32_t control = READ_SPECIAL(control), psp = READ_SPECIAL(psp);
    WRITE_SPECIAL(control, control & ~2U);
    SYNC();
    note(result);
    note(control & 7U);
    note(psp - (uint32_t)(uintptr_t)stack);
}

void case_basepri_max(void)
{
    WRITE_SPECIAL(basepri, 0x50);
    WRITE_SPECIAL(basepri_max, 0x70);
    note(READ_SPECIAL(basepri));
    WRITE_SPECIAL(basepri_max, 0x30);
    note(READ_SPECIAL(basepri));
    WRITE_SPECIAL(basepri, 0);
}

static void groups(uint32_t group)
{
    AIRCR = 0x05FA0000U | group << 8;
    SYNC();
    note(AIRCR & 0x700U);
    on(16 + LOW, pend_higher, 1U << HIGH | 1U << THIRD);
    pend(1U << LOW);
    WRITE_SPECIAL(basepri, 0x60);
    pend(1U << HIGH | 1U << THIRD);
    note(READ_SPECIAL(basepri));
    WRITE_SPECIAL(basepri, 0);
    SYNC();
}

void case_groups(void)
{
    lines(0x50, 0x40, 0x60);
    groups(0);
    groups(4);
    groups(5);
    groups(6);
    groups(7);
    AIRCR = 0x05FA0000U;
    lines(0x80, 0x40, 0xC0);
}

static uint32_t look(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)frame;
    note(NVIC_IABR);
    note(NVIC_ISPR & 0x00340000U);
    note(ICSR & ~0x00800000U);
    note(SHCSR);
    if (argument != 0) {
        pend(argument);
        note(ICSR & ~0x00800000U);
    }
    return exc_return;
}

void case_state_bits(void)
{
    on(16 + LOW, look, 1U << HIGH);
    on(16 + HIGH, look, 1U << THIRD);
    on(PENDSV, look, 0);
    ICSR = PEND_PENDSV;
    SYNC();
    pend(1U << LOW);
    note(NVIC_ISER);
    note(NVIC_IPR(LOW));
    note(SHPR(PENDSV));
}

static uint32_t pend_nmi(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)frame;
    (void)argument;
    ICSR = PEND_NMI;
    SYNC();
    return exc_return;
}

void case_nmi(void)
{
    __asm volatile("cpsid i" ::: "memory");
    ICSR = PEND_NMI;
    SYNC();
    __asm volatile("cpsie i" ::: "memory");
    on(16 + HIGH, pend_nmi, 0);
    pend(1U << HIGH);
}

static uint32_t mask_faults(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)frame;
    __asm volatile("cpsid f" ::: "memory");
    pend(argument);
    note(READ_SPECIAL(faultmask));
    ICSR = PEND_NMI;
    SYNC();
    note(READ_SPECIAL(faultmask));
    return exc_return; /* clears FAULTMASK */
}

void case_faultmask(void)
{
    on(16 + LOW, mask_faults, 1U << HIGH);
    pend(1U << LOW);
    note(READ_SPECIAL(faultmask));
}

void case_withdrawn(void)
{
    __asm volatile("cpsid i" ::: "memory");
    pend(1U << LOW | 1U << HIGH | 1U << THIRD);
    NVIC_ICPR = 1U << HIGH;
    NVIC_ICER = 1U << THIRD;
    ICSR = PEND_PENDSV;
    ICSR = 0x08000000U;
    SYNC();
    __asm volatile("cpsie i\n isb" ::: "memory");
    note(NVIC_ISPR & 0x00340000U);
    NVIC_ISER = 1U << THIRD;
    SYNC();
}

/* Equal priorities: the lower number first, and no preemption. */
void case_levels(void)
{
    lines(0x40, 0x40, 0x30);
    on(16 + HIGH, pend_higher, 1U << LOW | 1U << THIRD);
    pend(1U << LOW | 1U << HIGH);
    lines(0x80, 0x40, 0xC0);
}

/* One after the other without unstacking: the frame stays where it is. */
static uint32_t where(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    static uint32_t first;
    if (argument != 0) {
        first = (uint32_t)(uintptr_t)frame;
        ICSR = PEND_PENDSV;
        pend(1U << LOW | 1U << THIRD);
    }
    note((uint32_t)(uintptr_t)frame - first);
    return exc_return;
}

void case_chain(void)
{
    on(16 + HIGH, where, 1);
    on(16 + LOW, where, 0);
    on(16 + THIRD, where, 0);
    on(PENDSV, where, 0);
    pend(1U << HIGH);
}
