#include "observers/observer.h"

#include "firmware/math/compiler.h"
#include "firmware/math/image.h"
#include "firmware/math/measure.h"

#define PM_METHOD(name, help, traits, needs) PM_CHECK_NEEDS(name, needs)
#include "observers/observers.def"
#undef PM_METHOD

/* One case for each of the list that the image has. */

void observer_reset(observer_t *self, const observer_config_t *config, const obs_in_t *in)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case OBSERVER_##name : name##_reset(&self->name, &config->name, in); break;)
#include "observers/observers.def"
#undef PM_METHOD
    case OBSERVER_COUNT:
    default:
        break;
    }
}

/* Those that observer_step() has compiled into its caller are not called here a second time. */
#define OTHER_STEP(name)                                                                                     \
    if (!OBSERVER_IS_NEAR(name)) {                                                                           \
        name##_step(&self->name, &config->name, in, out);                                                    \
    }

PM_APART void observer_step_other(observer_t *self, const observer_config_t *config, const obs_in_t *in,
                                  obs_out_t *out)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, case OBSERVER_##name : OTHER_STEP(name) break;)
#include "observers/observers.def"
#undef PM_METHOD
    case OBSERVER_COUNT:
    default:
        *out = (obs_out_t){0};
        break;
    }
}

obs_out_t observer_last(const observer_t *self, const observer_config_t *config)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case OBSERVER_##name : return name##_last(&self->name);)
#include "observers/observers.def"
#undef PM_METHOD
    case OBSERVER_COUNT:
    default:
        return (obs_out_t){0};
    }
}

void observer_slow(observer_t *self, const observer_config_t *config, const obs_in_t *in,
                   const obs_out_t *out, pm_q_t weight)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case OBSERVER_##name : name##_slow(&self->name, &config->name, in, out, weight); break;)
#include "observers/observers.def"
#undef PM_METHOD
    case OBSERVER_COUNT:
    default:
        break;
    }
}

void observer_tie(observer_t *self, const observer_config_t *config)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case OBSERVER_##name : name##_tie(&self->name, &config->name); break;)
#include "observers/observers.def"
#undef PM_METHOD
    case OBSERVER_COUNT:
    default:
        break;
    }
}
