#include "firmware/drive/slip.h"

#include "firmware/math/filter.h"

#define K_ACROSS PM_FRAC(0.2) /* 5 ms */

void slip_reset(slip_t *self)
{
    *self = (slip_t){.count = 0};
}

static pm_angle_t resolved(slip_t *self, const slip_config_t *config)
{
    self->ms = 0;
    self->count = (uint8_t)(self->count + 1U);
    if ((config->traits & (uint32_t)SOURCE_HALF_TURN) != 0U) {
        return PM_TURN(0.5);
    }
    return self->across > 0 ? PM_TURN(1.0 / 3) : PM_TURN(2.0 / 3);
}

pm_angle_t slip_slow(slip_t *self, const slip_config_t *config, pm_dq_t v, pm_dq_t i, pm_q_t omega)
{
    const slip_config_t *c = config;
    const pm_q_t speed = pm_abs(omega);
    const bool half = (c->traits & (uint32_t)SOURCE_HALF_TURN) != 0U;
    const bool third = (c->traits & (uint32_t)SOURCE_THIRD_TURN) != 0U;
    if (speed < c->omega_least || !(half || third)) {
        self->ms = 0;
        return 0;
    }
    const pm_q_t e_d = v.d - pm_mul(c->R, i.d) + pm_mul(omega, pm_mul(c->L_q, i.q));
    const pm_q_t e_q = v.q - pm_mul(c->R, i.q) - pm_mul(omega, pm_mul(c->L_d, i.d));
    const pm_q_t along = omega < 0 ? -e_q : e_q;
    (void)pm_lp1(&self->across, omega < 0 ? e_d : -e_d, K_ACROSS);
    const pm_q_t emf = pm_mul(speed, c->psi_m);
    const bool beyond = along < (half ? -emf / 2 : emf / 4);
    self->ms = beyond ? (uint16_t)(self->ms + 1U) : 0U;
    return self->ms >= SLIP_MS ? resolved(self, c) : 0U;
}
