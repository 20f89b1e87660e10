// tim1.h: update events, what reaches the plant, breaks, lock, what arming refuses.
#include "rig.h"

#include <gtest/gtest.h>

#include <cmath>

namespace
{

using rig::Chip;
constexpr uint32_t cr1 = rig::tim1, sr = rig::tim1 + 0x10, egr = rig::tim1 + 0x14, ccmr1 = rig::tim1 + 0x18,
                   ccer = rig::tim1 + 0x20, cnt = rig::tim1 + 0x24, arr = rig::tim1 + 0x2C,
                   rcr = rig::tim1 + 0x30, ccr1 = rig::tim1 + 0x34, bdtr = rig::tim1 + 0x44,
                   af1 = rig::tim1 + 0x60;
constexpr uint32_t moe = 0x8000, bif = 0x80;
constexpr uint64_t half = rig::counts;

struct Tim1 : testing::Test {
    void ready()
    {
        c.supply_clocks();
        c.clock_170MHz();
        c.pins();
    }
    void arm(uint32_t legs = 0x555)
    {
        c.write(ccer, legs);
        c.set(bdtr, moe);
    }
    void duty(double a, double b, double w)
    {
        const double d[] = {a, b, w};
        for (uint32_t n = 0; n < 3; n++) {
            c.write(ccr1 + 4 * n, static_cast<uint32_t>(std::lround(d[n] * rig::counts)));
        }
    }
    plant_truth_t truth()
    {
        plant_truth_t t;
        plant_truth(c.plant, &t);
        return t;
    }
    Chip c;
};

// RM0440: RCR written after the launch puts the update events at the overflow ...
TEST_F(Tim1, RepetitionAfterTheStartUpdatesAtOverflows)
{
    ready();
    c.gates();
    uint64_t start = c.processor.now;
    c.set(cr1, 1);
    c.write(rcr, 1);
    EXPECT_EQ(tim1_next_update(&c.chip->tim1), start + half);
    c.run_period();
    EXPECT_EQ(tim1_next_update(&c.chip->tim1), start + 3 * half);
    c.run_period();
    EXPECT_EQ(tim1_next_update(&c.chip->tim1), start + 5 * half);
    EXPECT_TRUE(tim1_follows_plant(&c.chip->tim1));
    EXPECT_EQ(c.read(cnt), rig::counts);
    c.run(1000);
    EXPECT_EQ(c.read(cnt), rig::counts - 1000);
    c.run(half);
    EXPECT_EQ(c.read(cnt), 1000u);
    EXPECT_EQ(c.take_error(), "");
}

// ... and before it, with the update that loads it, at the underflow, which the plant cannot follow.
TEST_F(Tim1, RepetitionBeforeTheStartUpdatesAtUnderflows)
{
    ready();
    c.gates();
    c.write(rcr, 1);
    c.write(egr, 1);
    uint64_t start = c.processor.now;
    c.set(cr1, 1);
    EXPECT_EQ(tim1_next_update(&c.chip->tim1), start + 2 * half);
    c.run_period();
    EXPECT_FALSE(tim1_follows_plant(&c.chip->tim1));
    arm();
    EXPECT_NE(c.take_error().find("update events at underflows"), std::string::npos);
}

TEST_F(Tim1, CompareValuesWaitForTheUpdate)
{
    c.all();
    duty(0.75, 0.5, 0.5);
    arm();
    c.run_period(); // these still run with zero compare: all low
    EXPECT_EQ(truth().v_mean_alpha_V, 0.0);
    c.run_period();
    EXPECT_NEAR(truth().v_mean_alpha_V, 24.0 * 2 / 3 * 0.25, 0.5); // dead times
    EXPECT_EQ(c.take_error(), "");
}

TEST_F(Tim1, EachLegHasItsCompareValue)
{
    plant_config_t config = rig::plant_config();
    config.inverter.dead_time_s = 0.0;
    Chip ideal(config);
    ideal.supply_clocks();
    ideal.clock_170MHz();
    ideal.pins();
    ideal.gates(0);
    ideal.start_timer();
    ideal.write(ccr1, 1000);
    ideal.write(ccr1 + 4, 2000);
    ideal.write(ccr1 + 8, 3000);
    ideal.write(ccer, 0x555);
    ideal.set(bdtr, moe);
    ideal.run_period();
    ideal.run_period();
    plant_truth_t t;
    ideal.run_period();
    plant_truth(ideal.plant, &t);
    double volt = 24.0 / rig::counts;
    EXPECT_NEAR(t.v_mean_alpha_V, volt * (2000.0 / 3 - 2000.0 / 3 - 1000.0), 1e-6);
    EXPECT_NEAR(t.v_mean_beta_V, volt * (2000.0 - 3000.0) / std::sqrt(3.0), 1e-6);
    EXPECT_EQ(ideal.take_error(), "");
}

TEST_F(Tim1, ALegWithoutItsChannelsFloatsFromTheInstantOn)
{
    c.all();
    duty(0.6, 0.4, 0.5);
    arm();
    for (int n = 0; n < 20; n++) {
        c.run_period();
    }
    ASSERT_GT(std::fabs(truth().i_A[2] - truth().i_A[1]), 0.5);
    c.run(200);
    c.write(ccer, 0x055); // W off, 1.2 us into the period
    EXPECT_NEAR(board_within_s(c.chip, c.processor.now), 200.0 / 170e6, 1e-9);
    EXPECT_FALSE(c.chip->wiring.driven[2]);
    for (int n = 0; n < 3; n++) {
        c.run_period();
    }
    EXPECT_EQ(truth().i_A[2], 0.0);
    EXPECT_NE(truth().i_A[0], 0.0);
    EXPECT_EQ(c.take_error(), "");
}

// Mode 2 with both outputs, mode 1 with the lower one alone; not the upper one alone in mode 2.
TEST_F(Tim1, ALegMayBeInverted)
{
    ready();
    c.gates();
    c.set(rig::tim1 + 4, 1); // CCPC
    c.start_timer();
    c.set(bdtr, moe);
    c.run(200);
    c.write(ccer, 0x545);
    c.write(ccmr1, 0x6878);
    c.write(egr, 0x20);
    EXPECT_EQ(c.chip->wiring.state[0], PLANT_LEG_INVERTED);
    EXPECT_EQ(c.chip->wiring.state[1], PLANT_LEG_LOWER_INVERTED);
    EXPECT_EQ(c.chip->wiring.state[2], PLANT_LEG_PWM);
    EXPECT_EQ(c.take_error(), "");
    c.write(ccer, 0x551);
    c.write(egr, 0x20);
    EXPECT_EQ(c.take_error(), "TIM1: outputs 1 of channel 1 in mode 7 are not modelled");
}

// Written ahead, in effect at the COM event. One switch alone has no dead time, so the current is u v_dc / 2 R and
// not u less 0.01 of that; the other leg is held, the third is off.
TEST_F(Tim1, StatesOfLegsWaitForTheCommutation)
{
    ready();
    c.gates();
    c.set(rig::tim1 + 4, 1); // CCPC
    c.start_timer();
    c.set(bdtr, moe);
    c.run(200);
    duty(0.1, 0.5, 0.5);
    c.write(ccer, 0x051);   // U upper, V both, W off
    c.write(ccmr1, 0x4868); // V forced low
    EXPECT_FALSE(c.chip->wiring.driven[0]);
    c.write(egr, 0x20);
    EXPECT_TRUE(c.chip->wiring.driven[0]);
    EXPECT_FALSE(c.chip->wiring.driven[2]);
    EXPECT_EQ(c.chip->wiring.state[0], PLANT_LEG_UPPER);
    EXPECT_EQ(c.chip->wiring.state[1], PLANT_LEG_LOW);
    for (int n = 0; n < 100; n++) {
        c.run_period();
    }
    EXPECT_NEAR(truth().i_A[0], 0.1 * 24 / 0.2, 0.3);
    EXPECT_NEAR(truth().i_A[1], -0.1 * 24 / 0.2, 0.3);
    c.run(200);
    duty(0.5, 0.9, 0.5);
    c.write(ccer, 0x045);
    c.write(ccmr1, 0x7858); // U forced high, V the lower switch for the rest of 0.9
    c.run_period();
    EXPECT_EQ(c.chip->wiring.state[1], PLANT_LEG_LOW);
    c.run(200);
    c.write(egr, 0x20);
    EXPECT_EQ(c.chip->wiring.state[0], PLANT_LEG_HIGH);
    EXPECT_EQ(c.chip->wiring.state[1], PLANT_LEG_LOWER);
    for (int n = 0; n < 100; n++) {
        c.run_period();
    }
    EXPECT_NEAR(truth().i_A[0], 0.1 * 24 / 0.2, 0.3);
    EXPECT_EQ(truth().i_A[2], 0.0);
    EXPECT_EQ(c.take_error(), "");
}

// TIM3 counts from TIM1's update event: what was written ahead takes effect that many cycles later, once.
TEST_F(Tim1, ACommutationIsAtItsCount)
{
    constexpr uint32_t tim3 = 0x40000400, smcr = rig::tim1 + 8;
    for (const bool runs : {true, false}) {
        Chip chip;
        chip.supply_clocks();
        chip.clock_170MHz();
        chip.pins();
        chip.gates();
        chip.set(rig::rcc + 0x58, 2);
        chip.write(tim3 + 4, 0x40);
        chip.write(tim3 + 8, 4);
        chip.write(tim3 + 0x18, 0x78);
        chip.write(tim3, runs ? 1 : 0);
        chip.write(smcr, 0x20);
        chip.set(rig::tim1 + 4, 0x25);
        chip.start_timer();
        chip.set(bdtr, moe);
        chip.run_period();
        chip.write(ccer, 0x055);
        chip.write(egr, 0x20);
        chip.write(tim3 + 0x34, 6000);
        chip.write(ccer, 0x550);
        chip.run_period();
        chip.run(5999);
        EXPECT_TRUE(chip.chip->wiring.driven[0]);
        EXPECT_FALSE(chip.chip->wiring.driven[2]);
        chip.run(1);
        EXPECT_EQ(chip.chip->wiring.driven[0], !runs);
        EXPECT_EQ(chip.chip->wiring.driven[2], runs);
        chip.write(tim3 + 0x34, 0);
        chip.write(ccer, 0x555);
        chip.run_period();
        chip.run_period();
        EXPECT_EQ(chip.chip->wiring.driven[2], runs);
        EXPECT_EQ(chip.chip->wiring.driven[0], !runs);
        EXPECT_EQ(chip.take_error(), "");
    }
}

TEST_F(Tim1, FromOneSwitchToTheOtherNeedsAPeriodBetween)
{
    const struct {
        uint32_t ccer_from, mode_from, ccer_to, mode_to;
        bool safe;
    } rows[] = {
        {1, 6, 4, 7, false}, {5, 5, 4, 7, false}, {4, 7, 1, 6, false}, {4, 7, 5, 5, false},
        {5, 4, 1, 6, false}, {5, 6, 4, 7, true},  {5, 6, 1, 6, true},  {5, 5, 5, 4, true},
        {1, 6, 5, 4, true},  {4, 7, 5, 6, true},  {4, 7, 5, 4, true},  {1, 6, 5, 5, true},
    };
    for (const auto &row : rows) {
        Chip chip;
        chip.supply_clocks();
        chip.clock_170MHz();
        chip.pins();
        chip.gates();
        chip.set(rig::tim1 + 4, 1);
        chip.start_timer();
        chip.set(bdtr, moe);
        chip.write(ccer, 0x550 | row.ccer_from);
        chip.write(ccmr1, 0x6808 | row.mode_from << 4);
        chip.write(egr, 0x20);
        EXPECT_EQ(chip.take_error(), "");
        chip.write(ccer, 0x550 | row.ccer_to);
        chip.write(ccmr1, 0x6808 | row.mode_to << 4);
        chip.write(egr, 0x20);
        EXPECT_EQ(chip.take_error().find("without dead time") == std::string::npos, row.safe)
            << row.ccer_from << row.mode_from << row.ccer_to << row.mode_to;
    }
}

TEST_F(Tim1, MainOutputOffActsAtOnce)
{
    c.all();
    duty(0.7, 0.4, 0.4);
    arm();
    for (int n = 0; n < 10; n++) {
        c.run_period();
    }
    double before_A = truth().i_A[0];
    c.run(half);
    c.write(bdtr, c.read(bdtr) & ~moe);
    plant_truth_t t = truth();
    EXPECT_NEAR(t.t_s, std::floor(t.t_s / 50e-6) * 50e-6 + 25e-6, 1e-7);
    EXPECT_GT(t.i_A[0], before_A); // the upper switch had conducted since
    for (int n = 0; n < 5; n++) {
        c.run_period();
    }
    EXPECT_EQ(truth().i_A[0], 0.0);
    EXPECT_FALSE(tim1_main_output(&c.chip->tim1));
}

TEST_F(Tim1, AHeldBreakInputSwitchesOffAndBarsArming)
{
    c.all();
    arm();
    c.chip->wiring.break_held = true;
    tim1_check_break(&c.chip->tim1);
    EXPECT_EQ(c.read(bdtr) & moe, 0u);
    EXPECT_EQ(c.read(sr) & bif, bif);
    c.write(sr, ~bif);
    EXPECT_EQ(c.read(sr) & bif, bif);
    c.set(bdtr, moe);
    EXPECT_EQ(c.read(bdtr) & moe, 0u);
    c.chip->wiring.break_held = false;
    EXPECT_EQ(c.read(sr) & bif, bif); // latched
    c.write(sr, ~bif);
    EXPECT_EQ(c.read(sr) & bif, 0u);
    EXPECT_EQ(c.read(bdtr) & moe, 0u); // no automatic rise
    c.set(bdtr, moe);
    EXPECT_EQ(c.read(bdtr) & moe, moe);
}

// A filter of 8 samples at 1/16 of the clock is 128 cycles, for either edge.
TEST_F(Tim1, APulseOfTheBreakInputSwitchesOffWhenItOutlastsTheFilter)
{
    for (const uint64_t cycles : {127u, 128u, 170u}) {
        Chip chip;
        chip.supply_clocks();
        chip.clock_170MHz();
        chip.pins();
        chip.gates(85, 12);
        chip.start_timer();
        chip.write(ccer, 0x555);
        chip.set(bdtr, moe);
        tim1_pulse_break(&chip.chip->tim1, chip.processor.now + 1000, cycles);
        chip.run(1000 + 127);
        EXPECT_EQ(chip.read(bdtr) & moe, moe);
        chip.run(2);
        EXPECT_EQ(chip.read(bdtr) & moe, cycles < 128 ? moe : 0u) << cycles;
        EXPECT_EQ(chip.read(sr) & bif, cycles < 128 ? 0u : bif) << cycles;
        chip.run(200);
        chip.write(sr, ~bif);
        EXPECT_EQ(chip.read(sr) & bif, 0u);
        EXPECT_EQ(chip.take_error(), "");
    }
}

TEST_F(Tim1, ABreakBySoftwareLeavesItsFlag)
{
    c.all();
    arm();
    c.write(egr, 0x80);
    EXPECT_EQ(c.read(bdtr) & moe, 0u);
    EXPECT_EQ(c.read(sr) & bif, bif);
    c.write(sr, ~bif);
    EXPECT_EQ(c.read(sr) & bif, 0u);
    EXPECT_EQ(c.take_error(), "");
}

TEST_F(Tim1, ABreakPinOfAnotherFunctionIsNotSeen)
{
    c.all();
    c.write(rig::gpioa + 0x24, c.read(rig::gpioa + 0x24) & 0x0FFFFFFF);
    arm();
    c.chip->wiring.break_held = true;
    tim1_check_break(&c.chip->tim1);
    EXPECT_EQ(c.read(bdtr) & moe, moe);
}

// Code 128 + 32 of the reference: 15 A below zero. Nobody looks at registers until it has happened.
TEST_F(Tim1, AnOverCurrentBreaksWithoutTheProcessor)
{
    c.all(128 + 32);
    duty(0.2, 0.5, 0.5); // pulls phase A negative: some 144 A without limit, time constant 0.5 ms
    arm();
    int periods = 0;
    double least_A = 0.0;
    while (c.chip->wiring.driven[0] && periods < 100) {
        c.run_period();
        least_A = std::fmin(least_A, truth().i_A[0]);
        periods++;
    }
    EXPECT_GT(periods, 2);
    EXPECT_LT(periods, 50);
    EXPECT_GT(least_A, -16.5);
    EXPECT_EQ(c.read(bdtr) & moe, 0u);
    EXPECT_EQ(c.read(sr) & bif, bif);
    for (int n = 0; n < 20; n++) {
        c.run_period();
    }
    EXPECT_EQ(truth().i_A[0], 0.0);
    EXPECT_EQ(c.take_error(), "");
}

TEST_F(Tim1, BelowTheLevelNothingBreaks)
{
    c.all(128 + 64); // 30 A
    duty(0.44, 0.5, 0.5);
    arm();
    for (int n = 0; n < 60; n++) {
        c.run_period();
    }
    EXPECT_LT(truth().i_A[0], -5.0);
    EXPECT_EQ(c.read(bdtr) & moe, moe);
}

TEST_F(Tim1, WithoutItsEnableAComparatorDoesNotBreak)
{
    ready();
    c.amplifiers();
    c.comparators(128 + 16);
    c.gates();
    c.converters();
    ASSERT_EQ(c.read(bdtr) & 0x300u, 0x200u);
    c.write(af1, 0x1); // locked: stays
    EXPECT_EQ(c.read(af1), 0x17u);
}

TEST_F(Tim1, LockLevelTwoLeavesTheMainOutputAlone)
{
    c.all();
    uint32_t before = c.read(bdtr);
    c.write(bdtr, 0);
    EXPECT_EQ(c.read(bdtr), before);
    c.write(bdtr, moe);
    EXPECT_EQ(c.read(bdtr), before | moe);
    EXPECT_EQ(c.take_error(), "");
}

TEST_F(Tim1, DeadTimeOfAllRanges)
{
    struct {
        uint32_t dtg, clocks;
    } cases[] = {{0, 0},      {85, 85},    {127, 127},  {0x80, 128}, {0xBF, 254},
                 {0xC0, 256}, {0xDF, 504}, {0xE0, 512}, {0xFF, 1008}};
    for (const auto &one : cases) {
        plant_config_t config = rig::plant_config();
        config.inverter.dead_time_s = one.clocks / 170e6;
        Chip chip(config);
        chip.supply_clocks();
        chip.clock_170MHz();
        chip.pins();
        chip.gates(one.dtg);
        chip.start_timer();
        chip.run_period();
        chip.write(ccer, 0x555);
        chip.set(bdtr, moe);
        EXPECT_EQ(chip.take_error(), "") << one.dtg;
    }
}

TEST_F(Tim1, ArmingRefusesAnotherDeadTimeThanThePlants)
{
    ready();
    c.gates(100);
    c.start_timer();
    c.run_period();
    arm();
    EXPECT_EQ(c.take_error(), "TIM1_BDTR: dead time 588.2 ns, the plant's is 500.0 ns");
}

TEST_F(Tim1, ArmingRefusesAPinOfAnotherFunction)
{
    ready();
    c.write(rig::gpioc, 0xFFFFFFFF); // PC13 analog
    c.gates();
    c.start_timer();
    c.run_period();
    arm();
    EXPECT_EQ(c.take_error(), "TIM1: channel 1N is driven, but PC13 is not its pin (AF4)");
}

TEST_F(Tim1, ArmingRefusesAnotherCarrierThanThePlants)
{
    ready();
    c.gates();
    c.write(arr, rig::counts - 10);
    c.write(egr, 1);
    c.start_timer();
    c.run_period();
    arm();
    EXPECT_NE(c.take_error().find("the plant wants 20000 Hz of 4250 counts"), std::string::npos);
}

TEST_F(Tim1, ModesWithoutPreloadAreErrors)
{
    ready();
    c.gates();
    c.write(ccmr1, 0x6060);
    c.write(ccr1, 5);
    EXPECT_EQ(c.take_error(), "TIM1_CCR: compare values without preload are not modelled");
}

TEST_F(Tim1, TheDebuggersFreezeTakesTheOutputsOff)
{
    c.all();
    arm();
    tim1_freeze(&c.chip->tim1, true);
    EXPECT_FALSE(c.chip->wiring.driven[0]);
    tim1_freeze(&c.chip->tim1, false);
    EXPECT_TRUE(c.chip->wiring.driven[0]);
}

} // namespace
