// Zero-sequence voltages of two sets of windings with saliency and mutual inductance, behind an RC each: their differential
// equations in double precision, against what zero_pair.h says of the angle.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"
#include "tests/contract/observers.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::kJ;
using bench::kPi;
using bench::real;

constexpr double kBase_V = 60, kBase_A = 10, kPeriod_s = 1e-4, kFilter_s = 1e-4, kR_ohm = 1.1;
constexpr double kdL_0_H = 0.27e-3;
// With 1.1 ohm the voltage changes by 4 % within a period, of which the RC sees the end more (zero_sequence_test.cpp).
constexpr double kZero_deg = 0.1;
constexpr double kSlope = 0.03;
constexpr int kSettled = 1200;

struct Sets {
    double L_d_H = 2.5e-3, L_q_H = 4.1e-3, M_H = 0.99e-3; // kappa 0.24
};

drive_params_t parameters(const Sets &m, injection_id_t id, double f_Hz)
{
    drive_params_t p = {};
    drive_params_default(&p);
    const auto nano = [](double x) { return static_cast<int32_t>(std::lround(x * 1e9)); };
    p.pole_pairs = 5;
    p.R_s = 1100000;
    p.L_d = p.L_dh_rated = nano(m.L_d_H + m.M_H);
    p.L_q = p.L_q_rated = p.L_qh_rated = nano(m.L_q_H + m.M_H);
    p.L_dqh_rated = 0;
    p.M_d = p.M_q = nano(m.M_H);
    p.psi_m = 73400000;
    p.i_rated = 5200;
    p.f_pwm = 10000;
    p.v_full_scale = 60000;
    p.i_full_scale = 10000;
    p.v_dc_nominal = 40000;
    p.v_dc_min = 20000;
    p.v_dc_max = 50000;
    p.v_dc_derate = 45000;
    p.i_max = 6500;
    p.i_trip = 9000;
    p.i_open_loop = 2000;
    p.i_pulse = 4000;
    p.speed_max = 60000;
    p.speed_trip = 72000;
    p.speed_low = 4200;
    p.speed_high = 8400;
    p.J = 10000000;
    p.winding = 2;
    p.start_method = 3;
    p.injection = id;
    p.f_injection = static_cast<int32_t>(std::lround(f_Hz * 1e3));
    p.v_injection = 4000;
    p.dL_0 = nano(kdL_0_H);
    p.neutral_full_scale = 2000;
    p.neutral_filter = nano(kFilter_s);
    return p;
}

class Pair
{
  public:
    double theta = 0.4, error = 0;
    Complex i_dq_A = 0; // that both carry
    double second = 1;  // of what the second star point shows
    Sets m;

    Pair(const Sets &sets, const injection_config_t &c) : m(sets), config_(c)
    {
    }

    double after(int periods)
    {
        double eps = 0;
        for (int k = 0; k < periods; ++k) {
            eps = step();
        }
        return eps;
    }

    double step()
    {
        obs_in_t now = {};
        now.i = bench::ab((i_[0] + i_[1]) / 2.0 * std::polar(1.0, theta) / kBase_A);
        now.dir = bench::direction(theta - error);
        if (first_) {
            i_[0] = i_[1] = i_dq_A;
            injection_reset(&self_, &config_, &now);
        }
        obs_more_t more = {};
        more.v_zero = bench::fixed(v_V_[0] / kBase_V, 28);
        more.v_zero_second = bench::fixed(second * v_V_[1] / kBase_V, 28);
        more.apart = bench::ab((i_[0] - i_[1]) / 2.0 * std::polar(1.0, theta) / kBase_A);
        injection_in_t in = {};
        in.more = &more;
        in.i = now.i;
        in.dir = now.dir;
        in.ahead = {bench::fixed(std::cos(theta - error), 30), bench::fixed(std::sin(theta - error), 30)};
        injection_out_t out = {};
        injection_step(&self_, &config_, &in, &out);
        if (++count_ % 10 == 0) {
            obs_in_t slow = now;
            slow.i_dq = out.i;
            injection_slow(&self_, &config_, &slow);
        }
        run(first_ ? excitation_t{} : last_);
        last_ = out.carrier;
        first_ = false;
        return real(out.eps);
    }

  private:
    // Both sets in axes of the machine; psi_0 of the second in axes of its own, 30 degrees back.
    void run(const excitation_t &e)
    {
        constexpr int kSteps = 100;
        const Complex one = bench::complex(e.v) * kBase_V;
        const Complex u[2] = {one, one + bench::complex(e.apart) * kBase_V};
        for (int n = 0; n < kSteps; ++n) {
            Complex rate[2];
            Complex drop[2];
            for (int set = 0; set < 2; ++set) {
                drop[set] = u[set] * std::polar(1.0, -theta) - kR_ohm * (i_[set] - i_dq_A);
            }
            for (int set = 0; set < 2; ++set) {
                const Complex a = drop[set], b = drop[1 - set];
                const double D_d = m.L_d_H * m.L_d_H - m.M_H * m.M_H, D_q = m.L_q_H * m.L_q_H - m.M_H * m.M_H;
                rate[set] = {(m.L_d_H * a.real() - m.M_H * b.real()) / D_d,
                             (m.L_q_H * a.imag() - m.M_H * b.imag()) / D_q};
            }
            for (int set = 0; set < 2; ++set) {
                const double own = theta - set * kPi / 6;
                const Complex di = rate[set] * std::polar(1.0, own); // in the set's own stator axes
                const double v_V = -0.5 * kdL_0_H * (di * std::polar(1.0, 2 * own)).real();
                const double a = std::exp(-kPeriod_s / kSteps / kFilter_s);
                v_V_[set] = a * v_V_[set] + (1 - a) * v_V;
                i_[set] += rate[set] * (kPeriod_s / kSteps);
            }
        }
    }

    injection_t self_ = {};
    injection_config_t config_;
    excitation_t last_ = {};
    Complex i_[2] = {0, 0};
    double v_V_[2] = {0, 0};
    int count_ = 0;
    bool first_ = true;
};

injection_config_t config(const Sets &m, injection_id_t id, double f_Hz)
{
    const drive_params_t p = parameters(m, id, f_Hz);
    drive_config_t c = {};
    const drive_result_t result = drive_configure(&c, &p, PM_ALL);
    EXPECT_TRUE(result.ok) << drive_param_table[result.param].name << ' ' << result.reason;
    return c.position.injection;
}

struct Choice {
    injection_id_t id;
    double f_Hz;
};
const Choice kAll[] = {{INJECTION_zero_pair_anti_rotating, 5000},
                       {INJECTION_zero_pair_anti_rotating, 500},
                       {INJECTION_zero_pair_rotating, 500}};

TEST(ZeroPair, ErrorSignalIsZeroAtTheRotorWhateverSaliencyAndMutualInductance)
{
    for (const Choice &choice : kAll) {
        for (const Sets &m : {Sets{}, Sets{2.8e-3, 3.3e-3, 0.9e-3}, Sets{2.5e-3, 4.1e-3, 0}}) {
            for (const double theta : {0.0, 0.4, 1.3}) {
                Pair run(m, config(m, choice.id, choice.f_Hz));
                run.theta = theta;
                run.i_dq_A = {-1, 3};
                EXPECT_NEAR(run.after(kSettled) / kDegree, 0, kZero_deg)
                    << choice.id << ' ' << choice.f_Hz << ' ' << theta;
            }
        }
    }
}

TEST(ZeroPair, SlopeIsOne)
{
    for (const Choice &choice : kAll) {
        double eps[2];
        for (int n = 0; n < 2; ++n) {
            Pair run({}, config({}, choice.id, choice.f_Hz));
            run.error = n == 0 ? kDegree : -kDegree;
            eps[n] = run.after(kSettled);
        }
        EXPECT_NEAR((eps[0] - eps[1]) / (2 * kDegree), 1, kSlope) << choice.id << ' ' << choice.f_Hz;
    }
}

// Half of the answer is the second star point's.
TEST(ZeroPair, NeedsBothStars)
{
    for (const Choice &choice : kAll) {
        double eps[2];
        for (int n = 0; n < 2; ++n) {
            Pair run({}, config({}, choice.id, choice.f_Hz));
            run.error = n == 0 ? 3 * kDegree : -3 * kDegree;
            run.second = 0;
            eps[n] = run.after(kSettled);
        }
        EXPECT_GT(std::abs((eps[0] - eps[1]) / (6 * kDegree) - 1), 0.2) << choice.id << ' ' << choice.f_Hz;
    }
}

TEST(ZeroPair, IsRefusedWithoutTwoSetsOrInTheToldForm)
{
    drive_config_t c = {};
    drive_params_t p = parameters({}, INJECTION_zero_pair_rotating, 500);
    p.zero_form = 1;
    drive_result_t result = drive_configure(&c, &p, PM_ALL);
    EXPECT_EQ(result.param, DRIVE_PARAM_zero_form);
    p = parameters({}, INJECTION_zero_pair_rotating, 5000);
    EXPECT_EQ(drive_configure(&c, &p, PM_ALL).param, DRIVE_PARAM_f_injection);
    p = parameters({}, INJECTION_zero_pair_anti_rotating, 500);
    p.winding = 0;
    result = drive_configure(&c, &p, PM_ALL);
    EXPECT_EQ(result.param, DRIVE_PARAM_injection);
    EXPECT_STREQ(result.reason, "needs two sets of windings: winding 2");
    p = parameters({}, INJECTION_pulsating_square, 5000);
    p.winding = 0;
    p.mismatch_correction = MISMATCH_APART;
    result = drive_configure(&c, &p, PM_ALL);
    EXPECT_EQ(result.param, DRIVE_PARAM_mismatch_correction);
    EXPECT_STREQ(result.reason, "between two sets of windings: winding 2");
    p = parameters({}, INJECTION_zero_rotating, 500);
    result = drive_configure(&c, &p, PM_ALL);
    EXPECT_EQ(result.param, DRIVE_PARAM_injection);
    EXPECT_STREQ(result.reason, "reads one star: with two sets injection 12 or 13");
}

} // namespace
