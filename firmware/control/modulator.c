#include "firmware/control/modulator.h"

#include "firmware/math/root.h"

/* Scales v to the hexagon: the span of its phases becomes the link voltage. */
static pm_abc_t shorten(pm_abc_t u, pm_q_t span, pm_q_t v_dc, modulator_out_t *out)
{
    const pm_unit_t ratio = pm_ratio(v_dc, span);
    out->v = (pm_ab_t){.alpha = pm_unit(out->v.alpha, ratio), .beta = pm_unit(out->v.beta, ratio)};
    out->limited = true;
    return (pm_abc_t){.a = pm_unit(u.a, ratio), .b = pm_unit(u.b, ratio), .c = pm_unit(u.c, ratio)};
}

void modulator_step(const modulator_config_t *config, pm_ab_t v, pm_q_t v_dc, pm_ab_t i, modulator_out_t *out)
{
    out->v = v;
    out->limited = false;

    pm_abc_t u = pm_clarke_inverse(v);
    pm_q_t top = pm_max(u.a, pm_max(u.b, u.c));
    pm_q_t bottom = pm_min(u.a, pm_min(u.b, u.c));
    if (top - bottom > v_dc) {
        u = shorten(u, top - bottom, v_dc, out);
        top = pm_max(u.a, pm_max(u.b, u.c));
        bottom = pm_min(u.a, pm_min(u.b, u.c));
    }

    const int32_t per_volt = pm_counts_per_unit(config->counts, v_dc);
    const int32_t centre = pm_half(config->counts);
    const pm_q_t zero = pm_mean(top, bottom);
    int32_t a = centre + pm_mulh(u.a - zero, per_volt);
    int32_t b = centre + pm_mulh(u.b - zero, per_volt);
    int32_t c = centre + pm_mulh(u.c - zero, per_volt);

    if (config->compensate) {
        const pm_abc_t leg = pm_clarke_inverse(i);
        const int32_t lost = config->dead_counts + pm_mulh(config->drop, per_volt);
        a += pm_zone(leg.a, config->zone_gain, lost);
        b += pm_zone(leg.b, config->zone_gain, lost);
        c += pm_zone(leg.c, config->zone_gain, lost);
    }
    out->on[0] = a;
    out->on[1] = b;
    out->on[2] = c;
    /* rare: near the rails, by compensation or rounding */
    if (!pm_within(a, 0, config->counts) || !pm_within(b, 0, config->counts) ||
        !pm_within(c, 0, config->counts)) {
        out->on[0] = pm_clamp(a, 0, config->counts);
        out->on[1] = pm_clamp(b, 0, config->counts);
        out->on[2] = pm_clamp(c, 0, config->counts);
    }
}
