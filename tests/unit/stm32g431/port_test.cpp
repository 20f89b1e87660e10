// The port's arithmetic on registers that are ordinary memory. What the hardware makes of them is for
// tests/contract/hal on the emulated board, and for the bench.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/ntc.h"
#include "hal/stm32g431/registers/analog.h"
#include "hal/stm32g431/registers/fdcan.h"
#include "hal/stm32g431/registers/gpio.h"
#include "hal/stm32g431/registers/tim.h"
#include "hal/stm32g431/registers/usart.h"

namespace
{

const hal_config_t good = {4250, 800, 0x4000, 500};

class Port : public ::testing::Test
{
  protected:
    void SetUp() override
    {
        std::memset(&port_hal, 0, sizeof port_hal);
        std::memset(const_cast<uint32_t *>(&TIM1.CR1), 0, sizeof TIM1);
        std::memset(const_cast<uint32_t *>(&FDCANRAM1.filters[0]), 0, sizeof FDCANRAM1);
    }
    hal_t *hal = &port_hal;
};

// RM0440, description of DTG, in periods of 170 MHz
uint32_t dead_clocks(uint32_t code)
{
    if (code < 0x80) {
        return code;
    }
    if (code < 0xC0) {
        return 2 * (64 + (code & 0x3F));
    }
    return (code < 0xE0 ? 8 : 16) * (32 + (code & 0x1F));
}

TEST_F(Port, DeadTimeIsTheNextThatTheTimerHas)
{
    for (uint32_t ns = 300; ns <= 5929; ++ns) {
        hal_config_t config = good;
        config.dead_time_ns = static_cast<uint16_t>(ns);
        ASSERT_EQ(bridge_start(hal, &config), HAL_OK) << ns;
        const uint32_t code = reg_value(TIM_BDTR_DTG, TIM1.BDTR);
        const double wanted = ns * 0.17;
        ASSERT_GE(dead_clocks(code), wanted - 1e-9) << ns;
        uint32_t next = 1008;
        for (uint32_t other = 0; other < 256; ++other) {
            if (dead_clocks(other) >= wanted - 1e-9) {
                next = std::min(next, dead_clocks(other));
            }
        }
        ASSERT_EQ(dead_clocks(code), next) << ns;
    }
}

TEST_F(Port, RefusalsLeaveTheRegisterOpen)
{
    const auto status_of = [this](auto change) {
        hal_config_t config = good;
        change(config);
        const hal_status_t status = bridge_start(hal, &config);
        EXPECT_EQ(status == HAL_OK, (TIM1.BDTR & TIM_BDTR_LOCK) != 0);
        EXPECT_GE(TIM1.ARR, 2125U);
        return status;
    };
    EXPECT_EQ(status_of([](hal_config_t &) {}), HAL_OK);
    EXPECT_EQ(status_of([](hal_config_t &c) { c.timer_counts = 2124; }), HAL_TIMER_COUNTS);
    EXPECT_EQ(status_of([](hal_config_t &c) { c.dead_time_ns = 299; }), HAL_DEAD_TIME);
    EXPECT_EQ(status_of([](hal_config_t &c) { c.dead_time_ns = 5930; }), HAL_DEAD_TIME);
    EXPECT_EQ(status_of([](hal_config_t &c) { c.break_level = 0x8000; }), HAL_BREAK_LEVEL);
}

TEST_F(Port, BreakLevelBehindTheAmplifier)
{
    // code of 16 bits at the amplifier's output, a sixteenth of it at the comparator, 12 bits
    const auto reference = [this](uint16_t level) {
        hal_config_t config = good;
        config.break_level = level;
        EXPECT_EQ(bridge_start(hal, &config), HAL_OK);
        EXPECT_EQ(DAC3.DHR12R1, DAC3.DHR12R2);
        return DAC3.DHR12R1;
    };
    EXPECT_EQ(reference(0x4000), 192U);
    EXPECT_EQ(reference(1), 128U);
    EXPECT_EQ(reference(0x7FFF), 255U);
    EXPECT_EQ(reference(0), 255U); // the most
}

TEST_F(Port, WritesLegsAndTrips)
{
    ASSERT_EQ(bridge_start(hal, &good), HAL_OK);
    drive_out_t out = {};
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        out.compare[leg][0] = out.compare[leg][1] = static_cast<uint16_t>(100 * (leg + 1));
    }
    out.legs = pm_legs_of(PM_LEG_PWM, PM_LEG_OFF, PM_LEG_PWM);
    ASSERT_TRUE(hal_bridge_arm(hal));
    hal_bridge_write(hal, &out);
    EXPECT_EQ(TIM1.CCR1, 100U);
    EXPECT_EQ(TIM1.CCR2, 200U);
    EXPECT_EQ(TIM1.CCR3, 300U);
    bridge_begin_period();
    EXPECT_EQ(TIM1.CCER, TIM_CCER_CC1E | TIM_CCER_CC1NE | TIM_CCER_CC3E | TIM_CCER_CC3NE);
    EXPECT_TRUE(hal_bridge_armed(hal));
    out.trip = true;
    hal_bridge_write(hal, &out);
    EXPECT_EQ(TIM1.CCER, 0U);
    EXPECT_FALSE(hal_bridge_armed(hal));
    hal->refused = true;
    EXPECT_FALSE(hal_bridge_arm(hal));
    EXPECT_FALSE(hal_bridge_armed(hal));
}

// RM0440 28.3.17 and the table of outputs. They wait for the COM event with which the next control interrupt begins.
TEST_F(Port, EachStateOfALegHasItsOutputsAndMode)
{
    const struct {
        pm_leg_t state;
        uint32_t outputs, mode;
    } rows[] = {{PM_LEG_OFF, 0, 6},      {PM_LEG_PWM, 5, 6},           {PM_LEG_UPPER, 1, 6},
                {PM_LEG_LOWER, 4, 7},    {PM_LEG_HIGH, 5, 5},          {PM_LEG_LOW, 5, 4},
                {PM_LEG_INVERTED, 5, 7}, {PM_LEG_LOWER_INVERTED, 4, 6}};
    ASSERT_EQ(bridge_start(hal, &good), HAL_OK);
    EXPECT_EQ(TIM1.CR2 & TIM_CR2_CCPC, TIM_CR2_CCPC);
    for (const auto &row : rows) {
        for (uint32_t leg = 0; leg < 3; ++leg) {
            drive_out_t out = {};
            out.legs = static_cast<uint16_t>(PM_LEGS_PWM & ~(15U << 4 * leg)) |
                       static_cast<uint16_t>(row.state << 4 * leg);
            hal_bridge_write(hal, &out);
            bridge_begin_period();
            EXPECT_EQ(TIM1.CCER, (0x555U & ~(15U << 4 * leg)) | row.outputs << 4 * leg);
            const uint32_t modes[] = {reg_value(TIM_CCMR1_OC1M, TIM1.CCMR1),
                                      reg_value(TIM_CCMR1_OC2M, TIM1.CCMR1),
                                      reg_value(TIM_CCMR2_OC3M, TIM1.CCMR2)};
            for (uint32_t other = 0; other < 3; ++other) {
                EXPECT_EQ(modes[other], other == leg ? row.mode : 6U);
            }
            EXPECT_EQ(reg_value(TIM_CCMR2_OC4M, TIM1.CCMR2), 7U);
            EXPECT_EQ(TIM1.CCMR1 & 0x808U, 0x808U);
            EXPECT_EQ(TIM1.CCMR2 & 0x808U, 0x808U);
        }
    }
}

TEST_F(Port, ACommutationHasItsInstantAndItsLegs)
{
    ASSERT_EQ(bridge_start(hal, &good), HAL_OK);
    drive_out_t out = {};
    out.legs = PM_LEGS_PWM;
    out.instants.then = PM_LEGS_ALL(PM_LEG_LOWER);
    for (const uint32_t at : {1U, 509U, 510U, 4251U, 8499U}) {
        out.instants.commutate_at = static_cast<uint16_t>(at);
        hal_bridge_write(hal, &out);
        EXPECT_EQ(TIM3.CCR1, std::max<uint32_t>(at, 510));
        TIM1.EGR = 0;
        bridge_begin_period();
        EXPECT_EQ(TIM1.EGR, TIM_EGR_COMG);
        EXPECT_EQ(TIM1.CCER, 0x444U); // waits for the instant
    }
    out.instants.commutate_at = 0;
    hal_bridge_write(hal, &out);
    bridge_begin_period();
    EXPECT_EQ(TIM3.CCR1, 0U);
    EXPECT_EQ(TIM1.CCER, 0x555U);
    out.instants.commutate_at = 4000;
    hal_bridge_write(hal, &out);
    bridge_begin_period();
    out.trip = 1; // ahead of the instant
    hal_bridge_write(hal, &out);
    EXPECT_EQ(TIM1.CCER, 0U);
    bridge_begin_period();
    EXPECT_EQ(TIM1.CCER, 0U);
}

// The converters start ahead of it, where their sequence ends between those of the zero vectors; else they are busy.
TEST_F(Port, ASampleHasItsInstant)
{
    ASSERT_EQ(bridge_start(hal, &good), HAL_OK);
    bridge_run();
    EXPECT_EQ(TIM4.CR1, TIM_CR1_CEN);
    drive_out_t out = {};
    const struct {
        uint16_t at;
        uint32_t ccr;
    } rows[] = {{0, 85}, {1, 85}, {709, 85}, {710, 510}, {4250, 4050}, {8200, 8000}, {8201, 85}, {8499, 85}};
    for (const auto &row : rows) {
        out.instants.sample_at[0] = row.at;
        hal_bridge_write(hal, &out);
        EXPECT_EQ(TIM4.CCR1, row.ccr) << row.at;
    }
}

// By the counter the sequence within the period is told from that of its start.
TEST_F(Port, ASampleIsDeliveredOnce)
{
    drive_in_t in = {};
    TIM4.CNT = 600;
    EXPECT_FALSE(measure_is_within());
    TIM4.CNT = 510 + 337;
    EXPECT_TRUE(measure_is_within());
    ADC1.JDR1 = 100;
    ADC2.JDR1 = 200;
    ADC1.JDR2 = 300;
    ADC1.JDR3 = 400;
    hal_measure(hal, &in);
    EXPECT_EQ(in.more.sampled, 0U);
    measure_take_sample();
    ADC1.JDR1 = 2048; // of the zero vector
    hal_measure(hal, &in);
    EXPECT_TRUE(pm_sampled(&in.more, 0));
    EXPECT_EQ(in.more.i_sample[0][0], 65535U - 1600U);
    EXPECT_EQ(in.more.i_sample[0][1], 65535U - 3200U);
    EXPECT_EQ(in.more.i_sample[0][2], 65535U - 4800U);
    EXPECT_EQ(in.more.v_neutral_sample[0], 6400U);
    EXPECT_EQ(in.i_leg[0], 0x7FFFU);
    hal_measure(hal, &in);
    EXPECT_EQ(in.more.sampled, 0U);
}

TEST_F(Port, DeclaresWhatIsWired)
{
    EXPECT_EQ(hal_channels(hal), NEEDS_NEUTRAL | NEEDS_SECOND_SAMPLE | NEEDS_HELD | NEEDS_ONE_SWITCH |
                                     NEEDS_COMMUTATE | PM_BOOTSTRAP);
}

TEST_F(Port, CurrentsAreTurned)
{
    drive_in_t in = {};
    for (uint32_t code = 0; code < 4096; ++code) {
        ADC1.JDR1 = code;
        ADC2.JDR1 = 4095 - code;
        ADC1.JDR2 = 2048;
        ADC2.JDR2 = code;
        ADC1.JDR3 = code;
        hal_measure(hal, &in);
        ASSERT_EQ(in.i_leg[0], 65535U - 16U * code);
        ASSERT_EQ(in.i_leg[1], 65535U - 16U * (4095U - code));
        ASSERT_EQ(in.i_leg[2], 0x7FFFU);
        ASSERT_EQ(in.v_dc, 16U * code);
        ASSERT_EQ(in.more.v_neutral, 16U * code);
    }
}

TEST_F(Port, BreakIsReportedAndThenCleared)
{
    drive_in_t in = {};
    TIM1.SR = TIM_SR_BIF;
    EXPECT_FALSE(hal_bridge_arm(hal)); // which would hide it
    EXPECT_EQ(TIM1.SR, TIM_SR_BIF);
    hal_measure(hal, &in);
    EXPECT_TRUE(in.hw_fault);
    EXPECT_EQ(TIM1.SR, ~TIM_SR_BIF); // flags are cleared by zeros
    TIM1.SR = ~(TIM_SR_BIF | TIM_SR_SBIF);
    hal_measure(hal, &in);
    EXPECT_FALSE(in.hw_fault);
    EXPECT_EQ(TIM1.SR, ~(TIM_SR_BIF | TIM_SR_SBIF));
}

TEST_F(Port, SlowInputsTakeTurns)
{
    hal_slow_t slow = {};
    VREFINT.CAL = 1654;
    measure_run(hal);
    ADC1.ISR = ADC_ISR_EOC;
    ADC1.DR = 1309; // 25 degC
    hal_measure_slow(hal, &slow);
    EXPECT_NEAR(slow.temperature_dC, 250, 10);
    EXPECT_FALSE(slow.temperature_missing);
    EXPECT_FALSE(slow.reference_off);
    EXPECT_EQ(reg_value(ADC_SQR1_SQ1, ADC1.SQR1), 11U);
    ADC1.DR = 4095;
    hal_measure_slow(hal, &slow);
    EXPECT_EQ(slow.dial, 4095U * 16U);
    EXPECT_EQ(reg_value(ADC_SQR1_SQ1, ADC1.SQR1), 18U);
    hal_measure_slow(hal, &slow);
    EXPECT_TRUE(slow.reference_off);
    EXPECT_EQ(reg_value(ADC_SQR1_SQ1, ADC1.SQR1), 5U);
    hal_measure_slow(hal, &slow);
    EXPECT_TRUE(slow.temperature_missing);
    GPIOC.IDR = 1U << 10;
    hal_measure_slow(hal, &slow);
    EXPECT_FALSE(slow.button);
    GPIOC.IDR = 0;
    hal_measure_slow(hal, &slow);
    EXPECT_TRUE(slow.button);
}

// 1.212 V against the supply: 5 % of it either way.
TEST_F(Port, TheReferenceIsHeldToFivePerCent)
{
    VREFINT.CAL = 1654; // at 3.0 V
    for (double supply_V = 2.9; supply_V < 3.7; supply_V += 0.01) {
        const double off = 3.3 / supply_V - 1;
        if (std::abs(std::abs(off) - 0.05) < 0.002) {
            continue; // rounding
        }
        hal->turn = PORT_REFERENCE;
        ADC1.ISR = ADC_ISR_EOC;
        ADC1.DR = static_cast<uint32_t>(1.212 / supply_V * 4096);
        hal_slow_t slow = {};
        hal_measure_slow(hal, &slow);
        EXPECT_EQ(slow.reference_off, std::abs(off) > 0.05) << supply_V;
    }
}

TEST_F(Port, CanBitTimes)
{
    for (const int kbit_s : {125, 250, 500, 1000}) {
        hal_config_t config = good;
        config.can_kbit_s = static_cast<uint16_t>(kbit_s);
        ASSERT_EQ(can_start(&config), HAL_OK);
        const uint32_t word = FDCAN1.NBTP;
        const uint32_t before = 1 + reg_value(FDCAN_NBTP_NTSEG1, word) + 1;
        const uint32_t quanta = before + reg_value(FDCAN_NBTP_NTSEG2, word) + 1;
        const uint32_t divider = reg_value(FDCAN_NBTP_NBRP, word) + 1;
        EXPECT_EQ(divider * quanta * static_cast<uint32_t>(kbit_s), 170000U);
        EXPECT_NEAR(static_cast<double>(before) / quanta, 0.875, 0.01); // CiA 301
        EXPECT_LE(reg_value(FDCAN_NBTP_NSJW, word), reg_value(FDCAN_NBTP_NTSEG2, word));
    }
    hal_config_t config = good;
    config.can_kbit_s = 800;
    EXPECT_EQ(can_start(&config), HAL_CAN_BIT_RATE);
}

TEST_F(Port, CanFramesKeepTheirBytes)
{
    const hal_can_frame_t sent = {0x7A5, 8, {1, 2, 3, 0xFF, 5, 0x80, 7, 8}};
    FDCAN1.TXFQS = reg_field(FDCAN_TXFQS_TFQPI, 2);
    ASSERT_TRUE(hal_can_send(hal, &sent));
    EXPECT_EQ(FDCAN1.TXBAR, 4U);
    const fdcan_element_t &element = FDCANRAM1.TXBUF[2];
    EXPECT_EQ(element.HEAD, 0x7A5U << 18);
    EXPECT_EQ(element.DATA[0], 0xFF030201U);

    for (int n = 0; n < 2; ++n) {
        FDCANRAM1.RXFIFO0[1].HEAD = element.HEAD;
        FDCANRAM1.RXFIFO0[1].FORM = element.FORM;
        FDCANRAM1.RXFIFO0[1].DATA[n] = element.DATA[n];
    }
    can_take_element(&port_hal.can, &FDCANRAM1.RXFIFO0[1]);
    hal_can_frame_t got = {};
    ASSERT_TRUE(hal_can_receive(hal, &got));
    EXPECT_EQ(got.id, sent.id);
    EXPECT_EQ(got.length, sent.length);
    EXPECT_EQ(std::memcmp(got.data, sent.data, 8), 0);
    EXPECT_FALSE(hal_can_receive(hal, &got));
    FDCAN1.TXFQS = FDCAN_TXFQS_TFQF;
    EXPECT_FALSE(hal_can_send(hal, &sent));
}

TEST_F(Port, CanRingCountsWhatIsLost)
{
    for (uint32_t n = 0; n < PORT_CAN_FRAMES + 3; ++n) {
        FDCANRAM1.RXFIFO0[0].HEAD = reg_field(FDCAN_HEAD_ID, n);
        can_take_element(&port_hal.can, &FDCANRAM1.RXFIFO0[0]);
    }
    EXPECT_EQ(hal_can_lost(hal), 3U);
    hal_can_frame_t frame = {};
    for (uint32_t n = 0; n < PORT_CAN_FRAMES; ++n) {
        ASSERT_TRUE(hal_can_receive(hal, &frame));
        EXPECT_EQ(frame.id, n);
    }
    EXPECT_FALSE(hal_can_receive(hal, &frame));
}

TEST_F(Port, ConsoleRing)
{
    const std::string line(PORT_CONSOLE_SIZE - 56, 'x');
    EXPECT_EQ(hal_console(hal, line.c_str()), line.size());
    EXPECT_EQ(hal_console(hal, line.c_str()), 56U);
    USART2.ISR = USART_ISR_TXE;
    for (uint32_t n = 0; n < PORT_CONSOLE_SIZE; ++n) {
        port_console_sent();
        ASSERT_EQ(USART2.TDR, static_cast<uint32_t>('x'));
    }
    EXPECT_NE(USART2.CR1 & USART_CR1_TXEIE, 0U);
    port_console_sent();
    EXPECT_EQ(USART2.CR1 & USART_CR1_TXEIE, 0U);
}

TEST_F(Port, StoreStaysInside)
{
    const uint32_t data[2] = {1, 2};
    (void)hal_store_write(hal, 1, HAL_STORE_PAGE_SIZE - 8U, data, 8); // its flags need the controller
    EXPECT_EQ(hal_store_page(hal, 1)[HAL_STORE_PAGE_SIZE / 4U - 1U], 2U);
    EXPECT_FALSE(hal_store_write(hal, 1, HAL_STORE_PAGE_SIZE, data, 8));
    EXPECT_FALSE(hal_store_write(hal, 2, 0, data, 8));
    EXPECT_FALSE(hal_store_write(hal, 0, 4, data, 8));
    EXPECT_FALSE(hal_store_write(hal, 0, 0, data, 4));
    EXPECT_FALSE(hal_store_write(hal, 0, UINT32_MAX - 7U, data, 8));
    TIM1.BDTR = TIM_BDTR_MOE;
    EXPECT_FALSE(hal_store_erase(hal, 0));
    EXPECT_FALSE(hal_store_write(hal, 0, 0, data, 8));
}

TEST(Ntc, IsTheCurve)
{
    for (double degC = -40.0; degC <= 150.0; degC += 0.5) {
        const double ohm = 10e3 * std::exp(3380.0 * (1.0 / (degC + 273.15) - 1.0 / 298.15));
        const double code = 4096.0 * 4700.0 / (4700.0 + ohm);
        int32_t dC = 0;
        ASSERT_TRUE(ntc_temperature(static_cast<uint32_t>(std::lround(code)), &dC)) << degC;
        ASSERT_NEAR(0.1 * dC, degC, 1.2) << degC; // with half a step of the converter
    }
}

TEST(Ntc, BrokenOrShorted)
{
    int32_t dC = 0;
    for (const uint32_t code : {0U, 39U, 4001U, 4095U}) {
        EXPECT_FALSE(ntc_temperature(code, &dC)) << code;
        EXPECT_EQ(dC, 1500); // what is not known is hot
    }
    EXPECT_TRUE(ntc_temperature(40, &dC));
    EXPECT_TRUE(ntc_temperature(4000, &dC));
}

} // namespace
