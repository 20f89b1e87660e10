#include "sim_plant/board/cpu_state.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim_plant/board/cpu_insn.h"
#include "sim_plant/board/exceptions.h"

/* Numbers of unicorn's interrupt hook */
enum { UNICORN_SVC = 2, UNICORN_PREFETCH_ABORT = 3, UNICORN_BKPT = 7, UNICORN_EXCEPTION_EXIT = 8 };

#define NOWHERE UINT64_C(0xFFFFFFFE) /* an address that is never executed: runs end by stopping */

static const int core_register[16] = {
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
        registers[i] = cpu_get(cpu, core_register[i]);
    }
}

void cpu_spend(cpu_t *cpu, cycles_t cycles)
{
    cpu->total.low += cycles.low;
    cpu->total.typical += cycles.typical;
    cpu->total.high += cycles.high;
}

/* --- Errors -------------------------------------------------------------------------------------------- */

static void fail(cpu_t *cpu, uint32_t pc, const char *format, va_list arguments)
{
    if (cpu->failed) {
        return; /* the first error is the cause of the rest */
    }
    cpu->failed = true;
    cpu->want_stop = true;
    char text[160];
    (void)vsnprintf(text, sizeof text, format, arguments);
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
    va_start(arguments, format);
    fail(cpu, pc, format, arguments);
    va_end(arguments);
}

void cpu_fail(cpu_t *cpu, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fail(cpu, cpu->block != NULL ? cpu->block->address : cpu_pc(cpu), format, arguments);
    va_end(arguments);
}

bool cpu_hook(cpu_t *cpu, uc_hook *hook, int type, void (*call)(void), uint64_t begin, uint64_t end)
{
    /* unicorn takes functions as void *, which ISO C lets no cast do. */
    void *pointer;
    static_assert(sizeof pointer == sizeof call, "one kind of pointer");
    memcpy(&pointer, &call, sizeof pointer);
    return uc_hook_add(cpu->uc, hook, type, pointer, cpu, begin, end) == UC_ERR_OK;
}

/* --- Blocks -------------------------------------------------------------------------------------------- */

static void stop_before(cpu_t *cpu, uint32_t address)
{
    cpu->stopped = true;
    cpu->stop_pc = address;
    (void)uc_emu_stop(cpu->uc);
}

static void on_division(uc_engine *uc, uint64_t address, uint32_t size, void *user)
{
    (void)size;
    cpu_t *cpu = user;
    const uint8_t *code = cpu_memory(cpu, (uint32_t)address, 4);
    if (code == NULL) {
        return;
    }
    insn_t insn;
    insn_decode(&insn, (uint16_t)(code[0] | code[1] << 8), (uint16_t)(code[2] | code[3] << 8));
    if (insn.kind != INSN_DIVIDE) {
        return; /* the code has changed since */
    }
    const uint32_t numerator = cpu_get(cpu, core_register[insn.numerator]);
    const uint32_t denominator = cpu_get(cpu, core_register[insn.denominator]);
    if (denominator == 0 && (cpu->system.ccr & CCR_DIVIDE_TRAP) != 0) {
        cpu->divided_by_zero = true;
        cpu->division_pc = (uint32_t)address;
        (void)uc_emu_stop(uc);
        return;
    }
    const uint32_t cycles = cycles_of_division(numerator, denominator, insn.is_signed);
    cpu_spend(cpu, (cycles_t){cycles, cycles, cycles});
}

static bool is_hooked(const cpu_t *cpu, uint32_t address)
{
    for (unsigned i = 0; i < cpu->hooks; i++) {
        if (cpu->hooked[i] == address) {
            return true;
        }
    }
    return false;
}

/* A hook on a single instruction costs the others nothing, but has to be there before it is translated. */
static bool hook_divisions(cpu_t *cpu, const cpu_block_t *block, bool only_ask)
{
    const uint8_t *code = block->region->host + (block->address - block->region->is.base);
    for (uint32_t at = 0; at + 4 <= block->size;) {
        insn_t insn;
        insn_decode(&insn, (uint16_t)(code[at] | code[at + 1] << 8),
                    (uint16_t)(code[at + 2] | code[at + 3] << 8));
        const uint32_t address = block->address + at;
        if (insn.kind == INSN_DIVIDE && !is_hooked(cpu, address)) {
            if (only_ask) {
                return true;
            }
            uc_hook hook;
            if (cpu->hooks == sizeof cpu->hooked / sizeof cpu->hooked[0] ||
                !cpu_hook(cpu, &hook, UC_HOOK_CODE, (void (*)(void))on_division, address, address)) {
                cpu_fail(cpu, "too many divisions");
                return false;
            }
            cpu->hooked[cpu->hooks] = address;
            cpu->hooks++;
        }
        at += insn.length;
    }
    return false;
}

static void watch_block(cpu_t *cpu, cpu_block_t *block)
{
    for (unsigned i = 0; i < cpu->watches; i++) {
        if (cpu->watch[i].address == block->address) {
            const cpu_watch_entry_t entry = cpu->watch[i];
            block->attention = true;
            entry.call(entry.owner, block->address);
            return;
        }
    }
}

#define FPU_ENABLED UINT32_C(0x00F00000)

/* Things that are seldom. True: something has to be done before the block can run. */
static bool attend(cpu_t *cpu, cpu_block_t *block)
{
    if (block->cost.divisions > 0 && hook_divisions(cpu, block, true)) {
        return true;
    }
    if (!mpu_allows(&cpu->mpu, block->address, MPU_EXECUTE, cpu_is_urgent(cpu))) {
        return true;
    }
    if (block->cost.floating && (cpu->system.cpacr & FPU_ENABLED) != FPU_ENABLED) {
        return true;
    }
    /* HardFault may execute what others may not. */
    block->attention = cpu_is_urgent(cpu) && (cpu->mpu.control & 1U) != 0;
    watch_block(cpu, block);
    return false;
}

/* The same, with the processor at rest. */
static void serve_attention(cpu_t *cpu, cpu_block_t *block)
{
    if (block->cost.divisions > 0 && hook_divisions(cpu, block, true)) {
        (void)hook_divisions(cpu, block, false);
        cpu_retranslate(cpu, block->address, block->size);
    } else if (!mpu_allows(&cpu->mpu, block->address, MPU_EXECUTE, cpu_is_urgent(cpu))) {
        cpu_take_fetch_fault(cpu, true);
    } else if (block->cost.floating && (cpu->system.cpacr & FPU_ENABLED) != FPU_ENABLED) {
        exceptions_raise_usage(cpu, CFSR_NOCP);
    }
}

static void account(cpu_t *cpu, cpu_block_t *block)
{
    cpu_spend(cpu, block->cost.cycles);
    if (block->region->fetch.wait_states != 0) {
        cpu_spend(cpu, cycles_of_fetch(&block->region->fetch, block->address, block->size));
    }
    cpu->total.instructions += block->cost.instructions;
    cpu->event = cpu->event || block->cost.sends_event;
    block->hits++;
    cpu->block = block;
    cpu->block_end = block->address + block->size;
}

/* unicorn's PC may be stale in here, so that a stop remembers the address. */
static void on_block(uc_engine *uc, uint64_t where, uint32_t size, void *user)
{
    (void)uc;
    cpu_t *cpu = user;
    const uint32_t address = (uint32_t)where;
    if (cpu->block != NULL && cpu->block->cost.ends_in_branch_if && cpu->block_end != address) {
        cpu_spend(cpu, cycles_taken());
    }
    if (cpu->want_stop || cpu->total.typical >= cpu->stop_at ||
        (cpu->nvic.candidate != 0 && exceptions_next(cpu) != 0)) {
        cpu->block = NULL; /* the branch has been counted */
        stop_before(cpu, address);
        return;
    }
    cpu_block_t *block = cpu_block_at(cpu, address, size);
    if (block == NULL) {
        cpu_fail_at(cpu, address, "executed outside memory");
        stop_before(cpu, address);
        return;
    }
    if (block->region->original->stalled_until > cpu->total.typical) {
        cpu->wait_until = block->region->original->stalled_until;
        cpu->block = NULL;
        stop_before(cpu, address);
        return;
    }
    if (block->attention && attend(cpu, block)) {
        cpu->block = block;
        cpu->block_end = 0;
        stop_before(cpu, address);
        return;
    }
    account(cpu, block);
}

static void on_interrupt(uc_engine *uc, uint32_t number, void *user)
{
    cpu_t *cpu = user;
    cpu->interrupt = (int)number;
    (void)uc_emu_stop(uc);
}

/* --- Bus ----------------------------------------------------------------------------------------------- */

static uint64_t window_read(cpu_t *cpu, uint32_t address, unsigned size)
{
    uint32_t value = 0;
    if (cpu->failed || cpu->fault.pending) {
        return 0;
    }
    const bus_answer_t answer = bus_read(&cpu->bus, address, size, &value);
    if (answer != BUS_DONE && !cpu->failed) {
        uint32_t it;
        const cpu_device_t *device = bus_find(&cpu->bus, address);
        cpu_fail_at(cpu, cpu_access_pc(cpu, address, false, &it), "read of 0x%08x: %s %s", address,
                    device != NULL ? "not modelled in" : "no device",
                    device != NULL ? device->name : "there");
    }
    return value;
}

static void window_write(cpu_t *cpu, uint32_t address, unsigned size, uint32_t value)
{
    if (cpu->failed || cpu->fault.pending) {
        return;
    }
    const bus_answer_t answer = bus_write(&cpu->bus, address, size, value);
    if (answer != BUS_DONE && !cpu->failed) {
        uint32_t it;
        const cpu_device_t *device = bus_find(&cpu->bus, address);
        cpu_fail_at(cpu, cpu_access_pc(cpu, address, true, &it), "write of 0x%x to 0x%08x: %s %s", value,
                    address, device != NULL ? "not modelled in" : "no device",
                    device != NULL ? device->name : "there");
    }
}

static uint64_t read_peripheral(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    (void)uc;
    return window_read(user, UINT32_C(0x40000000) + (uint32_t)offset, size);
}

static void write_peripheral(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    (void)uc;
    window_write(user, UINT32_C(0x40000000) + (uint32_t)offset, size, (uint32_t)value);
}

static uint64_t read_private(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    (void)uc;
    return window_read(user, UINT32_C(0xE0000000) + (uint32_t)offset, size);
}

static void write_private(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    (void)uc;
    window_write(user, UINT32_C(0xE0000000) + (uint32_t)offset, size, (uint32_t)value);
}

/* --- Running ------------------------------------------------------------------------------------------- */

static void take_breakpoint(cpu_t *cpu)
{
    const uint32_t pc = cpu_get(cpu, UC_ARM_REG_PC) & ~1U;
    const uint8_t *code = cpu_memory(cpu, pc, 2);
    const uint8_t number = code != NULL ? code[0] : 0;
    if (cpu->breakpoint.call == NULL) {
        cpu_fail_at(cpu, pc, "breakpoint %d", number);
        return;
    }
    cpu_set(cpu, UC_ARM_REG_PC, (pc + 2) | 1U);
    if (!cpu->breakpoint.call(cpu->breakpoint.owner, number)) {
        cpu->reset_asked = true;
    }
}

static void take_interrupt(cpu_t *cpu)
{
    switch (cpu->interrupt) {
    case UNICORN_SVC:
        exceptions_raise(cpu, EXCEPTION_SVC);
        break;
    case UNICORN_PREFETCH_ABORT: /* the architecture's own rules; fetches from nowhere come as errors */
        cpu_take_fetch_fault(cpu, true);
        break;
    case UNICORN_BKPT:
        take_breakpoint(cpu);
        break;
    case UNICORN_EXCEPTION_EXIT:
        if ((cpu_get(cpu, UC_ARM_REG_XPSR) & 0x1FFU) == 0) { /* in thread mode it is but an address */
            cpu_take_fetch_fault(cpu, true);
        } else {
            exceptions_return(cpu, cpu_get(cpu, UC_ARM_REG_PC) | 1U);
        }
        break;
    default:
        cpu_fail_at(cpu, cpu_get(cpu, UC_ARM_REG_PC), "unicorn's interrupt %d", cpu->interrupt);
        break;
    }
}

static void end_of_division(cpu_t *cpu)
{
    cpu->divided_by_zero = false;
    cpu_set(cpu, UC_ARM_REG_PC, cpu->division_pc | 1U);
    exceptions_raise_usage(cpu, CFSR_DIVBYZERO);
}

static void execute(cpu_t *cpu)
{
    cpu->interrupt = -1;
    cpu->stopped = false;
    const uc_err error = uc_emu_start(cpu->uc, cpu_get(cpu, UC_ARM_REG_PC) | 1U, NOWHERE, 0, 0);
    if (cpu->stopped) {
        cpu_set(cpu, UC_ARM_REG_PC, cpu->stop_pc | 1U);
        if (cpu->block != NULL && cpu->block->address == cpu->stop_pc && cpu->block_end == 0) {
            cpu_block_t *block = cpu->block;
            cpu->block = NULL;
            serve_attention(cpu, block);
        }
        return;
    }
    if (cpu->divided_by_zero) {
        end_of_division(cpu);
    } else if (cpu->interrupt >= 0) {
        take_interrupt(cpu);
    } else if (error != UC_ERR_OK) {
        cpu_take_error(cpu, error);
    } else {
        cpu->sleeping = true; /* WFI is the only other end */
    }
    cpu->block = NULL;
}

/* While the alignment is enforced, every access comes by; it costs a third of the speed. */
static void watch_alignment(cpu_t *cpu)
{
    const bool wanted = (cpu->system.ccr & CCR_UNALIGN_TRAP) != 0;
    if (wanted == cpu->aligned_only) {
        return;
    }
    cpu->aligned_only = wanted;
    if (wanted) {
        (void)cpu_hook(cpu, &cpu->alignment_hook, UC_HOOK_MEM_READ | UC_HOOK_MEM_WRITE,
                       (void (*)(void))cpu_on_any_memory, 1, 0);
    } else {
        (void)uc_hook_del(cpu->uc, cpu->alignment_hook);
    }
    for (unsigned i = 0; i < cpu->regions; i++) { /* so that the hook gets into the translated code */
        cpu_retranslate(cpu, cpu->region[i].is.base, cpu->region[i].is.size);
    }
}

/* What was asked for from within a block. */
static void settle(cpu_t *cpu)
{
    cpu->want_stop = cpu->failed;
    if (cpu->flash_writes != 0) {
        cpu_flush_flash_writes(cpu);
    }
    if (cpu->remap) {
        watch_alignment(cpu);
        cpu_map_all(cpu);
    }
    if (cpu->close_again) {
        cpu_close_again(cpu);
    }
}

static void pass_time(cpu_t *cpu, uint64_t until, bool asleep)
{
    const uint64_t step = until - cpu->total.typical;
    cpu->total.low += step;
    cpu->total.typical += step;
    cpu->total.high += step;
    cpu->total.asleep += asleep ? step : 0;
}

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

static void wake(cpu_t *cpu)
{
    if (cpu->sleeping_for_event && cpu->event) {
        cpu->event = false;
        cpu->sleeping_for_event = false;
    }
    if ((cpu->sleeping || cpu->sleeping_for_event) && exceptions_wake(cpu)) {
        cpu->sleeping = false;
        cpu->sleeping_for_event = false;
    }
}

static bool ended(const cpu_t *cpu)
{
    return cpu->failed || cpu->reset_asked || cpu->locked_up;
}

bool cpu_run(cpu_t *cpu, uint64_t until_cycle)
{
    while (!ended(cpu)) {
        settle(cpu);
        while (!cpu->failed && alarms_serve(&cpu->alarms, cpu->total.typical)) {
        }
        if (ended(cpu)) {
            break;
        }
        cpu->stop_at = earlier(until_cycle, cpu->alarms.next);
        const bool waits = cpu->halted || cpu->wait_until > cpu->total.typical;
        if (!waits) {
            wake(cpu);
            const int next = exceptions_next(cpu);
            if (next != 0) {
                cpu->block = NULL;
                exceptions_enter(cpu, next);
                continue;
            }
        }
        if (cpu->total.typical >= until_cycle) {
            break;
        }
        if (cpu->total.typical >= cpu->stop_at) {
            continue;
        }
        if (cpu->halted || cpu->sleeping || cpu->sleeping_for_event) {
            pass_time(cpu, cpu->stop_at, !cpu->halted);
        } else if (waits) {
            pass_time(cpu, earlier(cpu->stop_at, cpu->wait_until), false);
        } else {
            execute(cpu);
        }
    }
    return !cpu->failed;
}

/* --- Interface ----------------------------------------------------------------------------------------- */

static bool set_up(cpu_t *cpu)
{
    uc_hook hook;
    return uc_open(UC_ARCH_ARM, (uc_mode)(UC_MODE_THUMB | UC_MODE_MCLASS), &cpu->uc) == UC_ERR_OK &&
           uc_ctl_set_cpu_model(cpu->uc, UC_CPU_ARM_CORTEX_M4) == UC_ERR_OK &&
           uc_mmio_map(cpu->uc, 0x40000000, 0x20000000, read_peripheral, cpu, write_peripheral, cpu) ==
               UC_ERR_OK &&
           uc_mmio_map(cpu->uc, 0xE0000000, 0x00100000, read_private, cpu, write_private, cpu) == UC_ERR_OK &&
           cpu_hook(cpu, &hook, UC_HOOK_BLOCK, (void (*)(void))on_block, 1, 0) &&
           cpu_hook(cpu, &hook, UC_HOOK_INTR, (void (*)(void))on_interrupt, 1, 0) &&
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
        cpu_set(cpu, core_register[i], 0);
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
    return cpu_get(cpu, core_register[n & 15]);
}

void cpu_set_register(cpu_t *cpu, int n, uint32_t value)
{
    cpu_set(cpu, core_register[n & 15], n == 15 ? value | 1U : value);
}

void cpu_irq(cpu_t *cpu, int irq, bool level)
{
    nvic_set_level(&cpu->nvic, EXCEPTION_IRQ0 + irq, level, cpu->total.typical);
}

void cpu_alarm(cpu_t *cpu, void *owner, uint64_t cycle, cpu_alarm_t alarm)
{
    if (!alarms_set(&cpu->alarms, owner, cycle, alarm)) {
        cpu_fail(cpu, "more than %d alarms", ALARMS_MOST);
    }
    cpu->stop_at = earlier(cpu->stop_at, cpu->alarms.next);
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
