/* Control of a mean current beside a carrier, at 1 kHz. */
#include "firmware/drive/commissioning/commissioning_parts.h"

/* k (error + its integral over 21 ms), k = w L: what dead time takes swings with the axis. */
static pm_q_t control(pm_q_t *integral, pm_q_t error, pm_q_t k, pm_q_t top)
{
    const pm_q_t proportional = pm_mul_sat(error, k);
    *integral = pm_clamp(*integral + pm_frac(proportional, PM_FRAC(1.0 / 21)), -top, top);
    return pm_clamp(*integral + pm_clamp(proportional, -top, top), -top, top);
}

void commissioning_hold(drive_t *drive, commissioning_hold_t *self, pm_ab_t ref, pm_dq_t i, pm_q_t omega)
{
    const commissioning_result_t *found = &drive->commissioning_report.result;
    const pm_q_t R = found->R != 0 ? found->R : drive->config.machine.R_s;
    const pm_q_t L = found->L_d != 0 ? found->L_d : drive->config.machine.L_d;
    const pm_q_t k = pm_mul_sat(L, omega);
    const pm_q_t top = pm_mul(drive->status.v_dc, PM_Q(0.2));
    const pm_ab_t error = {ref.alpha - i.d, ref.beta - i.q};
    self->v.alpha = control(&self->integral.alpha, error.alpha, k, top) + pm_mul_sat(ref.alpha, R);
    self->v.beta = control(&self->integral.beta, error.beta, k, top) + pm_mul_sat(ref.beta, R);
    const pm_q_t off = pm_max(pm_abs(error.alpha), pm_abs(error.beta));
    self->still = off > commissioning_current(drive) / 32 ? 0U : (uint16_t)(self->still + 1U);
}
