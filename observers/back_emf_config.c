#include "observers/back_emf.h"

#include "observers/model_config.h"

void make_back_emf(maker_t *m, back_emf_config_t *c)
{
    round_only(m);
    make_emf(m, c);
}
