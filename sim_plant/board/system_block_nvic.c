/* Interrupt lines and priorities: B3.4. */
#include "sim_plant/board/system_block_parts.h"

static uint32_t lines(cpu_t *cpu, uint32_t offset, bool (*is)(const nvic_t *, int))
{
    uint32_t value = 0;
    for (int bit = 0; bit < 32; bit++) {
        const int exception = EXCEPTION_IRQ0 + (int)(offset / 4) * 32 + bit;
        if (exception < NVIC_EXCEPTIONS && is(&cpu->nvic, exception)) {
            value |= UINT32_C(1) << bit;
        }
    }
    return value;
}

static void set_line(cpu_t *cpu, uint32_t kind, int exception)
{
    switch (kind) {
    case NVIC_ISER:
    case NVIC_ICER:
        nvic_enable(&cpu->nvic, exception, kind == NVIC_ISER);
        break;
    case NVIC_ISPR:
        nvic_pend(&cpu->nvic, exception, cpu->total.typical);
        break;
    default:
        nvic_unpend(&cpu->nvic, exception);
        break;
    }
}

static void set_lines(cpu_t *cpu, uint32_t kind, uint32_t offset, uint32_t value)
{
    for (uint32_t left = value; left != 0; left &= left - 1) {
        const int exception = EXCEPTION_IRQ0 + (int)(offset / 4) * 32 + __builtin_ctz(left);
        if (exception < NVIC_EXCEPTIONS) {
            set_line(cpu, kind, exception);
        }
    }
}

uint32_t priorities(const cpu_t *cpu, int first)
{
    uint32_t value = 0;
    for (int i = 0; i < 4; i++) {
        value |= (uint32_t)(uint8_t)cpu->nvic.priority[first + i] << (8 * i);
    }
    return value;
}

void set_priorities(cpu_t *cpu, int first, uint32_t value, uint32_t mask)
{
    for (int i = 0; i < 4; i++) {
        const int exception = first + i;
        const bool exists = exception >= EXCEPTION_MEM_MANAGE &&
                            (exception <= EXCEPTION_USAGE_FAULT || exception >= EXCEPTION_SVC);
        if (exists && ((mask >> (8 * i)) & 0xFFU) != 0) {
            nvic_set_priority(&cpu->nvic, exception, (uint8_t)(value >> (8 * i)));
        }
    }
}

bool lines_read(cpu_t *cpu, uint32_t offset, uint32_t *value)
{
    const uint32_t index = offset & 0x7FU;
    switch (offset & ~0x7FU) {
    case NVIC_ISER:
    case NVIC_ICER:
        *value = lines(cpu, index, nvic_enabled);
        return true;
    case NVIC_ISPR:
    case NVIC_ICPR:
        *value = lines(cpu, index, nvic_pending);
        return true;
    case NVIC_IABR:
        *value = lines(cpu, index, nvic_active);
        return true;
    default:
        break;
    }
    if (offset >= NVIC_IPR && offset < NVIC_IPR_END) {
        *value = priorities(cpu, EXCEPTION_IRQ0 + (int)(offset - NVIC_IPR));
        return true;
    }
    return false;
}

bool lines_write(cpu_t *cpu, uint32_t offset, uint32_t value, uint32_t mask)
{
    const uint32_t kind = offset & ~0x7FU;
    if (kind == NVIC_ISER || kind == NVIC_ICER || kind == NVIC_ISPR || kind == NVIC_ICPR) {
        set_lines(cpu, kind, offset & 0x7FU, value);
        return true;
    }
    if (offset >= NVIC_IPR && offset < NVIC_IPR_END) {
        set_priorities(cpu, EXCEPTION_IRQ0 + (int)(offset - NVIC_IPR), value, mask);
        return true;
    }
    return false;
}
