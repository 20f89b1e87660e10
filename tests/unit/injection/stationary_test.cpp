// What the sources have in common whose carrier stands on an axis of the stator: the sine and the square wave.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/unit/injection/rig.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::Machine;

constexpr double kZero_deg = 0.3;
constexpr int kSettled = 1500; // detection on both axes and ten time constants of the stator

const Machine &kMachine = bench::kIpmLinear;
const double kI_n_per_flux = (1 / kMachine.L_d0_H - 1 / kMachine.L_q0_H) / 2;
const double kI_n_of_I_p = (kMachine.L_q0_H - kMachine.L_d0_H) / (kMachine.L_q0_H + kMachine.L_d0_H);

struct Case {
    std::string name;
    injection_id_t id;
    double flux_Wb;
    // Sine: I_p - 3.7 times I_n - and the gain belong to a machine without resistance: (R / omega_h L)^2, 2e-3 of I_p.
    // Square: resistance takes R T_s / L from an answer, 1 % of I_p, alike in all directions: detected. The gain has the
    // rest.
    double eps, answer;
    double loop_Hz, settled_s; // from 85 degrees
};

saliency_config_t &saliency_of(injection_config_t &c)
{
    return c.id == INJECTION_stationary_sine ? c.stationary_sine.saliency : c.stationary_square.saliency;
}

stationary_config_t &stationary_of(injection_config_t &c)
{
    return c.id == INJECTION_stationary_sine ? c.stationary_sine.stationary : c.stationary_square.stationary;
}

// I_p wrong by 0.1 I_n.
void mistake_I_p(injection_config_t &c)
{
    pm_q_t &i_p = saliency_of(c).i_p_0;
    i_p += static_cast<pm_q_t>(std::lround(0.1 * kI_n_of_I_p * i_p));
}

rig::Answer settled(const injection_config_t &c, double theta, double error_rad, double R_ohm = 6)
{
    rig::Run run(c);
    run.theta = theta;
    run.error = error_rad;
    run.R_ohm = R_ohm;
    return run.after(kSettled);
}

class Stationary : public ::testing::TestWithParam<Case>
{
  protected:
    static injection_config_t config(bool detected = true)
    {
        return rig::config(GetParam().id, 6, detected);
    }
};

TEST_P(Stationary, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    for (const bool detected : {true, false}) {
        const injection_config_t c = config(detected);
        for (int a = -90; a <= 90; a += 15) {
            EXPECT_NEAR(settled(c, 0.4, a * kDegree, 1e-3).eps, 0.5 * std::sin(2 * a * kDegree),
                        GetParam().eps)
                << a;
        }
    }
}

TEST_P(Stationary, TheAnswerIsThatOfTheSaliencyAtAnyPosition)
{
    for (const double theta : {0.0, 0.8, 2.0, -1.0}) {
        const rig::Answer a = settled(config(), theta, 0);
        EXPECT_NEAR(a.eps / kDegree, 0, kZero_deg) << theta;
        EXPECT_NEAR(a.vector.real() / (kI_n_per_flux * GetParam().flux_Wb), 1, GetParam().answer) << theta;
        EXPECT_NEAR(a.misfit, 0, GetParam().answer) << theta;
    }
}

// METHODS.md 4.4.2.2 (e): I_p wrong by 0.1 I_n, sin 2 theta of 2.9 degrees.
TEST_P(Stationary, AWrongIpMovesThePositionBySinTwoTheta)
{
    for (const double theta : {0.2, 0.8, 1.2, -0.8}) {
        injection_config_t c = config(false);
        mistake_I_p(c);
        const double expected = 0.05 / kDegree * std::sin(2 * theta);
        const double without = settled(config(false), theta, 0, 1e-3).eps / kDegree;
        EXPECT_NEAR(settled(c, theta, 0, 1e-3).eps / kDegree - without, expected, 0.05) << theta;
        // detected: whatever the configuration has
        stationary_of(c).find = true;
        EXPECT_NEAR(settled(c, theta, 0, 1e-3).eps / kDegree, 0, kZero_deg) << theta;
    }
}

// METHODS.md 4.4.2.3 (e): the carrier does not follow the estimate.
TEST_P(Stationary, LocksFromAnyErrorUpTo85Degrees)
{
    for (int a = -85; a <= 85; a += 17) {
        rig::Run run(config());
        run.after(600); // I_p is found
        run.error = a * kDegree;
        run.loop_Hz = GetParam().loop_Hz;
        EXPECT_LT(run.settling(2000, 5 * kDegree) * rig::kBase.period_s, GetParam().settled_s) << a;
    }
}

TEST_P(Stationary, CarrierGoesFromAlphaToBetaAndStaysOnAlpha)
{
    rig::Run run(config()), elsewhere(config());
    elsewhere.theta = 2;
    elsewhere.error = 1;
    run.after(1000);
    elsewhere.after(1000);
    int changes = 0;
    bool on_beta = false;
    double most = 0;
    for (size_t k = 0; k < 1000; ++k) {
        const pm_ab_t v = run.given[k].v;
        EXPECT_EQ(v.alpha, elsewhere.given[k].v.alpha) << k;
        EXPECT_EQ(v.beta, elsewhere.given[k].v.beta) << k;
        EXPECT_TRUE(v.alpha == 0 || v.beta == 0) << k;
        EXPECT_TRUE(k < 600 || v.beta == 0) << k;
        most = std::max(most, std::abs(bench::complex(v) * rig::kBase.v_V));
        if (v.alpha != 0 || v.beta != 0) { // neither where the carrier passes through zero
            changes += on_beta != (v.beta != 0) ? 1 : 0;
            on_beta = v.beta != 0;
        }
    }
    EXPECT_NEAR(most, 35, 1e-4);
    EXPECT_EQ(changes, 4);
}

TEST_P(Stationary, MisfitIsTheSaliencyThatIsMissing)
{
    injection_config_t c = config();
    saliency_of(c).gain_0 /= 2; // twice the saliency expected
    EXPECT_NEAR(settled(c, 0.4, 0).misfit, -0.5, GetParam().answer);
}

INSTANTIATE_TEST_SUITE_P(
    All, Stationary,
    ::testing::Values(Case{"sine", INJECTION_stationary_sine, 35e-4 / (2 * 0.15643446504), 0.006, 0.02, 20,
                           0.100}, // V_h T_s / (2 sin(pi / 20))
                      Case{"square", INJECTION_stationary_square, 35e-4, 0.01, 0.03, 60, 0.040}),
    [](const auto &p) { return p.param.name; });

// The two axes are looked at a time t apart; what I_n leaves of itself is then of the order (omega t)^2.
TEST(StationaryFound, StandsWhenAFastRotorIsHandedBack)
{
    constexpr double kFound = 1.1, kI_p = 0.4, kBetween = 0.8; // rad, at base speed
    stationary_config_t c = {};
    c.i_n = bench::fixed(0.1, 28);
    c.between = bench::fixed(kBetween, 20);
    c.find = true;
    const pm_q_t slow = bench::fixed(-0.45 / kBetween, 28), fast = bench::fixed(-0.55 / kBetween, 28);
    stationary_t s = {};
    const auto find = [&](unsigned values) {
        obs_in_t in = {};
        in.dir = bench::direction(0);
        for (unsigned k = 0; k < values; ++k) {
            stationary_find(&s, &c, bench::fixed(kFound * kI_p, 28), &in, bench::fixed(kI_p, 28));
        }
    };
    stationary_reset(&s, &c, fast); // never found: what the configuration says
    EXPECT_FALSE(stationary_finding(&s));
    EXPECT_EQ(s.found, PM_ONE);
    stationary_reset(&s, &c, slow);
    EXPECT_TRUE(stationary_finding(&s));
    find(STATIONARY_VALUES);
    EXPECT_FALSE(stationary_finding(&s));
    EXPECT_NEAR(bench::real(s.found, 28), kFound, 1e-6);
    stationary_reset(&s, &c, fast);
    EXPECT_FALSE(stationary_finding(&s));
    EXPECT_NEAR(bench::real(s.found, 28), kFound, 1e-6);
    stationary_reset(&s, &c, slow);
    find(STATIONARY_VALUES / 2);
    stationary_reset(&s, &c, fast); // half found is not
    EXPECT_FALSE(stationary_finding(&s));
    EXPECT_EQ(s.found, PM_ONE);
    c.find = false;
    stationary_reset(&s, &c, 0);
    EXPECT_FALSE(stationary_finding(&s));
    EXPECT_EQ(s.found, PM_ONE);
}

} // namespace
