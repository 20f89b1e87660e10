/* The cycle counter (C1.8), and as much of ITM as an image needs to find out that nobody listens. */
#include "sim_plant/board/system_block_parts.h"

#define TRACE_ENABLE UINT32_C(0x01000000)

enum {
    DWT_CTRL = 0x000,
    DWT_CYCCNT = 0x004,
    LOCK_ACCESS = 0xFB0,
    ITM_TER = 0xE00,
    ITM_TPR = 0xE40,
    ITM_TCR = 0xE80
};

static bool dwt_counts(const cpu_t *cpu)
{
    return (cpu->system.dwt.control & 1U) != 0 && (cpu->system.demcr & TRACE_ENABLE) != 0;
}

static uint32_t dwt_count(const cpu_t *cpu)
{
    return dwt_counts(cpu) ? (uint32_t)(cpu->total.typical - cpu->system.dwt.origin) : cpu->system.dwt.value;
}

static void dwt_sync(cpu_t *cpu, uint32_t value)
{
    cpu->system.dwt.value = value;
    cpu->system.dwt.origin = cpu->total.typical - value;
}

bool dwt_read(void *self, uint32_t offset, uint32_t *value)
{
    cpu_t *cpu = self;
    switch (offset) {
    case DWT_CTRL:
        *value = UINT32_C(0x40000000) | cpu->system.dwt.control;
        return true;
    case DWT_CYCCNT:
        *value = dwt_count(cpu);
        return true;
    default:
        return false;
    }
}

bool dwt_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    cpu_t *cpu = self;
    (void)mask;
    switch (offset) {
    case DWT_CTRL: {
        const uint32_t count = dwt_count(cpu);
        cpu->system.dwt.control = value & 1U;
        dwt_sync(cpu, count);
        return (value & ~1U & UINT32_C(0x0FFFFFFF)) == 0; /* the other counters */
    }
    case DWT_CYCCNT:
        dwt_sync(cpu, value);
        return true;
    case LOCK_ACCESS:
        return true;
    default:
        return false;
    }
}

/* Ports read as zero, which is "full": nobody takes the data. */
bool itm_read(void *self, uint32_t offset, uint32_t *value)
{
    (void)self;
    *value = 0;
    return offset < 0x80 || offset == ITM_TER || offset == ITM_TPR || offset == ITM_TCR;
}

bool itm_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    (void)self;
    (void)value;
    (void)mask;
    return offset < 0x80 || offset == ITM_TER || offset == ITM_TPR || offset == ITM_TCR ||
           offset == LOCK_ACCESS;
}

void dwt_enable(cpu_t *cpu, uint32_t demcr)
{
    const uint32_t count = dwt_count(cpu);
    cpu->system.demcr = demcr;
    dwt_sync(cpu, count);
}
