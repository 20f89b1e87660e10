/* What the parts of the configuration have in common; not for users of config.h.
 *
 * With these helpers the formulas of config*.c read as they stand in the literature. */
#ifndef DRIVE_CONFIG_MAKER_H
#define DRIVE_CONFIG_MAKER_H

#include "firmware/drive/config.h"
#include "firmware/math/compiler.h"
#include "firmware/math/measure.h"

/* Formats of fixed.h. */
#define Q_BITS     28
#define FRAC_BITS  32
#define GAIN_BITS  26
#define UNIT_BITS  31
#define SMALL_BITS 20

typedef struct {
    const drive_params_t *params;
    drive_base_t base;
    pm_num_t impedance, inductance; /* bases */
    uint32_t slow_divider;          /* periods per slow step: the nearest to 1 ms ... */
    pm_num_t t_slow;                /* ... and what that is, s */
    mtpa_config_t mtpa;             /* already made */
    drive_result_t result;
    uint32_t channels; /* that the board has and the image carries: NEEDS_... */
} maker_t;

/* The first refusal counts. */
static inline void refuse(maker_t *m, drive_param_id_t id, const char *reason)
{
    if (m->result.ok) {
        m->result = (drive_result_t){.ok = false, .param = id, .reason = reason};
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

static inline int32_t fixed(maker_t *m, pm_num_t x, int bits, drive_param_id_t blame)
{
    int32_t out;
    if (!pm_num_to_fixed(x, bits, &out)) {
        refuse(m, blame, "beyond the fixed-point range with these bases");
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
    return pm_num_mul(PM_NUM_TWO_PI, si(m, id));
}

/* config_control.c */
void make_modulator(maker_t *m, modulator_config_t *c);
void make_current(maker_t *m, current_control_config_t *c);
void make_speed(maker_t *m, speed_control_config_t *c);
void make_flux_weakening(maker_t *m, field_weakening_config_t *c);
void make_mtpa(maker_t *m, mtpa_config_t *c);

/* config_observer_list.c */
void make_observer(maker_t *m, observer_config_t *c);

/* config_observer.c, config_kalman.c */
void make_model(maker_t *m, observer_model_t *c);
#define PM_METHOD(name, help, traits, needs) void make_##name(maker_t *m, name##_config_t *c);
#include "observers/observers.def"
#undef PM_METHOD

/* config_mismatch.c */
void make_mismatch(maker_t *m, mismatch_config_t *c);

/* config_position.c */
bool salient(const maker_t *m);
void make_position(maker_t *m, position_config_t *c, bool injection);
void make_speed_estimate(maker_t *m, speed_config_t *c);
void make_pulses(maker_t *m, initial_pulses_config_t *c);

#endif
