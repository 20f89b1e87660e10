// neutral.h: from code to volts of the zero sequence, with the channel's offset taken out, on the plant's own channels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>

#include "tests/support/application.h"
#include "tests/support/plants.h"
#include "tests/unit/drive/direct.h"

namespace
{

constexpr double kBase_V = 450, kFullScale_V = 15, kOffset_V = 0.4, kPsi_3_Wb = 7.08e-3;

TEST(Neutral, ACodeIsAShareOfFullScaleAgainstItsZero)
{
    drive_params_t p = direct::params();
    p.neutral_full_scale = 15000;
    drive_config_t c = {};
    ASSERT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
    neutral_t self = {};
    self.zero = PM_ONE + PM_ONE / 64;
    for (const int code : {0, 1, 20000, 32768, 33280, 65535}) {
        const double v_V = (1 + 1.0 / 64 - code / 32768.0) * kFullScale_V;
        EXPECT_NEAR(neutral_signal(&self, &c.neutral, static_cast<uint16_t>(code)) * kBase_V / PM_ONE, v_V,
                    1e-5)
            << code;
    }
}

TEST(Neutral, AFullScaleBeyondTheFormatIsRefused)
{
    drive_params_t p = direct::params();
    p.neutral_full_scale = 1000000; // more than twice v_full_scale
    drive_config_t c = {};
    const drive_result_t result = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_FALSE(result.ok);
    EXPECT_EQ(result.param, DRIVE_PARAM_neutral_full_scale);
}

// Behind the RC of the channel, by its equation in double precision.
TEST(Neutral, TheStarIsTakenOffAsTheChannelShowsIt)
{
    constexpr double kAlpha = -0.0049, kBeta = 0.045, kT_s = 1e-4;
    drive_params_t p = direct::params();
    p.star_alpha = -4900;
    p.star_beta = 45000;
    for (const double rc_s : {0.5e-4, 1e-4, 2e-4}) {
        p.neutral_filter = static_cast<int32_t>(std::lround(rc_s * 1e9));
        drive_config_t c = {};
        ASSERT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
        neutral_t self = {};
        const double a = std::exp(-kT_s / rc_s);
        double s = 0;
        for (int k = 0; k < 500; ++k) {
            const std::complex<double> u = std::polar(0.9, 0.3 * k) + std::polar(0.3, -1.9 * k);
            s = a * s + (1 - a) * (kAlpha * u.real() + kBeta * u.imag());
            const pm_q_t got =
                neutral_star(&self, &c.neutral, {bench::fixed(u.real(), 28), bench::fixed(u.imag(), 28)});
            ASSERT_NEAR(bench::real(got), s, 1e-6) << rc_s << ' ' << k;
        }
    }
}

struct Loop {
    plant_config_t config = plants::ipm_1000();
    const char *error = nullptr;
    std::unique_ptr<plant_t, decltype(&plant_destroy)> plant{nullptr, &plant_destroy};
    drive_params_t params = direct::params();
    sim_loop_t loop = {};

    explicit Loop(bool differential)
    {
        config.winding.L_0_H = 14e-3;
        config.winding.emf[0] = {3, kPsi_3_Wb, 0};
        config.inverter.c_leg_F = 0.5e-9;
        if (differential) {
            config.sensor.v_zero_full_scale_V = kFullScale_V;
            config.sensor.v_zero_offset_V = kOffset_V;
            config.sensor.v_zero_noise_lsb = 0.5;
            params.neutral_full_scale = 15000;
        } else {
            config.sensor.v_leg_full_scale_V = kBase_V;
            params.neutral_full_scale = 450000;
        }
        plant.reset(plant_create(&config, 1.0, &error));
        EXPECT_TRUE(sim_loop_init(&loop, plant.get(), &params).ok);
    }

    void calibrate()
    {
        drive_command_t c = {};
        c.enable = true;
        drive_command(&loop.app.drive, &c);
        for (int k = 0; k < 3000 && drive_status(&loop.app.drive)->state < DRIVE_FINDING; ++k) {
            sim_loop_step(&loop);
        }
    }

    double seen_V() const
    {
        const app_t &app = loop.app;
        return neutral_signal(&app.drive.neutral, &app.drive.config.neutral, app.in.more.v_neutral) *
               kBase_V / PM_ONE;
    }
};

TEST(Neutral, CalibrationTakesTheOffsetOut)
{
    Loop x(true);
    x.calibrate();
    const double zero_V = (x.loop.app.drive.neutral.zero / double(PM_ONE) - 1) * kFullScale_V;
    EXPECT_NEAR(zero_V, -kOffset_V, 1e-3); // the code has the other sign
}

TEST(Neutral, AChannelAtItsEndIsAFault)
{
    Loop x(true);
    x.config.sensor.v_zero_offset_V = 5.0;
    x.plant.reset(plant_create(&x.config, 1.0, &x.error));
    ASSERT_TRUE(sim_loop_init(&x.loop, x.plant.get(), &x.params).ok);
    x.calibrate();
    EXPECT_EQ(drive_status(&x.loop.app.drive)->fault, DRIVE_FAULT_SENSOR_OFFSET);
}

// Bridge off: e_0 alone, -3 omega psi_3 sin 3 theta, by either of both ways to measure it.
TEST(Neutral, IsTheThirdHarmonicOfTheEmfWithItsSign)
{
    for (const bool differential : {true, false}) {
        Loop x(differential);
        x.calibrate();
        drive_command_t off = {};
        off.coast = true;
        drive_command(&x.loop.app.drive, &off);
        const double omega = 200.0;
        plant_set_speed(x.plant.get(), omega / 3);
        for (int k = 0; k < 50; ++k) {
            sim_loop_step(&x.loop);
        }
        const double lsb_V = (differential ? 2 * kFullScale_V : 2 * kBase_V) / 4096;
        double square = 0, worst_V = 0;
        for (int k = 0; k < 200; ++k) {
            plant_truth_t truth;
            plant_truth(x.plant.get(), &truth);
            sim_loop_step(&x.loop);
            const double e_V = -3 * omega * kPsi_3_Wb * std::sin(3 * truth.theta_e_rad);
            worst_V = std::max(worst_V, std::fabs(x.seen_V() - e_V));
            square += e_V * e_V / 200;
        }
        EXPECT_GT(std::sqrt(square), 2.5) << "nothing to see";
        EXPECT_LT(worst_V, 3 * lsb_V) << differential;
    }
}

// Torque control without torque at an imposed speed, PWM with dead time, leg capacitance and L_s2 - M_s2: amplitude and angle of the
// third harmonic in the signal, over whole turns, of what METHODS.md 11.2.1 says and the RC leaves.
struct Sensed {
    double amplitude_rel, angle_deg; // the angle of the position
};

Sensed sensed(bool differential, double filter_s, double speed_rel)
{
    Loop x(differential);
    x.config.winding.dL_0_H = 2e-3;
    x.config.sensor.filter_s = differential ? 0 : filter_s;
    x.config.sensor.v_zero_filter_s = differential ? filter_s : 0;
    x.plant.reset(plant_create(&x.config, 1.0, &x.error));
    x.params.i_d_light = 0;
    EXPECT_TRUE(sim_loop_init(&x.loop, x.plant.get(), &x.params).ok);
    drive_command_t c = {};
    c.enable = true;
    c.mode = DRIVE_MODE_TORQUE;
    drive_command(&x.loop.app.drive, &c);
    const double omega = 314.16 * speed_rel;
    int turns = 0, periods = 0;
    std::complex<double> sum = 0;
    double travelled = 0, last = 0;
    for (int k = 0; k < 60000 && turns < 4; ++k) {
        if (k > 3000) { // started at rest
            plant_set_speed(x.plant.get(), omega / 3 * std::min(1.0, (k - 3000) / 5000.0));
        }
        plant_truth_t truth;
        plant_truth(x.plant.get(), &truth);
        sim_loop_step(&x.loop);
        if (k > 10000) {
            sum += x.seen_V() * std::polar(1.0, -3 * truth.theta_e_rad);
            travelled += k == 10001 ? 0 : std::remainder(truth.theta_e_rad - last, 2 * M_PI);
            ++periods;
            turns = static_cast<int>(travelled / (2 * M_PI));
        }
        last = truth.theta_e_rad;
    }
    EXPECT_EQ(drive_status(&x.loop.app.drive)->state, DRIVE_RUNNING);
    const std::complex<double> j = {0, 1},
                               law = 3.0 * j * omega * kPsi_3_Wb / (1.0 + 3.0 * j * omega * filter_s);
    const std::complex<double> ratio = 2.0 * sum / static_cast<double>(periods) / law;
    return {std::abs(ratio), std::arg(ratio) / 3 * 180 / M_PI};
}

TEST(Neutral, BehindAnRcItIsTheThirdHarmonicAtAnySpeed)
{
    for (const bool differential : {true, false}) {
        for (const double speed : {0.05, 0.2, 1.0}) {
            const Sensed s = sensed(differential, 100e-6, speed);
            EXPECT_NEAR(s.amplitude_rel, 1, 0.02) << differential << ' ' << speed;
            EXPECT_NEAR(s.angle_deg, 0, 0.3) << differential << ' ' << speed;
        }
    }
}

// One sample at the zero vector: half of the wave is below the negative rail, where four unipolar channels see nothing.
TEST(Neutral, TwinWithoutAnRcLosesHalfOfIt)
{
    const Sensed s = sensed(false, 0, 1.0);
    EXPECT_NEAR(s.amplitude_rel, 0.58, 0.05);
}

} // namespace
