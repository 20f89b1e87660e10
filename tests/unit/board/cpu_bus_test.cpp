#include "sim_plant/board/bus.h"

#include <gtest/gtest.h>

namespace
{

struct Registers {
    uint32_t word = 0x44332211, mask = 0, offset = 0;
};

bool read_word(void *self, uint32_t offset, uint32_t *value)
{
    auto *registers = static_cast<Registers *>(self);
    registers->offset = offset;
    *value = registers->word;
    return offset < 8;
}

bool write_word(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    auto *registers = static_cast<Registers *>(self);
    registers->offset = offset;
    registers->mask = mask;
    registers->word = (registers->word & ~mask) | (value & mask);
    return offset < 8;
}

struct Bus : ::testing::Test {
    bus_t bus{};
    Registers first, second;

    void SetUp() override
    {
        ASSERT_TRUE(add("first", 0x40000000, &first));
        ASSERT_TRUE(add("second", 0x40000400, &second));
    }

    bool add(const char *name, uint32_t base, Registers *registers)
    {
        const cpu_device_t device = {name, base, 0x400, registers, read_word, write_word};
        return bus_add(&bus, &device);
    }

    uint32_t read(uint32_t address, unsigned size)
    {
        uint32_t value = 0;
        EXPECT_EQ(bus_read(&bus, address, size, &value), BUS_DONE);
        return value;
    }
};

TEST_F(Bus, PartsOfAWordComeRightAligned)
{
    EXPECT_EQ(read(0x40000404, 4), 0x44332211U);
    EXPECT_EQ(second.offset, 4U);
    EXPECT_EQ(read(0x40000001, 1), 0x22U);
    EXPECT_EQ(read(0x40000003, 1), 0x44U);
    EXPECT_EQ(read(0x40000002, 2), 0x4433U);
}

TEST_F(Bus, PartsOfAWordAreWrittenWithTheirMask)
{
    EXPECT_EQ(bus_write(&bus, 0x40000002, 1, 0xAB), BUS_DONE);
    EXPECT_EQ(first.mask, 0x00FF0000U);
    EXPECT_EQ(first.word, 0x44AB2211U);
    EXPECT_EQ(bus_write(&bus, 0x40000406, 2, 0xCDEF), BUS_DONE);
    EXPECT_EQ(second.mask, 0xFFFF0000U);
    EXPECT_EQ(second.word, 0xCDEF2211U);
    EXPECT_EQ(bus_write(&bus, 0x40000004, 4, 7), BUS_DONE);
    EXPECT_EQ(first.word, 7U);
}

TEST_F(Bus, DistinguishesAMissingDeviceFromAMissingRegister)
{
    uint32_t value;
    EXPECT_EQ(bus_read(&bus, 0x40000800, 4, &value), BUS_NO_DEVICE);
    EXPECT_EQ(bus_write(&bus, 0x3FFFFFFC, 4, 0), BUS_NO_DEVICE);
    EXPECT_EQ(bus_read(&bus, 0x40000008, 4, &value), BUS_NO_REGISTER);
    EXPECT_EQ(bus_write(&bus, 0x40000408, 4, 0), BUS_NO_REGISTER);
}

TEST_F(Bus, RefusesWhatOverlaps)
{
    EXPECT_FALSE(add("other", 0x40000200, &first));
    EXPECT_FALSE(add("other", 0x3FFFFF00, &first));
    EXPECT_TRUE(add("other", 0x40000800, &first));
}

} // namespace
