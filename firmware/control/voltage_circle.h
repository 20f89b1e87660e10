/* The voltage limit of current control: a circle in which the d-axis has priority, flux before torque
 * (METHODS.md 1.3.2.2, row 5). A vector beyond the limit is detected to 2^-12 in its square, and the q-axis gets
 * what d leaves of it:
 *   u_d  limited to +-v_max
 *   u_q  = +-sqrt(v_max^2 - u_d^2), with its sign: a vector just inside the circle is put on it
 * Four instructions to detect; one root to shorten. Tests: tests/unit/control/synchronous_pi_test.cpp. */
#ifndef CONTROL_VOLTAGE_CIRCLE_H
#define CONTROL_VOLTAGE_CIRCLE_H

#include "firmware/math/frames.h"
#include "firmware/math/root.h"

static inline bool voltage_beyond(pm_dq_t u, pm_wide_t top) /* both Q22 */
{
    return pm_mulh2(u.d, u.d, u.q, u.q) >= pm_mulh(top, top);
}

static inline pm_dq_t voltage_within(pm_dq_t u, pm_wide_t top) /* both Q22 */
{
    const pm_wide_t d = pm_clamp(u.d, -top, top);
    const pm_q_t v_max = pm_narrow(top);
    const pm_q_t v_d = pm_narrow(d);
    const int32_t room = pm_mulh(v_max, v_max) - pm_mulh(v_d, v_d);
    const pm_wide_t left = pm_sqrt_wide(room);
    const pm_dq_t within = {d, u.q < 0 ? -left : left};
    return within;
}

#endif
