/* The pulses that find the initial position, chosen by machine data and limits: duration and magnitude (METHODS.md 9.6.1,
 * 9.6.2; rows 104 and 105).
 *
 * What a pulse of T at a duty shows is its flux F = 2/3 v_dc duty T, written as the current i = F / L_d that it makes along
 * d; T is the fewest periods whose highest duty gives it, because each period adds two edges with their dead time.
 * pulse_choice = 0: i = i_pulse, refused above i_trip and above i_limit, what the board bears.
 * pulse_choice = 1:
 *   i = i_rated                                   which saturates
 *   i >= 29 i_noise L_q / (L_q - L_d)             T_P_MIN: noise of the position is 1 degree; rms, half of 1 / 29 rad
 *   i <= 5/4 i_rated                              the peak with saturation stays below 1.5 i_rated
 *   i <= min(i_trip, i_limit) / 1.5               T_P_MAX: saturation lets the current rise by half at most
 *   i <= 2/3 v_dc / R_s sqrt(L_q / L_d)           T <= T_opt = ln(L_q / L_d) / (R_s (1 / L_d - 1 / L_q)), about
 *                                                 sqrt(L_d L_q) / R_s, where the currents of d and q differ most
 * The limits count before the least. Whether that was enough is said by the margin of the position found.
 * Once, with the configuration. Tests: tests/unit/injection/pulse_choice_test.cpp. */
#ifndef INJECTION_PULSE_CHOICE_H
#define INJECTION_PULSE_CHOICE_H

#include "firmware/math/image.h"
#include "firmware/params/maker.h"

#ifdef __cplusplus
extern "C" {
#endif

#if PM_HAS(pulse_choice)
pm_num_t pulse_choice_current(maker_t *m); /* i, A */
#else
PM_INLINE pm_num_t pulse_choice_current(maker_t *m)
{
    return si(m, DRIVE_PARAM_i_pulse);
}
#endif

#ifdef __cplusplus
}
#endif

#endif
