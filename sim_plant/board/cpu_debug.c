/* What a debugger asks of the processor. Breakpoints are hooks on single instructions, which must be there
 * before these are translated; a step stops at whatever comes next, in sequence or in another block. */
#include "sim_plant/board/cpu_state.h"

#include "sim_plant/board/cpu_insn.h"

#define NOWHERE UINT32_MAX /* no instruction is there */

static void on_instruction(uc_engine *uc, uint64_t where, uint32_t size, void *user)
{
    (void)size;
    cpu_t *cpu = user;
    const uint32_t address = (uint32_t)where;
    /* unicorn does not stop within an IT block. */
    if (address != cpu->debug.passing && (cpu->block == NULL || cpu_it_at(cpu->block, address) == 0)) {
        cpu->debug.stopped_at = address;
        (void)uc_emu_stop(uc);
    }
}

static bool hook(cpu_t *cpu, cpu_stop_t *stop, uint32_t address)
{
    stop->address = address;
    if (!cpu_hook(cpu, &stop->hook, UC_HOOK_CODE, (void (*)(void))on_instruction, address, address)) {
        return false;
    }
    cpu_retranslate(cpu, address, 2);
    return true;
}

static void unhook(cpu_t *cpu, const cpu_stop_t *stop)
{
    (void)uc_hook_del(cpu->uc, stop->hook);
    cpu_retranslate(cpu, stop->address, 2);
}

void cpu_debug(cpu_t *cpu, void *owner, cpu_debugger_t debugger)
{
    while (debugger == NULL && cpu->debug.stops > 0) {
        (void)cpu_break(cpu, cpu->debug.stop[0].address, false);
    }
    cpu->debug.owner = owner;
    cpu->debug.call = debugger;
    cpu->debug.due = false;
    cpu->debug.passing = cpu->debug.stopped_at = cpu->debug.resumed = NOWHERE;
}

bool cpu_break(cpu_t *cpu, uint32_t address, bool set)
{
    unsigned i = 0;
    address &= ~1U;
    while (i < cpu->debug.stops && cpu->debug.stop[i].address != address) {
        i++;
    }
    const bool found = i < cpu->debug.stops;
    if (set && !found) {
        if (i == CPU_BREAKS || !hook(cpu, &cpu->debug.stop[i], address)) {
            return false;
        }
        cpu->debug.stops++;
    } else if (!set && found) {
        unhook(cpu, &cpu->debug.stop[i]);
        cpu->debug.stops--;
        cpu->debug.stop[i] = cpu->debug.stop[cpu->debug.stops];
    } else {
        /* as it is */
    }
    return true;
}

void cpu_ask_debugger(cpu_t *cpu)
{
    cpu->debug.due = cpu->debug.call != NULL;
    cpu->want_stop = true;
}

/* Those of an IT block may be passed without being noticed, so that some more are watched. */
static void begin_step(cpu_t *cpu)
{
    uint32_t at = cpu->debug.resumed;
    for (unsigned i = 0; i < CPU_STEP_STOPS; i++) {
        const uint8_t *code = cpu_memory(cpu, at, 2);
        if (code == NULL) {
            return;
        }
        at += insn_is_wide((uint16_t)(code[0] | code[1] << 8)) ? 4U : 2U;
        if (hook(cpu, &cpu->debug.ahead[cpu->debug.aheads], at)) {
            cpu->debug.aheads++;
        }
    }
}

static void end_step(cpu_t *cpu)
{
    while (cpu->debug.aheads > 0) {
        cpu->debug.aheads--;
        unhook(cpu, &cpu->debug.ahead[cpu->debug.aheads]);
    }
    cpu->debug.stepping = false;
}

void cpu_serve_debugger(cpu_t *cpu)
{
    end_step(cpu);
    cpu->debug.due = false;
    cpu->debug.stepping = cpu->debug.call(cpu->debug.owner) == CPU_STEP;
    cpu->block = NULL;
    cpu->debug.resumed = cpu_pc(cpu);
    if (cpu->debug.stepping) {
        begin_step(cpu);
    }
}

bool cpu_debug_stops_block(cpu_t *cpu, uint32_t address)
{
    const bool begins = address == cpu->debug.resumed; /* else an interrupt has come first */
    cpu->debug.passing = begins ? address : NOWHERE;
    if (begins) {
        cpu->debug.resumed = NOWHERE;
    }
    cpu->debug.due = cpu->debug.due || (cpu->debug.stepping && !begins);
    return cpu->debug.due;
}

bool cpu_debug_stopped(cpu_t *cpu)
{
    const uint32_t pc = cpu->debug.stopped_at;
    if (pc == NOWHERE) {
        return false;
    }
    cpu->debug.stopped_at = NOWHERE;
    cpu->debug.due = true;
    cpu_take_back_after(cpu, pc);
    cpu_set(cpu, UC_ARM_REG_PC, pc | 1U);
    return true;
}
