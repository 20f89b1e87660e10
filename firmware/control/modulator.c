#include "firmware/control/modulator.h"

#include "firmware/math/compiler.h"
#include "firmware/math/pair.h"

/* Smallest and largest leg are +-size, or a itself when it lies beyond; c has the opposite sign. */
typedef struct {
    pm_abc_t leg;
    pm_q_t span; /* between the largest and the smallest */
} centred_t;

/* Length of (x, y), -1 to 8 %. */
static inline pm_q_t about_hypot(pm_q_t x, pm_q_t y)
{
    const pm_q_t a = pm_abs(x), b = pm_abs(y);
    return pm_max(a, b) + pm_frac(pm_min(a, b), PM_FRAC(0.4));
}

/* Of the half of what is lost that has the signs at the ends of a carrier's swing: the share that is there. */
static pm_unit_t beyond_swing(const modulator_config_t *config, pm_dq_t i)
{
    const pm_q_t size = pm_max(about_hypot(i.d, i.q), 1);
    const int32_t swing = (config->far[1] != 0U ? 8 : 2) * PM_ZONE_EDGE;
    const int32_t wide = swing / 4;
    const int32_t past = pm_mulh(size / 4, config->per_zone[1]) - (swing - swing / 10);
    if (past >= wide) {
        return PM_UNIT_MAX;
    }
    const pm_unit_t across = pm_ratio(pm_min(pm_abs(i.q), size), size);
    return past <= 0 ? across : across + pm_unit(PM_UNIT_MAX - across, pm_ratio(past, wide));
}

/* Edge of the zone over that which the ripple asks for, at most 1. */
static pm_unit_t beside_ripple(const modulator_config_t *config, int32_t per_volt, pm_ab_t v)
{
    const pm_q_t size = about_hypot(v.alpha, v.beta);
    const int32_t most = pm_mulh(size, config->ripple);
    if (most <= PM_ZONE_EDGE) {
        return PM_UNIT_MAX;
    }
    const int32_t active = pm_min(pm_mulh(size + pm_half(size), per_volt), PM_SHARE_ONE);
    const int32_t ripple = most - pm_times_share(most, active);
    return ripple > PM_ZONE_EDGE ? pm_ratio(PM_ZONE_EDGE, ripple) : PM_UNIT_MAX;
}

void modulator_slow(modulator_t *self, const modulator_config_t *config, pm_q_t v_dc, pm_ab_t v, pm_dq_t i)
{
    const int32_t per_volt = pm_per_volt(v_dc);
    const int32_t lost = config->dead + pm_mulh(config->drop, per_volt);
    const int32_t all = pm_shl(pm_sat(lost, PM_SHARE_BITS - 2), PM_HEIGHT_BITS);
    const uint32_t n = self->carrier ? 1U : 0U;
    self->zone_alpha = config->per_zone[n];
    self->far = all / 4 * (int32_t)config->far[n];
    if (config->per_zone[n] != config->per_zone[0]) {
        const int32_t none = pm_unit(pm_half(all), PM_UNIT_MAX - beyond_swing(config, i));
        self->near = all - self->far - (config->far[1] == 0U ? none : 0);
        self->far = pm_max(self->far - none, 0);
    } else {
        if (config->ripple != 0) {
            const pm_unit_t narrower = beside_ripple(config, per_volt, v);
            self->zone_alpha = pm_unit(self->zone_alpha, narrower);
            self->far = pm_unit(self->far, narrower);
        }
        self->near = all - self->far;
    }
    self->zone_beta =
        pm_mulh_sub(self->zone_alpha, self->zone_alpha, PM_FRAC(0.133974596)); /* 1 - sqrt(3)/2 */
    self->room = PM_UNIT_MAX;
    if (config->top != PM_SHARE_ONE) {
        const int32_t may_lose = pm_sat(lost, PM_SHARE_BITS - 2);
        self->lowest = config->dead + may_lose;
        self->seen = config->top - may_lose - MODULATOR_ROUNDING;
        self->room = pm_share_to_unit(2 * self->seen - PM_SHARE_ONE);
        const int32_t all_seen = self->seen - self->lowest - MODULATOR_ROUNDING;
        self->per_seen = self->carrier ? pm_div(PM_ONE, pm_shl(all_seen, PM_Q_BITS - PM_SHARE_BITS)) : PM_ONE;
    }
}

/* The common part of the legs is free. Here it is that of phase A with b = -c: then the mean of the smallest
 * and the largest leg is half of what a exceeds -|b| ... |b| by. */
static inline centred_t centred(pm_ab_t v)
{
    const pm_q_t a = v.alpha + pm_half(v.alpha);
    const pm_q_t b = pm_mulh_sub(v.beta, v.beta, PM_FRAC(0.133974596215561353)); /* 1 - sqrt(3)/2 */
    const pm_q_t size = pm_magnitude(b);
    const pm_q_t beyond = pm_max(a - size, 0) + pm_min(a + size, 0); /* of -size ... size; one of both is 0 */
    const pm_q_t zero = pm_half(beyond);
    return (centred_t){
        .leg = {.a = a - zero, .b = b - zero, .c = b + zero},
        .span = size + size + pm_magnitude(beyond),
    };
}

static inline pm_abc_t lost_by(const modulator_t *self, pm_ab_t i)
{
    const pm_pair_t zone = pm_pair(&self->zone_alpha, &self->zone_beta);
    const int32_t a = pm_mulh(i.alpha, zone.first);
    const int32_t y = pm_mulh(i.beta, zone.second);
    return (pm_abc_t){.a = a, .b = y - pm_half(a), .c = y + pm_half(a)}; /* c has the opposite sign */
}

/* Both parts, the second with an edge eight times as far: one saturation each. */
static inline int32_t zones_add(int32_t sum, int32_t x, pm_pair_t height)
{
    const int32_t near = pm_zone_add(sum, x, height.first);
    return pm_mulh_add(near, pm_shl_sat(x, PM_ZONE_LIFT - 3, PM_ZONE_BITS + PM_ZONE_LIFT), height.second);
}

static inline int32_t zones_sub(int32_t sum, int32_t x, pm_pair_t height)
{
    const int32_t near = pm_zone_sub(sum, x, height.first);
    return pm_mulh_sub(near, pm_shl_sat(x, PM_ZONE_LIFT - 3, PM_ZONE_BITS + PM_ZONE_LIFT), height.second);
}

/* A bit: 1, 2 or 4. */
static inline int32_t largest(const pm_abc_t *leg)
{
    const bool b = leg->b > leg->a;
    const bool c = -leg->c > pm_max(leg->a, leg->b);
    return c ? 4 : b ? 2 : 1;
}

/* Legs as shares of the period, around `centre`, with what they lose; i_zero: what each carries beside the vector, as lost_by() has it. */
static inline void write_shares(const modulator_t *self, const modulator_config_t *config, const centred_t *u,
                                int32_t centre, int32_t per_volt, pm_ab_t i_quarter, int32_t i_zero,
                                modulator_out_t *out)
{
    const pm_abc_t x = lost_by(self, i_quarter);
    const pm_abc_t i = {
        .a = x.a + i_zero, .b = x.b + i_zero, .c = x.c - i_zero}; /* c has the opposite sign */
    const int32_t whole = config->whole;
    const pm_pair_t lost = pm_pair(&self->near, &self->far);
    const int32_t a = zones_add(pm_mulh_add(centre, u->leg.a, per_volt), i.a, lost);
    const int32_t b = zones_add(pm_mulh_add(centre, u->leg.b, per_volt), i.b, lost);
    const int32_t c = zones_sub(pm_mulh_sub(centre, u->leg.c, per_volt), i.c, lost);
    out->on[0] = pm_share_of(a, whole);
    out->on[1] = pm_share_of(b, whole);
    out->on[2] = pm_share_of(c, whole);
}

/* Beyond the hexagon the span becomes the whole period: the vector is shortened along its own direction. */
static inline pm_ab_t shorten(modulator_t *self, pm_ab_t v, pm_q_t v_dc, int32_t per_volt)
{
    const int32_t ratio = pm_mulh(v_dc, per_volt); /* 1 and a little when the span is just too large */
    self->limited = ratio;
    return (pm_ab_t){.alpha = pm_times_share(v.alpha, ratio), .beta = pm_times_share(v.beta, ratio)};
}

/* Where a low-side shunt would not see the largest leg, the legs are as low as they can be. */
static inline void lower(modulator_t *self, const modulator_config_t *config, const centred_t *u, pm_q_t v_dc,
                         pm_ab_t i_quarter, modulator_out_t *out)
{
    const pm_q_t needed = pm_mul_sat(u->span, self->per_seen);
    const int32_t per_volt = pm_per_volt(pm_max(needed, v_dc));
    if (needed > v_dc) {
        out->v = shorten(self, out->v, v_dc, per_volt);
    }
    const int32_t half = pm_mulh(pm_half(u->span), per_volt);
    const int32_t centre = pm_min(self->lowest + half, PM_SHARE_HALF);
    if (centre + half > self->seen) {
        self->hidden += MODULATOR_NEXT * largest(&u->leg);
    }
    write_shares(self, config, u, centre, per_volt, i_quarter, 0, out);
}

void modulator_step(modulator_t *self, const modulator_config_t *config, pm_ab_t v, pm_q_t v_dc,
                    pm_ab_t i_quarter, modulator_out_t *out)
{
    const centred_t u = centred(v);
    pm_q_t link = v_dc;
    out->v = v;
    if (pm_rarely(pm_half(u.span) > pm_mulh(v_dc, self->room))) {
        if (pm_rarely(config->top != PM_SHARE_ONE)) {
            lower(self, config, &u, v_dc, i_quarter, out);
            return;
        }
        link = u.span;
        out->v = shorten(self, v, v_dc, pm_per_volt(link));
    }
    write_shares(self, config, &u, PM_SHARE_HALF, pm_per_volt(link), i_quarter, 0, out);
}

#if PM_CARRIES(NEEDS_BRIDGES)
pm_q_t modulator_step_zero(modulator_t *self, const modulator_config_t *config, const modulator_zero_t *in,
                           pm_q_t v_dc, modulator_out_t *out)
{
    const centred_t u = centred(in->v);
    const pm_q_t span = u.span + 2 * pm_magnitude(in->v_zero);
    const pm_q_t link = pm_max(span, v_dc);
    const int32_t per_volt = pm_per_volt(link);
    pm_q_t v_zero = in->v_zero;
    out->v = in->v;
    if (span > v_dc) {
        out->v = shorten(self, in->v, v_dc, per_volt);
        v_zero = pm_times_share(v_zero, self->limited);
    }
    const int32_t centre = pm_mulh_add(PM_SHARE_HALF, in->v_zero, per_volt);
    const int32_t i_zero = pm_mulh(in->i_zero_quarter, self->zone_alpha);
    write_shares(self, config, &u, centre, per_volt, in->i_quarter, i_zero, out);
    return v_zero;
}
#endif

#if REGULATION_HOLDS
/* Share of the period that a leg misses, Q20; lost: with the sign of its current. */
static int32_t missed(pm_leg_t from, pm_leg_t to, int32_t dead, int32_t lost)
{
    if (from == PM_LEG_LOW && to == PM_LEG_HIGH) {
        return -pm_clamp(dead + lost, 0, dead);
    }
    if (from == PM_LEG_HIGH && to == PM_LEG_LOW) {
        return pm_clamp(dead - lost, 0, dead);
    }
    return 0;
}

pm_ab_t modulator_edges(const modulator_t *self, const modulator_config_t *config, uint16_t from, uint16_t to,
                        pm_abc_t i, pm_q_t v_dc)
{
    if (from == to || self->zone_alpha == 0) {
        return (pm_ab_t){.alpha = 0, .beta = 0};
    }
    const pm_q_t current[PM_LEGS] = {i.a, i.b, i.c};
    const pm_pair_t height = pm_pair(&self->near, &self->far);
    pm_q_t v[PM_LEGS];
    for (uint32_t leg = 0; leg < PM_LEGS; leg++) {
        const int32_t lost = zones_add(0, pm_mulh(current[leg] / 4, self->zone_alpha), height);
        const int32_t share = missed(pm_leg(from, leg), pm_leg(to, leg), config->dead, lost);
        v[leg] = pm_frac(v_dc, pm_shl(share, 32 - PM_SHARE_BITS));
    }
    return pm_clarke((pm_abc_t){.a = v[0], .b = v[1], .c = v[2]});
}
#endif

#if PM_CARRIES(NEEDS_HALVES)
/* By how much all legs must move to lie within 0 ... top. */
static int32_t into_range(const int32_t on[PM_LEGS], int32_t top)
{
    const int32_t lowest = pm_min(on[0], pm_min(on[1], on[2]));
    const int32_t highest = pm_max(on[0], pm_max(on[1], on[2]));
    return lowest < 0 ? -lowest : pm_min(0, top - highest);
}

void modulator_split(modulator_t *self, const modulator_config_t *config, pm_ab_t split, pm_q_t v_dc,
                     uint16_t (*compare)[2])
{
    if (split.alpha == 0 && split.beta == 0) {
        return;
    }
    const int32_t per_volt = pm_per_volt(v_dc);
    const int32_t counts = pm_shl(config->counts, 32 - PM_SHARE_BITS);
    const pm_abc_t u = pm_clarke_inverse(split);
    const int32_t shift[PM_LEGS] = {pm_mulh(pm_mulh(u.a, per_volt), counts),
                                    pm_mulh(pm_mulh(u.b, per_volt), counts),
                                    pm_mulh(pm_mulh(u.c, per_volt), counts)};
    for (uint32_t half = 0; half < 2U; half++) {
        int32_t on[PM_LEGS];
        for (uint32_t leg = 0; leg < PM_LEGS; leg++) {
            on[leg] = (int32_t)compare[leg][half] + (half == 0U ? shift[leg] : -shift[leg]);
        }
        const int32_t move = into_range(on, config->counts);
        for (uint32_t leg = 0; leg < PM_LEGS; leg++) {
            const int32_t fits = pm_clamp(on[leg] + move, 0, config->counts);
            if (fits != on[leg] + move) {
                self->limited = pm_shl(1, PM_SHARE_BITS);
            }
            compare[leg][half] = (uint16_t)fits;
        }
    }
}
#endif
