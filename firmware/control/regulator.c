#include "firmware/control/regulator.h"

#include "firmware/math/compiler.h"
#include "firmware/math/measure.h"

#define PM_METHOD(name, help, traits, needs) PM_CHECK_NEEDS(name, needs)
#include "firmware/control/regulators.def"
#undef PM_METHOD

/* One case for each of the list that the image has. */

void regulator_reset(regulator_t *self, const regulator_config_t *config, pm_dq_t v, pm_dq_t i, pm_q_t omega)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case REGULATOR_##name : name##_reset(&self->name, &config->name, v, i, omega); break;)
#include "firmware/control/regulators.def"
#undef PM_METHOD
    case REGULATOR_COUNT:
    default:
        break;
    }
}

void regulator_slow_down(regulator_config_t *config, pm_unit_t share)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case REGULATOR_##name : name##_slow_down(&config->name, share); break;)
#include "firmware/control/regulators.def"
#undef PM_METHOD
    case REGULATOR_COUNT:
    default:
        break;
    }
}

/* The one that regulator_step() has compiled into its caller is not called here a second time. */
#define OTHER_STEP(name)                                                                                     \
    if (REGULATOR_##name != REGULATOR_INLINE) {                                                              \
        name##_step(&self->name, &config->name, in, out);                                                    \
    }

PM_APART void regulator_step_other(regulator_t *self, const regulator_config_t *config,
                                   const regulator_in_t *in, regulator_out_t *out)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case REGULATOR_##name : OTHER_STEP(name) break;)
#include "firmware/control/regulators.def"
#undef PM_METHOD
    case REGULATOR_COUNT:
    default:
        out->v = (pm_dq_t){0, 0};
        break;
    }
}
