// Application and simulated board.
#pragma once

#include "firmware/params/store.h"
#include "hal/sim/sim_loop.h"
