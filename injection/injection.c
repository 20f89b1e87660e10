#include "injection/injection.h"

#include "firmware/math/compiler.h"
#include "firmware/math/filter.h"
#include "firmware/math/image.h"
#include "firmware/math/measure.h"

#define PM_METHOD(name, help, traits, needs) PM_CHECK_NEEDS(name, needs)
#include "injection/injections.def"
#undef PM_METHOD

/* One case for each of the list that the image has. */

void injection_reset(injection_t *self, const injection_config_t *config, const obs_in_t *in)
{
#if PM_HAS(injection_stages)
    injection_stages_reset(&self->stages, &config->stages);
#endif
#if INJECTION_LOW_PASS
    self->eps = 0;
#endif
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case INJECTION_##name : name##_reset(&self->name, &config->name, in); break;)
#include "injection/injections.def"
#undef PM_METHOD
    case INJECTION_COUNT:
    default:
        break;
    }
}

/* The one that injection_step() has compiled into its caller is not called here a second time but with stages. */
#define OTHER_STEP(name)                                                                                     \
    if ((INJECTION_##name != INJECTION_INLINE || PM_HAS(injection_stages) != 0) &&                           \
        !(INJECTION_NEUTRAL && INJECTION_##name == INJECTION_zero_anti_rotating)) {                          \
        name##_step(&self->name, &config->name, in, out);                                                    \
    }

static inline void step_of(injection_t *self, const injection_config_t *config, const injection_in_t *in,
                           injection_out_t *out)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case INJECTION_##name : OTHER_STEP(name) break;)
#include "injection/injections.def"
#undef PM_METHOD
    case INJECTION_COUNT:
    default:
        *out = (injection_out_t){0};
        break;
    }
}

static inline void step_in_stages(injection_t *self, const injection_config_t *config,
                                  const injection_in_t *in, injection_out_t *out)
{
#if PM_HAS(injection_stages)
    if (config->stages.on) {
        injection_in_t turned;
        injection_stages_before(&self->stages, &config->stages, in, &turned);
        step_of(self, config, &turned, out);
        injection_stages_after(&self->stages, &config->stages, in, out);
        return;
    }
#endif
    step_of(self, config, in, out);
}

PM_APART void injection_step_other(injection_t *self, const injection_config_t *config,
                                   const injection_in_t *in, injection_out_t *out)
{
    step_in_stages(self, config, in, out);
#if INJECTION_LOW_PASS
    if (config->smooth != 0) {
        out->eps = pm_lp1(&self->eps, out->eps, config->smooth);
    }
#endif
}

void injection_slow(injection_t *self, const injection_config_t *config, const obs_in_t *in)
{
#if PM_HAS(injection_stages)
    if (config->stages.on) {
        injection_stages_slow(&self->stages, &config->stages, in, injection_last(self, config).vector.d);
    }
#endif
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case INJECTION_##name : name##_slow(&self->name, &config->name, in); break;)
#include "injection/injections.def"
#undef PM_METHOD
    case INJECTION_COUNT:
    default:
        break;
    }
}

obs_out_t injection_last(const injection_t *self, const injection_config_t *config)
{
    switch (config->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case INJECTION_##name : return name##_last(&self->name, &config->name);)
#include "injection/injections.def"
#undef PM_METHOD
    case INJECTION_COUNT:
    default:
        return (obs_out_t){0};
    }
}
