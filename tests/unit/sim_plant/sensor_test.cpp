// sensor.h: codes of known inputs, clipping, the statistics of the noise; and through plant_sample(), the
// instant of the sample.
#include "rig.h"

extern "C" {
#include "sim_plant/sensor.h"
}

#include <gtest/gtest.h>

#include <cmath>

namespace
{

// rms of N Gaussian values scatters by 1/sqrt(2N), 0.2 % for N = 1e5; METHODS wants 5 %.
constexpr double rms_tolerance = 0.05;
constexpr int samples = 100000;

class Sensor : public testing::Test
{
  protected:
    Sensor()
    {
        sensor.bits = 12;
        sensor.i_full_scale_A = 10.0;
        sensor.v_full_scale_V = 450.0;
        noise_seed(&noise, 1);
    }

    int current(double i_A, int leg = 0)
    {
        return sensor_current(&sensor, &noise, leg, i_A);
    }

    plant_sensor_t sensor{};
    noise_t noise{};
};

TEST_F(Sensor, CodeOfAKnownCurrent)
{
    EXPECT_EQ(current(0.0), 2048 << 4);
    EXPECT_EQ(current(5.0), 3072 << 4);
    EXPECT_EQ(current(-5.0), 1024 << 4);
    double lsb = 20.0 / 4096;
    EXPECT_EQ(current(0.49 * lsb), 2048 << 4);
    EXPECT_EQ(current(0.51 * lsb), 2049 << 4);
    EXPECT_EQ(current(-0.51 * lsb), 2047 << 4);
}

TEST_F(Sensor, Clips)
{
    EXPECT_EQ(current(10.1), 4095 << 4);
    EXPECT_EQ(current(1e9), 4095 << 4);
    EXPECT_EQ(current(-10.1), 0);
    EXPECT_EQ(current(-1e9), 0);
    EXPECT_EQ(sensor_voltage(&sensor, &noise, -1.0), 0);
    EXPECT_EQ(sensor_voltage(&sensor, &noise, 500.0), 4095 << 4);
}

TEST_F(Sensor, LinkVoltage)
{
    EXPECT_EQ(sensor_voltage(&sensor, &noise, 225.0), 2048 << 4);
}

TEST_F(Sensor, GainAndOffsetBelongToTheirLeg)
{
    sensor.gain_error[1] = 0.02;
    sensor.offset_A[2] = -0.1;
    sensor.bits = 16;
    double lsb = 20.0 / 65536;
    EXPECT_EQ(current(5.0, 0), 32768 + 16384);
    EXPECT_NEAR(current(5.0, 1), 32768 + 5.1 / lsb, 0.5);
    EXPECT_NEAR(current(5.0, 2), 32768 + 4.9 / lsb, 0.5);
}

TEST_F(Sensor, IdealConverterHasSixteenBitsAndNoNoise)
{
    sensor.bits = 0;
    sensor.noise_lsb = 5.0;
    double lsb = 20.0 / 65536;
    for (double i = -9.9; i < 9.9; i += 0.37) {
        EXPECT_NEAR((current(i) - 32768) * lsb, i, 0.5 * lsb);
    }
}

TEST_F(Sensor, NoiseHasItsRmsAndNoMean)
{
    sensor.bits = 16; // so that rounding adds little: 1/12 to 400
    sensor.noise_lsb = 20.0;
    double sum = 0.0, sum2 = 0.0, sum4 = 0.0;
    for (int k = 0; k < samples; k++) {
        double x = current(0.0) - 32768;
        sum += x;
        sum2 += x * x;
        sum4 += x * x * x * x;
    }
    double rms = std::sqrt(sum2 / samples);
    RecordProperty("rms_lsb", std::to_string(rms));
    EXPECT_NEAR(rms, 20.0, rms_tolerance * 20.0);
    EXPECT_NEAR(sum / samples, 0.0, 5.0 * 20.0 / std::sqrt(samples));
    EXPECT_NEAR(sum4 / samples / (rms * rms * rms * rms), 3.0, 0.1); // Gaussian
}

TEST_F(Sensor, EqualSeedsGiveEqualRuns)
{
    sensor.noise_lsb = 3.0;
    noise_t other;
    noise_seed(&other, 1);
    int differ = 0;
    for (int k = 0; k < 100; k++) {
        int first = current(0.0);
        EXPECT_EQ(first, sensor_current(&sensor, &other, 0, 0.0));
        noise_t third;
        noise_seed(&third, 2 + static_cast<uint64_t>(k));
        differ += first != sensor_current(&sensor, &third, 0, 0.0);
    }
    EXPECT_GT(differ, 50);
}

// A full voltage vector on a locked rotor: the current ramps without an edge, so a sample tells its instant.
TEST(SensorInstant, IsDelayAfterTheCentre)
{
    for (double delay : {-20e-6, 0.0, 30e-6}) {
        plant_config_t config = rig::ipm_1000();
        config.machine = {0.0, 50e-3, 50e-3, 0.0, 0.2, 3};
        config.mech.locked = true;
        config.sensor.delay_s = delay;
        rig::Plant plant(config);
        plant_pwm_t pwm = rig::pwm(1, 0, 0);
        plant_adc_t adc{};
        for (int k = 0; k < 6; k++) {
            plant_sample(plant, &adc);
            plant.run(pwm);
        }
        // the vector has acted since t = T; the last sample was taken at 5 T + delay
        double seen_A = (adc.i_leg[0] - 32768) * (10.0 / 32768);
        double slope_A_s = 200.0 / 50e-3;
        EXPECT_NEAR(seen_A, slope_A_s * (4e-4 + delay), 10.0 / 32768) << delay;
        EXPECT_NEAR(plant.truth().t_s, 6e-4, 1e-15);
    }
}

TEST(SensorInstant, FaultsActOnARunningPlant)
{
    rig::Plant plant(rig::ipm_1000());
    plant_adc_t adc{};
    plant_sample(plant, &adc);
    EXPECT_EQ(adc.i_leg[1], 32768);
    plant_sensor(plant)->offset_A[1] = 1.0;
    plant_sample(plant, &adc);
    EXPECT_NEAR(adc.i_leg[1], 32768 + 3277, 1);
}

} // namespace
