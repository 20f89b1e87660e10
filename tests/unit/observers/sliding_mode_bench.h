// Configuration of the sliding-mode observer from its header's formulas.
#pragma once

#include "tests/contract/bench.h"

namespace bench
{

inline observer_model_t observer_model(const Machine &m, const Base &b, double L_d_H, double L_q_H,
                                       double L_q2_pu = 0)
{
    observer_model_t c = {};
    c.R = fixed(m.R_ohm / b.impedance_ohm(), 28);
    c.L_d = fixed(L_d_H / b.inductance_H(), 28);
    c.L_q = fixed(L_q_H / b.inductance_H(), 28);
    c.L_q2 = fixed(L_q2_pu, 28);
    c.psi_m = fixed(m.psi_m_Wb / b.psi_Wb(), 28);
    c.t_s = fixed(b.period_s * b.omega_rad_s, 32);
    return c;
}

// Constant gain for the conventional function, 1.15 times the EMF at 0.6 of the base speed, and a low-pass of
// 20 Hz for its ripple; the others follow the speed with a tenth of that at standstill, and 100 Hz do.
inline sliding_mode_config_t sliding_mode_config(const Machine &linear, const Base &b,
                                                 sliding_mode_function_t function, bool conventional)
{
    sliding_mode_config_t c = {};
    c.model = observer_model(linear, b, linear.L_d0_H, linear.L_q0_H);
    c.function = function;
    const double k_max = 1.15 * 0.6 * linear.psi_m_Wb / b.psi_Wb();
    c.k_base = fixed(conventional ? k_max : 0.1 * k_max, 28);
    c.k_speed = fixed(conventional ? 0.0 : 2.0, 28);
    c.omega_min = fixed(0.02, 28);
    c.k_lp = fixed(1 - std::exp(-2 * kPi * (conventional ? 20 : 100) * b.period_s), 32);
    c.slope = fixed(SLIDING_MODE_STEP / (b.period_s * b.omega_rad_s), 20);
    return c;
}

} // namespace bench
