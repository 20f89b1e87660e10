// Differential channel of the neutral, offsets of voltage channels and amplifiers of shunts in line (lags.h,
// sensor.h), through the plant: against the formula of each.
#include "rig.h"

#include <gtest/gtest.h>

#include <cmath>

namespace
{

constexpr double V = 36.0;
constexpr double code_share = 1.0 / 65536.0; // of sixteen bits

plant_config_t machine()
{
    plant_config_t c = rig::spm_400_linear();
    c.winding.L_0_H = 2.25e-3;
    c.winding.emf[0] = {3, 3.0e-3, 0.0};
    return c;
}

double of_code(uint16_t code, double full_scale)
{
    return (code / 32768.0 - 1.0) * full_scale;
}

// Idle at constant speed the star network sees the third harmonic, e_0 = -3 omega psi_3 sin 3 theta.
class Idle
{
  public:
    static constexpr double omega_e = 500.0, amplitude_V = 3.0 * omega_e * 3.0e-3;

    explicit Idle(const plant_config_t &config) : plant(config)
    {
        plant_set_speed(plant, omega_e / config.machine.pole_pairs);
        plant.run(rig::all_off(), 100);
    }

    double sample()
    {
        plant_adc_t adc;
        plant_sample(plant, &adc);
        return of_code(adc.v_zero[0], full_scale_V);
    }

    double theta() const
    {
        return plant.truth().theta_e_rad;
    }

    static constexpr double full_scale_V = 10.0;
    rig::Plant plant;
};

plant_config_t with_channel()
{
    plant_config_t c = machine();
    c.sensor.v_zero_full_scale_V = Idle::full_scale_V;
    return c;
}

TEST(Differential, ShowsTheThirdHarmonicOfEitherSign)
{
    Idle idle(with_channel());
    double lowest_V = 0.0, highest_V = 0.0;
    for (int k = 0; k < 200; k++) {
        double expected_V = -Idle::amplitude_V * std::sin(3.0 * idle.theta());
        double seen_V = idle.sample();
        ASSERT_NEAR(seen_V, expected_V, 2.0 * code_share * Idle::full_scale_V);
        ASSERT_NEAR(seen_V, idle.plant.truth().v_zero_V[0], 2.0 * code_share * Idle::full_scale_V);
        lowest_V = std::fmin(lowest_V, seen_V);
        highest_V = std::fmax(highest_V, seen_V);
        idle.plant.run(rig::all_off());
    }
    EXPECT_LT(lowest_V, -0.9 * Idle::amplitude_V);
    EXPECT_GT(highest_V, 0.9 * Idle::amplitude_V);
}

TEST(Differential, HasGainOffsetAndLoading)
{
    plant_config_t config = with_channel();
    config.sensor.v_zero_gain_error = 0.05;
    config.sensor.v_zero_offset_V = 0.3;
    config.sensor.v_zero_network_ohm = 30e3;
    config.sensor.v_zero_load_ohm = 40e3; // on 10 kohm: 0.8
    Idle idle(config);
    for (int k = 0; k < 50; k++) {
        double expected_V = 1.05 * 0.8 * -Idle::amplitude_V * std::sin(3.0 * idle.theta()) + 0.3;
        ASSERT_NEAR(idle.sample(), expected_V, 2.0 * code_share * Idle::full_scale_V);
        idle.plant.run(rig::all_off());
    }
}

TEST(Differential, ClipsAtEitherEnd)
{
    plant_config_t config = with_channel();
    config.sensor.v_zero_full_scale_V = 0.5 * Idle::amplitude_V;
    config.sensor.v_zero_bits = 10;
    Idle idle(config);
    bool low = false, high = false;
    for (int k = 0; k < 200; k++) {
        plant_adc_t adc;
        plant_sample(idle.plant, &adc);
        double expected = -2.0 * std::sin(3.0 * idle.theta());
        if (std::fabs(expected) > 1.01) {
            ASSERT_EQ(adc.v_zero[0], expected > 0.0 ? 0xFFC0 : 0);
            (expected > 0.0 ? high : low) = true;
        }
        ASSERT_EQ(adc.v_zero[0] % 64, 0) << "ten bits";
        ASSERT_EQ(adc.v_zero[1], 0x8000) << "no second set";
        idle.plant.run(rig::all_off());
    }
    EXPECT_TRUE(low && high);
}

// tau dy/dt = u - y on a sine of 3 omega: gain 1/sqrt(1 + x^2), lag atan x.
TEST(Differential, RcLagsAsItsFormula)
{
    plant_config_t config = with_channel();
    config.sensor.v_zero_filter_s = 500e-6;
    Idle idle(config);
    double x = 3.0 * Idle::omega_e * config.sensor.v_zero_filter_s;
    for (int k = 0; k < 100; k++) {
        double expected_V =
            -Idle::amplitude_V / std::sqrt(1.0 + x * x) * std::sin(3.0 * idle.theta() - std::atan(x));
        // straight between the ends of steps of 0.05 rad: 0.15^2/12 of the curvature
        ASSERT_NEAR(idle.sample(), expected_V, 2e-3 * Idle::amplitude_V);
        idle.plant.run(rig::all_off());
    }
}

// A network with one resistor too large weighs its terminal less: with one leg high and two low the mean
// moves.
TEST(Differential, UnequalResistorsShowTheTerminals)
{
    plant_config_t config = rig::spm_400_linear();
    config.mech.locked = true;
    config.sensor.v_zero_full_scale_V = 10.0;
    config.sensor.v_zero_network_error[0] = 0.05;
    rig::Plant plant(config);
    plant.run(rig::pwm(1.0, 0.0, 0.0), 3);
    plant_adc_t adc;
    plant_sample(plant, &adc);
    double weight = (1.0 / 1.05) / (1.0 / 1.05 + 2.0);
    EXPECT_NEAR(of_code(adc.v_zero[0], 10.0), (weight - 1.0 / 3.0) * V, 20.0 * code_share);
}

TEST(Differential, NoiseIsItsOwn)
{
    plant_config_t config = with_channel();
    config.sensor.v_zero_bits = 12;
    config.sensor.v_zero_noise_lsb = 2.0;
    config.mech.locked = true;
    rig::Plant plant(config);
    double sum = 0.0, squares = 0.0;
    constexpr int samples = 4000;
    for (int k = 0; k < samples; k++) {
        plant_adc_t adc;
        plant_sample(plant, &adc);
        ASSERT_EQ(adc.i_leg[0], 0x8000) << "no other channel has noise";
        double lsb = (adc.v_zero[0] - 0x8000) / 16.0;
        sum += lsb;
        squares += lsb * lsb;
    }
    EXPECT_NEAR(sum / samples, 0.0, 4.0 * 2.0 / std::sqrt(samples));
    EXPECT_NEAR(std::sqrt(squares / samples), std::sqrt(4.0 + 1.0 / 12.0), 0.1);
}

TEST(VoltageChannels, HaveOffsets)
{
    plant_config_t config = machine();
    config.mech.locked = true;
    config.sensor.v_leg_full_scale_V = config.sensor.v_full_scale_V = 60.0;
    config.sensor.v_dc_offset_V = 0.6;
    config.sensor.v_offset_V[0] = -0.5;
    config.sensor.v_offset_V[1] = -0.4;
    config.sensor.v_offset_V[PLANT_LEGS] = 0.25;
    rig::Plant plant(config);
    plant.run(rig::pwm(1.0, 0.0, 0.0), 3);
    plant_adc_t adc;
    plant_sample(plant, &adc);
    EXPECT_NEAR(adc.v_dc * code_share * 60.0, V + 0.6, 60.0 * code_share);
    EXPECT_NEAR(adc.v_leg[0] * code_share * 60.0, V - 0.5, 60.0 * code_share);
    EXPECT_EQ(adc.v_leg[1], 0) << "below zero it clips";
    EXPECT_NEAR(adc.v_neutral[0] * code_share * 60.0, V / 3.0 + 0.25, 60.0 * code_share);
}

// A ramp of the current arrives as i(t) - slope tau (1 - e^{-t/tau}).
TEST(InLineAmplifier, FollowsARampLate)
{
    constexpr double tau_s = 5e-6, L = 3.24e-3, R = 0.373;
    plant_config_t config = rig::spm_400_linear();
    config.mech.locked = true;
    config.sensor.i_filter_s = tau_s;
    rig::Plant plant(config);
    plant.run(rig::pwm(1.0, 0.0, 0.0));
    for (double t_s : {2e-6, 5e-6, 20e-6, 80e-6}) {
        plant_sensor(plant)->delay_s = t_s;
        plant_adc_t adc;
        plant_sample(plant, &adc);
        double slope = 2.0 / 3.0 * V / L;
        double lag_A = slope * tau_s * -std::expm1(-t_s / tau_s);
        double bent_A = 0.5 * slope * t_s * t_s * R / L; // of the ramp, which ends at V/R
        EXPECT_NEAR(of_code(adc.i_leg[0], 10.0), slope * t_s - lag_A, bent_A + 20.0 * code_share) << t_s;
        EXPECT_EQ(adc.settled, 7);
    }
}

TEST(InLineAmplifier, IsNoneForOtherShunts)
{
    plant_config_t config = rig::spm_400_linear();
    config.sensor.shunt = PLANT_LOW_SIDE;
    config.sensor.i_filter_s = 5e-6;
    EXPECT_THROW(rig::Plant plant(config), std::invalid_argument);
}

// In the steady state at a duty the link's current, i for the share d of the period about its middle, is
// behind the RC what a periodic pulse makes of it: y = i (e^{x (1+d)/2} - e^{x (1-d)/2})/(e^x - 1) at the
// period's end, x = T/tau. The ripple of the current, of L/R = 8.7 ms, is odd about that middle.
TEST(LinkSensor, ShowsPulsesBehindItsFilter)
{
    constexpr double duty = 0.3, T = 100e-6;
    for (double tau_s : {30e-6, 200e-6}) {
        plant_config_t config = rig::spm_400_linear();
        config.mech.locked = true;
        config.sensor.i_dc_full_scale_A = 100.0;
        config.sensor.i_dc_filter_s = tau_s;
        config.sensor.i_dc_gain_error = 0.02;
        config.sensor.i_dc_offset_A = -0.5;
        rig::Plant plant(config);
        plant.run(rig::pwm(duty, 0.0, 0.0), 2000);
        plant_adc_t adc;
        plant_sample(plant, &adc);
        const double i_A = duty * V / (1.5 * 0.373), x = T / tau_s; // mean: R with R/2 behind it
        const double y_A =
            i_A * (std::exp(0.5 * x * (1.0 + duty)) - std::exp(0.5 * x * (1.0 - duty))) / std::expm1(x);
        // of the ripple, d (1 - d) T R/L of the current at most, the filter leaves no more than that
        const double ripple = duty * (1.0 - duty) * T * 0.373 / 3.24e-3;
        EXPECT_NEAR(of_code(adc.i_dc, 100.0), 1.02 * y_A - 0.5, ripple * y_A + 100.0 / 32768) << tau_s;
    }
}

// Without filter it is the current of the moment: a held pair carries it, the zero vector does not.
TEST(LinkSensor, IsTheCurrentOfTheMoment)
{
    plant_config_t config = rig::spm_400_linear();
    config.mech.locked = true;
    config.sensor.i_dc_full_scale_A = 100.0;
    rig::Plant plant(config);
    plant_adc_t adc;
    plant.run(rig::pwm(1.0, 0.0, 0.0), 4);
    plant_sample(plant, &adc);
    EXPECT_NEAR(of_code(adc.i_dc, 100.0), plant.truth().i_A[0], 100.0 / 32768);
    EXPECT_GT(plant.truth().i_A[0], 2.0);
    plant.run(rig::pwm(0.5, 0.0, 0.0), 2);
    plant_sample(plant, &adc);
    EXPECT_EQ(adc.i_dc, 0x8000);
    plant_sensor(plant)->i_dc_full_scale_A = 0.0;
    plant.run(rig::pwm(1.0, 0.0, 0.0), 2);
    plant_sample(plant, &adc);
    EXPECT_EQ(adc.i_dc, 0x8000) << "no such sensor";
}

} // namespace
