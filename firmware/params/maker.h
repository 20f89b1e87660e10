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

static inline pm_num_t si(const maker_t *m, drive_param_id_t id)
{
    return pm_num_dec(drive_param_get(m->params, id), drive_param_exp10[id]);
}

/* On-time of a leg up to which a shunt below its low switch sees its current, Q20; all of it with shunts in the
 * lines. */
static inline int32_t seen_on_time(const maker_t *m)
{
    const drive_params_t *p = m->params;
    const int32_t blind = p->t_settle == 0 ? 0 : (p->dead_time + p->t_settle) * p->f_pwm; /* 10^-9 */
    return PM_SHARE_ONE - pm_mulh(blind, PM_FRAC(2e-9 * PM_SHARE_ONE));
}

static inline int32_t fixed(maker_t *m, pm_num_t x, int bits, drive_param_id_t blame)
{
    int32_t out;
    if (!pm_num_to_fixed(x, bits, &out)) {
        refuse(m, blame, "beyond its format: full scales or speed_trip too far off");
    }
    return out;
}

/* A gain that must not round to nothing. */
static inline int32_t gain(maker_t *m, pm_num_t x, int bits, drive_param_id_t blame)
{
    const int32_t out = fixed(m, x, bits, blame);
    if (out <= 0) {
        refuse(m, blame, "gives a gain of zero with these bases");
    }
    return out;
}

static inline pm_num_t mul3(pm_num_t a, pm_num_t b, pm_num_t c)
{
    return pm_num_mul(pm_num_mul(a, b), c);
}

static inline pm_num_t square(pm_num_t x)
{
    return pm_num_mul(x, x);
}

static inline pm_num_t least(pm_num_t a, pm_num_t b)
{
    return pm_num_cmp(a, b) < 0 ? a : b;
}

/* A parameter over its base as a signal. */
static inline pm_q_t per_unit(maker_t *m, drive_param_id_t id, pm_num_t base)
{
    return fixed(m, pm_num_div(si(m, id), base), Q_BITS, id);
}

static inline pm_num_t pole_pairs(const maker_t *m)
{
    return pm_num(m->params->pole_pairs);
}

/* Mechanical speed parameter as per-unit electrical speed. */
static inline pm_q_t speed(maker_t *m, drive_param_id_t id)
{
    return fixed(m, pm_num_div(pm_num_mul(si(m, id), pole_pairs(m)), m->base.omega), Q_BITS, id);
}

static inline pm_num_t angular(const maker_t *m, drive_param_id_t id)
{
    const pm_num_t two_pi = {PM_NUM_TWO_PI_M, PM_NUM_TWO_PI_E};
    return pm_num_mul(two_pi, si(m, id));
}

/* Voltage that dead time takes of a leg, beside the drops of its devices, V. */
static inline pm_num_t dead_voltage(const maker_t *m)
{
    return mul3(si(m, DRIVE_PARAM_dead_time), si(m, DRIVE_PARAM_f_pwm), si(m, DRIVE_PARAM_v_dc_nominal));
}

#endif
