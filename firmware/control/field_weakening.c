#include "firmware/control/field_weakening.h"

#include "firmware/math/root.h"

pm_q_t field_weakening_step(field_weakening_t *self, const field_weakening_config_t *config,
                            const field_weakening_in_t *in)
{
    const pm_q_t left = in->v_top - pm_hypot(in->v.d, in->v.q);
    const pm_q_t helps = pm_mul(in->R_s, in->v.d) + pm_mul(in->omega, pm_mul(in->L_d, in->v.q));
    const pm_q_t moves = left < 0 && helps <= 0 ? -left / 8 : left;
    self->i_d = pm_clamp(self->i_d + pm_frac(moves, config->k), -config->i_max, 0);
    return self->i_d;
}
