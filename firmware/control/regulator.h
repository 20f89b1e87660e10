/* Any of the regulators of the current, chosen by the configuration (METHODS.md 1.3.2.2, 12.5.2).
 *
 * A regulator stands between references and voltage (regulation.h): sampled at k, its voltage acts over [k+1, k+2).
 * Each of regulators.def has these functions; config is const but in slow_down:
 *   x_reset(self, config, v, i, omega)
 *                                   the voltage v (Q28) acts at this current and speed: nothing jumps if it is right
 *   x_step(self, config, in, out)   one period; no division, no root unless the limit acts. |out->v| <= v_max
 *   x_slow_down(config, share)      a copy of the configuration to `share` of the bandwidth: what a low-speed source
 *                                   with a slow window asks for
 *   make_x(maker, config)           configuration from SI parameters (x_config.c)
 *   x_bandwidth(maker)              of the closed loop, in Hz
 * References are the drive's; dead time belongs to the modulator. A regulator with the trait REGULATOR_SWITCHES gives
 * a switch state instead, and the voltage that it makes, of which the drive keeps the mean for all that reads it at 1 kHz.
 *
 * Cost of the dispatch: one branch for the default, which is compiled into the caller, none in an image that has no
 * other; a call for the others. Tests: tests/contract/regulator_contract_test.cpp runs all of the list. */
#ifndef CONTROL_REGULATOR_H
#define CONTROL_REGULATOR_H

#include "firmware/control/methods.h"
#include "firmware/math/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
#define PM_METHOD(name, help, traits, needs) REGULATOR_##name,
#include "firmware/control/regulators.def"
#undef PM_METHOD
    REGULATOR_COUNT
} regulator_id_t;

#define REGULATOR_INLINE REGULATOR_synchronous_pi /* the default costs no call */

/* How many the image has. */
enum {
    REGULATORS_HERE = 0
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, +1)
#include "firmware/control/regulators.def"
#undef PM_METHOD
};

typedef struct {
    regulator_id_t id;
    union {
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, name##_config_t name;)
#include "firmware/control/regulators.def"
#undef PM_METHOD
    };
} regulator_config_t;

typedef union {
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, name##_t name;)
#include "firmware/control/regulators.def"
#undef PM_METHOD
} regulator_t;

uint32_t regulator_traits(regulator_id_t id); /* REGULATOR_... */

void regulator_reset(regulator_t *self, const regulator_config_t *config, pm_dq_t v, pm_dq_t i, pm_q_t omega);
void regulator_slow_down(regulator_config_t *config, pm_unit_t share);

/* Of the regulator that the parameter `regulator` names. */
void make_regulator(maker_t *m, regulator_config_t *c);
pm_num_t regulator_bandwidth(const maker_t *m);

/* regulator_step() of all but REGULATOR_INLINE. */
void regulator_step_other(regulator_t *self, const regulator_config_t *config, const regulator_in_t *in,
                          regulator_out_t *out);

/* usual: config->id is REGULATOR_INLINE, as the caller knows. */
static inline void regulator_step_usual(regulator_t *self, const regulator_config_t *config, bool usual,
                                        const regulator_in_t *in, regulator_out_t *out)
{
    if (REGULATORS_HERE == 1 || __builtin_expect(usual, 1) != 0) {
        synchronous_pi_step(&self->synchronous_pi, &config->synchronous_pi, in, out);
    } else {
        /* Only this path needs it in memory; copied by members, so that elsewhere it stays in registers. */
        const regulator_in_t given = {{in->i.d, in->i.q},
                                      {in->i_ref.d, in->i_ref.q},
                                      in->omega,
                                      in->v_max,
                                      PM_IF_HELD({in->ahead.cos, in->ahead.sin}, in->v_dc)};
        PM_IF_HELD(out->legs = 0U;)
        regulator_step_other(self, config, &given, out);
    }
}

static inline void regulator_step(regulator_t *self, const regulator_config_t *config,
                                  const regulator_in_t *in, regulator_out_t *out)
{
    regulator_step_usual(self, config, config->id == REGULATOR_INLINE, in, out);
}

#ifdef __cplusplus
}
#endif

#endif
