// Every observer of observers/observers.def for the linear machine of the tests: per-unit configurations as
// the headers give them, and a speed at which each works.
#pragma once

#include <vector>

#include "tests/contract/bench.h"
#include "tests/contract/mras_config.h"
#include "tests/unit/observers/ekf_bench.h"
#include "tests/unit/observers/sliding_mode_bench.h"

namespace bench
{

struct ObserverCase {
    const char *name;
    observer_config_t config;
    double omega_pu; // electrical, of the base
    int settle;      // periods until a change of the frame shows in eps to 3 %
};

namespace observers
{

// A filter of 300 Hz in the present frame.
constexpr int kFilter300Hz = 20;

inline int settle(observer_id_t id)
{
    return id == OBSERVER_back_emf || id == OBSERVER_extended_emf ? kFilter300Hz : 5;
}

inline void configure(active_flux_config_t &c, const Machine &m, const Base &b)
{
    c = flux_config(m, b);
}

inline void configure(emf_config_t &c, const Machine &m, const Base &b)
{
    c = emf_config(m, b);
}

inline void configure(flux_linkage_config_t &c, const Machine &m, const Base &b)
{
    c.flux = flux_config(m, b);
    c.g = PM_Q(0.5);
}

inline void configure(sliding_mode_config_t &c, const Machine &m, const Base &b)
{
    c = sliding_mode_config(m, b, SLIDING_MODE_SATURATION, false);
}

inline void configure(ekf_full_config_t &c, const Machine &m, const Base &b)
{
    c = ekf_full_config(m, b);
}

inline void configure(ekf_reduced_config_t &c, const Machine &m, const Base &b)
{
    c = ekf_reduced_config(m, b);
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
#define PM_METHOD(x, help, traits, needs)                                                                    \
    c.name = #x;                                                                                             \
    c.config = {};                                                                                           \
    c.config.id = OBSERVER_##x;                                                                              \
    c.settle = observers::settle(c.config.id);                                                               \
    observers::configure(c.config.x, m, b);                                                                  \
    all.push_back(c);
#include "observers/observers.def"
#undef PM_METHOD
    return all;
}

} // namespace bench
