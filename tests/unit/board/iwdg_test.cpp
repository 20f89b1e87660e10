// iwdg.h: keys, times of the slow clock, expiry.
#include "rig.h"

#include <gtest/gtest.h>

namespace
{

using rig::Chip;
constexpr uint32_t kr = rig::iwdg, pr = rig::iwdg + 4, rlr = rig::iwdg + 8, sr = rig::iwdg + 12;

// 20 ms: 160 counts at 8 kHz; and one, as the counter ends behind zero
constexpr double period_s = 161 / 8000.0;

void start(Chip *c)
{
    c->write(kr, 0xCCCC);
    c->write(kr, 0x5555);
    c->write(pr, 0);
    c->write(rlr, 160);
    c->run_s(1e-3);
    ASSERT_EQ(c->read(sr), 0u);
    c->write(kr, 0xAAAA);
}

TEST(Iwdg, ExpiresOnTime)
{
    Chip c;
    start(&c);
    c.run_s(period_s - 1e-5);
    EXPECT_FALSE(c.chip->iwdg.expired);
    c.run_s(2e-5);
    EXPECT_TRUE(c.chip->iwdg.expired);
    EXPECT_TRUE(c.processor.halted);
    EXPECT_EQ(c.take_error(), "");
}

TEST(Iwdg, FeedingPutsItOff)
{
    Chip c;
    start(&c);
    for (int n = 0; n < 5; n++) {
        c.run_s(0.9 * period_s);
        c.write(kr, 0xAAAA);
    }
    EXPECT_FALSE(c.chip->iwdg.expired);
}

TEST(Iwdg, RunsFromTheSlowClockIndependentOfTheProcessor)
{
    Chip c;
    start(&c);
    c.supply_clocks();
    double before_s = rcc_seconds(&c.chip->rcc);
    c.clock_170MHz();
    c.run_s(period_s - (rcc_seconds(&c.chip->rcc) - before_s) - 1e-5);
    EXPECT_FALSE(c.chip->iwdg.expired);
    c.run_s(2e-5);
    EXPECT_TRUE(c.chip->iwdg.expired);
}

TEST(Iwdg, ANewReloadCountsAfterItHasCrossedAndIsFed)
{
    Chip c;
    start(&c);
    c.write(kr, 0x5555);
    c.write(rlr, 800);
    EXPECT_EQ(c.read(sr), 2u);
    c.write(kr, 0xAAAA); // too early: the old value
    c.run_s(period_s + 1e-4);
    EXPECT_TRUE(c.chip->iwdg.expired);
}

TEST(Iwdg, WritesWithoutTheKeyOrUnderWayAreErrors)
{
    Chip c;
    c.write(rlr, 100);
    EXPECT_NE(c.take_error().find("protected"), std::string::npos);
    c.write(kr, 0xCCCC);
    c.write(kr, 0x5555);
    c.write(rlr, 100);
    EXPECT_EQ(c.take_error(), "");
    c.write(rlr, 101);
    EXPECT_NE(c.take_error().find("under way"), std::string::npos);
    c.write(kr, 0x1234);
    EXPECT_NE(c.take_error().find("no key"), std::string::npos);
}

TEST(Iwdg, TheDebuggerFreezesIt)
{
    Chip c;
    start(&c);
    c.run_s(0.5 * period_s);
    iwdg_freeze(&c.chip->iwdg, true);
    c.run_s(10 * period_s);
    EXPECT_FALSE(c.chip->iwdg.expired);
    iwdg_freeze(&c.chip->iwdg, false);
    c.run_s(0.49 * period_s);
    EXPECT_FALSE(c.chip->iwdg.expired);
    c.run_s(0.02 * period_s);
    EXPECT_TRUE(c.chip->iwdg.expired);
}

} // namespace
