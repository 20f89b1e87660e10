/* Configuration of the start: how position and pole are found. */
#include "firmware/drive/config.h"
#include "firmware/drive/procedures/procedure.h"
#include "firmware/params/maker.h"

#define PERIODS_LEAST 16U

/* The procedure that position_pulses names. */
static procedure_id_t pulses_of(const drive_params_t *params)
{
    static const uint8_t procedures[] = {PROCEDURE_initial_pulses, PROCEDURE_four_pulses,
                                         PROCEDURE_basic_pulses, PROCEDURE_boundary_detection,
                                         PROCEDURE_dc_link_pulses};
    return (procedure_id_t)procedures[params->position_pulses];
}

static void make_find(maker_t *m, drive_config_t *config)
{
    make_pulses(m, &config->pulses);
    PM_IN_IMAGE(
        boundary_detection, if (config->find == (uint8_t)PROCEDURE_boundary_detection) {
            make_boundary_detection(m, &config->boundary_detection);
        })
    PM_IN_IMAGE(
        dc_link_pulses, if (config->find == (uint8_t)PROCEDURE_dc_link_pulses) {
            make_dc_link_pulses(m, &config->pulses, &config->dc_link_pulses);
        })
}

/* Pulses know one bridge. */
static bool pulses_serve(const drive_params_t *params)
{
#if PM_CARRIES(NEEDS_BRIDGES)
    if (params->winding != 0) {
        return false;
    }
#endif
    return params->start_method != 3;
}

static sequence_id_t start_of(const drive_params_t *params, bool injection)
{
    if (!injection || !pulses_serve(params)) {
        return SEQUENCE_align;
    }
#if SEQUENCE_HAS_POLARITY
    if (params->polarity != 0) {
        return params->start_fallback == 0 ? SEQUENCE_pole : SEQUENCE_pole_align;
    }
#endif
    return params->start_fallback == 0 ? SEQUENCE_pulses : SEQUENCE_pulses_align;
}

static uint8_t find_of(const drive_params_t *params)
{
#if SEQUENCE_HAS_POLARITY
    if (params->position_find != 0) {
        return params->position_find == 1 ? (uint8_t)PROCEDURE_lock : (uint8_t)PROCEDURE_three_phase_hf;
    }
#endif
    return (uint8_t)pulses_of(params);
}

#if SEQUENCE_HAS_POLARITY
static uint8_t pole_of(const drive_params_t *params)
{
    static const uint8_t poles[] = {PROCEDURE_NONE, PROCEDURE_dual_pulses, PROCEDURE_d_current,
                                    PROCEDURE_secondary_current, PROCEDURE_secondary_voltage};
    return poles[params->polarity];
}

#if PM_HAS(pulsating_sine) || PM_HAS(secondary_voltage)
/* Dead time bends a carrier that it takes more of than a quarter into a second harmonic as large as that of the poles. So
 * it does to one of few periods: it takes from a current at its rising edge, from the opposite one at the falling edge half
 * a period later, so that half cycles are not alike. */
PM_APART static void check_second_harmonic(maker_t *m, uint32_t n)
{
    if (m->params->polarity < 3) {
        return;
    }
    if (pm_num_cmp(pm_num_mul(dead_voltage(m), pm_num(4)), si(m, DRIVE_PARAM_v_injection)) > 0) {
        refuse(m, DRIVE_PARAM_v_injection, "below four times what dead time takes");
    }
    if (n < PERIODS_LEAST) {
        refuse(m, DRIVE_PARAM_f_injection, "needs 16 periods of the PWM in one of the carrier");
    }
}
#endif

static const char *carrier_of(int32_t polarity)
{
    if (PM_HAS(secondary_voltage) && polarity == 4) {
        return "needs injection 8";
    }
    return polarity == 3 ? "needs injection 4" : "needs injection 0, 4 or 8";
}

/* What of the carrier the steps of polarity look at, and whether there is one that they can look at. */
static void make_carrier(maker_t *m, drive_config_t *config)
{
    const injection_config_t *c = &config->position.injection;
    const int32_t by = m->params->polarity;
    polarity_carrier_t carrier = {.periods = 1};
    bool seen = false;
    switch (c->id) {
    case INJECTION_pulsating_square:
        carrier = polarity_by_current(m, 1, c->pulsating_square.h_d);
        seen = by == 2;
        break;
#if PM_HAS(pulsating_sine)
    case INJECTION_pulsating_sine:
        carrier = polarity_by_current(m, c->pulsating_sine.sine.n, c->pulsating_sine.h_d);
        seen = !PM_HAS(secondary_voltage) || by != 4;
        check_second_harmonic(m, c->pulsating_sine.sine.n);
        break;
#endif
#if PM_HAS(zero_rotating)
    case INJECTION_zero_rotating:
        carrier = zero_rotating_polarity(m, &c->zero_rotating);
        seen = by == 2;
        PM_IN_IMAGE(
            secondary_voltage, if (by == 4) {
                carrier.reversed = false; /* the constants know */
                seen = true;
                check_second_harmonic(m, 2U * c->zero_rotating.half);
                make_zero_second(m, &config->zero_second);
            })
        break;
#endif
    default:
        break;
    }
    make_polarity(m, &carrier, &config->polarity);
    if (!seen) {
        refuse(m, DRIVE_PARAM_polarity, carrier_of(by));
    }
}

/* Whether it can be done at all. */
static void check_pole(maker_t *m, const drive_config_t *config)
{
    static const bool in_image[PROCEDURE_COUNT] = {
        true,
#define PM_METHOD(name, help, traits, needs) PM_HAS(name) != 0,
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    };
    const drive_params_t *p = m->params;
    if (!in_image[config->find]) {
        refuse(m, DRIVE_PARAM_position_find, "is not in this image");
    }
    if (!in_image[config->pole]) {
        refuse(m, DRIVE_PARAM_polarity, "is not in this image");
    }
    if (p->position_find == 1 && (config->position.traits & SOURCE_STATOR) != 0U) {
        refuse(m, DRIVE_PARAM_position_find, "needs a carrier in the estimated frame: injection 0, 1 or 4");
    } else if (p->position_find == 1 && p->polarity == 0) {
        refuse(m, DRIVE_PARAM_polarity, "injection alone does not know the pole: 1, 2 or 3");
    } else {
        /* both are found */
    }
}

/* How the start finds angle and pole. */
static void make_pole(maker_t *m, drive_config_t *config)
{
    const drive_params_t *p = m->params;
    check_pole(m, config);
    PM_IN_IMAGE(
        three_phase_hf, if (p->position_find == 2) { make_three_phase_hf(m, &config->three_phase_hf); })
    PM_IN_IMAGE(
        dual_pulses, if (p->polarity == 1) { make_dual_pulses(m, &config->dual_pulses); })
    if (p->polarity > 1) {
        make_carrier(m, config);
    }
}
#endif

void choose_start(maker_t *m, drive_config_t *config, uint32_t channels)
{
    config->start = (uint8_t)start_of(m->params, config->injection);
    config->find = find_of(m->params);
#if SEQUENCE_HAS_POLARITY
    config->pole = pole_of(m->params);
#endif
    config->charge_periods =
        (channels & PM_BOOTSTRAP) != 0U ? (uint16_t)(m->slow_divider * (uint32_t)CHARGE_MS) : 0U;
    PM_IN_IMAGE(flying_start, make_flying_start(m, &config->flying_start);
                config->flying_start.charge =
                    (uint32_t)config->charge_periods * (uint32_t)FLYING_START_PARTS;)
    PM_IN_IMAGE(saliency_map, make_saliency_map(m, &config->saliency_map);)
    PM_IN_IMAGE(zero_inductance, make_zero_inductance(m, &config->zero_inductance, config->neutral.decay);)
    require(m, sequence_needs((sequence_id_t)config->start, config->find, config_pole(config)),
            DRIVE_PARAM_start_method);
}

void make_start(maker_t *m, drive_config_t *config)
{
    make_find(m, config);
#if SEQUENCE_HAS_POLARITY
    make_pole(m, config);
#endif
}
