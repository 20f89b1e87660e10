#include "observers/third_pair.h"

#include "firmware/params/maker.h"

void make_third_pair(maker_t *m, third_pair_config_t *c)
{
    make_third(m, &c->third);
    if (m->params->third_notch != 0) {
        refuse(m, DRIVE_PARAM_third_notch, "observer 12 alone has it");
    }
}
