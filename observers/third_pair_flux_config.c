#include "observers/third_pair_flux.h"

#include "firmware/params/maker.h"

void make_third_pair_flux(maker_t *m, third_pair_flux_config_t *c)
{
    make_third(m, &c->third);
    /* Half a period less, of the sum. */
    const pm_num_t half = pm_num_mul(pm_num_ratio(1, 2), m->base.t_s);
    c->third.rc = fixed(m, mul3(pm_num(3), pm_num_sub(third_filter(m), half), m->base.omega), Q_BITS,
                        DRIVE_PARAM_neutral_filter);
    c->g = fixed(m, si(m, DRIVE_PARAM_third_drift), Q_BITS, DRIVE_PARAM_third_drift);
    third_pair_check(m);
}
