// Gains of the three EMF observers, which have one configuration.
#pragma once

#include "tests/contract/gains.h"

namespace gains
{

inline Names must_be_positive(const emf_config_t &e)
{
    return {{"EMF R", e.model.R},           {"EMF k_filter", e.k_filter},   {"EMF lag", e.lag},
            {"EMF rate", e.rate},           {"EMF slow_rate", e.slow_rate}, {"EMF slow_step", e.slow_step},
            {"EMF speed_lag", e.speed_lag}, {"EMF omega_min", e.omega_min}, {"EMF omega_tied", e.omega_tied}};
}

} // namespace gains
