/* The eight states of three legs that are held high or low: what regulators choose from that give a state instead of a
 * voltage (finite_set.h, predictive.h, direct_torque.h).
 *
 *   e_n = unit vector at n 60 degrees of the stator, n = 0 ... 5, called sectors
 *   state of sector n:  v = 2/3 v_dc e_n
 *   two zero states, all legs low or all high:  v = 0
 *
 * Cost: 28 instructions for switch_voltage(). Tests: tests/unit/control/finite_set_test.cpp. */
#ifndef CONTROL_SWITCH_STATES_H
#define CONTROL_SWITCH_STATES_H

#include "firmware/math/frames.h"
#include "firmware/math/legs.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SWITCH_SECTORS 6U

extern const uint16_t switch_legs[SWITCH_SECTORS]; /* PM_LEGS_... of the states of the sectors */

/* The zero state that is nearer to what the legs do now: at most one of them moves. */
uint16_t switch_zero(uint16_t legs);

/* v of a sector's state in the frame whose direction is given; v_dc and v in Q28. */
pm_dq_t switch_voltage(uint32_t sector, pm_q_t v_dc, pm_half_dir_t frame);

typedef struct {
    uint32_t sector;
    pm_q_t along; /* x . e, in the format of x */
} switch_nearest_t;

/* The sector that points most along x, whose format leaves |x| below 4 in Q28. */
switch_nearest_t switch_nearest(pm_ab_t x);

#ifdef __cplusplus
}
#endif

#endif
