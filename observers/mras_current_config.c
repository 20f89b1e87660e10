#include "observers/mras_current.h"

void make_mras_current(maker_t *m, mras_current_config_t *c)
{
    make_mras(m, c);
}
