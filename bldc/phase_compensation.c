#include "bldc/phase_compensation.h"

#include "firmware/math/root.h"

#define MOST PM_FRAC(0.375)

void phase_compensation_slow(phase_compensation_t *self, const thresholds_t *learnt, bool reverse,
                             uint32_t t_60, pm_q_t swing)
{
    for (uint32_t s = 0; s < SECTORS; s++) {
        const pm_q_t u = thresholds_at(learnt, s, reverse);
        const pm_unit_t share = pm_ratio(pm_min(pm_abs(u), pm_frac(swing, MOST)), swing);
        const int32_t shift = pm_unit((int32_t)t_60, share);
        self->shift[s] = u < 0 ? -shift : shift;
    }
}
