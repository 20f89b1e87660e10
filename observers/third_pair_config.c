#include "observers/third_pair.h"

#include "firmware/params/maker.h"

void third_pair_check(maker_t *m)
{
    if (m->params->winding != 2) {
        refuse(m, DRIVE_PARAM_observer, "needs two sets of windings: winding 2");
    } else if (m->params->third_notch != 0) {
        refuse(m, DRIVE_PARAM_third_notch, "observer 12 alone has it");
    } else {
        /* both star points are there */
    }
}

void make_third_pair(maker_t *m, third_pair_config_t *c)
{
    make_third(m, &c->third);
    third_pair_check(m);
}
