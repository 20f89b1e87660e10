// Variables that a scenario has of its machine, so that one scenario fits motors of any size. Each is a number
// (or the name) in title, profile and expectations, not in the sections that make the machine; a variable of
// the scenario's own of the same name counts more.
//   machine      name
//   salient      1: the drive starts by saliency, its position is known at standstill; 0: it aligns and starts
//                in open loop
//   round        1 - salient
//   pole_deg     a pole pair, mechanical: 360 / pole_pairs
//   load_ramp_s  0 where a step of rated torque takes 0.3 of rated speed at most, T / (J w_s); else the ramp of
//                the load that takes as much, 4 T / (J w_s^2) over it
//                (w_s: bandwidth of the speed control, a PI with its corner at a quarter of it)
//   pace         factor for the times of a scenario: 1 for a machine that is at rated speed within 0.55 s, more
//                for what acceleration, open loop, speed control and load_ramp_s need
// Tests: tests/unit/pmsim/machine_variables_test.cpp, tests/unit/demo.
#ifndef PMSIM_MACHINE_VARIABLES_H
#define PMSIM_MACHINE_VARIABLES_H

#include "tools/pmsim/setup.h"

namespace pmsim
{

Variables machine_variables(const Setup &setup);

} // namespace pmsim

#endif
