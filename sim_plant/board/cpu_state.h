/* Inside of the processor, for its own files: cpu.c runs it, cpu_memory.c maps, cpu_faults.c finds out what
 * went wrong, exceptions.c enters and returns, system_block.c is what the image sees of all this. */
#ifndef BOARD_CPU_STATE_H
#define BOARD_CPU_STATE_H

#include <unicorn/unicorn.h>

#include "sim_plant/board/alarms.h"
#include "sim_plant/board/bus.h"
#include "sim_plant/board/cpu.h"
#include "sim_plant/board/cpu_mpu.h"
#include "sim_plant/board/cycles.h"
#include "sim_plant/board/elf_image.h"
#include "sim_plant/board/nvic.h"
#include "sim_plant/board/system_block.h"

enum {
    CPU_MEMORIES = 8,
    CPU_RUNS = 64,
    CPU_PAGE = 1024,
    CPU_WATCHES = 32,
    CPU_FLASH_WRITES = 64,
    CPU_LINE = 64
};
enum { CPU_BREAKS = 32, CPU_STEP_STOPS = 5 };

typedef struct cpu_region cpu_region_t;

/* A run of instructions that the processor executes as one; from its address to the first branch. It is
 * within one line of the host's cache: these lines are much of what a block costs. */
typedef struct cpu_block cpu_block_t;
struct cpu_block {
    uint32_t address, size;
    cycles_block_t cost;
    cpu_region_t *region;
    cpu_block_t *after; /* the one that was executed after it, the last time */
    uint64_t hits;
    bool attention; /* look before executing: new, watched, or the MPU has changed */
};

typedef struct {
    cpu_block_t *at; /* NULL: none begins here */
} cpu_slot_t;

struct cpu_region {
    cpu_memory_t is;
    uint8_t *host;
    cpu_region_t *original; /* of an alias; else itself */
    cpu_slot_t *block;      /* by half-word; of its own addresses alone */
    bool *holds_code;       /* by page: a block there has been executed, or was about to be */
    cycles_flash_t fetch;
    uint64_t stalled_until;
    struct {
        uint32_t base, size, permissions;
    } run[CPU_RUNS]; /* as mapped in unicorn */
    unsigned runs;
};

typedef struct {
    uint64_t instructions, low, typical, high, asleep;
} cpu_counters_t;

/* An exception being served. */
typedef struct {
    int exception;
    cpu_counters_t own;
} cpu_frame_t;

typedef struct {
    uint32_t address, value, old;
    unsigned size;
} cpu_flash_write_t;

typedef struct {
    uint32_t address;
    void *owner;
    cpu_watch_t call;
} cpu_watch_entry_t;

/* Where the run is to stop. */
typedef struct {
    uint32_t address;
    uc_hook hook;
} cpu_stop_t;

struct cpu {
    uc_engine *uc;
    void *engine; /* unicorn's own name of it; NULL: not known */
    nvic_t nvic;
    bus_t bus;
    alarms_t alarms;
    mpu_t mpu;
    system_block_t system;
    cpu_region_t region[CPU_MEMORIES];
    unsigned regions;

    cpu_counters_t total; /* total.typical is the time */
    uint64_t stop_at;
    bool want_stop; /* before the next block */
    bool stopped;   /* by the block hook, before the block at stop_pc */
    uint32_t stop_pc;
    int interrupt; /* unicorn's number, -1: none */
    bool divided_by_zero;
    uint32_t division_pc;

    bool failed, reset_asked, locked_up, halted, sleeping, sleeping_for_event, event;
    bool remap;       /* access rights have changed */
    bool close_again; /* a read was allowed in a page that is not all open */
    char error[256];

    cpu_block_t *block;          /* present or last */
    cpu_region_t *executes_from; /* the last block's */
    uint32_t block_end;
    uint32_t hooked[256]; /* divisions with a hook */
    unsigned hooks;
    uint64_t wait_until; /* the next block cannot be fetched before */

    struct {
        uint32_t address;
        bool write, protection, unaligned;
        bool pending;           /* what unicorn still executes is not to happen */
        uint32_t registers[15]; /* as they were */
        uint32_t xpsr;
    } fault; /* the access that ends the run of unicorn */
    cpu_flash_write_t flash_write[CPU_FLASH_WRITES];
    unsigned flash_writes;
    uc_hook alignment_hook;
    bool aligned_only;

    cpu_frame_t frame[NVIC_EXCEPTIONS];
    unsigned frames;
    cpu_counters_t mark; /* total when the present frame began to run */
    cpu_counters_t thread;
    cpu_exception_stats_t stats[NVIC_EXCEPTIONS];

    const elf_image_t *symbols;
    cpu_watch_entry_t watch[CPU_WATCHES];
    unsigned watches;
    struct {
        void *owner;
        cpu_trace_t call;
    } trace;
    struct {
        void *owner;
        cpu_breakpoint_t call;
    } breakpoint;
    struct {
        void *owner;
        cpu_debugger_t call; /* NULL: there is none */
        bool due, stepping;
        uint32_t resumed;    /* the debugger has left off before this instruction, which has not begun yet */
        uint32_t passing;    /* it is the first of this block: no stop before it again */
        uint32_t stopped_at; /* by a hook */
        cpu_stop_t stop[CPU_BREAKS], ahead[CPU_STEP_STOPS];
        unsigned stops, aheads;
    } debug;
};

/* cpu.c */
extern const int cpu_core_register[16]; /* unicorn's names of r0 to r15 */
uint32_t cpu_get(const cpu_t *cpu, int unicorn_register);
void cpu_set(cpu_t *cpu, int unicorn_register, uint32_t value);
void cpu_get_core(const cpu_t *cpu, uint32_t registers[16]);
static inline void cpu_spend(cpu_t *cpu, cycles_t cycles)
{
    cpu->total.low += cycles.low;
    cpu->total.typical += cycles.typical;
    cpu->total.high += cycles.high;
}

bool cpu_hook(cpu_t *cpu, uc_hook *hook, int type, void (*call)(void), uint64_t begin, uint64_t end);
__attribute__((format(printf, 3, 4))) void cpu_fail_at(cpu_t *cpu, uint32_t pc, const char *format, ...);

/* cpu_hooks.c */
void cpu_on_block(uc_engine *uc, uint64_t where, uint32_t size, void *user);
void cpu_on_interrupt(uc_engine *uc, uint32_t number, void *user);
void cpu_serve_attention(cpu_t *cpu, cpu_block_t *block); /* with the processor at rest */

/* cpu_debug.c */
void cpu_serve_debugger(cpu_t *cpu);                      /* with the processor at rest */
bool cpu_debug_stops_block(cpu_t *cpu, uint32_t address); /* before a block begins */
bool cpu_debug_stopped(cpu_t *cpu);                       /* within a block; puts the PC there */

/* cpu_stores.c: between begin and end of a run this processor's pages without code take stores the fast way
 */
void cpu_stores_begin(cpu_t *cpu);
void cpu_stores_end(void);
void cpu_stores_meet_code(cpu_t *cpu, cpu_region_t *region, uint32_t first, uint32_t last); /* pages */

/* cpu_window.c */
bool cpu_open_windows(cpu_t *cpu);

/* cpu_memory.c */
cpu_region_t *cpu_region_of(cpu_t *cpu, uint32_t address);
bool cpu_load(cpu_t *cpu, uint32_t address, uint32_t *value); /* by the processor itself; no checks */
bool cpu_store(cpu_t *cpu, uint32_t address, uint32_t value);
void cpu_map(cpu_t *cpu, cpu_region_t *region); /* as the MPU and stalls have it */
void cpu_map_all(cpu_t *cpu);
void cpu_close_again(cpu_t *cpu);
void cpu_forbid(cpu_t *cpu, uint32_t address, bool forbidden);
void cpu_flush_flash_writes(cpu_t *cpu);
void cpu_forget_blocks(cpu_t *cpu, uint32_t address, uint32_t size);
void cpu_retranslate(cpu_t *cpu, uint32_t address, uint32_t size);
void cpu_free_memory(cpu_t *cpu);

/* cpu_block.c */
cpu_block_t *cpu_block_at(cpu_t *cpu, uint32_t address, uint32_t size);
void cpu_block_all_need_attention(cpu_t *cpu);
void cpu_free_blocks(cpu_region_t *region);

/* cpu_faults.c */
bool cpu_on_bad_memory(uc_engine *uc, uc_mem_type type, uint64_t where, int size, int64_t value, void *user);
void cpu_on_any_memory(uc_engine *uc, uc_mem_type type, uint64_t where, int size, int64_t value, void *user);
void cpu_take_error(cpu_t *cpu, uc_err error);
void cpu_take_fetch_fault(cpu_t *cpu, bool protection);
uint32_t cpu_access_pc(cpu_t *cpu, uint32_t address, bool write, uint32_t *it);
void cpu_take_back_after(cpu_t *cpu, uint32_t pc); /* what was counted of the block but not executed */
uint32_t cpu_it_at(const cpu_block_t *block, uint32_t pc); /* state of an IT block there */
bool cpu_is_urgent(const cpu_t *cpu);                      /* in HardFault, NMI or with FAULTMASK */

/* cpu_stats.c */
void cpu_stats_enter(cpu_t *cpu, int exception);
void cpu_stats_leave(cpu_t *cpu, int exception);

#endif
