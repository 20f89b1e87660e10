#include "bldc/freewheeling.h"

#include "firmware/params/maker.h"

void make_freewheeling(maker_t *m, freewheeling_config_t *c)
{
    /* sine: 1.5 E_m; trapezoid of the fundamental psi: 2 E = pi^2 / 6 psi w */
    const pm_num_t sine = pm_num_ratio(3, 2),
                   trapezoid = pm_num_mul(square(PM_NUM_TWO_PI), pm_num_ratio(1, 24));
    const pm_num_t shape = m->params->emf_shape == 0 ? sine : trapezoid;
    c->R = per_unit(m, DRIVE_PARAM_R_s, m->impedance);
    c->L = per_unit(m, DRIVE_PARAM_L_q, m->inductance);
    c->emf = fixed(m, pm_num_div(pm_num_mul(shape, si(m, DRIVE_PARAM_psi_m)), m->base.psi), Q_BITS,
                   DRIVE_PARAM_psi_m);
}
