#include "injection/stationary.h"

#include "firmware/math/root.h"

#define PER_VALUES PM_FRAC(1.0 / STATIONARY_VALUES)
/* I_p beyond this is no machine's. */
#define FOUND_LEAST PM_Q(0.25)
#define FOUND_MOST  PM_Q(4.0)
/* What I_n leaves of itself is of the second order of the angle: 0.5 rad, Q16. */
#define SLOW 32768

/* By what the rotor turns between the axes, rad, Q16. */
static int32_t turned(const stationary_config_t *config, pm_q_t omega)
{
    return pm_sat(pm_mulh(omega, config->between), 16);
}

void stationary_reset(stationary_t *self, const stationary_config_t *config, pm_q_t omega)
{
    const bool known = self->finding == 0U && self->found != 0;
    if (config->find && pm_abs(turned(config, omega)) < SLOW) {
        self->found = 0;
        self->finding = STATIONARY_VALUES;
    } else {
        self->found = config->find && known ? self->found : PM_ONE;
        self->finding = 0;
    }
}

bool stationary_find(stationary_t *self, const stationary_config_t *config, pm_q_t along, const obs_in_t *in,
                     pm_q_t i_p)
{
    const bool beta = stationary_on_beta(self);
    const pm_half_dir_t twice = pm_dir_sum(in->dir, in->dir);
    const pm_q_t angle = pm_shl(turned(config, in->omega), PM_Q_BITS - 16);
    const pm_q_t moved = pm_mul(pm_shl(pm_mulh(config->i_n, twice.sin), 2), angle);
    const pm_q_t found = pm_div(along - moved, i_p);
    self->found += pm_frac(pm_clamp(found, FOUND_LEAST, FOUND_MOST), PER_VALUES);
    self->finding--;
    return self->finding == 0U || beta != stationary_on_beta(self);
}
