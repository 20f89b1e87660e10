// Application and simulated board as a C++ test sees them. They are C11: inline functions use compound
// literals, which -Wpedantic refuses in C++.
#pragma once

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wc++20-extensions"
extern "C" {
#include "firmware/params/store.h"
#include "hal/sim/sim_loop.h"
}
#pragma GCC diagnostic pop
