// A machine in double precision and SI units, the bases of a drive, and the per-unit configurations that the
// formulas in the headers give for them: written from METHODS.md, so that no number comes from config.c.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>

#include "tests/contract/firmware.h"

namespace bench
{

using Complex = std::complex<double>; // d + jq, or alpha + j beta

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;
constexpr Complex kJ{0, 1};

inline int32_t fixed(double x, int bits)
{
    return static_cast<int32_t>(std::llround(std::ldexp(x, bits)));
}

inline double real(int32_t x, int bits = PM_Q_BITS)
{
    return std::ldexp(static_cast<double>(x), -bits);
}

inline pm_angle_t turns(double rad)
{
    return static_cast<pm_angle_t>(std::llround(std::ldexp(rad / (2 * kPi), 32)));
}

inline double rad(pm_angle_t angle)
{
    return std::ldexp(static_cast<double>(static_cast<int32_t>(angle)), -32) * 2 * kPi;
}

inline double wrapped(double angle_rad)
{
    return std::remainder(angle_rad, 2 * kPi);
}

inline pm_dir_t direction(double angle_rad)
{
    return {static_cast<pm_unit_t>(std::lround(std::cos(angle_rad) * PM_UNIT_MAX)),
            static_cast<pm_unit_t>(std::lround(std::sin(angle_rad) * PM_UNIT_MAX))};
}

inline pm_ab_t ab(Complex x)
{
    return {fixed(x.real(), PM_Q_BITS), fixed(x.imag(), PM_Q_BITS)};
}

// A further sample, as a converter of 16 bits gives it.
inline void give_sample(pm_measure_t *measured, unsigned n, pm_ab_t i)
{
    const double a = std::ldexp(i.alpha, -PM_Q_BITS), b = std::ldexp(i.beta, -PM_Q_BITS) * std::sqrt(3.0);
    const double phase[PM_LEGS] = {a, (b - a) / 2, (-b - a) / 2};
    for (int leg = 0; leg < PM_LEGS; ++leg) {
        const double code = std::round(32768 * (1 + phase[leg]));
        measured->i_sample[n][leg] = static_cast<uint16_t>(std::fmin(std::fmax(code, 0), UINT16_MAX));
    }
    measured->sampled = static_cast<uint16_t>(measured->sampled | 1U << n);
}

inline pm_dq_t dq(Complex x)
{
    return {fixed(x.real(), PM_Q_BITS), fixed(x.imag(), PM_Q_BITS)};
}

inline Complex complex(pm_ab_t x)
{
    return {real(x.alpha), real(x.beta)};
}

inline Complex complex(pm_dq_t x)
{
    return {real(x.d), real(x.q)};
}

// METHODS.md 0.2 E1: i_d = psi_d/L_d0 + c psi_d |psi|^4 - i_f, i_q likewise without the magnet.
struct Machine {
    double R_ohm, L_d0_H, L_q0_H, c_A_Wb5, psi_m_Wb;
    int pole_pairs;

    Complex current_A(Complex psi) const
    {
        const double sat = c_A_Wb5 * std::norm(psi) * std::norm(psi);
        const double i_f = psi_m_Wb / L_d0_H + c_A_Wb5 * std::pow(psi_m_Wb, 5);
        return {psi.real() * (1 / L_d0_H + sat) - i_f, psi.imag() * (1 / L_q0_H + sat)};
    }

    // Incremental inductances at a flux: the inverse of di/dpsi.
    struct Tangent {
        double L_d_H, L_q_H, L_dq_H;
    };

    Tangent tangent(Complex psi) const
    {
        const double p2 = std::norm(psi);
        const double d = 1 / L_d0_H + c_A_Wb5 * p2 * (p2 + 4 * psi.real() * psi.real());
        const double q = 1 / L_q0_H + c_A_Wb5 * p2 * (p2 + 4 * psi.imag() * psi.imag());
        const double dq = 4 * c_A_Wb5 * p2 * psi.real() * psi.imag();
        const double D = d * q - dq * dq;
        return {q / D, d / D, -dq / D};
    }

    Complex flux_Wb(Complex i_A) const
    {
        Complex psi = {psi_m_Wb + L_d0_H * i_A.real(), L_q0_H * i_A.imag()};
        for (int n = 0; n < 100; ++n) { // Newton, halved: the map is stiff far out
            const Complex e = i_A - current_A(psi);
            const Tangent t = tangent(psi);
            psi += 0.7 * Complex{t.L_d_H * e.real() + t.L_dq_H * e.imag(),
                                 t.L_dq_H * e.real() + t.L_q_H * e.imag()};
        }
        return psi;
    }
};

// METHODS.md 14.
constexpr Machine kIpm1000 = {6.0, 46.3e-3, 76.9e-3, 105.0, 0.236, 3};
constexpr Machine kSpm400 = {0.373, 3.385e-3, 3.385e-3, 2.09e5, 77.6e-3, 5};
// The same without saturation, at their inductances without load.
constexpr Machine kIpmLinear = {6.0, 43.0e-3, 75.0e-3, 0.0, 0.236, 3};
constexpr Machine kSpmLinear = {0.373, 3.24e-3, 3.24e-3, 0.0, 77.6e-3, 5};

// What the star point shows of a machine, METHODS.md 0.2 E3, and its channel.
struct Neutral {
    double dL_0_H, full_scale_V, filter_s;

    double flux_Wb(Complex i_A, double theta_rad) const
    {
        return -0.5 * dL_0_H * (i_A * std::polar(1.0, 2 * theta_rad)).real();
    }
    // The RC after a time with a constant voltage.
    double filtered(double v_V, double input_V, double time_s) const
    {
        return input_V + (v_V - input_V) * std::exp(-time_s / filter_s);
    }
};

constexpr Neutral kNeutral = {2.0e-3, 10, 100e-6};

struct Base {
    double v_V, i_A, omega_rad_s, period_s;

    double psi_Wb() const
    {
        return v_V / omega_rad_s;
    }
    double impedance_ohm() const
    {
        return v_V / i_A;
    }
    double inductance_H() const
    {
        return psi_Wb() / i_A;
    }
};

constexpr Base kIpmBase = {450, 10, 540, 100e-6};
constexpr Base kSpmBase = {60, 10, 360, 100e-6};

// observers/model.h.
inline observer_model_t model(const Machine &m, const Base &b, double L_d_H, double L_q_H, double L_q_rated_H,
                              double i_rated_A)
{
    const double i_rated = i_rated_A / b.i_A;
    observer_model_t c = {};
    c.R = fixed(m.R_ohm / b.impedance_ohm(), 28);
    c.L_d = fixed(L_d_H / b.inductance_H(), 28);
    c.L_q = fixed(L_q_H / b.inductance_H(), 28);
    c.L_q2 = fixed((L_q_rated_H - L_q_H) / b.inductance_H() / (i_rated * i_rated), 28);
    c.psi_m = fixed(m.psi_m_Wb / b.psi_Wb(), 28);
    c.t_s = fixed(b.period_s * b.omega_rad_s, 32);
    return c;
}

inline observer_model_t model(const Machine &linear, const Base &b)
{
    return model(linear, b, linear.L_d0_H, linear.L_q0_H, linear.L_q0_H, 4.0);
}

// A rotor at constant speed with constant currents in its frame: what an observer would measure.
class Rotation
{
  public:
    Rotation(const Machine &m, const Base &b, double omega_pu, Complex i_A, double start_rad = 0)
        : theta_rad(start_rad), omega_rad_s(omega_pu * b.omega_rad_s), i_dq_A(i_A), m_(m), b_(b)
    {
        i_A_ = i_dq_A * std::polar(1.0, theta_rad);
        psi_dq_Wb_ = m.flux_Wb(i_dq_A);
        psi_Wb_ = psi_dq_Wb_ * std::polar(1.0, theta_rad);
    }

    // To the next sample. The mean voltage is exact: change of flux and resistive drop of the mean current.
    void advance()
    {
        const Complex i_past = i_A_;
        const Complex psi_past = psi_Wb_;
        const double turn = omega_rad_s * b_.period_s;
        theta_rad += turn;
        i_A_ = i_dq_A * std::polar(1.0, theta_rad);
        psi_Wb_ = psi_dq_Wb_ * std::polar(1.0, theta_rad);
        const Complex i_mean = std::abs(turn) < 1e-9 ? i_A_ : (i_A_ - i_past) / (kJ * turn);
        v_V_ = (psi_Wb_ - psi_past) / b_.period_s + m_.R_ohm * i_mean;
    }

    // Measured with an error that does not turn, seen from a position that the caller believes in.
    obs_in_t seen(double theta_hat_rad, double omega_hat_rad_s, Complex v_error_V = 0,
                  Complex i_error_A = 0) const
    {
        const Complex i = (i_A_ + i_error_A) / b_.i_A;
        obs_in_t in = {};
        in.v = ab((v_V_ + v_error_V) / b_.v_V);
        in.i = ab(i);
        in.dir = direction(theta_hat_rad);
        in.omega = fixed(omega_hat_rad_s / b_.omega_rad_s, 28);
        in.i_dq = dq(i * std::polar(1.0, -theta_hat_rad));
        return in;
    }

    double theta_rad, omega_rad_s;
    const Complex i_dq_A;

  private:
    Machine m_;
    Base b_;
    Complex i_A_, psi_dq_Wb_, psi_Wb_, v_V_ = 0;
};

// METHODS.md 2.4.2, in the order of firmware/math/pll.h.
struct Loop {
    double theta_rad = 0, omega_rad_s = 0;
    double w_n_rad_s = 2 * kPi * 25, zeta = 0.9;

    void predict(double period_s)
    {
        theta_rad += omega_rad_s * period_s;
    }
    void correct(double eps_rad, double period_s)
    {
        theta_rad += 2 * zeta * w_n_rad_s * period_s * eps_rad;
        omega_rad_s += w_n_rad_s * w_n_rad_s * period_s * eps_rad;
    }
};

} // namespace bench
