/* The run: time, sleep, interrupts and what has to be done between two stretches of instructions. */
#include "sim_plant/board/cpu_state.h"

#include "sim_plant/board/exceptions.h"

/* Numbers of unicorn's interrupt hook */
enum {
    UNICORN_SVC = 2,
    UNICORN_PREFETCH_ABORT = 3,
    UNICORN_BKPT = 7,
    UNICORN_EXCEPTION_EXIT = 8,
};

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
    const uc_err error =
        uc_emu_start(cpu->uc, cpu_get(cpu, UC_ARM_REG_PC) | 1U, 0, 0, 0); /* there are no exits */
    if (cpu->stopped) {
        cpu_set(cpu, UC_ARM_REG_PC, cpu->stop_pc | 1U);
        if (cpu->block != NULL && cpu->block->address == cpu->stop_pc && cpu->block_end == 0) {
            cpu_block_t *block = cpu->block;
            cpu->block = NULL;
            cpu_serve_attention(cpu, block);
        }
        return;
    }
    if (cpu->debug.call != NULL && cpu_debug_stopped(cpu)) {
        /* the debugger's turn */
    } else if (cpu->divided_by_zero) {
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

static void run(cpu_t *cpu, uint64_t until_cycle)
{
    while (!ended(cpu)) {
        settle(cpu);
        while (!cpu->failed && alarms_serve(&cpu->alarms, cpu->total.typical)) {
        }
        if (ended(cpu)) {
            break;
        }
        if (cpu->debug.due) {
            cpu_serve_debugger(cpu);
            continue;
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
}

bool cpu_run(cpu_t *cpu, uint64_t until_cycle)
{
    cpu_stores_begin(cpu);
    run(cpu, until_cycle);
    cpu_stores_end();
    return !cpu->failed;
}
