#include "firmware/drive/fault_short.h"

#include "firmware/params/maker.h"

void make_fault_short(maker_t *m, fault_short_config_t *c)
{
    const drive_params_t *p = m->params;
    c->k = 0;
    if (p->fault_short != 0) {
        const pm_num_t decay = pm_num_div(si(m, DRIVE_PARAM_R_s), si(m, DRIVE_PARAM_L_q));
        c->k = gain(m, pm_num_mul(decay, m->base.t_s), FRAC_BITS, DRIVE_PARAM_R_s);
        if ((int64_t)2000 * p->psi_m > (int64_t)p->L_d * p->i_trip) { /* 10^-9 Wb, 10^-9 H, 10^-3 A */
            refuse(m, DRIVE_PARAM_fault_short, "the short-circuit current exceeds i_trip");
        }
    }
}
