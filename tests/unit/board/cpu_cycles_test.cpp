/* Sequences counted by hand from the Technical Reference Manual. */
#include "sim_plant/board/cycles.h"

#include <gtest/gtest.h>

#include <vector>

namespace
{

cycles_block_t block_of(const std::vector<uint16_t> &code)
{
    std::vector<uint8_t> bytes;
    for (const uint16_t word : code) {
        bytes.push_back(static_cast<uint8_t>(word));
        bytes.push_back(static_cast<uint8_t>(word >> 8));
    }
    cycles_block_t block;
    cycles_of_block(&block, bytes.data(), static_cast<uint32_t>(bytes.size()));
    return block;
}

void expect(const std::vector<uint16_t> &code, uint32_t instructions, uint32_t low, uint32_t typical,
            uint32_t high)
{
    const cycles_block_t block = block_of(code);
    EXPECT_EQ(block.instructions, instructions);
    EXPECT_EQ(block.cycles.low, low);
    EXPECT_EQ(block.cycles.typical, typical);
    EXPECT_EQ(block.cycles.high, high);
}

TEST(CpuCycles, ArithmeticTakesOne)
{
    expect({0x1888, 0xFB81, 0x2300, 0xFB01, 0x2003}, 3, 3, 3, 3); /* adds, smull, mla */
}

TEST(CpuCycles, LoadsThatFollowEachOtherOverlap)
{
    expect({0x6808}, 1, 2, 2, 2);
    expect({0x6808, 0x684A, 0x688B}, 3, 4, 4, 6); /* n loads: n + 1 */
    expect({0x6808, 0x6802}, 2, 3, 4, 4);         /* the second's address is what the first loads */
    expect({0x6808, 0x1888, 0x684A}, 3, 5, 5, 5); /* something between */
}

TEST(CpuCycles, Stores)
{
    expect({0x6008}, 1, 1, 1, 2);
    expect({0x5088}, 1, 1, 2, 2); /* with an index register */
}

TEST(CpuCycles, SeveralWordsCostOneCycleMoreThanWords)
{
    expect({0xB5F0}, 1, 6, 6, 6);         /* push {r4-r7, lr} */
    expect({0xE9D1, 0x2300}, 1, 3, 3, 3); /* ldrd */
    expect({0xBDF0}, 1, 7, 8, 9);         /* pop {r4-r7, pc}: and the refill */
}

TEST(CpuCycles, Branches)
{
    expect({0xE7FE}, 1, 2, 3, 4);
    expect({0xF7FF, 0xFFFE}, 1, 2, 3, 4);
    expect({0xD0FE}, 1, 1, 1, 1); /* not taken; taken adds the refill */
    EXPECT_TRUE(block_of({0x1888, 0xD0FE}).ends_in_branch_if);
    EXPECT_FALSE(block_of({0xE7FE}).ends_in_branch_if);
    expect({0xE8DF, 0xF000}, 1, 3, 4, 5); /* tbb */
}

TEST(CpuCycles, Others)
{
    expect({0xBF08, 0x1C40}, 2, 1, 2, 2);    /* it, add */
    expect({0xF3BF, 0x8F6F}, 1, 1, 3, 6);    /* isb */
    expect({0xB672}, 1, 1, 2, 2);            /* cpsid */
    expect({0xEE80, 0x0A20}, 1, 14, 14, 14); /* vdiv */
    EXPECT_TRUE(block_of({0xEE80, 0x0A20}).floating);
}

TEST(CpuCycles, DivisionsAreLeftToTheirOperands)
{
    const cycles_block_t block = block_of({0x1888, 0xFB91, 0xF0F2});
    EXPECT_EQ(block.divisions, 1U);
    EXPECT_EQ(block.instructions, 2U);
    EXPECT_EQ(block.cycles.typical, 1U);
}

TEST(CpuCycles, DivisionEndsEarly)
{
    EXPECT_EQ(cycles_of_division(5, 0, false), 2U);
    EXPECT_EQ(cycles_of_division(5, 7, false), 2U);
    EXPECT_EQ(cycles_of_division(7, 7, false), 4U);
    EXPECT_EQ(cycles_of_division(UINT32_MAX, 1, false), 11U);
    EXPECT_EQ(cycles_of_division(static_cast<uint32_t>(-7), 7, true), 4U);
    for (uint32_t n = 1; n != 0; n <<= 1) {
        EXPECT_GE(cycles_of_division(n, 3, false), 2U);
        EXPECT_LE(cycles_of_division(n, 1, false), 12U);
    }
}

TEST(CpuCycles, FlashWaitsOnceAndThenIsCached)
{
    cycles_flash_t flash;
    cycles_flash_reset(&flash, 4);
    const cycles_t first = cycles_of_fetch(&flash, 0x08000000, 16);
    EXPECT_EQ(first.low, 0U);
    EXPECT_EQ(first.typical, 4U + 2U) << "the jump waits, the prefetch hides a part of the second word";
    EXPECT_EQ(first.high, 8U);
    EXPECT_EQ(cycles_of_fetch(&flash, 0x08000000, 16).typical, 0U);
    for (uint32_t line = 1; line <= CYCLES_LINES; line++) {
        (void)cycles_of_fetch(&flash, 0x08000000 + line * CYCLES_LINE_BYTES, 4);
    }
    EXPECT_EQ(cycles_of_fetch(&flash, 0x08000000, 8).typical, 4U) << "pushed out by 32 other lines";
    cycles_flash_reset(&flash, 0);
    EXPECT_EQ(cycles_of_fetch(&flash, 0x08000000, 64).high, 0U);
}

} // namespace
