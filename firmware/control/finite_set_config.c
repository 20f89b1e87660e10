#include "firmware/control/finite_set.h"

#include "firmware/params/maker.h"

void make_finite_set(maker_t *m, finite_set_config_t *c)
{
    make_deadbeat(m, &c->deadbeat);
}

pm_num_t finite_set_bandwidth(const maker_t *m)
{
    return deadbeat_bandwidth(m);
}
