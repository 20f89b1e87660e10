#include "injection/boundary_detection.h"

#include "firmware/math/root.h"

#define NO_SECTOR 6
#define SECTOR    PM_TURN(1.0 / 12)
/* X of the machine whose y is |y|, six vectors, inverse, and the noise of X. */
#define Y_PER_X     PM_Q(0.866)
#define X_PER_NOISE PM_Q(3.5)

void boundary_detection_reset(boundary_detection_t *self)
{
    *self = (boundary_detection_t){0};
}

pm_procedure_t boundary_detection_step(boundary_detection_t *self, const pulses_config_t *config, pm_abc_t i,
                                       pulses_out_t *out)
{
    return basic_pulses_step(&self->pulses, config, i, out);
}

static void responses(const pulses_t *train, pm_q_t x[PULSES_AXES])
{
    for (uint32_t k = 0; k < PULSES_AXES; k++) {
        const uint32_t next = (k + 1U) % PULSES_AXES;
        const uint32_t last = (k + 2U) % PULSES_AXES;
        x[k] = train->e[k][next] - train->e[k][last] - train->e[next][next] + train->e[last][last];
    }
}

static uint32_t sector_of(const pm_q_t x[PULSES_AXES])
{
    static const uint8_t sectors[8] = {NO_SECTOR, 3, 5, 4, 1, 2, 0, NO_SECTOR};
    return sectors[(x[0] > 0 ? 4U : 0U) + (x[1] > 0 ? 2U : 0U) + (x[2] > 0 ? 1U : 0U)];
}

/* x_0 vanishes where the sectors 0 and 3 begin, x_1 one sector behind, x_2 two. */
static pm_angle_t angle(const boundary_detection_config_t *own, uint32_t sector, const pm_q_t x[PULSES_AXES],
                        pm_q_t amplitude)
{
    const pm_q_t before = pm_abs(x[sector % PULSES_AXES]);
    const pm_q_t behind = pm_abs(x[(sector + 1U) % PULSES_AXES]);
    const pm_angle_t begin = sector * SECTOR;
    if (own->interpolated) {
        const pm_q_t share =
            pm_div(before, before + behind); /* their sum is 0.87 of the amplitude and more */
        return begin + (pm_angle_t)pm_shl(pm_mulh(share, (int32_t)(SECTOR * 4U)), 2); /* of Q28 */
    }
    const pm_q_t least = pm_mul(own->threshold, amplitude);
    if (before < least) {
        return begin;
    }
    return begin + (behind < least ? SECTOR : SECTOR / 2U);
}

static pm_procedure_t locate(boundary_detection_t *self, const pulses_config_t *config,
                             const boundary_detection_config_t *own)
{
    pulses_found_t *found = &self->pulses.train.found;
    const primary_config_t limits = basic_pulses_limits(config);
    pm_q_t x[PULSES_AXES];
    responses(&self->pulses.train, x);
    const pm_ab_t vector = pm_clarke((pm_abc_t){.a = x[0], .b = x[1], .c = x[2]});
    const pm_q_t amplitude = pm_hypot(vector.alpha, vector.beta);
    found->margin = pulses_margin(amplitude, pm_mul(X_PER_NOISE, config->i_noise));
    const pm_procedure_t result = pulses_salient(pm_mul(Y_PER_X, amplitude), pulses_sum(&self->pulses.train),
                                                 config->s_min, found->margin);
    if (result != PM_DONE) {
        return result;
    }
    const uint32_t sector = sector_of(x);
    if (sector == NO_SECTOR) {
        return PM_FAILED_UNEVEN;
    }
    found->theta = angle(own, sector, x, amplitude);
    return primary_polarity(self->pulses.difference, &limits, found);
}

pm_procedure_t boundary_detection_find(boundary_detection_t *self, const pulses_config_t *config,
                                       const boundary_detection_config_t *own)
{
    const pm_procedure_t balanced = pulses_balance(&self->pulses.train);
    return balanced == PM_DONE ? locate(self, config, own) : balanced;
}
