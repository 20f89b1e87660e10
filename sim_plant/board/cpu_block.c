#include "sim_plant/board/cpu_state.h"

#include <assert.h>
#include <stdlib.h>

static cpu_block_t *make(cpu_t *cpu, cpu_region_t *region, uint32_t address, uint32_t size)
{
    const uint32_t at = address - region->is.base;
    cpu_block_t *block = region->block[at / 2].at;
    if (block == NULL) {
        static_assert(sizeof *block == CPU_LINE, "one line");
        block = aligned_alloc(CPU_LINE, sizeof *block);
        if (block == NULL) {
            return NULL;
        }
        *block = (cpu_block_t){.hits = 0};
        region->block[at / 2].at = block;
    }
    cpu_stores_meet_code(cpu, region, at / CPU_PAGE, (at + size - 1) / CPU_PAGE);
    /* The same start with another length: the newest counts, its hits go on. */
    block->address = address;
    block->size = size;
    block->region = region;
    block->attention = true;
    cycles_of_block(&block->cost, region->host + at, size);
    return block;
}

cpu_block_t *cpu_block_at(cpu_t *cpu, uint32_t address, uint32_t size)
{
    cpu_block_t *guess = cpu->block != NULL ? cpu->block->after : NULL;
    if (guess != NULL && guess->address == address && guess->size == size) {
        return guess;
    }
    cpu_region_t *region = cpu->executes_from;
    if (region == NULL || address - region->is.base >= region->is.size) {
        region = cpu_region_of(cpu, address);
        cpu->executes_from = region;
    }
    if (region == NULL || address - region->is.base + size > region->is.size) {
        return NULL;
    }
    cpu_block_t *block = region->block[(address - region->is.base) / 2].at;
    return block != NULL && block->size == size ? block : make(cpu, region, address, size);
}

/* Calls `act` for every block there is. */
static void for_all(const cpu_t *cpu, void (*act)(cpu_block_t *block))
{
    for (unsigned i = 0; i < cpu->regions; i++) {
        const cpu_region_t *region = &cpu->region[i];
        for (uint32_t k = 0; k < region->is.size / 2; k++) {
            if (region->block[k].at != NULL) {
                act(region->block[k].at);
            }
        }
    }
}

static void needs_attention(cpu_block_t *block)
{
    block->attention = true;
}

void cpu_block_all_need_attention(cpu_t *cpu)
{
    for_all(cpu, needs_attention);
}

void cpu_free_blocks(cpu_region_t *region)
{
    for (uint32_t k = 0; k < region->is.size / 2; k++) {
        free(region->block[k].at);
    }
    free(region->block);
}

void cpu_forget_blocks(cpu_t *cpu, uint32_t address, uint32_t size)
{
    for (unsigned i = 0; i < cpu->regions; i++) {
        cpu_region_t *region = &cpu->region[i];
        for (uint32_t k = 0; k < region->is.size / 2; k++) {
            cpu_block_t *block = region->block[k].at;
            if (block != NULL && block->address < address + size && address < block->address + block->size) {
                block->size = 0; /* decoded anew when it is next executed; its hits stay */
            }
        }
    }
}

void cpu_visit_blocks(const cpu_t *cpu, cpu_block_visitor_t visit, void *context)
{
    for (unsigned i = 0; i < cpu->regions; i++) {
        const cpu_region_t *region = &cpu->region[i];
        for (uint32_t k = 0; k < region->is.size / 2; k++) {
            const cpu_block_t *block = region->block[k].at;
            if (block != NULL && block->hits != 0) {
                visit(context, block->address, block->size, block->cost.instructions, block->hits);
            }
        }
    }
}

void cpu_watch(cpu_t *cpu, uint32_t address, void *owner, cpu_watch_t watch)
{
    address &= ~1U;
    unsigned i = 0;
    while (i < cpu->watches && cpu->watch[i].address != address) {
        i++;
    }
    if (watch == NULL) {
        if (i < cpu->watches) {
            cpu->watches--;
            cpu->watch[i] = cpu->watch[cpu->watches];
        }
        return;
    }
    if (i == CPU_WATCHES) {
        cpu_fail(cpu, "more than %d watched addresses", CPU_WATCHES);
        return;
    }
    cpu->watch[i] = (cpu_watch_entry_t){address, owner, watch};
    cpu->watches = i == cpu->watches ? i + 1 : cpu->watches;
    cpu_region_t *region = cpu_region_of(cpu, address);
    if (region != NULL && region->block[(address - region->is.base) / 2].at != NULL) {
        region->block[(address - region->is.base) / 2].at->attention = true;
    }
}
