#include "firmware/drive/held.h"

#include "firmware/drive/drive_parts.h"
#include "firmware/math/filter.h"

#if REGULATION_HOLDS

#define K_MEAN PM_FRAC(1.0 / 64)

void held_step(drive_t *drive)
{
    held_t *self = &drive->held;
    regulator_out_t *u = &drive->voltage;
    if (self->before != 0U) {
        const pm_ab_t v = modulator_edges(&drive->modulator, &drive->config.modulator, self->before,
                                          self->acting, drive->i_abc, drive->status.v_dc);
        drive->v_acting.alpha += v.alpha;
        drive->v_acting.beta += v.beta;
    }
    self->before = self->acting;
    self->acting = u->legs;
    u->v.d = pm_lp1(&self->v.d, u->v.d, K_MEAN);
    u->v.q = pm_lp1(&self->v.q, u->v.q, K_MEAN);
}

void held_end(held_t *self)
{
    self->before = 0;
    self->acting = 0;
}

#endif
