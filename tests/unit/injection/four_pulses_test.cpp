#include "injection/four_pulses.h"

#include <gtest/gtest.h>

#include <vector>

#include "injection/basic_pulses.h"
#include "injection/initial_pulses.h"
#include "tests/unit/injection/pulse_rig.h"

namespace
{

using namespace pulse_rig;

const Method<four_pulses_t> kFour = {&four_pulses_step, &four_pulses_find};
const Method<initial_pulses_t> kSix = {&initial_pulses_step, &initial_pulses_find};
const Method<basic_pulses_t> kBasic = {&basic_pulses_step, &basic_pulses_find};

// METHODS-ADDENDUM.md B (b), row 101, with a 12-bit converter, noise, and gains of 1.01, 1 and 0.99.
constexpr double kGain = 0.01;
constexpr double kIpmMean_deg = 0.8, kIpmMost_deg = 2;
constexpr double kSpmMean_deg = 3.5, kSpmMost_deg = 7;
// The same, of the first three pulses uncorrected.
constexpr double kIpmTwin_deg = 2.7, kTwinWithin_deg = 0.5;
constexpr double kSpmTwin_deg = 3.5; // 5.3 together with what the gains do

TEST(FourPulses, FindsIpm1000)
{
    expect_grid(kFour, ipm(kGain), kIpmMean_deg, kIpmMost_deg);
}

TEST(FourPulses, FindsSpm400)
{
    expect_grid(kFour, spm(kGain), kSpmMean_deg, kSpmMost_deg);
}

TEST(FourPulses, TakesTwoThirdsOfTheTimeOfSix)
{
    for (const Rig &r : {ipm(0), spm(0)}) {
        EXPECT_LE(grid(kFour, r).periods,
                  2.0 / 3 * grid(kSix, r).periods + 3); // the decay is not the same in all
    }
}

// What the first three pulses say, with the right pole: the saturation of first order.
TEST(FourPulses, TwinWithoutTheFourthErrs)
{
    const Method<four_pulses_t> twin = {&four_pulses_step, [](four_pulses_t *self, const pulses_config_t *c) {
                                            const pm_procedure_t result = four_pulses_find(self, c);
                                            if (result != PM_DONE) {
                                                return result;
                                            }
                                            const pm_angle_t right = self->train.found.theta;
                                            const pm_ab_t y = pulses_saliency(&self->train);
                                            const double half = std::atan2(y.beta, y.alpha) / 2;
                                            const double away = bench::wrapped(half - bench::rad(right));
                                            self->train.found.theta = bench::turns(
                                                std::abs(away) < bench::kPi / 2 ? half : half + bench::kPi);
                                            return result;
                                        }};
    const Grid ipm_grid = grid(twin, ipm(kGain));
    EXPECT_NEAR(ipm_grid.mean_deg, kIpmTwin_deg, kTwinWithin_deg);
    EXPECT_GE(grid(twin, spm(kGain)).mean_deg, kSpmTwin_deg);
}

// A+ B+ C+, and the opposite of that whose axis the magnet's is nearest to.
TEST(FourPulses, TheFourthIsTheOppositeOfTheNearest)
{
    const Rig r = ideal(ipm(0));
    const pulses_config_t c = config(r);
    for (int k = 0; k < 24; ++k) {
        const double theta = (k * 15 + 5) * kDegree;
        std::vector<int> patterns;
        static std::vector<int> *seen;
        seen = &patterns;
        const Method<four_pulses_t> watched = {
            [](four_pulses_t *self, const pulses_config_t *config, pm_abc_t i, pulses_out_t *out) {
                const pm_procedure_t result = four_pulses_step(self, config, i, out);
                int pattern = 0;
                for (int leg = 0; leg < 3; ++leg) {
                    pattern |= (out->driven && out->duty[leg] != 0 ? 1 : 0) << leg;
                }
                if (pattern != 0 && (seen->empty() || seen->back() != pattern)) {
                    seen->push_back(pattern);
                }
                return result;
            },
            &four_pulses_find};
        ASSERT_EQ(find(watched, r, c, theta).state, PM_DONE);
        int nearest = 0;
        for (int x = 1; x < 3; ++x) {
            const auto near = [theta](int axis) {
                return std::abs(std::cos(theta - axis * 2 * bench::kPi / 3));
            };
            nearest = near(x) > near(nearest) ? x : nearest;
        }
        EXPECT_EQ(patterns, (std::vector<int>{1, 2, 4, 7 & ~(1 << nearest)})) << theta;
    }
}

TEST(FourPulses, FailsWithoutSaliency)
{
    Rig r = ipm(kGain);
    r.plant.machine.L_q0_H = r.plant.machine.L_d0_H = 50e-3;
    r.plant.machine.c_A_Wb5 = 0;
    for (const double theta : {0.0, 0.8, 2.0}) {
        EXPECT_EQ(find(kFour, r, config(r), theta).state, PM_FAILED_SALIENCY) << theta;
    }
}

TEST(FourPulses, FailsWithoutPolarity)
{
    Rig r = ipm(kGain);
    r.plant.machine = {6.0, 43e-3, 75e-3, 0.0, 0.236, 3}; // salient, not saturating
    for (const double theta : {0.0, 0.8, 2.0}) {
        EXPECT_EQ(find(kFour, r, config(r), theta).state, PM_FAILED_POLARITY) << theta;
    }
}

// The q-axis of a machine with L_q below L_d, told the other way round, is found: D of the nearest leg is not zero, and would be
// a pole 90 degrees off.
TEST(Pulses, TheOtherAxisHasNoPole)
{
    Rig r = ipm(0.01);
    std::swap(r.plant.machine.L_d0_H, r.plant.machine.L_q0_H);
    pulses_config_t c = config(r);
    c.s_min = 0; // at some angles it is refused for too little saliency before
    for (int k = 0; k < 24; ++k) {
        const double theta = (k + 0.3) * bench::kPi / 12;
        EXPECT_EQ(find(kFour, r, c, theta).state, PM_FAILED_POLARITY) << k;
        EXPECT_EQ(find(kSix, r, c, theta).state, PM_FAILED_POLARITY) << k;
        EXPECT_EQ(find(kBasic, r, c, theta).state, PM_FAILED_POLARITY) << k;
    }
}

TEST(Pulses, SaliencyIsThatOfTheData)
{
    for (const Rig &r : {ipm(0.01), spm(0.01)}) {
        expect_saliency_of_the_data(kFour, r);
        expect_saliency_of_the_data(kSix, r);
        expect_saliency_of_the_data(kBasic, r);
    }
}

// polarity.h: L_d_falls. The same angle but for half a turn, with the same margin.
TEST(Pulses, TheOppositeSignOfSaturationIsTheOtherPole)
{
    const auto check = [](const auto &method) {
        const Rig r = ipm(0.01);
        pulses_config_t c = config(r);
        for (const double theta : {0.3, 2.2, 4.0}) {
            const Result x = find(method, r, c, theta);
            pulses_config_t opposite = c;
            opposite.reversed = true;
            const Result y = find(method, r, opposite, theta);
            ASSERT_EQ(y.state, PM_DONE);
            EXPECT_NEAR(std::abs(bench::wrapped(x.theta_rad - y.theta_rad)), bench::kPi, 1e-6) << theta;
            EXPECT_EQ(x.margin, y.margin);
        }
    };
    check(kSix);
    check(kFour);
    check(kBasic);
}

TEST(FourPulses, RefusesExchangedSensors)
{
    const Method<four_pulses_t> wrong = {
        [](four_pulses_t *self, const pulses_config_t *c, pm_abc_t i, pulses_out_t *out) {
            return four_pulses_step(self, c, {i.b, i.a, i.c}, out);
        },
        &four_pulses_find};
    EXPECT_EQ(find(wrong, ipm(0), config(ipm(0)), 0.5).state, PM_FAILED_UNEVEN);
}

// What dead time makes of a saliency is no polarity. Twin: where nobody counts with it, it is one, and the wrong one.
TEST(Pulses, WhatTheBridgeAddsIsNoPolarity)
{
    int wrong = 0;
    for (const double L_d_H : {2e-3, 4e-3, 8e-3}) {
        Rig r = ipm(0.0);
        r.plant.machine = {1.0, L_d_H, 3.5 * L_d_H, 0.0, 0.236, 3};
        r.plant.inverter.c_leg_F = 0;
        r.L_d_H = L_d_H;
        r.L_q_H = 3.5 * L_d_H;
        pulses_config_t unaware = config(r);
        unaware.i_bridge = 0;
        for (int k = 0; k < 24; ++k) {
            const double theta = (15 * k + 3) * kDegree;
            EXPECT_EQ(find(kSix, r, config(r), theta).state, PM_FAILED_POLARITY) << L_d_H << ' ' << k;
            EXPECT_EQ(find(kFour, r, config(r), theta).state, PM_FAILED_POLARITY) << L_d_H << ' ' << k;
            const Result x = find(kSix, r, unaware, theta);
            wrong += x.state == PM_DONE && std::abs(x.error_deg) > 90 ? 1 : 0;
        }
    }
    EXPECT_GT(wrong, 6);
}

} // namespace
