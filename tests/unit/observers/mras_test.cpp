#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "tests/unit/observers/mras_bench.h"

namespace
{

using bench::Base;
using bench::Complex;
using bench::complex;
using bench::kDegree;
using bench::kJ;
using bench::Machine;
using bench::real;
using bench::Rotation;

// Everything exact: what is left is the mean of two samples taken for the mean current and the chord of the
// current for its change, (omega T_s)^2/6 of the reactive voltage.
constexpr double kIdeal_deg = 0.1;
// The simplified model takes v_q, of which it needs 3 %, from the parameters too.
constexpr double kMismatch_deg = 0.3;
constexpr double kFormula = 0.02;
// Fixed point against double with the same inputs: the EMF is resolved to 2^-20 of the base and divided by
// 0.03 of it at the slowest.
constexpr double kFixed_rad = 3e-4;
constexpr double kFixedVector = 1e-5;
// Of the adapted quantity, which is a first-order lag in discrete time.
constexpr double kAdaptation = 0.02;

constexpr int kSlow = 10; // periods of 1 ms

// The literal forms of METHODS.md 12.2 in per-unit double precision, from the same bits as the fixed point.
struct Reference {
    explicit Reference(const mras_config_t &c)
        : R(real(c.model.R)), L_d(real(c.model.L_d)), L_q(real(c.model.L_q)), psi_m(real(c.model.psi_m)),
          t_s(real(c.model.t_s, 32)), k(real(c.k, 32)), emf_min(real(c.emf_min)), turn(real(c.turn, 32))
    {
    }

    double psi_a(double i_d) const
    {
        return psi_m + (L_d - L_q) * i_d;
    }
    double relative(double x, double E) const
    {
        const double size = std::max(std::abs(E), emf_min);
        return std::clamp(x * E / (size * size), -1.0, 1.0);
    }
    // x of the period's middle in the frame of the present position.
    Complex middle(const obs_in_t &in, Complex x) const
    {
        const Complex dir{real(in.dir.cos, 31), real(in.dir.sin, 31)};
        return x * std::conj(dir) * Complex{1, slow_omega * t_s / 2};
    }

    double R, L_d, L_q, psi_m, t_s, k, emf_min, turn;
    double filtered = 0;                               // speed of the reactive term
    double slow_omega = 0, slow_i_d = 0, slow_i_q = 0; // what the slow step has seen
    Complex i_past = 0;
    double adapted = 0, divisor = 0;
    double past = 0;

    double mean(double d)
    {
        return 0.5 * (d + std::exchange(past, d));
    }

    void reset(const obs_in_t &in, bool speed)
    {
        i_past = complex(in.i);
        filtered = real(in.omega);
        adapted = real(in.omega) * (speed ? 1 : psi_a(real(in.i_dq.d)));
        slow(in, speed);
    }
    void slow(const obs_in_t &in, bool speed)
    {
        slow_omega = real(in.omega);
        filtered += std::min(0.5, std::abs(slow_omega) * turn) * (slow_omega - filtered);
        slow_i_d = real(in.i_dq.d);
        slow_i_q = real(in.i_dq.q);
        divisor = adapted * (speed ? psi_a(slow_i_d) : 1);
    }
};

struct Out {
    double eps, misfit;
    Complex vector;
};

// 12.2.2: predicted current, restarted from the measured one; trapezoidal in R.
Out current_model(Reference &m, const obs_in_t &in)
{
    const double r = m.R * m.t_s / (2 * m.L_d), b = m.t_s / m.L_d;
    const Complex i = complex(in.i), i_dq = complex(in.i_dq);
    const Complex stationary = ((1 - r) * m.i_past + b * complex(in.v)) / (1 + r);
    Complex change = m.middle(in, i - stationary);
    change += b / (1 + r) * (m.filtered * (m.L_q - m.L_d) * kJ * i_dq + kJ * m.adapted);
    m.i_past = i;
    change.real(m.mean(change.real()));
    const double response = b / (1 + r);
    const double model = m.slow_omega * m.psi_a(m.slow_i_d);
    const Out out = {m.relative(change.real() / response, m.divisor), m.relative(model - m.adapted, model),
                     kJ * m.adapted - change / response};
    m.adapted -= m.k / response * change.imag();
    return out;
}

// 12.2.3: voltage of the measured current.
Out voltage_model(Reference &m, const obs_in_t &in)
{
    const Complex i = complex(in.i), i_dq = complex(in.i_dq);
    const Complex lacking = complex(in.v) - m.R * 0.5 * (i + m.i_past) - m.L_d / m.t_s * (i - m.i_past);
    m.i_past = i;
    const double psi_a = m.psi_a(m.slow_i_d);
    const Complex e = m.middle(in, lacking) - m.filtered * (m.L_q - m.L_d) * kJ * i_dq;
    Complex d = e - kJ * m.adapted * psi_a;
    d.real(m.mean(d.real()));
    const Out out = {m.relative(-d.real(), m.divisor), m.relative(m.slow_omega - m.adapted, m.slow_omega),
                     d + kJ * m.adapted * psi_a};
    m.adapted += m.k / psi_a * d.imag();
    return out;
}

struct Fixture {
    Machine machine;
    Base base;
    mras_config_t config;
};

// Four times (L_q - L_d) i_q / psi_a at rated current of IPM-1000.
Fixture ipm(double lag_rad = 2)
{
    return {bench::kIpmLinear, bench::kIpmBase,
            bench::mras_config(bench::kIpmLinear, bench::kIpmBase, lag_rad)};
}

Fixture spm(double lag_rad = 2)
{
    return {bench::kSpmLinear, bench::kSpmBase,
            bench::mras_config(bench::kSpmLinear, bench::kSpmBase, lag_rad)};
}

struct Current {
    using State = mras_current_t;
    static constexpr auto reset = mras_current_reset;
    static constexpr auto step = mras_current_step;
    static constexpr auto slow = mras_current_slow;
    static constexpr auto last = mras_current_last;
    static constexpr auto tie = mras_current_tie;
    static constexpr bool speed = false;
    static constexpr auto reference = current_model;
};

struct Voltage {
    using State = mras_voltage_t;
    static constexpr auto reset = mras_voltage_reset;
    static constexpr auto step = mras_voltage_step;
    static constexpr auto slow = mras_voltage_slow;
    static constexpr auto last = mras_voltage_last;
    static constexpr auto tie = mras_voltage_tie;
    static constexpr bool speed = true;
    static constexpr auto reference = voltage_model;
};

struct Simple {
    using State = mras_simple_t;
    static constexpr auto reset = mras_simple_reset;
    static constexpr auto step = mras_simple_step;
    static constexpr auto slow = mras_simple_slow;
    static constexpr auto last = mras_simple_last;
    static constexpr auto tie = mras_simple_tie;
};

// The observer leads.
template <class Kind> class Closed
{
  public:
    Closed(const Fixture &f, const Rotation &truth) : rotation(truth), f_(f)
    {
        loop.theta_rad = rotation.theta_rad;
        loop.omega_rad_s = rotation.omega_rad_s;
        in = rotation.seen(loop.theta_rad, loop.omega_rad_s);
        Kind::reset(&state, &f.config, &in);
        Kind::slow(&state, &f.config, &in, &out, PM_ONE);
    }

    void step(pm_q_t weight = PM_ONE)
    {
        rotation.advance();
        loop.predict(f_.base.period_s);
        in = rotation.seen(loop.theta_rad, loop.omega_rad_s);
        Kind::step(&state, &f_.config, &in, &out);
        loop.correct(real(out.eps), f_.base.period_s);
        if (++periods_ % kSlow == 0) {
            Kind::slow(&state, &f_.config, &in, &out, weight);
        }
    }

    double settled_deg(double seconds = 0.5)
    {
        for (int k = 0; k < static_cast<int>(seconds / f_.base.period_s); ++k) {
            step();
        }
        return bench::wrapped(rotation.theta_rad - loop.theta_rad) / kDegree;
    }

    typename Kind::State state;
    bench::Loop loop;
    Rotation rotation;
    obs_in_t in = {};
    obs_out_t out = {};

  private:
    Fixture f_;
    int periods_ = 0;
};

// The third argument that clang wants: the place in the list.
struct Place {
    template <class Kind> static std::string GetName(int n)
    {
        return std::to_string(n);
    }
};

template <class Kind> class Mras : public ::testing::Test
{
};
using All = ::testing::Types<Current, Voltage, Simple>;
TYPED_TEST_SUITE(Mras, All, Place);

template <class Kind> class MrasWithModel : public ::testing::Test
{
};
using WithModel = ::testing::Types<Current, Voltage>;
TYPED_TEST_SUITE(MrasWithModel, WithModel, Place);

TYPED_TEST(MrasWithModel, FollowsTheDoubleForm)
{
    for (const Fixture &f : {ipm(), spm()}) {
        for (const double omega : {0.06, 0.6, -1.0}) {
            double eps = 0, misfit = 0, vector = 0;
            Rotation rotation(f.machine, f.base, omega, {-1, 3});
            obs_in_t in = rotation.seen(0, rotation.omega_rad_s);
            typename TypeParam::State state;
            TypeParam::reset(&state, &f.config, &in);
            obs_out_t out = {};
            TypeParam::slow(&state, &f.config, &in, &out, PM_ONE);
            Reference reference(f.config);
            reference.reset(in, TypeParam::speed);
            for (int k = 1; k <= 3000; ++k) {
                rotation.advance();
                // a position that swings, and a speed that is not quite the rotor's
                const double error = 0.2 * std::sin(0.01 * k);
                in = rotation.seen(rotation.theta_rad - error, 0.98 * rotation.omega_rad_s,
                                   {0.4 * std::sin(0.3 * k), 0.2}, {0.01 * std::cos(0.7 * k), 0.0});
                TypeParam::step(&state, &f.config, &in, &out);
                const Out exact = TypeParam::reference(reference, in);
                eps = std::max(eps, std::abs(real(out.eps) - exact.eps));
                misfit = std::max(misfit, std::abs(real(out.misfit) - exact.misfit));
                vector = std::max(vector, std::abs(complex(out.vector) - exact.vector));
                if (k % kSlow == 0) {
                    TypeParam::slow(&state, &f.config, &in, &out, PM_ONE);
                    reference.slow(in, TypeParam::speed);
                }
            }
            EXPECT_LE(eps, kFixed_rad) << omega;
            EXPECT_LE(misfit, kFixed_rad) << omega;
            EXPECT_LE(vector, kFixedVector) << omega;
        }
    }
}

TYPED_TEST(Mras, FindsThePosition)
{
    for (const Fixture &f : {ipm(), spm()}) {
        for (const double omega : {0.06, -0.06, 0.3, 0.6, -0.6, 1.0}) {
            for (const Complex i : {Complex{0, 0}, Complex{-1.75, 4}, Complex{-1.75, -4}, Complex{2, 2}}) {
                Closed<TypeParam> closed(f, Rotation(f.machine, f.base, omega, i, 1.0));
                closed.loop.theta_rad += 0.3; // it starts beside
                EXPECT_NEAR(closed.settled_deg(), 0, kIdeal_deg) << omega << ' ' << i;
            }
        }
    }
}

// The EMF that a model with R^ and L_q^ sees in the rotor frame, z = (R - R^) i + j omega (psi - L_q^ i),
// stands on the q-axis of the estimated frame. METHODS.md 3.5.1 is its first order.
double mismatch_deg(const Machine &m, double omega_rad_s, Complex i_A, double R, double L_q)
{
    const Complex psi = {m.psi_m_Wb + m.L_d0_H * i_A.real(), m.L_q0_H * i_A.imag()};
    const Complex z = (1 - R) * m.R_ohm * i_A + kJ * omega_rad_s * (psi - L_q * m.L_q0_H * i_A);
    return std::arg(kJ * omega_rad_s / z) / kDegree;
}

TYPED_TEST(Mras, WrongParametersActAsDerived)
{
    for (const Fixture &exact : {ipm(), spm()}) {
        for (const double omega : {0.5, -0.5}) {
            for (const Complex i : {Complex{-2, 0}, Complex{-1, 4}, Complex{-1, -4}}) {
                for (const double R : {0.5, 1.0, 1.2}) {
                    for (const double L_q : {0.8, 1.0, 1.1}) {
                        Fixture f = exact;
                        f.config.model.R = static_cast<pm_q_t>(f.config.model.R * R);
                        f.config.model.L_q = static_cast<pm_q_t>(f.config.model.L_q * L_q);
                        const Machine &m = exact.machine;
                        const double expected = mismatch_deg(m, omega * f.base.omega_rad_s, i, R, L_q);
                        Closed<TypeParam> closed(f, Rotation(m, f.base, omega, i));
                        EXPECT_NEAR(closed.settled_deg(), expected,
                                    kMismatch_deg + kFormula * std::abs(expected))
                            << omega << ' ' << i << ' ' << R << ' ' << L_q;
                    }
                }
            }
        }
    }
}

TYPED_TEST(Mras, PublishedMismatchFigures) // METHODS.md 3.5.1 (e)
{
    Fixture f = spm();
    f.config.model.L_q = static_cast<pm_q_t>(f.config.model.L_q * 0.7);
    EXPECT_NEAR(Closed<TypeParam>(f, Rotation(f.machine, f.base, 0.582, {0, 4})).settled_deg(), -3.0, 0.3);
    f = spm();
    f.config.model.R /= 2;
    EXPECT_NEAR(Closed<TypeParam>(f, Rotation(f.machine, f.base, 0.582, {-2, 0})).settled_deg(), -1.3, 0.2);
}

TYPED_TEST(Mras, AWrongMagnetMovesNoAngle)
{
    for (const double factor : {0.8, 1.2}) {
        Fixture f = ipm();
        f.config.model.psi_m = static_cast<pm_q_t>(f.config.model.psi_m * factor);
        Closed<TypeParam> closed(f, Rotation(f.machine, f.base, 0.3, {-1, 3}));
        // the simplified one knows v_q, and through it the turn of half a period, from psi_m
        EXPECT_NEAR(closed.settled_deg(), 0, 2 * kIdeal_deg) << factor;
    }
}

TYPED_TEST(Mras, ErrorSignalIsTheSineInBothDirections)
{
    const Fixture f = ipm();
    for (const double omega : {0.5, -0.5}) {
        for (const double error : {-0.3, -0.02, 0.02, 0.3}) {
            Rotation rotation(f.machine, f.base, omega, {0, 0});
            obs_in_t in = rotation.seen(0, rotation.omega_rad_s);
            typename TypeParam::State state;
            TypeParam::reset(&state, &f.config, &in);
            obs_out_t out = {};
            for (int k = 0; k < 4; ++k) {
                rotation.advance();
                in = rotation.seen(rotation.theta_rad - error, rotation.omega_rad_s);
                TypeParam::step(&state, &f.config, &in, &out);
            }
            EXPECT_NEAR(real(out.eps), std::sin(error), 2e-3) << omega << ' ' << error;
            const obs_out_t last = TypeParam::last(&state);
            EXPECT_EQ(last.eps, out.eps);
            EXPECT_EQ(last.vector.d, out.vector.d);
        }
    }
}

// A current that jumps on the d-axis by far more than a period can change it: at the limit, on its own side.
TYPED_TEST(Mras, AJumpOfTheCurrentSaturates)
{
    const Fixture f = ipm();
    const double most = std::is_same_v<TypeParam, Current> ? 1 : 0.2; // 10 and 2 of the base voltage
    for (double jump = 0.1; jump <= most; jump += 0.1) {
        double eps[2];
        for (const int side : {0, 1}) {
            Rotation rotation(f.machine, f.base, 0.5, {0, 0});
            obs_in_t in = rotation.seen(0, rotation.omega_rad_s);
            typename TypeParam::State state;
            TypeParam::reset(&state, &f.config, &in);
            obs_out_t out = {};
            rotation.advance();
            in = rotation.seen(rotation.theta_rad, rotation.omega_rad_s);
            TypeParam::step(&state, &f.config, &in, &out);
            rotation.advance();
            in = rotation.seen(rotation.theta_rad, rotation.omega_rad_s);
            const Complex i = (side == 0 ? jump : -jump) * std::polar(1.0, rotation.theta_rad);
            in.i.alpha += bench::fixed(i.real(), 28);
            in.i.beta += bench::fixed(i.imag(), 28);
            in.i_dq.d += bench::fixed(side == 0 ? jump : -jump, 28);
            TypeParam::step(&state, &f.config, &in, &out);
            eps[side] = real(out.eps);
        }
        EXPECT_GT(std::abs(eps[0]), 0.5) << jump;
        EXPECT_LT(eps[0] * eps[1], 0) << jump;
    }
}

// Below emf_min the signal fades with the square of the speed instead of growing without end.
TYPED_TEST(Mras, NothingIsClaimedAtStandstill)
{
    Fixture f = ipm();
    f.config.emf_min = bench::fixed(0.1 * real(f.config.model.psi_m), 28);
    for (const double omega : {0.05, -0.025, 0.0}) {
        Rotation rotation(f.machine, f.base, omega, {0, 0});
        obs_in_t in = rotation.seen(0, rotation.omega_rad_s);
        typename TypeParam::State state;
        TypeParam::reset(&state, &f.config, &in);
        obs_out_t out = {};
        for (int k = 0; k < 4; ++k) {
            rotation.advance();
            in = rotation.seen(rotation.theta_rad - 0.1, rotation.omega_rad_s);
            TypeParam::step(&state, &f.config, &in, &out);
        }
        EXPECT_NEAR(real(out.eps), std::sin(0.1) * std::pow(omega / 0.1, 2), 1e-3) << omega;
    }
}

double adapted(const Current::State &state)
{
    return real(state.emf);
}
double adapted(const Voltage::State &state)
{
    return real(state.omega);
}

// From a wrong value, with the position held right: a lag of the bandwidth k.
TYPED_TEST(MrasWithModel, AdaptsAtTheRateGiven)
{
    const Fixture f = ipm();
    Rotation rotation(f.machine, f.base, 0.5, {0, 2});
    const obs_in_t first = rotation.seen(0, 0.8 * rotation.omega_rad_s);
    typename TypeParam::State state;
    TypeParam::reset(&state, &f.config, &first);
    obs_out_t out = {};
    TypeParam::slow(&state, &f.config, &first, &out, PM_ONE);
    const double end = 0.5 * (TypeParam::speed ? 1 : real(f.config.model.psi_m));
    const double start = adapted(state);
    EXPECT_NEAR(start, 0.8 * end, 1e-6);
    for (int k = 1; k <= 100; ++k) {
        rotation.advance();
        const obs_in_t in = rotation.seen(rotation.theta_rad, rotation.omega_rad_s);
        TypeParam::step(&state, &f.config, &in, &out);
        // the step's cross terms are those of the wrong speed until the slow step: none on q without i_d
        const double expected = end + (start - end) * std::pow(1 - real(f.config.k, 32), k);
        EXPECT_NEAR(adapted(state), expected, kAdaptation * (end - start)) << k;
    }
}

TYPED_TEST(MrasWithModel, TheAdaptedSpeedIsTheRotorsAndMisfitShowsTheLoops)
{
    const Fixture f = ipm();
    for (const double omega : {0.4, -0.4}) {
        Closed<TypeParam> closed(f, Rotation(f.machine, f.base, omega, {-1, 3}));
        closed.settled_deg();
        EXPECT_NEAR(real(closed.out.misfit), 0, 2e-3);
        obs_in_t in = closed.in; // a loop that runs 10 % slow
        in.omega = static_cast<pm_q_t>(0.9 * in.omega);
        TypeParam::slow(&closed.state, &f.config, &in, &closed.out, PM_ONE);
        closed.step();
        EXPECT_NEAR(real(closed.out.misfit), 1 - 1 / 0.9, 3e-3);
    }
}

// While injection leads, the adapted quantity is that of the position's speed, and the first step in
// the lead starts without a jump.
TYPED_TEST(MrasWithModel, TiedItKeepsToThePosition)
{
    const Fixture f = ipm();
    Rotation rotation(f.machine, f.base, 0.05, {0, 4});
    obs_in_t in = rotation.seen(0, rotation.omega_rad_s);
    typename TypeParam::State state;
    TypeParam::reset(&state, &f.config, &in);
    obs_out_t out = {};
    for (int k = 1; k <= 1000; ++k) {
        rotation.advance();
        in = rotation.seen(rotation.theta_rad, rotation.omega_rad_s);
        TypeParam::step(&state, &f.config, &in, &out);
        if (k % kSlow == 0) {
            TypeParam::slow(&state, &f.config, &in, &out, 0);
        }
    }
    EXPECT_NEAR(adapted(state), 0.05 * (TypeParam::speed ? 1 : real(f.config.model.psi_m)), 1e-6);
    TypeParam::slow(&state, &f.config, &in, &out, PM_ONE);
    const double before = adapted(state);
    for (int k = 0; k < 10; ++k) {
        rotation.advance();
        in = rotation.seen(rotation.theta_rad, rotation.omega_rad_s);
        TypeParam::step(&state, &f.config, &in, &out);
    }
    EXPECT_NEAR(adapted(state), before, 0.01 * before);
    EXPECT_NEAR(real(out.eps), 0, 0.01);
}

TYPED_TEST(MrasWithModel, LedAlongItLearnsNothing)
{
    const Fixture f = ipm();
    Rotation rotation(f.machine, f.base, 0.5, {0, 0});
    obs_in_t in = rotation.seen(0, 0.3 * f.base.omega_rad_s);
    typename TypeParam::State state;
    TypeParam::reset(&state, &f.config, &in);
    obs_out_t out = {};
    TypeParam::slow(&state, &f.config, &in, &out, PM_ONE);
    const double before = adapted(state);
    for (int k = 0; k < 20; ++k) {
        TypeParam::tie(&state, &f.config);
        rotation.advance();
        in = rotation.seen(rotation.theta_rad, rotation.omega_rad_s);
        TypeParam::step(&state, &f.config, &in, &out);
    }
    EXPECT_EQ(adapted(state), before);
}

// Led along in an open-loop start, a rotor that swings beside the imposed position is no lost position.
TYPED_TEST(Mras, LedAlongItClaimsNoError)
{
    const Fixture f = ipm();
    Rotation rotation(f.machine, f.base, 0.5, {0, 2});
    obs_in_t in = rotation.seen(0, rotation.omega_rad_s);
    typename TypeParam::State state;
    TypeParam::reset(&state, &f.config, &in);
    obs_out_t out = {};
    for (int k = 0; k < 20; ++k) {
        TypeParam::tie(&state, &f.config);
        rotation.advance();
        in = rotation.seen(rotation.theta_rad - 1.0, 0.8 * rotation.omega_rad_s);
        TypeParam::step(&state, &f.config, &in, &out);
        EXPECT_EQ(out.eps, 0);
        EXPECT_EQ(out.misfit, 0);
    }
    TypeParam::slow(&state, &f.config, &in, &out, PM_ONE);
    TypeParam::step(&state, &f.config, &in, &out);
    EXPECT_GT(real(out.eps), 0.1); // it has seen it all the time
}

// (L_q - L_d) i_q / psi_a is 2.2 rad at 16 A: a lag of less runs away, a longer one does not (mras.h).
TYPED_TEST(MrasWithModel, TheLagOfTheSpeedKeepsItStable)
{
    for (const double lag_rad : {0.9, 4.0}) {
        const Fixture f = ipm(lag_rad);
        Closed<TypeParam> closed(f, Rotation(f.machine, f.base, 0.1, {0, -16}));
        closed.loop.theta_rad += 0.05;
        const double error = std::abs(closed.settled_deg(2.0));
        if (lag_rad > 2.2) {
            EXPECT_LT(error, kIdeal_deg);
        } else {
            EXPECT_GT(error, 10);
        }
    }
}

// A carrier at half the sampling rate, of which the current says nothing here, is gone after two periods.
TEST(MrasSimple, ASquareWaveCarrierCancels)
{
    const Fixture f = ipm();
    Rotation rotation(f.machine, f.base, 0.3, {-1, 3});
    obs_in_t in = rotation.seen(0, rotation.omega_rad_s);
    mras_simple_t state;
    mras_simple_reset(&state, &f.config, &in);
    for (int k = 1; k <= 100; ++k) {
        rotation.advance();
        const Complex carrier = std::polar(k % 2 == 0 ? 30.0 : -30.0, rotation.theta_rad);
        in = rotation.seen(rotation.theta_rad, rotation.omega_rad_s, carrier);
        obs_out_t out;
        mras_simple_step(&state, &f.config, &in, &out);
        if (k > 1) {
            EXPECT_NEAR(real(out.eps), 0, 2e-3) << k;
        }
    }
}

} // namespace
