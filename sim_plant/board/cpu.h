/* The processor of the emulated board: a Cortex-M4 whose instructions libunicorn executes, with exceptions,
 * NVIC, SysTick, DWT, SCB, MPU and simulated time of our own. ARMv7-M Architecture Reference Manual, B1 and
 * B3.
 *
 * Time is counted in processor cycles, estimated per instruction (cycles.h). Devices hang on the bus by
 * address; an access that no device takes stops the run with an error that names address and PC.
 *
 * libunicorn is GPL-2: this folder is linked into pmsim-board alone. */
#ifndef BOARD_CPU_H
#define BOARD_CPU_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct cpu cpu_t;

/* A block of registers. Accesses come as words with a mask of the bytes that are meant; read and write
 * return false for a register that is not modelled. After cpu_fail() within one its own answer is of no
 * matter. A device may lie on memory that the processor may not write: it gets the writes (and mask), reads
 * stay memory. Flash is programmed so. */
typedef struct {
    const char *name;
    uint32_t base, size;
    void *self;
    bool (*read)(void *self, uint32_t offset, uint32_t *value);
    bool (*write)(void *self, uint32_t offset, uint32_t value, uint32_t mask);
} cpu_device_t;

typedef struct {
    const char *name;
    uint32_t base, size;
    bool executable, writable; /* by the processor */
    uint32_t alias_of;         /* the same memory as that other base; 0: its own */
} cpu_memory_t;

/* Figures of one exception number, from entry to return, without what has preempted it. */
typedef struct {
    uint64_t count;
    uint64_t instructions, instructions_least, instructions_most;
    uint64_t cycles_low, cycles_typical, cycles_high; /* sums */
    uint64_t cycles_most;                             /* typical, of one */
    uint64_t latency_most;                            /* from pending to entry */
} cpu_exception_stats_t;

cpu_t *cpu_create(char *error, size_t error_size);
void cpu_destroy(cpu_t *cpu);

void cpu_add_memory(cpu_t *cpu, const cpu_memory_t *memory);        /* base and size in whole KiB */
void cpu_add_device(cpu_t *cpu, const cpu_device_t *device);        /* copied */
uint8_t *cpu_memory(cpu_t *cpu, uint32_t address, uint32_t size);   /* the host's view, NULL: outside */
void cpu_code_changed(cpu_t *cpu, uint32_t address, uint32_t size); /* flash was programmed or erased */

/* Fetches from that memory wait as STM32G4's flash does at these wait states (cycles.h); 0 after creation. */
void cpu_set_wait_states(cpu_t *cpu, uint32_t base, unsigned wait_states);

/* Names in errors come from there; the image stays the caller's. */
typedef struct elf_image elf_image_t;
void cpu_set_symbols(cpu_t *cpu, const elf_image_t *image);
bool cpu_load_image(cpu_t *cpu, const elf_image_t *image); /* false: not all of it is in memory */

/* Stack pointer and entry from the vector table; clears everything but memory and counters of time. */
void cpu_reset(cpu_t *cpu, uint32_t vector_table);

/* Runs until that cycle. False when stopped by an error: cpu_error(). A halted processor lets time pass. */
bool cpu_run(cpu_t *cpu, uint64_t until_cycle);
const char *cpu_error(const cpu_t *cpu);
/* For devices: ends the run. */
__attribute__((format(printf, 2, 3))) void cpu_fail(cpu_t *cpu, const char *format, ...);
void cpu_halt(cpu_t *cpu, bool halted); /* as a debugger does */
/* Whatever the processor fetches from or loads of that memory until then waits. From within a device's write.
 */
void cpu_stall(cpu_t *cpu, uint32_t base, uint64_t until_cycle);
uint64_t cpu_now(const cpu_t *cpu);
uint32_t cpu_pc(const cpu_t *cpu);
uint32_t cpu_register(const cpu_t *cpu, int n); /* r0 to r15; 16: xPSR */

/* Interrupt request lines are levels: pending again after return while the line is high. CPU_NMI is one of
 * them. */
#define CPU_NMI (-14)
void cpu_irq(cpu_t *cpu, int irq, bool level);

/* Calls back once `cycle` has been reached, between two blocks of instructions. One per owner: a later call
 * replaces an earlier one; UINT64_MAX cancels. */
typedef void (*cpu_alarm_t)(void *owner, uint64_t cycle);
void cpu_alarm(cpu_t *cpu, void *owner, uint64_t cycle, cpu_alarm_t alarm);

/* Called at entry (true) and return (false) of every exception. */
typedef void (*cpu_trace_t)(void *owner, int exception, bool entry);
void cpu_trace(cpu_t *cpu, void *owner, cpu_trace_t trace);

/* Called before the block at that address is executed: the entry of a function, or where a call returns to.
 * Cost in time only where it is called. A later call for an address replaces; NULL cancels. */
typedef void (*cpu_watch_t)(void *owner, uint32_t address);
void cpu_watch(cpu_t *cpu, uint32_t address, void *owner, cpu_watch_t watch);

/* A BKPT is an error without this. True: it has been served, go on behind it; false: the run ends. */
typedef bool (*cpu_breakpoint_t)(void *owner, uint8_t number);
void cpu_on_breakpoint(cpu_t *cpu, void *owner, cpu_breakpoint_t breakpoint);
void cpu_set_register(cpu_t *cpu, int n, uint32_t value); /* of xPSR, the flags */

/* A debugger is called with the processor at rest, before the instruction at the PC: when asked for, at a
 * break, after a step. Time stands until it returns; it may change registers and memory. A break within an IT
 * block is not seen, and a step may go on to its end. A stop costs up to a block's time, no instructions. */
typedef enum { CPU_GO, CPU_STEP } cpu_debug_t;
typedef cpu_debug_t (*cpu_debugger_t)(void *owner);
void cpu_debug(cpu_t *cpu, void *owner, cpu_debugger_t debugger); /* NULL: none, and no breaks */
bool cpu_break(cpu_t *cpu, uint32_t address, bool set);           /* false: more than 32 */
void cpu_ask_debugger(cpu_t *cpu);

/* Software reset (AIRCR) or lock-up: the run ends with true, these tell. Both last until cpu_reset(). */
bool cpu_reset_asked(const cpu_t *cpu);
bool cpu_locked_up(const cpu_t *cpu);
bool cpu_sleeping(const cpu_t *cpu);

const cpu_exception_stats_t *cpu_exception_stats(const cpu_t *cpu, int exception);
void cpu_clear_stats(cpu_t *cpu);
uint64_t cpu_instructions(const cpu_t *cpu);
uint64_t cpu_cycles_low(const cpu_t *cpu); /* as cpu_now(), by the most favourable reading of the manual */
uint64_t cpu_cycles_high(const cpu_t *cpu);
uint64_t cpu_cycles_asleep(const cpu_t *cpu);
uint64_t cpu_cycles_in_thread(const cpu_t *cpu);

/* Executed blocks: address, size, instructions, times. For profiles and coverage. */
typedef void (*cpu_block_visitor_t)(void *context, uint32_t address, uint32_t size, uint32_t instructions,
                                    uint64_t hits);
void cpu_visit_blocks(const cpu_t *cpu, cpu_block_visitor_t visit, void *context);

#ifdef __cplusplus
}
#endif

#endif
