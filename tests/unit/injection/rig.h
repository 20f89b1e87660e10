// A linear machine with resistance, from its differential equation in the rotor frame, under a low-speed source that is
// given a position: one that is imposed, or that of a position loop.
#pragma once

#include <cmath>

#include "firmware/math/filter.h"
#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"
#include "tests/contract/observers.h"

namespace rig
{

using bench::Base;
using bench::Complex;
using bench::kJ;
using bench::Machine;
using bench::real;

const Base kBase = bench::kIpmBase;

// As the drive makes it for the machine, 35 V and 500 Hz, and a resistance that need not be the machine's.
inline injection_config_t config(injection_id_t id, double R_told_ohm, bool post_comp,
                                 const Machine &m = bench::kIpmLinear)
{
    drive_params_t p = bench::parameters(m, kBase);
    p.injection = id;
    p.start_method = 1;
    p.v_injection = 35000;
    p.R_s = static_cast<int32_t>(std::lround(R_told_ohm * 1e6));
    p.injection_post_comp = post_comp ? 1 : 0;
    drive_config_t c = {};
    EXPECT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
    return c.position.injection;
}

struct Answer {
    double eps, misfit;
    Complex vector;
    Complex i_A; // the current that the source calls fundamental, estimated frame
};

// The loop of drive/position.c at standstill: a double pole with damping 0.9.
struct Loop {
    double speed = 0;

    // In a period.
    double turn(double bandwidth_Hz, double eps, double period_s)
    {
        const double w = 2 * bench::kPi * bandwidth_Hz;
        speed += w * w * eps * period_s;
        return (speed + 1.8 * w * eps) * period_s;
    }
};

class Run
{
  public:
    double R_ohm = 6;
    double theta = 0.4, error = 0; // electrical; the position given is theta - error
    double omega = 0;              // electrical, 1/s
    Complex i_dq_A = 0;            // fundamental, kept by a steady voltage
    double loop_Hz = 0;            // of a position loop that moves `error`; 0: imposed
    Complex disturbance_V = 0;     // in the stator, that nobody knows of
    double L_c0_H = 0;             // cross-coupling of the zero sequence
    double dL_0_d_H_A = 0, dL_0_q_H_A2 = 0, L_c0_q_H_A = 0; // what of it moves with the current
    bool lead = true;                                       // to the star point
    bool sampled = true;                                    // samples that are asked for are taken
    std::vector<excitation_t> given;

    explicit Run(const injection_config_t &c) : config_(c)
    {
    }

    Answer after(int periods)
    {
        Answer a = {};
        for (int k = 0; k < periods; ++k) {
            a = step();
        }
        return a;
    }

    Answer step()
    {
        if (given.empty()) {
            i_ = i_dq_A;
            const obs_in_t first = seen(i_ * std::polar(1.0, error));
            injection_reset(&self_, &config_, &first);
            injection_slow(&self_, &config_, &first);
        }
        const obs_in_t now = seen(0);
        const double ahead = theta - error + 1.5 * omega * kBase.period_s;
        pm_measure_t codes = {};
        codes.sampled = sampled && given.size() > 1 && given[given.size() - 2].sample_at[0] != 0 ? 1 : 0;
        const obs_more_t more = {&codes,  {bench::ab(between_ / kBase.i_A), {0, 0}},
                                 nullptr, lead ? bench::fixed(v_zero_V_ / kBase.v_V, 28) : 0,
                                 0,       {0, 0}};
        injection_in_t in = {};
        in.more = &more;
        in.i = now.i;
        in.dir = now.dir;
        in.omega = now.omega;
        in.ahead = {bench::fixed(std::cos(ahead), 30), bench::fixed(std::sin(ahead), 30)};
        injection_out_t out;
        injection_step(&self_, &config_, &in, &out);
        if (given.size() % 10 == 9) {
            obs_in_t slow = now;
            slow.i_dq = out.i;
            injection_slow(&self_, &config_, &slow);
        }
        const obs_out_t last = injection_last(&self_, &config_);
        EXPECT_EQ(out.eps, config_.smooth == 0 ? last.eps : pm_lp1(&low_, last.eps, config_.smooth));
        const Answer a = {real(last.eps), real(last.misfit), bench::complex(last.vector) * kBase.i_A,
                          bench::complex(out.i) * kBase.i_A};
        given.push_back(out.carrier);
        run(given.size() > 1 ? given[given.size() - 2] : excitation_t{});
        error -= loop_.turn(loop_Hz, real(out.eps), kBase.period_s);
        return a;
    }

    // Periods until the error stays below the limit, of so many.
    int settling(int periods, double limit_rad)
    {
        int last = 0;
        for (int k = 0; k < periods; ++k) {
            step();
            if (std::abs(std::remainder(error, bench::kPi)) > limit_rad) {
                last = k + 1;
            }
        }
        return last;
    }

  private:
    obs_in_t seen(Complex i_dq) const
    {
        obs_in_t in = {};
        in.i = bench::ab(i_ * std::polar(1.0, theta) / kBase.i_A);
        in.dir = bench::direction(theta - error);
        in.omega = bench::fixed(omega / kBase.omega_rad_s, 28);
        in.i_dq = bench::dq(i_dq / kBase.i_A);
        return in;
    }

    // A period with the excitation of the step before.
    void run(const excitation_t &e)
    {
        const Machine &m = bench::kIpmLinear;
        const Complex steady =
            R_ohm * i_dq_A +
            kJ * omega * Complex(m.L_d0_H * i_dq_A.real() + m.psi_m_Wb, m.L_q0_H * i_dq_A.imag());
        const int n = 50;
        const double t = kBase.period_s / n;
        for (int k = 0; k < n; ++k) {
            if (2 * k == n) {
                between_ = i_ * std::polar(1.0, theta);
            }
            const double psi_0 = flux_zero();
            const Complex added = bench::complex(e.v) + (2 * k < n ? 1.0 : -1.0) * bench::complex(e.split);
            const Complex v =
                steady + (added * kBase.v_V + disturbance_V) * std::polar(1.0, -theta - omega * t / 2);
            const Complex psi = {m.L_d0_H * i_.real() + m.psi_m_Wb, m.L_q0_H * i_.imag()};
            const Complex dpsi = v - R_ohm * i_ - kJ * omega * psi;
            i_ += t * Complex(dpsi.real() / m.L_d0_H, dpsi.imag() / m.L_q0_H);
            theta += omega * t;
            v_zero_V_ = bench::kNeutral.filtered(v_zero_V_, (flux_zero() - psi_0) / t, t);
        }
    }

    // METHODS.md 0.2 E3, at the star point.
    double flux_zero() const
    {
        const Complex u = i_ * std::polar(1.0, 3 * theta);
        const Complex c(dL_0_d_H_A * i_.real() + dL_0_q_H_A2 * i_.imag() * i_.imag(),
                        -L_c0_H - L_c0_q_H_A * i_.imag());
        return bench::kNeutral.flux_Wb(i_ * std::polar(1.0, theta), theta) - 0.5 * (c * u).real();
    }

    injection_config_t config_;
    injection_t self_ = {};
    pm_q_t low_ = 0; // what the low-pass makes of the source's error signal
    Complex i_ = 0, between_ = 0;
    Loop loop_;
    double v_zero_V_ = 0;
};

} // namespace rig
