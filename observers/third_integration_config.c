#include "observers/third_integration.h"

#include "firmware/params/maker.h"

void make_third_integration(maker_t *m, third_integration_config_t *c)
{
    make_third(m, &c->third);
    c->third.rc += c->third.t_s / 16 * 3 / 2; /* half a period, Q28 */
    c->g = fixed(m, si(m, DRIVE_PARAM_third_drift), Q_BITS, DRIVE_PARAM_third_drift);
    if (m->params->third_notch != 0) {
        refuse(m, DRIVE_PARAM_third_notch, "observer 12 alone has it");
    }
}
