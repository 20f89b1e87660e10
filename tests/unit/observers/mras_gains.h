// Gains of the three model-reference observers, which have one configuration.
#pragma once

#include "tests/contract/gains.h"

namespace gains
{

inline Names must_be_positive(const mras_config_t &m)
{
    return {{"mras k", m.k}, {"mras emf_min", m.emf_min}, {"mras turn", m.turn}};
}

} // namespace gains
