#include "firmware/drive/drive_parts.h"

#include "firmware/math/filter.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

/* The vector sweeps into its place: a rotor that stands opposite to it would feel no torque. */
#define SWEEP_FROM PM_TURN(0.75)

/* Agreement of observer and imposed speed before the hand-over, and for how long. */
#define AGREE_MS 20

void open_loop_start(drive_t *drive)
{
    drive->stage = STAGE_OPEN_LOOP;
    drive->agree_ms = 0;
    drive->theta_open = SWEEP_FROM;
    drive->omega_ramp = 0;
    drive->omega_open = 0;
    drive->emf_open = 0;
    drive->i_open = 0;
    position_reset(&drive->position, &drive->config.position, 0, drive->i_ab, false);
    regulator_reset(&drive->regulator, &drive->config.regulator, (pm_dq_t){0, 0}, (pm_dq_t){0, 0}, 0);
}

/* The vector keeps its place: the imposed angle starts at the angle of the present current. */
void open_loop_resume(drive_t *drive)
{
    const pm_dq_t i = drive->status.i;
    const pm_angle_t turn = pm_atan2(i.q, i.d);
    const pm_ab_t v = {.alpha = pm_narrow(drive->voltage.v.d), .beta = pm_narrow(drive->voltage.v.q)};
    const pm_dq_t u = pm_park(v, pm_dir(turn));
    drive->theta_open = drive->position.pll.theta + turn;
    drive->omega_ramp = drive->position.pll.omega;
    drive->omega_open = drive->omega_ramp;
    drive->emf_open = 0;
    drive->i_open = pm_hypot(i.d, i.q);
    regulator_reset(&drive->regulator, &drive->config.regulator, u, (pm_dq_t){.d = drive->i_open, .q = 0},
                    drive->omega_ramp);
    drive->agree_ms = 0;
    drive->stage = STAGE_OPEN_LOOP;
}

static void hand_over(drive_t *drive)
{
    const pm_angle_t turn = drive->theta_open - drive->position.pll.theta;
    const pm_dir_t dir = pm_dir(turn);
    const pm_ab_t i = pm_park_inverse((pm_dq_t){.d = drive->i_open, .q = 0}, dir);
    const pm_dq_t v = {.d = pm_narrow(drive->voltage.v.d), .q = pm_narrow(drive->voltage.v.q)};
    const pm_ab_t u = pm_park_inverse(v, dir);
    regulator_reset(&drive->regulator, &drive->config.regulator, (pm_dq_t){.d = u.alpha, .q = u.beta},
                    (pm_dq_t){.d = i.alpha, .q = i.beta}, drive->position.pll.omega);
    reference_reset(drive, i.beta);
    drive->i_ref.d = i.alpha;
    drive->i_open = i.alpha;
    drive->position.carrier = drive_injects(drive); /* at lower speeds */
    drive->stage = STAGE_VECTOR;
}

static pm_q_t approach(pm_q_t x, pm_q_t target, pm_q_t step)
{
    return x + pm_clamp(target - x, -step, step);
}

static pm_q_t wanted_speed(const drive_t *drive)
{
    if (drive->state == DRIVE_STOPPING) {
        return 0;
    }
    if (drive->command.mode == DRIVE_MODE_TORQUE) {
        const pm_q_t fast = drive->config.position.omega_high + drive->config.position.omega_high / 4;
        return drive->torque_target < 0 ? -fast : fast;
    }
    return pm_clamp(drive->omega_target, -drive->config.omega_max, drive->config.omega_max);
}

bool open_loop_ramps(const drive_t *drive)
{
    return drive->omega_ramp != wanted_speed(drive);
}

/* Across the vector, where there is no current: the EMF but for what the rotor lags behind. */
static pm_q_t emf_across(const drive_t *drive)
{
    return pm_narrow_sat(drive->voltage.v.q) -
           pm_mul(drive->omega_open, pm_mul(drive->config.machine.L_d, drive->status.i.d));
}

/* A rotor that follows shows w psi_m, and of that at least 0.7 along or across the vector; one that stands shows what R
 * and saliency are not known to. It is judged where half of w psi_m is more than half of R i and 1/64 of v_dc, which is
 * what the compensation of dead time may leave. */
bool open_loop_stands(const drive_t *drive)
{
    const pm_machine_t *machine = &drive->config.machine;
    const pm_q_t half = pm_mul(pm_abs(drive->omega_ramp), machine->psi_m) / 2;
    const pm_q_t drop = pm_mul(machine->R_s, drive->status.i.d);
    const pm_q_t along = pm_narrow_sat(drive->voltage.v.d) - drop;
    return half > pm_abs(drop) / 2 + drive->status.v_dc / 64 && pm_abs(along) < half &&
           pm_abs(emf_across(drive)) < half;
}

/* A rotor on a vector of constant current swings undamped. Across the vector, where there is no current, the
 * voltage is the EMF of the rotor's speed: the vector falls behind a rotor that is too fast and runs ahead of
 * one that is too slow. */
static void damp(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const pm_q_t emf = pm_clamp(emf_across(drive) - pm_mul(drive->omega_ramp, c->machine.psi_m),
                                -c->open_loop.v_swing, c->open_loop.v_swing);
    const pm_q_t swing = emf - pm_lp1(&drive->emf_open, emf, c->open_loop.k_swing);
    drive->omega_open = drive->omega_ramp - pm_small_gain(pm_small(swing), c->open_loop.per_swing);
}

void open_loop_hold(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const bool current_mode = drive->command.mode == DRIVE_MODE_CURRENT;
    const pm_q_t i_wanted = current_mode ? pm_min(pm_abs(drive->i_target), c->i_max) : c->open_loop.i;
    drive->i_open = approach(drive->i_open, i_wanted, c->open_loop.i_slope);
    drive->i_ref = (pm_dq_t){.d = drive->i_open, .q = 0};
    damp(drive);
}

void open_loop_slow(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const bool current_mode = drive->command.mode == DRIVE_MODE_CURRENT;
    open_loop_hold(drive);
    const pm_q_t target = wanted_speed(drive);
    drive->omega_ramp = approach(drive->omega_ramp, target, c->open_loop.slope);

    const pm_q_t omega = drive->omega_ramp;
    const bool agree = pm_abs(omega) >= c->position.omega_high &&
                       pm_abs(drive->position.pll.omega - omega) < pm_abs(omega) / 4 &&
                       drive->position.quality > PM_Q(0.5);
    drive->agree_ms = agree ? (uint16_t)(drive->agree_ms + 1U) : 0U;
    if (!current_mode && drive->agree_ms > AGREE_MS) {
        hand_over(drive);
    }
}
