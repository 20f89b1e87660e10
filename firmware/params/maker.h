/* What the configuration of a method is made with, from SI parameters: for *_config.c, the makers.
 *
 * A maker stands beside its method, x_config.c beside x.c, and is declared in x.h:
 *   void make_x(maker_t *m, x_config_t *c);
 * With these few words its formulas read as they stand in the literature. A value that does not fit its
 * format refuses the parameter that made it. Not for the control path; the build makes *_config.c small. */
#ifndef PARAMS_MAKER_H
#define PARAMS_MAKER_H

#include "firmware/math/compiler.h"
#include "firmware/math/fixed.h"
#include "firmware/math/image.h"
#include "firmware/math/measure.h"
#include "firmware/params/parameters.h"

/* Formats of fixed.h. */
#define Q_BITS     28
#define FRAC_BITS  32
#define GAIN_BITS  26
#define UNIT_BITS  31
#define SMALL_BITS 20

struct maker {
    const drive_params_t *params;
    drive_base_t base;
    pm_num_t impedance, inductance; /* bases */
    uint32_t slow_divider;          /* periods per slow step: the nearest to 1 ms ... */
    pm_num_t t_slow;                /* ... and what that is, s */
    pm_num_t comp_zone;             /* what the source asks for, then what the modulator has, A */
    pm_num_t swing;                 /* injection_limits_t, A */
    pm_q_t i_d_rated;               /* of maximum torque per ampere at rated current */
    drive_result_t result;
    uint32_t channels; /* that the board has and the image carries: NEEDS_... */
};

/* The first refusal counts. */
static inline void refuse(maker_t *m, drive_param_id_t id, const char *reason)
{
    if (m->result.ok) {
        const drive_result_t refusal = {false, id, reason};
        m->result = refusal;
    }
}

/* What the method that parameter `id` chooses needs of the board. No code where it needs nothing. */
PM_INLINE void require(maker_t *m, uint32_t needs, drive_param_id_t id)
{
    const uint32_t missing = needs & ~m->channels;
    if (missing != 0U) {
        refuse(m, id, pm_need_text(missing));
    }
}

/* What follows passes and returns numbers as words, with the number first: in registers (num.h). */
static inline pm_num_word_t si_word(const maker_t *m, drive_param_id_t id)
{
    return pm_num_word_dec(drive_param_get(m->params, id), drive_param_exp10[id]);
}

PM_INLINE pm_num_t si(const maker_t *m, drive_param_id_t id)
{
    return pm_num_of(si_word(m, id));
}

/* On-time of a leg up to which a shunt below its low switch sees its current, Q20; all of it with shunts in the
 * lines. */
static inline int32_t seen_on_time(const maker_t *m)
{
    const drive_params_t *p = m->params;
    const int32_t blind = p->t_settle == 0 ? 0 : (p->dead_time + p->t_settle) * p->f_pwm; /* 10^-9 */
    return PM_SHARE_ONE - pm_mulh(blind, PM_FRAC(2e-9 * PM_SHARE_ONE));
}

/* `target` is fixed_target(). */
static inline int32_t fixed_word(pm_num_word_t x, maker_t *m, uint32_t target)
{
    int32_t out;
    if (!pm_num_word_to_fixed(x, (int)(target & 0xFFU), &out)) {
        refuse(m, target >> 8, "beyond its format: full scales or speed_trip too far off");
    }
    return out;
}

PM_INLINE uint32_t fixed_target(int bits, drive_param_id_t blame)
{
    return blame << 8 | (uint32_t)bits;
}

PM_INLINE int32_t fixed(maker_t *m, pm_num_t x, int bits, drive_param_id_t blame)
{
    return fixed_word(pm_num_word(x), m, fixed_target(bits, blame));
}

static inline int32_t gain_word(pm_num_word_t x, maker_t *m, uint32_t target)
{
    const int32_t out = fixed_word(x, m, target);
    if (out <= 0) {
        refuse(m, target >> 8, "gives a gain of zero with these bases");
    }
    return out;
}

/* A gain that must not round to nothing. */
PM_INLINE int32_t gain(maker_t *m, pm_num_t x, int bits, drive_param_id_t blame)
{
    return gain_word(pm_num_word(x), m, fixed_target(bits, blame));
}

PM_INLINE pm_num_t mul3(pm_num_t a, pm_num_t b, pm_num_t c)
{
    return pm_num_mul(pm_num_mul(a, b), c);
}

static inline pm_num_word_t square_word(pm_num_word_t x)
{
    return pm_num_word_mul(x, x);
}

PM_INLINE pm_num_t square(pm_num_t x)
{
    return pm_num_of(square_word(pm_num_word(x)));
}

static inline pm_num_word_t least_word(pm_num_word_t a, pm_num_word_t b)
{
    return pm_num_word_cmp(a, b) < 0 ? a : b;
}

PM_INLINE pm_num_t least(pm_num_t a, pm_num_t b)
{
    return pm_num_of(least_word(pm_num_word(a), pm_num_word(b)));
}

static inline pm_q_t per_unit_word(pm_num_word_t base, maker_t *m, drive_param_id_t id)
{
    return fixed_word(pm_num_word_div(si_word(m, id), base), m, fixed_target(Q_BITS, id));
}

/* A parameter over its base as a signal. */
PM_INLINE pm_q_t per_unit(maker_t *m, drive_param_id_t id, pm_num_t base)
{
    return per_unit_word(pm_num_word(base), m, id);
}

/* Torque over pole pairs, flux and current: 3/2 of each set of windings. */
PM_INLINE pm_num_t torque_share(const drive_params_t *params)
{
#if PM_HAS(two_sets)
    if (params->winding == 2) {
        return pm_num(3);
    }
#endif
    (void)params;
    return pm_num_ratio(3, 2);
}

PM_INLINE pm_num_t pole_pairs(const maker_t *m)
{
    return pm_num(m->params->pole_pairs);
}

/* Mechanical speed parameter as per-unit electrical speed. */
static inline pm_q_t speed(maker_t *m, drive_param_id_t id)
{
    return fixed(m, pm_num_div(pm_num_mul(si(m, id), pole_pairs(m)), m->base.omega), Q_BITS, id);
}

static inline pm_num_word_t angular_word(const maker_t *m, drive_param_id_t id)
{
    const pm_num_t two_pi = {PM_NUM_TWO_PI_M, PM_NUM_TWO_PI_E};
    return pm_num_word_mul(pm_num_word(two_pi), si_word(m, id));
}

PM_INLINE pm_num_t angular(const maker_t *m, drive_param_id_t id)
{
    return pm_num_of(angular_word(m, id));
}

/* Voltage that dead time takes of a leg, beside the drops of its devices, V. */
static inline pm_num_word_t dead_voltage_word(const maker_t *m)
{
    return pm_num_word(
        mul3(si(m, DRIVE_PARAM_dead_time), si(m, DRIVE_PARAM_f_pwm), si(m, DRIVE_PARAM_v_dc_nominal)));
}

PM_INLINE pm_num_t dead_voltage(const maker_t *m)
{
    return pm_num_of(dead_voltage_word(m));
}

#endif
