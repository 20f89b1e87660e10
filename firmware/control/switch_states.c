#include "firmware/control/switch_states.h"

#define HIGH PM_LEG_HIGH
#define LOW  PM_LEG_LOW

const uint16_t switch_legs[SWITCH_SECTORS] = {
    PM_LEGS_OF(HIGH, LOW, LOW),  PM_LEGS_OF(HIGH, HIGH, LOW), PM_LEGS_OF(LOW, HIGH, LOW),
    PM_LEGS_OF(LOW, HIGH, HIGH), PM_LEGS_OF(LOW, LOW, HIGH),  PM_LEGS_OF(HIGH, LOW, HIGH),
};

uint16_t switch_zero(uint16_t legs)
{
    const uint32_t high = (legs == PM_LEGS_ALL(HIGH) || legs == switch_legs[1] || legs == switch_legs[3] ||
                           legs == switch_legs[5])
                              ? (uint32_t)HIGH
                              : (uint32_t)LOW;
    return PM_LEGS_ALL(high);
}

static inline switch_nearest_t better(switch_nearest_t best, uint32_t sector, pm_q_t along)
{
    switch_nearest_t n = best;
    if (along > n.along) {
        n = (switch_nearest_t){.sector = sector, .along = along};
    }
    if (-along > n.along) {
        n = (switch_nearest_t){.sector = sector + SWITCH_SECTORS / 2U, .along = -along};
    }
    return n;
}

switch_nearest_t switch_nearest(pm_ab_t x)
{
    const pm_q_t half_alpha = pm_half(x.alpha);
    const pm_q_t beside = pm_mulh_sub(x.beta, x.beta, PM_FRAC(0.133974596215561353)); /* sqrt(3)/2 beta */
    switch_nearest_t n = better((switch_nearest_t){.sector = 0, .along = 0}, 0U, x.alpha);
    n = better(n, 1U, half_alpha + beside);
    return better(n, 2U, beside - half_alpha);
}

static pm_ab_t in_stator(uint32_t sector, pm_q_t v_dc)
{
    const pm_q_t third = pm_frac(v_dc, PM_FRAC(1.0 / 3));
    const pm_q_t beta = pm_shl(pm_frac(v_dc, PM_FRAC(0.288675134594812882)), 1); /* v_dc / sqrt(3) */
    const pm_q_t alpha = (sector % 3U == 0U) ? pm_shl(third, 1) : third;
    pm_ab_t v = {.alpha = (sector >= 2U && sector <= 4U) ? -alpha : alpha, .beta = 0};
    if (sector % 3U != 0U) {
        v.beta = sector < 3U ? beta : -beta;
    }
    return v;
}

pm_dq_t switch_voltage(uint32_t sector, pm_q_t v_dc, pm_half_dir_t frame)
{
    const pm_ab_t v = in_stator(sector, v_dc);
    const pm_dq_t quarter = {.d = pm_mulh_add(pm_mulh(v.alpha, frame.cos), v.beta, frame.sin),
                             .q = pm_mulh_sub(pm_mulh(v.beta, frame.cos), v.alpha, frame.sin)};
    return (pm_dq_t){.d = pm_shl(quarter.d, 2), .q = pm_shl(quarter.q, 2)};
}
