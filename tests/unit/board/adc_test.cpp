// adc.h: start-up order, times of sampling and conversion, what the codes mean.
#include "rig.h"

#include <gtest/gtest.h>

#include <cmath>

namespace
{

using rig::Chip;
constexpr uint32_t isr = 0, cr = 8, cfgr = 0xC, sqr1 = 0x30, dr = 0x40, jsqr = 0x4C, jdr1 = 0x80, jdr2 = 0x84;
constexpr uint32_t jeos = 0x40, eoc = 4;
constexpr int irq = 18;

// In cycles of the processor, behind the trigger: latency, then two of sampling (6.5) and conversion (12.5)
constexpr uint64_t latency = 9, sampling = 26, conversion = 50;

struct Adc : testing::Test {
    void drive(uint32_t a, uint32_t b, uint32_t c_)
    {
        c.write(rig::tim1 + 0x34, a);
        c.write(rig::tim1 + 0x38, b);
        c.write(rig::tim1 + 0x3C, c_);
        c.write(rig::tim1 + 0x20, 0x555);
        c.set(rig::tim1 + 0x44, 0x8000);
        ASSERT_EQ(c.take_error(), "");
    }
    Chip c;
};

TEST_F(Adc, StartUpHasAnOrder)
{
    c.supply_clocks();
    c.clock_170MHz();
    c.write(rig::adc12 + 8, 3u << 16);
    c.write(rig::adc1 + cr, 0);
    c.write(rig::adc1 + cr, 0x10000000);
    c.write(rig::adc1 + cr, 0x90000000);
    EXPECT_NE(c.take_error().find("before the regulator is up"), std::string::npos);
    c.write(rig::adc2 + cr, 0);
    c.write(rig::adc2 + cr, 0x10000000);
    c.run_s(21e-6);
    c.write(rig::adc2 + cr, 0x10000001);
    EXPECT_NE(c.take_error().find("without calibration"), std::string::npos);
}

TEST_F(Adc, CalibrationAndReadyHaveTheirDelays)
{
    c.supply_clocks();
    c.clock_170MHz();
    c.write(rig::adc12 + 8, 3u << 16);
    c.write(rig::adc1 + cr, 0);
    c.write(rig::adc1 + cr, 0x10000000);
    c.run_s(21e-6);
    c.write(rig::adc1 + cr, 0x90000000);
    c.run(4 * 116 - 1);
    EXPECT_EQ(c.read(rig::adc1 + cr), 0x90000000u);
    c.run(1);
    EXPECT_EQ(c.read(rig::adc1 + cr), 0x10000000u);
    c.write(rig::adc1 + cr, 0x10000001);
    EXPECT_NE(c.take_error().find("less than four clocks"), std::string::npos);
    c.run(16);
    c.write(rig::adc1 + cr, 0x10000000); // once asked for it stays on
    EXPECT_EQ(c.read(rig::adc1 + isr), 0u);
    c.run_s(1.1e-6);
    EXPECT_EQ(c.read(rig::adc1 + isr), 1u);
}

TEST_F(Adc, NoClockIsAnError)
{
    c.supply_clocks();
    c.clock_170MHz();
    c.write(rig::adc1 + cr, 0);
    c.write(rig::adc1 + cr, 0x10000000);
    c.run_s(21e-6);
    c.write(rig::adc1 + cr, 0x90000000);
    EXPECT_NE(c.take_error().find("CKMODE 0"), std::string::npos);
    c.write(rig::adc12 + 8, 1u << 16);
}

TEST_F(Adc, TheSequenceEndsOnTime)
{
    c.all();
    c.run(300);
    EXPECT_EQ(c.take_error(), "");
    c.write(rig::adc1 + isr, jeos);
    c.write(rig::adc2 + isr, jeos);
    uint64_t trigger = tim1_next_update(&c.chip->tim1) - 1;
    c.run_period();
    uint64_t end = trigger + latency + 2 * (sampling + conversion);
    c.run(end - 1 - c.processor.now);
    EXPECT_FALSE(c.line(irq));
    c.run(1);
    EXPECT_TRUE(c.line(irq));
    EXPECT_EQ(c.read(rig::adc2 + isr) & jeos, jeos);
    c.write(rig::adc1 + isr, jeos);
    EXPECT_FALSE(c.line(irq));
}

TEST_F(Adc, CodesOfCurrentsFallWithTheCurrentIntoTheMotor)
{
    c.all();
    drive(rig::counts / 2 + 400, rig::counts / 2, rig::counts / 2 - 400);
    for (int n = 0; n < 40; n++) {
        c.run_period();
    }
    c.run(300);
    plant_truth_t truth;
    plant_truth(c.plant, &truth);
    ASSERT_GT(truth.i_A[0], 5.0);
    ASSERT_LT(truth.i_A[2], -5.0);
    auto code = [](double i_A) { return 2048.0 - 2048.0 * i_A / 60.0; };
    EXPECT_NEAR(c.read(rig::adc1 + jdr1), code(truth.i_A[0]), 2.0);
    EXPECT_NEAR(c.read(rig::adc2 + jdr1), code(truth.i_A[1]), 2.0);
    EXPECT_NEAR(c.read(rig::adc1 + jdr2), code(truth.i_A[2]), 2.0);
    EXPECT_NEAR(c.read(rig::adc2 + jdr2), 4096.0 * 24.0 / 34.3, 1.0);
    EXPECT_EQ(c.take_error(), "");
}

// The currents ring down through the lower switches: what is held later is smaller.
TEST_F(Adc, RanksAreHeldOneAfterTheOther)
{
    plant_config_t config = rig::plant_config();
    config.machine.L_d0_H = config.machine.L_q0_H = 5e-6; // 50 us time constant
    Chip fast(config);
    fast.all();
    fast.write(rig::tim1 + 0x34, rig::counts / 2 + 800);
    fast.write(rig::tim1 + 0x38, rig::counts / 2);
    fast.write(rig::tim1 + 0x3C, rig::counts / 2 + 800); // equal to U: same truth, other instant
    fast.write(rig::tim1 + 0x20, 0x555);
    fast.set(rig::tim1 + 0x44, 0x8000);
    for (int n = 0; n < 40; n++) {
        fast.run_period();
    }
    fast.run(300);
    double u = 2048.0 - fast.read(rig::adc1 + jdr1);
    double w = 2048.0 - fast.read(rig::adc1 + jdr2);
    double later_s = static_cast<double>(sampling + conversion) / 170e6;
    ASSERT_GT(u, 50.0);
    EXPECT_NEAR(w, u * std::exp(-later_s / 50e-6), 1.5);
    EXPECT_LT(w, u);
}

TEST_F(Adc, ARegularConversionIsStartedAnewBehindASequence)
{
    c.all();
    c.chip->wiring.temperature_degC = 60.0;
    c.write(rig::adc1 + sqr1, 5u << 6);
    uint64_t trigger = tim1_next_update(&c.chip->tim1) - 1;
    c.run(trigger - 100 - c.processor.now);
    c.write(rig::adc1 + cr, 0x10000000 | 4);
    c.run_period();
    uint64_t length = 990 + conversion;
    uint64_t sequence = 13 + 2 * (sampling + conversion);
    c.run(trigger + sequence + length - 1 - c.processor.now);
    EXPECT_EQ(c.read(rig::adc1 + isr) & eoc, 0u);
    c.run(1);
    EXPECT_EQ(c.read(rig::adc1 + isr) & eoc, eoc);
    EXPECT_EQ(c.read(rig::adc1 + cr) & 4u, 0u);
    double R_ohm = 10e3 * std::exp(3380.0 * (1 / 333.15 - 1 / 298.15));
    EXPECT_NEAR(c.read(rig::adc1 + dr), 4096.0 * 4.7e3 / (4.7e3 + R_ohm), 1.0);
    EXPECT_EQ(c.read(rig::adc1 + isr) & eoc, 0u); // reading clears it
    EXPECT_EQ(c.take_error(), "");
}

TEST_F(Adc, Dial)
{
    c.all();
    c.chip->wiring.dial = 0.25;
    c.write(rig::adc1 + sqr1, 11u << 6);
    c.write(rig::adc1 + cr, 0x10000000 | 4);
    c.run(2000);
    EXPECT_EQ(c.read(rig::adc1 + dr), 1024u);
}

// TIM4 counts from TIM1's update event: one sequence there, one at its count, none where the first is still running.
TEST_F(Adc, BothEdgesOfTim4Trigger)
{
    constexpr uint32_t tim4 = 0x40000800;
    for (const uint32_t at : {3000u, 85u}) {
        Chip chip;
        chip.supply_clocks();
        chip.clock_170MHz();
        chip.pins();
        chip.amplifiers();
        chip.comparators(0x0F0);
        chip.gates();
        chip.set(rig::rcc + 0x58, 4);
        chip.write(tim4 + 4, 0x40);
        chip.write(tim4 + 8, 4);
        chip.write(tim4 + 0x18, 0x68);
        chip.write(tim4 + 0x34, at);
        chip.set(rig::tim1 + 4, 0x20);
        chip.converters(1u | 5u << 2 | 3u << 7);
        chip.write(tim4, 1);
        chip.start_timer();
        chip.run_period();
        const uint64_t length = latency + 2 * (sampling + conversion);
        chip.run(length - 1);
        EXPECT_FALSE(chip.line(irq));
        chip.run(1);
        EXPECT_TRUE(chip.line(irq));
        EXPECT_EQ(chip.read(tim4 + 0x24), length);
        chip.write(rig::adc1 + isr, jeos);
        chip.run(at > length ? at - 1 : length);
        EXPECT_FALSE(chip.line(irq));
        chip.run(1);
        EXPECT_EQ(chip.line(irq), at > length);
        chip.write(rig::adc1 + isr, jeos);
        chip.run_period();
        EXPECT_FALSE(chip.line(irq));
        chip.run(length);
        EXPECT_TRUE(chip.line(irq)); // again at the start of the next
        EXPECT_EQ(chip.take_error(), "");
    }
}

// The star point against the mean of the terminals; the plant's channel sees the opposite.
TEST_F(Adc, Neutral)
{
    plant_config_t config = rig::plant_config();
    config.sensor.v_zero_full_scale_V = 5.0;
    config.sensor.v_zero_offset_V = 1.0; // nothing turns
    for (const bool connected : {true, false}) {
        config.sensor.v_zero_full_scale_V = connected ? 5.0 : 0.0;
        Chip chip(config);
        chip.all();
        chip.write(rig::adc1 + sqr1, 14u << 6);
        chip.write(rig::adc1 + cr, 0x10000000 | 4);
        chip.run(2000);
        EXPECT_NEAR(chip.read(rig::adc1 + dr), connected ? 2048 - 2048 / 5 : 2048, 2.0);
        EXPECT_EQ(chip.take_error(), "");
    }
}

// Dividers of 30 V full scale: a leg that is held high shows the link.
TEST_F(Adc, Terminals)
{
    plant_config_t config = rig::plant_config();
    config.sensor.v_leg_full_scale_V = 30.0;
    const struct {
        uint32_t converter, channel;
    } input[] = {{rig::adc2, 17}, {rig::adc2, 5}, {rig::adc1, 14}};
    for (uint32_t leg = 0; leg < 3; leg++) {
        Chip chip(config);
        chip.all();
        chip.write(rig::tim1 + 0x34 + 4 * leg, 0xFFFF); // this one high, the others low
        chip.write(rig::tim1 + 0x20, 0x555);
        chip.set(rig::tim1 + 0x44, 0x8000);
        chip.run_period();
        chip.run_period();
        for (uint32_t n = 0; n < 3; n++) {
            chip.write(input[n].converter + sqr1, input[n].channel << 6);
            chip.write(input[n].converter + cr, 0x10000000 | 4);
            chip.run(1200);
            EXPECT_NEAR(chip.read(input[n].converter + dr), n == leg ? 4096.0 * 24.0 / 30.0 : 0.0, 20.0)
                << leg << n;
        }
        EXPECT_EQ(chip.take_error(), "");
        chip.write(rig::gpiob + 0x18, 1u << 5); // PB5
        chip.write(rig::gpiob, (chip.read(rig::gpiob) & ~(3u << 10)) | 1u << 10);
        chip.write(rig::adc2 + sqr1, 17u << 6);
        chip.write(rig::adc2 + cr, 0x10000000 | 4);
        chip.run(1200);
        (void)chip.read(rig::adc2 + dr);
        EXPECT_NE(chip.take_error().find("PB5 is high"), std::string::npos);
    }
}

TEST_F(Adc, AStuckConverterNeverEnds)
{
    c.all();
    c.chip->wiring.converter_stuck = true;
    adc_release(&c.chip->adc);
    c.write(rig::adc1 + isr, jeos);
    for (int n = 0; n < 5; n++) {
        c.run_period();
    }
    EXPECT_FALSE(c.line(irq));
    EXPECT_EQ(c.read(rig::adc1 + isr) & jeos, 0u);
}

TEST_F(Adc, InputsThatLeadNowhereAreErrors)
{
    c.all();
    c.write(rig::adc1 + sqr1, 7u << 6);
    c.write(rig::adc1 + cr, 0x10000000 | 4);
    c.run(4000);
    c.read(rig::adc1 + isr);
    EXPECT_EQ(c.take_error(), "ADC1: the board has nothing at input 7");
}

TEST_F(Adc, AnAmplifierThatIsOffIsAnError)
{
    c.all();
    c.write(rig::opamp + 4, 0);
    c.run_period();
    c.run(1000);
    EXPECT_EQ(c.take_error(), "ADC2: current of leg 2: the amplifier is off");
}

TEST_F(Adc, ConfigurationWhileRunningIsAnError)
{
    c.all();
    c.write(rig::adc1 + jsqr, 0);
    EXPECT_NE(c.take_error().find("write while conversions run"), std::string::npos);
    c.write(rig::adc1 + cfgr, 0x80001000);
    EXPECT_NE(c.take_error().find("write while conversions run"), std::string::npos);
}

} // namespace
