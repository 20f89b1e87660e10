#include "firmware/control/modulator.h"

#include "firmware/math/compiler.h"
#include "firmware/math/pair.h"

void modulator_slow(modulator_t *self, const modulator_config_t *config, pm_q_t v_dc)
{
    const int32_t per_volt = pm_counts_per_unit(config->per_unit, v_dc);
    const int32_t lost = config->dead_counts + pm_mulh(config->drop, per_volt);
    self->lost = config->compensate ? pm_shl(pm_sat(lost, PM_ZONE_BITS - 1), 32 - PM_ZONE_BITS) : 0;
}

/* What the legs have in common is free, so they are written about that of phase A that makes b = -c: then the
 * middle of the largest and the smallest is half of what a exceeds -|b| ... |b| by. */
static inline pm_abc_t centred(pm_ab_t v)
{
    const pm_q_t a = v.alpha + pm_half(v.alpha);
    const pm_q_t b = pm_mulh_sub(v.beta, v.beta, PM_FRAC(0.133974596215561353)); /* 1 - sqrt(3)/2 */
    const pm_q_t size = pm_magnitude(b);
    const pm_q_t zero = pm_half(a - pm_clamp(a, -size, size));
    return (pm_abc_t){.a = a - zero, .b = b - zero, .c = b + zero}; /* c reversed */
}

static inline pm_abc_t lost_by(const modulator_config_t *config, pm_ab_t i)
{
    const pm_pair_t zone = pm_pair(&config->zone_alpha, &config->zone_beta);
    const int32_t a = pm_mulh(i.alpha, zone.first);
    const int32_t y = pm_mulh(i.beta, zone.second);
    return (pm_abc_t){.a = a, .b = y - pm_half(a), .c = y + pm_half(a)}; /* c reversed */
}

static inline void set_legs(const modulator_t *self, const modulator_config_t *config, pm_ab_t v, pm_q_t v_dc,
                            pm_ab_t i_quarter, int32_t *on)
{
    const int32_t centre = pm_half(config->counts);
    const int32_t per_volt = pm_counts_per_unit(config->per_unit, v_dc);
    const pm_abc_t i = lost_by(config, i_quarter);
    const pm_abc_t u = centred(v);
    on[0] = pm_zone_add(pm_mulh_add(centre, u.a, per_volt), i.a, self->lost);
    on[1] = pm_zone_add(pm_mulh_add(centre, u.b, per_volt), i.b, self->lost);
    on[2] = pm_zone_sub(pm_mulh_sub(centre, u.c, per_volt), i.c, self->lost);
}

/* Scales v to the hexagon: the span of its phases becomes the link voltage. */
static bool shorten(pm_ab_t *v, pm_q_t v_dc)
{
    const pm_abc_t u = pm_clarke_inverse(*v);
    const pm_q_t top = pm_max(u.a, pm_max(u.b, u.c));
    const pm_q_t bottom = pm_min(u.a, pm_min(u.b, u.c));
    if (top - bottom <= v_dc) {
        return false;
    }
    const pm_unit_t ratio = pm_ratio(v_dc, top - bottom);
    *v = (pm_ab_t){.alpha = pm_unit(v->alpha, ratio), .beta = pm_unit(v->beta, ratio)};
    return true;
}

/* Beyond the rails: by the voltage asked for, by compensation, or by rounding. */
PM_RARE static void hold_to_rails(modulator_t *self, const modulator_config_t *config, pm_q_t v_dc,
                                  pm_ab_t i_quarter, modulator_out_t *out)
{
    out->limited = shorten(&out->v, v_dc);
    if (out->limited) {
        self->limited = true;
        set_legs(self, config, out->v, v_dc, i_quarter, out->on);
    }
    out->on[0] = pm_clamp(out->on[0], 0, config->counts);
    out->on[1] = pm_clamp(out->on[1], 0, config->counts);
    out->on[2] = pm_clamp(out->on[2], 0, config->counts);
}

void modulator_step(modulator_t *self, const modulator_config_t *config, pm_ab_t v, pm_q_t v_dc,
                    pm_ab_t i_quarter, modulator_out_t *out)
{
    const int32_t counts = config->counts;
    int32_t on[3];
    set_legs(self, config, v, v_dc, i_quarter, on);
    if (pm_within(on[0], 0, counts) && pm_within(on[1], 0, counts) && pm_within(on[2], 0, counts)) {
        *out = (modulator_out_t){.on = {on[0], on[1], on[2]}, .v = v, .limited = false};
    } else {
        modulator_out_t held = {.on = {on[0], on[1], on[2]}, .v = v};
        hold_to_rails(self, config, v_dc, i_quarter, &held);
        *out = held;
    }
}
