// tim2.h
#include "rig.h"

#include <gtest/gtest.h>

namespace
{

using rig::Chip;
constexpr uint32_t cr1 = rig::tim2, egr = rig::tim2 + 0x14, cnt = rig::tim2 + 0x24, psc = rig::tim2 + 0x28;

TEST(Tim2, CountsMicroseconds)
{
    Chip c;
    c.supply_clocks();
    c.write(psc, 15);
    c.write(egr, 1);
    c.write(cr1, 1);
    c.run_s(1.5e-3);
    EXPECT_EQ(c.read(cnt), 1500u);
    c.run(15);
    EXPECT_EQ(c.read(cnt), 1500u);
    c.run(1);
    EXPECT_EQ(c.read(cnt), 1501u);
    EXPECT_EQ(c.take_error(), "");
}

TEST(Tim2, ThePrescalerWaitsForTheUpdate)
{
    Chip c;
    c.supply_clocks();
    c.write(cr1, 1);
    c.write(psc, 99);
    c.run(1000);
    EXPECT_EQ(c.read(cnt), 1000u);
    c.write(egr, 1);
    EXPECT_EQ(c.read(cnt), 0u);
    c.run(1000);
    EXPECT_EQ(c.read(cnt), 10u);
}

TEST(Tim2, StopsAndContinues)
{
    Chip c;
    c.supply_clocks();
    c.write(cr1, 1);
    c.run(100);
    c.write(cr1, 0);
    c.run(100);
    EXPECT_EQ(c.read(cnt), 100u);
    c.write(cr1, 1);
    c.run(11);
    EXPECT_EQ(c.read(cnt), 111u);
}

} // namespace
