/* Runs a program of tests/target (memory of QEMU's mps2-an386, semihosting) on the emulated processor.
 *
 *   emulate [--count NAME]... [--totals] PROGRAM.elf [ARGUMENT]...
 *
 * --count writes a line `call NAME COUNT` per completed call of that function, instructions from its first to
 * its return, as tests/target/count.py counts them. Exit status: the program's, 99 when it could not run. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim_plant/board/elf_image.h"
#include "tests/target/emulator/semihosting.h"

enum { FUNCTIONS = 16, CALLS_OPEN = 64 };

typedef struct counter counter_t;

typedef struct {
    const char *name;
    counter_t *counter;
} counted_t;

/* Calls that have not returned, the innermost last. */
struct counter {
    cpu_t *cpu;
    counted_t function[FUNCTIONS];
    unsigned functions;
    struct {
        const char *name;
        uint32_t return_to;
        uint64_t start;
    } open[CALLS_OPEN];
    unsigned opened;
};

static void on_return(void *owner, uint32_t address)
{
    counter_t *counter = owner;
    while (counter->opened > 0 && counter->open[counter->opened - 1].return_to == address) {
        counter->opened--;
        printf("call %s %llu\n", counter->open[counter->opened].name,
               (unsigned long long)(cpu_instructions(counter->cpu) - counter->open[counter->opened].start));
    }
}

static void on_call(void *owner, uint32_t address)
{
    const counted_t *function = owner;
    counter_t *counter = function->counter;
    (void)address;
    if (counter->opened == CALLS_OPEN) {
        cpu_fail(counter->cpu, "calls nested too deeply");
        return;
    }
    const uint32_t return_to = cpu_register(counter->cpu, 14) & ~1U;
    if (counter->opened > 0 && counter->open[counter->opened - 1].name == function->name &&
        counter->open[counter->opened - 1].return_to == return_to) {
        return; /* a loop whose head is the function's */
    }
    counter->open[counter->opened].name = function->name;
    counter->open[counter->opened].return_to = return_to;
    counter->open[counter->opened].start = cpu_instructions(counter->cpu);
    counter->opened++;
    cpu_watch(counter->cpu, return_to, counter, on_return);
}

static bool count(counter_t *counter, const elf_image_t *image, const char *name)
{
    elf_symbol_t symbol;
    if (counter->functions == FUNCTIONS || !elf_image_find(image, name, &symbol)) {
        fprintf(stderr, "emulate: no function %s\n", name);
        return false;
    }
    counted_t *function = &counter->function[counter->functions];
    *function = (counted_t){name, counter};
    counter->functions++;
    cpu_watch(counter->cpu, symbol.address, function, on_call);
    return true;
}

static int run(cpu_t *cpu, const elf_image_t *image, const char *command_line, bool totals)
{
    semihosting_t semihosting = {.cpu = cpu, .command_line = command_line, .status = 99};
    cpu_on_breakpoint(cpu, &semihosting, semihosting_call);
    cpu_set_symbols(cpu, image);
    if (!cpu_load_image(cpu, image)) {
        fprintf(stderr, "emulate: the program does not fit into memory\n");
        return 99;
    }
    cpu_reset(cpu, 0);
    if (!cpu_run(cpu, UINT64_MAX)) {
        fprintf(stderr, "emulate: %s\n", cpu_error(cpu));
        return 99;
    }
    if (!semihosting.exited) {
        fprintf(stderr, "emulate: locked up or reset at 0x%08x\n", cpu_pc(cpu));
    }
    if (totals) {
        printf("total %llu instructions, %llu to %llu cycles, typical %llu\n",
               (unsigned long long)cpu_instructions(cpu), (unsigned long long)cpu_cycles_low(cpu),
               (unsigned long long)cpu_cycles_high(cpu), (unsigned long long)cpu_now(cpu));
    }
    return semihosting.status;
}

static int usage(void)
{
    fprintf(stderr, "usage: emulate [--count NAME]... [--totals] PROGRAM.elf [ARGUMENT]...\n");
    return 99;
}

int main(int argc, char **argv)
{
    int first = 1;
    const char *counted[FUNCTIONS];
    unsigned counts = 0;
    bool totals = false;
    for (; first < argc && strncmp(argv[first], "--", 2) == 0; first++) {
        if (strcmp(argv[first], "--totals") == 0) {
            totals = true;
        } else if (strcmp(argv[first], "--count") == 0 && first + 1 < argc && counts < FUNCTIONS) {
            first++;
            counted[counts] = argv[first];
            counts++;
        } else {
            return usage();
        }
    }
    if (first >= argc) {
        return usage();
    }
    char line[1024] = "";
    for (int i = first; i < argc; i++) {
        (void)snprintf(line + strlen(line), sizeof line - strlen(line), i == first ? "%s" : " %s", argv[i]);
    }
    char error[256] = "";
    elf_image_t *image = elf_image_open(argv[first], error, sizeof error);
    cpu_t *cpu = image != NULL ? cpu_create(error, sizeof error) : NULL;
    int status = 99;
    if (cpu != NULL) {
        static const cpu_memory_t code = {"code", 0, 4U << 20, true, true, 0};
        static const cpu_memory_t data = {"data", 0x20000000, 4U << 20, true, true, 0};
        cpu_add_memory(cpu, &code);
        cpu_add_memory(cpu, &data);
        counter_t counter = {.cpu = cpu};
        bool found = true;
        for (unsigned i = 0; i < counts; i++) {
            found = count(&counter, image, counted[i]) && found;
        }
        status = found ? run(cpu, image, line, totals) : 99;
    } else {
        fprintf(stderr, "emulate: %s\n", error);
    }
    cpu_destroy(cpu);
    elf_image_close(image);
    return status;
}
