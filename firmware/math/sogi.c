#include "firmware/math/sogi.h"

void pm_sogi_step(pm_sogi_t *self, pm_dir_t step, pm_frac_t k, pm_q_t x)
{
    const pm_q_t half = self->half;
    const pm_q_t y = self->y + half;
    const pm_q_t q = self->q;
    const pm_q_t y_next = pm_shl(pm_mulh_sub(pm_mulh(y, step.cos), q, step.sin), 1) + half;
    self->q = pm_shl(pm_mulh_add(pm_mulh(y, step.sin), q, step.cos), 1);
    self->y = y_next;
    self->half = pm_frac(x - y_next, k) >> 1;
}
