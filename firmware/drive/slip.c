#include "firmware/drive/slip.h"

#include "firmware/math/filter.h"

#define K_ACROSS PM_FRAC(0.2) /* 5 ms */

void slip_reset(slip_t *self)
{
    *self = (slip_t){.count = 0};
}

static pm_angle_t resolved(slip_t *self, bool half)
{
    self->ms = 0;
    self->count = (uint8_t)(self->count + 1U);
    if (half) {
        return PM_TURN(0.5);
    }
    return self->across > 0 ? PM_TURN(1.0 / 3) : PM_TURN(2.0 / 3);
}

pm_angle_t slip_slow(slip_t *self, const pm_machine_t *machine, const slip_in_t *in, bool *away)
{
    const pm_machine_t *m = machine;
    const pm_dq_t i = in->i;
    const pm_q_t omega = in->omega;
    const bool half = (in->traits & (uint32_t)SOURCE_HALF_TURN) != 0U;
    const bool third = (in->traits & (uint32_t)SOURCE_THIRD_TURN) != 0U;
    const pm_q_t emf = pm_mul(pm_abs(omega), m->psi_m);
    const pm_q_t least = pm_mul(pm_mul(m->R_s, pm_abs(i.d) + pm_abs(i.q)), PM_Q(0.4));
    const pm_q_t e_d = in->v.d - pm_mul(m->R_s, i.d) + pm_mul(omega, pm_mul(m->L_q, i.q));
    const pm_q_t e_q = in->v.q - pm_mul(m->R_s, i.q) - pm_mul(omega, pm_mul(m->L_d, i.d));
    const pm_q_t along = omega < 0 ? -e_q : e_q;
    *away = pm_abs(e_d) + pm_abs(e_q) > 3 * pm_mul(in->omega_most, m->psi_m) + least;
    (void)pm_lp1(&self->across, omega < 0 ? e_d : -e_d, K_ACROSS);
    const bool judged = (half || third) && pm_abs(omega) >= in->omega_least && emf >= least;
    const bool beyond = judged && along < (half ? -emf / 2 : emf / 4);
    const bool agrees = judged && along > emf / 2;
    self->agrees_ms = agrees ? (uint8_t)pm_min((int32_t)self->agrees_ms + 1, (int32_t)SLIP_MS) : 0U;
    self->ms = beyond ? (uint16_t)(self->ms + 1U) : 0U;
    return self->ms >= SLIP_MS ? resolved(self, half) : 0U;
}
