#include "injection/primary.h"

#include "firmware/math/root.h"
#include "firmware/math/trig.h"

pm_procedure_t primary_polarity(const pm_q_t difference[PULSES_AXES], const primary_config_t *config,
                                pulses_found_t *found)
{
    const pm_ab_t w = pm_clarke((pm_abc_t){.a = difference[0], .b = difference[1], .c = difference[2]});
    return pulses_pole(w, &config->pole, found);
}

pm_procedure_t primary_locate(const primary_t *self, const primary_config_t *config, pulses_found_t *found)
{
    /* twice 120 degrees are 240, twice 240 are 120 */
    const pm_ab_t y = pm_clarke((pm_abc_t){.a = self->sum[0], .b = self->sum[2], .c = self->sum[1]});
    const pm_q_t length = pm_hypot(y.alpha, y.beta);
    found->theta = pm_atan2(y.beta, y.alpha) / 2U;
    found->margin = pulses_margin(length, config->pole.noise);
    const pm_q_t third = self->sum[0] / 3 + self->sum[1] / 3 + self->sum[2] / 3;
    const pm_procedure_t result = pulses_salient(length, third, config->s_min, found->margin);
    if (result != PM_DONE) {
        return result;
    }
    return primary_polarity(self->difference, config, found);
}
