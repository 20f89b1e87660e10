/* unicorn tells the address of a bad access and leaves the registers as they were before the instruction, but
 * not where that is: within the present block it is the load or store whose address agrees. */
#include "sim_plant/board/cpu_state.h"
#include "sim_plant/board/exceptions.h"

#include "sim_plant/board/cpu_insn.h"

#include <string.h>

bool cpu_is_urgent(const cpu_t *cpu)
{
    return nvic_active(&cpu->nvic, EXCEPTION_HARD_FAULT) || nvic_active(&cpu->nvic, EXCEPTION_NMI) ||
           (cpu_get(cpu, UC_ARM_REG_FAULTMASK) & 1U) != 0;
}

static bool touches(const insn_t *insn, uint32_t pc, const uint32_t registers[16], uint32_t address,
                    bool write)
{
    const bool load = insn->kind == INSN_LOAD || insn->kind == INSN_LOADS;
    const bool store = insn->kind == INSN_STORE || insn->kind == INSN_STORES;
    return (write ? store : load) &&
           address - insn_address(insn, pc, registers) < (uint32_t)insn->size * insn->count;
}

/* The state of an IT block as the next instruction sees it: B1.4, A7.3. */
static uint32_t it_advance(uint32_t it)
{
    return (it & 7U) == 0 ? 0 : (it & 0xE0U) | (it << 1 & 0x1FU);
}

uint32_t cpu_it_at(const cpu_block_t *block, uint32_t pc)
{
    const uint8_t *code = block->region->host + (block->address - block->region->is.base);
    uint32_t state = 0;
    for (uint32_t at = 0; at + 2 <= block->size && block->address + at < pc;) {
        insn_t insn;
        insn_decode_at(&insn, code + at, block->size - at);
        state = insn.kind == INSN_IT ? insn.it : it_advance(state);
        at += insn.length;
    }
    return state;
}

uint32_t cpu_access_pc(cpu_t *cpu, uint32_t address, bool write, uint32_t *it)
{
    const cpu_block_t *block = cpu->block;
    uint32_t registers[16], state = 0;
    cpu_get_core(cpu, registers);
    *it = 0;
    if (block == NULL) {
        return registers[15];
    }
    const uint8_t *code = block->region->host + (block->address - block->region->is.base);
    for (uint32_t at = 0; at + 2 <= block->size;) {
        insn_t insn;
        insn_decode_at(&insn, code + at, block->size - at);
        if (touches(&insn, block->address + at, registers, address, write)) {
            *it = state;
            return block->address + at;
        }
        state = insn.kind == INSN_IT ? insn.it : it_advance(state);
        at += insn.length;
    }
    return block->address;
}

/* Within an IT block unicorn 2.0.1 goes on behind a store that failed, up to the next store: registers are
 * put back and devices do not hear of it (fault.pending), but one store to memory can slip through. */
static void give_fault(cpu_t *cpu, uint32_t address, bool write, bool protection)
{
    if (cpu->fault.pending) {
        return; /* the first one counts */
    }
    uint32_t registers[16];
    cpu_get_core(cpu, registers);
    memcpy(cpu->fault.registers, registers, sizeof cpu->fault.registers);
    cpu->fault.xpsr = cpu_get(cpu, UC_ARM_REG_XPSR);
    cpu->fault.address = address;
    cpu->fault.write = write;
    cpu->fault.protection = protection;
    cpu->fault.pending = true;
}

static bool to_flash(cpu_t *cpu, uint32_t address, unsigned size, uint32_t value)
{
    const cpu_device_t *device = bus_find(&cpu->bus, address);
    uint8_t *place = cpu_memory(cpu, address, size);
    if (device == NULL || place == NULL) {
        give_fault(cpu, address, true, false);
        return false;
    }
    if (cpu->flash_writes == CPU_FLASH_WRITES) {
        cpu_fail(cpu, "more than %d writes to flash in a row", CPU_FLASH_WRITES);
        return false;
    }
    cpu_flash_write_t *write = &cpu->flash_write[cpu->flash_writes];
    cpu->flash_writes++;
    *write = (cpu_flash_write_t){.address = address, .value = value, .size = size};
    memcpy(&write->old, place, size);
    cpu->want_stop = true;
    return true;
}

static void wait_for(cpu_t *cpu, uint64_t cycle)
{
    if (cycle > cpu->total.typical) {
        const uint32_t wait = (uint32_t)(cycle - cpu->total.typical);
        cpu_spend(cpu, (cycles_t){wait, wait, wait});
    }
}

bool cpu_on_bad_memory(uc_engine *uc, uc_mem_type type, uint64_t where, int size, int64_t value, void *user)
{
    (void)uc;
    cpu_t *cpu = user;
    const uint32_t address = (uint32_t)where;
    if (type == UC_MEM_FETCH_UNMAPPED || type == UC_MEM_FETCH_PROT) {
        give_fault(cpu, address, false, !mpu_allows(&cpu->mpu, address, MPU_EXECUTE, cpu_is_urgent(cpu)));
        return false;
    }
    const bool write = type == UC_MEM_WRITE_UNMAPPED || type == UC_MEM_WRITE_PROT;
    if (cpu->fault.pending) {
        return false;
    }
    if (!mpu_allows(&cpu->mpu, address, write ? MPU_WRITE : MPU_READ, cpu_is_urgent(cpu))) {
        give_fault(cpu, address, write, true);
        return false;
    }
    const cpu_region_t *region = cpu_region_of(cpu, address);
    if (region == NULL) {
        give_fault(cpu, address, write, false);
        return false;
    }
    if (region->original->stalled_until != 0) {
        wait_for(cpu, region->original->stalled_until);
        cpu->remap = true; /* open from now on */
    }
    if (write && !region->is.writable) {
        return to_flash(cpu, address, (unsigned)size, (uint32_t)value);
    }
    /* Allowed after all: unicorn's finest grain is a page. It now takes reads as allowed everywhere in it,
     * until the end of the block. */
    cpu->close_again = true;
    cpu->want_stop = true;
    return true;
}

/* While alignment is enforced every access comes by. Taking the memory's rights away ends a bad one cleanly.
 */
void cpu_on_any_memory(uc_engine *uc, uc_mem_type type, uint64_t where, int size, int64_t value, void *user)
{
    (void)uc;
    (void)value;
    cpu_t *cpu = user;
    const uint32_t address = (uint32_t)where;
    if (address % (uint32_t)size == 0 || cpu->fault.pending) {
        return;
    }
    if (cpu_region_of(cpu, address) != NULL) {
        give_fault(cpu, address, type == UC_MEM_WRITE, false);
        cpu->fault.unaligned = true;
        cpu_forbid(cpu, address, true);
    }
}

/* Instructions of the block behind the one that failed were counted but not executed. Their time stays: it
 * must not run backwards. */
void cpu_take_back_after(cpu_t *cpu, uint32_t pc)
{
    const cpu_block_t *block = cpu->block;
    if (block == NULL || pc - block->address >= block->size) {
        return;
    }
    cycles_block_t done;
    cycles_of_block(&done, block->region->host + (block->address - block->region->is.base),
                    pc - block->address);
    cpu->total.instructions -= block->cost.instructions - done.instructions;
    cpu->block = NULL;
}

static void data_fault(cpu_t *cpu)
{
    uint32_t it;
    for (int i = 0; i < 15; i++) {
        cpu_set_register(cpu, i, cpu->fault.registers[i]);
    }
    cpu->fault.pending = false;
    const uint32_t pc = cpu_access_pc(cpu, cpu->fault.address, cpu->fault.write, &it);
    cpu_take_back_after(cpu, pc);
    const uint32_t xpsr = cpu->fault.xpsr & ~UINT32_C(0x0600FC00);
    cpu_set(cpu, UC_ARM_REG_XPSR, xpsr | (it & 3U) << 25 | (it & 0xFCU) << 8);
    cpu_set(cpu, UC_ARM_REG_PC, pc | 1U);
    if (cpu->fault.unaligned) {
        cpu->fault.unaligned = false;
        cpu_forbid(cpu, cpu->fault.address, false);
        exceptions_raise_usage(cpu, CFSR_UNALIGNED);
    } else if (cpu->fault.protection) {
        cpu->system.cfsr |= CFSR_DACCVIOL | CFSR_MMARVALID;
        cpu->system.mmfar = cpu->fault.address;
        exceptions_raise(cpu, EXCEPTION_MEM_MANAGE);
    } else {
        cpu->system.cfsr |= CFSR_PRECISERR | CFSR_BFARVALID;
        cpu->system.bfar = cpu->fault.address;
        exceptions_raise(cpu, EXCEPTION_BUS_FAULT);
    }
}

void cpu_take_fetch_fault(cpu_t *cpu, bool protection)
{
    cpu->system.cfsr |= protection ? CFSR_IACCVIOL : CFSR_IBUSERR;
    exceptions_raise(cpu, protection ? EXCEPTION_MEM_MANAGE : EXCEPTION_BUS_FAULT);
}

/* WFE is unknown to unicorn 2.0.1: it ends as an invalid instruction, with the PC behind it. */
static bool was_wait_for_event(cpu_t *cpu, uint32_t pc)
{
    const cpu_block_t *block = cpu->block;
    if (block == NULL || block->address + block->size != pc) {
        return false;
    }
    const uint8_t *narrow = cpu_memory(cpu, pc - 2, 2), *wide = cpu_memory(cpu, pc - 4, 4);
    return (narrow != NULL && narrow[0] == 0x20 && narrow[1] == 0xBF) ||
           (wide != NULL && block->size >= 4 && memcmp(wide, "\xAF\xF3\x02\x80", 4) == 0);
}

static void invalid_instruction(cpu_t *cpu)
{
    const uint32_t pc = cpu_get(cpu, UC_ARM_REG_PC) & ~1U;
    if (was_wait_for_event(cpu, pc)) {
        cpu->sleeping_for_event = !cpu->event;
        cpu->event = false;
        return;
    }
    cpu_take_back_after(cpu, pc);
    const bool thumb = (cpu_get(cpu, UC_ARM_REG_XPSR) & UINT32_C(0x01000000)) != 0;
    exceptions_raise_usage(cpu, thumb ? CFSR_UNDEFINSTR : CFSR_INVSTATE);
}

void cpu_take_error(cpu_t *cpu, uc_err error)
{
    switch (error) {
    case UC_ERR_READ_UNMAPPED:
    case UC_ERR_WRITE_UNMAPPED:
    case UC_ERR_READ_PROT:
    case UC_ERR_WRITE_PROT:
        data_fault(cpu);
        break;
    case UC_ERR_FETCH_UNMAPPED:
    case UC_ERR_FETCH_PROT:
        cpu->fault.pending = false;
        cpu_take_fetch_fault(cpu, cpu->fault.protection);
        break;
    case UC_ERR_INSN_INVALID:
        invalid_instruction(cpu);
        break;
    default:
        cpu_fail_at(cpu, cpu_get(cpu, UC_ARM_REG_PC), "%s", uc_strerror(error));
        break;
    }
}
