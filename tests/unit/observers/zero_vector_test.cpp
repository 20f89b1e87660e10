// zero_vector.h: a machine whose terminals are shorted around the centre of each zero vector, sampled where the observer asks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "tests/contract/observers.h"
#include "tests/unit/math/samples.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::kJ;
using bench::Machine;
using bench::real;

constexpr bench::Base kB = bench::kSpmBase;
constexpr double kVdc_V = 36;
// Second order in omega x and in the rounding of a current.
constexpr double kExact_deg = 0.15;
// lambda is linear in i_q and the saliency that of no load.
constexpr double kSaturated_deg = 0.3;
constexpr double kTen = 20.9, kHalf = 104.7; // electrical, of SPM-400's rated speed

drive_params_t params(const Machine &m = bench::kSpmLinear)
{
    drive_params_t p = bench::parameters(m, kB);
    p.observer = OBSERVER_zero_vector;
    p.start_method = 2;
    p.v_dc_nominal = 36000;
    p.v_dc_max = 50000;
    p.v_dc_derate = 45000;
    p.v_dc_min = 20000;
    p.device_drop = 0;
    p.speed_low = 3600;
    p.speed_high = 4190;
    p.speed_max = 34000;
    return p;
}

// As the drive is told of it.
drive_params_t saturated()
{
    drive_params_t p = params(bench::kSpm400);
    p.L_d = 3000000;
    p.L_q = 3300000;
    p.L_q_rated = 3296600;
    p.L_dh_rated = 2994300;
    p.L_qh_rated = 3288000;
    p.L_dqh_rated = -51600;
    return p;
}

drive_result_t result(const drive_params_t &p, drive_config_t *c)
{
    *c = {};
    return drive_configure(c, &p, PM_CHANNELS);
}

observer_config_t config(const drive_params_t &p)
{
    drive_config_t c;
    const drive_result_t r = result(p, &c);
    EXPECT_TRUE(r.ok) << drive_param_table[r.param].name << ": " << r.reason;
    return c.position.observer;
}

// Constant speed and currents at the centres; around them the flux falls by the resistance alone.
class Bench
{
  public:
    Bench(const Machine &m, const drive_params_t &p, double omega_rad_s, Complex i_A, double error_rad = 0)
        : c(config(p)), error(error_rad), machine_(m), counts_(static_cast<uint32_t>(p.timer_counts)),
          omega_(omega_rad_s), i_A_(i_A)
    {
        std::memset(&state, 0xa5, sizeof state);
        const obs_in_t in = seen();
        observer_reset(&state, &c, &in);
    }

    // eps, degrees
    double step(pm_q_t weight = PM_ONE)
    {
        const double middle = theta_ + omega_ * kB.period_s / 2;
        theta_ += omega_ * kB.period_s;
        const Complex psi = machine_.flux_Wb(i_A_);
        v_V_ = (machine_.R_ohm * i_A_ + kJ * omega_ * psi) * std::polar(1.0, middle);
        pm_measure_t codes = {};
        obs_more_t more = {};
        more.codes = &codes;
        const pm_q_t link = fixed(v_dc / kB.v_V, 28);
        more.v_dc = &link;
        if (asked_[1] != 0) {
            const uint32_t later = c.zero_vector.later;
            taken[0] = taken[1];
            taken[1] = asked_[1] < counts_ ? asked_[1] - later : 2 * counts_ - (asked_[1] - later);
            bench::give_sample(&codes, 0, bench::ab((sample(asked_[1]) + noise()) / kB.i_A));
        }
        obs_in_t in = seen();
        in.more = &more;
        observer_step(&state, &c, &in, &out);
        asked_[1] = asked_[0];
        asked_[0] = zero_vector_sample_at(&state.zero_vector);
        if (++periods_ % divider == 0) {
            observer_slow(&state, &c, &in, &out, weight);
        }
        return real(out.eps) / kDegree;
    }

    double settled_deg(int periods = 4000)
    {
        double sum = 0;
        for (int k = 0; k < periods; ++k) {
            const double eps = step();
            sum += k >= periods / 2 ? eps : 0;
        }
        return sum / (periods - periods / 2);
    }

    uint32_t asked() const
    {
        return asked_[0];
    }

    observer_config_t c;
    observer_t state;
    obs_out_t out = {};
    double error; // by which the position lags, rad
    double v_dc = kVdc_V;
    double noise_A = 0;   // of each current along either axis
    double carrier_V = 0; // along alpha, the sign of each period another
    bool swapped = false;
    int divider = 10;           // periods in a call of 1 kHz
    uint32_t taken[2] = {0, 0}; // distances from the centre of the last two samples, counts

  private:
    obs_in_t seen()
    {
        obs_in_t in = {};
        const Complex carrier = {periods_ % 2 == 0 ? -carrier_V : carrier_V, 0};
        in.v = bench::ab((v_V_ + carrier) / kB.v_V);
        in.i = bench::ab(i_A_ * std::polar(1.0, theta_) / kB.i_A);
        in.dir = bench::direction(theta_ - error);
        in.omega = fixed(omega_ / kB.omega_rad_s, 28);
        in.i_dq = bench::dq(i_A_ * std::polar(1.0, error) / kB.i_A);
        return in;
    }

    // Of the period that ends now.
    Complex sample(uint32_t instant)
    {
        const double at_s = kB.period_s * instant / (2.0 * counts_);
        const bool behind = instant < counts_;
        double from_centre = behind ? at_s : at_s - kB.period_s;
        from_centre = swapped ? -from_centre : from_centre;
        const double centre = theta_ - (behind ? omega_ * kB.period_s : 0);
        return at_zero_voltage(centre, from_centre);
    }

    Complex at_zero_voltage(double theta, double time_s) const
    {
        Complex psi = machine_.flux_Wb(i_A_) * std::polar(1.0, theta);
        const int n = 40;
        const double t = time_s / n;
        for (int k = 0; k < n; ++k) {
            const Complex half = psi - 0.5 * t * machine_.R_ohm * current(psi, theta);
            psi -= t * machine_.R_ohm * current(half, theta + omega_ * t / 2);
            theta += omega_ * t;
        }
        return current(psi, theta);
    }

    Complex current(Complex psi, double theta) const
    {
        return machine_.current_A(psi * std::polar(1.0, -theta)) * std::polar(1.0, theta);
    }

    Complex noise()
    {
        const auto one = [this] {
            double sum = -6;
            for (int k = 0; k < 12; ++k) {
                sum += random_.within(0, 1);
            }
            return noise_A * sum;
        };
        const double x = one();
        return {x, one()};
    }

    Machine machine_;
    uint32_t counts_;
    double omega_, theta_ = 0.3;
    Complex i_A_, v_V_ = 0;
    uint32_t asked_[2] = {0, 0};
    int periods_ = 0;
    samples::Random random_;
};

const std::vector<double> kSpeeds = {kTen, -kTen, kHalf, -kHalf, 167.0};
const std::vector<Complex> kCurrents = {{0, 0}, {0, 4}, {0, -4}, {-2, 2}};

TEST(ZeroVector, FindsThePositionOfARoundMachineWithoutTheVoltage)
{
    for (const double omega : kSpeeds) {
        for (const Complex i : kCurrents) {
            Bench b(bench::kSpmLinear, params(), omega, i);
            EXPECT_NEAR(b.settled_deg(), 0, kExact_deg) << omega << ' ' << i;
        }
    }
}

// The drop of i_q within the zero vector turns the flux of the d-axis by L_dq; the same without the correction errs.
TEST(ZeroVector, TheCrossInductanceIsCorrectedAtEachLoadAndSpeed)
{
    for (const double omega : kSpeeds) {
        for (const double i_q : {2.0, 4.0, -4.0}) {
            Bench b(bench::kSpm400, saturated(), omega, kJ * i_q);
            EXPECT_NEAR(b.settled_deg(), 0, kSaturated_deg) << omega << ' ' << i_q;
            drive_params_t off = saturated();
            off.cross_coupling_comp = 0;
            Bench twin(bench::kSpm400, off, omega, kJ * i_q);
            const double lambda = -51.6e-6 / 3.288e-3 * i_q / 4;
            const double fall = 1 + 0.373 * i_q / (omega * 77.6e-3);
            const double expected = std::atan(lambda * fall * 3.3 / 3.0) / kDegree;
            EXPECT_NEAR(twin.settled_deg(), expected, 0.15 * std::fabs(expected) + kExact_deg)
                << omega << ' ' << i_q;
        }
    }
}

TEST(ZeroVector, TheErrorSignalIsTheAngle)
{
    for (const double omega : kSpeeds) {
        for (const double error : {0.1, -0.2}) {
            Bench b(bench::kSpmLinear, params(), omega, {0, 1}, error);
            EXPECT_NEAR(b.settled_deg(), std::sin(error) / kDegree, 0.03 * std::fabs(error) / kDegree)
                << omega;
        }
    }
}

// Twins: what the difference of the samples must be for.
TEST(ZeroVector, TwinSwappedSamplesPointTheOtherWay)
{
    Bench b(bench::kSpmLinear, params(), kHalf, 0, 0.1);
    b.swapped = true;
    EXPECT_LT(b.settled_deg(), -0.5 * 0.1 / kDegree);
    EXPECT_GT(std::fabs(real(b.out.misfit)), 0.9);
}

// METHODS addendum B(a), row 48: sigma per pair = root(2) root(2/3) of a current's noise over the change of the current.
TEST(ZeroVector, TheNoiseIsThatOfTheChangeOfTheCurrent)
{
    const double sigma_A = 0.577 * 10.0 / 2048;
    Bench b(bench::kSpmLinear, params(), kTen, 0);
    b.noise_A = sigma_A * std::sqrt(2.0 / 3);
    b.settled_deg(2000);
    const double x_s = kB.period_s * b.state.zero_vector.x / (2.0 * 8500);
    const double change_A = kTen * 77.6e-3 * 2 * x_s / 3.24e-3;
    const double k = real(b.c.zero_vector.emf.k_filter, 32);
    const double expected = std::sqrt(2.0) * b.noise_A / change_A / kDegree * std::sqrt(k / (2 - k));
    double squares = 0;
    const int n = 40000;
    for (int m = 0; m < n; ++m) {
        const double eps = b.step();
        squares += eps * eps;
    }
    EXPECT_NEAR(std::sqrt(squares / n), expected, 0.07 * expected);
}

TEST(ZeroVector, BothInstantsLieWithinTheZeroVectorAtAnyVoltage)
{
    const double dead_s = 2e-6;
    for (const double omega : {0.0, kTen, kHalf, 167.0}) {
        Bench b(bench::kSpmLinear, params(), omega, {0, 4});
        uint32_t least = 17000, most = 0;
        for (int k = 0; k < 400; ++k) {
            b.step();
            const uint32_t at = b.asked();
            if (k > 100) {
                least = std::min(least, at);
                most = std::max(most, at);
            }
        }
        const Complex psi = {77.6e-3, 3.24e-3 * 4};
        const double v = std::abs(0.373 * 4.0 * kJ + kJ * omega * psi);
        const double half_s = kB.period_s / 4 * (1 - std::sqrt(3.0) * v / kVdc_V);
        const double count_s = kB.period_s / 17000;
        EXPECT_LE(least * count_s, half_s - dead_s / 2) << omega;                // behind
        EXPECT_GE(most * count_s, kB.period_s - half_s + 1.5 * dead_s) << omega; // ahead
        EXPECT_GT(least * count_s, half_s - dead_s / 2 - 3e-6) << omega;         // and no nearer than need be
    }
}

// The voltage rises within a millisecond: the pairs that do not fit are left out and the loop coasts; then the samples move.
TEST(ZeroVector, APairOfATooShortZeroVectorIsLeftOut)
{
    Bench b(bench::kSpmLinear, params(), kHalf, {0, 2}, 0.1);
    b.settled_deg(200);
    const uint16_t x = b.state.zero_vector.x;
    ASSERT_GT(b.step(), 3);
    b.v_dc = 24; // the link sags
    bool coasted = false;
    for (int k = 0; k < 12; ++k) {
        coasted = b.step() == 0 || coasted;
    }
    EXPECT_TRUE(coasted);
    EXPECT_LT(std::fabs(real(b.out.misfit)), 0.5);
    EXPECT_GT(b.settled_deg(400), 3);
    EXPECT_LT(b.state.zero_vector.x, x);
}

// The samples move in either half of a pair; until those of the new distance arrive nothing is taken for a pair.
TEST(ZeroVector, NoPairHasTwoDistances)
{
    for (const int divider : {9, 10, 11}) {
        Bench b(bench::kSpmLinear, params(), kHalf, {0, 2}, 0.1);
        b.divider = divider;
        b.settled_deg(200);
        int moved = 0, pairs = 0;
        for (int k = 0; k < 2000; ++k) {
            b.v_dc = kVdc_V - 8 * std::sin(k * 0.01);
            const uint32_t x = b.state.zero_vector.x;
            const pm_q_t before = b.state.zero_vector.eps;
            b.step();
            if (b.state.zero_vector.eps != before && b.state.zero_vector.eps != 0) {
                ++pairs;
                ASSERT_EQ(b.taken[0], x) << divider << ' ' << k;
                ASSERT_EQ(b.taken[1], x) << divider << ' ' << k;
            }
            moved += b.state.zero_vector.x != x ? 1 : 0;
        }
        EXPECT_GT(moved, 10) << divider;
        EXPECT_GT(pairs, 200) << divider;
    }
}

// Tied, it takes the flux for that of the machine that it was told of; free, for the one that it sees.
TEST(ZeroVector, TheFluxIsLearntByTheOneThatLeads)
{
    Machine weak = bench::kSpmLinear;
    weak.psi_m_Wb *= 0.9;
    for (const pm_q_t weight : {0, PM_ONE}) {
        Bench b(weak, params(), kHalf, {0, 2});
        const pm_q_t told = b.state.zero_vector.emf.psi_ref;
        for (int k = 0; k < 20000; ++k) {
            b.step(weight);
        }
        const double share = b.state.zero_vector.emf.psi_ref / double(told);
        EXPECT_NEAR(share, weight == 0 ? 1 : 0.9, 0.02);
    }
}

TEST(ZeroVector, WithoutSamplesThereIsNoErrorSignal)
{
    Bench b(bench::kSpmLinear, params(), kHalf, 0, 0.1);
    pm_measure_t codes = {};
    obs_more_t more = {};
    more.codes = &codes;
    const pm_q_t link = fixed(0.6, 28);
    more.v_dc = &link;
    b.settled_deg(100);
    obs_in_t in = {};
    in.dir = bench::direction(0);
    in.omega = fixed(0.3, 28);
    in.more = &more;
    obs_out_t out;
    for (int k = 0; k < 4; ++k) {
        observer_step(&b.state, &b.c, &in, &out);
    }
    EXPECT_EQ(out.eps, 0);
    EXPECT_LT(out.misfit, PM_ONE / 2);
    for (int k = 0; k < 60; ++k) {
        observer_step(&b.state, &b.c, &in, &out);
    }
    EXPECT_EQ(out.misfit, PM_ONE); // the drive must not take this for a position
}

// A carrier of half the sampling frequency has two voltages, of which 1 kHz would always see the same.
TEST(ZeroVector, TheLargerVoltageOfACarrierCounts)
{
    Bench b(bench::kSpmLinear, params(), kTen, {0, 2}, 0.1);
    b.carrier_V = 8;
    EXPECT_GT(b.settled_deg(400), 4);
    EXPECT_EQ(b.state.zero_vector.missed, 0);
}

// METHODS addendum 4.6.2: four steps of the converter, by the parameter that asks for less; IPM-1000 has one.
TEST(ZeroVector, IsRefusedWhereTheConverterDoesNotSeeIt)
{
    drive_config_t c;
    drive_params_t p = params();
    p.speed_low = 3000;
    p.speed_high = 3600;
    drive_result_t r = result(p, &c);
    EXPECT_FALSE(r.ok);
    EXPECT_EQ(r.param, DRIVE_PARAM_observer);
    EXPECT_NE(std::string(r.reason).find("four steps"), std::string::npos);
    drive_params_default(&p);
    p.observer = OBSERVER_zero_vector;
    r = result(p, &c);
    EXPECT_FALSE(r.ok);
    EXPECT_EQ(r.param, DRIVE_PARAM_observer);
}

TEST(ZeroVector, IsRefusedWhereNoZeroVectorIsLeft)
{
    drive_config_t c;
    drive_params_t p = params();
    p.speed_max = 45000;
    const drive_result_t r = result(p, &c);
    EXPECT_FALSE(r.ok);
    EXPECT_EQ(r.param, DRIVE_PARAM_observer);
    EXPECT_NE(std::string(r.reason).find("speed_max"), std::string::npos);
}

} // namespace
