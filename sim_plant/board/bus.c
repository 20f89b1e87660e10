#include "sim_plant/board/bus.h"

static bool covers(const cpu_device_t *device, uint32_t address)
{
    return address - device->base < device->size;
}

bool bus_add(bus_t *bus, const cpu_device_t *device)
{
    if (bus->count == BUS_DEVICES || device->size == 0) {
        return false;
    }
    for (unsigned i = 0; i < bus->count; i++) {
        if (covers(&bus->device[i], device->base) || covers(device, bus->device[i].base)) {
            return false;
        }
    }
    bus->device[bus->count] = *device;
    bus->count++;
    return true;
}

const cpu_device_t *bus_find(bus_t *bus, uint32_t address)
{
    if (bus->last < bus->count && covers(&bus->device[bus->last], address)) {
        return &bus->device[bus->last];
    }
    for (unsigned i = 0; i < bus->count; i++) {
        if (covers(&bus->device[i], address)) {
            bus->last = i;
            return &bus->device[i];
        }
    }
    return NULL;
}

/* Bits of the word that an access of `size` bytes at `address` touches. */
static uint32_t mask_of(uint32_t address, unsigned size)
{
    const uint32_t low = size >= 4 ? UINT32_MAX : (UINT32_C(1) << (8 * size)) - 1;
    return low << (8 * (address & 3));
}

bus_answer_t bus_read(bus_t *bus, uint32_t address, unsigned size, uint32_t *value)
{
    const cpu_device_t *device = bus_find(bus, address);
    *value = 0;
    if (device == NULL) {
        return BUS_NO_DEVICE;
    }
    uint32_t word = 0;
    if (device->read == NULL || !device->read(device->self, (address - device->base) & ~3U, &word)) {
        return BUS_NO_REGISTER;
    }
    *value = (word & mask_of(address, size)) >> (8 * (address & 3));
    return BUS_DONE;
}

bus_answer_t bus_write(bus_t *bus, uint32_t address, unsigned size, uint32_t value)
{
    const cpu_device_t *device = bus_find(bus, address);
    if (device == NULL) {
        return BUS_NO_DEVICE;
    }
    const bool taken =
        device->write != NULL && device->write(device->self, (address - device->base) & ~3U,
                                               value << (8 * (address & 3)), mask_of(address, size));
    return taken ? BUS_DONE : BUS_NO_REGISTER;
}
