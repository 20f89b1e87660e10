#include "bldc/zero_crossing.h"

#include "bldc/virtual_third.h"
#include "firmware/math/root.h"

static pm_q_t against_reference(const zero_crossing_config_t *config, const zero_sample_t *in,
                                zero_legs_t legs, pm_q_t v)
{
    if (config->reference == ZERO_LINK) {
        return v - pm_half((int32_t)legs * in->v_dc);
    }
    if (config->reference == ZERO_VIRTUAL) {
        return virtual_third(in, legs);
    }
    const pm_q_t sum = in->v[0] + in->v[1] + in->v[2];
    const pm_q_t y = v - pm_frac(sum, PM_FRAC(0.333333333333333333));
    return config->reference == ZERO_NEUTRAL ? y - in->v_neutral : y;
}

pm_q_t zero_crossing_swing(const zero_crossing_config_t *config, uint32_t t_60)
{
    return pm_max(pm_mul_sat(pm_div((pm_q_t)config->t_60, (pm_q_t)t_60), config->swing), 1);
}

/* Time in which the difference rises by y >= 0. */
static uint32_t rise(const zero_crossing_config_t *config, pm_q_t swing, uint32_t t_60, pm_q_t y)
{
    const pm_unit_t share = pm_ratio(pm_min(y, swing - swing / 4), swing);
    const pm_unit_t cube = pm_unit(pm_unit(share, share), share);
    return (uint32_t)pm_unit((int32_t)t_60, pm_frac_add(share, cube, config->curve));
}

/* Between the last sample ahead and this one. */
static uint32_t between(const zero_crossing_t *self, uint32_t at, pm_q_t y)
{
    return self->at + (uint32_t)pm_unit((int32_t)(at - self->at), pm_ratio(-self->y, y - self->y));
}

/* From the distance of the sample that no rail has cut; past: one has cut this. */
static uint32_t by_slope(const zero_crossing_t *self, const zero_crossing_config_t *config, uint32_t at,
                         pm_q_t y, bool past, pm_q_t swing, uint32_t t_60)
{
    if (!past) {
        return at - rise(config, swing, t_60, y);
    }
    if (self->cut) {
        return at;
    }
    const uint32_t later = rise(config, swing, t_60, -self->y);
    return later < at - self->at ? self->at + later : at;
}

/* With both legs low the channels cut the leg that is below zero by its current and not the other: at the end of a downward
 * crossing their mean stays above its reference for good. */
static bool rests(const zero_crossing_config_t *config, const zero_crossing_t *self, zero_legs_t legs,
                  pm_q_t v)
{
    return config->reference == ZERO_VIRTUAL && !self->rising && legs == ZERO_LEGS_LOW &&
           v <= config->rail / 4;
}

/* A first sample past the crossing: not on its way from the rail to the EMF. */
static bool believed(zero_crossing_t *self, uint32_t at, pm_q_t y, const zero_expected_t *expected,
                     pm_q_t swing)
{
    if (y > swing - pm_frac(swing, PM_FRAC(0.375))) {
        return false;
    }
    const bool again = self->past;
    self->past = true;
    return again || (int32_t)(at - expected->at) >= 0;
}

/* A sample ahead of the crossing; one that is cut tells less than one before it that is not. */
static void advance(zero_crossing_t *self, uint32_t at, pm_q_t y, bool cut)
{
    if (!cut || !self->ahead || self->cut) {
        self->at = at;
        self->y = y;
        self->cut = cut;
    }
    self->ahead = true;
}

void zero_crossing_open(zero_crossing_t *self, uint32_t sector, bool reverse, uint32_t since)
{
    const zero_crossing_t opened = {.sector = (uint8_t)sector,
                                    .leg = sector_legs(sector, reverse).open,
                                    .rising = sector_rising(sector),
                                    .open_since = since,
                                    .at = since};
    *self = opened;
}

bool zero_crossing_step(zero_crossing_t *self, const zero_crossing_config_t *config, const zero_sample_t *in,
                        zero_instant_t when, const zero_expected_t *expected)
{
    if (when.at - self->open_since < config->blank) {
        return false;
    }
    const bool rising = self->rising;
    const pm_q_t v =
        config->reference == ZERO_VIRTUAL ? virtual_third_terminal(in, when.legs) : in->v[self->leg];
    const pm_q_t within = when.legs == ZERO_LEGS_HIGH ? -config->rail : config->rail;
    const bool low = v <= config->rail, high = v >= in->v_dc - within;
    const bool past = rising ? high : low;
    const bool cut = rising ? low : high;
    if ((past && !self->ahead) || (cut && when.legs == ZERO_LEGS_APART)) {
        return false; /* freewheeling, of a braking current at the other rail */
    }
    const pm_q_t difference = against_reference(config, in, when.legs, v);
    const pm_q_t threshold = when.legs == ZERO_LEGS_APART ? expected->threshold : 0;
    const pm_q_t y = (rising ? difference : -difference) - threshold;
    if (!self->ahead && pm_abs(y) < expected->seen) {
        return false;
    }
    const bool at_rest = y < 0 && past && rests(config, self, when.legs, v);
    if ((y < 0 || cut) && !at_rest) {
        advance(self, when.at, y, cut);
        return false;
    }
    if (self->ahead && !self->cut && !past) {
        self->at = between(self, when.at, y);
    } else {
        const pm_q_t swing = zero_crossing_swing(config, expected->t_60);
        if (at_rest && when.at - self->at < rise(config, swing, expected->t_60, -self->y)) {
            return false;
        }
        if (!self->ahead && !believed(self, when.at, y, expected, swing)) {
            return false;
        }
        self->at = by_slope(self, config, when.at, y, past, swing, expected->t_60);
    }
    self->found = true;
    return true;
}
