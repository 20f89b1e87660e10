// What block commutation is configured with, against the formulas of its headers in double precision.
#include <gtest/gtest.h>

#include <cmath>

#include "firmware/drive/config.h"
#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"
#include "tools/pmsim/machine_file.h"

namespace
{

using bench::kPi;
using bench::real;

// BLDC-FAN with a neutral: 40 V, 10 A, 400 rad/s at four pole pairs, 20 kHz of 4250 counts.
constexpr double kV = 40, kOmega = 1600, kPsi_Wb = 7.5e-3, kPsi_3_Wb = 0.6e-3;
constexpr double kCounts_Hz = 2 * 4250 * 20e3;
constexpr double kExact = 1e-6;

drive_params_t fan()
{
    pmsim::Setup setup = pmsim::load_machine_file("sim_plant/machines/bldc_fan.yaml");
    pmsim::derive_board_parameters(setup);
    drive_params_t p = *setup.params;
    p.emf_shape = 0;
    p.psi_3 = static_cast<int32_t>(std::lround(kPsi_3_Wb * 1e9));
    p.neutral_full_scale = 20000;
    p.neutral_filter = 10000;
    return p;
}

six_step_config_t configured(const drive_params_t &p)
{
    drive_config_t config = {};
    const drive_result_t result = drive_configure(&config, &p, PM_CHANNELS);
    EXPECT_TRUE(result.ok) << result.reason;
    return config.block.six_step;
}

drive_param_id_t refused(const drive_params_t &p, uint32_t channels = PM_CHANNELS)
{
    drive_config_t config = {};
    const drive_result_t result = drive_configure(&config, &p, channels);
    EXPECT_FALSE(result.ok);
    return result.param;
}

TEST(BlockConfig, TimesAreInCountsOfTheTimer)
{
    drive_params_t p = fan();
    p.t_lead = 1000;
    p.dead_time = 500;
    p.t_blank = 16000;
    const six_step_config_t c = configured(p);
    EXPECT_NEAR(c.commutation.turn_base, 2 * kPi * kCounts_Hz / kOmega, 0.5);
    EXPECT_NEAR(c.crossing.t_60, c.commutation.turn_base / 6.0, 0.5);
    EXPECT_EQ(c.crossing.blank, 2720); // 16 us of 170 MHz
    EXPECT_EQ(c.pattern.least, 2720 + 170 + 85);
    EXPECT_EQ(c.pattern.lead, 170);
    p.t_blank = 24000;
    EXPECT_EQ(refused(p), DRIVE_PARAM_t_blank); // 4080 and 255 of 4250
}

// Half of the sixty degrees between crossing and commutation, less the advance.
TEST(BlockConfig, CommutationIsThirtyDegreesLessTheAdvance)
{
    drive_params_t p = fan();
    for (const double advance_deg : {0.0, 6.0, 15.0}) {
        p.six_step_advance = static_cast<int32_t>(std::lround(advance_deg * 1000));
        EXPECT_NEAR(real(configured(p).commutation.half, 32), (30 - advance_deg) / 360, kExact)
            << advance_deg;
    }
}

// A sine of psi_m w rises at the open terminal by 3/2 of it a radian against the link, by two thirds of that against the mean
// of the terminals; a trapezoid by pi/2. The third harmonic of a sine by 9 psi_3 w, of a trapezoid by pi/6 psi_m w.
TEST(BlockConfig, TheSignalOfTheCrossingRisesAsTheEmf)
{
    const struct {
        int32_t reference, shape;
        double slope_Wb;
    } cases[] = {
        {CROSSINGS_open_terminal, 0, 1.5 * kPsi_Wb},  {CROSSINGS_open_terminal, 1, kPi / 2 * kPsi_Wb},
        {CROSSINGS_terminal_mean, 0, 1.0 * kPsi_Wb},  {CROSSINGS_terminal_mean, 1, kPi / 3 * kPsi_Wb},
        {CROSSINGS_virtual_third, 0, 1.5 * kPsi_Wb},  {CROSSINGS_virtual_third, 1, kPi / 2 * kPsi_Wb},
        {CROSSINGS_third_harmonic, 0, 9 * kPsi_3_Wb}, {CROSSINGS_third_harmonic, 1, kPi / 6 * kPsi_Wb},
    };
    for (const auto &x : cases) {
        drive_params_t p = fan();
        p.zero_reference = x.reference;
        p.emf_shape = x.shape;
        const six_step_config_t c = configured(p);
        EXPECT_NEAR(real(c.crossing.swing), x.slope_Wb * kPi / 3 * kOmega / kV, 1e-5)
            << x.reference << x.shape;
        EXPECT_EQ(c.crossing.curve, x.shape == 0 ? ZERO_CURVE_SINE : 0);
        EXPECT_EQ(c.crossing.reference, x.reference == CROSSINGS_terminal_mean ? ZERO_TERMINALS : ZERO_LINK);
        EXPECT_NEAR(real(c.crossing.rail), 0.35 / kV, kExact);
        const double most = x.reference == CROSSINGS_third_harmonic ? 36 : 12;
        EXPECT_NEAR(real(c.thresholds.most), p.v_dc_nominal * 1e-3 / most / kV, kExact);
    }
}

TEST(BlockConfig, AThirdHarmonicIsToldBySizeAndSign)
{
    for (const int sign : {1, -1}) {
        for (const int32_t shape : {0, 1}) {
            drive_params_t p = fan();
            p.zero_reference = CROSSINGS_third_harmonic;
            p.psi_3 *= sign;
            p.emf_shape = shape;
            const six_step_config_t c = configured(p);
            EXPECT_EQ(c.third.negative, sign < 0);
            EXPECT_EQ(c.third.trapezoid, shape != 0);
            EXPECT_NEAR(c.third.pi_rc, kPi * 10e-6 * kCounts_Hz, 0.5);
            // a third of what the terminal swings by, three times; of a trapezoid a ninth
            EXPECT_NEAR(real(c.missing.share), shape != 0 ? 1.0 / 9 : 2 * kPsi_3_Wb / kPsi_Wb, kExact);
            EXPECT_NEAR(real(c.missing.least), 16.0 / 2048 * 20 / kV, kExact);
            EXPECT_EQ(c.missing.rail, c.crossing.rail);
        }
    }
    drive_params_t p = fan();
    p.zero_reference = CROSSINGS_third_harmonic;
    p.psi_3 = 0;
    EXPECT_EQ(refused(p), DRIVE_PARAM_psi_3);
}

TEST(BlockConfig, OneSwitchOfALegNeedsABoardThatHasIt)
{
    constexpr uint32_t kBoth = PM_CHANNELS & ~NEEDS_ONE_SWITCH;
    drive_params_t p = fan();
    p.pattern = PATTERN_H_PWM_L_PWM;
    p.freewheeling = 1;
    EXPECT_EQ(refused(p, kBoth), DRIVE_PARAM_pattern);
    p.pattern = PATTERN_H_PWM_L_ON;
    p.freewheeling = 0;
    EXPECT_EQ(refused(p, kBoth), DRIVE_PARAM_freewheeling);
    p.freewheeling = 1;
    drive_config_t config = {};
    EXPECT_TRUE(drive_configure(&config, &p, kBoth).ok);
}

} // namespace
