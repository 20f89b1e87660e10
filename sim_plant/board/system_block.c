#include "sim_plant/board/system_block.h"

#include "sim_plant/board/cpu_state.h"
#include "sim_plant/board/exceptions.h"

/* Offsets in the system control space, 0xE000E000 */
enum {
    ICTR = 0x004,
    ACTLR = 0x008,
    SYST_CSR = 0x010,
    SYST_RVR = 0x014,
    SYST_CVR = 0x018,
    SYST_CALIB = 0x01C,
    NVIC_ISER = 0x100,
    NVIC_ICER = 0x180,
    NVIC_ISPR = 0x200,
    NVIC_ICPR = 0x280,
    NVIC_IABR = 0x300,
    NVIC_IPR = 0x400,
    NVIC_IPR_END = NVIC_IPR + NVIC_LINES,
    CPUID = 0xD00,
    ICSR = 0xD04,
    VTOR = 0xD08,
    AIRCR = 0xD0C,
    SCR = 0xD10,
    CCR = 0xD14,
    SHPR1 = 0xD18,
    SHPR3 = 0xD20,
    SHCSR = 0xD24,
    CFSR = 0xD28,
    HFSR = 0xD2C,
    DFSR = 0xD30,
    MMFAR = 0xD34,
    BFAR = 0xD38,
    AFSR = 0xD3C,
    CPACR = 0xD88,
    MPU = 0xD90,
    MPU_END = 0xDBC,
    DHCSR = 0xDF0,
    DEMCR = 0xDFC,
    STIR = 0xF00,
    FPCCR = 0xF34,
    FPCAR = 0xF38,
    FPDSCR = 0xF3C,
};

enum { SYSTICK_ENABLE = 1, SYSTICK_INTERRUPT = 2, SYSTICK_CORE_CLOCK = 4 };

#define TRACE_ENABLE UINT32_C(0x01000000)

static uint64_t now(const cpu_t *cpu)
{
    return cpu->total.typical;
}

/* --- SysTick ------------------------------------------------------------------------------------------ */

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
    cpu->system.systick.zero_at = runs ? now(cpu) + ticks * tick(cpu) : UINT64_MAX;
    cpu_alarm(cpu, &cpu->system.systick, cpu->system.systick.zero_at, systick_zero);
}

static uint32_t systick_value(const cpu_t *cpu)
{
    if ((cpu->system.systick.control & SYSTICK_ENABLE) == 0) {
        return cpu->system.systick.value;
    }
    if (cpu->system.systick.zero_at == UINT64_MAX || cpu->system.systick.zero_at <= now(cpu)) {
        return 0;
    }
    const uint64_t left = (cpu->system.systick.zero_at - now(cpu) + tick(cpu) - 1) / tick(cpu);
    return left > cpu->system.systick.reload ? 0 : (uint32_t)left;
}

static void systick_control(cpu_t *cpu, uint32_t value)
{
    const uint32_t count = systick_value(cpu);
    cpu->system.systick.control = value & 7U;
    cpu->system.systick.value = count;
    systick_start(cpu, count);
}

/* --- NVIC ---------------------------------------------------------------------------------------------- */

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
        nvic_pend(&cpu->nvic, exception, now(cpu));
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

static uint32_t priorities(const cpu_t *cpu, int first)
{
    uint32_t value = 0;
    for (int i = 0; i < 4; i++) {
        value |= (uint32_t)(uint8_t)cpu->nvic.priority[first + i] << (8 * i);
    }
    return value;
}

static void set_priorities(cpu_t *cpu, int first, uint32_t value, uint32_t mask)
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

/* --- System control block ------------------------------------------------------------------------------ */

static uint32_t bit_if(bool set, unsigned bit)
{
    return set ? UINT32_C(1) << bit : 0;
}

static uint32_t read_icsr(const cpu_t *cpu)
{
    const nvic_t *nvic = &cpu->nvic;
    const uint32_t vector = cpu_get(cpu, UC_ARM_REG_XPSR) & 0x1FFU;
    bool line = false;
    for (int i = EXCEPTION_IRQ0; i < NVIC_EXCEPTIONS; i++) {
        line = line || nvic_pending(nvic, i);
    }
    return bit_if(nvic_pending(nvic, EXCEPTION_NMI), 31) | bit_if(nvic_pending(nvic, EXCEPTION_PENDSV), 28) |
           bit_if(nvic_pending(nvic, EXCEPTION_SYSTICK), 26) | bit_if(line, 22) |
           (uint32_t)nvic->candidate << 12 | bit_if(vector != 0 && nvic->active_count == 1, 11) | vector;
}

static void write_icsr(cpu_t *cpu, uint32_t value)
{
    if ((value >> 31 & 1U) != 0) {
        nvic_pend(&cpu->nvic, EXCEPTION_NMI, now(cpu));
    }
    if ((value >> 28 & 1U) != 0) {
        nvic_pend(&cpu->nvic, EXCEPTION_PENDSV, now(cpu));
    } else if ((value >> 27 & 1U) != 0) {
        nvic_unpend(&cpu->nvic, EXCEPTION_PENDSV);
    }
    if ((value >> 26 & 1U) != 0) {
        nvic_pend(&cpu->nvic, EXCEPTION_SYSTICK, now(cpu));
    } else if ((value >> 25 & 1U) != 0) {
        nvic_unpend(&cpu->nvic, EXCEPTION_SYSTICK);
    }
}

static bool write_aircr(cpu_t *cpu, uint32_t value)
{
    if (value >> 16 != 0x05FA) {
        return true; /* without the key nothing happens */
    }
    nvic_set_group(&cpu->nvic, value >> 8 & 7U);
    if ((value & 4U) != 0) {
        cpu->reset_asked = true;
        cpu->want_stop = true;
    }
    return (value & 3U) == 0;
}

static const struct {
    uint8_t active, pended, enable; /* bit of SHCSR; 0xFF: has none */
    uint8_t exception;
} handlers[] = {
    {0, 13, 16, EXCEPTION_MEM_MANAGE},  {1, 14, 17, EXCEPTION_BUS_FAULT},
    {3, 12, 18, EXCEPTION_USAGE_FAULT}, {7, 15, 0xFF, EXCEPTION_SVC},
    {10, 0xFF, 0xFF, EXCEPTION_PENDSV}, {11, 0xFF, 0xFF, EXCEPTION_SYSTICK},
};

enum { HANDLERS = sizeof handlers / sizeof handlers[0] };

static uint32_t read_shcsr(const cpu_t *cpu)
{
    uint32_t value = 0;
    for (int i = 0; i < HANDLERS; i++) {
        const int exception = handlers[i].exception;
        value |= bit_if(nvic_active(&cpu->nvic, exception), handlers[i].active);
        value |=
            handlers[i].pended == 0xFF ? 0 : bit_if(nvic_pending(&cpu->nvic, exception), handlers[i].pended);
        value |=
            handlers[i].enable == 0xFF ? 0 : bit_if(nvic_enabled(&cpu->nvic, exception), handlers[i].enable);
    }
    return value;
}

/* The active bits are for operating systems that switch contexts by hand: refused. */
static bool write_shcsr(cpu_t *cpu, uint32_t value)
{
    const uint32_t old = read_shcsr(cpu);
    for (int i = 0; i < HANDLERS; i++) {
        const int exception = handlers[i].exception;
        if ((value ^ old) >> handlers[i].active & 1U) {
            return false;
        }
        if (handlers[i].enable != 0xFF) {
            nvic_enable(&cpu->nvic, exception, (value >> handlers[i].enable & 1U) != 0);
        }
        if (handlers[i].pended != 0xFF && (value >> handlers[i].pended & 1U) != 0) {
            nvic_pend(&cpu->nvic, exception, now(cpu));
        } else if (handlers[i].pended != 0xFF) {
            nvic_unpend(&cpu->nvic, exception);
        }
    }
    return true;
}

static void write_ccr(cpu_t *cpu, uint32_t value)
{
    cpu->system.ccr = value & 0x31BU;
    cpu->remap = true; /* alignment is watched through access rights */
    cpu->want_stop = true;
}

static uint32_t *plain_register(cpu_t *cpu, uint32_t offset)
{
    switch (offset) {
    case ACTLR:
        return &cpu->system.actlr;
    case SCR:
        return &cpu->system.scr;
    case CCR:
        return &cpu->system.ccr;
    case CFSR:
        return &cpu->system.cfsr;
    case HFSR:
        return &cpu->system.hfsr;
    case DFSR:
        return &cpu->system.dfsr;
    case MMFAR:
        return &cpu->system.mmfar;
    case BFAR:
        return &cpu->system.bfar;
    case VTOR:
        return &cpu->system.vtor;
    case CPACR:
        return &cpu->system.cpacr;
    case DEMCR:
        return &cpu->system.demcr;
    case FPCCR:
        return &cpu->system.fpccr;
    case FPCAR:
        return &cpu->system.fpcar;
    case FPDSCR:
        return &cpu->system.fpdscr;
    default:
        return NULL;
    }
}

static bool read_nvic(cpu_t *cpu, uint32_t offset, uint32_t *value)
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

static bool read_systick(cpu_t *cpu, uint32_t offset, uint32_t *value)
{
    switch (offset) {
    case SYST_CSR:
        *value = cpu->system.systick.control | bit_if(cpu->system.systick.passed_zero, 16);
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

static bool read_control(void *self, uint32_t offset, uint32_t *value)
{
    cpu_t *cpu = self;
    const uint32_t *plain = plain_register(cpu, offset);
    if (plain != NULL) {
        *value = *plain;
        return true;
    }
    switch (offset) {
    case ICTR:
        *value = (NVIC_LINES + 31) / 32 - 1;
        return true;
    case CPUID:
        *value = UINT32_C(0x410FC241); /* Cortex-M4 r0p1 */
        return true;
    case ICSR:
        *value = read_icsr(cpu);
        return true;
    case AIRCR:
        *value = UINT32_C(0xFA050000) | cpu->nvic.priority_group << 8;
        return true;
    case SHCSR:
        *value = read_shcsr(cpu);
        return true;
    case AFSR:
    case DHCSR: /* no debugger */
        *value = 0;
        return true;
    default:
        break;
    }
    if (offset >= SHPR1 && offset <= SHPR3) {
        *value = priorities(cpu, (int)(offset - SHPR1) + 4);
        return true;
    }
    if (offset >= MPU && offset < MPU_END) {
        return mpu_read(&cpu->mpu, offset - MPU, value);
    }
    return read_systick(cpu, offset, value) || read_nvic(cpu, offset, value);
}

static bool write_nvic(cpu_t *cpu, uint32_t offset, uint32_t value, uint32_t mask)
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

static bool write_systick(cpu_t *cpu, uint32_t offset, uint32_t value)
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

static void dwt_sync(cpu_t *cpu, uint32_t value);
static uint32_t dwt_count(const cpu_t *cpu);

static bool write_control(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    cpu_t *cpu = self;
    uint32_t *plain = plain_register(cpu, offset);
    switch (offset) {
    case ICSR:
        write_icsr(cpu, value);
        return true;
    case VTOR:
        cpu->system.vtor = value & ~0x7FU;
        return true;
    case AIRCR:
        return write_aircr(cpu, value);
    case CCR:
        write_ccr(cpu, (value & mask) | (cpu->system.ccr & ~mask));
        return true;
    case SHCSR:
        return write_shcsr(cpu, value);
    case CFSR:
    case HFSR:
    case DFSR:
        *plain &= ~value; /* a one clears */
        return true;
    case DEMCR: {
        const uint32_t count = dwt_count(cpu);
        cpu->system.demcr = value;
        dwt_sync(cpu, count);
        return (value & UINT32_C(0x000F0000)) == 0; /* the debug monitor */
    }
    case STIR:
        set_line(cpu, NVIC_ISPR, EXCEPTION_IRQ0 + (int)(value % NVIC_LINES));
        return true;
    default:
        break;
    }
    if (plain != NULL) {
        *plain = (*plain & ~mask) | (value & mask);
        if (offset == CPACR) {
            cpu_block_all_need_attention(cpu);
        }
        return true;
    }
    if (offset >= SHPR1 && offset <= SHPR3) {
        set_priorities(cpu, (int)(offset - SHPR1) + 4, value, mask);
        return true;
    }
    if (offset >= MPU && offset < MPU_END) {
        cpu->remap = true;
        cpu->want_stop = true;
        return mpu_write(&cpu->mpu, offset - MPU, value);
    }
    return write_systick(cpu, offset, value) || write_nvic(cpu, offset, value, mask);
}

/* --- DWT and ITM --------------------------------------------------------------------------------------- */

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
    return dwt_counts(cpu) ? (uint32_t)(now(cpu) - cpu->system.dwt.origin) : cpu->system.dwt.value;
}

static void dwt_sync(cpu_t *cpu, uint32_t value)
{
    cpu->system.dwt.value = value;
    cpu->system.dwt.origin = now(cpu) - value;
}

static bool read_dwt(void *self, uint32_t offset, uint32_t *value)
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

static bool write_dwt(void *self, uint32_t offset, uint32_t value, uint32_t mask)
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
static bool read_itm(void *self, uint32_t offset, uint32_t *value)
{
    (void)self;
    *value = 0;
    return offset < 0x80 || offset == ITM_TER || offset == ITM_TPR || offset == ITM_TCR;
}

static bool write_itm(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    (void)self;
    (void)value;
    (void)mask;
    return offset < 0x80 || offset == ITM_TER || offset == ITM_TPR || offset == ITM_TCR ||
           offset == LOCK_ACCESS;
}

void system_block_attach(cpu_t *cpu)
{
    const cpu_device_t devices[] = {
        {"system control space", UINT32_C(0xE000E000), 0x1000, cpu, read_control, write_control},
        {"DWT", UINT32_C(0xE0001000), 0x1000, cpu, read_dwt, write_dwt},
        {"ITM", UINT32_C(0xE0000000), 0x1000, cpu, read_itm, write_itm},
    };
    for (unsigned i = 0; i < sizeof devices / sizeof devices[0]; i++) {
        (void)bus_add(&cpu->bus, &devices[i]);
    }
}

void system_block_reset(cpu_t *cpu)
{
    cpu_alarm(cpu, &cpu->system.systick, UINT64_MAX, NULL);
    cpu->system = (system_block_t){.ccr = 0x200, .fpccr = UINT32_C(0xC0000000)};
    cpu->system.systick.zero_at = UINT64_MAX;
    cpu->mpu = (mpu_t){.control = 0};
}
