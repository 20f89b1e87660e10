#include "sim_plant/board/cpu_mpu.h"

enum {
    ENABLE = 1,
    HFNMIENA = 2,
    PRIVDEFENA = 4,
    TYPE = 0x00,
    CTRL = 0x04,
    RNR = 0x08,
    RBAR = 0x0C, /* and RASR; three aliases of the pair follow */
    LAST = 0x28,
};

#define EXECUTE_NEVER UINT32_C(0x10000000)

bool mpu_read(const mpu_t *mpu, uint32_t offset, uint32_t *value)
{
    switch (offset) {
    case TYPE:
        *value = (uint32_t)MPU_REGIONS << 8;
        return true;
    case CTRL:
        *value = mpu->control;
        return true;
    case RNR:
        *value = mpu->region;
        return true;
    default:
        break;
    }
    if (offset < RBAR || offset > LAST) {
        return false;
    }
    *value = (offset - RBAR) % 8 == 0 ? mpu->base[mpu->region] | mpu->region : mpu->attributes[mpu->region];
    return true;
}

bool mpu_write(mpu_t *mpu, uint32_t offset, uint32_t value)
{
    if (offset == CTRL) {
        mpu->control = value & 7U;
        return true;
    }
    if (offset == RNR) {
        mpu->region = value % MPU_REGIONS;
        return true;
    }
    if (offset < RBAR || offset > LAST) {
        return false;
    }
    if ((offset - RBAR) % 8 != 0) {
        mpu->attributes[mpu->region] = value;
    } else {
        if ((value & 0x10U) != 0) { /* VALID: the number comes along */
            mpu->region = value % MPU_REGIONS;
        }
        mpu->base[mpu->region] = value & ~0x1FU;
    }
    return true;
}

static bool region_covers(const mpu_t *mpu, int region, uint32_t address)
{
    const uint32_t attributes = mpu->attributes[region];
    const unsigned size_bits = ((attributes >> 1) & 0x1FU) + 1U;
    if ((attributes & ENABLE) == 0 || size_bits < 5) {
        return false;
    }
    if (size_bits == 32) {
        return true;
    }
    const uint32_t offset = address - (mpu->base[region] & ~((UINT32_C(1) << size_bits) - 1U));
    if (offset >> size_bits != 0) {
        return false;
    }
    const unsigned part = size_bits >= 8 ? (offset >> (size_bits - 3)) & 7U : 0U;
    return size_bits < 8 || ((attributes >> (8U + part)) & 1U) == 0; /* sub-region disabled */
}

/* The background map: peripherals, devices and the system are never executable. */
static bool background_allows(uint32_t address, mpu_access_t access)
{
    const uint32_t part = address >> 29;
    return access != MPU_EXECUTE || (part != 2 && part < 5);
}

static bool region_allows(uint32_t attributes, mpu_access_t access)
{
    const uint32_t permission = (attributes >> 24) & 7U;
    const bool write = permission >= 1 && permission <= 3;
    const bool read = write || permission >= 5;
    switch (access) {
    case MPU_READ:
        return read;
    case MPU_WRITE:
        return write;
    default:
        return read && (attributes & EXECUTE_NEVER) == 0;
    }
}

bool mpu_allows(const mpu_t *mpu, uint32_t address, mpu_access_t access, bool urgent)
{
    const bool off = (mpu->control & ENABLE) == 0 || (urgent && (mpu->control & HFNMIENA) == 0);
    if (off || address >= UINT32_C(0xE0000000)) { /* the system space keeps its own rules */
        return background_allows(address, access);
    }
    for (int region = MPU_REGIONS - 1; region >= 0; region--) {
        if (region_covers(mpu, region, address)) {
            return region_allows(mpu->attributes[region], access) &&
                   (access != MPU_EXECUTE || background_allows(address, access));
        }
    }
    return (mpu->control & PRIVDEFENA) != 0 && background_allows(address, access);
}

bool mpu_is_open(const mpu_t *mpu, uint32_t address, uint32_t size)
{
    if ((mpu->control & ENABLE) == 0) {
        return true;
    }
    for (uint32_t at = 0; at < size; at += MPU_FINEST) {
        if (!mpu_allows(mpu, address + at, MPU_READ, false) ||
            !mpu_allows(mpu, address + at, MPU_WRITE, false)) {
            return false;
        }
    }
    return true;
}
