// Configuration of the EMF observers from the formulas of their header.
#pragma once

#include "tests/contract/bench.h"

namespace bench
{

// observers/emf.h. R follows in 64 ms at i_rated, amplitude filter 100 ms.
inline emf_config_t emf_config(const Machine &m, const Base &b, double L_d_H, double L_q_H,
                               double L_q_rated_H, double i_rated_A, double bandwidth_Hz = 300)
{
    const double i_rated = i_rated_A / b.i_A;
    const double w = 2 * kPi * bandwidth_Hz * b.period_s, k = w / (1 + w);
    emf_config_t c = {};
    c.model = model(m, b, L_d_H, L_q_H, L_q_rated_H, i_rated_A);
    c.resistance.k = fixed(1.0 / 64 / (i_rated * i_rated), 26);
    c.resistance.omega = PM_Q(0.06);
    c.resistance.drop = fixed(real(c.model.R) * i_rated / 8, 28);
    c.k_filter = fixed(k, 32);
    c.lag = fixed((2 - k) / k, 26);
    c.rate = fixed(1 / (b.period_s * b.omega_rad_s), 20);
    c.slow_rate = fixed(1 / (1e-3 * b.omega_rad_s), 26);
    c.slow_step = fixed(1e-3 * b.omega_rad_s, 28);
    c.speed_lag = fixed(1.8 / (2 * kPi * 25 * 1e-3), 26);
    c.omega_min = PM_Q(0.02);
    c.omega_tied = fixed(300 / b.omega_rad_s, 28);
    return c;
}

inline emf_config_t emf_config(const Machine &linear, const Base &b)
{
    return emf_config(linear, b, linear.L_d0_H, linear.L_q0_H, linear.L_q0_H, 4.0);
}

} // namespace bench
