/* Everything outside memory: the ranges of addresses in which devices are. */
#include "sim_plant/board/cpu_state.h"

static uint64_t window_read(cpu_t *cpu, uint32_t address, unsigned size)
{
    uint32_t value = 0;
    if (cpu->failed || cpu->fault.pending) {
        return 0;
    }
    const bus_answer_t answer = bus_read(&cpu->bus, address, size, &value);
    if (answer != BUS_DONE && !cpu->failed) {
        uint32_t it;
        const cpu_device_t *device = bus_find(&cpu->bus, address);
        cpu_fail_at(cpu, cpu_access_pc(cpu, address, false, &it), "read of 0x%08x: %s %s", address,
                    device != NULL ? "not modelled in" : "no device",
                    device != NULL ? device->name : "there");
    }
    return value;
}

static void window_write(cpu_t *cpu, uint32_t address, unsigned size, uint32_t value)
{
    if (cpu->failed || cpu->fault.pending) {
        return;
    }
    const bus_answer_t answer = bus_write(&cpu->bus, address, size, value);
    if (answer != BUS_DONE && !cpu->failed) {
        uint32_t it;
        const cpu_device_t *device = bus_find(&cpu->bus, address);
        cpu_fail_at(cpu, cpu_access_pc(cpu, address, true, &it), "write of 0x%x to 0x%08x: %s %s", value,
                    address, device != NULL ? "not modelled in" : "no device",
                    device != NULL ? device->name : "there");
    }
}

static uint64_t read_peripheral(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    (void)uc;
    return window_read(user, UINT32_C(0x40000000) + (uint32_t)offset, size);
}

static void write_peripheral(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    (void)uc;
    window_write(user, UINT32_C(0x40000000) + (uint32_t)offset, size, (uint32_t)value);
}

static uint64_t read_private(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    (void)uc;
    return window_read(user, UINT32_C(0xE0000000) + (uint32_t)offset, size);
}

static void write_private(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    (void)uc;
    window_write(user, UINT32_C(0xE0000000) + (uint32_t)offset, size, (uint32_t)value);
}

bool cpu_open_windows(cpu_t *cpu)
{
    return uc_mmio_map(cpu->uc, 0x40000000, 0x20000000, read_peripheral, cpu, write_peripheral, cpu) ==
               UC_ERR_OK &&
           uc_mmio_map(cpu->uc, 0xE0000000, 0x00100000, read_private, cpu, write_private, cpu) == UC_ERR_OK;
}
