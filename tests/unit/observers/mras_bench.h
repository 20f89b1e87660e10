// Per-unit configuration of observers/mras.h, as its formulas say.
#pragma once

#include "tests/contract/bench.h"

namespace bench
{

inline mras_config_t mras_config(const Machine &m, const Base &b, double lag_rad = 1,
                                 double bandwidth_rad_s = 2 * kPi * 50)
{
    mras_config_t c = {};
    c.model = model(m, b);
    c.k = fixed(bandwidth_rad_s * b.period_s, 32);
    c.emf_min = fixed(0.02 * m.psi_m_Wb / b.psi_Wb(), 28);
    c.turn =
        fixed(std::min(0.499, 10 * b.period_s * b.omega_rad_s / lag_rad), 32); // slow steps of 10 periods
    return c;
}

} // namespace bench
