// The winding of a linear machine at constant speed, with the delay of a converter: current control in closed loop.
#pragma once

#include <complex>
#include <deque>

#include "tests/contract/bench.h"

namespace bench
{

// The winding under a stationary voltage, at constant speed, in per-unit volts and amperes.
class Winding
{
  public:
    Winding(const Machine &machine, const Base &base, double omega_pu)
        : m_(machine), b_(base), omega_(omega_pu * base.omega_rad_s)
    {
    }

    // A voltage commanded at k, in the frame of the middle of [k+1, k+2), acts there.
    void run(Complex v_dq_pu)
    {
        const double t = b_.period_s;
        queue_.push_back(v_dq_pu * b_.v_V * std::polar(1.0, theta_ + 1.5 * omega_ * t));
        const Complex emf = kJ * omega_ * m_.psi_m_Wb * std::polar(1.0, theta_ + 0.5 * omega_ * t);
        const Complex v = queue_.size() > 1 ? queue_.front() : emf; // at no current
        if (queue_.size() > 1) {
            queue_.pop_front();
        }
        const int n = 40;
        for (int k = 0; k < n; ++k) {
            const Complex half = i_A_ + 0.5 * t / n * slope(v, i_A_, theta_);
            i_A_ += t / n * slope(v, half, theta_ + 0.5 * omega_ * t / n);
            theta_ += omega_ * t / n;
        }
    }

    Complex i() const // per-unit, in the rotor frame
    {
        return i_A_ / b_.i_A;
    }

  private:
    Complex slope(Complex v_ab, Complex i, double theta) const
    {
        const Complex v = v_ab * std::polar(1.0, -theta);
        const Complex psi = {m_.psi_m_Wb + m_.L_d0_H * i.real(), m_.L_q0_H * i.imag()};
        const Complex s = v - m_.R_ohm * i - kJ * omega_ * psi;
        return {s.real() / m_.L_d0_H, s.imag() / m_.L_q0_H};
    }

    Machine m_;
    Base b_;
    double omega_, theta_ = 0;
    Complex i_A_ = 0;
    std::deque<Complex> queue_;
};

} // namespace bench
