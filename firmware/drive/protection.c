#include "firmware/drive/drive_parts.h"

#include "firmware/drive/second_bridge.h"
#include "firmware/math/filter.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define FEEDS_SHARE 32 /* of i_max: ten degrees of an i_d of a tenth of rated current, and more */

void drive_trip(drive_t *drive, drive_fault_t fault)
{
    drive->stage = fault_short_stage(drive, fault); /* which opens the bridge */
    if (drive->fault != DRIVE_FAULT_NONE) {
        return;
    }
    drive->fault = fault;
    drive->record = (drive_fault_record_t){
        .fault = fault,
        .i = drive->i_abc,
        .v_dc = drive->status.v_dc,
        .omega = drive->pll.omega,
        .theta = drive->pll.theta,
        .temperature_dC = drive->temperature_dC,
        .period = drive->period,
        .refusal = drive->status.refusal,
    };
}

static bool is_live(const drive_t *drive)
{
    return drive->stage != STAGE_OFF && drive->state != DRIVE_CALIBRATING;
}

void protection_step(drive_t *drive)
{
    const protection_config_t *c = &drive->config.protection;
    const pm_q_t v_dc = drive->status.v_dc;
    /* before the calibration the offsets are not known, and nothing is driven */
    const bool live = is_live(drive);
    if (drive->hw_fault) {
        drive_trip(drive, DRIVE_FAULT_HARDWARE);
    } else if (live && !protection_currents_passed(drive, c->i_trip_squared)) {
        drive_trip(drive, DRIVE_FAULT_OVER_CURRENT);
    } else if (live && !protection_passed(drive, c->i_trip_squared)) {
        drive_trip(drive, v_dc > c->v_dc_max ? DRIVE_FAULT_OVER_VOLTAGE : DRIVE_FAULT_UNDER_VOLTAGE);
    } else {
        /* all is well */
    }
}

bool protection_cause_present(const drive_t *drive)
{
    const protection_config_t *c = &drive->config.protection;
    return drive->hw_fault || drive->temperature_dC >= c->temp_trip_dC ||
           !pm_within(drive->status.v_dc, c->v_dc_min, c->v_dc_max);
}

drive_fault_t protection_fault_of_lost(const drive_t *drive)
{
#if PM_CARRIES(NEEDS_NEUTRAL)
    const bool right = drive->stage == STAGE_VECTOR ||
                       pm_abs(drive->position.pll.omega - drive->omega_ramp) < pm_abs(drive->omega_ramp) / 4;
    if (right && position_lacks_third(&drive->position, &drive->config.position)) {
        return DRIVE_FAULT_NO_THIRD_HARMONIC;
    }
#else
    (void)drive;
#endif
    return DRIVE_FAULT_POSITION_LOST;
}

/* Counts while a condition holds; true when it has held for longer than `limit` ms. */
static bool lasts(uint16_t *timer, bool condition, uint16_t limit)
{
    *timer = condition ? (uint16_t)(*timer + 1U) : 0U;
    return *timer > limit;
}

/* At once where the quality is none. Where the observer alone has little of it, an eighth as fast: an estimate that turns at another
 * speed than the rotor meets it now and then, and its quality comes and goes. Injection has little with a
 * small carrier, and counts from its first slip on; whether a rotor follows an imposed vector is seen elsewhere (follow.h). */
static bool is_lost(drive_t *drive, bool judged)
{
    const position_t *p = &drive->position;
    const uint16_t lost = (uint16_t)(drive->lost + (p->quality == 0 ? 8U : 1U));
    const bool alone = drive->stage == STAGE_VECTOR && (p->weight == PM_ONE || p->slip.count != 0U);
    const bool low = p->quality < (alone ? PM_Q(0.375) : 1);
    drive->lost = judged && low ? lost : 0U;
    return drive->lost / 8U > drive->config.protection.lost_ms;
}

/* At standstill where it should turn, with three quarters of rated current or of its torque, or what there is of them. A load
 * that zero speed holds is not blocked; nor is a rotor that holds less torque. */
static bool is_blocked(const drive_t *drive)
{
    const protection_config_t *c = &drive->config.protection;
    const pm_dq_t i = drive->i_ref;
    pm_q_t torque = 0;
    if (drive->command.mode == DRIVE_MODE_TORQUE) {
        torque = pm_abs(drive->torque_target);
    } else if (pm_abs(drive->speed.reference) <= c->omega_stall) {
        return false;
    } else {
        /* its current says */
    }
    return drive->stage == STAGE_VECTOR && drive->state == DRIVE_RUNNING &&
           pm_abs(drive->position.omega_mean) < c->omega_stall &&
           (torque > pm_mul(c->i_stall, drive->config.machine.psi_m) ||
            pm_mul(i.d, i.d) + pm_mul(i.q, i.q) > pm_mul(c->i_stall, c->i_stall));
}

/* Else their sum is zero, an old one, or without what flows in a leg that is open. */
static bool all_measured(const drive_t *drive)
{
#if PM_HAS(six_step)
    if (drive_commutates(drive) && block_hides_open(drive)) {
        return false;
    }
#endif
    return drive->completed != drive->period;
}

void protection_slow(drive_t *drive)
{
    const protection_config_t *c = &drive->config.protection;
    const bool turning = drive->stage == STAGE_VECTOR || drive_commutates(drive);
    if (drive->temperature_dC >= c->temp_trip_dC) {
        drive_trip(drive, DRIVE_FAULT_OVER_TEMPERATURE);
    }
    if (!is_live(drive)) {
        return;
    }
    const pm_q_t sum = drive->i_abc.a + drive->i_abc.b + drive->i_abc.c;
    if (all_measured(drive) && lasts(&drive->sum_ms, pm_abs(sum) > c->i_sum, 2)) {
        drive_trip(drive, DRIVE_FAULT_SENSOR_SUM);
    }
#if PM_HAS(two_sets)
    const pm_abc_t second = drive->two_sets.i;
    if (lasts(&drive->second_sum_ms, pm_abs(second.a + second.b + second.c) > c->i_sum, 2)) {
        drive_trip(drive, DRIVE_FAULT_SENSOR_SUM);
    }
#endif
    const pm_q_t omega = drive->pll.omega;
    if (turning && pm_abs(omega) > PM_ONE) {
        drive_trip(drive, DRIVE_FAULT_OVER_SPEED);
    }
    /* Also in open loop, where the rotor can lose synchronism, except during the ramp up to the speed from
     * which the observer's angle is used, and at rest, where no EMF shows; not during identification. */
    const bool unseen = drive->forced && (drive->omega_ramp == 0 || open_loop_ramps(drive));
    const bool judged = drive->state >= DRIVE_RUNNING && drive->command.mode < DRIVE_MODE_CURRENT &&
                        !unseen && !drive_commutates(drive); /* which knows at once (block.h) */
    if (is_lost(drive, judged)) {
        drive_trip(drive, protection_fault_of_lost(drive));
    }
#if PM_CARRIES(NEEDS_NEUTRAL)
    if (drive->stage == STAGE_VECTOR && drive->position.absent_ms > POSITION_ABSENT_MS) {
        drive_trip(drive, DRIVE_FAULT_NO_THIRD_HARMONIC);
    }
#endif
    if (lasts(&drive->stall_ms, is_blocked(drive), c->stall_ms)) {
        drive_trip(drive, DRIVE_FAULT_STALL);
    }
}

/* Square of the amplitude that heats as much as all phases do. */
static pm_q_t heating(const drive_t *drive)
{
    const pm_ab_t i = drive->i_ab;
    pm_q_t square = pm_mul(i.alpha, i.alpha) + pm_mul(i.beta, i.beta);
#if PM_HAS(open_winding)
    const pm_q_t zero = drive->open_winding.i;
    square += 2 * pm_mul(zero, zero);
#endif
#if PM_HAS(two_sets)
    const pm_ab_t z = drive->two_sets.z;
    square += pm_mul(z.alpha, z.alpha) + pm_mul(z.beta, z.beta);
#endif
    return square;
}

void protection_heat(drive_t *drive)
{
    const protection_config_t *c = &drive->config.protection;
    const pm_q_t square = is_live(drive) ? heating(drive) : 0;
    if (pm_lp1(&drive->heat, square, c->k_heat) > c->heat_max) {
        drive_trip(drive, DRIVE_FAULT_OVERLOAD);
    }
    if (pm_lp1(&drive->bridge_heat, square, c->k_bridge_heat) > c->bridge_heat_max) {
        drive_trip(drive, DRIVE_FAULT_BRIDGE_OVERLOAD);
    }
}

static bool has_open_phase(drive_t *drive, pm_q_t least, pm_ab_t wanted, pm_ab_t i)
{
#if PM_CARRIES(NEEDS_BRIDGES)
    if (drive->config.winding != (uint8_t)WINDING_STAR) {
        return second_bridge_has_open_phase(drive, least, wanted, i);
    }
#endif
    return open_phase_slow(&drive->open_phase, least, wanted, i, 0);
}

/* References and measured currents of a frame, whichever it is. Not where a carrier leaves control no more than half of its
 * voltage, on a link that has sagged: then dead time has more of it than the direction of the current bears. */
void protection_phases(drive_t *drive)
{
    const bool controlled = drive->stage == STAGE_VECTOR || drive->stage == STAGE_OPEN_LOOP;
    if (!controlled || drive->v_share <= drive->config.v_share / 2) {
        open_phase_reset(&drive->open_phase);
        PM_IN_IMAGE(two_sets, open_phase_reset(&drive->second_open_phase);)
        return;
    }
    const pm_dir_t dir = pm_dir(drive->stage == STAGE_VECTOR ? drive->position.pll.theta : drive->theta_open);
    const protection_config_t *c = &drive->config.protection;
    if (has_open_phase(drive, drive->carrier ? c->judged_carrier : c->judged,
                       pm_park_inverse(drive->i_ref, dir), pm_park_inverse(drive->status.i, dir))) {
        drive_trip(drive, DRIVE_FAULT_OPEN_PHASE);
    }
#if PM_HAS(open_winding)
    if (drive->config.winding == (uint8_t)WINDING_OPEN && second_bridge_is_strained(drive)) {
        const bool imposed = drive->stage == STAGE_OPEN_LOOP && drive->state == DRIVE_RUNNING &&
                             drive->command.mode < DRIVE_MODE_CURRENT;
        drive_trip(drive, imposed ? DRIVE_FAULT_POSITION_LOST : DRIVE_FAULT_OPEN_PHASE);
    }
#endif
}

/* 1 below `from`, 0 above `to`. */
static pm_unit_t derate(int32_t x, int32_t from, int32_t to)
{
    if (x <= from) {
        return PM_UNIT_MAX;
    }
    return x >= to ? 0 : pm_ratio(to - x, to - from);
}

/* Braking takes a small capacitor through the whole range within a millisecond. What was seen is given up with 16 ms. */
void protection_link(drive_t *drive)
{
    const pm_q_t v_dc = drive->status.v_dc;
    const pm_q_t rise = drive->v_dc_before > 0 ? pm_max(v_dc - drive->v_dc_before, 0) : 0;
    const pm_q_t kept = drive->v_dc_ahead - (drive->v_dc_ahead - v_dc) / 16;
    drive->v_dc_ahead = pm_max(v_dc + 2 * rise, kept);
    drive->v_dc_before = v_dc;
}

void protection_current_limits(drive_t *drive, pm_q_t *i_min, pm_q_t *i_max)
{
    const protection_config_t *c = &drive->config.protection;
    const pm_unit_t by_temperature = derate(drive->temperature_dC, c->temp_derate_dC, c->temp_trip_dC);
    /* In the last quarter nothing is regenerated, and the link feeds a rotor that turns: noise of the current, and what an error of
     * the angle makes of i_d, must not carry it to v_dc_max. */
    const pm_q_t v_dc_none = c->v_dc_max - (c->v_dc_max - c->v_dc_derate) / 4;
    const pm_unit_t by_voltage = derate(drive->v_dc_ahead, c->v_dc_derate, v_dc_none);
    const pm_q_t i = pm_unit(drive->config.i_max, by_temperature);
    if (by_temperature < PM_UNIT_MAX) {
        drive->status.limits |= DRIVE_LIMIT_TEMPERATURE;
    }
    *i_max = i;
    *i_min = -i;
    if (by_voltage < PM_UNIT_MAX) {
        drive->status.limits |= DRIVE_LIMIT_DC_VOLTAGE;
        const pm_q_t omega = drive->position.pll.omega;
        const bool feeds = drive->status.v_dc > v_dc_none && pm_abs(omega) > c->omega_stall;
        const pm_q_t brakes = feeds ? -i / FEEDS_SHARE : pm_unit(i, by_voltage);
        if (omega > 0) {
            *i_min = -brakes;
        } else {
            *i_max = brakes;
        }
    }
}
