// analog.h: what an amplifier and a comparator need, and which current a comparator's code stands for.
#include "rig.h"

#include <gtest/gtest.h>

namespace
{

using rig::Chip;

struct Analog : testing::Test {
    Analog()
    {
        c.supply_clocks();
        c.clock_170MHz();
        c.pins();
    }
    Chip c;
};

TEST_F(Analog, AnAmplifierNeedsAllOfItsSettings)
{
    for (int leg = 0; leg < BOARD_LEGS; leg++) {
        EXPECT_NE(analog_fault(&c.chip->analog, leg), nullptr);
    }
    c.amplifiers();
    for (int leg = 0; leg < BOARD_LEGS; leg++) {
        EXPECT_EQ(analog_fault(&c.chip->analog, leg), nullptr);
    }
    const uint32_t right = c.read(rig::opamp);
    for (uint32_t bits : {1u, 1u << 2, 1u << 5, 1u << 14, 1u << 8}) {
        c.write(rig::opamp, right ^ bits);
        EXPECT_NE(analog_fault(&c.chip->analog, 0), nullptr) << bits;
    }
    c.write(rig::opamp, right);
    c.write(rig::gpioa, c.read(rig::gpioa) & ~(3u << 2)); // PA1 as an input
    EXPECT_NE(analog_fault(&c.chip->analog, 0), nullptr);
    EXPECT_EQ(analog_fault(&c.chip->analog, 1), nullptr);
}

TEST_F(Analog, ACodeIsALevelOfTheAmplifiersOutput)
{
    double share = 0.0;
    EXPECT_FALSE(analog_level(&c.chip->analog, 0, &share));
    c.comparators(128 + 64); // mid-scale is 1.65 V / 16: code 128
    for (int leg = 0; leg < BOARD_LEGS; leg++) {
        ASSERT_TRUE(analog_level(&c.chip->analog, leg, &share));
        EXPECT_NEAR(share, 0.5, 1e-12);
    }
    c.write(rig::dac3 + 0x14, 128 + 32);
    analog_level(&c.chip->analog, 0, &share);
    EXPECT_NEAR(share, 0.5, 1e-12);
    analog_level(&c.chip->analog, 2, &share);
    EXPECT_NEAR(share, 0.25, 1e-12);
    EXPECT_EQ(c.take_error(), "");
}

TEST_F(Analog, OrderAndModesOfTheReference)
{
    c.write(rig::dac3, 1);
    EXPECT_NE(c.take_error().find("does not feed the comparators"), std::string::npos);
    c.write(rig::dac3, 0);
    c.write(rig::dac3 + 0x3C, 0x30003); // HFSEL 0 at 170 MHz
    c.write(rig::dac3, 1);
    EXPECT_NE(c.take_error().find("HFSEL 0 is too slow"), std::string::npos);
    c.write(rig::comp, 0x41);
    EXPECT_NE(c.take_error().find("before the reference"), std::string::npos);
    c.run_s(10e-6);
    c.write(rig::comp, 0x41);
    EXPECT_EQ(c.take_error(), "");
    c.write(rig::comp, 0x31);
    EXPECT_NE(c.take_error().find("COMP: inputs other than"), std::string::npos);
}

TEST_F(Analog, ABreakLevelBelowMidScaleIsAnError)
{
    c.gates();
    c.comparators(100);
    EXPECT_NE(c.take_error().find("below the amplifiers' mid-scale"), std::string::npos);
}

} // namespace
