// What every regulator of firmware/control/regulators.def owes the drive, whatever its law.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>
#include <string>
#include <vector>

#include "firmware/params/maker.h"
#include "tests/contract/observers.h"
#include "tests/contract/winding.h"
#include "tests/unit/math/samples.h"

namespace
{

using bench::Base;
using bench::Complex;
using bench::fixed;
using bench::kJ;
using bench::Machine;
using bench::real;
using bench::Winding;

const Machine kMachine = bench::kIpmLinear;
const Base kBase = bench::kIpmBase;

// Settled without error of the model: rounding of the gains, and of a voltage through T_s / L.
constexpr double kSettled = 1e-4;
// A step within the voltage, METHODS.md 1.3.2.2 (e).
constexpr double kOvershoot = 0.10;
// Seeded with the voltage that acts: of the base current.
constexpr double kSeeded = 1e-3;
// Mirrored inputs: products are rounded to nearest, sums of wide numbers down.
constexpr int32_t kMirror = 40; // of 2^-22
// Squares of wide numbers, 2^-12, and the root.
constexpr double kCircle = 4e-4;
// 10 to 90 % of a first order, 0.35 / f; delay and whole periods beside it.
constexpr double kRise = 0.35, kRisePeriods = 3;
// The link, and what the current moves in a period under the longest vector of a switch state against the EMF of 0.6:
// (2/3 300 V + 57 V) 100 us / 43 mH.
constexpr double kLink = 300.0 / 450;
constexpr double kRipple = 0.06;

struct RegulatorCase {
    std::string name;
    regulator_config_t config;
    drive_params_t params;
    double bandwidth_Hz;
    unsigned traits;

    bool switches() const
    {
        return (traits & REGULATOR_SWITCHES) != 0;
    }

    double ripple() const
    {
        return switches() ? kRipple : 0;
    }
};

void PrintTo(const RegulatorCase &c, std::ostream *out)
{
    *out << c.name;
}

regulator_config_t configured(const drive_params_t &p, double *bandwidth_Hz = nullptr)
{
    drive_config_t config = {};
    const drive_result_t result = drive_configure(&config, &p, PM_CHANNELS);
    EXPECT_TRUE(result.ok) << drive_param_table[result.param].name << ": " << result.reason;
    if (bandwidth_Hz != nullptr) {
        maker_t m = {};
        m.params = &p;
        const pm_num_t f = regulator_bandwidth(&m);
        *bandwidth_Hz = std::ldexp(static_cast<double>(f.m), f.e);
    }
    return config.regulator;
}

std::vector<RegulatorCase> cases()
{
    std::vector<RegulatorCase> all;
    const auto add = [&all](regulator_id_t id, const char *name, unsigned traits) {
        drive_params_t p = bench::parameters(kMachine, kBase);
        p.regulator = static_cast<int32_t>(id);
        p.start_method = (traits & REGULATOR_SWITCHES) != 0 ? 2 : 0;
        RegulatorCase x = {name, {}, p, 0, traits};
        x.config = configured(p, &x.bandwidth_Hz);
        all.push_back(x);
    };
#define PM_METHOD(name, help, traits, needs) add(REGULATOR_##name, #name, traits);
#include "firmware/control/regulators.def"
#undef PM_METHOD
    return all;
}

class Regulator
{
  public:
    explicit Regulator(const regulator_config_t &config, Complex v = 0, double omega = 0) : config_(config)
    {
        std::memset(&state_, 0xa5, sizeof state_); // reset owes every member
        regulator_reset(&state_, &config_, bench::dq(v), bench::dq(0), fixed(omega, 28));
    }

    regulator_out_t raw(Complex i, Complex ref, double omega, double v_max)
    {
        const regulator_in_t in = {bench::dq(i),     bench::dq(ref), fixed(omega, 28),
                                   fixed(v_max, 28), {1 << 30, 0},   fixed(kLink, 28)};
        regulator_out_t out = {};
        regulator_step(&state_, &config_, &in, &out);
        return out;
    }

    Complex step(Complex i, Complex ref, double omega, double v_max = 2)
    {
        const regulator_out_t out = raw(i, ref, omega, v_max);
        limited = out.limited;
        return {real(out.v.d, 22), real(out.v.q, 22)};
    }

    bool limited = false;

  private:
    regulator_config_t config_;
    regulator_t state_;
};

// The currents of a step from 0 to `ref` after the current has settled at zero.
std::vector<Complex> respond(const regulator_config_t &config, double omega, Complex ref, int periods,
                             double v_max = 2)
{
    Winding winding(kMachine, kBase, omega);
    const Complex emf = kJ * omega * kMachine.psi_m_Wb / kBase.psi_Wb();
    Regulator regulator(config, emf, omega);
    std::vector<Complex> i;
    for (int k = -200; k < periods; ++k) {
        if (k >= 0) {
            i.push_back(winding.i());
        }
        winding.run(regulator.step(winding.i(), k < 0 ? 0 : ref, omega, v_max));
    }
    return i;
}

double rise_periods(const std::vector<Complex> &i, double from, double to)
{
    const auto reached = [&i](double x) {
        return std::find_if(i.begin(), i.end(), [x](Complex y) { return y.imag() >= x; }) - i.begin();
    };
    return static_cast<double>(reached(to) - reached(from));
}

class RegulatorContract : public testing::TestWithParam<RegulatorCase>
{
};

TEST_P(RegulatorContract, ReachesTheReferenceAtAnySpeed)
{
    for (const double omega : {0.0, 0.3, -0.3, 0.6}) {
        for (const Complex ref : {Complex{0, 0.3}, Complex{-0.2, 0.2}, Complex{-0.1, -0.3}}) {
            const Complex i = respond(GetParam().config, omega, ref, 1500).back();
            // the frame turns on while the voltage acts: part of the decoupling is left to what integrates
            EXPECT_LE(std::abs(i - ref), kSettled + 0.01 * std::abs(omega) + GetParam().ripple())
                << omega << ' ' << ref;
        }
    }
}

TEST_P(RegulatorContract, RisesWithItsBandwidthAndLittleOvershoot)
{
    if (GetParam().switches()) {
        GTEST_SKIP() << "the step is as large as its ripple";
    }
    const Complex ref = {0, 0.05};
    const std::vector<Complex> i = respond(GetParam().config, 0, ref, 400);
    const double expected = kRise / GetParam().bandwidth_Hz / kBase.period_s;
    EXPECT_LE(rise_periods(i, 0.1 * 0.05, 0.9 * 0.05), expected + kRisePeriods);
    const auto top =
        std::max_element(i.begin(), i.end(), [](Complex a, Complex b) { return a.imag() < b.imag(); });
    EXPECT_LE(top->imag(), 0.05 * (1 + kOvershoot));
}

TEST_P(RegulatorContract, SeededWithTheActingVoltageNothingMoves)
{
    for (const double omega : {0.0, 0.4, -0.4}) {
        for (const Complex &i : respond(GetParam().config, omega, 0, 50)) {
            ASSERT_LE(std::abs(i), kSeeded + GetParam().ripple()) << omega;
        }
    }
}

TEST_P(RegulatorContract, RecoversFromTheVoltageLimit)
{
    const Complex ref = {0, 0.5};
    const double v_max = 0.3;
    const std::vector<Complex> i = respond(GetParam().config, 0.4, ref, 1500, v_max);
    const auto top =
        std::max_element(i.begin(), i.end(), [](Complex a, Complex b) { return a.imag() < b.imag(); });
    EXPECT_LE(top->imag(), 0.5 * (1 + kOvershoot));
    EXPECT_LE(std::abs(i.back() - ref), 0.01 + GetParam().ripple());
}

TEST_P(RegulatorContract, StaysInsideTheCircleForAnyInput)
{
    samples::Random random;
    Regulator regulator(GetParam().config);
    int limited = 0;
    for (int n = 0; n < 20000; ++n) {
        const auto any = [&random] {
            return Complex{random.within(-1.33, 1.33), random.within(-1.33, 1.33)};
        };
        const double v_max = random.within(0.01, 0.8);
        const Complex v = regulator.step(any(), 0.7 * any(), random.within(-1.2, 1.2), v_max);
        const double top = GetParam().switches() ? 2 * kLink / 3 : v_max;
        ASSERT_LE(std::abs(v), top + kCircle / top) << n;
        limited += regulator.limited ? 1 : 0;
    }
    EXPECT_GT(limited, 5000);
}

TEST_P(RegulatorContract, TurnsWithTheMachine)
{
    const auto mirrored = [](Complex x) { return std::conj(x); };
    samples::Random random;
    Regulator one(GetParam().config), other(GetParam().config);
    for (int n = 0; n < 200; ++n) {
        const Complex i = {random.within(-0.4, 0.4), random.within(-0.4, 0.4)};
        const Complex ref = i + 0.01 * Complex{random.within(-1, 1), random.within(-1, 1)};
        const double omega = random.within(-0.5, 0.5);
        const regulator_out_t a = one.raw(i, ref, omega, 4),
                              b = other.raw(mirrored(i), mirrored(ref), -omega, 4);
        ASSERT_LE(std::abs(a.v.d - b.v.d), kMirror * (n + 1)) << n;
        ASSERT_LE(std::abs(a.v.q + b.v.q), kMirror * (n + 1)) << n;
    }
}

TEST_P(RegulatorContract, SlowedItTakesLongerAndStaysSettled)
{
    if (GetParam().switches()) {
        GTEST_SKIP() << "the step is as large as its ripple";
    }
    const Complex ref = {0, 0.05};
    const double fast = rise_periods(respond(GetParam().config, 0, ref, 400), 0.005, 0.045);
    regulator_config_t slowed = GetParam().config;
    regulator_slow_down(&slowed, PM_UNIT(0.1));
    const std::vector<Complex> i = respond(slowed, 0, ref, 3000);
    EXPECT_GE(rise_periods(i, 0.005, 0.045), 4 * fast);
    EXPECT_LE(std::abs(i.back() - ref), 1e-3);
}

TEST_P(RegulatorContract, StableWithInductancesOffByAThird)
{
    for (const double share : {0.67, 1.33}) {
        drive_params_t p = GetParam().params;
        for (int32_t *L : {&p.L_d, &p.L_q, &p.L_dh_rated, &p.L_qh_rated, &p.L_q_rated}) {
            *L = static_cast<int32_t>(std::lround(*L * share));
        }
        const Complex ref = {-0.1, 0.3};
        const std::vector<Complex> i = respond(configured(p), 0.3, ref, 1500);
        for (auto x = i.end() - 100; x != i.end(); ++x) {
            ASSERT_LE(std::abs(*x - ref), 0.03 + GetParam().ripple()) << share;
        }
    }
}

// A carrier of the voltage would be lost in the choice of a state, one of the reference in slow control.
TEST_P(RegulatorContract, TakesTheCarriersThatItPasses)
{
    const bool switches = GetParam().switches(), follows = (GetParam().traits & REGULATOR_FOLLOWS) != 0;
    drive_params_t p = GetParam().params;
    for (const int32_t method : {0, 1}) { // injection finds the rotor, or leads behind the align
        p.start_method = method;
        for (const injection_id_t source : {INJECTION_pulsating_sine, INJECTION_current_sine}) {
            p.injection = static_cast<int32_t>(source);
            const bool takes = source == INJECTION_current_sine ? follows : !switches;
            drive_config_t c = {};
            const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
            EXPECT_EQ(r.ok, takes) << method << ' ' << source << ' ' << drive_param_table[r.param].name;
            if (!takes) {
                EXPECT_EQ(r.param, DRIVE_PARAM_regulator) << method;
                EXPECT_STREQ(r.reason,
                             source == INJECTION_current_sine
                                 ? "does not follow a carrier in its reference: 1, 2 or 3"
                                 : "cannot add an injected voltage: injection 11, or start_method 2");
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, RegulatorContract, testing::ValuesIn(cases()),
                         [](const testing::TestParamInfo<RegulatorCase> &x) { return x.param.name; });

} // namespace
