// sensor.h: codes of known inputs, clipping, the statistics of the noise and the order in which it is drawn,
// shunts and their windows; and through plant_sample(), the instant of the sample.
#include "rig.h"

extern "C" {
#include "sim_plant/sensor.h"
}

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

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
        input.legs = 3;
        input.sets = 1;
        noise_seed(&noise, 1);
    }

    void convert()
    {
        sensor_convert(&sensor, &noise, &input, &adc);
    }

    int current(double i_A, int leg = 0)
    {
        input.i_A[leg] = i_A;
        convert();
        return adc.i_leg[leg];
    }

    int link_voltage(double v_V)
    {
        input.v_dc_V = v_V;
        convert();
        return adc.v_dc;
    }

    plant_sensor_t sensor{};
    noise_t noise{};
    sensor_input_t input{};
    plant_adc_t adc{};
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
    EXPECT_EQ(link_voltage(-1.0), 0);
    EXPECT_EQ(link_voltage(500.0), 4095 << 4);
}

// The top code stands for full scale less one step; half a step below it still rounds up to it.
TEST_F(Sensor, CornerCodesOfEveryWidth)
{
    for (int bits = 1; bits <= 16; bits++) {
        sensor.bits = bits;
        double steps = std::exp2(bits);
        int align = 16 - bits;
        int top = (1 << bits) - 1;
        double i_lsb = 20.0 / steps;
        double v_lsb = 450.0 / steps;
        EXPECT_EQ(current(-10.0), 0) << bits;
        EXPECT_EQ(current(-10.0 + 0.49 * i_lsb), 0) << bits;
        EXPECT_EQ(current(-10.0 + 0.51 * i_lsb), 1 << align) << bits;
        EXPECT_EQ(current(0.0), 0x8000) << bits;
        EXPECT_EQ(current(10.0 - 1.51 * i_lsb), (top - 1) << align) << bits;
        EXPECT_EQ(current(10.0 - 1.49 * i_lsb), top << align) << bits;
        EXPECT_EQ(current(10.0), top << align) << bits;
        EXPECT_EQ(link_voltage(0.0), 0) << bits;
        EXPECT_EQ(link_voltage(0.51 * v_lsb), 1 << align) << bits;
        EXPECT_EQ(link_voltage(450.0 - 1.51 * v_lsb), (top - 1) << align) << bits;
        EXPECT_EQ(link_voltage(450.0), top << align) << bits;
    }
}

TEST_F(Sensor, LinkVoltage)
{
    EXPECT_EQ(link_voltage(225.0), 2048 << 4);
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

// Terminals and neutrals of two sets, each with its own divider; the DC link has none.
TEST_F(Sensor, VoltageChannelsHaveTheirDividerAndFullScale)
{
    sensor.bits = 16;
    input.legs = 6;
    input.sets = 2;
    input.v_dc_V = 200.0;
    for (int k = 0; k < PLANT_LEGS; k++) {
        input.v_leg_V[k] = 20.0 + 30.0 * k;
        sensor.divider_error[k] = 0.01 * (k - 2);
    }
    for (int set = 0; set < PLANT_SETS; set++) {
        input.v_neutral_V[set] = 100.0 + set;
        sensor.divider_error[PLANT_LEGS + set] = -0.03 * (set + 1);
    }
    for (double own_V : {0.0, 300.0}) { // 0: that of the link
        sensor.v_leg_full_scale_V = own_V;
        convert();
        double lsb_V = (own_V > 0.0 ? own_V : 450.0) / 65536;
        for (int k = 0; k < PLANT_LEGS; k++) {
            double expected_V = (1.0 + 0.01 * (k - 2)) * (20.0 + 30.0 * k);
            EXPECT_NEAR(adc.v_leg[k] * lsb_V, expected_V, 0.5 * lsb_V) << k;
        }
        EXPECT_NEAR(adc.v_neutral[0] * lsb_V, 0.97 * 100.0, 0.5 * lsb_V);
        EXPECT_NEAR(adc.v_neutral[1] * lsb_V, 0.94 * 101.0, 0.5 * lsb_V);
        EXPECT_NEAR(adc.v_dc * (450.0 / 65536), 200.0, 0.5 * 450.0 / 65536);
    }
}

TEST_F(Sensor, VoltageChannelsClip)
{
    sensor.v_leg_full_scale_V = 300.0;
    input.v_leg_V[0] = -1.2; // a lower diode
    input.v_leg_V[1] = 300.0;
    input.v_neutral_V[0] = 1e6;
    convert();
    EXPECT_EQ(adc.v_leg[0], 0);
    EXPECT_EQ(adc.v_leg[1], 4095 << 4);
    EXPECT_EQ(adc.v_neutral[0], 4095 << 4);
}

TEST_F(Sensor, TemperatureSpansBothSigns)
{
    struct {
        double full_scale_degC, t_degC;
        int code;
    } const cases[] = {{0.0, 0.0, 2048}, {0.0, 100.0, 3072},  {0.0, -50.0, 1536}, {0.0, 250.0, 4095},
                       {0.0, -250.0, 0}, {100.0, 25.0, 2560}, {100.0, -100.0, 0}};
    for (const auto &c : cases) {
        sensor.t_full_scale_degC = c.full_scale_degC;
        input.temperature_degC = c.t_degC;
        convert();
        EXPECT_EQ(adc.temperature, c.code << 4) << c.t_degC;
    }
}

TEST_F(Sensor, ChannelsWithoutALegReadNothing)
{
    std::fill(std::begin(input.i_A), std::end(input.i_A), 5.0);
    std::fill(std::begin(input.v_leg_V), std::end(input.v_leg_V), 100.0);
    std::fill(std::begin(input.v_neutral_V), std::end(input.v_neutral_V), 100.0);
    adc.i_leg[4] = adc.v_leg[4] = adc.v_neutral[1] = 77;
    adc.settled = 0xFF;
    convert();
    EXPECT_EQ(adc.i_leg[2], 3072 << 4);
    EXPECT_EQ(adc.i_leg[3], 0x8000);
    EXPECT_EQ(adc.i_leg[4], 0x8000);
    EXPECT_GT(adc.v_leg[2], 0);
    EXPECT_EQ(adc.v_leg[4], 0);
    EXPECT_GT(adc.v_neutral[0], 0);
    EXPECT_EQ(adc.v_neutral[1], 0);
    EXPECT_EQ(adc.settled, 0b111);
}

TEST_F(Sensor, NoiseHasItsRmsAndNoMean)
{
    sensor.bits = 16; // so that rounding adds little: 1/12 to 400
    sensor.noise_lsb = 20.0;
    sensor.v_leg_full_scale_V = 450.0;
    input.v_dc_V = input.v_leg_V[1] = input.v_neutral_V[0] = 225.0;
    constexpr int channels = 4;
    double sum[channels]{}, sum2[channels]{}, sum4[channels]{};
    for (int k = 0; k < samples; k++) {
        convert();
        const int codes[channels] = {adc.i_leg[0], adc.v_dc, adc.v_leg[1], adc.v_neutral[0]};
        for (int c = 0; c < channels; c++) {
            double x = codes[c] - 32768;
            sum[c] += x;
            sum2[c] += x * x;
            sum4[c] += x * x * x * x;
        }
    }
    for (int c = 0; c < channels; c++) {
        double rms = std::sqrt(sum2[c] / samples);
        RecordProperty("rms_lsb_" + std::to_string(c), std::to_string(rms));
        EXPECT_NEAR(rms, 20.0, rms_tolerance * 20.0) << c;
        EXPECT_NEAR(sum[c] / samples, 0.0, 5.0 * 20.0 / std::sqrt(samples)) << c;
        EXPECT_NEAR(sum4[c] / samples / (rms * rms * rms * rms), 3.0, 0.1) << c; // Gaussian
    }
}

// Closed-loop results depend on the sequence: three currents, then the link, and further channels only on a
// board that has them.
TEST_F(Sensor, NoiseIsDrawnInAKnownOrder)
{
    sensor.bits = 16;
    sensor.noise_lsb = 20.0;
    input.v_dc_V = input.v_leg_V[0] = input.v_leg_V[1] = input.v_leg_V[2] = input.v_neutral_V[0] = 225.0;
    noise_t own;
    noise_seed(&own, 1);
    auto drawn = [&own] { return static_cast<int>(std::lround(32768 + 20.0 * noise_gaussian(&own))); };
    for (double v_leg_full_scale_V : {0.0, 450.0, 0.0}) {
        sensor.v_leg_full_scale_V = v_leg_full_scale_V;
        bool on_board = v_leg_full_scale_V > 0.0;
        for (int n = 0; n < 5; n++) {
            convert();
            for (int k = 0; k < 3; k++) {
                EXPECT_EQ(adc.i_leg[k], drawn());
            }
            EXPECT_EQ(adc.v_dc, drawn());
            for (int k = 0; k < 3; k++) {
                EXPECT_EQ(adc.v_leg[k], on_board ? drawn() : 32768);
            }
            EXPECT_EQ(adc.v_neutral[0], on_board ? drawn() : 32768);
            EXPECT_EQ(adc.temperature, 32768);
        }
    }
}

TEST_F(Sensor, EqualSeedsGiveEqualRuns)
{
    sensor.noise_lsb = 3.0;
    noise_t other;
    noise_seed(&other, 1);
    auto first_with = [this](noise_t *with) {
        plant_adc_t seen;
        sensor_convert(&sensor, with, &input, &seen);
        return seen.i_leg[0];
    };
    int differ = 0;
    for (int k = 0; k < 100; k++) {
        int first = current(0.0);
        EXPECT_EQ(first, first_with(&other));
        noise_t third;
        noise_seed(&third, 2 + static_cast<uint64_t>(k));
        differ += first != first_with(&third);
    }
    EXPECT_GT(differ, 50);
}

// Sixteen bits, 4 A in every leg, 6 A in the link, a window of 2 us.
class Shunt : public Sensor
{
  protected:
    static constexpr double lsb_A = 20.0 / 65536;
    static constexpr double window_s = 2e-6;

    Shunt()
    {
        sensor.bits = 16;
        sensor.settle_s = window_s;
        std::fill(std::begin(input.i_A), std::end(input.i_A), 4.0);
        std::fill(std::begin(input.low_for_s), std::end(input.low_for_s), 1e-5);
        input.i_dc_A = 6.0;
        input.quiet_s = 1e-5;
    }

    double seen_A(int leg)
    {
        convert();
        return (adc.i_leg[leg] - 32768) * lsb_A;
    }

    // The amplifier so long after its current came on.
    static double approach(double after_s)
    {
        return 1.0 - std::exp(-5.0 * after_s / window_s);
    }
};

TEST_F(Shunt, InLineIsAlwaysSettled)
{
    input.legs = 6;
    input.quiet_s = 0.0;
    std::fill(std::begin(input.low_for_s), std::end(input.low_for_s), -1.0);
    for (int k = 0; k < 6; k++) {
        EXPECT_NEAR(seen_A(k), 4.0, 0.5 * lsb_A) << k;
    }
    EXPECT_EQ(adc.settled, 0b111111);
}

TEST_F(Shunt, LowSideSeesItsLegWhileTheLowerPathConducts)
{
    sensor.shunt = PLANT_LOW_SIDE;
    input.i_A[0] = -4.0;
    input.low_for_s[1] = -1.0;
    sensor.offset_A[1] = 0.25; // of the amplifier, so it stays
    EXPECT_NEAR(seen_A(0), -4.0, 0.5 * lsb_A);
    EXPECT_NEAR(seen_A(1), 0.25, 0.5 * lsb_A);
    EXPECT_NEAR(seen_A(2), 4.0, 0.5 * lsb_A);
    EXPECT_EQ(adc.settled, 0b101);
}

TEST_F(Shunt, LowSideSettlesWithinItsWindow)
{
    sensor.shunt = PLANT_LOW_SIDE;
    for (double share : {0.0, 0.01, 0.2, 0.7, 0.999}) {
        input.low_for_s[2] = share * window_s;
        EXPECT_NEAR(seen_A(2), 4.0 * approach(share * window_s), 0.5 * lsb_A) << share;
        EXPECT_EQ(adc.settled, 0b011) << share;
    }
    for (double share : {1.0, 1.001, 1e3}) {
        input.low_for_s[2] = share * window_s;
        EXPECT_NEAR(seen_A(2), 4.0, 0.5 * lsb_A) << share;
        EXPECT_EQ(adc.settled, 0b111) << share;
    }
}

TEST_F(Shunt, SingleShuntSeesTheLinkAlone)
{
    sensor.shunt = PLANT_SINGLE_SHUNT;
    sensor.gain_error[0] = 0.1;
    sensor.offset_A[1] = 1.0; // of a shunt that is not there
    EXPECT_NEAR(seen_A(0), 6.6, 0.5 * lsb_A);
    for (int k = 1; k < PLANT_LEGS; k++) {
        EXPECT_EQ(adc.i_leg[k], 0x8000) << k;
    }
    EXPECT_EQ(adc.settled, 0b001);
}

TEST_F(Shunt, SingleShuntSettlesAfterTheLastEdge)
{
    sensor.shunt = PLANT_SINGLE_SHUNT;
    input.i_dc_A = -6.0;
    std::fill(std::begin(input.low_for_s), std::end(input.low_for_s), -1.0); // no matter
    for (double share : {0.0, 0.3, 0.999}) {
        input.quiet_s = share * window_s;
        EXPECT_NEAR(seen_A(0), -6.0 * approach(share * window_s), 0.5 * lsb_A) << share;
        EXPECT_EQ(adc.settled, 0) << share;
    }
    input.quiet_s = window_s;
    EXPECT_NEAR(seen_A(0), -6.0, 0.5 * lsb_A);
    EXPECT_EQ(adc.settled, 0b001);
}

TEST_F(Shunt, WithoutSettlingTimeConductionIsEnough)
{
    sensor.settle_s = 0.0;
    sensor.shunt = PLANT_LOW_SIDE;
    input.low_for_s[0] = 0.0;
    input.low_for_s[1] = -1e-9;
    EXPECT_NEAR(seen_A(0), 4.0, 0.5 * lsb_A);
    EXPECT_EQ(seen_A(1), 0.0);
    EXPECT_EQ(adc.settled, 0b101);
    sensor.shunt = PLANT_SINGLE_SHUNT;
    input.quiet_s = 0.0;
    EXPECT_NEAR(seen_A(0), 6.0, 0.5 * lsb_A);
    EXPECT_EQ(adc.settled, 0b001);
}

// A single shunt draws for its own channel and the link.
TEST_F(Shunt, SingleShuntDrawsTwice)
{
    sensor.shunt = PLANT_SINGLE_SHUNT;
    sensor.noise_lsb = 20.0;
    input.i_dc_A = 0.0;
    input.v_dc_V = 225.0;
    noise_t own;
    noise_seed(&own, 1);
    auto drawn = [&own] { return static_cast<int>(std::lround(32768 + 20.0 * noise_gaussian(&own))); };
    for (int n = 0; n < 5; n++) {
        convert();
        EXPECT_EQ(adc.i_leg[0], drawn());
        EXPECT_EQ(adc.i_leg[1], 0x8000);
        EXPECT_EQ(adc.v_dc, drawn());
    }
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
