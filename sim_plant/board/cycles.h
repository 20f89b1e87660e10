/* Time of instructions on a Cortex-M4: Technical Reference Manual (DDI 0439), tables 3-1 and 7-1 and section
 * 3.3.3 for loads and stores that follow each other. What the manual gives as a range becomes three figures:
 *
 *            refill of the pipeline P   load after load or store   store            barrier   IT
 *   low      1                          1                          1                1         0
 *   typical  2                          1, 2 if its address        1, 2 with an     3         1
 *                                       was just loaded            index register
 *   high     3                          2                          2                6         1
 *
 * A division takes 2 to 12 cycles by its operands. Flash: cycles_flash_t. docs/emulator.md. */
#ifndef BOARD_CYCLES_H
#define BOARD_CYCLES_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    uint32_t low, typical, high;
} cycles_t;

/* Of a run of instructions without a label. Its divisions and a taken conditional branch at its end are
 * not in it. */
typedef struct {
    cycles_t cycles;
    uint32_t instructions;
    uint32_t divisions;
    bool ends_in_branch_if;
    bool floating;    /* has instructions that need the floating-point unit */
    bool sends_event; /* has SEV */
} cycles_block_t;

void cycles_of_block(cycles_block_t *block, const uint8_t *code, uint32_t size);

static inline cycles_t cycles_taken(void) /* in addition to the branch itself */
{
    const cycles_t refill = {1, 2, 3};
    return refill;
}

uint32_t cycles_of_division(uint32_t numerator, uint32_t denominator, bool is_signed);

#define CYCLES_ENTRY    12 /* of an exception; TRM 2.5, zero wait states */
#define CYCLES_RETURN   10
#define CYCLES_CHAIN    6  /* return and entry in one */
#define CYCLES_FP_FRAME 17 /* high only: the lazy save that then happens */

/* Instruction cache and prefetch of STM32G4's flash (RM0440 3.3.4): 32 lines of four 64-bit words, the least
 * recently used makes room. A word that is not in the cache costs the wait states at a jump; in sequence the
 * prefetch hides what the instructions before it take. Literals and data are not counted. */
enum { CYCLES_LINES = 32, CYCLES_LINE_BYTES = 32 };

typedef struct {
    unsigned wait_states;
    uint32_t tag[CYCLES_LINES]; /* line address + 1; 0: empty */
    uint8_t valid[CYCLES_LINES];
    uint32_t used[CYCLES_LINES];
    uint32_t clock;
    uint32_t last;
} cycles_flash_t;

void cycles_flash_reset(cycles_flash_t *flash, unsigned wait_states);
cycles_t cycles_of_fetch(cycles_flash_t *flash, uint32_t address, uint32_t size);

#ifdef __cplusplus
}
#endif

#endif
