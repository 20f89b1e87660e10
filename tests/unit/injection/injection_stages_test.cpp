// The optional stages about a source, each by what it does to an error signal that is known.
#include "injection/injection_stages.h"

#include <gtest/gtest.h>

#include <cmath>

#include "firmware/math/trig.h"
#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"

namespace
{

using bench::kDegree;
using bench::real;

constexpr double kFine = 1e-6;

drive_config_t configured(std::initializer_list<std::pair<int32_t drive_params_t::*, int32_t>> changes = {})
{
    drive_params_t p;
    drive_params_default(&p);
    p.start_method = 1;
    for (const auto &change : changes) {
        p.*change.first = change.second;
    }
    drive_config_t c = {};
    const drive_result_t result = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_TRUE(result.ok) << result.reason;
    return c;
}

bool refused(std::initializer_list<std::pair<int32_t drive_params_t::*, int32_t>> changes)
{
    drive_params_t p;
    drive_params_default(&p);
    p.start_method = 1;
    for (const auto &change : changes) {
        p.*change.first = change.second;
    }
    drive_config_t c = {};
    return !drive_configure(&c, &p, PM_CHANNELS).ok;
}

pm_dir_t direction(double rad)
{
    return {bench::fixed(std::cos(rad) * (1 - 1e-9), 31), bench::fixed(std::sin(rad) * (1 - 1e-9), 31)};
}

injection_in_t at(double theta)
{
    injection_in_t in = {};
    in.dir = direction(theta);
    in.ahead = {bench::fixed(std::cos(theta + 0.02), 30), bench::fixed(std::sin(theta + 0.02), 30)};
    return in;
}

TEST(InjectionStages, NoneIsTheDefault)
{
    const drive_config_t c = configured();
    EXPECT_FALSE(c.position.injection.stages.on);
    EXPECT_TRUE(c.position.injection.inlined);
    EXPECT_FALSE(configured({{&drive_params_t::cross_coupling_comp, 2}}).position.injection.inlined);
}

// theta_v = theta^ + theta_m / 2, and the current of the source comes back turned by as much
TEST(InjectionStages, VirtualFrameIsAheadByHalfOfThetaM)
{
    const injection_stages_config_t c =
        configured({{&drive_params_t::cross_coupling_comp, 2}}).position.injection.stages;
    ASSERT_TRUE(c.direct);
    injection_stages_t self = {};
    injection_stages_reset(&self, &c);
    for (const double i_q : {0.0, 0.2, 0.4, -0.4}) {
        obs_in_t slow = {};
        slow.i_dq = {0, bench::fixed(i_q, 28)};
        injection_stages_slow(&self, &c, &slow, 0);
        const double turn = real(saliency_shift(&c.saliency, bench::fixed(i_q, 28)));
        for (const double theta : {0.0, 0.9, 2.5, 4.4}) {
            const injection_in_t in = at(theta);
            injection_in_t to = {};
            injection_stages_before(&self, &c, &in, &to);
            EXPECT_NEAR(std::atan2(real(to.dir.sin), real(to.dir.cos)),
                        std::remainder(theta + turn, 2 * M_PI), kFine);
            EXPECT_NEAR(std::atan2(real(to.ahead.sin), real(to.ahead.cos)),
                        std::remainder(theta + 0.02 + turn, 2 * M_PI), kFine);
            injection_out_t out = {};
            out.i = {bench::fixed(0.5, 28), bench::fixed(-0.25, 28)};
            injection_stages_after(&self, &c, &in, &out);
            EXPECT_NEAR(real(out.i.d), 0.5 * std::cos(turn) + 0.25 * std::sin(turn), kFine);
            EXPECT_NEAR(real(out.i.q), 0.5 * std::sin(turn) - 0.25 * std::cos(turn), kFine);
        }
    }
    // -L_dqh grows with i_q: at rated current IPM-1000 has 15 degrees and more of theta_m
    EXPECT_GT(real(saliency_shift(&c.saliency, bench::fixed(0.4, 28))), 7 * kDegree);
}

// With another stage alone the source keeps the frame of the position.
TEST(InjectionStages, WithoutTheVirtualFrameTheSourceHasThatOfThePosition)
{
    injection_stages_config_t c =
        configured({{&drive_params_t::cross_coupling_comp, 2}}).position.injection.stages;
    injection_stages_t self = {};
    injection_stages_reset(&self, &c);
    obs_in_t slow = {};
    slow.i_dq = {0, bench::fixed(0.4, 28)};
    injection_stages_slow(&self, &c, &slow, 0);
    c.direct = false;
    const injection_in_t in = at(0.9);
    injection_in_t to = {};
    injection_stages_before(&self, &c, &in, &to);
    EXPECT_EQ(to.dir.cos, in.dir.cos);
    EXPECT_EQ(to.dir.sin, in.dir.sin);
    EXPECT_EQ(to.ahead.cos, in.ahead.cos);
    EXPECT_EQ(to.ahead.sin, in.ahead.sin);
}

TEST(InjectionStages, SaliencyOfAnOrderIsTakenOut)
{
    for (const int order : {-4, 8, -10, 14}) {
        for (const double phase : {0.0, 1.0, -2.0}) {
            const injection_stages_config_t c = configured({{&drive_params_t::saliency_order, order},
                                                            {&drive_params_t::saliency_ratio, 100000},
                                                            {&drive_params_t::saliency_phase,
                                                             static_cast<int32_t>(std::lround(phase * 1e6))}})
                                                    .position.injection.stages;
            injection_stages_t self = {};
            injection_stages_reset(&self, &c);
            for (double theta = 0; theta < 6.28; theta += 0.17) {
                const injection_in_t in = at(theta);
                injection_out_t out = {};
                out.eps = bench::fixed(0.05 * std::sin((order - 2) * theta + phase) + 0.01, 28);
                injection_stages_after(&self, &c, &in, &out);
                EXPECT_NEAR(real(out.eps), 0.01, 2e-5) << order << " " << phase << " " << theta;
            }
        }
    }
    EXPECT_TRUE(refused({{&drive_params_t::saliency_order, 4}})); // no winding of three like phases has it
}

// c + a cos 2 theta + b sin 2 theta along the carrier: what a vector that stands shows there
TEST(InjectionStages, LearnsWhatStandsWhileItTurnsAndKeepsIt)
{
    const drive_config_t whole = configured({{&drive_params_t::asymmetry_learning, 1}});
    const injection_stages_config_t &c = whole.position.injection.stages;
    const double a = 4e-4, b = -7e-4, mean = 0.03;
    injection_stages_t self = {};
    injection_stages_reset(&self, &c);
    double theta = 0;
    const auto run = [&](int ms, double omega_rad_s) {
        for (int n = 0; n < ms; ++n) {
            theta += 1e-3 * omega_rad_s;
            obs_in_t slow = {};
            slow.dir = direction(theta);
            slow.omega = bench::fixed(omega_rad_s / 540, 28);
            const double h_d = mean + a * std::cos(2 * theta) + b * std::sin(2 * theta);
            injection_stages_slow(&self, &c, &slow, bench::fixed(h_d, 28));
        }
    };
    run(3000, 10);
    EXPECT_NEAR(real(self.as_a), a, 0.02 * 8e-4);
    EXPECT_NEAR(real(self.as_b), b, 0.02 * 8e-4);
    const injection_stages_t learnt = self;
    run(3000, 1); // slower than what it learns from
    EXPECT_EQ(self.as_a, learnt.as_a);
    EXPECT_EQ(self.as_b, learnt.as_b);
    injection_stages_reset(&self, &c);
    EXPECT_EQ(self.as_a, learnt.as_a);

    const injection_in_t in = at(0.6);
    injection_out_t out = {};
    injection_stages_after(&self, &c, &in, &out);
    const double gain = self.gain / std::pow(2.0, 20);
    EXPECT_NEAR(real(out.eps), -gain * (b * std::cos(1.2) - a * std::sin(1.2)), 0.02 * gain * 8e-4);
    EXPECT_TRUE(refused({{&drive_params_t::asymmetry_learning, 1}, {&drive_params_t::injection, 2}}));
}

TEST(InjectionStages, LearnsBothPartsAlike)
{
    const drive_config_t whole = configured({{&drive_params_t::asymmetry_learning, 1}});
    const injection_stages_config_t &c = whole.position.injection.stages;
    injection_stages_t self = {};
    injection_stages_reset(&self, &c);
    self.c = bench::fixed(0.03, 28);
    obs_in_t slow = {};
    slow.dir = direction(22.5 * kDegree); // 2 theta where both are as large
    slow.omega = PM_ONE / 4;
    injection_stages_slow(&self, &c, &slow, bench::fixed(0.04, 28));
    EXPECT_GT(self.as_a, 0);
    EXPECT_NEAR(self.as_a, self.as_b, 16);
}

} // namespace
