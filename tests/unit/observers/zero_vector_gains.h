// Gains of the zero-vector derivative.
#pragma once

#include "tests/unit/observers/emf_gains.h"

namespace gains
{

inline Names must_be_positive(const zero_vector_config_t &c)
{
    Names x = must_be_positive(c.emf);
    x.push_back({"zero vector counts", c.counts});
    return x;
}

} // namespace gains
