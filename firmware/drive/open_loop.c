#include "firmware/drive/drive_parts.h"

#include "firmware/math/filter.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

/* The vector sweeps into its place: a rotor that stands opposite to it would feel no torque. */
#define SWEEP_FROM PM_TURN(0.75)

/* Agreement of observer and imposed speed before the hand-over, and for how long. */
#define AGREE_MS 20U
#define WAIT_MS  500U /* for it, from speed_high on */
/* Of an angle, to FOLLOW_TURN. */
#define PER_TURN (INT32_MAX / (FOLLOW_TURN / 2))
/* With more current, before the vector turns once more. */
#define REST_MS 100U
/* From the lead of an observer on: the voltage of a step of the current is not that of the rotor. */
#define SETTLE_MS 5U

void open_loop_begin(drive_t *drive)
{
    drive->stage = STAGE_OPEN_LOOP;
    drive->emf_open = 0;
    drive->agree_ms = 0;
    drive->wait_ms = 0;
    drive->rest_ms = 0;
    drive->tried = false;
}

void open_loop_start(drive_t *drive)
{
    open_loop_begin(drive);
    drive->theta_open = SWEEP_FROM;
    drive->omega_ramp = 0;
    drive->omega_open = 0;
    drive->i_open = 0;
    drive->i_ref = (pm_dq_t){0, 0};
    drive->i_vector = drive->config.open_loop.i;
    position_reset(&drive->position, &drive->config.position, &(pm_pll_t){0}, drive->i_ab, false);
    regulator_reset(&drive->regulator, &drive->config.regulator, (pm_dq_t){0, 0}, (pm_dq_t){0, 0}, 0);
}

/* More current than the torque takes, as far ahead of the rotor as makes the same of it. */
static pm_dq_t with_margin(const drive_t *drive, pm_dq_t i)
{
    const drive_config_t *c = &drive->config;
    const pm_q_t wanted = pm_max(c->open_loop.i, 2 * pm_abs(i.q) + pm_half(c->open_loop.i));
    const pm_q_t length = pm_min(wanted, pm_max(c->i_max, pm_abs(i.q)));
    return (pm_dq_t){.d = pm_sqrt(pm_mul(length, length) - pm_mul(i.q, i.q)), .q = i.q};
}

/* EMF of a rotor whose position is known, beside that of its speed: what R, L and psi_m are not known to. Damping must not take
 * it for a swing. */
static pm_q_t unexplained(const drive_t *drive, pm_ab_t v, pm_dq_t i)
{
    const pm_machine_t *m = &drive->config.machine;
    const pm_q_t psi_d = m->psi_m + pm_mul(m->L_d, i.d);
    return v.beta - pm_mul(drive->follow.R, i.q) - pm_mul(drive->omega_ramp, psi_d);
}

/* The torque stays as it is. */
void open_loop_resume(drive_t *drive)
{
    const pm_dq_t i = drive->status.i;
    const pm_dq_t vector = with_margin(drive, i);
    const pm_angle_t turn = pm_atan2(vector.q, vector.d);
    const pm_dir_t dir = pm_dir(turn);
    const pm_ab_t v = {.alpha = pm_narrow(drive->voltage.v.d), .beta = pm_narrow(drive->voltage.v.q)};
    const pm_ab_t present = {.alpha = i.d, .beta = i.q};
    drive->i_open = pm_hypot(vector.d, vector.q);
    drive->i_vector = drive->i_open;
    drive->theta_open = drive->position.pll.theta + turn;
    drive->omega_ramp = drive->position.pll.omega;
    drive->omega_open = drive->omega_ramp;
    regulator_reset(&drive->regulator, &drive->config.regulator, pm_park(v, dir), pm_park(present, dir),
                    drive->omega_ramp);
    follow_resume(&drive->follow);
    open_loop_begin(drive);
    drive->i_ref = (pm_dq_t){.d = drive->i_open, .q = 0};
    drive->rest_ms = SETTLE_MS;
    drive->emf_open = unexplained(drive, v, i);
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

void open_loop_release(drive_t *drive)
{
    /* not that of the vector: what damps the rotor's swings is as noisy as the voltage */
    drive->position.pll.omega = drive->omega_ramp;
    if (drive->follow.follows) {
        const position_config_t *c = &drive->config.position;
        position_turn(&drive->position, c, 0U - drive->follow.lag, drive->i_ab);
        position_set_resistance(&drive->position, c, drive->follow.R);
    }
}

static pm_q_t wanted_speed(const drive_t *drive)
{
    if (drive->state == DRIVE_STOPPING) {
        return 0;
    }
    if (drive->command.mode == DRIVE_MODE_TORQUE) {
        const pm_q_t high = drive->config.position.omega_high;
        const pm_q_t fast = pm_min(high + high / 4, drive->config.omega_max);
        return drive->torque_target < 0 ? -fast : fast;
    }
    return pm_clamp(drive->omega_target, -drive->config.omega_max, drive->config.omega_max);
}

bool open_loop_ramps(const drive_t *drive)
{
    return drive->omega_ramp != wanted_speed(drive);
}

/* Too fast for a rotor that swings to stand. */
static bool is_fast(const drive_t *drive)
{
    return drive->follow.emf >= pm_half(drive->config.open_loop.v_swing);
}

/* The EMF of the rotor's speed, along where it is: across the vector alone a lag delta shows as speed, omega sin(delta), which
 * from 0.7 of the swing's frequency on turns damping into its opposite. Below half of that frequency, where the rotor may swing
 * through zero, and until it has been seen to follow, across the vector alone. */
static pm_q_t emf_of_speed(const drive_t *drive)
{
    const pm_machine_t *m = &drive->config.machine;
    const follow_t *f = &drive->follow;
    const pm_q_t i = drive->status.i.d;
    /* What the vector moves by in a millisecond moves the current across the rotor, where it meets L_q of a rotor that does not lag
     * and less of one that does. */
    const pm_q_t L_across = m->L_d + (m->L_q - m->L_d) / 4;
    const pm_q_t reactive = pm_mul(drive->omega_ramp, pm_mul(m->L_d, i)) +
                            pm_mul(drive->omega_open - drive->omega_ramp, pm_mul(L_across, i));
    const pm_ab_t e = {.alpha = pm_narrow(drive->voltage.v.q) - reactive,
                       .beta = pm_narrow(drive->voltage.v.d) - pm_mul(f->R, i)};
    if (!is_fast(drive) || !f->follows) {
        return e.alpha;
    }
    return pm_park(e, pm_dir(f->lag)).d;
}

/* A rotor on a vector of constant current swings undamped: the vector falls behind one that is too fast and runs ahead of
 * one that is too slow. */
static void damp(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const pm_q_t v = c->open_loop.v_swing;
    const pm_q_t steady = is_fast(drive) ? drive->emf_open : 0; /* what R, L and psi_m are not known to */
    const pm_q_t emf = emf_of_speed(drive) - pm_mul(drive->omega_ramp, c->machine.psi_m);
    const pm_q_t seen = steady + pm_clamp(emf - steady, -v, v);
    const pm_q_t swing = seen - pm_lp1(&drive->emf_open, seen, c->open_loop.k_swing);
    const pm_q_t yields = -pm_small_gain(pm_small(swing), c->open_loop.per_swing);
    const pm_q_t moves = drive->omega_open - drive->omega_ramp;
    drive->omega_open += pm_mul(yields - moves, (pm_q_t)c->open_loop.k_yield * (PM_ONE / 32768));
}

void open_loop_hold(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const bool current_mode = drive->command.mode == DRIVE_MODE_CURRENT;
    const pm_q_t i_wanted = current_mode ? pm_min(pm_abs(drive->i_target), c->i_max) : drive->i_vector;
    drive->i_open = pm_approach(drive->i_open, i_wanted, c->open_loop.i_slope);
    drive->i_ref = (pm_dq_t){.d = drive->i_open, .q = 0};
    damp(drive);
}

/* Once more from standstill, with the most current that saliency lets it. A vector that the user gave, or that a rotor had followed, is not
 * tried again. */
static void try_again(drive_t *drive)
{
    const bool may = drive->command.mode != DRIVE_MODE_CURRENT && !drive->follow.follows;
    if (!may || drive->tried) {
        drive_trip(drive, DRIVE_FAULT_STALL);
        return;
    }
    drive->tried = true;
    drive->i_vector = drive->config.open_loop.i_most;
    drive->omega_ramp = 0;
    drive->rest_ms = REST_MS;
    drive->wait_ms = 0;
    follow_again(&drive->follow, FOLLOW_TURN);
}

/* The current follows the load, where that shows. */
static void watch(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const follow_in_t in = {.omega = drive->omega_ramp,
                            .v = {.d = pm_narrow(drive->voltage.v.d), .q = pm_narrow(drive->voltage.v.q)},
                            .i = drive->i_open,
                            .v_dc = drive->status.v_dc,
                            .turn = pm_abs(drive->turn_open) / PER_TURN * (int32_t)c->slow_divider};
    if (follow_slow(&drive->follow, &c->machine, &in)) {
        try_again(drive);
        return;
    }
    const int32_t load = follow_load(&drive->follow);
    if (load > 0) {
        drive->i_vector = pm_min(drive->i_vector + c->open_loop.i_slope, c->open_loop.i_most);
    } else if (load < 0) {
        drive->i_vector = pm_max(drive->i_vector - c->open_loop.i_slope / 8, c->open_loop.i);
    } else {
        /* right, or not known */
    }
}

static void hand_over_in_time(drive_t *drive)
{
    const pm_q_t omega = drive->omega_ramp;
    const bool fast = pm_abs(omega) >= drive->config.position.omega_high;
    const bool agree = fast && pm_abs(drive->position.pll.omega - omega) < pm_abs(omega) / 4 &&
                       drive->position.quality > PM_Q(0.5);
    drive->agree_ms = agree ? (uint16_t)(drive->agree_ms + 1U) : 0U;
    drive->wait_ms = fast ? (uint16_t)(drive->wait_ms + 1U) : 0U;
    if (drive->agree_ms > AGREE_MS) {
        hand_over(drive);
    } else if (drive->wait_ms > WAIT_MS) {
        drive_trip(drive, protection_fault_of_lost(drive));
    } else {
        /* not yet */
    }
}

void open_loop_rested(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    follow_rested(&drive->follow, &c->machine, drive->i_open, drive->status.v_dc);
    position_set_resistance(&drive->position, &c->position, drive->follow.R);
}

static bool settles(const drive_t *drive)
{
    return drive->rest_ms > 0U && drive->follow.follows;
}

void open_loop_slow(drive_t *drive)
{
    if (settles(drive)) {
        drive->rest_ms--;
        return;
    }
    open_loop_hold(drive);
    if (drive->rest_ms > 0U) {
        drive->rest_ms--;
    } else {
        drive->omega_ramp =
            pm_approach(drive->omega_ramp, wanted_speed(drive), drive->config.open_loop.slope);
    }
    watch(drive);
    if (drive->command.mode != DRIVE_MODE_CURRENT && drive->stage == STAGE_OPEN_LOOP) {
        hand_over_in_time(drive);
    }
}
