#include "firmware/drive/open_phase.h"

#define SEEN 2U /* what a millisecond in which the leg conducts takes back */

void open_phase_reset(open_phase_t *self)
{
    *self = (open_phase_t){.missed = {{0}}};
}

static pm_q_t square(pm_ab_t x)
{
    return pm_mul(x.alpha, x.alpha) + pm_mul(x.beta, x.beta);
}

static uint8_t less(uint8_t ms)
{
    return (uint8_t)(ms > SEEN ? ms - SEEN : 0U);
}

/* One leg; true when it has been missed for long. A leg that conducts does so at some time of the turn, also when the
 * current is beside what is wanted. */
static bool is_missed(uint8_t missed[2], pm_q_t half_asked, pm_q_t sixteenth, pm_q_t w, pm_q_t i)
{
    const bool flows = pm_mul(i, i) >= sixteenth;
    if (flows) {
        uint8_t *seen = &missed[i < 0 ? 1 : 0];
        *seen = less(*seen);
    }
    if (pm_mul(w, w) > half_asked) {
        uint8_t *ms = &missed[w < 0 ? 1 : 0];
        *ms = flows ? less(*ms) : (uint8_t)(*ms + 1U);
    }
    return missed[0] > OPEN_PHASE_MS || missed[1] > OPEN_PHASE_MS;
}

bool open_phase_slow(open_phase_t *self, pm_q_t least, pm_ab_t wanted, pm_ab_t i, pm_q_t i_zero)
{
    const pm_q_t all = square(i);
    const pm_q_t asked = square(wanted);
    if (all < least || asked < pm_max(least, all / 4)) {
        return false;
    }
    const pm_abc_t w = pm_clarke_inverse(wanted);
    const pm_abc_t leg = pm_clarke_inverse(i);
    const bool a = is_missed(self->missed[0], asked / 2, all / 16, w.a, leg.a + i_zero);
    const bool b = is_missed(self->missed[1], asked / 2, all / 16, w.b, leg.b + i_zero);
    const bool c = is_missed(self->missed[2], asked / 2, all / 16, w.c, leg.c + i_zero);
    return a || b || c;
}
