// Configurations of the low-speed sources against the formulas of their headers, for IPM-1000's defaults: 10 kHz, 540 rad/s.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "firmware/params/parameters.h"
#include "injection/saliency.h"
#include "tests/contract/bench.h"

namespace
{

using bench::real;

constexpr double kF_pwm = 10e3, kOmega = 540;

drive_params_t with(int32_t injection)
{
    drive_params_t p;
    drive_params_default(&p);
    p.injection = injection;
    p.start_method = 1;
    return p;
}

// Its answer is that of dL_0, not of the currents: tests/unit/injection/zero_sequence_test.cpp.
bool at_neutral(int32_t id)
{
    return id == INJECTION_zero_anti_rotating || id == INJECTION_zero_rotating ||
           id == INJECTION_zero_pulsating || id == INJECTION_zero_pair_anti_rotating ||
           id == INJECTION_zero_pair_rotating;
}

drive_config_t configure(const drive_params_t &p)
{
    drive_config_t c = {};
    const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_TRUE(r.ok) << r.reason;
    return c;
}

// A mean of two samples is half a period old: current control up to f_pwm / 20, whatever it is set to.
TEST(InjectionConfig, SquareWavesSlowCurrentControl)
{
    for (const int32_t id : {INJECTION_pulsating_square, INJECTION_stationary_square}) {
        for (const double set_Hz : {300.0, 490.0, 510.0, 800.0, 1000.0}) {
            drive_params_t p = with(id);
            p.current_bandwidth = static_cast<int32_t>(std::lround(set_Hz * 1e3));
            const double share = std::min(1.0, kF_pwm / 20 / set_Hz);
            EXPECT_NEAR(real(configure(p).position.current_low, 31), share, 1e-6) << id << ' ' << set_Hz;
        }
    }
}

// Sines: half a window and 1.5 periods are a phase of 0.4 rad at the bandwidth of current control and of 0.2 rad at that of
// the position loop.
TEST(InjectionConfig, SinesSlowCurrentControlByTheirWindow)
{
    for (const int32_t id : {INJECTION_pulsating_sine, INJECTION_rotating_sine, INJECTION_stationary_sine}) {
        for (const int n : {10, 20}) {
            drive_params_t p = with(id);
            p.f_injection = static_cast<int32_t>(
                std::lround(kF_pwm / n * std::pow(10, -drive_param_exp10[DRIVE_PARAM_f_injection])));
            const double delay = (n + 2) / 2.0 / kF_pwm;
            p.current_bandwidth = 500000;
            p.injection_bandwidth = 1000;
            EXPECT_NEAR(real(configure(p).position.current_low, 31),
                        std::min(1.0, 0.4 / (2 * bench::kPi * delay) / 500), 1e-6)
                << id << ' ' << n;
            const double most_Hz = 0.2 / (2 * bench::kPi * delay);
            for (const double share : {0.99, 1.01}) {
                p.injection_bandwidth = static_cast<int32_t>(std::lround(share * most_Hz * 1e3));
                drive_config_t c = {};
                const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
                EXPECT_EQ(!r.ok && r.param == DRIVE_PARAM_injection_bandwidth, share > 1) << id << ' ' << n;
            }
        }
    }
}

// By half a period the mean of two samples is late.
TEST(InjectionConfig, SquareWavesTurnByHalfAPeriod)
{
    const double half = kOmega / kF_pwm / 2;
    EXPECT_NEAR(
        real(configure(with(INJECTION_pulsating_square)).position.injection.pulsating_square.half_step, 32),
        half, 1e-8);
    EXPECT_NEAR(
        real(configure(with(INJECTION_stationary_square)).position.injection.stationary_square.half_step, 32),
        half, 1e-8);
}

// Left to itself (start_method 0) the drive injects where there is a saliency of more than 5 % of L_q at zero current.
TEST(InjectionConfig, SaliencyOfFivePerCentIsEnough)
{
    for (int32_t id = 0; id < INJECTION_COUNT; ++id) {
        if (at_neutral(id)) {
            continue;
        }
        for (const double share : {0.045, 0.055}) {
            drive_params_t p = with(id);
            p.start_method = 0;
            p.i_noise = 1;
            p.L_d = static_cast<int32_t>(std::lround((1 - share) * p.L_q));
            drive_config_t c = {};
            drive_configure(&c, &p, PM_CHANNELS);
            EXPECT_EQ(c.injection, share > 0.05) << id << ' ' << share;
        }
    }
}

// And not where noise hides the answer.
// One that is not of the list has no traits: no parameter outside its range makes it ambiguous.
TEST(InjectionConfig, ASourceThatIsNoneHasNoTraits)
{
    EXPECT_NE(injection_traits(INJECTION_rotating_sine), 0U);
    EXPECT_EQ(injection_traits(INJECTION_COUNT), 0U);
}

TEST(InjectionConfig, AnswerMustExceedTheNoise)
{
    for (int32_t id = 0; id < INJECTION_COUNT; ++id) {
        if (at_neutral(id)) {
            continue;
        }
        drive_params_t p = with(id);
        p.start_method = 0;
        p.i_noise = 1;
        drive_config_t c = {};
        drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_TRUE(c.injection) << id;
        p.i_noise = 400000;
        drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_FALSE(c.injection) << id;
    }
}

// Half the difference of two samples: V T (L_q - L_d) / (2 L_d L_q) across d, against four times the noise.
TEST(InjectionConfig, AnswerOfThePulsatingSquareIsItsFormula)
{
    drive_params_t p = with(INJECTION_pulsating_square);
    p.start_method = 0;
    const double L_d = p.L_d * 1e-9, L_q = p.L_q * 1e-9, flux = p.v_injection * 1e-3 / kF_pwm;
    const double answer_mA = 1e3 * flux * (L_q - L_d) / (2 * L_d * L_q);
    for (const double share : {0.9, 1.1}) {
        const drive_param_info_t &info = drive_param_table[DRIVE_PARAM_i_noise];
        p.i_noise = static_cast<int32_t>(
            std::lround(share * answer_mA / 4 * std::pow(10, -3 - drive_param_exp10[DRIVE_PARAM_i_noise])));
        ASSERT_GE(p.i_noise, info.min);
        drive_config_t c = {};
        drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_EQ(c.injection, share < 1) << share;
    }
}

// The negative sequence of a sine, V_h / (2 omega_h) (1 / L_d - 1 / L_q), with x / sin x for the staircase, read over N
// samples, against four times the noise.
TEST(InjectionConfig, AnswerOfTheStationarySineIsItsFormula)
{
    drive_params_t p = with(INJECTION_stationary_sine);
    p.start_method = 0;
    const auto si = [&p](drive_param_id_t id) {
        return drive_param_get(&p, id) * std::pow(10, drive_param_exp10[id]);
    };
    const double N = std::round(kF_pwm / si(DRIVE_PARAM_f_injection)), x = bench::kPi / N;
    const double flux = si(DRIVE_PARAM_v_injection) / (2 * x * kF_pwm) * x / std::sin(x);
    const double I_n = flux / 2 * (1 / si(DRIVE_PARAM_L_d) - 1 / si(DRIVE_PARAM_L_q));
    for (const double share : {0.9, 1.1}) {
        p.i_noise = static_cast<int32_t>(std::lround(share * I_n * std::sqrt(N / 2) / 4 *
                                                     std::pow(10, -drive_param_exp10[DRIVE_PARAM_i_noise])));
        drive_config_t c = {};
        drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_EQ(c.injection, share < 1) << share;
    }
}

// 5.4: the saliency of the negative sequence leads the magnets by half of atan(-L_dq / L_sd), at half and full rated current.
TEST(InjectionConfig, ShiftIsHalfTheAngleOfTheCoupling)
{
    drive_params_t p = with(INJECTION_rotating_sine);
    const double unit = std::pow(10, drive_param_exp10[DRIVE_PARAM_cross_half]);
    p.cross_half = static_cast<int32_t>(std::lround(-0.02 / unit));
    const saliency_config_t c = configure(p).position.injection.rotating_sine.saliency;
    const auto shift = [](double L_d, double L_q, double L_dq) {
        return std::atan2(-L_dq, (L_q - L_d) / 2) / 2;
    };
    const double i_rated = p.i_rated * 1e-3 / (p.i_full_scale * 1e-3);
    const double L_d = p.L_d + (p.L_dh_rated - p.L_d) / 4.0, L_q = p.L_q + (p.L_qh_rated - p.L_q) / 4.0;
    const auto of = [&](double share) {
        return real(saliency_shift(&c, static_cast<pm_q_t>(std::lround(share * i_rated * PM_ONE))));
    };
    EXPECT_NEAR(of(1), shift(p.L_dh_rated, p.L_qh_rated, p.L_dqh_rated), 1e-4);
    EXPECT_NEAR(of(0.5), shift(L_d, L_q, -0.02 * L_q), 1e-4);
    EXPECT_NEAR(of(-1), -of(1), 1e-6);
}

// Three times I_p of the rotating sine, unless more is told: below, the carrier governs the signs of the currents.
TEST(InjectionConfig, RotatingSineWidensTheZoneOfTheCompensation)
{
    const auto zone_A = [](const drive_params_t &p) { // per_zone is its inverse
        return 1 / double(configure(p).modulator.per_zone[0]);
    };
    drive_params_t p = with(INJECTION_rotating_sine), none = p;
    none.start_method = 2;
    const auto si = [&p](drive_param_id_t id) {
        return drive_param_get(&p, id) * std::pow(10, drive_param_exp10[id]);
    };
    const double N = std::round(kF_pwm / si(DRIVE_PARAM_f_injection)), x = bench::kPi / N;
    const double flux = si(DRIVE_PARAM_v_injection) / (2 * x * kF_pwm) * x / std::sin(x);
    const double i_p = flux / 2 * (1 / si(DRIVE_PARAM_L_d) + 1 / si(DRIVE_PARAM_L_q));
    EXPECT_NEAR(zone_A(p) / zone_A(none), 3 * i_p / si(DRIVE_PARAM_comp_zone),
                1e-3 * 3 * i_p / si(DRIVE_PARAM_comp_zone));
    p.comp_zone = static_cast<int32_t>(std::lround(4000 * i_p));
    drive_params_t told = p;
    told.start_method = 2;
    EXPECT_EQ(zone_A(p), zone_A(told));
}

// The positive sequence, in proportion to (L_d + L_q) / (L_d L_q - L_dq^2), grows with the current as the inductances fall.
TEST(InjectionConfig, PositiveSequenceFollowsTheInductances)
{
    const drive_params_t p = with(INJECTION_rotating_sine);
    const saliency_config_t c = configure(p).position.injection.rotating_sine.saliency;
    const auto sum = [](double L_d, double L_q, double L_dq) {
        return (L_d + L_q) / (L_d * L_q - L_dq * L_dq);
    };
    const double zero = sum(p.L_d, p.L_q, 0), rated = sum(p.L_dh_rated, p.L_qh_rated, p.L_dqh_rated);
    const auto i_rated = static_cast<pm_q_t>(std::lround(double(p.i_rated) / p.i_full_scale * PM_ONE));
    EXPECT_GT(rated / zero, 1.1);
    for (const pm_q_t i_q : {i_rated, -i_rated}) {
        EXPECT_NEAR(real(saliency_i_p(&c, i_q)) / real(saliency_i_p(&c, 0)), rated / zero, 1e-4);
    }
}

// What follows the axis of the saliency has none to follow there.
TEST(InjectionConfig, NoSaliencyAtRatedCurrentIsRefusedToSourcesOfTheStator)
{
    for (const int32_t id : {INJECTION_rotating_sine, INJECTION_stationary_square}) {
        drive_params_t p = with(id);
        p.L_qh_rated = p.L_dh_rated - 1000000;
        p.L_dqh_rated = 0;
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_FALSE(r.ok) << id;
        EXPECT_EQ(r.param, DRIVE_PARAM_L_dqh_rated) << id;
        p.start_method = 0;
        EXPECT_FALSE(configure(p).injection) << id;
    }
}

// Of the parabola of the slope through what there is without current and at rated current; L_d, L_q and L_dq at rated current.
TEST(InjectionConfig, CurrentEndsBeforeTheSaliency)
{
    struct saturated_t {
        double L_d, L_q, L_dq; // of L_q without current
    };
    for (const int32_t id : {INJECTION_pulsating_square, INJECTION_pulsating_sine}) {
        for (const saturated_t &x :
             {saturated_t{0.5, 0.7, 0}, saturated_t{0.5, 0.5, 0}, saturated_t{0.5, 0.48, 0.05},
              saturated_t{0.5, 0.4, 0}, saturated_t{0.5, 0.99, 0}}) {
            drive_params_t p = with(id);
            p.L_d = p.L_q / 2;
            p.L_dh_rated = static_cast<int32_t>(x.L_d * p.L_q);
            p.L_qh_rated = static_cast<int32_t>(x.L_q * p.L_q);
            p.L_dqh_rated = static_cast<int32_t>(x.L_dq * p.L_q);
            const double slope_0 = 0.5 / 0.5;
            const double slope_r =
                (x.L_q - x.L_d + 2 * x.L_dq * x.L_dq / x.L_q) / (x.L_d * x.L_q - x.L_dq * x.L_dq);
            const double gone = std::sqrt(slope_0 / (slope_0 - slope_r)); // of rated current
            const double most =
                std::min(0.9 * gone * p.i_rated, static_cast<double>(p.i_max)) / p.i_full_scale;
            const drive_config_t c = configure(p);
            EXPECT_NEAR(real(c.i_injection), most, 1e-4) << id << ' ' << x.L_q;
            EXPECT_LE(real(c.protection.i_stall), 15.0 / 16 * most + 1e-6) << id << ' ' << x.L_q;
        }
    }
}

// Where the axis of the saliency is followed, its amplitude does not vanish with the slope across.
TEST(InjectionConfig, SourcesOfTheStatorHaveAllOfTheCurrent)
{
    for (const int32_t id : {INJECTION_rotating_sine, INJECTION_stationary_square, INJECTION_inform}) {
        drive_params_t p = with(id);
        p.L_qh_rated = p.L_dh_rated + 2000000;
        const drive_config_t c = configure(p);
        EXPECT_EQ(c.i_injection, c.i_max) << id;
    }
}

// Chosen by saliency it injects where at half of rated current some is left, by the same parabola: 1/L_d - 1/L_q falls by less than
// four times what it is.
TEST(InjectionConfig, SaliencyIsSeenToHalfOfRatedCurrent)
{
    for (const double slope_r : {-3.1, -2.9, 0.0, 0.5}) {
        drive_params_t p = with(INJECTION_pulsating_square);
        p.start_method = 0;
        p.L_d = p.L_q / 2;
        p.L_dh_rated = p.L_d;
        p.L_qh_rated = static_cast<int32_t>(p.L_q / (2 - slope_r));
        p.L_dqh_rated = 0;
        EXPECT_EQ(configure(p).injection, slope_r > -3) << slope_r;
    }
}

// Of the pulse: flux L_d i in periods of 2/3 v_dc T at a duty of 1 or less; waits for eight times that and 50.
TEST(InjectionConfig, PulseIsThatOfItsFlux)
{
    for (const double i_A : {2.0, 4.0, 6.0}) {
        drive_params_t p = with(INJECTION_pulsating_square);
        p.i_pulse = static_cast<int32_t>(std::lround(i_A * 1e3));
        const pulses_config_t c = configure(p).pulses;
        const double exact = p.L_d * 1e-9 * i_A / (2.0 / 3 * p.v_dc_nominal * 1e-3 / kF_pwm);
        const double whole = std::ceil(exact);
        EXPECT_EQ(c.periods, whole) << i_A;
        EXPECT_EQ(c.timeout, 8 * whole + 50) << i_A;
        EXPECT_NEAR(real(c.duty), std::min(1.0, exact / whole), 1e-6) << i_A;
        EXPECT_NEAR(real(c.s_min), 0.5 * (p.L_q - p.L_d) / (p.L_q + p.L_d), 1e-6) << i_A;
    }
}

// What rings with the legs' capacitance, 2 v_dc sqrt(C / L_d), and what dead time makes; a current below five times the noise,
// four steps of a 12-bit converter or the ringing is zero.
TEST(InjectionConfig, PulsesAllowForBridgeAndNoise)
{
    for (const double C_nF : {0.0, 0.5, 20.0}) {
        drive_params_t p = with(INJECTION_pulsating_square);
        p.polarity = 1;
        p.leg_capacitance = static_cast<int32_t>(
            std::lround(C_nF * 1e-9 * std::pow(10, -drive_param_exp10[DRIVE_PARAM_leg_capacitance])));
        const drive_config_t c = configure(p);
        const double v_dc = p.v_dc_nominal * 1e-3, L_d = p.L_d * 1e-9;
        const double ringing = 2 * v_dc * std::sqrt(C_nF * 1e-9 / L_d) / 10;
        const double edges = v_dc * 4 * c.pulses.periods / 3.0 * 2e-6 / L_d / 10;
        const double noise = p.i_noise * std::pow(10, drive_param_exp10[DRIVE_PARAM_i_noise]) / 10;
        const double zero = std::max({5 * noise, 8.0 / 4096, ringing});
        EXPECT_NEAR(real(c.pulses.i_bridge), edges + ringing, 1e-5) << C_nF;
        EXPECT_NEAR(real(c.pulses.i_zero), zero, 1e-6) << C_nF;
        EXPECT_NEAR(real(c.dual_pulses.ringing), ringing, 1e-6) << C_nF;
        EXPECT_NEAR(real(c.dual_pulses.i_zero), zero, 1e-6) << C_nF;
        EXPECT_NEAR(real(c.dual_pulses.noise), 2 * noise, 1e-7) << C_nF;
        EXPECT_NEAR(real(c.dual_pulses.i_least), p.i_pulse * 1e-3 / 10 / 4, 1e-6) << C_nF;
    }
}

TEST(InjectionConfig, BoundaryThresholdIsThatOfTheParameter)
{
    for (const double told : {0.0, 0.3}) {
        drive_params_t p = with(INJECTION_pulsating_square);
        p.position_pulses = 3;
        p.boundary_threshold = static_cast<int32_t>(
            std::lround(told * std::pow(10, -drive_param_exp10[DRIVE_PARAM_boundary_threshold])));
        const boundary_detection_config_t c = configure(p).boundary_detection;
        EXPECT_NEAR(real(c.threshold), told, 1e-6);
        EXPECT_EQ(c.interpolated, told == 0);
    }
}

// Six pulses as often as told, and the noise of as many: 0.775 of a step of the converter each.
TEST(InjectionConfig, LinkPulsesAreAsManyAsTold)
{
    for (const int32_t repeats : {1, 4}) {
        drive_params_t p = with(INJECTION_pulsating_square);
        p.position_pulses = 4;
        p.dc_link_repeats = repeats;
        const dc_link_pulses_config_t c = configure(p).dc_link_pulses;
        EXPECT_EQ(c.pulses, 6 * repeats);
        EXPECT_NEAR(real(c.limits.pole.noise), 0.775 / 4096 * std::sqrt(repeats), 1e-6);
    }
}

// Values of two milliseconds or more, whole periods of the carrier: eight of them, and twice as many as long as they end
// within 64 ms. I_p by its carrier's flux.
TEST(InjectionConfig, ThreePhaseValuesFillTheTime)
{
    for (const int n : {8, 10, 20, 40}) {
        drive_params_t p = with(INJECTION_pulsating_sine);
        p.position_find = 2;
        p.f_injection = static_cast<int32_t>(
            std::lround(kF_pwm / n * std::pow(10, -drive_param_exp10[DRIVE_PARAM_f_injection])));
        p.injection_bandwidth = 1000;
        const three_phase_hf_config_t c = configure(p).three_phase_hf;
        const int block = (20 + n - 1) / n * n;
        int wanted = 8;
        while (wanted < 32 && 2 * wanted * block <= 640) {
            wanted *= 2;
        }
        EXPECT_EQ(c.block, block) << n;
        EXPECT_EQ(c.wanted, wanted) << n;
        const double x = M_PI / n, omega = 2 * M_PI * kF_pwm / n;
        const double flux = p.v_injection * 1e-3 / omega * (x / std::sin(x));
        const double I_p = flux * (1 / (p.L_d * 1e-9) + 1 / (p.L_q * 1e-9)) / 2;
        EXPECT_NEAR(real(c.i_least), I_p / 2 / 4 / 10, 1e-5) << n;
    }
}

} // namespace
