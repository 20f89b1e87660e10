#include "firmware/drive/neutral.h"

#include "firmware/math/compiler.h"
#include "firmware/math/image.h"
#include "firmware/params/maker.h"
#include "injection/zero_sequence.h"

_Static_assert(PM_HAS(neutral) || !PM_CARRIES(NEEDS_NEUTRAL), "the channel needs the option `neutral`");

#if PM_HAS(neutral)
/* Of 5 % at most. */
static int32_t star(maker_t *m, drive_param_id_t id, pm_num_t share)
{
    return fixed(m, pm_num_mul(si(m, id), share), 32, id);
}

PM_APART void make_neutral(maker_t *m, neutral_config_t *c)
{
    const pm_num_t a = zero_decay(m);
    const pm_num_t rest = pm_num_sub(pm_num(1), a);
    c->decay = fixed(m, a, 31, DRIVE_PARAM_neutral_filter);
    c->star_alpha = star(m, DRIVE_PARAM_star_alpha, rest);
    c->star_beta = star(m, DRIVE_PARAM_star_beta, rest);
    c->per_code = fixed(m, pm_num_div(si(m, DRIVE_PARAM_neutral_full_scale), m->base.v), 30,
                        DRIVE_PARAM_neutral_full_scale);
}
#endif
