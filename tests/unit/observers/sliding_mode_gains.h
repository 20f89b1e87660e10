// Gains of the sliding-mode observer.
#pragma once

#include "tests/contract/gains.h"

namespace gains
{

inline Names must_be_positive(const sliding_mode_config_t &s)
{
    return {{"sliding t_s", s.model.t_s},
            {"sliding k_lp", s.k_lp},
            {"sliding slope", s.slope},
            {"sliding omega_min", s.omega_min}};
}

} // namespace gains
