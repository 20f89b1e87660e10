// Every observer of observers/observers.def for the linear machine of the tests: per-unit configurations as
// the headers give them, and a speed at which each works.
#pragma once

#include <vector>

#include "tests/contract/bench.h"
#include "tests/contract/mras_config.h"

namespace bench
{

struct ObserverCase {
    const char *name;
    observer_config_t config;
    double omega_pu; // electrical, of the base
};

namespace observers
{

inline void configure(active_flux_config_t &c, const Machine &m, const Base &b)
{
    c = flux_config(m, b);
}

// The three of observers/mras.h have one configuration.
inline void configure(mras_config_t &c, const Machine &m, const Base &b)
{
    c = mras_config(m, b);
}

} // namespace observers

inline std::vector<ObserverCase> observer_cases(const Machine &m = kIpmLinear, const Base &b = kIpmBase)
{
    std::vector<ObserverCase> all;
    ObserverCase c = {};
    c.omega_pu = 0.4;
#define PM_OBSERVER(x, help)                                                                                 \
    c.name = #x;                                                                                             \
    c.config = {};                                                                                           \
    c.config.id = OBSERVER_##x;                                                                              \
    observers::configure(c.config.x, m, b);                                                                  \
    all.push_back(c);
#include "observers/observers.def"
#undef PM_OBSERVER
    return all;
}

} // namespace bench
