#include "bldc/third_harmonic.h"

#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define TRIANGLE PM_UNIT(0.09705)

void third_harmonic_open(third_harmonic_t *self, uint32_t now)
{
    self->at = now;
    self->y = 0;
    self->ahead = false;
}

bool third_harmonic_step(third_harmonic_t *self, const third_harmonic_config_t *config, pm_q_t v_zero,
                         uint32_t now, bool rising)
{
    const pm_q_t y = rising != config->negative ? v_zero : -v_zero;
    const bool found = self->ahead && y >= 0;
    if (found) {
        const int32_t apart = (int32_t)(now - self->at);
        const pm_unit_t share = pm_ratio(-self->y, y - self->y);
        self->crossing = self->at + (uint32_t)pm_unit(apart, share) - self->lag;
    }
    self->at = now;
    self->y = y;
    self->ahead = self->ahead || y < -self->seen;
    if (found) {
        third_harmonic_skip(self);
    }
    return found;
}

void third_harmonic_skip(third_harmonic_t *self)
{
    self->y = -self->y;
    self->ahead = false;
}

void third_harmonic_slow(third_harmonic_t *self, const third_harmonic_config_t *config, uint32_t t_60,
                         pm_q_t swing)
{
    const pm_angle_t phase = pm_atan2(config->pi_rc, (int32_t)t_60); /* 0 ... a quarter of a turn */
    const pm_unit_t u = (pm_unit_t)pm_min((int32_t)(2U * phase), PM_UNIT_MAX);
    pm_unit_t share = u / 2;
    if (config->trapezoid) {
        share += pm_unit(pm_unit(pm_unit(u, u), PM_UNIT_MAX - u), TRIANGLE);
    }
    self->lag = (uint32_t)pm_unit((int32_t)t_60, share);
    self->seen = pm_max(pm_unit(swing, pm_dir(phase).cos) / 8, 1);
}
