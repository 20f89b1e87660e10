#include "firmware/drive/fault_short.h"

#include "firmware/drive/drive_parts.h"
#include "firmware/math/compiler.h"
#include "firmware/math/filter.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

/* Smallest current with an angle. */
#define I_LEAST PM_Q(0.02)

/* What is left of the flux at the fault when the current's angle counts. */
#define FLUX_LEAST PM_Q(0.1)

/* Phase EMF of a star over link voltage, 1 / sqrt(3) and a sixteenth more or less. */
#define BEGINS PM_UNIT(0.5773503 * 17 / 16)
#define ENDS   PM_UNIT(0.5773503 * 15 / 16)

/* Not: a switch that may be broken or is too warm (HARDWARE, OVER_CURRENT, OVER_TEMPERATURE, BRIDGE_OVERLOAD, OPEN_PHASE), currents
 * that are not known (SENSOR_...), a program or numbers that are not to be relied on (OVERRUN, PARAMETERS),
 * POSITION_NOT_FOUND, where nothing turns. */
static bool leaves_low_switches(drive_fault_t fault)
{
    bool leaves = false;
    switch (fault) {
    case DRIVE_FAULT_OVER_VOLTAGE:
    case DRIVE_FAULT_UNDER_VOLTAGE:
    case DRIVE_FAULT_OVER_SPEED:
    case DRIVE_FAULT_POSITION_LOST:
    case DRIVE_FAULT_NO_THIRD_HARMONIC:
    case DRIVE_FAULT_STALL:
    case DRIVE_FAULT_OVERLOAD:
    case DRIVE_FAULT_REMOTE_LOST:
    case DRIVE_FAULT_TEMPERATURE_SENSOR:
        leaves = true;
        break;
    default:
        break;
    }
    return leaves;
}

static pm_q_t link(const drive_t *drive)
{
    return pm_max(drive->status.v_dc, drive->config.protection.v_dc_min);
}

/* EMF of a phase above which it begins, and below which it ends; of an open winding each phase meets the link by itself. */
static pm_q_t begins_at(const drive_t *drive)
{
    const pm_q_t v_dc = link(drive);
    PM_IN_IMAGE(
        open_winding, if (drive->config.winding == (uint8_t)WINDING_OPEN) { return v_dc + v_dc / 16; })
    return pm_unit(v_dc, BEGINS);
}

static pm_q_t ends_at(const drive_t *drive)
{
    const pm_q_t v_dc = link(drive);
    PM_IN_IMAGE(
        open_winding, if (drive->config.winding == (uint8_t)WINDING_OPEN) { return v_dc - v_dc / 16; })
    return pm_unit(v_dc, ENDS);
}

static bool begins(drive_t *drive, drive_fault_t fault)
{
    const drive_config_t *c = &drive->config;
    const bool lost = fault == DRIVE_FAULT_POSITION_LOST ||
                      (PM_CARRIES(NEEDS_NEUTRAL) != 0 && fault == DRIVE_FAULT_NO_THIRD_HARMONIC);
    const pm_q_t omega = lost ? drive->status.omega_ref : drive->pll.omega;
    drive->fault_short =
        (fault_short_t){.flux = PM_ONE, .turn = pm_half(pm_omega_to_angle(omega, c->k_theta))};
    return c->fault_short.k != 0 && drive->stage >= STAGE_OPEN_LOOP &&
           pm_mul_sat(c->machine.psi_m, pm_abs(omega)) > begins_at(drive);
}

PM_APART drive_stage_t fault_short_stage(drive_t *drive, drive_fault_t fault)
{
    drive_stage_t stage = STAGE_OFF;
    if (leaves_low_switches(fault)) {
        if (drive->fault != DRIVE_FAULT_NONE) {
            stage = drive->stage;
        } else if (begins(drive, fault)) {
            stage = STAGE_SHORT;
        } else {
            /* the EMF is below the link, or this is not wanted */
        }
    }
    return stage;
}

PM_APART void fault_short_step(drive_t *drive, drive_out_t *out)
{
    fault_short_t *self = &drive->fault_short;
    const pm_ab_t i = drive->i_ab;
    const pm_frac_t k = drive->config.fault_short.k;
    const pm_angle_t theta = pm_atan2(i.beta, i.alpha);
    if (pm_lp1(&self->flux, 0, k) < FLUX_LEAST) {
        const bool has_angle = pm_abs(i.alpha) > I_LEAST || pm_abs(i.beta) > I_LEAST;
        (void)pm_lp1(&self->turn, has_angle ? pm_half(pm_angle_diff(theta, self->theta)) : 0, k);
    }
    self->theta = theta;
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        pm_write_leg(out->compare[x], 0);
    }
    out->legs = PM_LEGS_PWM;
}

void fault_short_slow(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const pm_q_t omega = pm_div(ends_at(drive), c->machine.psi_m);
    if (drive->temperature_dC >= c->protection.temp_trip_dC ||
        pm_abs(drive->fault_short.turn) < pm_half(pm_omega_to_angle(omega, c->k_theta))) {
        drive->stage = STAGE_OFF;
    }
}
