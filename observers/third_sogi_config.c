#include "observers/third_sogi.h"

#include "firmware/params/maker.h"

void make_third_sogi(maker_t *m, third_sogi_config_t *c)
{
    make_third(m, &c->third);
    c->k = fixed(m, si(m, DRIVE_PARAM_third_gain), Q_BITS, DRIVE_PARAM_third_gain);
}
