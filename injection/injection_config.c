#include "firmware/math/image.h"
#include "injection/injection.h"
#include "injection/saliency_config.h"
#include "injection/sine.h"

/* Without a load dead time and devices take 4/3 of a leg's loss of the vector, whose sign is the current's: a carrier
 * below that moves no current, and what answers is the noise. */
static bool carrier_passes(const maker_t *m)
{
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
    return traits_of[id];
}

void make_injection(maker_t *m, injection_config_t *c)
{
    check_carrier(m);
    c->id = (injection_id_t)m->params->injection;
    c->reserve = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
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
#if PM_HAS(injection_stages)
    const bool is_square = c->id == INJECTION_pulsating_square;
    const bool is_sine = c->id == INJECTION_pulsating_sine;
    make_injection_stages(m, &c->stages, is_square || is_sine, is_sine ? sine_flux(m) : flux_of_period(m));
    c->inlined = c->id == INJECTION_INLINE && !c->stages.on;
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

/* The carrier must pass the legs, its answer be four times the noise, the saliency 5 %, and some of it be left at rated
 * current. */
bool injection_sees_saliency(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const inductances_t rated = inductances_at_rated(m);
    const pm_num_t dL = pm_num_sub(L.L_q, L.L_d);
    const pm_num_t noise = pm_num_mul(pm_num(4), si(m, DRIVE_PARAM_i_noise));
    return carrier_passes(m) && pm_num_cmp(answer(m), noise) > 0 &&
           pm_num_cmp(dL, pm_num_mul(L.L_q, pm_num_ratio(1, 20))) > 0 &&
           pm_num_cmp(slope_across(&rated, pm_num(1)), pm_num(0)) > 0;
}
