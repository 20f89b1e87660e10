#include "injection/dc_link_pulses.h"

#include <gtest/gtest.h>

#include "tests/unit/injection/pulse_rig.h"

namespace
{

using namespace pulse_rig;

// METHODS-ADDENDUM.md B (b), row 103.
constexpr double kIpmMean_deg = 3, kIpmMost_deg = 10;
constexpr double kSpmMean_deg = 2.5, kSpmMost_deg = 6;
constexpr double kPulse_A = 6; // 1.5 times rated: 4 A are refused, margin 4 to 6
constexpr int kFew = 30;       // positions; all of them in tests/scenario

dc_link_pulses_config_t own; // of the rig at work

// A link of 470 uF behind R, and the configuration as make_dc_link_pulses() derives it for `told`.
Rig behind(Rig r, double R_ohm, double told_ohm = 1.0, int repeats = 4, double pulse_A = kPulse_A)
{
    constexpr double kC_F = 470e-6;
    r.plant.dclink.r_source_ohm = R_ohm;
    r.plant.dclink.c_F = kC_F;
    r.i_pulse_A = pulse_A;
    const pulses_config_t c = config(r);
    const double T_s = r.base.period_s, duty = real(c.duty), u = c.periods * T_s / (told_ohm * kC_F);
    const double v_base = r.plant.sensor.v_full_scale_V;
    const double k = duty * told_ohm * (1 - (1 - std::exp(-u)) / u) * r.base.i_A / v_base * repeats;
    own.periods = c.periods;
    own.duty = c.duty;
    own.wait = static_cast<uint16_t>(5 * told_ohm * kC_F / T_s + 1.5 * c.periods + 5);
    own.pulses = static_cast<uint16_t>(6 * repeats);
    own.limits.s_min = c.s_min;
    own.limits.pole.bridge = fixed(k * real(c.i_bridge) * 2 / 3, 28);
    own.limits.pole.noise = fixed(0.775 / 4096 * std::sqrt(repeats), 28);
    return r;
}

const Method<dc_link_pulses_t> kLink = {
    [](dc_link_pulses_t *self, const pulses_config_t *, pm_abc_t, pulses_out_t *out) {
        return dc_link_pulses_step(self, &own, fixed(seen.v_dc / 65536.0, 28), out);
    },
    [](dc_link_pulses_t *self, const pulses_config_t *) { return dc_link_pulses_find(self, &own); }};

TEST(DcLinkPulses, FindsIpm1000)
{
    expect_grid(kLink, behind(ipm(0), 1), kIpmMean_deg, kIpmMost_deg, kFew);
}

TEST(DcLinkPulses, FindsSpm400)
{
    expect_grid(kLink, behind(spm(0), 1), kSpmMean_deg, kSpmMost_deg, kFew);
}

// Behind 0.2 ohm the drop is a few steps of the converter: without the margin a guess, with it a refusal.
TEST(DcLinkPulses, TwinStiffSupplyIsRefusedWhereAGuessErrs)
{
    const Rig r = behind(ipm(0), 0.2, 1, 1, 4);
    const Grid honest = grid(kLink, r, kFew);
    EXPECT_EQ(honest.wrong_pole, 0);
    EXPECT_LT(honest.done, kFew / 4);
    const Method<dc_link_pulses_t> guess = {
        kLink.step, [](dc_link_pulses_t *self, const pulses_config_t *c) {
            const pm_procedure_t result = kLink.find(self, c);
            const pm_q_t *D = self->response.difference;
            const double x = real(pm_park(pm_clarke({D[0], D[1], D[2]}), pm_dir(self->found.theta)).d);
            self->found.theta += result != PM_DONE && x < 0 ? PM_TURN(0.5) : 0U;
            return PM_DONE;
        }};
    const Grid guessed = grid(guess, r, kFew);
    EXPECT_GE(guessed.wrong_pole, 0.03 * kFew);
}

// No link that drops, nothing connected: the voltage of six pulses is that before them.
TEST(DcLinkPulses, FailsWhenTheVoltageDoesNotFall)
{
    Rig r = behind(ipm(0), 1);
    r.plant.machine.L_d0_H *= 1e4;
    r.plant.machine.L_q0_H *= 1e4;
    r.plant.machine.c_A_Wb5 = 0;
    EXPECT_EQ(find(kLink, r, config(r), 0.5).state, PM_FAILED_OPEN);
}

// Four samples before the pulse, one at its end; the legs are off in between.
TEST(DcLinkPulses, TakesTheDropOfEachPulse)
{
    const dc_link_pulses_config_t c = {3, 10, 6, PM_ONE / 2, {}};
    dc_link_pulses_t self = {};
    for (int pulse = 0; pulse < 6; ++pulse) {
        for (int k = 1; k <= 15; ++k) {
            pulses_out_t out;
            const bool before = k >= 7 && k <= 10;
            const pm_q_t v = before ? 1000 : k == 15 ? 1000 - 10 * (pulse + 1) : 77;
            const pm_procedure_t state = dc_link_pulses_step(&self, &c, v, &out);
            EXPECT_EQ(state, pulse == 5 && k == 15 ? PM_DONE : PM_RUNNING) << pulse << ' ' << k;
            EXPECT_EQ(out.driven, k > 10 && k < 15) << pulse << ' ' << k;
            const int high = (out.duty[0] != 0) + (out.duty[1] != 0) + (out.duty[2] != 0);
            EXPECT_EQ(high, k > 10 && k < 14 ? 1 + pulse % 2 : 0) << pulse << ' ' << k;
        }
    }
    for (int x = 0; x < 3; ++x) {
        EXPECT_EQ(self.response.sum[x], 10 * (2 * x + 1) + 10 * (2 * x + 2));
        EXPECT_EQ(self.response.difference[x], -10);
    }
}

} // namespace
