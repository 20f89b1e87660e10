/* What unicorn calls while it executes. */
#include "sim_plant/board/cpu_state.h"

#include "sim_plant/board/cpu_insn.h"
#include "sim_plant/board/exceptions.h"

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
    insn_decode_at(&insn, code, 4);
    if (insn.kind != INSN_DIVIDE) {
        return; /* the code has changed since */
    }
    const uint32_t numerator = cpu_get(cpu, cpu_core_register[insn.numerator]);
    const uint32_t denominator = cpu_get(cpu, cpu_core_register[insn.denominator]);
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
        insn_decode_at(&insn, code + at, block->size - at);
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
void cpu_serve_attention(cpu_t *cpu, cpu_block_t *block)
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
    if (cpu->block != NULL) {
        cpu->block->after = block;
    }
    cpu->block = block;
    cpu->block_end = block->address + block->size;
    __builtin_prefetch(block->after);
}

/* unicorn's PC may be stale in here, so that a stop remembers the address. */
void cpu_on_block(uc_engine *uc, uint64_t where, uint32_t size, void *user)
{
    (void)uc;
    cpu_t *cpu = user;
    const uint32_t address = (uint32_t)where;
    if (cpu->block != NULL && cpu->block->cost.ends_in_branch_if && cpu->block_end != address) {
        cpu_spend(cpu, cycles_taken());
    }
    cpu_block_t *block = cpu_block_at(cpu, address, size); /* in any case: it has been translated */
    if (cpu->want_stop || cpu->total.typical >= cpu->stop_at ||
        (cpu->nvic.candidate != 0 && exceptions_next(cpu) != 0)) {
        cpu->block = NULL; /* the branch has been counted */
        stop_before(cpu, address);
        return;
    }
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
    if (cpu->debug.call != NULL && cpu_debug_stops_block(cpu, address)) {
        cpu->block = NULL;
        stop_before(cpu, address);
        return;
    }
    account(cpu, block);
}

void cpu_on_interrupt(uc_engine *uc, uint32_t number, void *user)
{
    cpu_t *cpu = user;
    cpu->interrupt = (int)number;
    (void)uc_emu_stop(uc);
}
