#include "injection/four_pulses.h"

#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define PULSES      4
#define THIRD       PM_Q(0.11) /* r */
#define CORRECTIONS 3

void four_pulses_reset(four_pulses_t *self)
{
    *self = (four_pulses_t){0};
}

/* That whose two poles are nearest: within 30 degrees of the axis, or of its opposite; 2 theta is then within 60 of twice
 * the axis: 0, 240 for the second, 120 for the third. No arctangent: it is within a period of control. */
static uint16_t nearest(pm_ab_t y)
{
    if (pm_mul(PM_Q(1.7320508), y.alpha) >= pm_abs(y.beta)) {
        return 0;
    }
    return y.beta > 0 ? 2U : 1U;
}

pm_procedure_t four_pulses_step(four_pulses_t *self, const pulses_config_t *config, pm_abc_t i,
                                pulses_out_t *out)
{
    const bool reverse = self->train.pulse == PULSES - 1U;
    const uint32_t axis = reverse ? self->axis : self->train.pulse;
    const pm_procedure_t result = pulses_step(&self->train, config, axis, reverse, i, out);
    if (result != PM_DONE) {
        return result;
    }
    if (!reverse) {
        pulses_add(&self->train, axis, false);
    }
    if (self->train.pulse == PULSES - 1U) {
        self->axis = nearest(pulses_saliency(&self->train));
    }
    return self->train.pulse < PULSES ? PM_RUNNING : PM_DONE;
}

/* Of the two angles whose double y has, that next to `theta`. */
static pm_angle_t half_angle(pm_ab_t y, pm_angle_t theta)
{
    const pm_angle_t half = pm_atan2(y.beta, y.alpha) / 2U;
    return pm_abs(pm_angle_diff(half, theta)) < (int32_t)PM_TURN(0.25) ? half : half + PM_TURN(0.5);
}

/* cos x + r cos 3 x */
static pm_q_t saturation(pm_angle_t x)
{
    return pm_unit(PM_ONE, pm_dir(x).cos) + pm_unit(THIRD, pm_dir(3U * x).cos);
}

/* One of the corrections. */
static void correct(four_pulses_t *self)
{
    pm_angle_t *theta = &self->train.found.theta;
    const pm_q_t bias =
        pm_div(pm_abs(self->D) / 2, pm_abs(saturation(*theta - pulses_axis[self->axis]))); /* 3 B */
    const pm_ab_t turned = pm_park_inverse((pm_dq_t){.d = bias, .q = 0}, pm_dir(0U - *theta));
    *theta = half_angle((pm_ab_t){.alpha = self->y.alpha - turned.alpha, .beta = self->y.beta - turned.beta},
                        *theta);
}

/* Of the vectors of the first three. */
static pm_ab_t sum(const pulses_t *train)
{
    pm_ab_t w = {0, 0};
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        const pm_ab_t i =
            pm_clarke((pm_abc_t){.a = train->e[x][0], .b = train->e[x][1], .c = train->e[x][2]});
        w.alpha += i.alpha;
        w.beta += i.beta;
    }
    return w;
}

static pm_procedure_t locate(four_pulses_t *self, const pulses_config_t *config)
{
    pulses_found_t *found = &self->train.found;
    self->y = pulses_saliency(&self->train);
    const pm_q_t length = pm_hypot(self->y.alpha, self->y.beta);
    const pm_sigma_t saliency = pulses_margin(length, pm_mul(PM_Q(2.12), config->i_noise));
    const pm_procedure_t result = pulses_salient(length, pulses_sum(&self->train), config->s_min, saliency);
    if (result != PM_DONE) {
        return result;
    }
    const pm_q_t reverse = pulses_leg(&self->train.i, self->axis);
    self->D = self->train.e[self->axis][self->axis] + reverse - pm_mul(self->train.g[self->axis], reverse);
    const pm_sigma_t polarity =
        pulses_polarity(self->D, config->i_bridge / 2, pm_mul(PM_Q(1.414), config->i_noise));
    if (polarity < PULSES_SURE) {
        return PM_FAILED_POLARITY;
    }
    found->theta = pm_atan2(self->y.beta, self->y.alpha) / 2U;
    const bool opposite = (self->D < 0) != (pm_dir(found->theta - pulses_axis[self->axis]).cos < 0);
    found->theta += opposite ? PM_TURN(0.5) : 0U;
    const pm_dq_t seen = pm_park(sum(&self->train), pm_dir(found->theta));
    if (seen.d < pm_abs(seen.q)) {
        return PM_FAILED_POLARITY;
    }
    found->margin = pm_min(polarity, saliency);
    return PM_RUNNING;
}

pm_procedure_t four_pulses_find(four_pulses_t *self, const pulses_config_t *config)
{
    const pm_procedure_t balanced = pulses_balance(&self->train);
    if (balanced != PM_DONE) {
        return balanced;
    }
    if (self->train.steps == PULSES_BALANCING + 1U) {
        return locate(self, config);
    }
    if (self->train.steps > PULSES_BALANCING + 1U + CORRECTIONS) {
        /* theta is of the end of the axis with B > 0 */
        self->train.found.theta += config->reversed ? PM_TURN(0.5) : 0U;
        return PM_DONE;
    }
    correct(self);
    return PM_RUNNING;
}
