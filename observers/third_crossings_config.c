#include "observers/third_crossings.h"

void make_third_crossings(maker_t *m, third_crossings_config_t *c)
{
    make_third_integration(m, c);
}
