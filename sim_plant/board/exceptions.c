#include "sim_plant/board/exceptions.h"

#include "sim_plant/board/cpu_state.h"

enum {
    FRAME_BASIC = 0x20,
    FRAME_EXTENDED = 0x68,
    CONTROL_SPSEL = 2,
    CONTROL_FPCA = 4,
    RETURN_PSP = 4,
    RETURN_THREAD = 8,
    RETURN_BASIC = 16, /* no floating-point registers in the frame */
    CCR_NONBASE_THREAD = 1,
    CCR_STKALIGN = 1 << 9,
    SCR_SLEEP_ON_EXIT = 2,
    FRAME_WORDS = FRAME_EXTENDED / 4,
};

#define XPSR_THUMB       UINT32_C(0x01000000)
#define XPSR_ALIGNED     UINT32_C(0x00000200)
#define XPSR_EXCEPTION   UINT32_C(0x000001FF)
#define EXC_RETURN_FIXED UINT32_C(0xFFFFFFE0)

static const int frame_register[7] = {UC_ARM_REG_R0,  UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3,
                                      UC_ARM_REG_R12, UC_ARM_REG_LR, UC_ARM_REG_PC};

nvic_masks_t exceptions_masks(const cpu_t *cpu)
{
    return (nvic_masks_t){.primask = (cpu_get(cpu, UC_ARM_REG_PRIMASK) & 1U) != 0,
                          .faultmask = (cpu_get(cpu, UC_ARM_REG_FAULTMASK) & 1U) != 0,
                          .basepri = (uint8_t)(cpu_get(cpu, UC_ARM_REG_BASEPRI) & 0xF0U)};
}

int exceptions_priority(const cpu_t *cpu)
{
    const nvic_masks_t masks = exceptions_masks(cpu);
    return nvic_execution_priority(&cpu->nvic, &masks);
}

int exceptions_next(const cpu_t *cpu)
{
    /* Reading the masks costs more than the comparison that mostly decides. */
    if (nvic_next(&cpu->nvic, cpu->nvic.active_priority) == 0) {
        return 0;
    }
    return nvic_next(&cpu->nvic, exceptions_priority(cpu));
}

bool exceptions_wake(const cpu_t *cpu)
{
    if (cpu->nvic.candidate == 0) {
        return false;
    }
    nvic_masks_t masks = exceptions_masks(cpu);
    masks.primask = false;
    return nvic_next(&cpu->nvic, nvic_execution_priority(&cpu->nvic, &masks)) != 0;
}

void exceptions_raise(cpu_t *cpu, int exception)
{
    const int priority = exceptions_priority(cpu);
    if (!nvic_enabled(&cpu->nvic, exception) || nvic_group_priority(&cpu->nvic, exception) >= priority) {
        if (priority <= -1) {
            cpu->locked_up = true;
            cpu->want_stop = true;
            return;
        }
        cpu->system.hfsr |= HFSR_FORCED;
        exception = EXCEPTION_HARD_FAULT;
    }
    nvic_pend(&cpu->nvic, exception, cpu->total.typical);
}

void exceptions_raise_usage(cpu_t *cpu, uint32_t status)
{
    cpu->system.cfsr |= status;
    exceptions_raise(cpu, EXCEPTION_USAGE_FAULT);
}

static bool stack_word(cpu_t *cpu, uint32_t address, uint32_t *value, bool write)
{
    if (!(write ? cpu_store(cpu, address, *value) : cpu_load(cpu, address, value))) {
        cpu->system.cfsr |= write ? CFSR_STKERR : CFSR_UNSTKERR;
        exceptions_raise(cpu, EXCEPTION_BUS_FAULT);
        return false;
    }
    return true;
}

/* Words of a frame go past the MPU, whose regions begin and end at multiples of MPU_FINEST; the first failure
 * ends it and becomes a fault of its own. */
static bool stack_words(cpu_t *cpu, uint32_t address, uint32_t *words, unsigned count, bool write)
{
    const bool urgent = cpu_is_urgent(cpu);
    for (unsigned i = 0; i < count; i++) {
        const uint32_t at = address + 4 * i;
        if ((i == 0 || at % MPU_FINEST == 0) &&
            !mpu_allows(&cpu->mpu, at, write ? MPU_WRITE : MPU_READ, urgent)) {
            cpu->system.cfsr |= write ? CFSR_MSTKERR : CFSR_MUNSTKERR;
            exceptions_raise(cpu, EXCEPTION_MEM_MANAGE);
            return false;
        }
        if (!stack_word(cpu, at, &words[i], write)) {
            return false;
        }
    }
    return true;
}

/* B1.5.6 PushStack(). False: a derived fault is pending now. */
static bool push_frame(cpu_t *cpu, uint32_t control, uint32_t xpsr)
{
    const bool extended = (control & CONTROL_FPCA) != 0;
    uint32_t words[FRAME_WORDS];
    for (unsigned i = 0; i < 7; i++) {
        words[i] = cpu_get(cpu, frame_register[i]);
    }
    const uint32_t sp = cpu_get(cpu, UC_ARM_REG_SP);
    const bool align = (sp & 4U) != 0 && (extended || (cpu->system.ccr & CCR_STKALIGN) != 0);
    words[7] = (xpsr & ~XPSR_ALIGNED) | (align ? XPSR_ALIGNED : 0);
    if (extended) {
        for (int i = 0; i < 16; i++) {
            words[8 + i] = cpu_get(cpu, UC_ARM_REG_S0 + i);
        }
        words[24] = cpu_get(cpu, UC_ARM_REG_FPSCR);
        words[25] = 0;
    }
    const uint32_t size = extended ? FRAME_EXTENDED : FRAME_BASIC;
    const uint32_t frame = sp - size - (align ? 4U : 0U);
    cpu_set(cpu, UC_ARM_REG_SP, frame);
    return stack_words(cpu, frame, words, size / 4, true);
}

/* B1.5.6 ExceptionTaken() */
static void take(cpu_t *cpu, int exception, uint32_t exc_return, cycles_t cycles)
{
    cpu_stats_enter(cpu, exception);
    cpu_spend(cpu, cycles);
    nvic_activate(&cpu->nvic, exception);
    cpu->event = true;
    cpu->sleeping = false;
    const uint32_t place = cpu->system.vtor + 4U * (uint32_t)exception;
    uint32_t vector = 0;
    if (!cpu_load(cpu, place, &vector)) {
        cpu->system.hfsr |= HFSR_VECTTBL;
        if (exception <= EXCEPTION_HARD_FAULT || !cpu_load(cpu, cpu->system.vtor + 12U, &vector)) {
            cpu->locked_up = true;
        }
    }
    /* Control first: in handler mode it ignores SPSEL. */
    const uint32_t control = cpu_get(cpu, UC_ARM_REG_CONTROL);
    cpu_set(cpu, UC_ARM_REG_CONTROL, control & ~(uint32_t)(CONTROL_SPSEL | CONTROL_FPCA));
    cpu_set(cpu, UC_ARM_REG_XPSR, XPSR_THUMB | (uint32_t)exception);
    cpu_set(cpu, UC_ARM_REG_LR, exc_return);
    cpu_set(cpu, UC_ARM_REG_PC, vector | 1U);
    if (cpu->trace.call != NULL) {
        cpu->trace.call(cpu->trace.owner, exception, true);
    }
    if ((vector & 1U) == 0) {
        exceptions_raise_usage(cpu, CFSR_INVSTATE);
    }
}

void exceptions_enter(cpu_t *cpu, int exception)
{
    const uint32_t control = cpu_get(cpu, UC_ARM_REG_CONTROL), xpsr = cpu_get(cpu, UC_ARM_REG_XPSR);
    const bool thread = (xpsr & XPSR_EXCEPTION) == 0;
    const bool psp = thread && (control & CONTROL_SPSEL) != 0, extended = (control & CONTROL_FPCA) != 0;
    if ((control & 1U) != 0) {
        cpu_fail(cpu, "unprivileged code is not modelled");
        return;
    }
    const uint32_t exc_return = EXC_RETURN_FIXED | 1U | (thread ? RETURN_THREAD : 0U) |
                                (psp ? RETURN_PSP : 0U) | (extended ? 0U : RETURN_BASIC);
    if (!push_frame(cpu, control, xpsr)) {
        exception = exceptions_next(cpu);
        if (exception == 0 || cpu->locked_up) {
            return;
        }
    }
    const uint32_t high = CYCLES_ENTRY + (extended ? CYCLES_FP_FRAME : 0U);
    take(cpu, exception, exc_return, (cycles_t){CYCLES_ENTRY, CYCLES_ENTRY, high});
}

static void chain(cpu_t *cpu, int exception, uint32_t exc_return)
{
    take(cpu, exception, exc_return, (cycles_t){CYCLES_CHAIN, CYCLES_CHAIN, CYCLES_CHAIN});
}

/* B1.5.8: what EXC_RETURN may say in this state. */
static bool return_is_legal(const cpu_t *cpu, int exception, uint32_t exc_return)
{
    if (!nvic_active(&cpu->nvic, exception) || (exc_return & EXC_RETURN_FIXED) != EXC_RETURN_FIXED) {
        return false;
    }
    switch (exc_return & 0xFU) {
    case 0x1:
        return cpu->nvic.active_count > 1;
    case 0x9:
    case 0xD:
        return cpu->nvic.active_count == 1 || (cpu->system.ccr & CCR_NONBASE_THREAD) != 0;
    default:
        return false;
    }
}

static void deactivate(cpu_t *cpu, int exception)
{
    if (nvic_active(&cpu->nvic, exception)) {
        nvic_deactivate(&cpu->nvic, exception, cpu->total.typical);
    }
    if (exception != EXCEPTION_NMI) {
        cpu_set(cpu, UC_ARM_REG_FAULTMASK, 0);
    }
    cpu->event = true;
}

/* The cycles of unstacking are the exception's own; a chained one takes over the frame. */
static void leave(cpu_t *cpu, int exception, bool chained, bool extended)
{
    if (!chained) {
        const uint32_t high = CYCLES_RETURN + (extended ? CYCLES_FP_FRAME : 0U);
        cpu_spend(cpu, (cycles_t){CYCLES_RETURN, CYCLES_RETURN, high});
    }
    cpu_stats_leave(cpu, exception);
    if (cpu->trace.call != NULL) {
        cpu->trace.call(cpu->trace.owner, exception, false);
    }
}

static void restore(cpu_t *cpu, uint32_t exc_return, const uint32_t words[FRAME_WORDS], uint32_t frame)
{
    const bool thread = (exc_return & RETURN_THREAD) != 0, psp = (exc_return & RETURN_PSP) != 0;
    const bool extended = (exc_return & RETURN_BASIC) == 0;
    const uint32_t xpsr = words[7];
    const uint32_t sp =
        frame + (extended ? FRAME_EXTENDED : FRAME_BASIC) + ((xpsr & XPSR_ALIGNED) != 0 ? 4U : 0U);
    cpu_set(cpu, UC_ARM_REG_SP, psp ? cpu_get(cpu, UC_ARM_REG_SP) : sp);
    cpu_set(cpu, UC_ARM_REG_XPSR,
            (xpsr & ~(XPSR_ALIGNED | XPSR_EXCEPTION)) | (thread ? 0U : xpsr & XPSR_EXCEPTION));
    const uint32_t control = cpu_get(cpu, UC_ARM_REG_CONTROL) & ~(uint32_t)(CONTROL_SPSEL | CONTROL_FPCA);
    cpu_set(cpu, UC_ARM_REG_CONTROL, control | (psp ? CONTROL_SPSEL : 0U) | (extended ? CONTROL_FPCA : 0U));
    if (psp) {
        cpu_set(cpu, UC_ARM_REG_SP, sp);
    }
    for (unsigned i = 0; i < 6; i++) {
        cpu_set(cpu, frame_register[i], words[i]);
    }
    if (extended) {
        for (int i = 0; i < 16; i++) {
            cpu_set(cpu, UC_ARM_REG_S0 + i, words[8 + i]);
        }
        cpu_set(cpu, UC_ARM_REG_FPSCR, words[24]);
    }
    cpu_set(cpu, UC_ARM_REG_PC, words[6] | 1U);
}

void exceptions_return(cpu_t *cpu, uint32_t exc_return)
{
    const int exception = (int)(cpu_get(cpu, UC_ARM_REG_XPSR) & XPSR_EXCEPTION);
    const bool legal = return_is_legal(cpu, exception, exc_return);
    const bool extended = (exc_return & RETURN_BASIC) == 0;
    deactivate(cpu, exception);
    if (!legal) {
        exceptions_raise_usage(cpu, CFSR_INVPC);
    }
    int next = exceptions_next(cpu);
    uint32_t words[FRAME_WORDS] = {0};
    const uint32_t frame = cpu_get(cpu, (exc_return & RETURN_PSP) != 0 ? UC_ARM_REG_PSP : UC_ARM_REG_SP);
    if (next == 0 && legal &&
        !stack_words(cpu, frame, words, (extended ? FRAME_EXTENDED : FRAME_BASIC) / 4U, false)) {
        next = exceptions_next(cpu);
    }
    leave(cpu, exception, next != 0, extended);
    if (cpu->locked_up) {
        return;
    }
    if (next != 0) {
        chain(cpu, next, exc_return);
        return;
    }
    const bool thread = (exc_return & RETURN_THREAD) != 0;
    restore(cpu, exc_return, words, frame);
    if (thread != ((words[7] & XPSR_EXCEPTION) == 0)) {
        exceptions_raise_usage(cpu, CFSR_INVPC);
    } else if ((words[7] & XPSR_THUMB) == 0) {
        exceptions_raise_usage(cpu, CFSR_INVSTATE);
    } else if (thread && (cpu->system.scr & SCR_SLEEP_ON_EXIT) != 0) {
        cpu->sleeping = true;
    }
}
