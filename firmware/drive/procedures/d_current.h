/* Magnetic polarity by a d-axis current and the amplitude of the answer to the carrier: of the current (METHODS.md 8.3.1,
 * row 94), or of the voltage at the neutral (8.3.2, row 95).
 *
 * On top of position control by injection, i_d is held at +i_polarity, then at -i_polarity. The carrier's answer
 *   h_d = F / L_dh(i_d)                      F: flux of the carrier, V_h / omega_h or V_h T_s / 2
 * is larger where the current adds to the flux of the magnet. At the neutral it is, of a rotating carrier,
 *   h_d = V_h dL_0 L_sa / (2 D) [1 + kappa cos(6 theta + theta_m)]      in phase with cos(2 theta + phi)
 * which goes by 1 / L_dh at 0, 60, ... degrees and by 1 / L_qh between; the carrier that turns back with -2 theta^ + 90 degrees
 * has none where it locks. dL_0 may change with the current, too, so that it was found once which of the two is larger: zero_falls.
 * Where that is not known, or is not the same at every position (zero_inductance.h), the configuration refuses.
 * Of n values in each direction:
 *   D      = mean(h_d+) - mean(h_d-)         > 0: d of the estimated frame is the magnet's north
 *   sigma^2 = sigma_+^2 + sigma_-^2
 *   margin = (|D| - 1/128 h_d) / sigma       polarity.h
 * Dead time, drops and gain errors are the same for both directions, as all six currents change their signs.
 * IPM-1000 at 2 A: h_d+ / h_d- = 1.24, SPM-400: 1.08; at the neutral of IPM-1000 1.23 at 0 degrees and 1.077 at 30.
 *
 * One of the two currents points against the magnet, where a free rotor is not stable: it leaves at the rate w, and is
 * held by a frame that turns with it, current and all, as fast as injection_bandwidth allows. A rotor too light for that
 * is refused by the configuration:
 *   w^2 = 3/2 p^2 psi_m i_polarity / J < (2 pi injection_bandwidth)^2
 *
 * 8 ms to either current and 8 ms for it to settle, n values, 16 ms back: at most 150 ms with a carrier of 500 Hz
 * and n = 16. Peak current i_polarity and the carrier. Movement: 0.9 degrees mechanical at most with SPM-400, 0.03 with
 * IPM-1000.
 * PM_FAILED_POLARITY: below five sigma, as with a linear machine or i_polarity = 0; PM_FAILED_NO_CURRENT: the
 * carrier has no answer; PM_FAILED_SALIENCY: with the current the frame has left its axis by 30 degrees, as where the
 * saliency is gone. Sources: pulsating_sine, pulsating_square, zero_rotating.
 * Tests: tests/unit/drive/polarity_test.cpp, tests/scenario/polarity_d_current.yaml, polarity_zero_d_current.yaml. */
#ifndef DRIVE_PROCEDURES_D_CURRENT_H
#define DRIVE_PROCEDURES_D_CURRENT_H

#include "injection/polarity.h"

typedef struct {
    polarity_mean_t h[2]; /* with +i_d, with -i_d; beside `first` */
    pm_q_t first;
    pm_angle_t theta; /* of the frame before the current */
    pm_sigma_t margin;
    uint16_t ms;
    uint8_t part;
    uint8_t result; /* pm_procedure_t, from the moment it is known */
} d_current_t;

#endif
