/* Any of the fundamental-model observers, chosen by the configuration. Comparison (METHODS.md 2.3.3, row 17):
 * docs/results/observers.md.
 *
 * Every observer of observers.def is a source (firmware/math/estimate.h) with these functions. self is its
 * state; config is const and made from the machine in model.h and a few gains:
 *   x_reset(self, config, in)              sets every member for the given position, so that no transient
 *                                          follows if it is right; also before the first step
 *   x_step(self, config, in, out)          one period; no division, no root: those belong to x_slow
 *   x_last(self)                           the result of the last step again (eps = 0 after x_reset)
 *   x_slow(self, config, in, out, weight)  at 1 kHz, with in (i_dq, omega) and out of the last step.
 *                                          weight 0: another source leads, and the state is tied to the
 *                                          present position; above 0 it is free; PM_ONE: it leads
 *   x_tie(self, config)                    the position is imposed from outside (alignment, open-loop start):
 *                                          the state stays tied to it until the next x_slow, without
 *                                          adaptation
 * A configuration may change its values at any time between two steps. If its id changes, observer_reset()
 * with the new one must follow.
 *
 * Cost of the dispatch: three instructions for active_flux, which is inlined into the caller; a call for the
 * others. Tests: tests/contract/observer_contract_test.cpp runs the whole list, tests/target/observers counts
 * instructions. */
#ifndef OBSERVERS_OBSERVER_H
#define OBSERVERS_OBSERVER_H

#include "firmware/math/image.h"
#include "observers/methods.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
#define PM_METHOD(name, help, traits, needs) OBSERVER_##name,
#include "observers/observers.def"
#undef PM_METHOD
    OBSERVER_COUNT
} observer_id_t;

#define OBSERVER_INLINE OBSERVER_active_flux /* the default costs no call */
/* Those that observer_step() does not hand to observer_step_other(). */
#define OBSERVER_IS_NEAR(name) (OBSERVER_##name == OBSERVER_INLINE || OBSERVER_##name == OBSERVER_zero_vector)
/* How many others the image has: with 0 the call is left out. Without zero_vector it is one more than there are, since leaving the call
 * out costs such an image an instruction. */
enum {
    OBSERVERS_OTHER = (PM_HAS(zero_vector) != 0 ? 0 : 1)
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, +(OBSERVER_IS_NEAR(name) ? 0 : 1))
#include "observers/observers.def"
#undef PM_METHOD
};

typedef struct {
    observer_id_t id;
    union {
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, name##_config_t name;)
#include "observers/observers.def"
#undef PM_METHOD
    };
} observer_config_t;

typedef union {
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, name##_t name;)
#include "observers/observers.def"
#undef PM_METHOD
} observer_t;

void observer_reset(observer_t *self, const observer_config_t *config, const obs_in_t *in);
obs_out_t observer_last(const observer_t *self, const observer_config_t *config);
void observer_slow(observer_t *self, const observer_config_t *config, const obs_in_t *in,
                   const obs_out_t *out, pm_q_t weight);
void observer_tie(observer_t *self, const observer_config_t *config);

/* observer_step() of all but the near ones. */
void observer_step_other(observer_t *self, const observer_config_t *config, const obs_in_t *in,
                         obs_out_t *out);

static inline void observer_step(observer_t *self, const observer_config_t *config, const obs_in_t *in,
                                 obs_out_t *out)
{
    if (__builtin_expect(config->id == OBSERVER_INLINE, 1) != 0) {
        active_flux_step(&self->active_flux, &config->active_flux, in, out);
#if PM_HAS(zero_vector) && PM_CARRIES(NEEDS_SECOND_SAMPLE)
    } else if (config->id == OBSERVER_zero_vector) { /* works in every second period */
        zero_vector_step(&self->zero_vector, &config->zero_vector, in, out);
#endif
    } else if (OBSERVERS_OTHER != 0) {
        /* Only this path needs them in memory; copied by members, so that elsewhere they stay in registers. */
        const obs_in_t given = {{in->v.alpha, in->v.beta},  {in->i.alpha, in->i.beta},
                                {in->dir.cos, in->dir.sin}, in->omega,
                                {in->i_dq.d, in->i_dq.q},   PM_IF_MEASURED(in->more)};
        obs_out_t result;
        observer_step_other(self, config, &given, &result);
        *out = result;
    } else {
        const obs_out_t none = {0, 0, {0, 0}};
        *out = none;
    }
}

uint32_t observer_traits(observer_id_t id); /* SOURCE_... */

void make_observer(maker_t *m, observer_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
