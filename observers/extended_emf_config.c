#include "observers/extended_emf.h"

void make_extended_emf(maker_t *m, extended_emf_config_t *c)
{
    make_emf(m, c);
}
