// The firmware's headers as a C++ test sees them. They are C11: some have no linkage of their own, and inline
// functions use compound literals, which -Wpedantic refuses in C++.
#pragma once

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wc++20-extensions"
extern "C" {
#include "firmware/control/current_control.h"
#include "firmware/control/field_weakening.h"
#include "firmware/control/modulator.h"
#include "firmware/control/mtpa.h"
#include "firmware/control/speed_control.h"
#include "firmware/drive/drive_parts.h"
#include "firmware/math/estimate.h"
#include "injection/initial_pulses.h"
#include "injection/pulsating_square.h"
#include "observers/observer.h"
}
#pragma GCC diagnostic pop
