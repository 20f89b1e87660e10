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
constexpr double kV = 40, kA = 10, kOmega = 1600, kPsi_Wb = 7.5e-3, kPsi_3_Wb = 0.6e-3;
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

TEST(BlockConfig, PatternAndLearningAreThoseOfTheParameters)
{
    drive_params_t p = fan();
    p.missed_crossings = 9;
    p.learn_vertical = 40;
    p.learn_horizontal = 70;
    for (const int32_t id : {PATTERN_H_PWM_L_PWM, PATTERN_H_PWM_L_ON, PATTERN_PWM_ON}) {
        p.pattern = id;
        p.freewheeling = id == PATTERN_PWM_ON ? 0 : 1;
        const six_step_config_t c = configured(p);
        EXPECT_EQ(c.pattern.id, id);
        EXPECT_EQ(c.pattern.complementary, id != PATTERN_PWM_ON);
        EXPECT_EQ(c.pattern.half_period, 4250);
        EXPECT_EQ(c.commutation.strikes, 9);
        EXPECT_EQ(c.commutation.delay, 0);
        EXPECT_NEAR(real(c.thresholds.k_V, 32), 1.5 * 0.04, kExact); // thresholds.h
        EXPECT_NEAR(real(c.thresholds.k_H, 32), 0.07, kExact);
    }
}

// The third harmonic has no terminal to be compared with: all bits of the threshold, or none.
TEST(BlockConfig, ThresholdsAreComparedWithTerminalsAlone)
{
    const struct {
        int32_t reference, compared;
    } cases[] = {{CROSSINGS_open_terminal, -1},
                 {CROSSINGS_terminal_mean, -1},
                 {CROSSINGS_third_harmonic, 0},
                 {CROSSINGS_virtual_third, 0}};
    for (const auto &x : cases) {
        drive_params_t p = fan();
        p.zero_reference = x.reference;
        EXPECT_EQ(configured(p).compared, x.compared) << x.reference;
    }
}

// Sixty degrees of it are a sixth of a turn, to half a count.
TEST(BlockConfig, SixtyDegreesAreRounded)
{
    drive_params_t p = fan();
    for (int k = 0; k < 60; ++k) {
        p.speed_trip += 101;
        const six_step_config_t c = configured(p);
        EXPECT_NEAR(c.crossing.t_60, c.commutation.turn_base / 6.0, 0.5) << c.commutation.turn_base;
    }
}

// patterns.h: b = 2 f_pwm (dead time + settling) of a period; line_current.h keeps u at what is shown.
TEST(BlockConfig, LowSideShuntsShowTheCurrentForAPartOfThePeriod)
{
    drive_params_t p = fan();
    p.dead_time = 500;
    p.t_blank = 3000;
    p.pattern = PATTERN_H_PWM_L_ON;
    for (const int32_t pattern : {PATTERN_H_PWM_L_PWM, PATTERN_H_PWM_L_ON, PATTERN_H_PWM_L_PWM_ALTERNATING}) {
        p.pattern = pattern;
        p.t_settle = 0; // shunts in the lines
        pattern_config_t c = configured(p).pattern;
        EXPECT_FALSE(c.low_side);
        EXPECT_EQ(c.shown, PM_ONE);
        EXPECT_EQ(c.most, PM_ONE);
        p.t_settle = 2000;
        const double b = 2 * 20e3 * (0.5e-6 + 2e-6);
        c = configured(p).pattern;
        EXPECT_TRUE(c.low_side);
        if (pattern == PATTERN_H_PWM_L_PWM) {
            EXPECT_LT(c.shown, 0); // the low leg: never, not even without voltage
            EXPECT_NEAR(real(c.most), 1 - 2 * b, 1e-5);
        } else {
            EXPECT_NEAR(real(c.shown), pattern == PATTERN_H_PWM_L_ON ? 1 - b : 1 - 2 * b, 1e-5);
            EXPECT_EQ(c.most, PM_ONE);
        }
        drive_config_t whole = {};
        ASSERT_TRUE(drive_configure(&whole, &p, PM_CHANNELS).ok);
        EXPECT_EQ(whole.block.current.most, c.most);
    }
    for (const int32_t holds : {PATTERN_H_ON_L_PWM, PATTERN_PWM_ON, PATTERN_ON_PWM}) {
        p.pattern = holds;
        p.t_settle = 2000;
        EXPECT_EQ(refused(p), DRIVE_PARAM_pattern) << holds;
        p.t_settle = 0;
        EXPECT_EQ(configured(p).pattern.id, holds);
    }
}

// Only what a method uses is asked of the board.
TEST(BlockConfig, CrossingsNeedTheirChannels)
{
    drive_params_t p = fan();
    p.zero_reference = CROSSINGS_third_harmonic;
    EXPECT_EQ(refused(p, PM_CHANNELS & ~NEEDS_NEUTRAL), DRIVE_PARAM_zero_reference);
    constexpr uint32_t kLeast = NEEDS_TERMINALS | NEEDS_SECOND_SAMPLE | NEEDS_HELD | NEEDS_COMMUTATE;
    p.zero_reference = CROSSINGS_open_terminal;
    p.pattern = PATTERN_H_PWM_L_ON;
    p.freewheeling = 1;
    p.psi_3 = 0; // not known, and not asked for
    drive_config_t config = {};
    const drive_result_t result = drive_configure(&config, &p, kLeast);
    EXPECT_TRUE(result.ok) << result.reason;
    EXPECT_EQ(config.block.six_step.third.pi_rc, 0);
}

// The psi_3 of a trapezoid is in its shape: of none in the parameters the sign is that of the shape.
TEST(BlockConfig, ATrapezoidNeedsNoThirdHarmonicOfItsOwn)
{
    drive_params_t p = fan();
    p.zero_reference = CROSSINGS_third_harmonic;
    p.emf_shape = 1;
    p.psi_3 = 0;
    EXPECT_FALSE(configured(p).third.negative);
}

// line_current.h: two phases in series.
TEST(BlockConfig, CurrentControlIsThatOfTwoPhases)
{
    drive_params_t p = fan();
    p.R_s = 400000; // uohm
    p.L_q = 500000; // nH
    p.current_bandwidth = 800000;
    drive_config_t config = {};
    const drive_result_t result = drive_configure(&config, &p, PM_CHANNELS);
    ASSERT_TRUE(result.ok) << result.reason;
    const double w = 2 * kPi * 800, Z = kV / kA;
    const double R = drive_param_get(&p, DRIVE_PARAM_R_s) * std::pow(10, drive_param_exp10[DRIVE_PARAM_R_s]);
    const double L = drive_param_get(&p, DRIVE_PARAM_L_q) * std::pow(10, drive_param_exp10[DRIVE_PARAM_L_q]);
    EXPECT_NEAR(R, 0.4, kExact);
    EXPECT_NEAR(L, 0.5e-3, kExact);
    const line_current_config_t &c = config.block.current;
    EXPECT_NEAR(real(c.pi.kp, 26), 2 * w * L / Z, kExact);
    EXPECT_NEAR(real(c.pi.ki, 26), 2 * w * R / 20e3 / Z, kExact);
    EXPECT_NEAR(real(c.pi.kb, 31), R / 20e3 / L, kExact); // ki / kp
    EXPECT_NEAR(real(c.R_2), 2 * R / Z, kExact);
}

// freewheeling.h: 2 E at base speed, of a trapezoid's flat top with psi_m of its fundamental, 1.5 E_m of a sine.
TEST(BlockConfig, FreewheelingIsToldResistanceInductanceAndEmf)
{
    for (const int32_t shape : {0, 1}) {
        drive_params_t p = fan();
        p.emf_shape = shape;
        p.R_s = 400000;
        p.L_q = 500000;
        drive_config_t config = {};
        ASSERT_TRUE(drive_configure(&config, &p, PM_CHANNELS).ok);
        const freewheeling_config_t &c = config.block.freewheeling;
        EXPECT_NEAR(real(c.R), 0.4 / (kV / kA), kExact);
        EXPECT_NEAR(real(c.L), 0.5e-3 * kOmega / (kV / kA), kExact);
        const double two_E_Wb = shape == 0 ? 1.5 * kPsi_Wb : 2 * kPi * kPi / 12 * kPsi_Wb;
        EXPECT_NEAR(real(c.emf), two_E_Wb * kOmega / kV, kExact);
    }
}

} // namespace
