#include "injection/polarity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/contract/bench.h"

namespace
{

using bench::fixed;
using bench::real;

TEST(Polarity, MeanAndNoiseAreThoseOfTheValues)
{
    std::mt19937 random(3);
    for (const double spread : {1e-6, 3e-5, 1e-3, 0.03}) {
        for (const unsigned count : {16U, 32U, 128U}) {
            std::normal_distribution<double> values(0.4 * spread, spread);
            polarity_mean_t self = {};
            double sum = 0, square = 0;
            for (unsigned k = 0; k < count; ++k) {
                const pm_q_t x = fixed(values(random), 28);
                polarity_add(&self, x);
                sum += real(x);
                square += real(x) * real(x);
            }
            const double mean = sum / count;
            const double noise = std::sqrt(square / count - mean * mean) / std::sqrt(count);
            EXPECT_NEAR(real(polarity_mean(&self)), mean, 1e-8);
            EXPECT_NEAR(real(polarity_noise(&self)), noise, 0.02 * noise + 1e-8) << spread << ' ' << count;
        }
    }
}

TEST(Polarity, NoValuesHaveNeitherMeanNorNoise)
{
    polarity_mean_t self = {};
    EXPECT_EQ(polarity_mean(&self), 0);
    EXPECT_EQ(polarity_noise(&self), 0);
    polarity_add(&self, PM_Q(0.01));
    EXPECT_EQ(polarity_noise(&self), 0);
}

TEST(Polarity, ValuesBeyondTheRangeAreTakenAsItsEnd)
{
    polarity_mean_t self = {};
    for (int k = 0; k < 256; ++k) {
        polarity_add(&self, k % 2 == 0 ? PM_Q(1.0) : PM_Q(-1.0));
    }
    EXPECT_EQ(polarity_mean(&self), 0);
    EXPECT_NEAR(real(polarity_noise(&self)), 0.125 / 16, 1e-4);
}

TEST(Polarity, RestOfAMeanFallsWithTheRoot)
{
    for (const unsigned count : {4U, 16U, 32U, 128U}) {
        EXPECT_NEAR(real(polarity_rest(PM_Q(1e-4), count)), 1e-4 / std::sqrt(count), 1e-7) << count;
    }
}

// Sure from five sigma beyond the allowance on, either way.
TEST(Polarity, IsJudgedBeyondAllowanceAndNoise)
{
    polarity_config_t c = {};
    for (const int sign : {1, -1}) {
        for (const bool reversed : {false, true}) {
            c.reversed = reversed;
            pm_sigma_t margin;
            bool north;
            EXPECT_EQ(polarity_judge(&c, sign * 6100, 1000, 1000, &margin, &north), PM_DONE);
            EXPECT_NEAR(margin / 256.0, 5.1, 0.05);
            EXPECT_EQ(north, (sign > 0) != reversed);
            EXPECT_EQ(polarity_judge(&c, sign * 5900, 1000, 1000, &margin, &north), PM_FAILED_POLARITY);
            EXPECT_EQ(polarity_judge(&c, sign * 900, 1000, 1, &margin, &north), PM_FAILED_POLARITY);
            EXPECT_EQ(margin, 0);
        }
    }
}

} // namespace
