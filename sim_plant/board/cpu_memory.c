#include "sim_plant/board/cpu_state.h"

#include <stdlib.h>
#include <string.h>

cpu_region_t *cpu_region_of(cpu_t *cpu, uint32_t address)
{
    for (unsigned i = 0; i < cpu->regions; i++) {
        if (address - cpu->region[i].is.base < cpu->region[i].is.size) {
            return &cpu->region[i];
        }
    }
    return NULL;
}

uint8_t *cpu_memory(cpu_t *cpu, uint32_t address, uint32_t size)
{
    cpu_region_t *region = cpu_region_of(cpu, address);
    const bool inside = region != NULL && size <= region->is.size - (address - region->is.base);
    return inside ? region->host + (address - region->is.base) : NULL;
}

bool cpu_load(cpu_t *cpu, uint32_t address, uint32_t *value)
{
    const uint8_t *place = cpu_memory(cpu, address, 4);
    if (place == NULL) {
        return false;
    }
    const cpu_region_t *original = cpu_region_of(cpu, address)->original;
    if (original->stalled_until > cpu->total.typical) {
        cpu->wait_until = original->stalled_until;
    }
    memcpy(value, place, 4);
    return true;
}

bool cpu_store(cpu_t *cpu, uint32_t address, uint32_t value)
{
    uint8_t *place = cpu_memory(cpu, address, 4);
    if (place == NULL || !cpu_region_of(cpu, address)->is.writable) {
        return false;
    }
    memcpy(place, &value, 4);
    return true;
}

static uint32_t permissions_of(const cpu_t *cpu, const cpu_region_t *region, uint32_t page)
{
    uint32_t permissions = UC_PROT_EXEC;
    if (region->original->stalled_until > cpu->total.typical) {
        return permissions; /* a load has to wait */
    }
    if (!mpu_is_open(&cpu->mpu, page, CPU_PAGE)) {
        /* Code and constants are most often closed to writes alone, and a trap for each load would cost much.
         */
        bool readable = true;
        for (uint32_t at = 0; at < CPU_PAGE; at += MPU_FINEST) {
            readable = readable && mpu_allows(&cpu->mpu, page + at, MPU_READ, false);
        }
        return readable ? permissions | UC_PROT_READ : permissions;
    }
    return permissions | UC_PROT_READ | (region->is.writable ? UC_PROT_WRITE : 0U);
}

static bool same_runs(const cpu_region_t *a, const cpu_region_t *b)
{
    return a->runs == b->runs && memcmp(a->run, b->run, a->runs * sizeof a->run[0]) == 0;
}

static void find_runs(const cpu_t *cpu, cpu_region_t *region)
{
    region->runs = 0;
    for (uint32_t at = 0; at < region->is.size; at += CPU_PAGE) {
        const uint32_t permissions = permissions_of(cpu, region, region->is.base + at);
        if (region->runs > 0 && region->run[region->runs - 1].permissions == permissions) {
            region->run[region->runs - 1].size += CPU_PAGE;
        } else if (region->runs < CPU_RUNS) {
            region->run[region->runs].base = region->is.base + at;
            region->run[region->runs].size = CPU_PAGE;
            region->run[region->runs].permissions = permissions;
            region->runs++;
        }
    }
}

void cpu_map(cpu_t *cpu, cpu_region_t *region)
{
    cpu_region_t fresh = *region;
    find_runs(cpu, &fresh);
    if (same_runs(&fresh, region)) {
        return;
    }
    uc_err error = UC_ERR_OK;
    for (unsigned i = 0; i < region->runs && error == UC_ERR_OK; i++) {
        error = uc_mem_unmap(cpu->uc, region->run[i].base, region->run[i].size);
    }
    for (unsigned i = 0; i < fresh.runs && error == UC_ERR_OK; i++) {
        error = uc_mem_map_ptr(cpu->uc, fresh.run[i].base, fresh.run[i].size, fresh.run[i].permissions,
                               region->host + (fresh.run[i].base - region->is.base));
    }
    if (error != UC_ERR_OK) {
        cpu_fail(cpu, "memory %s cannot be mapped: %s", region->is.name, uc_strerror(error));
    }
    *region = fresh;
}

/* Mapping anew makes unicorn forget which pages it has found open. */
void cpu_close_again(cpu_t *cpu)
{
    for (unsigned i = 0; i < cpu->regions; i++) {
        const cpu_region_t *region = &cpu->region[i];
        for (unsigned k = 0; k < region->runs; k++) {
            if ((region->run[k].permissions & UC_PROT_READ) == 0) {
                (void)uc_mem_unmap(cpu->uc, region->run[k].base, region->run[k].size);
                (void)uc_mem_map_ptr(cpu->uc, region->run[k].base, region->run[k].size,
                                     region->run[k].permissions,
                                     region->host + (region->run[k].base - region->is.base));
            }
        }
    }
    cpu->close_again = false;
}

/* Whole runs as they were mapped: for a part of one unicorn would make copies of its own. */
void cpu_forbid(cpu_t *cpu, uint32_t address, bool forbidden)
{
    const cpu_region_t *region = cpu_region_of(cpu, address);
    for (unsigned k = 0; region != NULL && k < region->runs; k++) {
        if (address - region->run[k].base < region->run[k].size) {
            (void)uc_mem_protect(cpu->uc, region->run[k].base, region->run[k].size,
                                 forbidden ? UC_PROT_NONE : region->run[k].permissions);
        }
    }
}

void cpu_map_all(cpu_t *cpu)
{
    for (unsigned i = 0; i < cpu->regions; i++) {
        cpu_map(cpu, &cpu->region[i]);
    }
    cpu_block_all_need_attention(cpu);
    cpu->remap = false;
}

void cpu_add_memory(cpu_t *cpu, const cpu_memory_t *memory)
{
    if (cpu->regions == CPU_MEMORIES || memory->size % CPU_PAGE != 0 || memory->base % CPU_PAGE != 0) {
        cpu_fail(cpu, "memory %s does not fit", memory->name);
        return;
    }
    cpu_region_t *region = &cpu->region[cpu->regions];
    *region = (cpu_region_t){.is = *memory, .original = region};
    if (memory->alias_of != 0) {
        region->original = cpu_region_of(cpu, memory->alias_of);
        if (region->original == NULL || region->original->is.size < memory->size) {
            cpu_fail(cpu, "memory %s is an alias of nothing", memory->name);
            return;
        }
        region->host = region->original->host;
    } else {
        region->host = aligned_alloc(4096, (memory->size + 4095U) & ~4095U);
        if (region->host != NULL) {
            memset(region->host, memory->writable ? 0 : 0xFF, memory->size);
        }
    }
    region->block = calloc(memory->size / 2, sizeof region->block[0]);
    region->holds_code = calloc(memory->size / CPU_PAGE, sizeof region->holds_code[0]);
    if (region->host == NULL || region->block == NULL || region->holds_code == NULL) {
        cpu_fail(cpu, "no memory on the host for %s", memory->name);
        return;
    }
    cpu->regions++;
    cpu_map(cpu, region);
}

void cpu_free_memory(cpu_t *cpu)
{
    for (unsigned i = 0; i < cpu->regions; i++) {
        cpu_free_blocks(&cpu->region[i]);
        free(cpu->region[i].holds_code);
        if (cpu->region[i].original == &cpu->region[i]) {
            free(cpu->region[i].host);
        }
    }
}

void cpu_set_wait_states(cpu_t *cpu, uint32_t base, unsigned wait_states)
{
    cpu_region_t *region = cpu_region_of(cpu, base);
    if (region != NULL) {
        cycles_flash_reset(&region->fetch, wait_states);
    }
}

void cpu_retranslate(cpu_t *cpu, uint32_t address, uint32_t size)
{
    (void)uc_ctl_remove_cache(cpu->uc, (uint64_t)address, (uint64_t)address + size);
}

void cpu_code_changed(cpu_t *cpu, uint32_t address, uint32_t size)
{
    cpu_region_t *changed = cpu_region_of(cpu, address);
    for (unsigned i = 0; changed != NULL && i < cpu->regions; i++) {
        cpu_region_t *region = &cpu->region[i];
        if (region->original == changed->original) {
            const uint32_t there = region->is.base + (address - changed->is.base);
            cpu_forget_blocks(cpu, there, size);
            cpu_retranslate(cpu, there, size);
            cycles_flash_reset(&region->fetch, region->fetch.wait_states);
        }
    }
}

void cpu_stall(cpu_t *cpu, uint32_t base, uint64_t until_cycle)
{
    cpu_region_t *region = cpu_region_of(cpu, base);
    if (region != NULL) {
        region->original->stalled_until = until_cycle;
        cpu->remap = true;
        cpu->want_stop = true;
    }
}

/* unicorn has written the flash; now it is as it was, and the device hears of it. */
void cpu_flush_flash_writes(cpu_t *cpu)
{
    for (unsigned i = cpu->flash_writes; i > 0; i--) {
        const cpu_flash_write_t *write = &cpu->flash_write[i - 1];
        memcpy(cpu_memory(cpu, write->address, write->size), &write->old, write->size);
    }
    const unsigned count = cpu->flash_writes;
    cpu->flash_writes = 0;
    for (unsigned i = 0; i < count; i++) {
        const cpu_flash_write_t *write = &cpu->flash_write[i];
        if (bus_write(&cpu->bus, write->address, write->size, write->value) != BUS_DONE && !cpu->failed) {
            cpu_fail(cpu, "write of 0x%x to 0x%08x is refused", write->value, write->address);
        }
    }
}

static bool load_part(void *context, uint32_t address, const uint8_t *data, uint32_t size)
{
    uint8_t *place = cpu_memory(context, address, size);
    if (place != NULL) {
        memcpy(place, data, size);
    }
    return place != NULL;
}

bool cpu_load_image(cpu_t *cpu, const elf_image_t *image)
{
    return elf_image_load(image, cpu, load_part);
}
