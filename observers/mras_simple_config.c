#include "observers/mras_simple.h"

void make_mras_simple(maker_t *m, mras_simple_config_t *c)
{
    make_mras(m, c);
}
