/* Live values: the drive's per-unit numbers in the units of the dictionary. Thread context; a value of
 * several words may be of two successive periods. */
#include <stddef.h>

#include "firmware/app/app_parts.h"
#include "firmware/params/maker.h"

#define THOUSAND 1000

/* Raw 32768 of a traced signal. */
#define RAW_FULL (2 * PM_ONE)
_Static_assert(TRACE_SHIFT == PM_Q_BITS - 14, "of twice the base");

/* Signal times base, times 10^exponent, as an integer; what does not fit is limited. */
int32_t app_in_units(pm_q_t x, pm_num_t base, int exponent)
{
    int32_t value;
    const pm_num_t in_si = pm_num_mul(pm_num_from_fixed(x, PM_Q_BITS), base);
    (void)pm_num_to_fixed(pm_num_mul(in_si, pm_num_dec(1, exponent)), 0, &value);
    return value;
}

static pm_num_t omega_mech(const app_t *app)
{
    const drive_config_t *c = &app->drive.config;
    return pm_num_div(c->base.omega, c->pole_pairs);
}

/* Base of a signal and the decimal exponent of its unit */
typedef struct {
    pm_num_t base;
    int exponent;
} unit_t;

static unit_t current(const app_t *app)
{
    return (unit_t){.base = app->drive.config.base.i, .exponent = 3};
}

static unit_t voltage(const app_t *app)
{
    return (unit_t){.base = app->drive.config.base.v, .exponent = 3};
}

static unit_t speed_e(const app_t *app)
{
    return (unit_t){.base = app->drive.config.base.omega, .exponent = 3};
}

static unit_t speed_mech(const app_t *app)
{
    return (unit_t){.base = omega_mech(app), .exponent = 3};
}

static unit_t share(void)
{
    return (unit_t){.base = pm_num(1), .exponent = 3};
}

typedef enum { IN_CURRENT, IN_VOLTAGE, IN_SPEED_E, IN_SPEED_MECH, IN_SHARE } unit_kind_t;

static unit_t unit_of(const app_t *app, unit_kind_t kind)
{
    switch (kind) {
    case IN_CURRENT:
        return current(app);
    case IN_VOLTAGE:
        return voltage(app);
    case IN_SPEED_E:
        return speed_e(app);
    case IN_SPEED_MECH:
        return speed_mech(app);
    case IN_SHARE:
    default:
        return share();
    }
}

/* A signal of the drive that is a number in memory, as it is in every period */
typedef struct {
    uint16_t slot, offset;
    unit_kind_t unit;
} signal_row_t;

static const signal_row_t signals[] = {
    {OD_LIVE_I_D, offsetof(drive_t, status.i.d), IN_CURRENT},
    {OD_LIVE_I_Q, offsetof(drive_t, status.i.q), IN_CURRENT},
    {OD_LIVE_I_D_REF, offsetof(drive_t, i_ref.d), IN_CURRENT},
    {OD_LIVE_I_Q_REF, offsetof(drive_t, i_ref.q), IN_CURRENT},
    {OD_LIVE_I_A, offsetof(drive_t, i_abc.a), IN_CURRENT},
    {OD_LIVE_I_B, offsetof(drive_t, i_abc.b), IN_CURRENT},
    {OD_LIVE_I_C, offsetof(drive_t, i_abc.c), IN_CURRENT},
    {OD_LIVE_OMEGA_E, offsetof(drive_t, pll.omega), IN_SPEED_E},
    {OD_LIVE_VELOCITY_ACTUAL, offsetof(drive_t, pll.omega), IN_SPEED_MECH},
    {OD_LIVE_VELOCITY_DEMAND, offsetof(drive_t, status.omega_ref), IN_SPEED_MECH},
    {OD_LIVE_DC_LINK_VOLTAGE, offsetof(drive_t, status.v_dc), IN_VOLTAGE},
    {OD_LIVE_QUALITY, offsetof(drive_t, status.quality), IN_SHARE},
    {OD_LIVE_WEIGHT, offsetof(drive_t, status.weight), IN_SHARE},
};

static const signal_row_t *signal_of(uint16_t slot)
{
    for (uint32_t n = 0; n < sizeof signals / sizeof signals[0]; n++) {
        if (signals[n].slot == slot) {
            return &signals[n];
        }
    }
    return NULL;
}

static const volatile int32_t *place_of(const app_t *app, const signal_row_t *row)
{
    const uint8_t *memory = (const uint8_t *)&app->drive;
    return (const volatile int32_t *)(const volatile void *)&memory[row->offset];
}

/* Stored with a range of twice the base, resolution 2^-14 of it */
bool trace_host_find(void *context, uint16_t index, uint8_t sub, trace_signal_t *signal)
{
    const app_t *app = context;
    bool has_index;
    const od_entry_t *entry = od_find(index, sub, &has_index);
    if (entry == NULL || entry->kind != (uint8_t)OD_LIVE) {
        return false;
    }
    if (entry->slot == (uint16_t)OD_LIVE_THETA) {
        *signal = (trace_signal_t){
            .source = (const volatile int32_t *)&app->drive.status.theta, .scale = INT32_MAX, .angle = true};
        return true;
    }
    const signal_row_t *row = signal_of(entry->slot);
    if (row == NULL) {
        return false;
    }
    const unit_t unit = unit_of(app, row->unit);
    const int32_t scale = app_in_units(RAW_FULL, unit.base, unit.exponent);
    *signal = (trace_signal_t){.source = place_of(app, row), .scale = scale};
    return true;
}

/* --- torque of the magnet, with the reluctance torque of the present i_d ------------------------------- */

static pm_num_t rated_torque(const app_t *app)
{
    const pm_num_t psi = pm_num_dec(app->params.psi_m, -9);
    const pm_num_t i = pm_num_dec(app->params.i_rated, -3);
    return pm_num_mul(pm_num_mul(torque_share(&app->params), pm_num(app->params.pole_pairs)),
                      pm_num_mul(psi, i));
}

static int32_t rounded(pm_num_t x)
{
    int32_t value;
    (void)pm_num_to_fixed(x, 0, &value);
    return value;
}

int32_t app_torque_uNm(const app_t *app, int32_t permille)
{
    return rounded(pm_num_mul(rated_torque(app), pm_num_mul(pm_num(permille), pm_num(THOUSAND))));
}

static int32_t torque_permille(const app_t *app)
{
    const drive_config_t *c = &app->drive.config;
    const pm_dq_t i = app->drive.status.i;
    const pm_q_t psi = c->machine.psi_m + pm_mul(c->machine.L_d - c->machine.L_q, i.d);
    const pm_num_t torque = pm_num_mul(pm_num_from_fixed(pm_mul(psi, i.q), PM_Q_BITS), c->base.torque);
    return pm_clamp(rounded(pm_num_mul(pm_num_div(torque, rated_torque(app)), pm_num(THOUSAND))), INT16_MIN,
                    INT16_MAX);
}

static int32_t current_permille(const app_t *app)
{
    const unit_t unit = current(app);
    const pm_num_t i_mA = pm_num(app_in_units(app->drive.status.i.q, unit.base, unit.exponent));
    const pm_num_t part = pm_num_div(pm_num_mul(i_mA, pm_num(THOUSAND)), pm_num(app->params.i_rated));
    return pm_clamp(rounded(part), INT16_MIN, INT16_MAX);
}

/* ------------------------------------------------------------------------------------------------------------
 */

static bool record_value(const app_t *app, uint16_t slot, int32_t *value)
{
    const drive_fault_record_t *record = drive_fault_record(&app->drive);
    const unit_t i = current(app);
    switch (slot) {
    case OD_LIVE_FAULT_RECORD_CODE:
        *value = (int32_t)record->fault;
        return true;
    case OD_LIVE_FAULT_RECORD_I_A:
        *value = app_in_units(record->i.a, i.base, i.exponent);
        return true;
    case OD_LIVE_FAULT_RECORD_I_B:
        *value = app_in_units(record->i.b, i.base, i.exponent);
        return true;
    case OD_LIVE_FAULT_RECORD_I_C:
        *value = app_in_units(record->i.c, i.base, i.exponent);
        return true;
    case OD_LIVE_FAULT_RECORD_V_DC:
        *value = app_in_units(record->v_dc, voltage(app).base, 3);
        return true;
    case OD_LIVE_FAULT_RECORD_OMEGA_E:
        *value = app_in_units(record->omega, speed_e(app).base, 3);
        return true;
    case OD_LIVE_FAULT_RECORD_THETA:
        *value = (int32_t)record->theta;
        return true;
    case OD_LIVE_FAULT_RECORD_TEMPERATURE:
        *value = record->temperature_dC;
        return true;
    case OD_LIVE_FAULT_RECORD_PERIOD:
        *value = (int32_t)record->period;
        return true;
    case OD_LIVE_FAULT_RECORD_REFUSED_BY:
        *value = (int32_t)record->refusal.procedure;
        return true;
    case OD_LIVE_FAULT_RECORD_REFUSED_BECAUSE:
        *value = (int32_t)record->refusal.reason;
        return true;
    default:
        return false;
    }
}

static bool state_value(const app_t *app, uint16_t slot, int32_t *value)
{
    const drive_status_t *status = drive_status(&app->drive);
    switch (slot) {
    case OD_LIVE_PARAMETER_BATCH:
        *value = app->batch ? 1 : 0;
        return true;
    case OD_LIVE_PARAMETER_REFUSED:
        *value = (int32_t)app_refused_object(app);
        return true;
    case OD_LIVE_PARAMETERS_READY:
        *value = (int32_t)app_ready(app);
        return true;
    case OD_LIVE_STORED_DROPPED:
        *value = app->dropped;
        return true;
    case OD_LIVE_DRIVE_STATE:
        *value = app->drive.fault == DRIVE_FAULT_NONE ? (int32_t)app->drive.state : (int32_t)DRIVE_FAULT;
        return true;
    case OD_LIVE_DRIVE_FAULT:
        *value = (int32_t)app->drive.fault;
        return true;
    case OD_LIVE_DRIVE_LIMITS:
        *value = (int32_t)status->limits;
        return true;
    default:
        return record_value(app, slot, value);
    }
}

bool app_value(app_t *app, uint16_t slot, int32_t *value)
{
    const signal_row_t *row = signal_of(slot);
    if (row != NULL) {
        const unit_t unit = unit_of(app, row->unit);
        *value = app_in_units(*place_of(app, row), unit.base, unit.exponent);
        return true;
    }
    switch (slot) {
    case OD_LIVE_V_ALPHA:
        *value = app_in_units(app->drive.status.v.alpha, voltage(app).base, 3);
        return true;
    case OD_LIVE_V_BETA:
        *value = app_in_units(app->drive.status.v.beta, voltage(app).base, 3);
        return true;
    case OD_LIVE_THETA:
        *value = (int32_t)app->drive.status.theta;
        return true;
    case OD_LIVE_TEMPERATURE:
        *value = app->slow.temperature_dC;
        return true;
    case OD_LIVE_RATED_CURRENT:
        *value = app->params.i_rated;
        return true;
    case OD_LIVE_RATED_TORQUE:
        *value = rounded(pm_num_mul(rated_torque(app), pm_num(THOUSAND)));
        return true;
    case OD_LIVE_TORQUE_ACTUAL:
        *value = torque_permille(app);
        return true;
    case OD_LIVE_CURRENT_ACTUAL:
        *value = current_permille(app);
        return true;
    default:
        return app_identify_value(app, slot, value) || state_value(app, slot, value);
    }
}

cia402_in_t app_drive_facts(const app_t *app)
{
    const drive_t *drive = &app->drive;
    const protection_config_t *limit = &drive->config.protection;
    const uint32_t derated = (uint32_t)DRIVE_LIMIT_TEMPERATURE | (uint32_t)DRIVE_LIMIT_DC_VOLTAGE;
    const unit_t unit = unit_of(app, IN_SPEED_MECH);
    return (cia402_in_t){
        .ready = app_may_run(app),
        .fault = drive->fault != DRIVE_FAULT_NONE,
        .off = (drive->state == DRIVE_OFF || drive->fault != DRIVE_FAULT_NONE) && !hal_bridge_armed(app->hal),
        .following = drive->fault == DRIVE_FAULT_NONE && drive->state == DRIVE_RUNNING,
        .voltage = drive->status.v_dc >= limit->v_dc_min && drive->status.v_dc <= limit->v_dc_max,
        .limited = (drive->status.limits & ~derated) != 0U,
        .warning = (drive->status.limits & derated) != 0U,
        .velocity = app_in_units(drive->pll.omega, unit.base, unit.exponent),
    };
}
