#include "observers/third_crossings.h"

#include "firmware/params/maker.h"

void make_third_crossings(maker_t *m, third_crossings_config_t *c)
{
    make_third_integration(m, c);
    c->expects = false; /* between crossings the position says nothing new; so that less may be removed */
    c->g -= c->g / 4;
    c->centre = PM_FRAC(0.4999999);
    c->lead = c->g;
}
