#include "sim_plant/board/cpu_mpu.h"

#include <gtest/gtest.h>

namespace
{

constexpr uint32_t on = 1, in_faults = 2, background = 4;
constexpr uint32_t no_access = 0, read_write = 3U << 24, read_only = 6U << 24, never = 1U << 28;

uint32_t size_of(unsigned bits)
{
    return (bits - 1) << 1 | 1;
}

struct Mpu : ::testing::Test {
    mpu_t mpu{};

    void region(uint32_t number, uint32_t base, uint32_t attributes)
    {
        ASSERT_TRUE(mpu_write(&mpu, 0x0C, base | 0x10 | number));
        ASSERT_TRUE(mpu_write(&mpu, 0x10, attributes));
    }

    bool allows(uint32_t address, mpu_access_t access)
    {
        return mpu_allows(&mpu, address, access, false);
    }
};

TEST_F(Mpu, OffLeavesTheArchitecturesOwnRules)
{
    EXPECT_TRUE(allows(0x20000000, MPU_WRITE));
    EXPECT_TRUE(allows(0x20000000, MPU_EXECUTE));
    EXPECT_FALSE(allows(0x40000000, MPU_EXECUTE));
    EXPECT_FALSE(allows(0xE0000000, MPU_EXECUTE));
}

TEST_F(Mpu, AccessRightsOfARegion)
{
    region(0, 0x20000000, no_access | never | size_of(5));
    region(1, 0x20000040, read_only | never | size_of(6));
    mpu_write(&mpu, 0x04, on | background);
    EXPECT_FALSE(allows(0x20000000, MPU_READ));
    EXPECT_FALSE(allows(0x2000001C, MPU_WRITE));
    EXPECT_TRUE(allows(0x20000020, MPU_WRITE));
    EXPECT_TRUE(allows(0x20000040, MPU_READ));
    EXPECT_FALSE(allows(0x2000007C, MPU_WRITE));
    EXPECT_FALSE(allows(0x20000040, MPU_EXECUTE));
    EXPECT_FALSE(mpu_is_open(&mpu, 0x20000000, 1024));
    EXPECT_TRUE(mpu_is_open(&mpu, 0x20000400, 1024));
}

TEST_F(Mpu, TheHigherNumberWinsAndSubRegionsMakeHoles)
{
    region(1, 0x20000000, no_access | size_of(10));
    region(2, 0x20000000, read_write | 0x8000 | size_of(8)); /* without its last eighth */
    mpu_write(&mpu, 0x04, on | background);
    EXPECT_TRUE(allows(0x200000DC, MPU_WRITE));
    EXPECT_FALSE(allows(0x200000E0, MPU_WRITE));
    EXPECT_FALSE(allows(0x20000100, MPU_READ));
}

TEST_F(Mpu, WithoutBackgroundNothingElseIsAllowed)
{
    region(0, 0x20000000, read_write | size_of(10));
    mpu_write(&mpu, 0x04, on);
    EXPECT_TRUE(allows(0x20000000, MPU_READ));
    EXPECT_FALSE(allows(0x20000400, MPU_READ));
    EXPECT_TRUE(allows(0xE000E100, MPU_WRITE)) << "the system space is outside";
}

TEST_F(Mpu, UrgentCodeIsFreeUnlessAskedFor)
{
    region(0, 0x20000000, no_access | size_of(5));
    mpu_write(&mpu, 0x04, on | background);
    EXPECT_TRUE(mpu_allows(&mpu, 0x20000000, MPU_WRITE, true));
    mpu_write(&mpu, 0x04, on | background | in_faults);
    EXPECT_FALSE(mpu_allows(&mpu, 0x20000000, MPU_WRITE, true));
}

TEST_F(Mpu, RegistersReadBack)
{
    region(5, 0x20000400, read_only | size_of(8));
    uint32_t value = 0;
    EXPECT_TRUE(mpu_read(&mpu, 0x00, &value));
    EXPECT_EQ(value, 0x800U);
    EXPECT_TRUE(mpu_read(&mpu, 0x08, &value));
    EXPECT_EQ(value, 5U);
    EXPECT_TRUE(mpu_read(&mpu, 0x0C, &value));
    EXPECT_EQ(value, 0x20000405U);
    EXPECT_TRUE(mpu_read(&mpu, 0x10, &value));
    EXPECT_EQ(value, read_only | size_of(8));
    EXPECT_FALSE(mpu_read(&mpu, 0x2C, &value));
}

} // namespace
