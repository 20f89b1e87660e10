#include "sim_plant/board/cpu_insn.h"

enum { SP = 13, PC = 15 };

static uint32_t field(uint32_t word, unsigned low, unsigned bits)
{
    return (word >> low) & ((1U << bits) - 1U);
}

static uint8_t bits_set(uint32_t word)
{
    return (uint8_t)__builtin_popcount(word);
}

static void access(insn_t *insn, bool load, unsigned size, unsigned base, int32_t offset, unsigned target)
{
    insn->kind = load ? INSN_LOAD : INSN_STORE;
    insn->size = (uint8_t)size;
    insn->count = 1;
    insn->base = (uint8_t)base;
    insn->offset = offset;
    insn->target = load ? (uint8_t)target : INSN_NO_REGISTER;
    insn->writes_pc = load && target == PC;
}

static void multiple(insn_t *insn, bool load, unsigned base, unsigned list, bool descending)
{
    insn->kind = load ? INSN_LOADS : INSN_STORES;
    insn->size = 4;
    insn->count = bits_set(list);
    insn->base = (uint8_t)base;
    insn->offset = descending ? -4 * insn->count : 0;
    insn->writes_pc = load && (list & 0x8000U) != 0;
}

/* 0101 to 1001: single loads and stores of the low registers. */
static void narrow_access(insn_t *insn, uint16_t w)
{
    static const uint8_t register_size[8] = {4, 2, 1, 1, 4, 2, 1, 2};
    const unsigned rt = field(w, 0, 3), rn = field(w, 3, 3);
    const unsigned immediate = field(w, 6, 5);
    const bool load = field(w, 11, 1) != 0;
    switch (w >> 12) {
    case 5: {
        const unsigned operation = field(w, 9, 3);
        access(insn, operation >= 3, register_size[operation], rn, 0, rt);
        insn->index = (uint8_t)field(w, 6, 3);
        break;
    }
    case 6:
        access(insn, load, 4, rn, (int32_t)(4 * immediate), rt);
        break;
    case 7:
        access(insn, load, 1, rn, (int32_t)immediate, rt);
        break;
    case 8:
        access(insn, load, 2, rn, (int32_t)(2 * immediate), rt);
        break;
    default:
        access(insn, load, 4, SP, (int32_t)(4 * field(w, 0, 8)), field(w, 8, 3));
        break;
    }
}

static void hint(insn_t *insn, unsigned number)
{
    static const insn_kind_t kinds[5] = {INSN_ALU, INSN_ALU, INSN_WAIT_EVENT, INSN_WAIT_INTERRUPT,
                                         INSN_SEND_EVENT};
    insn->kind = number < 5 ? kinds[number] : INSN_ALU;
}

/* 1011: stack, IT, CBZ and others. */
static void narrow_miscellaneous(insn_t *insn, uint16_t w)
{
    if ((w & 0xF500U) == 0xB100U) {
        insn->kind = INSN_BRANCH_IF;
    } else if ((w & 0xFE00U) == 0xB400U) {
        multiple(insn, false, SP, w & 0x1FFU, true);
    } else if ((w & 0xFE00U) == 0xBC00U) {
        multiple(insn, true, SP, field(w, 0, 8) | (field(w, 8, 1) << 15), false);
    } else if ((w & 0xFFE8U) == 0xB660U) {
        insn->kind = INSN_SPECIAL;
    } else if ((w & 0xFF00U) == 0xBF00U) {
        if ((w & 0xFU) != 0) {
            insn->kind = INSN_IT;
            insn->it = (uint8_t)w;
        } else {
            hint(insn, field(w, 4, 4));
        }
    }
}

static void decode_narrow(insn_t *insn, uint16_t w)
{
    switch (w >> 12) {
    case 4:
        if ((w & 0xF800U) == 0x4800U) {
            access(insn, true, 4, PC, (int32_t)(4 * field(w, 0, 8)), field(w, 8, 3));
        } else if ((w & 0xFF00U) == 0x4700U || (w & 0xFD87U) == 0x4487U) { /* BX, BLX; ADD or MOV to the PC */
            insn->kind = INSN_BRANCH;
        }
        break;
    case 5:
    case 6:
    case 7:
    case 8:
    case 9:
        narrow_access(insn, w);
        break;
    case 0xB:
        narrow_miscellaneous(insn, w);
        break;
    case 0xC:
        multiple(insn, field(w, 11, 1) != 0, field(w, 8, 3), w & 0xFFU, false);
        break;
    case 0xD:
        if (field(w, 8, 4) < 14) {
            insn->kind = INSN_BRANCH_IF;
        }
        break;
    case 0xE:
        insn->kind = INSN_BRANCH;
        break;
    default:
        break;
    }
}

/* 1110 100x x1: dual, exclusive and table branch. */
static void wide_dual(insn_t *insn, uint16_t w, uint16_t v)
{
    const unsigned rn = field(w, 0, 4);
    const bool load = field(w, 4, 1) != 0;
    const int32_t immediate = (int32_t)(4 * field(v, 0, 8));
    const unsigned rt = v >> 12;
    if ((w & 0xFFE0U) == 0xE840U) {
        access(insn, load, 4, rn, immediate, rt);
    } else if ((w & 0xFFE0U) == 0xE8C0U && field(v, 5, 3) == 0) {
        insn->kind = INSN_TABLE_BRANCH;
    } else if ((w & 0xFFE0U) == 0xE8C0U) {
        access(insn, load, field(v, 4, 1) != 0 ? 2 : 1, rn, 0, rt);
    } else {
        const bool up = field(w, 7, 1) != 0, before = field(w, 8, 1) != 0;
        insn->kind = load ? INSN_LOADS : INSN_STORES;
        insn->size = 4;
        insn->count = 2;
        insn->base = (uint8_t)rn;
        insn->offset = !before ? 0 : up ? immediate : -immediate;
    }
}

/* 1111 100x: single loads and stores. */
static void wide_access(insn_t *insn, uint16_t w, uint16_t v)
{
    const unsigned rn = field(w, 0, 4), rt = v >> 12;
    const unsigned size = 1U << field(w, 5, 2);
    const bool load = field(w, 4, 1) != 0, up = field(w, 7, 1) != 0;
    if (load && rt == PC && size != 4) {
        return; /* PLD, PLI: hints */
    }
    if (rn == PC) {
        const int32_t immediate = (int32_t)field(v, 0, 12);
        access(insn, load, size, rn, up ? immediate : -immediate, rt);
    } else if (up) {
        access(insn, load, size, rn, (int32_t)field(v, 0, 12), rt);
    } else if ((v & 0x0800U) != 0) {
        const int32_t immediate = (int32_t)field(v, 0, 8);
        const bool before = field(v, 10, 1) != 0, add = field(v, 9, 1) != 0;
        access(insn, load, size, rn, !before ? 0 : add ? immediate : -immediate, rt);
    } else {
        access(insn, load, size, rn, 0, rt);
        insn->index = (uint8_t)field(v, 0, 4);
        insn->shift = (uint8_t)field(v, 4, 2);
    }
}

/* x110 110x: loads and stores of the floating-point registers. */
static void float_access(insn_t *insn, uint16_t w, uint16_t v)
{
    const bool load = field(w, 4, 1) != 0, up = field(w, 7, 1) != 0, before = field(w, 8, 1) != 0;
    const bool write_back = field(w, 5, 1) != 0;
    const int32_t immediate = (int32_t)(4 * field(v, 0, 8));
    insn->base = (uint8_t)field(w, 0, 4);
    insn->size = 4;
    if (before && !write_back) {
        insn->count = field(v, 8, 1) != 0 ? 2 : 1;
        insn->kind = insn->count == 1 ? (load ? INSN_LOAD : INSN_STORE) : (load ? INSN_LOADS : INSN_STORES);
        insn->offset = up ? immediate : -immediate;
    } else {
        insn->kind = load ? INSN_LOADS : INSN_STORES;
        insn->count = (uint8_t)field(v, 0, 8);
        insn->offset = before ? -immediate : 0;
    }
}

static void coprocessor(insn_t *insn, uint16_t w, uint16_t v)
{
    if (field(v, 9, 3) != 5) { /* coprocessors 10 and 11 are the floating-point unit; there is no other */
        return;
    }
    insn->floating = true;
    insn->kind = INSN_FLOAT;
    if ((w & 0x0200U) == 0) {
        if ((w & 0x01E0U) != 0x0040U) { /* that is VMOV of two registers */
            float_access(insn, w, v);
        }
        return;
    }
    if ((w & 0x0100U) != 0 || (v & 0x0010U) != 0) {
        return; /* moves between register files */
    }
    switch (field(w, 4, 4) & 0xBU) {
    case 0:
    case 1:
    case 9:
    case 10:
        insn->kind = INSN_FLOAT_MAC;
        break;
    case 8:
        insn->kind = INSN_FLOAT_DIVIDE;
        break;
    case 11:
        if ((w & 0xFU) == 1 && (v & 0xC0U) == 0xC0U) { /* VSQRT */
            insn->kind = INSN_FLOAT_DIVIDE;
        }
        break;
    default:
        break;
    }
}

/* 1111 0, second half 1...: branches and control. */
static void wide_control(insn_t *insn, uint16_t w, uint16_t v)
{
    if ((v & 0x5000U) != 0) {
        insn->kind = INSN_BRANCH;
    } else if ((w & 0x0380U) != 0x0380U) {
        insn->kind = INSN_BRANCH_IF;
    } else if ((w & 0xFFE0U) == 0xF380U || (w & 0xFFE0U) == 0xF3E0U) {
        insn->kind = INSN_SPECIAL;
    } else if ((w & 0xFFF0U) == 0xF3A0U && (v & 0x0700U) == 0) {
        hint(insn, v & 0xFFU);
    } else if ((w & 0xFFF0U) == 0xF3B0U) {
        insn->kind = INSN_BARRIER;
    }
}

static void decode_wide(insn_t *insn, uint16_t w, uint16_t v)
{
    if ((w & 0xEC00U) == 0xEC00U) {
        coprocessor(insn, w, v);
    } else if ((w & 0xFE40U) == 0xE800U) {
        multiple(insn, field(w, 4, 1) != 0, field(w, 0, 4), v, field(w, 8, 1) != 0);
    } else if ((w & 0xFE40U) == 0xE840U) {
        wide_dual(insn, w, v);
    } else if ((w & 0xF800U) == 0xF000U) {
        if ((v & 0x8000U) != 0) {
            wide_control(insn, w, v);
        }
    } else if ((w & 0xFE00U) == 0xF800U) {
        wide_access(insn, w, v);
    } else if (((w & 0xFFF0U) == 0xFB90U || (w & 0xFFF0U) == 0xFBB0U) && (v & 0xF0U) == 0xF0U) {
        insn->kind = INSN_DIVIDE;
        insn->is_signed = (w & 0x0020U) == 0;
        insn->numerator = (uint8_t)field(w, 0, 4);
        insn->denominator = (uint8_t)field(v, 0, 4);
    }
}

void insn_decode(insn_t *insn, uint16_t first, uint16_t second)
{
    *insn = (insn_t){.kind = INSN_ALU,
                     .length = 2,
                     .base = INSN_NO_REGISTER,
                     .index = INSN_NO_REGISTER,
                     .target = INSN_NO_REGISTER};
    if (insn_is_wide(first)) {
        insn->length = 4;
        decode_wide(insn, first, second);
    } else {
        decode_narrow(insn, first);
    }
}

static uint16_t half_word(const uint8_t *code)
{
    return (uint16_t)((unsigned)code[0] | (unsigned)code[1] << 8);
}

void insn_decode_at(insn_t *insn, const uint8_t *code, uint32_t left)
{
    insn_decode(insn, half_word(code), left >= 4 ? half_word(code + 2) : 0);
}

uint32_t insn_address(const insn_t *insn, uint32_t pc, const uint32_t registers[16])
{
    uint32_t address = insn->base == PC ? (pc + 4) & ~3U : registers[insn->base & 15];
    if (insn->index != INSN_NO_REGISTER) {
        address += registers[insn->index & 15] << insn->shift;
    }
    return address + (uint32_t)insn->offset;
}
