/* Protective short circuit: on a fault deep in field weakening the low switches close, all three, instead of opening
 * (parameter fault_short).
 *
 * With the bridge open the diodes rectify the motor's EMF as soon as its line-to-line peak exceeds the link,
 *   sqrt(3) psi_m |omega| > v_dc
 * and charge the link up to it, or brake into a battery, until the rotor is slower. Shorted, the motor gives the link
 * nothing: its current tends to psi_m / L_d, and its torque brakes.
 *
 *   begins   with a fault that leaves the low switches usable (fault_short.c), at
 *              sqrt(3) psi_m |omega| > 17/16 v_dc
 *   ends     when the current turns more slowly than a rotor does at
 *              sqrt(3) psi_m |omega| = 15/16 v_dc
 *            and at once with a fault that forbids it: break, current above i_trip, bridge too warm, overrun
 * v_dc is the measured voltage, at least v_dc_min: what charges a dead link up to there harms nothing. A sixteenth is
 * about what psi_m, by the magnets' temperature, and v_dc are known to: below the upper limit an open bridge charges the
 * link by 6 % at most, above the lower one it still might.
 *
 * Of an open winding, whose phases meet the link by themselves, 1 stands for sqrt(3) in all of this; its second bridge closes the same
 * switches, and i_0, up to psi_3 / L_0, is part of the current.
 *
 * omega is the estimate, for POSITION_LOST the reference. From then on it is that of the current vector: in the
 * stationary frame the current of a shorted machine turns with the rotor, whatever the estimate says. The flux of before
 * stands still in that frame and can hold the current's angle back until it has decayed, at least with L_q / R_s: for
 * 2.3 L_q / R_s, to a tenth, the angle does not count. Then its step per period does, through a low-pass of L_q / R_s. So
 * a short that was begun in error ends, too. A current below 2 % of full scale, 40 steps of a 12-bit converter, has no
 * angle and counts as one that stands still.
 *
 * Limits. At the fault the flux is at most v_dc / (sqrt(3) omega) < psi_m. It stands still while the rotor turns on, and
 * the current is largest when it opposes the magnets:
 *   i_peak < 2 psi_m / L_d
 * Where this exceeds i_trip, fault_short is refused; resistance makes it less, 1.5 psi_m / L_d at omega L_d = 4 R_s. Low
 * switches and windings must bear psi_m / L_d for as long as something drives the rotor: no time ends the short. When
 * it ends, the energy of the windings goes into the link, as whenever a bridge opens: about
 *   psi_m^2 / L_d
 * three quarters of it stored, the rest by the EMF while the current ceases.
 *
 * The fault is latched and reported as ever and cannot be cleared meanwhile. The short acts from the update event that
 * follows the step, as any output; until there the voltage of the step before goes on. No upper switch closes after
 * that. Nothing begins a short that has ended. A reset, the break and a processor that has stopped open the bridge.
 *
 * Cost: nothing in a period without it; with it an arctangent per period, and at 1 kHz a division. State 12 bytes.
 * Tests: tests/unit/drive/fault_short_test.cpp, tests/unit/app/short_test.cpp, tests/scenario/fault_short.yaml. */
#ifndef DRIVE_FAULT_SHORT_H
#define DRIVE_FAULT_SHORT_H

#include "firmware/math/fixed.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_frac_t k; /* low-pass of L_q / R_s, each period; 0: off */
} fault_short_config_t;

typedef struct {
    pm_q_t flux;      /* of the moment of the fault: what is left of 1 */
    pm_angle_t theta; /* of the current vector */
    int32_t turn;     /* half its step per period, filtered, in turns of 2^32 */
} fault_short_t;

void make_fault_short(maker_t *m, fault_short_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
