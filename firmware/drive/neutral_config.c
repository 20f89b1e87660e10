#include "firmware/drive/neutral.h"

#include "firmware/math/image.h"
#include "firmware/params/maker.h"

_Static_assert(PM_HAS(neutral) || !PM_CARRIES(NEEDS_NEUTRAL), "the channel needs the option `neutral`");

#if PM_HAS(neutral)
void make_neutral(maker_t *m, neutral_config_t *c)
{
    c->per_code = fixed(m, pm_num_div(si(m, DRIVE_PARAM_neutral_full_scale), m->base.v), 30,
                        DRIVE_PARAM_neutral_full_scale);
}
#endif
