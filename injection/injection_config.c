#include "firmware/math/image.h"
#include "firmware/math/root.h"
#include "injection/injection.h"
#include "injection/saliency_config.h"
#include "injection/sine.h"

/* The voltage of the carrier is made by the regulator of the current. */
static bool in_reference(const maker_t *m)
{
#if PM_HAS(current_sine)
    return (injection_traits((injection_id_t)m->params->injection) & (uint32_t)SOURCE_IN_REFERENCE) != 0U;
#else
    (void)m;
    return false;
#endif
}

/* Without a load dead time and devices take 4/3 of a leg's loss of the vector, whose sign is the current's: a carrier
 * below that moves no current, and what answers is the noise. */
static bool carrier_passes(const maker_t *m)
{
    if (in_reference(m)) {
        return true;
    }
    const pm_num_t lost = pm_num_add(dead_voltage(m), si(m, DRIVE_PARAM_device_drop));
    return pm_num_cmp(si(m, DRIVE_PARAM_v_injection), pm_num_mul(lost, pm_num_ratio(4, 3))) > 0;
}

/* Carrier and control share the voltage vector: at most 0.6 of v_dc / sqrt(3) may go to the carrier. */
static void check_carrier(maker_t *m)
{
    const pm_num_t linear = pm_num_mul(si(m, DRIVE_PARAM_v_dc_nominal), pm_num_sqrt(pm_num_ratio(1, 3)));
    if (pm_num_cmp(si(m, DRIVE_PARAM_v_injection), pm_num_mul(linear, pm_num_ratio(3, 5))) > 0) {
        refuse(m, DRIVE_PARAM_v_injection, "leaves too little of v_dc_nominal for control");
    } else if (!carrier_passes(m)) {
        refuse(m, DRIVE_PARAM_v_injection, "is lost in dead time");
    } else {
        /* room for both */
    }
}

uint32_t injection_traits(injection_id_t id)
{
    static const uint8_t traits_of[INJECTION_COUNT] = {
#define PM_METHOD(name, help, traits, needs) (uint8_t)(traits),
#include "injection/injections.def"
#undef PM_METHOD
    };
    return id < INJECTION_COUNT ? traits_of[id] : 0U;
}

#if INJECTION_LOW_PASS
static pm_frac_t smoothing(maker_t *m)
{
    pm_num_t f_Hz = injection_limits(m).low_pass;
    drive_param_id_t from = DRIVE_PARAM_injection_bandwidth;
#if PM_HAS(injection_stages)
    if (m->params->injection_filter != 0) {
        f_Hz = si(m, DRIVE_PARAM_injection_filter);
        from = DRIVE_PARAM_injection_filter;
    }
#endif
    if (f_Hz.m == 0) {
        return 0;
    }
    const pm_num_t step = mul3(PM_NUM_TWO_PI, f_Hz, m->base.t_s);
    return gain(m, pm_num_div(step, pm_num_add(pm_num(1), step)), FRAC_BITS, from);
}
#endif

void make_injection(maker_t *m, injection_config_t *c)
{
    check_carrier(m);
    c->id = (injection_id_t)m->params->injection;
    c->reserve = in_reference(m) ? 0 : per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    switch (c->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case INJECTION_##name                                                                  \
                : require(m, needs, DRIVE_PARAM_injection);                                                  \
                make_##name(m, &c->name); break;)
#include "injection/injections.def"
#undef PM_METHOD
    case INJECTION_COUNT:
    default: /* excluded by the range of the parameter */
        refuse(m, DRIVE_PARAM_injection, "is not in this image");
        break;
    }
#if INJECTION_LOW_PASS
    c->smooth = smoothing(m);
#endif
#if PM_HAS(injection_stages)
    const bool is_square = c->id == INJECTION_pulsating_square;
    const bool is_sine = c->id == INJECTION_pulsating_sine;
    make_injection_stages(m, &c->stages, is_square || is_sine, is_sine ? sine_flux(m) : flux_of_period(m));
    c->inlined = c->id == INJECTION_INLINE && !c->stages.on && c->smooth == 0;
#endif
}

injection_limits_t injection_limits(const maker_t *m)
{
    switch ((injection_id_t)m->params->injection) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case INJECTION_##name : return name##_limits(m);)
#include "injection/injections.def"
#undef PM_METHOD
    case INJECTION_COUNT:
    default:
        return (injection_limits_t){.pll_max = {0, 0}};
    }
}

static pm_num_t answer(const maker_t *m)
{
    switch ((injection_id_t)m->params->injection) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case INJECTION_##name : return name##_answer(m);)
#include "injection/injections.def"
#undef PM_METHOD
    case INJECTION_COUNT:
    default:
        return pm_num(0);
    }
}

/* Whether the source reads the current across the axis of the rotor; else it follows the axis of the saliency, which saturation
 * turns away from that. */
static bool reads_across(const maker_t *m)
{
    const uint32_t traits = injection_traits((injection_id_t)m->params->injection);
    return (traits & ((uint32_t)SOURCE_STATOR | (uint32_t)SOURCE_ONE_WAY)) == 0U;
}

/* Share of the slope across that rated current takes away; at most 8. */
static pm_q_t saturates(const maker_t *m)
{
    const inductances_t zero = inductances_at_zero(m);
    const inductances_t rated = inductances_at_rated(m);
    const pm_num_t slope = slope_across(&zero, pm_num(1));
    const pm_num_t fall = pm_num_sub(slope, slope_across(&rated, pm_num(1)));
    pm_q_t share;
    (void)pm_num_to_fixed(pm_num_div(fall, slope), Q_BITS, &share);
    return share;
}

static bool is_in_image(injection_id_t id)
{
    switch (id) {
#define PM_METHOD(name, help, traits, needs) PM_IN_IMAGE(name, case INJECTION_##name : return true;)
#include "injection/injections.def"
#undef PM_METHOD
    case INJECTION_COUNT:
    default:
        return false;
    }
}

/* The carrier must pass the legs, its answer be four times the noise, the saliency 5 %, and some of it be left at half of rated
 * current; at all of rated current for sources that follow the axis of the saliency. Of a source that the image has not nothing can be
 * said: make_injection() is to refuse it. */
bool injection_sees_saliency(const maker_t *m)
{
    const drive_params_t *p = m->params;
    if (!is_in_image((injection_id_t)p->injection)) {
        return true;
    }
    const pm_num_t noise = pm_num_dec(4 * p->i_noise, drive_param_exp10[DRIVE_PARAM_i_noise]);
    return carrier_passes(m) && pm_num_cmp(answer(m), noise) > 0 && p->L_q - p->L_d > p->L_q / 20 &&
           saturates(m) < (reads_across(m) ? 4 : 1) * PM_ONE;
}

/* The slope falls with the square of the current: 0.9 of where it would be zero, or 7 times rated current. */
pm_q_t injection_current(maker_t *m)
{
    const pm_q_t share = pm_div(PM_Q(0.9), pm_sqrt(pm_max(saturates(m), PM_ONE / 64)));
    return reads_across(m) ? pm_mul(share, per_unit(m, DRIVE_PARAM_i_rated, m->base.i)) : PM_Q_MAX;
}
