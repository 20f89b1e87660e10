/* Faults: what they leave in the status registers, where they return to, and what becomes of them when their
 * handler may not run. */
#include "tests/target/emulator/exceptions.h"

#define ENABLE_FAULTS 0x00070000U /* MemManage, BusFault, UsageFault */
#define NO_ADDRESS    0x90000000U

/* Goes on behind the faulty instruction, which has that many bytes. */
static uint32_t skip(frame_t *frame, uint32_t exc_return, uint32_t bytes)
{
    frame->pc += bytes;
    return exc_return;
}

static void handle_faults(uint32_t bytes)
{
    for (uint32_t i = HARD_FAULT; i <= USAGE_FAULT; i++) {
        on(i, skip, bytes);
    }
}

static void undefined(void)
{
    __asm volatile("nop\n .hword 0xde01\n nop" ::: "memory");
}

static uint32_t undefined_inside(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)frame;
    (void)argument;
    undefined();
    return exc_return;
}

static void supervisor(void)
{
    __asm volatile("svc #9" ::: "memory");
}

/* SVC cannot be taken: HardFault, with the address behind it. */
void case_escalation(void)
{
    handle_faults(0);
    __asm volatile("cpsid i" ::: "memory");
    supervisor();
    __asm volatile("cpsie i" ::: "memory");
    WRITE_SPECIAL(basepri, 0x10);
    SHPR(SVC) = 0x20;
    SYNC();
    supervisor();
    WRITE_SPECIAL(basepri, 0);
    SHPR(SVC) = 0;
}

void case_undefined(void)
{
    handle_faults(2);
    SHCSR = 0;
    undefined();
    SHCSR = ENABLE_FAULTS;
    SHPR(USAGE_FAULT) = 0x60;
    undefined();
    on(16 + LOW, undefined_inside, 0);
    NVIC_ISPR = 1U << LOW;
    SYNC();
    on(16 + HIGH, undefined_inside, 0); /* more urgent than UsageFault */
    NVIC_ISPR = 1U << HIGH;
    SYNC();
    SHPR(USAGE_FAULT) = 0;
    __asm volatile("cmp r0, r0\n ite eq\n .hword 0xde02\n nopne\n nop" ::: "memory", "cc");
    handle_faults(4);
    __asm volatile("nop\n .hword 0xf7f0\n .hword 0xa001\n nop" ::: "memory");
}

void case_bus(void)
{
    handle_faults(2);
    uint32_t value = 0x11111111;
    __asm volatile("nop\n ldr %0, [%1]\n nop" : "+l"(value) : "l"(NO_ADDRESS) : "memory");
    note(value);
    __asm volatile("nop\n str %0, [%1]\n nop" ::"l"(value), "l"(NO_ADDRESS + 8) : "memory");
    handle_faults(4);
    __asm volatile("nop\n ldrb.w %0, [%1, #3]\n nop" : "+l"(value) : "l"(NO_ADDRESS) : "memory");
    __asm volatile("nop\n ldr.w %0, [%1, %2, lsl #2]\n nop"
                   : "+l"(value)
                   : "l"(NO_ADDRESS - 0x40), "l"(0x20)
                   : "memory");
    note(value);
    register uint32_t base __asm("r4") = NO_ADDRESS;
    __asm volatile("nop\n ldrd r2, r3, [r4], #8\n nop" : "+r"(base)::"r2", "r3", "memory");
    note(base);
    __asm volatile("nop\n stmdb.w r4!, {r2, r3, r5}\n nop" : "+r"(base)::"memory");
    note(base);
    handle_faults(2);
    __asm volatile("nop\n ldmia r4!, {r2, r3}\n nop" : "+r"(base)::"r2", "r3", "memory");
    note(base);
    __asm volatile("cmp r4, r4\n itt eq\n streq r2, [r4]\n moveq r2, #0" ::: "r2", "memory", "cc");
    SHCSR = 0;
    __asm volatile("nop\n ldr %0, [%1]\n nop" : "+l"(value) : "l"(NO_ADDRESS) : "memory");
    SHCSR = ENABLE_FAULTS;
}

void case_division(void)
{
    handle_faults(4);
    uint32_t quotient = 5;
    __asm volatile("udiv %0, %1, %2" : "+r"(quotient) : "r"(7), "r"(0));
    note(quotient);
    CCR |= 0x10U;
    SYNC();
    quotient = 5;
    __asm volatile("udiv %0, %1, %2" : "+r"(quotient) : "r"(7), "r"(0));
    note(quotient);
    __asm volatile("nop\n sdiv %0, %1, %2\n adds %0, #1" : "+l"(quotient) : "r"(7), "r"(0) : "cc");
    note(quotient);
    __asm volatile("sdiv %0, %1, %2" : "+r"(quotient) : "r"(-7), "r"(2));
    note(quotient);
    CCR &= ~0x10U;
    SYNC();
}

void case_unaligned(void)
{
    static uint32_t words[4] = {0x03020100, 0x07060504, 0x0B0A0908, 0x0F0E0D0C};
    const uint32_t odd = (uint32_t)(uintptr_t)words + 1;
    uint32_t value = 0;
    __asm volatile("ldr %0, [%1]" : "=l"(value) : "l"(odd) : "memory");
    note(value);
    CCR |= 8U;
    SYNC();
    handle_faults(2);
    value = 1;
    __asm volatile("nop\n ldr %0, [%1]\n nop" : "+l"(value) : "l"(odd) : "memory");
    note(value);
    __asm volatile("nop\n ldrh %0, [%1]\n nop" : "+l"(value) : "l"(odd) : "memory");
    note(value);
    __asm volatile("nop\n str %0, [%1]\n nop" ::"l"(value), "l"(odd + 1) : "memory");
    __asm volatile("nop\n ldr %0, [%1]\n nop" : "+l"(value) : "l"(odd + 3) : "memory");
    note(value);
    __asm volatile("nop\n ldrb %0, [%1]\n nop" : "+l"(value) : "l"(odd) : "memory");
    note(value);
    CCR &= ~8U;
    SYNC();
    note(words[0]);
    __asm volatile("ldr %0, [%1]" : "=l"(value) : "l"(odd) : "memory");
    note(value);
}

/* Back to the caller of what was branched to. */
static uint32_t give_up(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)argument;
    frame->pc = frame->lr & ~1U;
    frame->xpsr |= 0x01000000U;
    return exc_return;
}

static void branch_to(uint32_t address)
{
    __asm volatile("blx %0" ::"r"(address) : "lr", "memory");
}

void case_thumb_lost(void)
{
    for (uint32_t i = HARD_FAULT; i <= USAGE_FAULT; i++) {
        on(i, give_up, 0);
    }
    branch_to((uint32_t)(uintptr_t)undefined & ~1U);
    branch_to(NO_ADDRESS | 1U); /* fetch from nowhere */
    branch_to(0x40000001U);     /* peripherals are never executable */
    branch_to(0xE000E001U);
}

static uint32_t leave_with(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)frame;
    (void)exc_return;
    return argument;
}

/* The UsageFault of a bad return is chained on: its EXC_RETURN is the bad one. */
static uint32_t repair(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)frame;
    note(exc_return);
    return argument;
}

void case_bad_return(void)
{
    on(USAGE_FAULT, repair, 0xFFFFFFF9U);
    on(16 + LOW, leave_with, 0xFFFFFFF1U); /* to a handler, but there is none below */
    NVIC_ISPR = 1U << LOW;
    SYNC();
    on(16 + LOW, leave_with, 0xFFFFFFF5U); /* reserved */
    NVIC_ISPR = 1U << LOW;
    SYNC();
    note(READ_SPECIAL(ipsr));
}

static void region(uint32_t number, uint32_t base, uint32_t attributes)
{
    MPU_RNR = number;
    MPU_RBAR = base;
    MPU_RASR = attributes;
}

#define NO_ACCESS     0x00000000U
#define READ_WRITE    0x03000000U
#define READ_ONLY     0x06000000U
#define EXECUTE_NEVER 0x10000000U
#define SIZE(bits)    (((bits)-1U) << 1 | 1U)

/* Functions, for the emulator takes reads as allowed in all of a page to the end of the block in which one
 * access to it was. */
static uint32_t arena[512] __attribute__((aligned(2048)));

__attribute__((noinline)) static void store(volatile uint32_t *place, uint32_t value)
{
    __asm volatile("nop\n str %0, [%1]\n nop" ::"l"(value), "l"(place) : "memory");
}

__attribute__((noinline)) static uint32_t load(const volatile uint32_t *place)
{
    uint32_t value = 0x22222222;
    __asm volatile("nop\n ldr %0, [%1]\n nop" : "+l"(value) : "l"(place) : "memory");
    return value;
}

static uint32_t touch_arena(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    store(&arena[8], argument); /* HardFault does not know the MPU */
    note(load(&arena[8]));
    return skip(frame, exc_return, 2);
}

static void mpu_on(void)
{
    MPU_CTRL = 5; /* with the background map, not in HardFault */
    SYNC();
}

static void mpu_off(void)
{
    MPU_CTRL = 0;
    SYNC();
}

void case_mpu(void)
{
    handle_faults(2);
    arena[8] = 1;
    region(0, (uint32_t)(uintptr_t)arena, NO_ACCESS | EXECUTE_NEVER | SIZE(5));
    region(1, (uint32_t)(uintptr_t)&arena[16], READ_ONLY | EXECUTE_NEVER | SIZE(6));
    region(2, (uint32_t)(uintptr_t)&arena[256], READ_WRITE | EXECUTE_NEVER | SIZE(10));
    mpu_on();
    note(load(&arena[8])); /* just behind the first region */
    store(&arena[8], 2);
    note(load(&arena[7]));
    store(&arena[7], 3);
    note(load(&arena[16]));
    store(&arena[16], 4);
    note(load(&arena[16]));
    store(&arena[256], 0x47704770); /* BX LR twice */
    note(load(&arena[256]));
    for (uint32_t i = HARD_FAULT; i <= USAGE_FAULT; i++) {
        on(i, give_up, 0);
    }
    branch_to((uint32_t)(uintptr_t)&arena[256] | 1U);
    region(2, (uint32_t)(uintptr_t)&arena[256], READ_WRITE | SIZE(10));
    SYNC();
    branch_to((uint32_t)(uintptr_t)&arena[256] | 1U);
    region(3, (uint32_t)(uintptr_t)&arena[256], NO_ACCESS | SIZE(10) | 0x0100U); /* its first eighth is off */
    SYNC();
    handle_faults(2);
    note(load(&arena[256 + 32]));
    note(load(&arena[256])); /* last: QEMU 7.2 takes the whole page for open after this */
    region(0, (uint32_t)(uintptr_t)arena, NO_ACCESS | EXECUTE_NEVER | SIZE(6));
    SYNC();
    SHCSR = 0;
    on(HARD_FAULT, touch_arena, 0x55);
    store(&arena[8], 6);
    SHCSR = ENABLE_FAULTS;
    mpu_off();
    note(load(&arena[8]));
    for (uint32_t i = 0; i < 8; i++) {
        region(i, 0, 0);
    }
}

static uint32_t resume_at;

/* The frame is not there, for the stack has ended: one is made up that leads behind the culprit. */
static uint32_t rescue(frame_t *frame, uint32_t exc_return, uint32_t argument)
{
    (void)argument;
    mpu_off();
    note((uint32_t)(uintptr_t)frame - (uint32_t)(uintptr_t)arena);
    *frame = (frame_t){.pc = resume_at, .xpsr = 0x01000000};
    return exc_return;
}

/* A thread on a process stack that ends in a guard: an interrupt's frame that does not fit, then a push that
 * runs into it. */
void case_guard(void)
{
    on(MEM_MANAGE, rescue, 0);
    on(HARD_FAULT, rescue, 0);
    region(0, (uint32_t)(uintptr_t)arena, NO_ACCESS | EXECUTE_NEVER | SIZE(8));
    for (uint32_t i = 0; i < 2; i++) {
        SHCSR = i == 0 ? ENABLE_FAULTS : 0;
        WRITE_SPECIAL(psp, (uintptr_t)&arena[64 + 2]);
        WRITE_SPECIAL(control, READ_SPECIAL(control) | 2U);
        mpu_on();
        __asm volatile(
            "adr r0, 1f\n str r0, [%2]\n str %0, [%1]\n dsb\n isb\n nop\n .balign 4\n 1: nop" ::"r"(1U
                                                                                                    << LOW),
            "r"(&NVIC_ISPR), "r"(&resume_at)
            : "r0", "r1", "r2", "r3", "r12", "lr", "memory");
        mpu_on();
        WRITE_SPECIAL(psp, (uintptr_t)&arena[64 + 2]);
        __asm volatile(
            "adr r0, 1f\n str r0, [%0]\n nop\n push {r0, r1, r2, r3}\n nop\n .balign 4\n 1: nop" ::"r"(
                &resume_at)
            : "r0", "r1", "r2", "r3", "r12", "lr", "memory");
        WRITE_SPECIAL(control, READ_SPECIAL(control) & ~2U);
        SYNC();
    }
    SHCSR = ENABLE_FAULTS;
    note(arena[64]);
    note(arena[65]);
    region(0, 0, 0);
}
