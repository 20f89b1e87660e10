// Gains of the third-harmonic sources.
#pragma once

#include "tests/contract/gains.h"

namespace gains
{

inline Names must_be_positive(const third_config_t &c)
{
    return {{"third psi_3", c.psi_3}, {"third t_s", c.t_s}, {"third omega_min", c.omega_min}};
}

inline Names must_be_positive(const third_integration_config_t &c)
{
    return must_be_positive(c.third);
}

inline Names must_be_positive(const third_sogi_config_t &c)
{
    return must_be_positive(c.third);
}

inline Names must_be_positive(const third_pair_config_t &c)
{
    return must_be_positive(c.third);
}

inline Names must_be_positive(const third_pair_flux_config_t &c)
{
    Names names = must_be_positive(c.third);
    names.push_back({"third_pair_flux g", c.g});
    return names;
}

} // namespace gains
