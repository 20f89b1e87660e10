// Variables that a scenario has of its machine, so that one scenario fits motors of any size. Each is a number
// (or the name) in title, profile and expectations, not in the sections that make the machine; a variable of
// the scenario's own of the same name counts more.
//   machine      name
//   salient      1: the drive starts by saliency, its position is known at standstill; 0: it aligns and starts
//                in open loop
//   round        1 - salient
//   start_turn_deg  what a start may turn the rotor by, mechanical: 5 where saturation shows the pole; 105
//                electrical where a torque has to (torque_polarity.h); a pole pair where the rotor is aligned
//   bears        share of rated torque that the link leaves the drive at rated speed, with what friction takes
//   drag_rel     friction and bearings at rated speed, of rated torque
//   told_deg     error of an observer at that load by the L_q that the drive is told, where it is not the motor's:
//                  atan((L_q - L_q,told) i_q / psi_a),   psi_a = psi_m - (L_q - L_d) i_d
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
