// board_registers.h, and what every peripheral has of it: nothing unknown passes.
#include "rig.h"

#include <gtest/gtest.h>

namespace
{

using rig::Chip;

TEST(Registers, AnUnknownOffsetIsRefused)
{
    Chip c;
    c.write(rig::rcc + 0x14, 0);
    EXPECT_NE(c.take_error().find("RCC: write of 0x00000000 to offset 0x14"), std::string::npos);
    c.read(rig::rcc + 0x14);
    EXPECT_NE(c.take_error().find("RCC: read of offset 0x14"), std::string::npos);
}

TEST(Registers, BitsThatAreNotModelledAreNamed)
{
    Chip c;
    c.set(rig::rcc, 0x40000); // HSEBYP
    EXPECT_EQ(c.take_error(), "RCC_CR: write of 0x00040500: bits 0x00040000 are not modelled");
    EXPECT_EQ(c.read(rig::rcc) & 0x40000u, 0u);
}

TEST(Registers, BitsOfTheHardwareStayAsTheyAre)
{
    Chip c;
    c.write(rig::rcc, c.read(rig::rcc) | 0x02020000); // PLLRDY, HSERDY
    EXPECT_EQ(c.take_error(), "");
    EXPECT_EQ(c.read(rig::rcc) & 0x02020000u, 0u);
}

TEST(Registers, OnlyTheBytesOfAnAccessChange)
{
    Chip c;
    c.supply_clocks();
    c.write(rig::gpioa + 0x20, 0x11223344);
    c.write(rig::gpioa + 0x20, 0x0000AA00, 0x0000FF00);
    EXPECT_EQ(c.read(rig::gpioa + 0x20), 0x1122AA44u);
}

TEST(Registers, APeripheralWithoutClockIsAnError)
{
    struct {
        uint32_t address;
        const char *name;
    } cases[] = {{rig::gpiob, "GPIOB"}, {rig::tim1, "TIM1"},           {rig::tim2, "TIM2"},
                 {rig::adc1, "ADC12"},  {rig::opamp, "OPAMP"},         {rig::comp, "COMP"},
                 {rig::dac3, "DAC3"},   {rig::fdcan + 0x18, "FDCAN1"}, {rig::usart2, "USART2"},
                 {rig::pwr, "PWR"},     {rig::can_ram, "FDCAN memory"}};
    for (const auto &one : cases) {
        Chip c;
        c.read(one.address);
        EXPECT_EQ(c.take_error(), std::string(one.name) + ": access while its clock is off");
        c.supply_clocks();
        c.read(one.address);
        EXPECT_EQ(c.take_error(), "") << one.name;
    }
}

} // namespace
