#include "injection/basic_pulses.h"

#include <gtest/gtest.h>

#include <cstring>

#include "tests/unit/injection/pulse_rig.h"

namespace
{

using namespace pulse_rig;

const Method<basic_pulses_t> kBasic = {&basic_pulses_step, &basic_pulses_find};

// METHODS-ADDENDUM.md B (b), row 99, with a 12-bit converter, noise, and gains of 1.01, 1 and 0.99.
constexpr double kGain = 0.01;
constexpr double kIpmMean_deg = 1, kIpmMost_deg = 2;
constexpr double kSpmMean_deg = 5, kSpmMost_deg = 9;
constexpr double kSpmEqual_deg = 2; // with equal gains

TEST(BasicPulses, FindsIpm1000)
{
    expect_grid(kBasic, ipm(kGain), kIpmMean_deg, kIpmMost_deg);
}

TEST(BasicPulses, FindsSpm400)
{
    expect_grid(kBasic, spm(kGain), kSpmMean_deg, kSpmMost_deg);
}

// What remains is what the gains make: without them it is gone, and with them it is there.
TEST(BasicPulses, TwinWithEqualGainsIsExact)
{
    expect_grid(kBasic, spm(0), kSpmEqual_deg, 9);
    EXPECT_GE(grid(kBasic, spm(kGain)).mean_deg, 3);
}

TEST(BasicPulses, AResetForgetsAll)
{
    basic_pulses_t self;
    std::memset(&self, 0x55, sizeof self);
    basic_pulses_reset(&self);
    const basic_pulses_t none = {};
    EXPECT_EQ(std::memcmp(&self, &none, sizeof self), 0);
}

} // namespace
