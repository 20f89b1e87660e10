#include "injection/boundary_detection.h"

#include <gtest/gtest.h>

#include "tests/unit/injection/pulse_rig.h"

namespace
{

using namespace pulse_rig;

constexpr double kThreshold = 0.259; // sin 15 degrees
constexpr double kSector_deg = 30;

pm_procedure_t find_with(boundary_detection_t *self, const pulses_config_t *c, double threshold)
{
    const boundary_detection_config_t own = {fixed(threshold, 28), threshold == 0};
    return boundary_detection_find(self, c, &own);
}

const Method<boundary_detection_t> kSectors = {
    &boundary_detection_step,
    [](boundary_detection_t *self, const pulses_config_t *c) { return find_with(self, c, kThreshold); }};
const Method<boundary_detection_t> kInterpolated = {
    &boundary_detection_step,
    [](boundary_detection_t *self, const pulses_config_t *c) { return find_with(self, c, 0); }};
const Method<boundary_detection_t> kCentres = {
    &boundary_detection_step,
    [](boundary_detection_t *self, const pulses_config_t *c) { return find_with(self, c, 1e-6); }};

// METHODS-ADDENDUM.md B (b), row 102: one-degree steps about the boundaries, noise of 3 LSB.
Rig noisy()
{
    Rig r = ipm(0.02);
    r.plant.sensor.noise_lsb = 3;
    r.noise_A = 3 * 2 * r.base.i_A / 4096;
    return r;
}

struct Seen {
    double most_deg = 0, mean_deg = 0;
    int refused = 0, wrong_sector = 0;
};

Seen around_the_boundaries(const Method<boundary_detection_t> &method, const Rig &r)
{
    Seen seen_here;
    const pulses_config_t c = config(r);
    for (int boundary = 0; boundary < 12; ++boundary) {
        for (int off = -3; off <= 3; ++off) {
            const double theta_deg = kSector_deg * boundary + off;
            const Result x = find(method, r, c, theta_deg * kDegree, static_cast<uint64_t>(theta_deg + 4));
            seen_here.refused += x.state == PM_DONE ? 0 : 1;
            seen_here.most_deg = std::max(seen_here.most_deg, std::abs(x.error_deg));
            seen_here.mean_deg += std::abs(x.error_deg) / 84;
            seen_here.wrong_sector += std::abs(x.error_deg) > kSector_deg / 2 ? 1 : 0;
        }
    }
    ::testing::Test::RecordProperty("mean_deg", std::to_string(seen_here.mean_deg));
    ::testing::Test::RecordProperty("most_deg", std::to_string(seen_here.most_deg));
    return seen_here;
}

TEST(BoundaryDetection, TakesTheBoundaryWhereASignCannotBeTrusted)
{
    const Seen s = around_the_boundaries(kSectors, noisy());
    EXPECT_EQ(s.refused, 0);
    EXPECT_LE(s.most_deg, 8.5);
    EXPECT_EQ(s.wrong_sector, 0);
}

TEST(BoundaryDetection, InterpolatesWithinTheSector)
{
    const Seen s = around_the_boundaries(kInterpolated, noisy());
    EXPECT_EQ(s.refused, 0);
    EXPECT_LE(s.most_deg, 2);
}

// Without the rule: half a sector at its boundaries, and the wrong sector.
TEST(BoundaryDetection, TwinWithoutTheThresholdJumps)
{
    const Seen s = around_the_boundaries(kCentres, noisy());
    EXPECT_GE(s.most_deg, 14);
    EXPECT_GT(s.wrong_sector, 0);
}

// All around: 7.5 degrees by construction, and what the position of the rotor adds.
TEST(BoundaryDetection, FindsBothMachinesAllAround)
{
    expect_grid(kSectors, ipm(0.02), 4.5, 8.5);
    expect_grid(kInterpolated, ipm(0.02), 0.8, 1.6);
    expect_grid(kInterpolated, spm(0.02), 1.5, 3.5);
}

// By hand: an angle in each sector and its three numbers, as they stand in the header.
TEST(BoundaryDetection, EachSectorHasItsSigns)
{
    pulses_config_t c = config(ipm(0));
    for (int sector = 0; sector < 12; ++sector) {
        for (const double within_deg : {3.0, 15.0, 27.0}) {
            const double theta = (kSector_deg * sector + within_deg) * kDegree;
            boundary_detection_t self = {};
            pulses_t *train = &self.pulses.train;
            for (int x = 0; x < 3; ++x) {
                const double g_x = x * 2 * bench::kPi / 3;
                for (int k = 0; k < 3; ++k) {
                    const double g_k = k * 2 * bench::kPi / 3;
                    train->e[x][k] =
                        fixed(0.5 * (std::cos(g_k - g_x) + 0.2 * std::cos(2 * theta - g_x - g_k)), 28);
                }
                self.pulses.difference[x] = fixed(0.1 * std::cos(theta - g_x), 28);
            }
            train->steps = PULSES_BALANCING;
            ASSERT_EQ(find_with(&self, &c, kThreshold), PM_DONE) << sector << ' ' << within_deg;
            const double error_deg = bench::wrapped(bench::rad(train->found.theta) - theta) / kDegree;
            EXPECT_NEAR(error_deg, within_deg == 15 ? 0 : within_deg == 3 ? -3 : 3, 1e-3) << sector;
            ASSERT_EQ(find_with(&self, &c, 0), PM_DONE);
            EXPECT_NEAR(bench::wrapped(bench::rad(train->found.theta) - theta) / kDegree, 0, 0.6) << sector;
        }
    }
}

// Currents that no machine makes: all three of one sign.
TEST(BoundaryDetection, RefusesSignsOfNoMachine)
{
    const pulses_config_t c = config(ipm(0));
    for (const int sign : {1, -1}) {
        boundary_detection_t self = {};
        pulses_t *train = &self.pulses.train;
        for (int x = 0; x < 3; ++x) {
            train->e[x][x] = fixed(0.5, 28);
            train->e[x][(x + 1) % 3] = fixed(-0.25 + sign * 0.3, 28);
            train->e[x][(x + 2) % 3] = fixed(-0.25 - sign * 0.3, 28);
        }
        train->e[0][1] += fixed(0.55, 28); // a saliency, or it would be that which is missing
        train->steps = PULSES_BALANCING;
        EXPECT_EQ(find_with(&self, &c, 0), PM_FAILED_UNEVEN) << sign;
    }
}

TEST(BoundaryDetection, SaliencyIsThatOfTheData)
{
    expect_saliency_of_the_data(kSectors, ipm(0.01));
}

TEST(BoundaryDetection, FailsWithoutSaliencyAndWithoutPolarity)
{
    Rig round = ipm(0.01);
    round.plant.machine.L_q0_H = round.plant.machine.L_d0_H = 50e-3;
    round.plant.machine.c_A_Wb5 = 0;
    Rig linear = ipm(0.01);
    linear.plant.machine = {6.0, 43e-3, 75e-3, 0.0, 0.236, 3};
    for (const double theta : {0.0, 0.8, 2.0}) {
        EXPECT_EQ(find(kSectors, round, config(round), theta).state, PM_FAILED_SALIENCY) << theta;
        EXPECT_EQ(find(kSectors, linear, config(linear), theta).state, PM_FAILED_POLARITY) << theta;
    }
}

} // namespace
