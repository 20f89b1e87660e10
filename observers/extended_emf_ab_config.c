#include "observers/extended_emf_ab.h"

void make_extended_emf_ab(maker_t *m, extended_emf_ab_config_t *c)
{
    make_emf(m, c);
}
