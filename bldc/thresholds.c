#include "bldc/thresholds.h"

#include "firmware/math/root.h"

pm_q_t thresholds_at(const thresholds_t *self, uint32_t sector, bool reverse)
{
    const uint8_t leg = sector_legs(sector, reverse).open;
    const pm_q_t u_V = sector_rising(sector) ? self->u_V[leg] : -self->u_V[leg];
    return reverse ? u_V + self->u_H[leg] : u_V - self->u_H[leg];
}

/* D / T as a ratio, |D| < T. */
static pm_unit_t share(int32_t D, uint32_t turn)
{
    const int32_t T = (int32_t)turn;
    const pm_unit_t r = pm_ratio(pm_min(pm_abs(D), T), T);
    return D < 0 ? -r : r;
}

static pm_q_t learn(pm_q_t u, pm_frac_t k, pm_q_t volts, pm_q_t most)
{
    return pm_clamp(pm_frac_add(u, volts, k), -most, most);
}

void thresholds_learn(thresholds_t *self, const thresholds_config_t *config, uint32_t sector, bool reverse,
                      const uint32_t interval[], uint32_t turn, pm_q_t swing)
{
    const uint32_t s0 = sector_next(sector), s1 = sector_next(s0), s2 = sector_next(s1);
    const int32_t i_0 = (int32_t)interval[s0], i_2 = (int32_t)interval[s2];
    const uint8_t leg = sector_legs(sector, reverse).open;
    if (sector_rising(sector)) {
        const int32_t D = 2 * (i_0 + (int32_t)interval[s1] + i_2) - (int32_t)turn;
        self->u_V[leg] = learn(self->u_V[leg], config->k_V, pm_unit(swing, share(D, turn)), config->most);
    } else {
        const int32_t D = i_2 - i_0 + (int32_t)interval[sector] - (int32_t)interval[sector_next(s2)];
        const pm_q_t h = pm_unit(swing, share(reverse ? -D : D, turn));
        self->u_H[leg] = learn(self->u_H[leg], config->k_H, h, config->most);
    }
}

void thresholds_slow(thresholds_t *self)
{
    const pm_q_t mean = pm_frac(self->u_H[0] + self->u_H[1] + self->u_H[2], PM_FRAC(1.0 / 3));
    for (uint32_t leg = 0; leg < PM_LEGS; leg++) {
        self->u_H[leg] -= mean;
    }
}
