// Configuration of the flux observers from the formulas of their header.
#pragma once

#include "tests/contract/bench.h"

namespace bench
{

// observers/active_flux.h. Tie 300 rad/s, R follows in 8 ms at i_rated, amplitude filter 100 ms.
inline active_flux_config_t flux_config(const Machine &m, const Base &b, double L_d_H, double L_q_H,
                                        double L_q_rated_H, double i_rated_A, double g = 0.5)
{
    const double step = b.period_s * b.omega_rad_s;
    const double i_rated = i_rated_A / b.i_A;
    active_flux_config_t c = {};
    c.model = model(m, b, L_d_H, L_q_H, L_q_rated_H, i_rated_A);
    c.g = fixed(g * step, 32);
    c.k_seed = fixed(300 * b.period_s, 32);
    c.resistance.k = fixed(300.0 / 8 / (b.omega_rad_s * i_rated * i_rated), 26);
    c.resistance.omega = PM_Q(0.06);
    c.resistance.drop = fixed(real(c.model.R) * i_rated / 8, 28);
    return c;
}

inline active_flux_config_t flux_config(const Machine &linear, const Base &b, double g = 0.5)
{
    return flux_config(linear, b, linear.L_d0_H, linear.L_q0_H, linear.L_q0_H, 4.0, g);
}

// Not tied to the position any more, as after a slow step with weight.
inline void lead(active_flux_t &state)
{
    state.k_d -= state.k_q;
    state.k_q = 0;
}

} // namespace bench
