/* QEMU TCG plugin: instructions executed per call of chosen functions, from entry to return.
 *
 *   -plugin plugin_calls.so,map=MAP,out=OUT
 *
 * MAP (written by count.py) has one line per item, addresses in hex, sorted by address per kind:
 *   f ADDR NAME    a function; NAME is remembered for the profile
 *   m ADDR         measure this function
 *   r ADDR         an instruction that follows a call, so a place where a call may return to
 * OUT gets, per measured function, a line `call NAME COUNT`, one for each completed call, and
 * `prof NAME CALLS INSTRUCTIONS` for every function that ran inside measured calls.
 *
 * Work is done per translated block, not per instruction. That is exact: a function entry and a return
 * address always start a block, and on a machine without interrupts a block that starts runs to its end.
 * An instruction that fails its IT condition counts as one, as it takes a cycle on hardware too.
 *
 * qemu-plugin.h is not packaged by Debian or Ubuntu. Declared here is the part of the API that has kept
 * its signatures through all versions; functions that changed (instruction data, inline counters) are
 * avoided, which is why the map is made outside. */
#include <inttypes.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef uint64_t qemu_plugin_id_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
extern void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t,
                                                  void (*)(qemu_plugin_id_t, struct qemu_plugin_tb *));
extern void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *, void (*)(unsigned, void *),
                                                 int flags, void *);
extern void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, void (*)(qemu_plugin_id_t, void *), void *);
extern size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
extern uint64_t qemu_plugin_tb_vaddr(const struct qemu_plugin_tb *);
extern struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t);
extern uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *);
extern size_t qemu_plugin_insn_size(const struct qemu_plugin_insn *);

#ifndef PM_PLUGIN_API
#define PM_PLUGIN_API 1
#endif
#define EXPORT __attribute__((visibility("default")))
EXPORT int qemu_plugin_version = PM_PLUGIN_API;

enum { MAX_DEPTH = 1024 };

struct function {
    uint32_t addr;
    bool measured;
    char name[96];
    uint64_t calls, insns;
};

struct block {
    uint32_t start;
    uint32_t insns;
    uint32_t return_to; /* address after its last instruction if that is a call, else 0 */
    struct function *function;
};

/* An open call. A tail call has no frame of its own to return to: it shares its caller's return address. */
struct frame {
    uint32_t return_to;
    bool tail;
    struct function *measured;
    uint64_t start;
};

static struct function *functions;
static size_t function_count;
static uint32_t *returns;
static size_t return_count;
static struct frame stack[MAX_DEPTH];
static size_t depth;
static size_t open_measured;
static uint64_t total;
static uint32_t pending_return; /* set by a block that ended in a call */
static const struct function *running;
static FILE *out;

static void fail(const char *what)
{
    fprintf(stderr, "plugin_calls: %s\n", what);
    exit(3);
}

static struct function *function_at(uint32_t addr)
{
    size_t low = 0, high = function_count;
    while (low < high) {
        size_t mid = (low + high) / 2;
        if (functions[mid].addr <= addr) {
            low = mid + 1;
        } else {
            high = mid;
        }
    }
    return low > 0 ? &functions[low - 1] : NULL;
}

static int compare_u32(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static void push(uint32_t return_to, bool tail, struct function *measured)
{
    if (depth == MAX_DEPTH) {
        fail("calls nested too deeply");
    }
    stack[depth] = (struct frame){return_to, tail, measured, total};
    depth++;
    open_measured += measured != NULL;
}

/* Closes the innermost call; true when that was a tail call, so that its caller returns with it. */
static bool pop(void)
{
    depth--;
    const struct frame *top = &stack[depth];
    if (top->measured != NULL) {
        open_measured--;
        fprintf(out, "call %s %" PRIu64 "\n", top->measured->name, total - top->start);
    }
    return top->tail;
}

static void on_block(unsigned vcpu, void *user)
{
    (void)vcpu;
    const struct block *b = user;
    struct function *f = b->function;
    bool enters = f != NULL && f->addr == b->start;
    bool called =
        pending_return != 0 && b->start != pending_return; /* equal: a call skipped by its IT block */

    if (called) {
        push(pending_return, false, enters && f->measured ? f : NULL);
    } else {
        if (depth > 0 && stack[depth - 1].return_to == b->start) {
            while (pop()) {
            }
        }
        /* A tail call to another function; a jump to its own start is a loop. */
        if (enters && f->measured && depth > 0 && stack[depth - 1].measured != f) {
            push(stack[depth - 1].return_to, true, f);
        }
    }
    pending_return = b->return_to;
    total += b->insns;
    if (open_measured > 0 && f != NULL) {
        f->insns += b->insns;
        f->calls += enters && (called || running != f);
    }
    running = f;
}

static void on_translate(qemu_plugin_id_t id, struct qemu_plugin_tb *tb)
{
    (void)id;
    size_t n = qemu_plugin_tb_n_insns(tb);
    struct block *b = malloc(sizeof *b); /* lives as long as the process: blocks may be cached for ever */
    if (b == NULL || n == 0) {
        fail("cannot record a block");
    }
    const struct qemu_plugin_insn *last = qemu_plugin_tb_get_insn(tb, n - 1);
    uint32_t after = (uint32_t)(qemu_plugin_insn_vaddr(last) + qemu_plugin_insn_size(last));
    bool is_return = bsearch(&after, returns, return_count, sizeof *returns, compare_u32) != NULL;
    b->start = (uint32_t)qemu_plugin_tb_vaddr(tb);
    b->insns = (uint32_t)n;
    b->return_to = is_return ? after : 0;
    b->function = function_at(b->start);
    qemu_plugin_register_vcpu_tb_exec_cb(tb, on_block, 0, b);
}

static void on_exit(qemu_plugin_id_t id, void *user)
{
    (void)id;
    (void)user;
    for (size_t i = 0; i < function_count; i++) {
        if (functions[i].insns > 0) {
            fprintf(out, "prof %s %" PRIu64 " %" PRIu64 "\n", functions[i].name, functions[i].calls,
                    functions[i].insns);
        }
    }
    fprintf(out, "total %" PRIu64 "\n", total);
    fclose(out);
}

static void read_map(const char *path)
{
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        fail("cannot read the map");
    }
    char line[256];
    size_t lines = 0;
    while (fgets(line, sizeof line, file) != NULL) {
        lines++;
    }
    functions = calloc(lines + 1, sizeof *functions);
    returns = calloc(lines + 1, sizeof *returns);
    if (functions == NULL || returns == NULL) {
        fail("out of memory");
    }
    rewind(file);
    while (fgets(line, sizeof line, file) != NULL) {
        struct function f = {0};
        char kind = 0;
        if (sscanf(line, "%c %" SCNx32 " %95s", &kind, &f.addr, f.name) < 2) {
            fail("bad line in the map");
        }
        if (kind == 'f') {
            functions[function_count++] = f;
        } else if (kind == 'm') {
            function_at(f.addr)->measured = true;
        } else {
            returns[return_count++] = f.addr;
        }
    }
    fclose(file);
}

EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const void *info, int argc, char **argv)
{
    (void)info;
    const char *map = NULL;
    for (int i = 0; i < argc; i++) {
        if (strncmp(argv[i], "map=", 4) == 0) {
            map = argv[i] + 4;
        } else if (strncmp(argv[i], "out=", 4) == 0) {
            out = fopen(argv[i] + 4, "w");
        }
    }
    if (map == NULL || out == NULL) {
        fail("needs map= and out=");
    }
    read_map(map);
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translate);
    qemu_plugin_register_atexit_cb(id, on_exit, NULL);
    return 0;
}
