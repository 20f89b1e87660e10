// Gains of the low-speed sources.
#pragma once

#include "tests/contract/gains.h"

namespace gains
{

inline Names must_be_positive(const pulsating_square_config_t &c)
{
    return {{"v_h", c.v_h}, {"gain_0", c.saliency.gain_0}, {"h_d", c.h_d}, {"h_d_inverse", c.h_d_inverse}};
}

inline Names must_be_positive(const rotating_sine_config_t &c)
{
    return {{"sine v_h", c.v_h},
            {"sine gain_0", c.saliency.gain_0},
            {"sine per_n", c.per_n},
            {"sine n", c.n - 7}};
}

} // namespace gains
