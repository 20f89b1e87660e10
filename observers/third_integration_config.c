#include "observers/third_integration.h"

#include "firmware/params/maker.h"

void make_third_integration(maker_t *m, third_integration_config_t *c)
{
    make_third(m, &c->third);
    /* Half a period more, of the sum of the trapezia. */
    const pm_num_t half = pm_num_mul(pm_num_ratio(1, 2), m->base.t_s);
    c->third.rc = fixed(m, mul3(pm_num(3), pm_num_add(third_filter(m), half), m->base.omega), Q_BITS,
                        DRIVE_PARAM_neutral_filter);
    c->g = fixed(m, si(m, DRIVE_PARAM_third_drift), Q_BITS, DRIVE_PARAM_third_drift);
    c->expects = true;
    c->centre = PM_FRAC(0.25);
    /* h = g / 2 / (1 + g^2 / 2) */
    const pm_num_t g = si(m, DRIVE_PARAM_third_drift);
    c->lead =
        fixed(m, pm_num_div(g, pm_num_add(pm_num(2), pm_num_mul(g, g))), Q_BITS, DRIVE_PARAM_third_drift);
    if (m->params->third_notch != 0) {
        refuse(m, DRIVE_PARAM_third_notch, "observer 12 alone has it");
    }
}
