/* Identification over the bus: commands, and the results in the units of the dictionary. */
#include <stddef.h>

#include "firmware/app/app_parts.h"

typedef enum { IN_OHM, IN_VOLT, IN_HENRY, IN_WEBER, IN_INERTIA, IN_VISCOUS, IN_TORQUE, IN_AMPERE } base_t;

typedef struct {
    uint16_t slot;
    uint8_t offset; /* in the result */
    uint8_t base, exponent;
} result_row_t;

#define AT(member) (uint8_t) offsetof(commissioning_result_t, member)

static const result_row_t results[] = {
    {OD_LIVE_IDENTIFICATION_R_S, AT(R), IN_OHM, 6},
    {OD_LIVE_IDENTIFICATION_DEAD_VOLTAGE, AT(lost), IN_VOLT, 3},
    {OD_LIVE_IDENTIFICATION_L_D, AT(L_d), IN_HENRY, 9},
    {OD_LIVE_IDENTIFICATION_L_Q, AT(L_q), IN_HENRY, 9},
    {OD_LIVE_IDENTIFICATION_L_Q_RATED, AT(L_q_rated), IN_HENRY, 9},
    {OD_LIVE_IDENTIFICATION_L_DH_RATED, AT(L_d), IN_HENRY, 9},
    {OD_LIVE_IDENTIFICATION_L_DQH_RATED, AT(L_dq_rated), IN_HENRY, 9},
    {OD_LIVE_IDENTIFICATION_PSI_M, AT(psi_m), IN_WEBER, 9},
    {OD_LIVE_IDENTIFICATION_J, AT(J), IN_INERTIA, 9},
    {OD_LIVE_IDENTIFICATION_FRICTION, AT(viscous), IN_VISCOUS, 9},
    {OD_LIVE_IDENTIFICATION_COULOMB, AT(coulomb), IN_TORQUE, 6},
};

static pm_num_t base_of(const drive_config_t *config, base_t base)
{
    const drive_base_t *b = &config->base;
    const pm_num_t per_speed = pm_num_div(config->pole_pairs, b->omega);
    switch (base) {
    case IN_OHM:
        return pm_num_div(b->v, b->i);
    case IN_VOLT:
        return b->v;
    case IN_HENRY:
        return pm_num_div(b->psi, b->i);
    case IN_WEBER:
        return b->psi;
    case IN_INERTIA: {
        const pm_num_t time =
            pm_num_mul(b->t_s, pm_num((int32_t)config->slow_divider * COMMISSIONING_J_STEPS));
        return pm_num_mul(pm_num_mul(b->torque, time), per_speed);
    }
    case IN_VISCOUS:
        return pm_num_mul(b->torque, per_speed);
    case IN_AMPERE:
        return b->i;
    case IN_TORQUE:
    default:
        return b->torque;
    }
}

/* I_1 T_dt / v_dc, with the voltage that modulator_config.c takes. */
static int32_t leg_capacitance(const app_t *app)
{
    const drive_params_t *p = &app->params;
    int32_t pF = 0;
    const pm_num_t move = pm_num_mul(
        pm_num_from_fixed(app->drive.commissioning_report.result.move, PM_Q_BITS), app->drive.config.base.i);
    const pm_num_t time = pm_num_dec(p->dead_time, drive_param_exp10[DRIVE_PARAM_dead_time]);
    const pm_num_t v_dc = pm_num_dec(p->v_dc_nominal, drive_param_exp10[DRIVE_PARAM_v_dc_nominal]);
    (void)pm_num_to_fixed(pm_num_mul(pm_num_div(pm_num_mul(move, time), v_dc), pm_num_dec(1, 12)), 0, &pF);
    return pF;
}

static int32_t in_row(const app_t *app, const result_row_t *row)
{
    const uint8_t *memory = (const uint8_t *)&app->drive.commissioning_report.result;
    const pm_q_t x = *(const int32_t *)(const void *)&memory[row->offset];
    return app_in_units(x, base_of(&app->drive.config, (base_t)row->base), row->exponent);
}

#if PM_HAS(saliency_map)
static int32_t of_map(const app_t *app, pm_q_t x, base_t base, uint8_t exponent)
{
    return app_in_units(x, base_of(&app->drive.config, base), exponent);
}

/* What has been measured with the rotor locked goes before what was estimated with it free. */
static bool measured_value(const app_t *app, uint16_t slot, int32_t *value)
{
    const saliency_map_result_t *map = &app->drive.saliency_map;
    switch (slot) {
    case OD_LIVE_IDENTIFICATION_L_DH_RATED:
        *value = of_map(app, map->rated.L_d, IN_HENRY, 9);
        return true;
    case OD_LIVE_IDENTIFICATION_L_QH_RATED:
        *value = of_map(app, map->rated.L_q, IN_HENRY, 9);
        return true;
    case OD_LIVE_IDENTIFICATION_L_DQH_RATED:
        *value = of_map(app, map->rated.L_dq, IN_HENRY, 9);
        return true;
    case OD_LIVE_IDENTIFICATION_CROSS_HALF: {
        const pm_num_t part = pm_num_ratio(map->half.L_dq, map->half.L_q);
        (void)pm_num_to_fixed(pm_num_mul(part, pm_num(1000000)), 0, value);
        return true;
    }
    default:
        return false;
    }
}

static bool map_value(const app_t *app, uint16_t slot, int32_t *value)
{
    const saliency_map_result_t *map = &app->drive.saliency_map;
    const saliency_point_t *point =
        &map->point[app->map_point / SALIENCY_MAP_SIDE][app->map_point % SALIENCY_MAP_SIDE];
    switch (slot) {
    case OD_LIVE_IDENTIFICATION_MAP_POINT:
        *value = app->map_point;
        return true;
    case OD_LIVE_IDENTIFICATION_MAP_L_DH:
        *value = of_map(app, point->L_d, IN_HENRY, 9);
        return true;
    case OD_LIVE_IDENTIFICATION_MAP_L_QH:
        *value = of_map(app, point->L_q, IN_HENRY, 9);
        return true;
    case OD_LIVE_IDENTIFICATION_MAP_L_DQH:
        *value = of_map(app, point->L_dq, IN_HENRY, 9);
        return true;
    case OD_LIVE_IDENTIFICATION_CIRCLE_CENTRE:
        *value = of_map(app, map->centre, IN_AMPERE, 6);
        return true;
    case OD_LIVE_IDENTIFICATION_CIRCLE_RADIUS:
        *value = of_map(app, map->radius, IN_AMPERE, 6);
        return true;
    default:
        return map->i != 0 && measured_value(app, slot, value);
    }
}
#endif

#if PM_HAS(zero_inductance)
static bool zero_value(const app_t *app, uint16_t slot, int32_t *value)
{
    const zero_inductance_result_t *r = &app->drive.zero_inductance;
    switch (slot) {
    case OD_LIVE_IDENTIFICATION_DL_0:
        *value = app_in_units(r->dL_0, base_of(&app->drive.config, IN_HENRY), 9);
        return true;
    case OD_LIVE_IDENTIFICATION_ZERO_L_C0:
        *value = app_in_units(r->L_c0, base_of(&app->drive.config, IN_HENRY), 9);
        return true;
    case OD_LIVE_IDENTIFICATION_STAR_ALPHA:
        *value = app_in_units(r->star.alpha, pm_num(1), 6);
        return true;
    case OD_LIVE_IDENTIFICATION_STAR_BETA:
        *value = app_in_units(r->star.beta, pm_num(1), 6);
        return true;
    case OD_LIVE_IDENTIFICATION_ZERO_FALLS:
        *value = r->margin == 0 ? 2 : (int32_t)r->falls;
        return true;
    default:
        return false;
    }
}
#endif

bool app_identify_value(const app_t *app, uint16_t slot, int32_t *value)
{
#if PM_HAS(zero_inductance)
    if (zero_value(app, slot, value)) {
        return true;
    }
#endif
#if PM_HAS(saliency_map)
    if (map_value(app, slot, value)) {
        return true;
    }
#endif
    const commissioning_report_t *report = &app->drive.commissioning_report;
    const commissioning_result_t *r = &report->result;
    for (uint32_t n = 0; n < sizeof results / sizeof results[0]; n++) {
        if (results[n].slot == slot) {
            *value = in_row(app, &results[n]);
            return true;
        }
    }
    switch (slot) {
    case OD_LIVE_IDENTIFICATION_COMMAND:
        *value = app->routines;
        return true;
    case OD_LIVE_IDENTIFICATION_STATE:
        *value = report->state;
        return true;
    case OD_LIVE_IDENTIFICATION_PROGRESS:
        *value = report->progress;
        return true;
    case OD_LIVE_IDENTIFICATION_REASON:
        *value = report->reason;
        return true;
    case OD_LIVE_IDENTIFICATION_LEG_CAPACITANCE:
        *value = leg_capacitance(app);
        return true;
    case OD_LIVE_IDENTIFICATION_L_QH_RATED:
        *value = app_in_units(commissioning_tangent(r, 16), base_of(&app->drive.config, IN_HENRY), 9);
        return true;
    case OD_LIVE_IDENTIFICATION_CROSS_HALF: {
        const pm_num_t part = pm_num_ratio(r->L_dq_rated / 2, commissioning_tangent(r, 4));
        (void)pm_num_to_fixed(pm_num_mul(part, pm_num(1000000)), 0, value);
        return true;
    }
    default:
        return false;
    }
}

bool app_identify_put(app_t *app, uint16_t slot, int32_t value)
{
    const bool map = value == (int32_t)COMMISSIONING_SALIENCY;
#if PM_HAS(saliency_map)
    if (slot == (uint16_t)OD_LIVE_IDENTIFICATION_MAP_POINT) {
        app->map_point = (uint8_t)value;
        return true;
    }
#endif
    const bool neutral = value == (int32_t)COMMISSIONING_NEUTRAL;
    if (slot != (uint16_t)OD_LIVE_IDENTIFICATION_COMMAND || (map && PM_HAS(saliency_map) == 0) ||
        (neutral && PM_HAS(zero_inductance) == 0)) {
        return false;
    }
    app->routines = (uint8_t)value;
    procedure_report(&app->drive, COMMISSIONING_IDLE,
                     COMMISSIONING_NO_REASON); /* it is off: nobody else writes it */
    return true;
}

/* By default the rated current and 30 % of the highest speed. */
void app_identify_command(const app_t *app, drive_command_t *command)
{
    command->mode = DRIVE_MODE_IDENTIFY;
    command->routines = app->routines;
    if (command->current_mA == 0) {
        command->current_mA = app->params.i_rated;
    }
    if (command->speed_mrad_s == 0) {
        command->speed_mrad_s = app->params.speed_max / 10 * 3;
    }
}
