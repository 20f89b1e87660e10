// Gains of the flux observers.
#pragma once

#include "tests/contract/gains.h"

namespace gains
{

inline Names must_be_positive(const active_flux_config_t &f)
{
    return {{"flux R", f.model.R}, {"flux t_s", f.model.t_s}, {"flux g", f.g}, {"flux k_seed", f.k_seed}};
}

inline Names must_be_positive(const flux_linkage_config_t &f)
{
    return must_be_positive(f.flux);
}

} // namespace gains
