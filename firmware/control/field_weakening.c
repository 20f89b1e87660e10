#include "firmware/control/field_weakening.h"

pm_q_t field_weakening_step(field_weakening_t *self, const field_weakening_config_t *config, pm_q_t v,
                            pm_q_t v_top)
{
    self->i_d = pm_clamp(self->i_d + pm_frac(v_top - v, config->k), -config->i_max, 0);
    return self->i_d;
}
