#include "injection/random_square.h"

void make_random_square(maker_t *m, random_square_config_t *c)
{
    make_pulsating_square(m, c);
}

injection_limits_t random_square_limits(const maker_t *m)
{
    return pulsating_square_limits(m);
}

pm_num_t random_square_answer(const maker_t *m)
{
    return pulsating_square_answer(m);
}
