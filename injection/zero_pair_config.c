#include "injection/zero_pair.h"

#include "firmware/math/compiler.h"
#include "firmware/params/maker.h"
#include "injection/zero_pair_anti_rotating.h"
#include "injection/zero_pair_rotating.h"

#if PM_HAS(zero_pair_anti_rotating) || PM_HAS(zero_pair_rotating)

PM_APART void make_zero_pair(maker_t *m, zero_config_t *c)
{
    make_zero_sequence(m, c);
    if (m->params->winding != 2) {
        refuse(m, DRIVE_PARAM_injection, "needs two sets of windings: winding 2");
    } else if (m->params->zero_form % 2 == 1) {
        refuse(m, DRIVE_PARAM_zero_form, "two sets have the measured form alone: 0 or 2");
    } else {
        c->form = (uint8_t)ZERO_MEASURED;
        c->told_first = false;
    }
}

#endif

#if PM_HAS(zero_pair_anti_rotating)
void make_zero_pair_anti_rotating(maker_t *m, zero_pair_anti_rotating_config_t *c)
{
    make_zero_pair(m, c);
    c->anti_rotating = 1U;
}
#endif

#if PM_HAS(zero_pair_rotating)
void make_zero_pair_rotating(maker_t *m, zero_pair_rotating_config_t *c)
{
    make_zero_pair(m, c);
    if (c->half < 4U) {
        refuse(m, DRIVE_PARAM_f_injection,
               "a rotating carrier needs at least eight periods: an eighth of f_pwm");
    }
}
#endif
