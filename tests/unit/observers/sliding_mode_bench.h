// Configuration of the sliding-mode observer from its header's formulas.
#pragma once

#include "tests/contract/bench.h"

namespace bench
{

// Constant gain for the conventional function, 1.15 times the EMF at 0.6 of the base speed, and a low-pass of
// 20 Hz for its ripple; the others follow the speed with a tenth of that at standstill, and 100 Hz do.
inline sliding_mode_config_t sliding_mode_config(const Machine &linear, const Base &b,
                                                 sliding_mode_function_t function, bool conventional)
{
    sliding_mode_config_t c = {};
    c.model = model(linear, b);
    c.function = function;
    const double k_max = 1.15 * 0.6 * linear.psi_m_Wb / b.psi_Wb();
    c.k_base = fixed(conventional ? k_max : 0.1 * k_max, 28);
    c.k_speed = fixed(conventional ? 0.0 : 2.0, 28);
    c.omega_min = fixed(0.02, 28);
    c.omega_tie = fixed(0.1, 28);
    c.k_lp = fixed(1 - std::exp(-2 * kPi * (conventional ? 20 : 100) * b.period_s), 32);
    c.slope = fixed(SLIDING_MODE_STEP / (b.period_s * b.omega_rad_s), 20);
    return c;
}

} // namespace bench
