#include "sim_plant/board/cpu_state.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT = 160 }; /* of an error, without its place */

const int cpu_core_register[16] = {
    UC_ARM_REG_R0,  UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3, UC_ARM_REG_R4,  UC_ARM_REG_R5,
    UC_ARM_REG_R6,  UC_ARM_REG_R7, UC_ARM_REG_R8, UC_ARM_REG_R9, UC_ARM_REG_R10, UC_ARM_REG_R11,
    UC_ARM_REG_R12, UC_ARM_REG_SP, UC_ARM_REG_LR, UC_ARM_REG_PC,
};

uint32_t cpu_get(const cpu_t *cpu, int unicorn_register)
{
    uint32_t value = 0;
    (void)uc_reg_read(cpu->uc, unicorn_register, &value);
    return value;
}

void cpu_set(cpu_t *cpu, int unicorn_register, uint32_t value)
{
    (void)uc_reg_write(cpu->uc, unicorn_register, &value);
}

void cpu_get_core(const cpu_t *cpu, uint32_t registers[16])
{
    for (int i = 0; i < 16; i++) {
        registers[i] = cpu_get(cpu, cpu_core_register[i]);
    }
}

static void fail(cpu_t *cpu, uint32_t pc, const char *text)
{
    if (cpu->failed) {
        return; /* the first error is the cause of the rest */
    }
    cpu->failed = true;
    cpu->want_stop = true;
    elf_symbol_t symbol;
    if (cpu->symbols != NULL && elf_image_function_at(cpu->symbols, pc, &symbol)) {
        (void)snprintf(cpu->error, sizeof cpu->error, "%s; PC 0x%08x, %s + 0x%x", text, pc, symbol.name,
                       pc - symbol.address);
    } else {
        (void)snprintf(cpu->error, sizeof cpu->error, "%s; PC 0x%08x", text, pc);
    }
}

void cpu_fail_at(cpu_t *cpu, uint32_t pc, const char *format, ...)
{
    va_list arguments;
    char text[TEXT];
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    fail(cpu, pc, text);
}

void cpu_fail(cpu_t *cpu, const char *format, ...)
{
    va_list arguments;
    char text[TEXT];
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    fail(cpu, cpu->block != NULL ? cpu->block->address : cpu_pc(cpu), text);
}

bool cpu_hook(cpu_t *cpu, uc_hook *hook, int type, void (*call)(void), uint64_t begin, uint64_t end)
{
    /* unicorn takes functions as void *, which ISO C lets no cast do. */
    void *pointer;
    static_assert(sizeof pointer == sizeof call, "one kind of pointer");
    memcpy(&pointer, &call, sizeof pointer);
    return uc_hook_add(cpu->uc, hook, type, pointer, cpu, begin, end) == UC_ERR_OK;
}

static bool set_up(cpu_t *cpu)
{
    uc_hook hook;
    return uc_open(UC_ARCH_ARM, (uc_mode)(UC_MODE_THUMB | UC_MODE_MCLASS), &cpu->uc) == UC_ERR_OK &&
           uc_ctl_set_cpu_model(cpu->uc, UC_CPU_ARM_CORTEX_M4) == UC_ERR_OK &&
           uc_ctl_exits_enable(cpu->uc) == UC_ERR_OK && cpu_open_windows(cpu) &&
           cpu_hook(cpu, &hook, UC_HOOK_BLOCK, (void (*)(void))cpu_on_block, 1, 0) &&
           cpu_hook(cpu, &hook, UC_HOOK_INTR, (void (*)(void))cpu_on_interrupt, 1, 0) &&
           cpu_hook(cpu, &hook, UC_HOOK_MEM_INVALID, (void (*)(void))cpu_on_bad_memory, 1, 0);
}

cpu_t *cpu_create(char *error, size_t error_size)
{
    cpu_t *cpu = calloc(1, sizeof *cpu);
    if (cpu == NULL || !set_up(cpu)) {
        (void)snprintf(error, error_size, "libunicorn refuses a Cortex-M4");
        cpu_destroy(cpu);
        return NULL;
    }
    alarms_clear(&cpu->alarms);
    nvic_reset(&cpu->nvic);
    system_block_attach(cpu);
    system_block_reset(cpu);
    return cpu;
}

void cpu_destroy(cpu_t *cpu)
{
    if (cpu != NULL) {
        if (cpu->uc != NULL) {
            (void)uc_close(cpu->uc);
        }
        cpu_free_memory(cpu);
        free(cpu);
    }
}

void cpu_add_device(cpu_t *cpu, const cpu_device_t *device)
{
    if (!bus_add(&cpu->bus, device)) {
        cpu_fail(cpu, "device %s does not fit at 0x%08x", device->name, device->base);
    }
}

void cpu_set_symbols(cpu_t *cpu, const elf_image_t *image)
{
    cpu->symbols = image;
}

void cpu_reset(cpu_t *cpu, uint32_t vector_table)
{
    cpu->failed = cpu->reset_asked = cpu->locked_up = cpu->halted = false;
    cpu->sleeping = cpu->sleeping_for_event = cpu->event = false;
    cpu->error[0] = 0;
    cpu->block = NULL;
    cpu->flash_writes = 0;
    cpu->fault.pending = cpu->fault.unaligned = false;
    cpu->wait_until = 0;
    while (cpu->frames > 0) {
        cpu_stats_leave(cpu, cpu->frame[cpu->frames - 1].exception);
    }
    nvic_reset(&cpu->nvic);
    system_block_reset(cpu);
    for (unsigned i = 0; i < cpu->regions; i++) {
        if (cpu->region[i].is.writable) {
            cpu_code_changed(cpu, cpu->region[i].is.base, cpu->region[i].is.size);
        }
    }
    cpu->system.vtor = vector_table;
    cpu->remap = true;
    for (int i = 0; i < 15; i++) {
        cpu_set(cpu, cpu_core_register[i], 0);
    }
    static const int masks[] = {UC_ARM_REG_PRIMASK, UC_ARM_REG_BASEPRI, UC_ARM_REG_FAULTMASK};
    cpu_set(cpu, UC_ARM_REG_XPSR, UINT32_C(0x01000000));
    cpu_set(cpu, UC_ARM_REG_CONTROL, 0);
    for (unsigned i = 0; i < sizeof masks / sizeof masks[0]; i++) {
        cpu_set(cpu, masks[i], 0);
    }
    uint32_t sp = 0, entry = 0;
    if (!cpu_load(cpu, vector_table, &sp) || !cpu_load(cpu, vector_table + 4, &entry)) {
        cpu_fail_at(cpu, 0, "no vector table at 0x%08x", vector_table);
    }
    cpu_set(cpu, UC_ARM_REG_SP, sp & ~3U);
    cpu_set(cpu, UC_ARM_REG_LR, UINT32_MAX);
    cpu_set(cpu, UC_ARM_REG_PC, entry | 1U);
    cpu->want_stop = cpu->failed;
}

const char *cpu_error(const cpu_t *cpu)
{
    return cpu->error;
}

void cpu_halt(cpu_t *cpu, bool halted)
{
    cpu->halted = halted;
    cpu->want_stop = true;
}

uint64_t cpu_now(const cpu_t *cpu)
{
    return cpu->total.typical;
}

uint32_t cpu_pc(const cpu_t *cpu)
{
    return cpu_get(cpu, UC_ARM_REG_PC) & ~1U;
}

uint32_t cpu_register(const cpu_t *cpu, int n)
{
    return cpu_get(cpu, n == 16 ? UC_ARM_REG_XPSR : cpu_core_register[n & 15]);
}

void cpu_set_register(cpu_t *cpu, int n, uint32_t value)
{
    if (n == 16) {
        const uint32_t flags = UINT32_C(0xF80F0000);
        cpu_set(cpu, UC_ARM_REG_XPSR, (cpu_get(cpu, UC_ARM_REG_XPSR) & ~flags) | (value & flags));
        return;
    }
    cpu_set(cpu, cpu_core_register[n & 15], n == 15 ? value | 1U : value);
}

void cpu_irq(cpu_t *cpu, int irq, bool level)
{
    const uint64_t asked = cpu->alarms.serving;
    nvic_set_level(&cpu->nvic, EXCEPTION_IRQ0 + irq, level,
                   asked < cpu->total.typical ? asked : cpu->total.typical);
}

void cpu_alarm(cpu_t *cpu, void *owner, uint64_t cycle, cpu_alarm_t alarm)
{
    if (!alarms_set(&cpu->alarms, owner, cycle, alarm)) {
        cpu_fail(cpu, "more than %d alarms", ALARMS_MOST);
    }
    if (cpu->alarms.next < cpu->stop_at) {
        cpu->stop_at = cpu->alarms.next;
    }
}

void cpu_trace(cpu_t *cpu, void *owner, cpu_trace_t trace)
{
    cpu->trace.owner = owner;
    cpu->trace.call = trace;
}

void cpu_on_breakpoint(cpu_t *cpu, void *owner, cpu_breakpoint_t breakpoint)
{
    cpu->breakpoint.owner = owner;
    cpu->breakpoint.call = breakpoint;
}

bool cpu_reset_asked(const cpu_t *cpu)
{
    return cpu->reset_asked || cpu->locked_up;
}

bool cpu_locked_up(const cpu_t *cpu)
{
    return cpu->locked_up;
}

bool cpu_sleeping(const cpu_t *cpu)
{
    return cpu->sleeping || cpu->sleeping_for_event;
}
