/* Any of the low-speed sources, chosen by the configuration (METHODS.md chapters 4 and 5).
 *
 * A source is an excitation (carrier.h) and a demodulator of what it measures (difference of two samples;
 * window.h), with the saliency of the machine under load (saliency.h). It owes the contract of every position
 * source (firmware/math/estimate.h), and as it disturbs the current that it measures, it says what the
 * fundamental current is and what voltage it adds:
 *   x_reset(self, config, in)             seeds every member with the current of `in`
 *   x_step(self, config, in, out)         one period, before the observer, which takes the fundamental current
 *                                         out->i. No division, no root
 *   x_last(self)                          eps, misfit and vector of the last step again
 *   x_slow(self, config, in)              at 1 kHz, also after a reset: what depends on load and speed, for
 *                                         i_dq and omega of the last step
 *   make_x(maker, config)                 configuration from SI parameters (x_config.c)
 *   x_limits(maker)                       what the source asks of the loops while it leads
 *   x_answer(maker)                       amplitude of the answer at 45 degrees of error without load, in A
 *                                         of one sample with the noise of one sample
 *
 * The error signal goes to the loop through 1 / (1 + s / w_c) (4.5.2, row 45), of sources that ask for it (x_limits()) or with the
 * parameter `injection_filter`. With loop gains K_p = 2 zeta w_n, K_i = w_n^2 and T_d from position to error signal the loop is
 * stable with
 *   w_c > w / tan(atan(K_p w / K_i) - w T_d)
 *   w: where |K_p j w + K_i| = w^2 sqrt(1 + (w / w_c)^2); without delay w_c > K_i / K_p. Below it swings up.
 *
 * In period k the step takes the current sampled at k and gives the voltage for [k+1, k+2).
 *
 * Cost of the dispatch: three instructions for the default, which is compiled into the caller; a call for
 * the others. Tests: tests/contract/observer_contract_test.cpp runs all of the list,
 * tests/scenario/injection_filter.yaml. */
#ifndef INJECTION_INJECTION_H
#define INJECTION_INJECTION_H

#include "firmware/math/image.h"
#include "injection/injection_stages.h"
#include "injection/methods.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
#define PM_METHOD(name, help, traits, needs) INJECTION_##name,
#include "injection/injections.def"
#undef PM_METHOD
    INJECTION_COUNT
} injection_id_t;

#define INJECTION_INLINE INJECTION_pulsating_square /* the default costs no call */
/* nor does one more in programs that carry the neutral, unless stages stand before and behind it */
#define INJECTION_NEUTRAL                                                                                    \
    (PM_CARRIES(NEEDS_NEUTRAL) && PM_HAS(zero_anti_rotating) && !PM_HAS(injection_stages))

/* Some source has a window over a carrier, or the low-pass a parameter. */
#define INJECTION_LOW_PASS                                                                                   \
    (PM_HAS(injection_stages) || PM_HAS(rotating_sine) || PM_HAS(pulsating_sine) || PM_HAS(stationary_sine))

typedef struct {
    injection_id_t id;
    bool inlined; /* INJECTION_INLINE without stages and low-pass; only in images with those */
#if INJECTION_LOW_PASS
    pm_frac_t smooth; /* w_c T_s / (1 + w_c T_s); 0: no low-pass */
#endif
    pm_q_t reserve; /* voltage amplitude that control leaves to the carrier */
    union {
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, name##_config_t name;)
#include "injection/injections.def"
#undef PM_METHOD
    };
#if PM_HAS(injection_stages)
    injection_stages_config_t stages;
#endif
} injection_config_t;

typedef struct {
    union {
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, name##_t name;)
#include "injection/injections.def"
#undef PM_METHOD
    };
#if PM_HAS(injection_stages)
    injection_stages_t stages;
#endif
#if INJECTION_LOW_PASS
    pm_q_t eps; /* behind the low-pass */
#endif
} injection_t;

/* Compiled into the caller: the default, with nothing about it. */
static inline bool injection_is_inline(const injection_config_t *config)
{
#if PM_HAS(injection_stages)
    return config->inlined;
#else
    return config->id == INJECTION_INLINE;
#endif
}

uint32_t injection_traits(injection_id_t id); /* SOURCE_... */
void injection_reset(injection_t *self, const injection_config_t *config, const obs_in_t *in);
void injection_slow(injection_t *self, const injection_config_t *config, const obs_in_t *in);
obs_out_t injection_last(const injection_t *self, const injection_config_t *config);

/* Of the source that the parameter `injection` names. injection_sees_saliency(): the carrier is more than dead time and
 * devices take of it without load, its answer at 45 degrees of error is four times the noise, and some saliency is left at
 * half of rated current, at all of it for sources of the stator. make_injection() refuses a carrier below the first.
 * injection_current(): i_q up to which saturation leaves some. */
void make_injection(maker_t *m, injection_config_t *c);
injection_limits_t injection_limits(const maker_t *m);
bool injection_sees_saliency(const maker_t *m);
pm_q_t injection_current(maker_t *m);

/* injection_step() of all but those, and with stages of these too. */
void injection_step_other(injection_t *self, const injection_config_t *config, const injection_in_t *in,
                          injection_out_t *out);

static inline void injection_step(injection_t *self, const injection_config_t *config,
                                  const injection_in_t *in, injection_out_t *out)
{
    if (__builtin_expect(injection_is_inline(config), 1) != 0) {
        pulsating_square_step(&self->pulsating_square, &config->pulsating_square, in, out);
#if INJECTION_NEUTRAL
    } else if (config->id == INJECTION_zero_anti_rotating) {
        zero_anti_rotating_step(&self->zero_anti_rotating, &config->zero_anti_rotating, in, out);
#endif
    } else {
        /* Only this path needs them in memory; copied by members, so that elsewhere they stay in registers. */
        const injection_in_t given = {{in->i.alpha, in->i.beta},
                                      {in->dir.cos, in->dir.sin},
                                      in->omega,
                                      {in->ahead.cos, in->ahead.sin},
                                      INJECTION_IF_MORE(in->more, )
                                          INJECTION_IF_VOLTAGE({in->v.alpha, in->v.beta})};
        injection_out_t result;
        injection_step_other(self, config, &given, &result);
        *out = result;
    }
}

#ifdef __cplusplus
}
#endif

#endif
