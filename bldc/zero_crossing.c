#include "bldc/zero_crossing.h"

#include "firmware/math/root.h"

static pm_q_t against_reference(const zero_crossing_config_t *config, const zero_sample_t *in, pm_q_t v)
{
    if (config->reference == ZERO_LINK) {
        return v - pm_half((int32_t)in->legs * in->v_dc);
    }
    const pm_q_t sum = in->v[0] + in->v[1] + in->v[2];
    const pm_q_t y = v - pm_frac(sum, PM_FRAC(0.333333333333333333));
    return config->reference == ZERO_NEUTRAL ? y - in->v_neutral : y;
}

/* Time in which the difference rises by y >= 0. */
static uint32_t rise(const zero_expected_t *expected, pm_q_t y)
{
    const pm_unit_t share = pm_ratio(pm_min(y, expected->swing), expected->swing);
    return (uint32_t)pm_unit((int32_t)expected->t_60, share);
}

/* y >= 0; past: a rail has cut it. */
static uint32_t instant(const zero_crossing_t *self, uint32_t at, pm_q_t y, bool past,
                        const zero_expected_t *expected)
{
    const bool before = self->ahead && !self->cut;
    if (!past) {
        if (!before) {
            return at - rise(expected, y);
        }
        return self->at + (uint32_t)pm_unit((int32_t)(at - self->at), pm_ratio(-self->y, y - self->y));
    }
    if (before) {
        const uint32_t later = rise(expected, -self->y);
        return later < at - self->at ? self->at + later : at;
    }
    return at;
}

/* A first sample past the crossing: not on its way from the rail to the EMF. */
static bool believed(zero_crossing_t *self, uint32_t at, pm_q_t y, const zero_expected_t *expected)
{
    if (y > expected->swing - pm_frac(expected->swing, PM_FRAC(0.375))) {
        return false;
    }
    const bool again = self->past;
    self->past = true;
    return again || (int32_t)(at - expected->at) >= 0;
}

void zero_crossing_open(zero_crossing_t *self, uint32_t sector, uint32_t since)
{
    const zero_crossing_t opened = {.sector = sector, .open_since = since, .at = since};
    *self = opened;
}

bool zero_crossing_step(zero_crossing_t *self, const zero_crossing_config_t *config, bool reverse,
                        const zero_sample_t *in, const zero_expected_t *expected)
{
    if (in->at - self->open_since < config->blank) {
        return false;
    }
    const bool rising = sector_rising(self->sector);
    const pm_q_t v = in->v[sector_legs(self->sector, reverse).open];
    const bool low = v <= config->rail, high = v >= in->v_dc - config->rail;
    const bool past = rising ? high : low;
    if (past && !self->ahead) {
        return false; /* freewheeling */
    }
    const bool cut = rising ? low : high;
    const pm_q_t difference = against_reference(config, in, v);
    const pm_q_t y = (rising ? difference : -difference) - expected->threshold;
    if (y < 0 || cut) {
        self->at = in->at;
        self->y = y;
        self->ahead = true;
        self->cut = cut;
        return false;
    }
    if (!self->ahead && !believed(self, in->at, y, expected)) {
        return false;
    }
    self->at = instant(self, in->at, y, past, expected);
    self->found = true;
    return true;
}
