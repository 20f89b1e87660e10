// What every position source owes drive/position.c, whatever its method: all observers of observers.def and
// the injections.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "firmware/math/filter.h"
#include "tests/contract/observers.h"
#include "tests/unit/math/samples.h"

namespace
{

using bench::Base;
using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::kJ;
using bench::Machine;
using bench::real;

// Halves and products round towards one side: mirrored inputs differ by a few LSB a period, gathered over the
// source's memory and raised by its gain (150 for the carrier's 0.016 of the base).
constexpr double kMirror = 5e-5;
// The direction of an angle is rounded to 2^-31 at every angle anew; through the same gain.
constexpr double kTurned = 5e-5;
// Currents within a zero vector come as codes, rounded at every angle anew: up to 1.3 along an axis, of a change of 67 (w psi_m 2x / L_q).
constexpr double kRounded = 0.02;
// Seeded at the truth. The run starts with a step of the sampled voltage and a mean current half a period
// old, of which 0.013 are left.
constexpr double kSeeded_rad = 0.02;
// A carrier begins with an offset of the current, I_p - I_n across d, that decays with L/R, 7 ms. A window of
// N T = 3 ms that begins with it takes (1 - exp(-N T R / L)) / (2 pi) of it for an answer, so the first eps errs by
// up to (I_p - I_n) / (2 I_n) 0.056, with I_n = 0.27 I_p.
constexpr double kStarted_rad = 0.075;
// eps is exact for small errors: its largest value after a change of the frame, when the old carrier is gone and
// a filter of 300 Hz has settled. A flux observer follows the frame from then on.
constexpr double kSlope = 0.05;
constexpr int kOld = 4, kSettle = 20, kWindows = 80;

const Machine kMachine = bench::kIpmLinear;
const Base kBase = bench::kIpmBase;
constexpr int kPeriods = 400;

// What a source is given, with the current in the middle of the period that has ended, and within the zero vectors at its
// ends: at the distance that the source asks for, behind the beginning and ahead of the end.
struct Seen : obs_in_t {
    pm_ab_t between, behind, ahead;
    pm_q_t v_zero;        // of the star point,
    pm_q_t v_zero_second; // and of that of a second set
    pm_ab_t apart;        // half of what the first set has more current than it
};

constexpr double kVdc_V = 300;
constexpr uint16_t kCounts = 8500; // of half a period

// Per-unit.
struct Carrier {
    Complex v = 0, split = 0;
    Complex apart = 0; // of a second set, beyond v
};

class Source
{
  public:
    virtual ~Source() = default;
    virtual void aim(double) // angle of the estimated frame where the next voltage acts
    {
    }
    virtual bool behind_filter() const // reads the answer to its carrier at the star point, behind the RC
    {
        return false;
    }
    virtual Carrier carrier() // of the coming period
    {
        return {};
    }

    // The instants within the zero vectors at both ends of a period, in periods: behind the first, ahead of the second.
    virtual std::pair<double, double> within() const
    {
        return {0, 0};
    }

    void reset(const obs_in_t &in)
    {
        asked_[0] = asked_[1] = 0;
        reset_with(in);
    }

    // A sample that was asked for is there two calls later.
    obs_out_t step(const Seen &seen)
    {
        pm_measure_t codes = {};
        const pm_ab_t &sample =
            asked_[1] == kCounts ? seen.between : (asked_[1] < kCounts ? seen.behind : seen.ahead);
        if (asked_[1] != 0) {
            bench::give_sample(&codes, 0, sample);
        }
        const pm_q_t v_dc = fixed(kVdc_V / kBase.v_V, 28);
        const obs_more_t more = {&codes,      {sample, {0, 0}},   &v_dc,
                                 seen.v_zero, seen.v_zero_second, seen.apart};
        obs_in_t in = seen;
        in.more = &more;
        asked_[1] = asked_[0];
        asked_[0] = 0;
        return step_with(in);
    }

  protected:
    virtual void reset_with(const obs_in_t &in) = 0;
    virtual obs_out_t step_with(const obs_in_t &in) = 0;
    void ask(uint32_t instant)
    {
        asked_[0] = instant;
    }

  private:
    uint32_t asked_[2] = {0, 0}; // timer counts; 0: nothing
};

class Observer : public Source
{
  public:
    explicit Observer(const observer_config_t &config) : config_(config)
    {
        std::memset(&state_, 0xa5, sizeof state_); // reset owes every member
    }
    std::pair<double, double> within() const override
    {
        if (config_.id != OBSERVER_zero_vector) {
            return {0, 0};
        }
        const double x = state_.zero_vector.x, later = config_.zero_vector.later;
        return {(x + later) / (2.0 * kCounts), (x - later) / (2.0 * kCounts)};
    }

  protected:
    void reset_with(const obs_in_t &in) override
    {
        observer_reset(&state_, &config_, &in);
        const obs_out_t none = observer_last(&state_, &config_);
        ASSERT_EQ(none.eps, 0);
        observer_slow(&state_, &config_, &in, &none, PM_ONE); // it leads
    }
    obs_out_t step_with(const obs_in_t &in) override
    {
        obs_out_t out;
        observer_step(&state_, &config_, &in, &out);
        const obs_out_t last = observer_last(&state_, &config_);
        EXPECT_EQ(std::memcmp(&out, &last, sizeof out), 0);
        if (config_.id == OBSERVER_zero_vector) {
            ask(zero_vector_sample_at(&state_.zero_vector));
        }
        return out;
    }

  private:
    observer_config_t config_;
    observer_t state_;
};

// A low-speed source: it adds its carrier, and 1 kHz is every tenth period.
class Injection : public Source
{
  public:
    explicit Injection(const injection_config_t &config) : config_(config)
    {
        std::memset(&state_, 0xa5, sizeof state_); // reset owes every member
    }
    void aim(double ahead_rad) override
    {
        ahead_ = {fixed(std::cos(ahead_rad), 30), fixed(std::sin(ahead_rad), 30)};
    }
    bool behind_filter() const override
    {
        return true;
    }
    Carrier carrier() override
    {
        return {bench::complex(carrier_.v) + made_, bench::complex(carrier_.split),
                bench::complex(carrier_.apart)};
    }

  protected:
    void reset_with(const obs_in_t &in) override
    {
        injection_reset(&state_, &config_, &in);
        const obs_out_t none = injection_last(&state_, &config_);
        ASSERT_EQ(none.eps, 0);
        injection_slow(&state_, &config_, &in);
        k_ = 0;
        i_ref_ = 0;
        low_ = 0;
    }
    obs_out_t step_with(const obs_in_t &in) override
    {
        if (++k_ % 10 == 0) {
            injection_slow(&state_, &config_, &in);
        }
        const injection_in_t given = {in.i, in.dir, in.omega, ahead_, in.more, in.v};
        injection_out_t out;
        injection_step(&state_, &config_, &given, &out);
        carrier_ = out.carrier;
        // a regulator that gives a carrier of its reference the voltage along d that the winding needs
        const double change_A = (real(carrier_.i_ref) - i_ref_) * kBase.i_A;
        i_ref_ = real(carrier_.i_ref);
        made_ = kMachine.L_d0_H / kBase.period_s * change_A / kBase.v_V *
                Complex(real(ahead_.cos, 30), real(ahead_.sin, 30));
        if (carrier_.sample_at[0] != 0) {
            ask(carrier_.sample_at[0]);
        }
        EXPECT_EQ(carrier_.sample_at[1], 0);
        const obs_out_t last = injection_last(&state_, &config_);
        EXPECT_EQ(out.eps, config_.smooth == 0 ? last.eps : pm_lp1(&low_, last.eps, config_.smooth));
        return last;
    }

  private:
    injection_config_t config_;
    injection_t state_;
    pm_half_dir_t ahead_ = {1 << 30, 0};
    pm_q_t low_ = 0; // what the low-pass makes of the source's error signal
    excitation_t carrier_ = {};
    Complex made_ = 0;
    double i_ref_ = 0;
    int k_ = 0;
};

struct Entry {
    std::string name;
    std::function<std::unique_ptr<Source>()> make;
    double omega_pu; // a speed at which it works
    unsigned traits;
    bool carrier; // a low-speed source
};

std::vector<Entry> sources()
{
    std::vector<Entry> all;
    for (const bench::InjectionCase &c : bench::injection_cases(kMachine, kBase)) {
        all.push_back({c.name, [c] { return std::make_unique<Injection>(c.config); }, 0.05, c.traits, true});
    }
    for (const bench::ObserverCase &c : bench::observer_cases(kMachine, kBase)) {
        all.push_back({c.name, [c] { return std::make_unique<Observer>(c.config); }, 0.4,
                       observer_traits(c.config.id), false});
    }
    return all;
}

// A linear machine at constant speed under steady voltage and the source's carrier, with the period of delay.
class Drive
{
  public:
    // error: how far the position that the source is given lags the rotor
    Drive(Source &source, double omega_pu, double i_q_A, double error_rad = 0, double start_rad = 0.3)
        : source_(source), omega_(omega_pu * kBase.omega_rad_s), error_(error_rad), theta_(start_rad)
    {
        const Complex i = kJ * i_q_A;
        const Complex psi = {kMachine.psi_m_Wb, kMachine.L_q0_H * i_q_A};
        v_dq_ = kMachine.R_ohm * i + kJ * omega_ * psi;
        psi_ = second_ = psi * std::polar(1.0, theta_);
        applying_ = commanded_ = v_dq_ * std::polar(1.0, theta_ + omega_ * kBase.period_s / 2);
        commanded_ *= std::polar(1.0, omega_ * kBase.period_s);
        i_past_ = current();
        source_.reset(seen());
    }

    Seen advance(obs_out_t *out)
    {
        run();
        const Seen in = seen();
        const double turn = 1.5 * omega_ * kBase.period_s;
        source_.aim(theta_ - error_ + turn);
        *out = source_.step(in);
        const Carrier carrier = source_.carrier();
        commanded_ = v_dq_ * std::polar(1.0, theta_ + turn) + carrier.v * kBase.v_V;
        split_commanded_ = carrier.split * kBase.v_V;
        apart_commanded_ = carrier.apart * kBase.v_V;
        return in;
    }

    // The source is told another angle from now on.
    void mistake(double error_rad)
    {
        error_ = error_rad;
    }

    // A recording that can be turned and mirrored.
    static std::vector<Seen> record(const Entry &e, double error_rad, double start_rad = 0.3)
    {
        const std::unique_ptr<Source> source = e.make();
        Drive drive(*source, e.omega_pu, 2.0, error_rad, start_rad);
        std::vector<Seen> all = {drive.seen()};
        for (int k = 0; k < kPeriods; ++k) {
            obs_out_t out;
            all.push_back(drive.advance(&out));
        }
        return all;
    }

  private:
    static Complex current(Complex psi_ab, double theta)
    {
        const Complex psi = psi_ab * std::polar(1.0, -theta);
        const Complex i = {(psi.real() - kMachine.psi_m_Wb) / kMachine.L_d0_H, psi.imag() / kMachine.L_q0_H};
        return i * std::polar(1.0, theta);
    }

    Complex current() const
    {
        return current(psi_, theta_);
    }

    Seen seen() const
    {
        const Complex i = 0.5 * (current() + current(second_, theta_)) / kBase.i_A;
        Seen in = {};
        in.apart = bench::ab(0.5 * (current() - current(second_, theta_)) / kBase.i_A);
        in.between = bench::ab(i_between_ / kBase.i_A);
        in.behind = bench::ab(i_behind_ / kBase.i_A);
        in.ahead = bench::ab(at_zero_voltage(-source_.within().second) / kBase.i_A);
        in.v = bench::ab(v_mean_ / kBase.v_V);
        const Complex i_dq_A = i * kBase.i_A * std::polar(1.0, -theta_);
        const double e_0 = bench::star_point_V(theta_, omega_, i_dq_A);
        const double e_02 = bench::star_point_V(theta_ - bench::kSecondSet_rad, omega_, i_dq_A);
        in.v_zero_second = fixed((source_.behind_filter() ? v_zero_second_ : e_02) / kBase.v_V, 28);
        in.v_zero = fixed((source_.behind_filter() ? v_zero_ : e_0) / kBase.v_V, 28);
        in.i = bench::ab(i);
        in.dir = bench::direction(theta_ - error_);
        in.omega = fixed(omega_ / kBase.omega_rad_s, 28);
        in.i_dq = bench::dq(0.5 * (i + i_past_ / kBase.i_A) * std::polar(1.0, error_ - theta_));
        return in;
    }

    // Around the present instant, in periods, the terminals being shorted there.
    Complex at_zero_voltage(double periods) const
    {
        Complex psi = psi_;
        double theta = theta_;
        const int n = 20;
        const double t = periods * kBase.period_s / n;
        for (int k = 0; k < n; ++k) {
            const Complex before = psi;
            const Complex i = current(psi, theta);
            psi -= t * kMachine.R_ohm * i;
            theta += omega_ * t;
            psi = before - t * kMachine.R_ohm * 0.5 * (i + current(psi, theta));
        }
        return current(psi, theta);
    }

    void run()
    {
        i_past_ = current();
        i_behind_ = at_zero_voltage(source_.within().first);
        const int n = 20;
        const double t = kBase.period_s / n;
        for (int k = 0; k < n; ++k) {
            const Complex v = applying_ + (2 * k < n ? split_ : -split_);
            const Complex before = psi_;
            const Complex i = current();
            const double psi_0 = bench::kNeutral.flux_Wb(i, theta_);
            if (2 * k == n) {
                i_between_ = i;
            }
            psi_ += t * (v - kMachine.R_ohm * i);
            theta_ += omega_ * t;
            psi_ = before + t * (v - kMachine.R_ohm * 0.5 * (i + current()));
            const double v_0 = (bench::kNeutral.flux_Wb(current(), theta_) - psi_0) / t;
            v_zero_ = bench::kNeutral.filtered(v_zero_, v_0, t);
            run_second(v + apart_, t);
        }
        v_mean_ = applying_;
        apart_ = apart_commanded_;
        applying_ = commanded_;
        split_ = split_commanded_;
    }

    // The second set, 30 degrees on, without mutual inductance; theta_ is that of the end of the step.
    void run_second(Complex v, double t)
    {
        const double before_rad = theta_ - omega_ * t;
        const Complex before = second_;
        const Complex i = current(second_, before_rad);
        second_ += t * (v - kMachine.R_ohm * i);
        second_ = before + t * (v - kMachine.R_ohm * 0.5 * (i + current(second_, theta_)));
        const auto flux_Wb = [](Complex i_A, double theta) {
            const Complex own = i_A * std::polar(1.0, -bench::kSecondSet_rad);
            return bench::kNeutral.flux_Wb(own, theta - bench::kSecondSet_rad);
        };
        const double v_0 = (flux_Wb(current(second_, theta_), theta_) - flux_Wb(i, before_rad)) / t;
        v_zero_second_ = bench::kNeutral.filtered(v_zero_second_, v_0, t);
    }

    Source &source_;
    double omega_, error_, theta_;
    Complex v_dq_, psi_, applying_, commanded_, v_mean_ = 0, i_past_ = 0;
    Complex split_ = 0, split_commanded_ = 0, i_between_ = 0, i_behind_ = 0;
    Complex second_, apart_ = 0, apart_commanded_ = 0;
    double v_zero_ = 0, v_zero_second_ = 0;
};

std::vector<obs_out_t> replay(const Entry &e, const std::vector<Seen> &in)
{
    const std::unique_ptr<Source> source = e.make();
    source->reset(in[0]);
    std::vector<obs_out_t> out;
    for (size_t k = 1; k < in.size(); ++k) {
        out.push_back(source->step(in[k]));
        source->carrier();
    }
    return out;
}

class ObserverContract : public ::testing::TestWithParam<Entry>
{
};

TEST_P(ObserverContract, ZeroInputGivesZero)
{
    const std::unique_ptr<Source> source = GetParam().make();
    Seen in = {};
    in.dir = bench::direction(0);
    source->reset(in);
    for (int k = 0; k < kPeriods; ++k) {
        const obs_out_t out = source->step(in);
        source->carrier();
        ASSERT_EQ(out.eps, 0) << k;
        ASSERT_EQ(out.vector.q, 0) << k;
        ASSERT_LE(std::abs(out.misfit), PM_ONE) << k;
    }
}

TEST_P(ObserverContract, SeededAtTheTruthShowsNoError)
{
    for (const double sign : {1.0, -1.0}) {
        for (const double start : {0.0, 2.0, -1.0}) {
            const std::unique_ptr<Source> source = GetParam().make();
            Drive drive(*source, sign * GetParam().omega_pu, 2.0, 0, start);
            for (int k = 0; k < kPeriods; ++k) {
                obs_out_t out;
                drive.advance(&out);
                ASSERT_NEAR(real(out.eps), 0, GetParam().carrier ? kStarted_rad : kSeeded_rad)
                    << start << ' ' << k;
            }
        }
    }
}

double sign_of(double x)
{
    return x < 0 ? -1 : 1;
}

double mean_of_a_sixth(Drive &drive, double omega_pu)
{
    const int periods =
        static_cast<int>(std::lround(bench::kPi / 3 / (omega_pu * kBase.omega_rad_s * kBase.period_s)));
    double sum = 0;
    for (int k = 0; k < periods; ++k) {
        obs_out_t out;
        drive.advance(&out);
        sum += real(out.eps);
    }
    return sum / periods;
}

// theta_rotor - theta, whichever way the rotor turns.
TEST_P(ObserverContract, ErrorSignalIsTheAngle)
{
    for (const double sign : {1.0, -1.0}) {
        for (const double error : {0.1, -0.1}) {
            const std::unique_ptr<Source> source = GetParam().make();
            Drive drive(*source, sign * GetParam().omega_pu, 0);
            obs_out_t out;
            for (int k = 0; k < 20; ++k) {
                drive.advance(&out);
            }
            const double before = real(out.eps);
            drive.mistake(error);
            double largest = 0;
            for (int k = 0; k < kSettle; ++k) {
                drive.advance(&out);
                largest = std::max(largest, k < kOld ? 0 : (real(out.eps) - before) * sign_of(error));
            }
            if (GetParam().carrier) { // a window holds both frames at first
                for (int k = 0; k < kWindows; ++k) {
                    drive.advance(&out);
                }
                largest = real(out.eps) * sign_of(error);
            }
            if ((GetParam().traits & SOURCE_IN_MEAN) != 0) {
                largest = sign_of(error) * mean_of_a_sixth(drive, GetParam().omega_pu);
            }
            EXPECT_NEAR(largest, std::abs(error), kSlope * std::abs(error) + kSeeded_rad);
        }
    }
}

// Mirrored at the alpha axis, everything turns the other way.
TEST_P(ObserverContract, MirroredInputGivesMirroredOutput)
{
    if ((GetParam().traits & SOURCE_ONE_WAY) != 0) {
        GTEST_SKIP() << "its carrier is not mirrored";
    }
    const std::vector<Seen> in = Drive::record(GetParam(), 0.15);
    std::vector<Seen> mirrored = in;
    for (Seen &x : mirrored) {
        x.v.beta = -x.v.beta;
        x.i.beta = -x.i.beta;
        x.between.beta = -x.between.beta;
        x.behind.beta = -x.behind.beta;
        x.ahead.beta = -x.ahead.beta;
        x.dir.sin = -x.dir.sin;
        x.omega = -x.omega;
        x.i_dq.q = -x.i_dq.q;
        x.v_zero_second = -x.v_zero_second; // a quarter of a cycle from the first
    }
    const std::vector<obs_out_t> a = replay(GetParam(), in), b = replay(GetParam(), mirrored);
    double largest = 0;
    for (size_t k = 0; k < a.size(); ++k) {
        ASSERT_NEAR(real(a[k].eps), -real(b[k].eps), kMirror) << k;
        ASSERT_NEAR(real(a[k].misfit), real(b[k].misfit), kMirror) << k;
        ASSERT_NEAR(real(a[k].vector.d), real(b[k].vector.d), kMirror) << k;
        ASSERT_NEAR(real(a[k].vector.q), -real(b[k].vector.q), kMirror) << k;
        largest = std::max(largest, std::abs(real(a[k].eps)));
    }
    EXPECT_GT(largest, 0.05); // there was something to mirror
}

// A source knows no absolute angle: the whole world turned gives the same, also where the angle passes 0 or 2
// pi.
TEST_P(ObserverContract, TurnedInputGivesTheSame)
{
    const bool third = (GetParam().traits & SOURCE_THIRD_TURN) != 0;
    if ((GetParam().traits & SOURCE_STATOR) != 0 && !third) {
        GTEST_SKIP() << "its carrier does not turn with the world";
    }
    const double exact = GetParam().name == "zero_vector" ? kRounded : kTurned;
    const std::vector<Seen> in = Drive::record(GetParam(), 0.15);
    const std::vector<obs_out_t> a = replay(GetParam(), in);
    const std::vector<double> any = {-0.3, -0.3 - 1e-6, -1.3, bench::kPi / 2, bench::kPi, 3.0};
    const std::vector<double> thirds = {2 * bench::kPi / 3,
                                        -2 * bench::kPi / 3}; // the star point sees no other
    for (const double turn : third ? thirds : any) {
        std::vector<Seen> turned = in;
        for (Seen &x : turned) {
            x.v = bench::ab(bench::complex(x.v) * std::polar(1.0, turn));
            x.i = bench::ab(bench::complex(x.i) * std::polar(1.0, turn));
            for (pm_ab_t *i : {&x.between, &x.behind, &x.ahead}) {
                *i = bench::ab(bench::complex(*i) * std::polar(1.0, turn));
            }
            const double angle = std::atan2(real(x.dir.sin, 31), real(x.dir.cos, 31));
            x.dir = bench::direction(angle + turn);
        }
        const std::vector<obs_out_t> b = replay(GetParam(), turned);
        for (size_t k = 0; k < a.size(); ++k) {
            ASSERT_NEAR(real(a[k].eps), real(b[k].eps), exact) << turn << ' ' << k;
            ASSERT_NEAR(real(a[k].misfit), real(b[k].misfit), exact) << turn << ' ' << k;
        }
    }
}

// The position of 0 and of 2 pi k are the same bits once they are turns of 2^32.
TEST_P(ObserverContract, WholeTurnsAreNothing)
{
    const std::vector<obs_out_t> a = replay(GetParam(), Drive::record(GetParam(), 0.15, 0.02));
    for (const int turns : {1, -1, 1000}) {
        const std::vector<obs_out_t> b =
            replay(GetParam(), Drive::record(GetParam(), 0.15, 0.02 + turns * 2 * bench::kPi));
        for (size_t k = 0; k < a.size(); ++k) {
            ASSERT_NEAR(real(a[k].eps), real(b[k].eps), kTurned) << turns << ' ' << k;
        }
    }
}

TEST_P(ObserverContract, SameInputSameBits)
{
    const std::vector<Seen> in = Drive::record(GetParam(), -0.2);
    const std::unique_ptr<Source> used = GetParam().make();
    // one that has worked on something else before is as good as a new one
    const std::vector<Seen> other = Drive::record(GetParam(), 0.4, 2.0);
    used->reset(other[0]);
    for (size_t k = 1; k < other.size(); ++k) {
        used->step(other[k]);
        used->carrier();
    }
    used->reset(in[0]);
    const std::vector<obs_out_t> a = replay(GetParam(), in);
    for (size_t k = 1; k < in.size(); ++k) {
        const obs_out_t b = used->step(in[k]);
        used->carrier();
        ASSERT_EQ(std::memcmp(&a[k - 1], &b, sizeof b), 0) << k;
    }
}

void expect_limits(const obs_out_t &out)
{
    ASSERT_LE(std::abs(real(out.eps)), 1.0);
    ASSERT_LE(std::abs(real(out.misfit)), 1.0);
}

// Every field at the ends of what converters and the loop can give: a vector of +-1 per phase is 4/3 long,
// the link's hexagon 2/3, the speed ends at 1.25. The period after, the other end.
TEST_P(ObserverContract, CornersOfTheConvertersAreHarmless)
{
    samples::Random random;
    for (int n = 0; n < 20000; ++n) {
        const std::unique_ptr<Source> source = GetParam().make();
        Seen in[4];
        for (Seen &x : in) {
            const auto end = [&random](double limit) { return random.word() < 0 ? -limit : limit; };
            x.v = bench::ab({end(2.0 / 3), end(2.0 / 3)});
            x.i = bench::ab({end(4.0 / 3), end(4.0 / 3)});
            x.dir = bench::direction(random.within(-4, 4));
            x.omega = fixed(end(1.25), 28);
            x.i_dq = bench::dq({end(4.0 / 3), end(4.0 / 3)});
            for (pm_ab_t *i : {&x.between, &x.behind, &x.ahead}) {
                *i = bench::ab({end(4.0 / 3), end(4.0 / 3)});
            }
            x.v_zero = fixed(end(1), 28);
            x.v_zero_second = fixed(end(1), 28);
            x.apart = bench::ab({end(4.0 / 3), end(4.0 / 3)});
        }
        source->reset(in[0]);
        for (int k = 0; k < 12; ++k) {
            expect_limits(source->step(in[k % 4]));
            source->carrier();
        }
    }
}

// A voltage that stays, at standstill, with nothing to hold the source: what a locked rotor with a lost
// position does until it is noticed (t_lost, up to 1 s).
TEST_P(ObserverContract, ConstantExtremesForASecondAreHarmless)
{
    const std::unique_ptr<Source> source = GetParam().make();
    Seen in = {};
    in.v = bench::ab({2.0 / 3, 0});
    in.dir = bench::direction(0);
    source->reset(in);
    for (int k = 0; k < 10000; ++k) {
        expect_limits(source->step(in));
        source->carrier();
    }
}

INSTANTIATE_TEST_SUITE_P(Sources, ObserverContract, ::testing::ValuesIn(sources()),
                         [](const auto &p) { return std::string(p.param.name); });

} // namespace
