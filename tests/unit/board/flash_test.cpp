// flash.h: unlocking, erasing, programming and every way to do it wrong. RM0440 5.3.
#include "rig.h"

#include <gtest/gtest.h>

#include <cstring>

namespace
{

using rig::Chip;
constexpr uint32_t keyr = rig::flash + 8, sr = rig::flash + 0x10, cr = rig::flash + 0x14;
constexpr uint32_t page = 0x0801F800;
constexpr uint32_t pg = 1, per = 2, strt = 0x10000, lock = 0x80000000, busy = 0x10000;
constexpr uint32_t progerr = 8, pgaerr = 0x20, sizerr = 0x40, pgserr = 0x80, errors = 0xC3FA;

void unlock(Chip *c)
{
    c->write(keyr, 0x45670123);
    c->write(keyr, 0xCDEF89AB);
}

void program(Chip *c, uint32_t address, uint32_t low, uint32_t high)
{
    c->write(cr, pg);
    c->write(address, low);
    c->write(address + 4, high);
    c->run_s(100e-6);
}

uint32_t word(Chip *c, uint32_t address)
{
    uint32_t value = 0;
    std::memcpy(&value, cpu_memory(&c->processor, address, 4), sizeof value);
    return value;
}

TEST(Flash, IsLockedUntilBothKeysHaveCome)
{
    Chip c;
    c.write(cr, pg);
    EXPECT_EQ(c.take_error(), "FLASH_CR: write while locked");
    unlock(&c);
    EXPECT_EQ(c.read(cr) & lock, 0u);
    c.write(cr, lock);
    EXPECT_EQ(c.read(cr) & lock, lock);
    unlock(&c);
    EXPECT_EQ(c.read(cr) & lock, 0u);
    EXPECT_EQ(c.take_error(), "");
}

TEST(Flash, AWrongKeyLocksUntilReset)
{
    Chip c;
    c.write(keyr, 0x45670123);
    c.write(keyr, 0x45670123);
    EXPECT_NE(c.take_error().find("wrong key"), std::string::npos);
    unlock(&c);
    EXPECT_EQ(c.read(cr) & lock, lock);
}

TEST(Flash, ErasesAPageInItsTime)
{
    Chip c;
    std::memset(c.processor.flash.data() + 0x1F000, 0x55, 0x1000);
    unlock(&c);
    c.write(cr, per | 63u << 3);
    c.write(cr, c.read(cr) | strt);
    c.run_s(21e-3);
    EXPECT_EQ(c.read(sr) & busy, busy);
    EXPECT_GT(c.processor.stalled_until, c.processor.now);
    c.run_s(2e-3);
    EXPECT_EQ(c.read(sr), 0u);
    EXPECT_EQ(word(&c, page), 0xFFFFFFFFu);
    EXPECT_EQ(word(&c, page + 2044), 0xFFFFFFFFu);
    EXPECT_EQ(word(&c, page - 4), 0x55555555u);
    EXPECT_EQ(c.take_error(), "");
}

TEST(Flash, ProgramsADoubleWordOnce)
{
    Chip c;
    unlock(&c);
    program(&c, page, 1, 2);
    EXPECT_EQ(c.read(sr), 0u);
    EXPECT_EQ(word(&c, page), 1u);
    EXPECT_EQ(word(&c, page + 4), 2u);
    program(&c, page, 0, 1);
    EXPECT_EQ(c.read(sr), progerr);
    EXPECT_EQ(word(&c, page), 1u);
    c.write(sr, progerr);
    program(&c, page, 0, 0); // zero goes over anything
    EXPECT_EQ(c.read(sr), 0u);
    EXPECT_EQ(word(&c, page), 0u);
}

TEST(Flash, NothingIsProgrammedBeforeTheSecondWord)
{
    Chip c;
    unlock(&c);
    c.write(cr, pg);
    c.write(page, 1);
    EXPECT_EQ(word(&c, page), 0xFFFFFFFFu);
    EXPECT_EQ(c.read(sr), 0u);
}

TEST(Flash, MistakesSetTheirFlags)
{
    struct {
        uint32_t mode, first, second, mask, flag;
    } cases[] = {
        {pg, page + 4, page + 8, ~0u, pgaerr}, // not at a multiple of eight
        {pg, page, page + 12, ~0u, pgaerr},    // not the other half
        {pg, page, page + 4, 0xFFFF, sizerr},  // half-words
        {0, page, page + 4, ~0u, pgserr},      // without PG
    };
    for (const auto &one : cases) {
        Chip c;
        unlock(&c);
        c.write(cr, one.mode);
        c.write(one.first, 1, one.mask);
        c.write(one.second, 2, one.mask);
        EXPECT_NE(c.read(sr) & one.flag, 0u);
        EXPECT_EQ(word(&c, page), 0xFFFFFFFFu);
        EXPECT_EQ(word(&c, page + 8), 0xFFFFFFFFu);
        c.write(sr, errors);
        EXPECT_EQ(c.read(sr), 0u);
    }
}

TEST(Flash, AFormerErrorBars)
{
    Chip c;
    unlock(&c);
    program(&c, page, 1, 2);
    program(&c, page, 3, 4);
    program(&c, page + 8, 5, 6);
    EXPECT_EQ(c.read(sr), progerr | pgserr);
    EXPECT_EQ(word(&c, page + 8), 0xFFFFFFFFu);
}

TEST(Flash, WritesWhileBusyEndTheRun)
{
    Chip c;
    unlock(&c);
    c.write(cr, pg);
    c.write(page, 1);
    c.write(page + 4, 2);
    c.write(page + 8, 3);
    EXPECT_EQ(c.take_error(), "flash: write to 0x0801f808 while busy");
}

TEST(Flash, ACutLeavesNeitherOldNorNew)
{
    Chip c;
    unlock(&c);
    c.chip->flash.cut_after = 2;
    program(&c, page, 0x11111111, 0x22222222);
    EXPECT_FALSE(c.chip->flash.cut);
    program(&c, page + 8, 0x33333333, 0x44444444);
    EXPECT_TRUE(c.chip->flash.cut);
    EXPECT_TRUE(c.processor.halted);
    EXPECT_NE(word(&c, page + 12), 0x44444444u);
    EXPECT_NE(word(&c, page + 12), 0xFFFFFFFFu);
}

} // namespace
