#include "observers/flux_linkage.h"

#include "observers/model_config.h"

void make_flux_linkage(maker_t *m, flux_linkage_config_t *c)
{
    round_only(m);
    make_active_flux(m, &c->flux);
    c->g = fixed(m, si(m, DRIVE_PARAM_flux_gain), Q_BITS, DRIVE_PARAM_flux_gain);
}
