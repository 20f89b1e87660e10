// gpio.h: levels, BSRR, alternate functions, reset state.
#include "rig.h"

#include <gtest/gtest.h>

namespace
{

using rig::Chip;
constexpr uint32_t pupdr = 0x0C, idr = 0x10, odr = 0x14, bsrr = 0x18;

struct Gpio : testing::Test {
    Gpio()
    {
        c.supply_clocks();
    }
    void mode(uint32_t port, int pin, uint32_t value)
    {
        c.write(port, (c.read(port) & ~(3u << (2 * pin))) | value << (2 * pin));
    }
    Chip c;
};

TEST_F(Gpio, ResetStateIsThatOfTheManual)
{
    EXPECT_EQ(c.read(rig::gpioa), 0xABFFFFFFu);
    EXPECT_EQ(c.read(rig::gpiob), 0xFFFFFEBFu);
    EXPECT_EQ(c.read(rig::gpioc), 0xFFFFFFFFu);
    EXPECT_TRUE(gpio_analog(&c.chip->gpio, PORT_A, 1));
    EXPECT_FALSE(gpio_analog(&c.chip->gpio, PORT_A, 15));
}

TEST_F(Gpio, SettingWinsOverClearing)
{
    c.write(rig::gpioc + bsrr, 1u << 6);
    EXPECT_EQ(c.read(rig::gpioc + odr), 1u << 6);
    c.write(rig::gpioc + bsrr, 1u << 6 | 1u << 22);
    EXPECT_EQ(c.read(rig::gpioc + odr), 1u << 6);
    c.write(rig::gpioc + bsrr, 1u << 22);
    EXPECT_EQ(c.read(rig::gpioc + odr), 0u);
}

TEST_F(Gpio, AnOutputShowsOnlyAsOutput)
{
    c.write(rig::gpioc + bsrr, 1u << 6);
    EXPECT_FALSE(gpio_drives_high(&c.chip->gpio, PORT_C, 6));
    mode(rig::gpioc, 6, 1);
    EXPECT_TRUE(gpio_drives_high(&c.chip->gpio, PORT_C, 6));
    EXPECT_EQ(c.read(rig::gpioc + idr) & 1u << 6, 1u << 6);
}

TEST_F(Gpio, ButtonPullsLow)
{
    EXPECT_EQ(c.read(rig::gpioc + idr) & 1u << 10, 0u); // analog reads zero
    mode(rig::gpioc, 10, 0);
    EXPECT_EQ(c.read(rig::gpioc + idr) & 1u << 10, 1u << 10);
    c.chip->wiring.button = true;
    EXPECT_EQ(c.read(rig::gpioc + idr) & 1u << 10, 0u);
}

TEST_F(Gpio, AnOpenInputFollowsItsPull)
{
    mode(rig::gpioc, 1, 0);
    EXPECT_EQ(c.read(rig::gpioc + idr) & 2u, 0u);
    c.write(rig::gpioc + pupdr, 1u << 2);
    EXPECT_EQ(c.read(rig::gpioc + idr) & 2u, 2u);
}

TEST_F(Gpio, AFunctionConnectsWithItsModeAndNumber)
{
    gpio_pin_t pin = {PORT_A, 8, 6};
    c.write(rig::gpioa + 0x24, 6);
    EXPECT_FALSE(gpio_connects(&c.chip->gpio, pin));
    mode(rig::gpioa, 8, 2);
    EXPECT_TRUE(gpio_connects(&c.chip->gpio, pin));
    c.write(rig::gpioa + 0x24, 5);
    EXPECT_FALSE(gpio_connects(&c.chip->gpio, pin));
}

} // namespace
