#include "injection/dual_pulses.h"

#include <gtest/gtest.h>

#include "firmware/math/trig.h"
#include "tests/unit/injection/leg_rig.h"

namespace
{

using namespace leg_rig;

// METHODS-ADDENDUM.md B (b), row 93.
constexpr int kPositions93 = 72;
constexpr double kSigma = 5;
constexpr double kTime_s = 25e-3;
constexpr double kMovement_deg = 0.5;
// What injection leaves of the position without load.
constexpr double kAngleError = 3 * kDegree;

dual_pulses_config_t make(const Rig &r)
{
    const double v_dc = r.plant.dclink.v_source_V;
    const double exact = r.i_pulse_A * r.L_d_H / (0.45 * v_dc * r.base.period_s);
    const double n = std::ceil(exact);
    dual_pulses_config_t c = {};
    c.periods = static_cast<uint16_t>(n);
    c.timeout = 500;
    c.amplitude = fixed(r.i_pulse_A * r.L_d_H / (n * v_dc * r.base.period_s), 28);
    c.i_zero = fixed(0.025 / r.base.i_A, 28);
    c.i_least = fixed(r.i_pulse_A / 4 / r.base.i_A, 28);
    c.noise = fixed(2 * r.noise_A / r.base.i_A, 28);
    const double x = n * r.base.period_s * r.plant.machine.R_s_ohm / r.L_d_H;
    c.decay = fixed((std::exp(-x) + std::exp(-3 * x)) / 2, 31);
    c.ringing = fixed(2 * v_dc * std::sqrt(r.plant.inverter.c_leg_F / r.L_d_H) / r.base.i_A, 28);
    return c;
}

struct Found {
    pm_procedure_t result;
    bool north;
    double margin;
    LegRun run;
};

// d_rad: the axis that is looked at.
Found look(const Rig &r, const dual_pulses_config_t &c, double theta_rad, double d_rad, uint64_t seed = 1)
{
    dual_pulses_t self = {};
    const pm_dir_t d = pm_dir(bench::turns(d_rad));
    const LegRun x = run_legs(r, theta_rad, seed, [&](pm_abc_t i, pulses_out_t *out) {
        return dual_pulses_step(&self, &c, pm_clarke(i), d, out);
    });
    if (x.result != PM_DONE) {
        return {x.result, false, 0, x};
    }
    const pm_procedure_t result = dual_pulses_find(&self, &c);
    return {result, self.north, self.margin / 256.0, x};
}

void expect_right(const Rig &r)
{
    const dual_pulses_config_t c = make(r);
    for (int k = 0; k < kPositions93; ++k) {
        const double theta = (k + 0.3) * 2 * bench::kPi / kPositions93;
        for (const bool opposite : {false, true}) {
            const double d = theta + kAngleError * (k % 2 == 0 ? 1 : -1) + (opposite ? bench::kPi : 0);
            const Found x = look(r, c, theta, d, static_cast<uint64_t>(k) + 1);
            ASSERT_EQ(x.result, PM_DONE) << k;
            EXPECT_EQ(x.north, !opposite) << k;
            EXPECT_GE(x.margin, kSigma) << k;
            EXPECT_LE(x.run.periods * r.base.period_s, kTime_s);
            EXPECT_LE(x.run.i_most_A, 1.3 * r.i_pulse_A);
            // an impulse moves the rotor until friction stops it: no more than over the time of all
            const double speed = std::abs(x.run.turned_Nms) / r.plant.mech.J_kgm2;
            EXPECT_LE(speed * kTime_s / kDegree, kMovement_deg);
        }
    }
}

TEST(DualPulses, FindTheNorthOfIpm1000)
{
    expect_right(ipm(0.01));
}

TEST(DualPulses, FindTheNorthOfSpm400)
{
    expect_right(spm(0.01));
}

TEST(DualPulses, RefuseLinearMachines)
{
    for (const double gain : {0.0, 0.02}) {
        for (const Rig &r : {linear(ipm(gain)), linear(spm(gain))}) {
            for (int k = 0; k < 24; ++k) {
                const double theta = (15 * k + 3) * kDegree;
                EXPECT_EQ(look(r, make(r), theta, theta, 1 + static_cast<uint64_t>(k)).result,
                          PM_FAILED_POLARITY)
                    << k;
            }
        }
    }
}

// Resistance, dead time and drops are odd in the voltage. Twin: of the first order alone they are a polarity.
TEST(DualPulses, BothOrdersTogetherCancelWhatTheBridgeDoes)
{
    Rig r = linear(ipm(0));
    r.plant.machine.R_s_ohm = 20;
    r.plant.sensor.noise_lsb = 0;
    const dual_pulses_config_t c = make(r);
    dual_pulses_t self = {};
    const pm_dir_t d = pm_dir(bench::turns(0.4));
    const LegRun x = run_legs(r, 0.4, 1, [&](pm_abc_t i, pulses_out_t *out) {
        return dual_pulses_step(&self, &c, pm_clarke(i), d, out);
    });
    ASSERT_EQ(x.result, PM_DONE);
    const auto sum = [&](int k) { return real(self.order[k].peak[0]) + real(self.order[k].peak[1]); };
    EXPECT_GT(std::abs(sum(0)) * r.base.i_A, 0.3);
    const double before = real(self.order[0].before) + real(self.order[1].before);
    EXPECT_GT(std::abs(sum(0) + sum(1)) * r.base.i_A, 0.1); // what the first order leaves of its current
    EXPECT_LT(std::abs(sum(0) + sum(1) - 2 * before * real(c.decay) / 8) * r.base.i_A,
              0.05); // of the 16 A of all peaks
    EXPECT_EQ(dual_pulses_find(&self, &c), PM_FAILED_POLARITY);
}

TEST(DualPulses, TheOppositeSignOfSaturationIsTheOtherPole)
{
    const Rig r = ipm(0);
    dual_pulses_config_t c = make(r);
    EXPECT_TRUE(look(r, c, 1, 1).north);
    c.reversed = true;
    EXPECT_FALSE(look(r, c, 1, 1).north);
}

TEST(DualPulses, WaitForACurrentToEndAndSayWhenItDoesNot)
{
    const Rig r = ipm(0);
    dual_pulses_config_t c = make(r);
    const pm_dir_t d = pm_dir(0);
    for (const pm_ab_t i : {pm_ab_t{PM_Q(0.1), 0}, pm_ab_t{0, -PM_Q(0.1)}}) { // along either axis
        dual_pulses_t self = {};
        pulses_out_t out;
        int k = 0;
        pm_procedure_t result = PM_RUNNING;
        for (; result == PM_RUNNING && k < 1000; ++k) {
            result = dual_pulses_step(&self, &c, i, d, &out);
            EXPECT_FALSE(out.driven);
        }
        EXPECT_EQ(result, PM_FAILED_TIMEOUT);
        EXPECT_EQ(k, c.timeout + 1);
    }
}

TEST(DualPulses, SayThatNothingIsConnected)
{
    const Rig r = ipm(0);
    const dual_pulses_config_t c = make(r);
    dual_pulses_t self = {};
    pulses_out_t out;
    pm_procedure_t result = PM_RUNNING;
    while (result == PM_RUNNING) {
        result = dual_pulses_step(&self, &c, {0, 0}, pm_dir(0), &out);
    }
    EXPECT_EQ(result, PM_DONE);
    EXPECT_EQ(dual_pulses_find(&self, &c), PM_FAILED_NO_CURRENT);
}

// Each pulse and its opposite are the same but for the sign, and leave no flux.
TEST(DualPulses, AreMirrorImagesWithoutAMean)
{
    const Rig r = ipm(0);
    const dual_pulses_config_t c = make(r);
    dual_pulses_t self = {};
    pulses_out_t out;
    int sum = 0, plus = 0, minus = 0;
    pm_procedure_t result = PM_RUNNING;
    while (result == PM_RUNNING) {
        result = dual_pulses_step(&self, &c, {0, 0}, pm_dir(0), &out);
        if (out.driven) {
            sum += (out.duty[0] > PM_ONE / 2) - (out.duty[0] < PM_ONE / 2);
            plus += out.duty[0] > PM_ONE / 2 ? 1 : 0;
            minus += out.duty[0] < PM_ONE / 2 ? 1 : 0;
            EXPECT_NEAR(out.duty[0] + out.duty[1] + out.duty[2], 3 * (PM_ONE / 2), 3);
        }
    }
    EXPECT_EQ(sum, 0);
    EXPECT_EQ(plus, 4 * c.periods);
    EXPECT_EQ(minus, 4 * c.periods);
}

// The current that was there is the mean of all four peaks.
TEST(DualPulses, EachPeakCountsForTheCurrent)
{
    for (int order = 0; order < 2; ++order) {
        for (int peak = 0; peak < 2; ++peak) {
            dual_pulses_config_t c = {};
            c.noise = 1;
            const pm_q_t i = PM_ONE / 8;
            c.i_least = i - i / 8; // of four peaks
            dual_pulses_t self = {};
            self.order[0].peak[0] = self.order[1].peak[1] = i;
            self.order[0].peak[1] = self.order[1].peak[0] = -i;
            EXPECT_NE(dual_pulses_find(&self, &c), PM_FAILED_NO_CURRENT);
            self.order[order].peak[peak] = 0;
            EXPECT_EQ(dual_pulses_find(&self, &c), PM_FAILED_NO_CURRENT) << order << peak;
        }
    }
}

} // namespace
