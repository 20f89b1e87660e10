/* Resistance, the voltage lost in a leg and the capacitance of a leg (METHODS.md 5.6.1): current along phase
 * A with the rotor on it.
 *
 *   v = R i + 4/3 v_lost - K / i,  K = v_lost I_1
 * A leg whose current moves its capacitance within the dead time gives back v_lost I_1 / (2 i) (modulator.h);
 * phase A has i, the others half of it. Four currents of 100, 80, 60, 40 % of I give the three: with weights
 * of
 *   (3, 1, -1, -3)   the slope,      in which K / I counts -59/12,
 *   (1, -1, -1, 1)   the curvature,  -7/12,
 *   (1, 1, 1, 1)     the mean,       -77/12. */
#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define TURN_MS   400U
#define SETTLE_MS 350U
#define MEAN_MS   250U
#define LEVELS    4U

static pm_q_t top_voltage(const drive_t *drive)
{
    return pm_mul(drive->status.v_dc, PM_Q(0.45));
}

static void set_voltage(drive_t *drive, pm_q_t U)
{
    drive->procedure.identify.of.resistance.U = U;
    const pm_ab_t v = pm_park_inverse((pm_dq_t){.d = U, .q = 0}, pm_dir(drive->theta_open));
    drive->procedure.identify.v = v;
}

void sweep_enter(drive_t *drive)
{
    drive->procedure.identify.kind = KIND_VOLTAGE;
    drive->theta_open = PM_TURN(0.75);
    set_voltage(drive, 0);
}

/* A quarter turn from the initial vector, so that a rotor that stood opposite to it has been moved. */
phase_result_t sweep_slow(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    const pm_q_t wanted = commissioning_current(drive);
    const pm_q_t step = drive->status.v_dc / 4096 + 1;
    const pm_q_t i = pm_hypot(commissioning_mean(self, 0), commissioning_mean(self, 1));
    commissioning_clear_sums(self);
    pm_q_t U = self->of.resistance.U;
    if (U > top_voltage(drive)) {
        return (phase_result_t){.failed = COMMISSIONING_NO_CURRENT};
    }
    if (self->part == 1U) {
        drive->theta_open += PM_TURN(0.25) / TURN_MS;
        U += i > wanted ? -2 * step : 0;
        if (pm_angle_diff(drive->theta_open, 0U) >= 0) {
            drive->theta_open = 0;
            self->part = 2;
        }
    } else {
        const pm_q_t enough = self->part == 0U ? wanted / 2 : wanted;
        U += i < enough ? step : 0;
        if (i >= enough) {
            self->part++;
        }
    }
    set_voltage(drive, U);
    self->of.resistance.R_hat = pm_div(U, pm_max(i, wanted / 16));
    return (phase_result_t){.done = self->part == 3U};
}

void levels_enter(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    self->of.resistance.slope_v = 0;
    self->of.resistance.slope_i = 0;
    self->of.resistance.bend_v = 0;
    self->of.resistance.bend_i = 0;
    self->of.resistance.v = 0;
    self->of.resistance.i = 0;
}

static phase_result_t conclude(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    commissioning_result_t *r = &drive->commissioning_report.result;
    if (self->of.resistance.slope_i <= 0 || self->of.resistance.slope_v <= 0) {
        return (phase_result_t){.failed = COMMISSIONING_IMPLAUSIBLE};
    }
    const pm_q_t slope_i = self->of.resistance.slope_i;
    const pm_q_t first = pm_div(self->of.resistance.slope_v, slope_i);
    const pm_q_t bend = self->of.resistance.bend_v - pm_mul(first, self->of.resistance.bend_i);
    const pm_q_t back = pm_max(pm_mul(-bend, PM_Q(12.0 / 7)), 0); /* K / I */
    const pm_q_t R = pm_div(self->of.resistance.slope_v - pm_mul(back, PM_Q(59.0 / 12)), slope_i);
    const pm_q_t gap =
        self->of.resistance.v - pm_mul(R, self->of.resistance.i) + pm_mul(back, PM_Q(77.0 / 12));
    r->R = R;
    r->lost = pm_max(pm_mul(gap, PM_Q(0.75 / LEVELS)), 0);
    r->move = r->lost > 0 ? pm_mul(pm_div(back, r->lost), commissioning_current(drive)) : 0;
    self->R = R;
    self->lost = r->lost;
    return (phase_result_t){.done = true};
}

static void take_level(identify_t *self)
{
    static const int32_t weights[LEVELS] = {3, 1, -1, -3};
    const pm_q_t i = commissioning_mean(self, 0);
    const pm_q_t v = commissioning_mean(self, 2);
    self->of.resistance.slope_i += weights[self->part] * i;
    self->of.resistance.slope_v += weights[self->part] * v;
    static const int32_t curved[LEVELS] = {1, -1, -1, 1};
    self->of.resistance.bend_i += curved[self->part] * i;
    self->of.resistance.bend_v += curved[self->part] * v;
    self->of.resistance.i += i;
    self->of.resistance.v += v;
}

/* Integral control with 50 ms: the slope of the current per volt is known to a factor of two only. */
phase_result_t levels_slow(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    const pm_q_t full = commissioning_current(drive);
    const pm_q_t wanted = full - (pm_q_t)self->part * (full / 5);
    const bool even = pm_abs(commissioning_mean(self, 1)) < full / 4;
    if (self->ms > SETTLE_MS + MEAN_MS) {
        if (!even) {
            return (phase_result_t){.failed = COMMISSIONING_UNEVEN};
        }
        take_level(self);
        self->part++;
        self->ms = 0;
        commissioning_clear_sums(self);
        return self->part == LEVELS ? conclude(drive) : (phase_result_t){.done = false};
    }
    if (self->ms <= SETTLE_MS) {
        const pm_q_t error = wanted - commissioning_mean(self, 0);
        const pm_q_t U = self->of.resistance.U + pm_mul(pm_mul(error, self->of.resistance.R_hat), PM_Q(0.02));
        commissioning_clear_sums(self);
        if (U > top_voltage(drive)) {
            return (phase_result_t){.failed = COMMISSIONING_NO_CURRENT};
        }
        set_voltage(drive, U);
    }
    return (phase_result_t){.done = false};
}
