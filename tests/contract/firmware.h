// The firmware's headers that the contract suites use.
#pragma once

#include "firmware/control/field_weakening.h"
#include "firmware/control/modulator.h"
#include "firmware/control/mtpa.h"
#include "firmware/control/regulator.h"
#include "firmware/control/speed_control.h"
#include "firmware/drive/drive_parts.h"
#include "firmware/math/estimate.h"
#include "injection/four_pulses.h"
#include "injection/initial_pulses.h"
#include "injection/pulsating_square.h"
#include "observers/observer.h"
