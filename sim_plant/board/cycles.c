#include "sim_plant/board/cycles.h"

#include <string.h>

#include "sim_plant/board/cpu_insn.h"

/* What the next instruction can follow on. */
typedef struct {
    bool memory;    /* the last one was a single load or store */
    uint8_t loaded; /* its target */
} pipeline_t;

static cycles_t all(uint32_t cycles)
{
    return (cycles_t){cycles, cycles, cycles};
}

static cycles_t plus(cycles_t a, cycles_t b)
{
    return (cycles_t){a.low + b.low, a.typical + b.typical, a.high + b.high};
}

static cycles_t of_load(const insn_t *insn, const pipeline_t *before)
{
    const bool waits =
        before->loaded != INSN_NO_REGISTER && (before->loaded == insn->base || before->loaded == insn->index);
    const bool follows = before->memory && !waits;
    return (cycles_t){before->memory ? 1 : 2, follows ? 1 : 2, 2};
}

static cycles_t of_access(const insn_t *insn, const pipeline_t *before)
{
    switch (insn->kind) {
    case INSN_LOAD:
        return of_load(insn, before);
    case INSN_STORE:
        return (cycles_t){1, insn->index != INSN_NO_REGISTER || insn->floating ? 2 : 1, 2};
    default:
        return all(1U + insn->count);
    }
}

static cycles_t of_instruction(const insn_t *insn, const pipeline_t *before)
{
    switch (insn->kind) {
    case INSN_LOAD:
    case INSN_STORE:
    case INSN_LOADS:
    case INSN_STORES: {
        const cycles_t cycles = of_access(insn, before);
        return insn->writes_pc ? plus(cycles, cycles_taken()) : cycles;
    }
    case INSN_BRANCH:
        return plus(all(1), cycles_taken());
    case INSN_TABLE_BRANCH:
        return plus(all(2), cycles_taken());
    case INSN_DIVIDE:
        return all(0);
    case INSN_IT:
        return (cycles_t){0, 1, 1};
    case INSN_BARRIER:
        return (cycles_t){1, 3, 6};
    case INSN_SPECIAL:
        return (cycles_t){1, 2, 2};
    case INSN_FLOAT_MAC:
        return all(3);
    case INSN_FLOAT_DIVIDE:
        return all(14);
    default:
        return all(1);
    }
}

void cycles_of_block(cycles_block_t *block, const uint8_t *code, uint32_t size)
{
    *block = (cycles_block_t){.instructions = 0};
    pipeline_t pipeline = {false, INSN_NO_REGISTER};
    for (uint32_t at = 0; at + 2 <= size;) {
        insn_t insn;
        insn_decode_at(&insn, code + at, size - at);
        block->cycles = plus(block->cycles, of_instruction(&insn, &pipeline));
        block->instructions++;
        block->divisions += insn.kind == INSN_DIVIDE ? 1 : 0;
        block->floating = block->floating || insn.floating;
        block->sends_event = block->sends_event || insn.kind == INSN_SEND_EVENT;
        block->ends_in_branch_if = insn.kind == INSN_BRANCH_IF;
        pipeline.memory = insn.kind == INSN_LOAD || insn.kind == INSN_STORE;
        pipeline.loaded = insn.target;
        at += insn.length;
    }
}

/* The manual says "2 to 12, by early termination" and no more; this is the common reading: four bits of the
 * quotient a cycle. */
uint32_t cycles_of_division(uint32_t numerator, uint32_t denominator, bool is_signed)
{
    const uint32_t n = is_signed && (int32_t)numerator < 0 ? 0U - numerator : numerator;
    const uint32_t d = is_signed && (int32_t)denominator < 0 ? 0U - denominator : denominator;
    if (d == 0 || n < d) {
        return 2;
    }
    const uint32_t bits = (uint32_t)(__builtin_clz(d) - __builtin_clz(n)) + 1U;
    const uint32_t cycles = 3U + (bits + 3U) / 4U;
    return cycles > 12U ? 12U : cycles;
}

void cycles_flash_reset(cycles_flash_t *flash, unsigned wait_states)
{
    memset(flash, 0, sizeof *flash);
    flash->wait_states = wait_states;
}

static unsigned line_of(cycles_flash_t *flash, uint32_t address)
{
    const uint32_t tag = address / CYCLES_LINE_BYTES + 1U;
    flash->clock++;
    if (flash->tag[flash->last] == tag) {
        flash->used[flash->last] = flash->clock;
        return flash->last;
    }
    unsigned oldest = 0;
    for (unsigned i = 0; i < CYCLES_LINES; i++) {
        if (flash->tag[i] == tag) {
            flash->used[i] = flash->clock;
            flash->last = i;
            return i;
        }
        if (flash->clock - flash->used[i] > flash->clock - flash->used[oldest]) {
            oldest = i;
        }
    }
    flash->tag[oldest] = tag;
    flash->valid[oldest] = 0;
    flash->used[oldest] = flash->clock;
    flash->last = oldest;
    return oldest;
}

cycles_t cycles_of_fetch(cycles_flash_t *flash, uint32_t address, uint32_t size)
{
    enum { WORD = 8, TYPICAL_WORD_CYCLES = 3 }; /* what the instructions of one word take */
    cycles_t cycles = {0, 0, 0};
    if (flash->wait_states == 0) {
        return cycles;
    }
    const uint32_t hidden =
        flash->wait_states + 1 < TYPICAL_WORD_CYCLES ? 0 : flash->wait_states + 1 - TYPICAL_WORD_CYCLES;
    const uint32_t start = address & ~(uint32_t)(WORD - 1);
    for (uint32_t at = start; at < address + size; at += WORD) {
        const unsigned line = line_of(flash, at);
        const uint8_t bit = (uint8_t)(1U << (at / WORD % 4U));
        if ((flash->valid[line] & bit) == 0) {
            cycles.typical += at == start ? flash->wait_states : hidden;
            flash->valid[line] |= bit;
        }
        cycles.high += flash->wait_states; /* as if nothing were cached */
    }
    return cycles;
}
