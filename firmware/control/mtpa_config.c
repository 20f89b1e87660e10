#include "firmware/control/mtpa.h"

#include "firmware/params/maker.h"

/* h = psi_m / (2 (L_q - L_d)); 0 when the saliency is negligible. */
void make_mtpa(maker_t *m, mtpa_config_t *c)
{
    const pm_num_t dL = pm_num_sub(si(m, DRIVE_PARAM_L_q), si(m, DRIVE_PARAM_L_d));
    const pm_num_t trifle = pm_num_mul(si(m, DRIVE_PARAM_L_q), pm_num_ratio(1, 100));
    c->h = 0;
    if (m->params->mtpa != 0 && pm_num_cmp(dL, trifle) > 0) {
        const pm_num_t h = pm_num_div(si(m, DRIVE_PARAM_psi_m), pm_num_mul(pm_num(2), dL));
        int32_t x;
        /* beyond, i_d is less than a fourteenth of i_q, and hypot(h, i_q) might not fit */
        if (pm_num_to_fixed(pm_num_div(h, m->base.i), Q_BITS, &x) && x < PM_Q(7.0)) {
            c->h = x;
        }
    }
}
