// open_winding.h: the voltages of both bridges, what dead time takes of their legs, the signal of the zero sequence and the loop that
// holds its current, against the header's formulas in double precision; then the drive on OW-400.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "firmware/drive/drive_parts.h"
#include "tests/unit/drive/open_winding_machine.h"

namespace
{

using bench::ab;
using bench::Complex;
using bench::fixed;
using bench::kPi;
using bench::real;
using ow::kA, ow::kLink, ow::kOmega, ow::kPsi_3_Wb, ow::kT_s, ow::kV;

// A leg is rounded to the nearest count, of which a phase has two, and the scale of the division is cut (modulator_test.cpp).
constexpr double kPhase_counts = 2.5;
// Of compensation one more a leg: it is made of two parts, one below its full value where it saturates.
constexpr double kCompensation_counts = 2.5;
// Products of Q28 are cut; there are four.
constexpr double kExact = 4e-8;

struct Phases {
    double x[3];

    double mean() const
    {
        return (x[0] + x[1] + x[2]) / 3;
    }
    Complex vector() const
    {
        return {(2 * x[0] - x[1] - x[2]) / 3, (x[1] - x[2]) / std::sqrt(3.0)};
    }
};

// Of a bridge against the negative rail, per-unit.
Phases legs(const modulator_out_t &bridge, double v_dc, int counts)
{
    Phases u = {};
    for (int leg = 0; leg < 3; ++leg) {
        u.x[leg] = v_dc * bridge.on[leg] / counts;
    }
    return u;
}

Phases operator-(const Phases &a, const Phases &b)
{
    return {{a.x[0] - b.x[0], a.x[1] - b.x[1], a.x[2] - b.x[2]}};
}

// What phase k has of a vector.
double phase(Complex x, int k)
{
    return (x * std::polar(1.0, -2 * kPi * k / 3)).real();
}

// The two bridges of a period; `asked` is the v_0 that the loop wants of the modulator.
struct Bridges {
    drive_config_t config;
    open_winding_config_t zero;
    open_winding_t self = {};
    modulator_t modulator = {};
    bridges_t out = {};
    double v_dc;

    explicit Bridges(const drive_params_t &p, double link = kLink)
        : config(ow::configured(p)), zero(config.open_winding), v_dc(link)
    {
        open_winding_reset(&self);
        modulator_slow(&modulator, &config.modulator, fixed(v_dc, 28), {}, {});
        EXPECT_EQ(config.modulator.ripple, 0);
    }

    void step(Complex v, Complex i = 0, double asked = 0)
    {
        if (zero.held) { // by i_0 alone, without what is gathered
            zero.k_r = 0;
            self.y = 0;
            self.q = 0;
            self.i = fixed(-asked / real(zero.k_p), 28);
        }
        modulator.limited = 0;
        open_winding_step(&self, &zero, &modulator, &config.modulator, ab(v), fixed(v_dc, 28), ab(i / 4.0),
                          &out);
    }

    Phases first() const
    {
        return legs(out.bridge[0], v_dc, config.modulator.counts);
    }
    Phases second() const
    {
        return legs(out.bridge[1], v_dc, config.modulator.counts);
    }
    double count() const
    {
        return v_dc / config.modulator.counts;
    }
};

drive_params_t ideal(int32_t zero_current)
{
    drive_params_t p = ow::params();
    p.zero_current = zero_current;
    p.dead_time_comp = 0;
    return p;
}

struct Random {
    std::mt19937 generator{1};

    double operator()(double least, double most)
    {
        return std::uniform_real_distribution<double>(least, most)(generator);
    }
    Complex vector(double most)
    {
        const double size = most * std::sqrt((*this)(0, 1));
        return std::polar(size, (*this)(-kPi, kPi));
    }
};

// --- voltages ------------------------------------------------------------------------------------------------

TEST(OpenWinding, EachPhaseHasTheDifferenceOfItsLegs)
{
    Random random;
    for (int n = 0; n < 400; ++n) {
        const double v_dc = random(20 / kV, 50 / kV);
        Bridges x(ideal(0), v_dc);
        for (int m = 0; m < 20; ++m) {
            const Complex v = random.vector(200.0 / 201 * v_dc);
            x.step(v);
            ASSERT_EQ(x.modulator.limited, 0) << v;
            const Phases u = x.first() - x.second();
            for (int k = 0; k < 3; ++k) {
                ASSERT_NEAR(u.x[k], phase(v, k), kPhase_counts * x.count()) << v << ' ' << v_dc << ' ' << k;
            }
            ASSERT_LE(std::abs(Complex(real(x.out.v.alpha), real(x.out.v.beta)) - v), kExact);
        }
    }
}

// Half of the link each; legs of one are those of the other in another order, so that as many are high at each instant.
TEST(OpenWinding, BothBridgesHaveTheSameMean)
{
    Random random;
    Bridges x(ideal(0));
    for (int n = 0; n < 2000; ++n) {
        const Complex v = random.vector(x.v_dc);
        x.step(v);
        ASSERT_NEAR((x.first() - x.second()).mean(), 0, kPhase_counts * x.count()) << v;
        Phases a = x.first(), b = x.second();
        std::sort(a.x, a.x + 3);
        std::sort(b.x, b.x + 3);
        for (int leg = 0; leg < 3; ++leg) {
            ASSERT_NEAR(a.x[leg], b.x[leg], kPhase_counts * x.count()) << v;
        }
    }
}

TEST(OpenWinding, TheCommonPartIsSharedByBothBridges)
{
    Random random;
    Bridges x(ideal(1)), without(ideal(0));
    for (int n = 0; n < 2000; ++n) {
        const Complex v = random.vector(0.7 * x.v_dc);
        const double asked = random(-0.25, 0.25) * x.v_dc;
        x.step(v, 0, asked);
        without.step(v);
        ASSERT_NEAR(real(x.self.v_next), asked, 1e-6) << v;
        for (int k = 0; k < 3; ++k) {
            const double first = (x.first() - without.first()).x[k];
            const double second = (x.second() - without.second()).x[k];
            ASSERT_NEAR(first, asked / 2, kPhase_counts * x.count()) << v << ' ' << k;
            ASSERT_NEAR(second, -asked / 2, kPhase_counts * x.count()) << v << ' ' << k;
        }
    }
}

// Vector and common part become less by the same share, and what is told of them is what acts.
TEST(OpenWinding, VoltageBeyondTheLinkIsShortenedAlongItself)
{
    Random random;
    Bridges x(ideal(1));
    int limited = 0;
    for (int n = 0; n < 4000; ++n) {
        const Complex v = std::polar(random(0.5, 2.0) * x.v_dc, random(-kPi, kPi));
        const double asked = random(-0.25, 0.25) * x.v_dc;
        x.step(v, 0, asked);
        // Both bridges ask for the largest difference of two phases of v / sqrt(3) e^{j 30}, which is one of -v ... v.
        const double span =
            std::max({std::fabs(phase(v, 0)), std::fabs(phase(v, 1)), std::fabs(phase(v, 2))}) +
            std::fabs(asked);
        const double share = std::min(1.0, x.v_dc / span);
        ASSERT_EQ(x.modulator.limited != 0, span > x.v_dc) << v << ' ' << asked;
        limited += x.modulator.limited != 0 ? 1 : 0;
        const Complex told(real(x.out.v.alpha), real(x.out.v.beta));
        ASSERT_LE(std::abs(told - v * share), 1e-4 * std::abs(v)) << v << ' ' << asked;
        ASSERT_NEAR(real(x.self.v_next), asked * share, 1e-4 * std::fabs(asked) + 1e-6) << v << ' ' << asked;
        const Phases u = x.first() - x.second();
        ASSERT_LE(std::abs(u.vector() - told), 2 * kPhase_counts * x.count()) << v << ' ' << asked;
        ASSERT_NEAR(u.mean(), asked * share, kPhase_counts * x.count()) << v << ' ' << asked;
    }
    EXPECT_GT(limited, 1000);
}

// --- what dead time takes ------------------------------------------------------------------------------------

// modulator.h: two parts, of which the share of the period that is lost has 3/4 up to 1.7 I_1 and 1/4 up to eight times that.
double lost_counts(double i_A, const drive_params_t &p)
{
    const double dead_s = p.dead_time * 1e-9, edge_A = 1.7 * p.leg_capacitance * 1e-12 * 36 / dead_s;
    const double share =
        0.75 * std::clamp(i_A / edge_A, -1.0, 1.0) + 0.25 * std::clamp(i_A / (8 * edge_A), -1.0, 1.0);
    return dead_s / kT_s * share * p.timer_counts;
}

TEST(OpenWinding, EachLegIsGivenWhatItsOwnCurrentLoses)
{
    for (const int32_t held : {0, 1}) {
        drive_params_t p = ow::params();
        p.zero_current = held;
        Random random;
        Bridges with(p), without(ideal(held));
        for (int n = 0; n < 4000; ++n) {
            const Complex v = random.vector(0.6 * with.v_dc);
            const Complex i_A = random.vector(n % 2 == 0 ? 0.3 : 4.0);
            const double i_zero_A = random(-0.4, 0.4);
            const double asked = held != 0 ? -i_zero_A / kA * real(with.zero.k_p) : 0;
            for (Bridges *x : {&with, &without}) {
                x->self.i = fixed(i_zero_A / kA, 28); // which step() puts there again where it is held
                x->step(v, i_A / kA, asked);
            }
            for (int leg = 0; leg < 3; ++leg) {
                const double i_leg_A = phase(i_A, leg) + i_zero_A;
                const int first = with.out.bridge[0].on[leg] - without.out.bridge[0].on[leg];
                const int second = with.out.bridge[1].on[leg] - without.out.bridge[1].on[leg];
                ASSERT_NEAR(first, lost_counts(i_leg_A, p), kCompensation_counts) << i_leg_A << ' ' << leg;
                ASSERT_NEAR(second, lost_counts(-i_leg_A, p), kCompensation_counts) << i_leg_A << ' ' << leg;
            }
        }
    }
}

// --- the signal ----------------------------------------------------------------------------------------------

pm_abc_t currents(Complex i_A, double i_zero_A)
{
    return {fixed((phase(i_A, 0) + i_zero_A) / kA, 28), fixed((phase(i_A, 1) + i_zero_A) / kA, 28),
            fixed((phase(i_A, 2) + i_zero_A) / kA, 28)};
}

// Row 91. What the vector of the currents is makes no difference.
TEST(OpenWinding, ACurrentThatFlowsTellsItsEmfByRAndL)
{
    drive_params_t p = ow::params();
    p.zero_current = 0;
    const double R_ohm = p.R_s * 1e-6, L_H = p.L_0 * 1e-9;
    Random random;
    Bridges x(p);
    double before_A = 0;
    for (int n = 0; n < 2000; ++n) {
        const double i_zero_A = std::clamp(before_A + random(-0.1, 0.1), -2.0, 2.0);
        const pm_q_t got = open_winding_signal(&x.self, &x.zero, currents(random.vector(4.0), i_zero_A));
        const double e_V = -R_ohm * (i_zero_A + before_A) / 2 - L_H * (i_zero_A - before_A) / kT_s;
        ASSERT_NEAR(real(got) * kV, e_V, 3e-4) << n; // a step of Q18, of 60 V
        x.step(random.vector(0.5));
        before_A = i_zero_A;
    }
}

// Row 92: of k what acts over [k-1, k), which was asked for at k-2.
TEST(OpenWinding, AVoltageThatHoldsItIsTheSignalOfThePeriodInWhichItActs)
{
    Random random;
    Bridges x(ideal(1));
    std::vector<double> asked = {0, 0}; // before the first
    for (size_t n = 0; n < 100; ++n) {
        const pm_q_t got = open_winding_signal(&x.self, &x.zero, currents(random.vector(4.0), random(-1, 1)));
        ASSERT_NEAR(real(got), asked[n], 1e-6) << n;
        asked.push_back(random(-0.14, 0.14));
        x.step(random.vector(0.2), 0, asked.back());
    }
}

// --- the loop ------------------------------------------------------------------------------------------------

// R, L_0 and the EMF of the zero sequence, exact from period to period; v_0 acts a period after it has been asked for.
struct Circuit {
    double R_ohm = 0.393, L_H = 2.25e-3, omega, amplitude_V;
    double i_A = 0, v_acting_V = 0, theta = 0.3;

    Circuit(double omega_1_s, double amplitude) : omega(omega_1_s), amplitude_V(amplitude)
    {
    }

    double e_V(double angle) const
    {
        return -amplitude_V * std::sin(3 * angle);
    }

    // What flows without a voltage, peak.
    double free_A() const
    {
        return amplitude_V / std::abs(Complex(R_ohm, 3 * omega * L_H));
    }

    void period(double v_next_V)
    {
        constexpr int kParts = 40;
        const double h = kT_s / kParts, decay = std::exp(-R_ohm / L_H * h);
        for (int n = 0; n < kParts; ++n) {
            const double v = v_acting_V - e_V(theta + omega * h / 2);
            i_A = v / R_ohm + (i_A - v / R_ohm) * decay;
            theta += omega * h;
        }
        v_acting_V = v_next_V;
    }
};

struct Held {
    Bridges bridges;
    Circuit circuit;
    double most_V = 0; // of v_0

    Held(const drive_params_t &p, double omega, double amplitude_V) : bridges(p), circuit(omega, amplitude_V)
    {
        bridges.config.winding = WINDING_OPEN;
        open_winding_slow(&bridges.self, &bridges.zero, fixed(omega / kOmega, 28));
    }

    void period()
    {
        Bridges &x = bridges;
        (void)open_winding_signal(&x.self, &x.zero, currents(0, circuit.i_A));
        open_winding_step(&x.self, &x.zero, &x.modulator, &x.config.modulator, ab(0.1), fixed(x.v_dc, 28),
                          ab(0), &x.out);
        const double v_V = real(x.self.v_next) * kV;
        most_V = std::max(most_V, std::fabs(v_V));
        EXPECT_LE(std::abs(x.self.y), fixed(x.v_dc / 4, 28));
        circuit.period(v_V);
    }

    void run(double time_s)
    {
        for (int n = 0; n < std::lround(time_s / kT_s); ++n) {
            period();
        }
    }

    // The largest of i_0 over some cycles, A.
    double left_A()
    {
        double most = 0;
        for (int n = 0; n < std::lround(2 * kPi / std::fabs(circuit.omega) / kT_s); ++n) {
            period();
            most = std::max(most, std::fabs(circuit.i_A));
        }
        return most;
    }
};

drive_params_t told(double L_share)
{
    drive_params_t p = ideal(1);
    p.L_0 = static_cast<int32_t>(std::lround(2.25e6 * L_share));
    return p;
}

constexpr double kRated_1_s = 209.4;

// Below a hundredth of what flows by itself. Told half or half as much again, k_p is as far off, which changes how long that takes.
TEST(OpenWinding, TheCurrentIsHeldAtZero)
{
    for (const double share : {1.0, 0.5, 1.5}) {
        for (const double speed : {0.05, 0.2, 0.5, 1.0}) {
            for (const double direction : {1.0, -1.0}) {
                const double omega = direction * speed * kRated_1_s;
                Held x(told(share), omega, 3 * std::fabs(omega) * kPsi_3_Wb);
                x.run(0.05);
                EXPECT_LE(x.left_A(), 0.01 * x.circuit.free_A()) << share << ' ' << omega;
                x.run(1.0);
                EXPECT_LE(x.left_A(), 0.002 * x.circuit.free_A()) << share << ' ' << omega;
            }
        }
    }
}

// Over the period in which it acts; its mean is that of the EMF there.
TEST(OpenWinding, TheVoltageThatHoldsItIsTheEmf)
{
    for (const double share : {1.0, 0.5, 1.5}) {
        for (const double omega : {0.1 * kRated_1_s, kRated_1_s, -kRated_1_s, 1.4 * kRated_1_s}) {
            const double e_V = 3 * std::fabs(omega) * kPsi_3_Wb;
            Held x(told(share), omega, e_V);
            x.run(0.5);
            Complex sum = 0, of_e = 0;
            const int periods = static_cast<int>(std::lround(20 * 2 * kPi / std::fabs(omega) / kT_s));
            for (int n = 0; n < periods; ++n) {
                const double middle = x.circuit.theta + omega * kT_s / 2;
                const Complex turned = std::polar(1.0, -3 * middle);
                sum += x.circuit.v_acting_V * turned;
                of_e += x.circuit.e_V(middle) * turned;
                x.period();
            }
            const Complex ratio = sum / of_e;
            EXPECT_NEAR(std::abs(ratio), 1, 0.002) << share << ' ' << omega;
            EXPECT_NEAR(std::arg(ratio) / 3 * 180 / kPi, 0, 0.02) << share << ' ' << omega; // of theta
        }
    }
}

// What is gathered turns with 3 omega, and is asked for as it will be when it acts and the current has followed.
TEST(OpenWinding, WhatIsGatheredIsAheadByDelayAndLag)
{
    const drive_params_t p = ideal(1);
    const double f_Hz = p.current_bandwidth * 1e-3;
    ASSERT_NEAR(f_Hz, 500, 1);
    for (const double omega : {0.1 * kRated_1_s, kRated_1_s, -kRated_1_s}) {
        Bridges x(p);
        open_winding_slow(&x.self, &x.zero, fixed(omega / kOmega, 28));
        const Complex turn = std::polar(1.0, 3 * omega * kT_s);
        // the voltage acts after the delay on L_0, whose current k_p answers with the same delay
        const Complex delay = std::polar(1.0, 3 * omega * 1.5 * kT_s);
        const Complex lag = std::conj(delay) + Complex(0, 3 * omega / (2 * kPi * f_Hz));
        const Complex ahead = delay * lag / std::abs(lag);
        Complex gathered(0.03, 0.01);
        x.self.y = fixed(gathered.real(), 28);
        x.self.q = fixed(gathered.imag(), 28);
        x.self.i = 0;
        for (int k = 0; k < 200; ++k) {
            gathered *= turn;
            open_winding_step(&x.self, &x.zero, &x.modulator, &x.config.modulator, ab(0), fixed(x.v_dc, 28),
                              ab(0), &x.out);
            ASSERT_NEAR(real(x.self.v_next), (gathered * ahead).real(), 2e-5) << omega << ' ' << k;
        }
    }
}

// An EMF that the quarter does not reach, as a rotor too fast has it: nothing is gathered beyond, and what follows is as from rest.
TEST(OpenWinding, SaturatesAtAQuarterOfTheLinkAndRecovers)
{
    for (const double omega : {0.5 * kRated_1_s, -kRated_1_s}) {
        Held x(told(1.0), omega, 40.0);
        x.run(0.5);
        EXPECT_NEAR(x.most_V, kLink * kV / 4, 1e-3) << omega;
        EXPECT_NE(x.bridges.modulator.limited, 0) << omega; // and says so
        x.circuit.amplitude_V = 3 * std::fabs(omega) * kPsi_3_Wb;
        x.circuit.i_A = 0;
        x.most_V = 0;
        x.run(0.1);
        EXPECT_LE(x.most_V, kLink * kV / 4 + 1e-3) << omega;
        EXPECT_LE(x.left_A(), 0.01 * x.circuit.free_A()) << omega;
    }
}

TEST(OpenWinding, AResetForgetsAll)
{
    Held x(told(1.0), kRated_1_s, 1.9);
    x.run(0.1);
    open_winding_reset(&x.bridges.self);
    const open_winding_t &s = x.bridges.self;
    EXPECT_EQ(s.i | s.v_acting | s.v_next | s.y | s.q, 0);
    EXPECT_EQ(s.turn.sin, 0);
    EXPECT_EQ(s.lead.sin, 0);
    EXPECT_EQ(s.turn.cos, PM_UNIT_MAX);
}

// --- parameters ----------------------------------------------------------------------------------------------

struct Refused {
    drive_param_id_t param;
    std::string reason;
};

Refused refused(const drive_params_t &p, uint32_t channels = PM_CHANNELS)
{
    drive_config_t config = {};
    const drive_result_t result = drive_configure(&config, &p, channels);
    EXPECT_FALSE(result.ok);
    return {result.param, result.ok ? "" : result.reason};
}

TEST(OpenWinding, ASecondBridgeIsAskedOfTheBoard)
{
    const Refused got = refused(ow::params(), PM_CHANNELS & ~NEEDS_BRIDGES);
    EXPECT_EQ(got.param, DRIVE_PARAM_winding);
    EXPECT_EQ(got.reason, "needs a second bridge: not on this board");
    drive_params_t star = ow::params();
    star.winding = 0;
    star.observer = 0;
    drive_config_t config = {};
    const drive_result_t result = drive_configure(&config, &star, PM_CHANNELS & ~NEEDS_BRIDGES);
    EXPECT_TRUE(result.ok) << result.reason;
    EXPECT_EQ(config.winding, WINDING_STAR);
}

// Its currents tell what the channel of a star point does.
TEST(OpenWinding, TheThirdHarmonicNeedsNoChannelOfTheNeutral)
{
    drive_params_t p = ow::params();
    drive_config_t config = {};
    EXPECT_TRUE(drive_configure(&config, &p, PM_CHANNELS & ~NEEDS_NEUTRAL).ok);
    p.winding = 0;
    EXPECT_EQ(refused(p, PM_CHANNELS & ~NEEDS_NEUTRAL).param, DRIVE_PARAM_observer);
}

// By itself, and asked to; what reads the star point has none.
TEST(OpenWinding, InjectionFollowsAnAlign)
{
    for (const int start : {0, 3}) {
        drive_params_t p = ow::params();
        p.start_method = start;
        p.L_q = p.L_q_rated = 3 * p.L_d / 2;
        const drive_config_t c = ow::configured(p);
        EXPECT_TRUE(c.injection) << start;
        EXPECT_EQ(c.start, SEQUENCE_align) << start;
        for (const int injection :
             {INJECTION_zero_anti_rotating, INJECTION_zero_rotating, INJECTION_zero_pulsating}) {
            p.injection = injection;
            drive_config_t none = {};
            const drive_result_t result = drive_configure(&none, &p, PM_CHANNELS);
            EXPECT_FALSE(result.ok) << injection;
            EXPECT_EQ(result.param, DRIVE_PARAM_injection);
            EXPECT_STREQ(result.reason, "reads one star: with two sets injection 12 or 13");
        }
    }
}

TEST(OpenWinding, WhatKnowsOneBridgeIsRefused)
{
    const char *const star = "knows one bridge: winding 0";
    const struct {
        int32_t drive_params_t::*value;
        int32_t to;
        drive_param_id_t param;
        const char *reason;
    } cases[] = {
        {&drive_params_t::L_0, 0, DRIVE_PARAM_L_0, "of an open winding must be known"},
        {&drive_params_t::start_method, 1, DRIVE_PARAM_start_method,
         "pulses know one bridge: take 0, 2 or 3"},
        {&drive_params_t::flying_start, 1, DRIVE_PARAM_flying_start, star},
        {&drive_params_t::commutation, 1, DRIVE_PARAM_commutation, star},
        {&drive_params_t::regulator, REGULATOR_finite_set, DRIVE_PARAM_regulator, star},
        {&drive_params_t::t_settle, 1000, DRIVE_PARAM_t_settle, "two bridges need shunts in the lines"},
    };
    for (const auto &x : cases) {
        drive_params_t p = ow::params();
        p.*x.value = x.to;
        const Refused got = refused(p);
        EXPECT_EQ(got.param, x.param) << x.reason << ", got " << got.reason;
        EXPECT_EQ(got.reason, x.reason);
    }
}

} // namespace
