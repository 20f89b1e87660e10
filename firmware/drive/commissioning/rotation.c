/* Magnet flux, inertia and friction: a current vector turns and pulls the rotor along (METHODS.md 1.3.1.3).
 *
 * In the vector's frame:
 *   psi         = (v - R i) / (j omega)
 *   psi - L_q i = psi_m + (L_d - L_q) i_d              active flux, on the rotor's axis
 *   torque      = 1.5 P i (v_d - R i) / omega
 * The active flux is on the rotor's axis wherever the load has turned it. Two currents give psi_m without
 * L_d. J times the acceleration is half the difference of the torques while speeding up and slowing down at
 * the same rate over the same speeds; R and friction cancel. Friction at two speeds gives the viscous
 * part. */
#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/math/filter.h"
#include "firmware/math/num.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define RAMP_MS   2000
#define SETTLE_MS 600U
#define MEAN_MS   600U

enum { U_D, U_Q, I_D, I_Q, TORQUE }; /* of the sums */

typedef struct {
    pm_q_t psi; /* of the magnet */
    bool follows;
} active_t;

void rotation_enter(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    self->of.rotation.omega =
        pm_clamp(drive->omega_target, -drive->config.omega_max, drive->config.omega_max);
    self->of.rotation.count = 0;
    self->of.rotation.omega_ref = 0;
    self->of.rotation.u_d = drive->voltage.v.d;
}

static pm_q_t ramp_step(const identify_t *self)
{
    return pm_abs(self->of.rotation.omega) / RAMP_MS + 1;
}

/* Torque over 1.5 P i, including the resistive loss: power over omega. i_q is the error that ramps leave. */
static pm_q_t torque_voltage(const identify_t *self, pm_q_t omega)
{
    const pm_q_t i_d = pm_max(commissioning_mean(self, I_D), 1);
    const pm_q_t turned = pm_mul(commissioning_mean(self, U_Q), pm_div(commissioning_mean(self, I_Q), i_d));
    return pm_div(commissioning_mean(self, U_D) + turned, omega);
}

/* Between half the speed and nine tenths. */
static void take_torque(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    const pm_q_t top = pm_abs(self->of.rotation.omega);
    const pm_q_t omega = pm_abs(self->of.rotation.omega_ref);
    if (omega > top / 2 && omega < top - top / 10) {
        self->sum[TORQUE] += torque_voltage(self, omega);
        self->of.rotation.count++;
    }
    const int64_t torque = self->sum[TORQUE];
    commissioning_clear_sums(self);
    self->sum[TORQUE] = torque;
}

static pm_q_t mean_torque(const identify_t *self)
{
    return (pm_q_t)pm_quotient(self->sum[TORQUE], self->of.rotation.count);
}

/* A rotor on a vector that turns at a given speed swings like a pendulum. u_d rises by u_q per radian that it
 * falls behind; the vector then slows down: 30 rad/s per radian. */
static void turn_on(drive_t *drive, pm_q_t target)
{
    identify_t *self = &drive->procedure.identify;
    const pm_q_t ref = pm_approach(self->of.rotation.omega_ref, target, ramp_step(self));
    const pm_q_t off = drive->voltage.v.d - self->of.rotation.u_d;
    self->of.rotation.u_d += off / 256;
    self->of.rotation.omega_ref = ref;
    drive->omega_open = ref;
    if (pm_abs(ref) > pm_abs(self->of.rotation.omega) / 4) {
        const pm_q_t behind = pm_clamp(pm_div(off, pm_abs(drive->voltage.v.q)), -PM_Q(0.3), PM_Q(0.3));
        /* per-unit: 0.03 over the radians of a millisecond at base speed, which are up to half of one in a period */
        const pm_q_t per_ms_8 = commissioning_period(drive) / 8 * (int32_t)drive->config.slow_divider;
        const pm_q_t back = pm_mul(behind, pm_div(PM_Q(0.03 / 8), per_ms_8));
        drive->omega_open -= ref < 0 ? -back : back;
    }
}

phase_result_t rotation_up(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    take_torque(drive);
    turn_on(drive, self->of.rotation.omega);
    self->of.rotation.tau_up = mean_torque(self);
    return (phase_result_t){.done = self->of.rotation.omega_ref == self->of.rotation.omega};
}

static active_t active_flux(const drive_t *drive)
{
    const identify_t *self = &drive->procedure.identify;
    const pm_q_t omega = self->of.rotation.omega;
    const pm_q_t speed = pm_abs(omega);
    const pm_q_t i = commissioning_mean(self, I_D);
    const pm_q_t e_d = commissioning_mean(self, U_D) - pm_mul(self->R, i);
    const pm_q_t e_q = omega < 0 ? -commissioning_mean(self, U_Q) : commissioning_mean(self, U_Q);
    const pm_q_t d = pm_div(e_q, speed) - pm_mul(self->L_q, i);
    const pm_q_t q = pm_div(e_d, speed);
    const pm_q_t length = pm_hypot(d, q);
    const pm_q_t i_d = pm_mul(i, pm_div(d, pm_max(length, 1)));
    const pm_q_t psi = length + pm_mul(self->L_q - self->L_d, i_d);
    const bool follows = d > pm_mul(self->L_q, i) / 8 && pm_abs(q) < 2 * d && psi > 0;
    return (active_t){.psi = psi, .follows = follows};
}

static bool is_measured(identify_t *self)
{
    if (self->ms == SETTLE_MS) {
        commissioning_clear_sums(self);
    }
    return self->ms >= SETTLE_MS + MEAN_MS;
}

static const phase_result_t running = {.done = false};
static const phase_result_t stuck = {.failed = COMMISSIONING_NOT_TURNING};

phase_result_t rotation_full(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    turn_on(drive, self->of.rotation.omega);
    if (!is_measured(self)) {
        return running;
    }
    const active_t active = active_flux(drive);
    if (!active.follows) {
        return stuck;
    }
    self->of.rotation.psi_full = active.psi;
    self->of.rotation.tau_even = torque_voltage(self, pm_abs(self->of.rotation.omega));
    return (phase_result_t){.done = true};
}

/* At a quarter of the current, where saliency and its saturation have little effect. */
phase_result_t rotation_less(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    commissioning_result_t *r = &drive->commissioning_report.result;
    const pm_q_t half = commissioning_current(drive) / 4;
    drive->i_ref.d = pm_approach(drive->i_ref.d, half, half / 64 + 1);
    turn_on(drive, self->of.rotation.omega);
    if (!is_measured(self)) {
        return running;
    }
    const active_t active = active_flux(drive);
    /* with a rotor at standstill the result would be proportional to the current: half now */
    if (!active.follows || active.psi < pm_mul(self->of.rotation.psi_full, PM_Q(0.75))) {
        return stuck;
    }
    r->psi_m = active.psi;
    return (phase_result_t){.done = true};
}

static void conclude_mechanics(drive_t *drive, pm_q_t tau_down, pm_q_t i)
{
    const identify_t *self = &drive->procedure.identify;
    commissioning_result_t *r = &drive->commissioning_report.result;
    const pm_q_t tau_up = self->of.rotation.tau_up;
    r->J = pm_div(pm_mul(tau_up - tau_down, i) / 2, ramp_step(self) * COMMISSIONING_J_STEPS);

    /* voltage across R, over the speeds of the window (mean of 1 / omega: 1.469) and at the top */
    const pm_q_t top = pm_abs(self->of.rotation.omega);
    const pm_q_t at_top = pm_div(pm_mul(self->R, i), top);
    const pm_q_t even = self->of.rotation.tau_even - at_top;
    const pm_q_t middle = pm_mean(tau_up, tau_down) - pm_mul(at_top, PM_Q(1.46947));
    r->viscous = pm_div(pm_mul(even - middle, i), pm_mul(top, PM_Q(0.3)));
    r->coulomb = pm_mul(even, i) - pm_mul(r->viscous, top);
}

phase_result_t rotation_down(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    const pm_q_t full = commissioning_current(drive) / 2;
    if (self->ms < SETTLE_MS) {
        drive->i_ref.d = pm_approach(drive->i_ref.d, full, full / 64 + 1);
        turn_on(drive, self->of.rotation.omega);
        commissioning_clear_sums(self);
        self->of.rotation.count = 0;
        return running;
    }
    take_torque(drive);
    turn_on(drive, 0);
    if (self->of.rotation.omega_ref != 0) {
        return running;
    }
    const pm_q_t tau_down = mean_torque(self);
    const bool wanted = (drive->commissioning_report.routines & (uint8_t)COMMISSIONING_MECHANICS) != 0U;
    if (wanted) {
        conclude_mechanics(drive, tau_down, full);
        if (drive->commissioning_report.result.J <= 0) {
            return (phase_result_t){.failed = COMMISSIONING_NOT_TURNING};
        }
    }
    return (phase_result_t){.done = true};
}
