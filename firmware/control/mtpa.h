/* Maximum torque per ampere from parameters (METHODS.md 1.3.2.2, row 5).
 *
 *   h   = psi_m / (2 (L_q - L_d))
 *   i_d = h - sqrt(h^2 + i_q^2)
 * i_d = 0 when L_q - L_d is below a hundredth of L_q (the configuration then has h = 0). With L_q below L_d, where a
 * positive i_d would be best, that gives away ((L_d - L_q) i / psi_m)^2 / 2 of the torque. Runs at 1 kHz.
 * Tests: tests/unit/control/mtpa_test.cpp. */
#ifndef CONTROL_MTPA_H
#define CONTROL_MTPA_H

#include "firmware/math/frames.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t h; /* psi_m / (2 (L_q - L_d)), a current; 0: i_d = 0 */
} mtpa_config_t;

pm_q_t mtpa_i_d(const mtpa_config_t *config, pm_q_t i_q);

void make_mtpa(maker_t *m, mtpa_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
