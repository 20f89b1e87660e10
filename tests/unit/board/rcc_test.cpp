// rcc.h: clocks with their start-up times, what a clock change demands, security system, reset causes.
#include "rig.h"

#include <gtest/gtest.h>

namespace
{

using rig::Chip;
constexpr uint32_t cr = rig::rcc, cfgr = rig::rcc + 8, pllcfgr = rig::rcc + 0xC, cifr = rig::rcc + 0x1C,
                   cicr = rig::rcc + 0x20, csr = rig::rcc + 0x94, acr = rig::flash, cr5 = rig::pwr + 0x80;
constexpr uint32_t hse_on = 0x10000, hse_ready = 0x20000, css_on = 0x80000, pll_on = 0x1000000,
                   pll_ready = 0x2000000;
constexpr int nmi = CPU_NMI;

TEST(Rcc, StartsOnHsi)
{
    Chip c;
    EXPECT_EQ(c.chip->rcc.clock_Hz, 16000000u);
    EXPECT_EQ(c.read(cfgr), 0x5u);
}

TEST(Rcc, CrystalAndPllHaveTheirStartUpTimes)
{
    Chip c;
    c.supply_clocks();
    c.set(cr, hse_on);
    c.run_s(1.9e-3);
    EXPECT_EQ(c.read(cr) & hse_ready, 0u);
    c.run_s(0.2e-3);
    EXPECT_EQ(c.read(cr) & hse_ready, hse_ready);
    c.write(pllcfgr, 0x01005513); // HSE, M 2, N 85, R 2
    c.set(cr, pll_on);
    c.run_s(39e-6);
    EXPECT_EQ(c.read(cr) & pll_ready, 0u);
    c.run_s(2e-6);
    EXPECT_EQ(c.read(cr) & pll_ready, pll_ready);
    EXPECT_EQ(c.take_error(), "");
}

TEST(Rcc, Reaches170MHzAndKeepsTheTime)
{
    Chip c;
    c.supply_clocks();
    c.clock_170MHz();
    EXPECT_EQ(c.take_error(), "");
    EXPECT_EQ(c.chip->rcc.clock_Hz, 170000000u);
    EXPECT_EQ(c.read(cfgr), 0xFu);
    double before_s = rcc_seconds(&c.chip->rcc);
    c.run(170000);
    EXPECT_NEAR(rcc_seconds(&c.chip->rcc) - before_s, 1e-3, 1e-9);
}

TEST(Rcc, PllWithoutItsSource)
{
    Chip c;
    c.write(pllcfgr, 0x01005513);
    c.set(cr, pll_on);
    EXPECT_EQ(c.take_error(), "RCC_CR: PLL on before its source is ready");
}

TEST(Rcc, PllOutsideItsRanges)
{
    Chip c;
    c.write(pllcfgr, 0x01005502); // HSI / 1, N 85: 1360 MHz
    c.set(cr, pll_on);
    EXPECT_NE(c.take_error().find("outside their ranges"), std::string::npos);
}

TEST(Rcc, SwitchToAClockThatIsNotReady)
{
    Chip c;
    c.write(cfgr, 3);
    EXPECT_EQ(c.take_error(), "RCC_CFGR: switch to source 3, which is not ready");
    EXPECT_EQ(c.chip->rcc.clock_Hz, 16000000u);
}

// Everything but one step of the way to 170 MHz
void climb(Chip *c, bool boost, uint32_t wait_states, bool half, double rest_s)
{
    c->supply_clocks();
    c->set(cr, hse_on);
    c->run_s(3e-3);
    c->write(pllcfgr, 0x01005513);
    c->set(cr, pll_on);
    c->run_s(50e-6);
    c->write(cr5, boost ? 0 : 0x100);
    c->write(acr, 0x40700 | wait_states);
    c->write(cfgr, half ? 0x83 : 0x03);
    c->run_s(rest_s);
    c->write(cfgr, 0x03);
}

TEST(Rcc, TheWayTo170MHzHasItsConditions)
{
    struct {
        bool boost;
        uint32_t wait_states;
        bool half;
        double rest_s;
        const char *error;
    } cases[] = {
        {true, 4, true, 2e-6, ""},
        {false, 5, true, 2e-6, "RCC: 170.0 MHz is too fast for this voltage range"},
        {true, 3, true, 2e-6, "FLASH_ACR: 3 wait states are too few for 170.0 MHz"},
        {true, 4, false, 2e-6, "RCC_CFGR: from 16.0 to 170.0 MHz without an AHB prescaler of 2 between"},
        {true, 4, true, 0.2e-6, "RCC_CFGR: the prescaler changes less than 1 us after the source"},
    };
    for (const auto &one : cases) {
        Chip c;
        climb(&c, one.boost, one.wait_states, one.half, one.rest_s);
        EXPECT_EQ(c.take_error(), one.error);
    }
}

TEST(Rcc, FewerWaitStatesAtFullSpeed)
{
    Chip c;
    c.supply_clocks();
    c.clock_170MHz();
    c.write(acr, 0x40703);
    EXPECT_EQ(c.take_error(), "FLASH_ACR: 3 wait states are too few for 170.0 MHz");
}

TEST(Rcc, ClockSecuritySwitchesToTheInternalClockAndSetsItsFlag)
{
    Chip c;
    c.all();
    c.set(cr, css_on);
    c.write(rig::tim1 + 0x20, 0x555);
    c.set(rig::tim1 + 0x44, 0x8000);
    ASSERT_TRUE(tim1_main_output(&c.chip->tim1));
    c.chip->wiring.oscillator_stopped = true;
    rcc_oscillator(&c.chip->rcc, true);
    EXPECT_EQ(c.take_error(), "");
    EXPECT_TRUE(c.line(nmi));
    EXPECT_EQ(c.chip->rcc.clock_Hz, 16000000u);
    EXPECT_EQ(c.read(cfgr) & 0xFu, 0x5u);
    EXPECT_EQ(c.read(cifr), 0x100u);
    EXPECT_FALSE(tim1_main_output(&c.chip->tim1));
    EXPECT_EQ(c.read(rig::tim1 + 0x10) & 0x2000u, 0x2000u);
    c.write(rig::tim1 + 0x10, 0); // stays while the cause lasts
    EXPECT_EQ(c.read(rig::tim1 + 0x10) & 0x2000u, 0x2000u);
    c.write(cicr, 0x100);
    EXPECT_FALSE(c.line(nmi));
    c.write(rig::tim1 + 0x10, 0);
    EXPECT_EQ(c.read(rig::tim1 + 0x10) & 0x2000u, 0u);
}

TEST(Rcc, ALowSupplyBreaksTheTimerOnceTheDetectorIsLocked)
{
    constexpr uint32_t cr2 = rig::pwr + 0x04, cfgr2 = 0x4001001C;
    Chip c;
    c.all();
    c.write(cr2, 0xD); // 2.90 V
    c.set(rig::tim1 + 0x44, 0x8000);
    c.chip->wiring.supply_V = 2.85;
    tim1_check_break(&c.chip->tim1);
    EXPECT_TRUE(tim1_main_output(&c.chip->tim1)); // not connected
    c.write(cfgr2, 0x4);
    c.write(cr2, 0); // locked
    EXPECT_EQ(c.read(cr2), 0xDu);
    EXPECT_FALSE(tim1_main_output(&c.chip->tim1));
    EXPECT_EQ(c.read(rig::tim1 + 0x10) & 0x2000u, 0x2000u);
    c.chip->wiring.supply_V = 2.95;
    c.write(rig::tim1 + 0x10, 0);
    EXPECT_EQ(c.read(rig::tim1 + 0x10) & 0x2000u, 0u);
}

TEST(Rcc, APllThatDoesNotLock)
{
    Chip c;
    c.chip->wiring.pll_fails = true;
    c.write(pllcfgr, 0x01005532);
    c.set(cr, pll_on);
    c.run_s(1e-3);
    EXPECT_EQ(c.read(cr) & pll_ready, 0u);
}

TEST(Rcc, ACrystalThatStopsWithoutSecurityEndsTheRun)
{
    Chip c;
    c.all();
    c.chip->wiring.oscillator_stopped = true;
    rcc_oscillator(&c.chip->rcc, true);
    EXPECT_NE(c.take_error().find("no CSS is on"), std::string::npos);
}

TEST(Rcc, ACrystalThatNeverStarts)
{
    Chip c;
    c.chip->wiring.oscillator_stopped = true;
    c.set(cr, hse_on);
    c.run_s(50e-3);
    EXPECT_EQ(c.read(cr) & hse_ready, 0u);
    c.chip->wiring.oscillator_stopped = false;
    rcc_oscillator(&c.chip->rcc, false);
    c.run_s(3e-3);
    EXPECT_EQ(c.read(cr) & hse_ready, hse_ready);
}

TEST(Rcc, ResetCausesAddUpUntilRemoved)
{
    Chip c;
    EXPECT_EQ(c.read(csr) & 0xFE000000u, RCC_POWER_RESET | RCC_PIN_RESET);
    c.write(csr, c.read(csr) | 0x800000);
    EXPECT_EQ(c.read(csr) & 0xFE000000u, 0u);
    board_chip_reset(c.chip, RCC_WATCHDOG_RESET);
    EXPECT_EQ(c.read(csr) & 0xFE000000u, RCC_WATCHDOG_RESET | RCC_PIN_RESET);
    board_chip_reset(c.chip, RCC_SOFTWARE_RESET);
    EXPECT_EQ(c.read(csr) & 0xFE000000u, RCC_WATCHDOG_RESET | RCC_SOFTWARE_RESET | RCC_PIN_RESET);
    EXPECT_EQ(c.take_error(), "");
}

TEST(Rcc, NoClockChangeWhileTim1Counts)
{
    Chip c;
    c.all();
    c.write(cfgr, 0x83);
    EXPECT_EQ(c.take_error(), "RCC_CFGR: the clock changes while TIM1 counts");
}

} // namespace
