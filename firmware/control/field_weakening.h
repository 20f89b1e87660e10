/* Field weakening by voltage feedback (row 5).
 *
 *   i_fw += k (v_top - |v|),   -i_fw_max <= i_fw <= 0
 * The integral drives i_d negative while the voltage exceeds v_top, a share of what the DC link allows, and
 * releases it afterwards. The loop gain falls with speed, so the configured k is for base speed: stable there
 * means stable above. Runs at 1 kHz.
 *
 * A current along d changes the voltage by
 *   1/2 d|v|^2 / di_d = R v_d + omega L_d v_q
 * Where that is not positive, more of it takes voltage and gives none: beyond the current of most torque per volt, and where a
 * winding is resistance above all, as a gimbal motor's. There i_fw goes back, at an eighth of the rate.
 * Tests: tests/unit/control/field_weakening_test.cpp. */
#ifndef CONTROL_FIELD_WEAKENING_H
#define CONTROL_FIELD_WEAKENING_H

#include "firmware/math/frames.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_frac_t k;  /* Q32, per call */
    pm_q_t i_max; /* largest demagnetising current; 0: off */
} field_weakening_config_t;

typedef struct {
    pm_q_t i_d; /* <= 0, to be added to the reference */
} field_weakening_t;

typedef struct {
    pm_dq_t v;
    pm_q_t v_top;
    pm_q_t omega;    /* electrical */
    pm_q_t R_s, L_d; /* per-unit */
} field_weakening_in_t;

pm_q_t field_weakening_step(field_weakening_t *self, const field_weakening_config_t *config,
                            const field_weakening_in_t *in);

void make_field_weakening(maker_t *m, field_weakening_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
