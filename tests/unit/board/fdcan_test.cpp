// fdcan.h: bit rates, FIFOs, time on the bus, error states.
#include "rig.h"

#include <gtest/gtest.h>

namespace
{

using rig::Chip;
constexpr uint32_t cccr = rig::fdcan + 0x18, nbtp = rig::fdcan + 0x1C, psr = rig::fdcan + 0x44,
                   ir = rig::fdcan + 0x50, ie = rig::fdcan + 0x54, ile = rig::fdcan + 0x5C,
                   rxgfc = rig::fdcan + 0x80, rxf0s = rig::fdcan + 0x90, rxf0a = rig::fdcan + 0x94,
                   txfqs = rig::fdcan + 0xC4, txbar = rig::fdcan + 0xCC;
constexpr uint32_t rx_fifo = rig::can_ram + 4 * 44, tx_buffers = rig::can_ram + 4 * 158, element = 72;
constexpr int irq = 21;
constexpr uint64_t bit = 170; // cycles at 1 Mbit/s
constexpr uint32_t one_Mbit = 4u << 16 | 28u << 8 | 3u | 3u << 25;

struct Can : testing::Test {
    Can()
    {
        c.supply_clocks();
        c.clock_170MHz();
        c.pins();
    }
    void start(uint32_t timing = one_Mbit)
    {
        c.write(cccr, 1);
        c.write(cccr, 3);
        c.write(nbtp, timing);
        c.write(rxgfc, 0xB);
        c.write(ie, 0x5);
        c.write(ile, 1);
        c.write(cccr, 0);
        c.run(11 * bit);
    }
    void send(uint32_t id, uint32_t length, uint32_t low = 0, uint32_t high = 0)
    {
        uint32_t index = c.read(txfqs) >> 16 & 3;
        c.write(tx_buffers + element * index, id << 18);
        c.write(tx_buffers + element * index + 4, length << 16);
        c.write(tx_buffers + element * index + 8, low);
        c.write(tx_buffers + element * index + 12, high);
        c.write(txbar, 1u << index);
    }
    bool arrive(uint16_t id, uint8_t length = 0)
    {
        fdcan_frame_t frame = {id, length, {1, 2, 3, 4, 5, 6, 7, 8}};
        return fdcan_put(&c.chip->fdcan, &frame);
    }
    Chip c;
};

// Against ISO 11898-1 by hand: identifier 0x555 has no equal neighbours.
TEST(CanBits, LengthOfFrames)
{
    fdcan_frame_t plain = {0x555, 0, {}};
    EXPECT_GE(fdcan_frame_bits(&plain), 47u);
    EXPECT_LE(fdcan_frame_bits(&plain), 47u + 8u);
    fdcan_frame_t zeros = {0x000, 8, {}};
    // all of start, identifier, control (but for the length's one), data, and CRC's zeros: near the worst
    // case
    EXPECT_GT(fdcan_frame_bits(&zeros), 111u + 15u);
    EXPECT_LE(fdcan_frame_bits(&zeros), 111u + 24u);
}

TEST_F(Can, TheFourBitRates)
{
    for (uint32_t brp : {4u, 9u, 19u, 39u}) {
        start((one_Mbit & ~(0x1FFu << 16)) | brp << 16);
        EXPECT_EQ(c.take_error(), "");
        EXPECT_EQ(c.chip->fdcan.bit_cycles, 34 * (brp + 1));
    }
    start((one_Mbit & ~(0x1FFu << 16)) | 5u << 16);
    EXPECT_NE(c.take_error().find("does not make"), std::string::npos);
    c.write(rig::rcc + 0x88, 0);
    start();
    EXPECT_NE(c.take_error().find("does not make"), std::string::npos);
}

TEST_F(Can, ConfigurationIsProtected)
{
    start();
    c.write(nbtp, 0);
    EXPECT_NE(c.take_error().find("INIT and CCE"), std::string::npos);
    c.write(cccr, 2); // CCE alone does not open
    c.write(rxgfc, 0);
    EXPECT_NE(c.take_error().find("INIT and CCE"), std::string::npos);
}

TEST_F(Can, AFrameToTheImageTakesItsTimeAndInterrupts)
{
    start();
    ASSERT_TRUE(arrive(0x60A, 5));
    fdcan_frame_t same = {0x60A, 5, {1, 2, 3, 4, 5, 6, 7, 8}};
    c.run(fdcan_frame_bits(&same) * bit - 1);
    EXPECT_FALSE(c.line(irq));
    c.run(1);
    EXPECT_TRUE(c.line(irq));
    EXPECT_EQ(c.read(rxf0s), 1u | 1u << 16);
    EXPECT_EQ(c.read(rx_fifo) >> 18, 0x60Au);
    EXPECT_EQ(c.read(rx_fifo + 4) >> 16 & 0xF, 5u);
    EXPECT_EQ(c.read(rx_fifo + 8), 0x04030201u);
    EXPECT_EQ(c.read(rx_fifo + 12), 0x05u);
    c.write(ir, 1);
    EXPECT_FALSE(c.line(irq));
    c.write(rxf0a, 0);
    EXPECT_EQ(c.read(rxf0s), 1u << 8 | 1u << 16);
    EXPECT_EQ(c.take_error(), "");
}

TEST_F(Can, TheFourthFrameIsLost)
{
    start();
    for (uint16_t n = 0; n < 4; n++) {
        arrive(static_cast<uint16_t>(0x100 + n));
    }
    c.run(4 * 60 * bit);
    EXPECT_EQ(c.read(rxf0s), 3u | 1u << 24 | 1u << 25);
    EXPECT_EQ(c.read(ir) & 5u, 5u);
    EXPECT_EQ(c.read(rx_fifo + 2 * element) >> 18, 0x102u);
    c.write(rxf0a, 1); // two at once
    EXPECT_EQ(c.read(rxf0s) & 0xF0Fu, 1u | 2u << 8);
    c.write(rxf0a, 0);
    EXPECT_NE(c.take_error().find("element 0 is not waiting"), std::string::npos);
}

TEST_F(Can, SendsInOrderAndFillsUp)
{
    start();
    EXPECT_EQ(c.read(txfqs) & 7, 3u);
    send(0x701, 1, 0x7F);
    send(0x181, 8, 0x33221100, 0x77665544);
    send(0x080, 2, 0xBEEF);
    EXPECT_EQ(c.read(txfqs) & 7, 0u);
    EXPECT_EQ(c.read(txfqs) >> 21 & 1, 1u);
    c.run(3 * 140 * bit);
    const uint16_t ids[] = {0x701, 0x181, 0x080};
    for (uint16_t id : ids) {
        fdcan_frame_t frame{};
        ASSERT_TRUE(fdcan_take(&c.chip->fdcan, &frame));
        EXPECT_EQ(frame.id, id);
        EXPECT_EQ(id != 0x181 || frame.data[7] == 0x77, true);
    }
    EXPECT_EQ(c.read(txfqs) & 7, 3u);
    c.write(txbar, 1u << 1);
    EXPECT_NE(c.take_error().find("not next in the transmit FIFO"), std::string::npos);
}

TEST_F(Can, TheLowerIdentifierGoesFirst)
{
    start();
    arrive(0x300);
    arrive(0x200); // waits for the one before it
    send(0x250, 0);
    c.run(60 * bit); // 0x300 was on the bus already
    EXPECT_EQ(c.read(rxf0s) & 0xF, 1u);
    c.run(60 * bit);
    EXPECT_EQ(c.read(rxf0s) & 0xF, 2u);
    fdcan_frame_t frame{};
    EXPECT_FALSE(fdcan_take(&c.chip->fdcan, &frame));
    c.run(60 * bit);
    EXPECT_TRUE(fdcan_take(&c.chip->fdcan, &frame));
}

TEST_F(Can, PassiveEndsWithFramesSent)
{
    start();
    fdcan_error(&c.chip->fdcan, false);
    EXPECT_EQ(c.read(psr) & 0xE0u, 0x60u);
    send(0x100, 0);
    c.run(60 * bit);
    EXPECT_EQ(c.read(psr) & 0xE0u, 0x40u); // 127: a warning is left
}

TEST_F(Can, BusOffRecoversOnceAskedTo)
{
    start();
    send(0x100, 0);
    fdcan_error(&c.chip->fdcan, true);
    EXPECT_EQ(c.read(psr) & 0x80u, 0x80u);
    EXPECT_EQ(c.read(cccr) & 1u, 1u);
    EXPECT_FALSE(arrive(0x200));
    c.run(2000 * bit);
    EXPECT_EQ(c.read(psr) & 0x80u, 0x80u);
    c.write(cccr, 0);
    c.run((128 * 11 - 1) * bit);
    EXPECT_EQ(c.read(psr) & 0x80u, 0x80u);
    c.run(bit);
    EXPECT_EQ(c.read(psr) & 0x80u, 0u);
    c.run(60 * bit);
    fdcan_frame_t frame{};
    EXPECT_TRUE(fdcan_take(&c.chip->fdcan, &frame)); // the frame that had waited
    EXPECT_EQ(c.take_error(), "");
}

TEST_F(Can, PinsAndTransceiverMatter)
{
    start();
    c.write(rig::gpiob + 0x24, 0);
    send(0x100, 0);
    c.run(60 * bit);
    EXPECT_NE(c.take_error().find("PB9 and PA11"), std::string::npos);
}

} // namespace
