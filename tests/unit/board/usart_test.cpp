// usart.h: bytes take their time, TXE and TC with their interrupt, the pin.
#include "rig.h"

#include <gtest/gtest.h>

namespace
{

using rig::Chip;
constexpr uint32_t cr1 = rig::usart2, brr = rig::usart2 + 0xC, isr = rig::usart2 + 0x1C,
                   tdr = rig::usart2 + 0x28;
constexpr uint32_t ue = 1, te = 8, txeie = 0x80, txe = 0x80, tc = 0x40;
constexpr int irq = 38;
constexpr uint64_t byte = 10 * 1476; // cycles at 115200 baud

struct Usart : testing::Test {
    Usart()
    {
        c.supply_clocks();
        c.clock_170MHz();
        c.pins();
        c.write(brr, 1476);
        c.write(cr1, ue | te);
    }
    Chip c;
};

TEST_F(Usart, SendsOneByteWhileTheNextWaits)
{
    c.write(tdr, 'o');
    EXPECT_EQ(c.read(isr) & (txe | tc), txe); // straight into the shift register
    c.write(tdr, 'k');
    EXPECT_EQ(c.read(isr) & (txe | tc), 0u);
    c.run(byte - 1);
    EXPECT_STREQ(c.chip->usart.text, "");
    c.run(1);
    EXPECT_STREQ(c.chip->usart.text, "o");
    EXPECT_EQ(c.read(isr) & (txe | tc), txe);
    c.run(byte);
    EXPECT_STREQ(c.chip->usart.text, "ok");
    EXPECT_EQ(c.read(isr) & (txe | tc), txe | tc);
    EXPECT_EQ(c.take_error(), "");
}

TEST_F(Usart, InterruptsWhileThereIsRoom)
{
    EXPECT_FALSE(c.line(irq));
    c.write(cr1, ue | te | txeie);
    EXPECT_TRUE(c.line(irq));
    c.write(tdr, 'a');
    c.write(tdr, 'b');
    EXPECT_FALSE(c.line(irq));
    c.run(byte);
    EXPECT_TRUE(c.line(irq));
    c.write(cr1, ue | te);
    EXPECT_FALSE(c.line(irq));
}

TEST_F(Usart, KeepsLongTexts)
{
    std::string all;
    for (int n = 0; n < 2000; n++) {
        char letter = static_cast<char>('a' + n % 26);
        all += letter;
        c.write(tdr, static_cast<uint32_t>(letter));
        c.run(byte);
    }
    EXPECT_EQ(c.chip->usart.text, all);
}

TEST_F(Usart, MistakesAreErrors)
{
    c.write(tdr, 'a');
    c.write(tdr, 'b');
    c.write(tdr, 'c');
    EXPECT_EQ(c.take_error(), "USART2_TDR: write while it is full");
    c.write(brr, 100);
    EXPECT_EQ(c.take_error(), "USART2_BRR: write while it is enabled");
    c.write(cr1, 0);
    c.write(tdr, 'd');
    EXPECT_EQ(c.take_error(), "USART2_TDR: write while it is full");
}

TEST_F(Usart, APinOfAnotherFunctionIsAnError)
{
    c.write(rig::gpiob + 0x20, 0);
    c.write(tdr, 'a');
    c.run(byte);
    EXPECT_EQ(c.take_error(), "USART2 sends, but PB3 is not its pin (AF7)");
}

} // namespace
