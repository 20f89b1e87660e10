#include "firmware/control/predictive.h"

#include "firmware/control/deadbeat.h"
#include "firmware/params/maker.h"

void make_predictive(maker_t *m, predictive_config_t *c)
{
    deadbeat_config_t same = {.k_d = 0};
    make_deadbeat(m, &same);
    c->model = same.model;
    c->weight_d =
        fixed(m, pm_num_div(si(m, DRIVE_PARAM_L_d), si(m, DRIVE_PARAM_L_q)), Q_BITS, DRIVE_PARAM_L_d);
    c->share = PM_UNIT_MAX;
    c->compensates = m->params->predictive_delay != 0;
}

pm_num_t predictive_bandwidth(const maker_t *m)
{
    return deadbeat_bandwidth(m);
}
