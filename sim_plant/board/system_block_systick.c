/* The system timer: B3.3. */
#include "sim_plant/board/system_block_parts.h"

enum { SYSTICK_ENABLE = 1, SYSTICK_INTERRUPT = 2, SYSTICK_CORE_CLOCK = 4 };

static uint64_t tick(const cpu_t *cpu)
{
    return (cpu->system.systick.control & SYSTICK_CORE_CLOCK) != 0 ? 1 : 8;
}

static void systick_zero(void *owner, uint64_t cycle)
{
    /* The alarm belongs to SysTick's own state, so that the processor's address stays free for others. */
    char *system = (char *)owner - offsetof(system_block_t, systick);
    cpu_t *cpu = (cpu_t *)(void *)(system - offsetof(struct cpu, system));
    cpu->system.systick.passed_zero = true;
    if ((cpu->system.systick.control & SYSTICK_INTERRUPT) != 0) {
        nvic_pend(&cpu->nvic, EXCEPTION_SYSTICK, cycle);
    }
    const uint64_t period = (cpu->system.systick.reload + UINT64_C(1)) * tick(cpu);
    cpu->system.systick.zero_at = cpu->system.systick.reload == 0 ? UINT64_MAX : cycle + period;
    cpu_alarm(cpu, owner, cpu->system.systick.zero_at, systick_zero);
}

static void systick_start(cpu_t *cpu, uint32_t from)
{
    const bool runs =
        (cpu->system.systick.control & SYSTICK_ENABLE) != 0 && (from != 0 || cpu->system.systick.reload != 0);
    const uint64_t ticks = from != 0 ? from : cpu->system.systick.reload + UINT64_C(1);
    cpu->system.systick.zero_at = runs ? cpu->total.typical + ticks * tick(cpu) : UINT64_MAX;
    cpu_alarm(cpu, &cpu->system.systick, cpu->system.systick.zero_at, systick_zero);
}

static uint32_t systick_value(const cpu_t *cpu)
{
    if ((cpu->system.systick.control & SYSTICK_ENABLE) == 0) {
        return cpu->system.systick.value;
    }
    if (cpu->system.systick.zero_at == UINT64_MAX || cpu->system.systick.zero_at <= cpu->total.typical) {
        return 0;
    }
    const uint64_t left = (cpu->system.systick.zero_at - cpu->total.typical + tick(cpu) - 1) / tick(cpu);
    return left > cpu->system.systick.reload ? 0 : (uint32_t)left;
}

static void systick_control(cpu_t *cpu, uint32_t value)
{
    const uint32_t count = systick_value(cpu);
    cpu->system.systick.control = value & 7U;
    cpu->system.systick.value = count;
    systick_start(cpu, count);
}

bool systick_read(cpu_t *cpu, uint32_t offset, uint32_t *value)
{
    switch (offset) {
    case SYST_CSR:
        *value = cpu->system.systick.control | (cpu->system.systick.passed_zero ? UINT32_C(0x00010000) : 0U);
        cpu->system.systick.passed_zero = false;
        return true;
    case SYST_RVR:
        *value = cpu->system.systick.reload;
        return true;
    case SYST_CVR:
        *value = systick_value(cpu);
        return true;
    case SYST_CALIB:
        *value = 0;
        return true;
    default:
        return false;
    }
}

bool systick_write(cpu_t *cpu, uint32_t offset, uint32_t value)
{
    switch (offset) {
    case SYST_CSR:
        systick_control(cpu, value);
        return true;
    case SYST_RVR:
        cpu->system.systick.reload = value & 0xFFFFFFU;
        return true;
    case SYST_CVR:
        cpu->system.systick.passed_zero = false;
        cpu->system.systick.value = 0;
        systick_start(cpu, 0);
        return true;
    default:
        return false;
    }
}
