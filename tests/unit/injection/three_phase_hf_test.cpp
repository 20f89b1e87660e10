#include "injection/three_phase_hf.h"

#include <gtest/gtest.h>

#include <complex>

#include "firmware/math/trig.h"
#include "tests/unit/injection/leg_rig.h"

namespace
{

using namespace leg_rig;

// METHODS-ADDENDUM.md B (b), rows 106 and 107: 35 V, 500 Hz, 120 angles.
constexpr double kMean_deg = 2, kMost_deg = 5;
constexpr double kOutside_deg = 2; // of a sector's border: the sector is right
constexpr double kTime_s = 0.1;
constexpr double kTwin_deg = 0.8; // with the R term left in

three_phase_hf_config_t make(const Rig &r, double v_V, int n = 20)
{
    const double a = 2 * bench::kPi / n, omega = a / r.base.period_s;
    const double F = v_V * r.base.period_s / (2 * std::sin(a / 2));
    const double sum = r.L_d_H + r.L_q_H, kappa = (r.L_q_H - r.L_d_H) / sum;
    const double R = r.plant.machine.R_s_ohm + r.plant.inverter.r_on_ohm;
    const int count = 20 * 32; // 64 ms
    three_phase_hf_config_t c = {};
    c.sine.n = static_cast<uint16_t>(n);
    c.sine.step = UINT32_MAX / static_cast<uint32_t>(n);
    c.sine.lag = 3 * (c.sine.step / 2) + PM_TURN(0.25);
    c.share = fixed(v_V / r.plant.dclink.v_source_V, 28);
    c.rise = c.share / 160 + 1;
    c.settled = 240;
    c.block = static_cast<uint16_t>(n);
    c.wanted = n == 20 ? 32 : 16;
    c.i_least = fixed(F * (1 / r.L_d_H + 1 / r.L_q_H) / 16 / r.base.i_A, 28);
    c.kappa = fixed(kappa, 28);
    c.rho_R = fixed(2 * R / (omega * sum), 28);
    c.rho_0 = fixed(R * (1 / r.L_d_H + 1 / r.L_q_H) / 2 / omega * (1 + kappa * kappa), 28);
    c.inverter = fixed((1 - kappa * kappa) / (1 + kappa * kappa) / 2, 28);
    c.noise = fixed(r.noise_A * std::sqrt(2.0 / 3 / count) / r.base.i_A, 28);
    return c;
}

struct Found {
    pm_procedure_t result = PM_RUNNING;
    double error_deg = 0; // of the angle but for its pole
    bool right_pole = false;
    double margin = 0;
    unsigned sector = 0;
    LegRun run;
};

Found look(const Rig &r, const three_phase_hf_config_t &c, double theta_rad, uint64_t seed = 1)
{
    three_phase_hf_t self = {};
    Found x;
    x.run = run_legs(
        r, theta_rad, seed,
        [&](pm_abc_t i, pulses_out_t *out) { return three_phase_hf_step(&self, &c, i, out); },
        [&] { three_phase_hf_slow(&self); });
    x.result = x.run.result == PM_DONE ? three_phase_hf_find(&self, &c) : x.run.result;
    x.margin = self.found.margin / 256.0;
    x.sector = self.sector;
    const double error = bench::wrapped(theta_rad - bench::rad(self.found.theta));
    x.right_pole = std::abs(error) < bench::kPi / 2;
    x.error_deg = bench::wrapped(2 * error) / 2 / kDegree;
    return x;
}

double expect_angles(const Rig &r, double v_V, double mean_deg, double most_deg)
{
    const three_phase_hf_config_t c = make(r, v_V);
    double mean = 0;
    for (int k = 0; k < kPositions; ++k) {
        const double theta_deg = (k + 0.37) * 360 / kPositions;
        const Found x = look(r, c, theta_deg * kDegree, static_cast<uint64_t>(k) + 1);
        EXPECT_TRUE(x.result == PM_DONE || x.result == PM_FAILED_POLARITY) << theta_deg << ' ' << x.result;
        EXPECT_TRUE(x.result != PM_DONE || x.right_pole) << theta_deg;
        EXPECT_LE(std::abs(x.error_deg), most_deg) << theta_deg;
        EXPECT_LE(x.run.periods * r.base.period_s, kTime_s);
        const double half = std::fmod(theta_deg, 180), border = std::abs(std::remainder(half, 30));
        if (border > kOutside_deg) {
            EXPECT_EQ(x.sector, static_cast<unsigned>(half / 30)) << theta_deg;
        }
        mean += std::abs(x.error_deg) / kPositions;
    }
    EXPECT_LE(mean, mean_deg);
    ::testing::Test::RecordProperty("mean_deg", std::to_string(mean));
    return mean;
}

TEST(ThreePhaseHf, FindsIpm1000AndItsSector)
{
    expect_angles(ipm(0), 35, kMean_deg, kMost_deg);
}

TEST(ThreePhaseHf, FindsSpm400AndItsSector)
{
    expect_angles(spm(0), 8, kMean_deg, kMost_deg);
}

// The sums of the currents give their sensors' gains.
TEST(ThreePhaseHf, FindsTheAngleWithSensorsOfUnlikeGains)
{
    expect_angles(ipm(0.02), 35, kMean_deg, kMost_deg);
    expect_angles(spm(0.02), 8, kMean_deg, kMost_deg);
}

// -1/2 R / (omega_h L_sa), without an inverter's own: 0.9 degrees.
TEST(ThreePhaseHf, TwinWithoutTheResistanceErrs)
{
    const Rig r = ideal(ipm(0));
    const three_phase_hf_config_t right = make(r, 35);
    three_phase_hf_config_t twin = right;
    twin.rho_R = 0;
    double mean = 0, mean_right = 0;
    for (int k = 0; k < 24; ++k) {
        const double theta = (15 * k + 4) * kDegree;
        mean += look(r, twin, theta).error_deg / 24;
        mean_right += look(r, right, theta).error_deg / 24;
    }
    EXPECT_GE(std::abs(mean), kTwin_deg);
    EXPECT_LE(std::abs(mean_right), 0.3);
}

// What dead time does to the negative sequence, a quarter of 13 degrees and more at 35 V. Twin: left in.
TEST(ThreePhaseHf, TwinWithoutTheInverterErrs)
{
    Rig r = ipm(0);
    r.plant.inverter.c_leg_F = 0;
    const three_phase_hf_config_t right = make(r, 35);
    three_phase_hf_config_t twin = right;
    twin.inverter = 0;
    double mean = 0, mean_right = 0;
    for (int k = 0; k < 24; ++k) {
        const double theta = (15 * k + 4) * kDegree;
        mean += look(r, twin, theta).error_deg / 24;
        mean_right += look(r, right, theta).error_deg / 24;
    }
    EXPECT_GE(std::abs(mean), 2 * std::abs(mean_right) + 0.5);
}

// At 250 Hz the second harmonic is far above the noise and what dead time makes.
TEST(ThreePhaseHf, FindsThePoleWithAStrongCarrier)
{
    for (int k = 0; k < 72; ++k) {
        const double theta = (5 * k + 1) * kDegree;
        for (const bool surface : {false, true}) {
            const Rig r = surface ? spm(0.01) : ipm(0.01);
            const Found x = look(r, make(r, surface ? 12 : 70, 40), theta, static_cast<uint64_t>(k) + 1);
            ASSERT_EQ(x.result, PM_DONE) << k;
            EXPECT_TRUE(x.right_pole) << k;
            EXPECT_GE(x.margin, 5) << k;
        }
    }
}

TEST(ThreePhaseHf, RefusesThePoleOfLinearMachines)
{
    for (const double gain : {0.0, 0.02}) {
        for (int k = 0; k < 24; ++k) {
            const double theta = (15 * k + 3) * kDegree;
            const auto seed = static_cast<uint64_t>(k) + 1;
            EXPECT_EQ(look(linear(ipm(gain)), make(ipm(0), 35), theta, seed).result, PM_FAILED_POLARITY) << k;
            EXPECT_EQ(look(linear(spm(gain)), make(spm(0), 12), theta, seed).result, PM_FAILED_POLARITY) << k;
        }
    }
}

TEST(ThreePhaseHf, FailsWithoutSaliencyWithoutACurrentAndWithUnevenPhases)
{
    const Rig r = ipm(0);
    const three_phase_hf_config_t c = make(r, 35);
    Rig round = linear(r);
    round.plant.machine.L_q0_H = round.plant.machine.L_d0_H;
    EXPECT_EQ(look(round, c, 1).result, PM_FAILED_SALIENCY);
    Rig weak = r;
    weak.plant.machine.L_d0_H *= 10;
    weak.plant.machine.L_q0_H *= 10;
    weak.plant.machine.c_A_Wb5 = 0;
    EXPECT_EQ(look(weak, c, 1).result, PM_FAILED_NO_CURRENT);
    Rig uneven = r;
    uneven.plant.sensor.gain_error[1] = 0.4;
    EXPECT_EQ(look(uneven, c, 1).result, PM_FAILED_UNEVEN);
    three_phase_hf_config_t noisy = c; // where the noise may be the saliency
    noisy.noise = PM_Q(0.005);
    EXPECT_EQ(look(r, noisy, 1).result, PM_FAILED_SALIENCY);
}

// Currents by formula, for what no machine does: a negative sequence as large as the positive one, which leaves no two
// equations for the gains, or larger, which turns their sign; and none.
TEST(ThreePhaseHf, TakesAnySequencesOfItsCurrents)
{
    const three_phase_hf_config_t c = make(ipm(0), 35);
    const auto find = [&c](double I_p, double I_n, double theta, double *error_rad) {
        three_phase_hf_t self = {};
        for (int x = 0; x < 3; ++x) {
            const double g = 2 * bench::kPi / 3 * x;
            const std::complex<double> I =
                std::polar(I_p, -g) +
                std::polar(I_n,
                           -(2 * theta - bench::rad(static_cast<pm_angle_t>(pm_rad_to_angle(c.rho_R))) - g));
            const double scale = std::ldexp(c.block * c.wanted / 2.0, 27);
            self.cosine[x] = static_cast<int64_t>(I.real() * scale);
            self.sine[x] = static_cast<int64_t>(-I.imag() * scale);
        }
        const pm_procedure_t result = three_phase_hf_find(&self, &c);
        *error_rad = bench::wrapped(2 * (bench::rad(self.found.theta) - theta)) / 2;
        return result;
    };
    double error;
    EXPECT_EQ(find(0, 0, 1, &error), PM_FAILED_NO_CURRENT);
    EXPECT_EQ(find(0.4, 0.4, 1, &error), PM_FAILED_UNEVEN);
    for (const double I_n : {0.3, 0.5}) {
        EXPECT_EQ(find(0.4, I_n, 1, &error), PM_FAILED_POLARITY); /* of a linear machine */
        EXPECT_LE(std::abs(error), 0.02) << I_n;
    }
}

} // namespace
