#include "firmware/control/finite_set.h"

#include "firmware/math/legs.h"

#if PM_CARRIES(NEEDS_HELD)

#define SECTORS 6U
/* Wide enough for any voltage that deadbeat control asks for. */
#define V_ANY PM_Q(7.9)

#define HIGH PM_LEG_HIGH
#define LOW  PM_LEG_LOW

/* Of e_0 ... e_5. */
static const uint16_t legs_of[SECTORS] = {
    PM_LEGS_OF(HIGH, LOW, LOW),  PM_LEGS_OF(HIGH, HIGH, LOW), PM_LEGS_OF(LOW, HIGH, LOW),
    PM_LEGS_OF(LOW, HIGH, HIGH), PM_LEGS_OF(LOW, LOW, HIGH),  PM_LEGS_OF(HIGH, LOW, HIGH),
};

void finite_set_reset(finite_set_t *self, const finite_set_config_t *config, pm_dq_t v, pm_dq_t i,
                      pm_q_t omega)
{
    deadbeat_reset(&self->deadbeat, &config->deadbeat, v, i, omega);
    self->legs = PM_LEGS_ALL(PM_LEG_LOW);
}

/* The zero state that is nearer to what the legs do now: at most one of them moves. */
static uint16_t nearer_zero(uint16_t legs)
{
    const uint32_t high =
        (legs == PM_LEGS_ALL(HIGH) || legs == legs_of[1] || legs == legs_of[3] || legs == legs_of[5])
            ? (uint32_t)HIGH
            : (uint32_t)LOW;
    return PM_LEGS_ALL(high);
}

typedef struct {
    uint32_t sector;
    pm_q_t along; /* v . e */
} nearest_t;

static inline nearest_t better(nearest_t best, uint32_t sector, pm_q_t along)
{
    nearest_t n = best;
    if (along > n.along) {
        n = (nearest_t){.sector = sector, .along = along};
    }
    if (-along > n.along) {
        n = (nearest_t){.sector = sector + SECTORS / 2U, .along = -along};
    }
    return n;
}

static nearest_t nearest_to(pm_ab_t v)
{
    const pm_q_t half_alpha = pm_half(v.alpha);
    const pm_q_t beside = pm_mulh_sub(v.beta, v.beta, PM_FRAC(0.133974596215561353)); /* sqrt(3)/2 beta */
    nearest_t n = better((nearest_t){.sector = 0, .along = 0}, 0U, v.alpha);
    n = better(n, 1U, half_alpha + beside);
    return better(n, 2U, beside - half_alpha);
}

static pm_ab_t voltage_of(uint32_t sector, pm_q_t v_dc)
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

void finite_set_step(finite_set_t *self, const finite_set_config_t *config, const regulator_in_t *in,
                     regulator_out_t *out)
{
    regulator_in_t any = *in;
    any.v_max = V_ANY;
    regulator_out_t wanted = {.limited = false};
    deadbeat_step(&self->deadbeat, &config->deadbeat, &any, &wanted);
    /* Q25 with a direction of Q30: Q23. Far beyond the link, only the direction counts. */
    const pm_dq_t v = {.d = pm_shl(pm_sat(wanted.v.d, 28), 3), .q = pm_shl(pm_sat(wanted.v.q, 28), 3)};
    const nearest_t n = nearest_to(pm_park_inverse_quarter(v, in->ahead));
    const pm_q_t third = pm_frac(in->v_dc, PM_FRAC(1.0 / 3 / 32)); /* Q23 */
    pm_ab_t given = {.alpha = 0, .beta = 0};
    if (n.along > third) {
        given = voltage_of(n.sector, in->v_dc);
        self->legs = legs_of[n.sector];
    } else {
        self->legs = nearer_zero(self->legs);
    }
    /* Q26 */
    const pm_dq_t dq = {.d = pm_mulh_add(pm_mulh(given.alpha, in->ahead.cos), given.beta, in->ahead.sin),
                        .q = pm_mulh_sub(pm_mulh(given.beta, in->ahead.cos), given.alpha, in->ahead.sin)};
    self->deadbeat.v = (pm_dq_t){.d = pm_shl(dq.d, 2), .q = pm_shl(dq.q, 2)};
    out->v = (pm_dq_t){.d = pm_widen(self->deadbeat.v.d), .q = pm_widen(self->deadbeat.v.q)};
    out->legs = self->legs;
    const pm_wide_t beyond = pm_widen(in->v_dc);
    out->limited = out->limited || pm_abs(wanted.v.d) > beyond || pm_abs(wanted.v.q) > beyond;
}

void finite_set_slow_down(finite_set_config_t *config, pm_unit_t share)
{
    deadbeat_slow_down(&config->deadbeat, share);
}

#endif
