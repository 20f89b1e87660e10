/* Runs every instruction of instructions.def on thousands of operands and prints a line per instruction: its
 * name, the hash of its results and the hash of its flags. On the target the instructions themselves, on the
 * host what the manual says of them; compare.py compares. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { VECTORS = 6000, MEMORY_WORDS = 8 };

#ifdef __arm__
typedef struct {
    uint32_t lo, hi, flags;
} result_t;

#define OPERATION(name, text, ...)                                                                           \
    static void do_##name(result_t *r, uint32_t a, uint32_t b, uint32_t c, uint32_t d, uint32_t *memory)     \
    {                                                                                                        \
        register uint32_t lo __asm("r4") = c;                                                                \
        register uint32_t hi __asm("r5") = d;                                                                \
        register uint32_t flags __asm("r6") = r->flags;                                                      \
        register uint32_t x __asm("r2") = a;                                                                 \
        register uint32_t y __asm("r3") = b;                                                                 \
        register uint32_t *m __asm("r7") = memory;                                                           \
        __asm volatile("msr apsr_nzcvqg, %5\n" text "\n mrs %5, apsr"                                        \
                       : "+r"(lo), "+r"(hi), "+r"(x), "+r"(y), "+r"(m), "+r"(flags)::"r12", "cc", "memory"); \
        r->lo = lo;                                                                                          \
        r->hi = hi;                                                                                          \
        r->flags = flags & 0xF80F0000U;                                                                      \
    }
#else
#include "tests/target/emulator/instructions_reference.h"

#define OPERATION(name, text, ...)                                                                           \
    static void do_##name(result_t *r, uint32_t a, uint32_t b, uint32_t c, uint32_t d, uint32_t *memory)     \
    {                                                                                                        \
        (void)r, (void)a, (void)b, (void)c, (void)d, (void)memory;                                           \
        __VA_ARGS__;                                                                                         \
    }
#endif
#include "tests/target/emulator/instructions.def"
#undef OPERATION

typedef void (*operation_t)(result_t *r, uint32_t a, uint32_t b, uint32_t c, uint32_t d, uint32_t *memory);

static const struct {
    const char *name;
    operation_t run;
} operations[] = {
#define OPERATION(name, text, ...) {#name, do_##name},
#include "tests/target/emulator/instructions.def"
#undef OPERATION
};

static uint32_t random_state;

static uint32_t random_word(void) /* xorshift */
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}

/* Half of the operands are corners; each of the four walks through them at its own pace. */
static uint32_t operand(uint32_t index, uint32_t pace)
{
    static const uint32_t corners[] = {
        0,          1,          2,          31,         32,         33,         0x7FFF,     0x8000,
        0xFFFF,     0x10000,    0x7FFFFFFF, 0x80000000, 0x80000001, 0xFFFFFFFF, 0x80008000, 0x7FFF7FFF,
        0x80007FFF, 0x00018000, 0x7F7F7F7F, 0x80808080, 0xFF00FF00, 0x00FF00FF,
    };
    const uint32_t n = sizeof corners / sizeof corners[0];
    const uint32_t place = index / pace % (2 * n);
    return place < n ? corners[place] : random_word();
}

static uint32_t hash(uint32_t h, uint32_t word) /* FNV-1a */
{
    for (unsigned i = 0; i < 4; i++) {
        h = (h ^ (word & 0xFFU)) * 16777619U;
        word >>= 8;
    }
    return h;
}

int main(void)
{
    for (uint32_t k = 0; k < sizeof operations / sizeof operations[0]; k++) {
        uint32_t results = 2166136261U, flags = 2166136261U;
        random_state = 2463534242U;
        for (uint32_t i = 0; i < VECTORS; i++) {
            const uint32_t a = operand(i, 1), b = operand(i, 23), c = operand(i, 7), d = operand(i, 5);
            uint32_t memory[MEMORY_WORDS] = {a, b, c, d, ~a, ~b, ~c, ~d};
            result_t r = {c, d, c & 0xF80F0000U};
            operations[k].run(&r, a, b, c, d, memory);
            results = hash(hash(results, r.lo), r.hi);
            for (uint32_t m = 0; m < MEMORY_WORDS; m++) {
                results = hash(results, memory[m]);
            }
            flags = hash(flags, r.flags);
        }
        printf("%s %08lx %08lx\n", operations[k].name, (unsigned long)results, (unsigned long)flags);
    }
    return 0;
}
