#include "sim_plant/board/board_registers.h"

#include <assert.h>
#include <stddef.h>

void board_registers_init(board_registers_t *r, cpu_t *cpu, const char *name, const board_register_t *list,
                          int count)
{
    *r = (board_registers_t){.cpu = cpu, .name = name, .list = list, .count = count};
    board_registers_reset(r);
}

void board_registers_reset(board_registers_t *r)
{
    for (int n = 0; n < r->count; n++) {
        assert(r->list[n].offset / 4 < BOARD_REGISTERS_MOST);
        r->value[r->list[n].offset / 4] = r->list[n].reset;
    }
}

static const board_register_t *find(const board_registers_t *r, uint32_t offset)
{
    for (int n = 0; n < r->count; n++) {
        if (r->list[n].offset == offset) {
            return &r->list[n];
        }
    }
    return NULL;
}

bool board_registers_read(const board_registers_t *r, uint32_t offset, uint32_t *value)
{
    if (!find(r, offset)) {
        cpu_fail(r->cpu, "%s: read of offset 0x%02x, which is not modelled", r->name, (unsigned)offset);
        return false;
    }
    *value = r->value[offset / 4];
    return true;
}

bool board_registers_write(board_registers_t *r, uint32_t offset, uint32_t value, uint32_t mask)
{
    const board_register_t *entry = find(r, offset);
    if (!entry) {
        cpu_fail(r->cpu, "%s: write of 0x%08x to offset 0x%02x, which is not modelled", r->name,
                 (unsigned)value, (unsigned)offset);
        return false;
    }
    uint32_t whole = (r->value[offset / 4] & ~mask) | (value & mask);
    whole = (whole & ~entry->hardware) | (r->value[offset / 4] & entry->hardware);
    uint32_t strange = (whole ^ entry->reset) & ~(entry->modelled | entry->hardware);
    if (strange != 0u) {
        cpu_fail(r->cpu, "%s_%s: write of 0x%08x: bits 0x%08x are not modelled", r->name, entry->name,
                 (unsigned)value, (unsigned)strange);
        return false;
    }
    r->value[offset / 4] = whole;
    return true;
}
