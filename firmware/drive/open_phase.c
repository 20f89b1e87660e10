#include "firmware/drive/open_phase.h"

#include "firmware/math/filter.h"

#define K_MISSED PM_FRAC(1.0 / 32)

void open_phase_reset(open_phase_t *self)
{
    *self = (open_phase_t){.ms = 0};
}

/* One leg; true while it is missed. */
static bool is_missed(pm_q_t missed[2], pm_q_t least, pm_q_t wanted, pm_q_t i)
{
    const pm_q_t short_of = wanted / 2 + wanted / 4 - i;
    return pm_lp1(&missed[wanted < 0 ? 1 : 0], pm_mul(wanted, short_of), K_MISSED) > least;
}

bool open_phase_slow(open_phase_t *self, pm_q_t least, pm_ab_t wanted, pm_ab_t i)
{
    const pm_abc_t w = pm_clarke_inverse(wanted);
    const pm_abc_t leg = pm_clarke_inverse(i);
    const bool a = is_missed(self->missed[0], least, w.a, leg.a);
    const bool b = is_missed(self->missed[1], least, w.b, leg.b);
    const bool c = is_missed(self->missed[2], least, w.c, leg.c);
    self->ms = a || b || c ? (uint16_t)(self->ms + 1U) : 0U;
    return self->ms > OPEN_PHASE_MS;
}
