#include "sim_plant/board/system_block_parts.h"

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
        nvic_pend(&cpu->nvic, EXCEPTION_NMI, cpu->total.typical);
    }
    if ((value >> 28 & 1U) != 0) {
        nvic_pend(&cpu->nvic, EXCEPTION_PENDSV, cpu->total.typical);
    } else if ((value >> 27 & 1U) != 0) {
        nvic_unpend(&cpu->nvic, EXCEPTION_PENDSV);
    }
    if ((value >> 26 & 1U) != 0) {
        nvic_pend(&cpu->nvic, EXCEPTION_SYSTICK, cpu->total.typical);
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
            nvic_pend(&cpu->nvic, exception, cpu->total.typical);
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
    return systick_read(cpu, offset, value) || lines_read(cpu, offset, value);
}

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
    case DEMCR:
        dwt_enable(cpu, value);
        return (value & UINT32_C(0x000F0000)) == 0; /* the debug monitor */
    case STIR:
        nvic_pend(&cpu->nvic, EXCEPTION_IRQ0 + (int)(value % NVIC_LINES), cpu->total.typical);
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
    return systick_write(cpu, offset, value) || lines_write(cpu, offset, value, mask);
}

void system_block_attach(cpu_t *cpu)
{
    const cpu_device_t devices[] = {
        {"system control space", UINT32_C(0xE000E000), 0x1000, cpu, read_control, write_control},
        {"DWT", UINT32_C(0xE0001000), 0x1000, cpu, dwt_read, dwt_write},
        {"ITM", UINT32_C(0xE0000000), 0x1000, cpu, itm_read, itm_write},
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
