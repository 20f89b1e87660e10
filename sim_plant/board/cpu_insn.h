/* What one Thumb-2 instruction of ARMv7E-M with FPv4-SP is: enough for its cost and for the memory it
 * touches. ARMv7-M ARM, A5. Tests: tests/unit/board/cpu_insn_test.cpp. */
#ifndef BOARD_CPU_INSN_H
#define BOARD_CPU_INSN_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    INSN_ALU, /* and everything else of one cycle */
    INSN_LOAD,
    INSN_STORE,
    INSN_LOADS, /* several words: LDM, POP, LDRD, VLDM */
    INSN_STORES,
    INSN_BRANCH, /* taken always: B, BL, BX, BLX, TBB, and the PC written by an ALU operation */
    INSN_BRANCH_IF,
    INSN_TABLE_BRANCH,
    INSN_DIVIDE,
    INSN_IT,
    INSN_BARRIER,
    INSN_SPECIAL, /* MRS, MSR, CPS */
    INSN_WAIT_INTERRUPT,
    INSN_WAIT_EVENT,
    INSN_SEND_EVENT,
    INSN_FLOAT,       /* one cycle */
    INSN_FLOAT_MAC,   /* three */
    INSN_FLOAT_DIVIDE /* fourteen */
} insn_kind_t;

#define INSN_NO_REGISTER 0xFF

typedef struct {
    insn_kind_t kind;
    uint8_t length; /* bytes */
    uint8_t size;   /* bytes of one access */
    uint8_t count;  /* accesses */
    uint8_t base, index, shift;
    uint8_t target;      /* register of a single load, or INSN_NO_REGISTER */
    uint8_t numerator;   /* of a division */
    uint8_t denominator; /* of a division */
    bool is_signed;      /* a division */
    bool writes_pc;      /* a load does */
    bool floating;       /* needs the floating-point unit */
    uint8_t it;          /* condition and mask of an IT instruction */
    int32_t offset;      /* of the first access from the base */
} insn_t;

/* `second` is the following half-word, of use to 32-bit instructions alone. */
void insn_decode(insn_t *insn, uint16_t first, uint16_t second);

/* The one at the start of `left` bytes of code. */
void insn_decode_at(insn_t *insn, const uint8_t *code, uint32_t left);

static inline bool insn_is_wide(uint16_t first)
{
    return first >= 0xE800;
}

/* Address of the first access of a load or store at `pc`, with r0 to r15 as they are before it. */
uint32_t insn_address(const insn_t *insn, uint32_t pc, const uint32_t registers[16]);

#ifdef __cplusplus
}
#endif

#endif
