#include "bldc/zero_crossing.h"

#include "firmware/math/compiler.h"
#include "firmware/math/root.h"

static pm_q_t against_reference(const zero_crossing_config_t *config, const zero_sample_t *in,
                                zero_legs_t legs, pm_q_t v)
{
    if (config->reference == ZERO_LINK) {
        return v - pm_half((int32_t)legs * in->v_dc);
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

/* More than 15 degrees before the crossing is due. */
static bool is_early(uint32_t at, const zero_expected_t *expected)
{
    return (int32_t)(expected->at - at) > (int32_t)(expected->t_60 / 4U);
}

/* With the sample before, within four times what the EMF rises by in the time between and half of `rail`. */
static bool agrees(const zero_crossing_t *self, const zero_crossing_config_t *config, uint32_t at, pm_q_t y,
                   const zero_expected_t *expected)
{
    const uint32_t t = at - self->at, t_60 = expected->t_60;
    if (t >= t_60 / 4U) {
        return true;
    }
    const pm_q_t most = pm_unit(zero_crossing_swing(config, t_60), pm_ratio((pm_q_t)(4U * t), (pm_q_t)t_60));
    return pm_abs(y - self->y) <= most + pm_half(config->rail);
}

/* A first sample past the crossing: not on its way from the rail to the EMF. */
static bool believed(zero_crossing_t *self, const zero_crossing_config_t *config, uint32_t at, pm_q_t y,
                     const zero_expected_t *expected, pm_q_t swing)
{
    if (y > swing - pm_frac(swing, PM_FRAC(0.375))) {
        return false;
    }
    const bool again = self->past && (!is_early(at, expected) || agrees(self, config, at, y, expected));
    self->past = true;
    if (again || (int32_t)(at - expected->at) >= 0) {
        return true;
    }
    self->at = at;
    self->y = y;
    return false;
}

typedef struct {
    uint32_t at;
    pm_q_t y;
    bool past; /* the rail has cut it */
} late_t;

/* From the distance of the sample that no rail has cut. */
PM_APART static bool is_late(zero_crossing_t *self, const zero_crossing_config_t *config, late_t in,
                             const zero_expected_t *expected)
{
    const uint32_t t_60 = expected->t_60;
    const pm_q_t swing = zero_crossing_swing(config, t_60);
    if (!self->ahead && !believed(self, config, in.at, in.y, expected, swing)) {
        return false;
    }
    if (!in.past) {
        self->at = in.at - rise(config, swing, t_60, in.y);
        return true;
    }
    const uint32_t later = self->cut ? UINT32_MAX : rise(config, swing, t_60, -self->y);
    if (later < in.at - self->at) {
        self->at += later;
        return true;
    }
    self->at = in.y < 0 ? self->at : in.at; /* rests at the rail, or is due by this sample itself */
    return in.y >= 0;
}

void zero_crossing_open(zero_crossing_t *self, uint32_t sector, bool reverse, uint32_t since)
{
    self->sector = (uint8_t)sector;
    self->leg = sector_legs(sector, reverse).open;
    self->rising = sector_rising(sector);
    self->open_since = since;
    self->ahead = false;
    self->cut = false;
    self->past = false;
    self->found = false;
}

/* At the lower rail, where no diode conducts any more: of a rotor that is about to start all of its EMF is as near as that. */
static bool is_slow_emf(const zero_crossing_t *self, const zero_crossing_config_t *config, pm_q_t v,
                        zero_instant_t when, const zero_expected_t *expected)
{
    return when.legs == ZERO_LEGS_LOW && v > config->rail / 4 && expected->seen > 0 &&
           expected->seen < config->rail / 4 && when.at - self->open_since > expected->t_60 / 16U;
}

bool zero_crossing_step(zero_crossing_t *self, const zero_crossing_config_t *config, const zero_sample_t *in,
                        zero_instant_t when, const zero_expected_t *expected)
{
    if (when.at - self->open_since < config->blank) {
        return false;
    }
    const bool rising = self->rising;
    const pm_q_t v = in->v[self->leg];
    const pm_q_t within = when.legs == ZERO_LEGS_HIGH ? -config->rail : config->rail;
    bool past = false, cut = false;
    if (v <= config->rail || v >= in->v_dc - within) {
        const bool low = v <= config->rail && !is_slow_emf(self, config, v, when, expected);
        const bool high = v >= in->v_dc - within;
        past = rising ? high : low;
        cut = rising ? low : high;
        if ((past && !self->ahead) || (cut && when.legs == ZERO_LEGS_APART)) {
            return false; /* freewheeling, of a braking current at the other rail */
        }
    }
    const pm_q_t difference = against_reference(config, in, when.legs, v);
    const bool on = when.legs == ZERO_LEGS_APART;
    const pm_q_t threshold = on ? expected->threshold : 0;
    const pm_q_t y = (rising ? difference : -difference) - threshold;
    if (!self->ahead && pm_abs(y) < expected->seen) {
        return false;
    }
    const uint32_t at = on ? when.at + expected->moved : when.at;
    if (cut && self->ahead && !self->cut) {
        return false; /* tells less than the one before it */
    }
    if (cut || (y < 0 && !(past && v <= config->rail / 4))) {
        self->at = at;
        self->y = y;
        self->ahead = true;
        self->cut = cut;
        self->past = false;
        return false;
    }
    if (self->ahead && is_early(at, expected) && !agrees(self, config, at, y, expected)) {
        self->ahead = false; /* one of the two was on its way from a rail */
        self->at = at;
        self->y = y;
        self->past = true;
        return false;
    }
    if (self->ahead && !self->cut && !past) {
        self->at = between(self, at, y);
        self->found = true;
    } else {
        self->found = is_late(self, config, (late_t){at, y, past}, expected);
    }
    return self->found;
}
