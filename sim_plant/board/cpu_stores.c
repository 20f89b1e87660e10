/* Stores at full speed. libunicorn 2.0.1 takes every store as one that may change translated code, some 0.1
 * us each, because it keeps no record of pages without code. We do, by the blocks that were executed, and
 * tell it page by page as it opens them.
 *
 * For that, two functions within libunicorn are put to use by their names: the dynamic linker gives it our
 * tlb_set_page_with_attrs_arm() in place of its own, which is then called from here. A library that does not
 * let this happen, by its version or by how it was built, works as before, slowly. */
#define _GNU_SOURCE /* RTLD_NEXT */
#include "sim_plant/board/cpu_state.h"

#include <dlfcn.h>
#include <stddef.h>
#include <string.h>

/* Its types are of no matter here: a struct of one word as the attributes, the rest as told. */
typedef void (*set_page_t)(void *engine, uint32_t page, uint64_t physical, uint32_t attributes, int rights,
                           int mode, uint32_t size);
typedef void (*set_dirty_t)(void *engine, uint32_t page);                  /* stores need no care */
typedef void (*reset_dirty_t)(void *engine, uint64_t host, uint64_t size); /* they do */

static _Thread_local cpu_t *present; /* the one that executes in this thread */

__attribute__((visibility("default"))) void tlb_set_page_with_attrs_arm(void *engine, uint32_t page,
                                                                        uint64_t physical,
                                                                        uint32_t attributes, int rights,
                                                                        int mode, uint32_t size);

/* ISO C lets no cast make a function of a void *. */
static void find(const char *name, void *function)
{
    void *found = dlsym(RTLD_NEXT, name);
    memcpy(function, &found, sizeof found);
}

void cpu_stores_begin(cpu_t *cpu)
{
    present = cpu;
}

void cpu_stores_end(void)
{
    present = NULL;
}

void tlb_set_page_with_attrs_arm(void *engine, uint32_t page, uint64_t physical, uint32_t attributes,
                                 int rights, int mode, uint32_t size)
{
    static _Thread_local set_page_t set_page;
    static _Thread_local set_dirty_t set_dirty;
    if (set_page == NULL) {
        find("tlb_set_page_with_attrs_arm", &set_page);
        find("tlb_set_dirty_arm", &set_dirty);
    }
    set_page(engine, page, physical, attributes, rights, mode, size);
    if (present == NULL || set_dirty == NULL) {
        return;
    }
    const cpu_region_t *region = cpu_region_of(present, page);
    if (region != NULL && region->is.writable && !region->holds_code[(page - region->is.base) / CPU_PAGE]) {
        present->engine = engine;
        set_dirty(engine, page & ~(uint32_t)(CPU_PAGE - 1));
    }
}

void cpu_stores_meet_code(cpu_t *cpu, cpu_region_t *region, uint32_t first, uint32_t last)
{
    for (uint32_t page = first; page <= last; page++) {
        if (!region->holds_code[page]) {
            region->holds_code[page] = true;
            reset_dirty_t reset_dirty;
            find("tlb_reset_dirty_arm", &reset_dirty);
            if (cpu->engine != NULL && reset_dirty != NULL) {
                reset_dirty(cpu->engine, (uintptr_t)&region->host[page * CPU_PAGE], CPU_PAGE);
            }
        }
    }
}
