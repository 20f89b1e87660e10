/* What block commutation is to give, at 1 kHz: the current that a speed or a torque wants, or the voltage of a duty, within the
 * limits of both. */
#include "firmware/drive/block.h"

#include "firmware/drive/drive_parts.h"
#include "firmware/math/filter.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#if PM_HAS(six_step)

pm_q_t block_emf(const drive_t *drive)
{
    const pm_q_t psi = pm_mul(drive->config.machine.psi_m, LINE_OF_PHASES);
    return pm_mul_sat(psi, pm_abs(drive->block.pll.omega));
}

void block_prepare(drive_t *drive, pm_q_t i_q)
{
    block_t *self = &drive->block;
    const pm_q_t emf = block_emf(drive);
    const pm_q_t i = pm_mul(i_q, LINE_OF_Q);
    line_current_prepare(&self->current, self->six_step.reverse ? -i : i, emf,
                         pm_max(drive->status.v_dc, DRIVE_V_DC_LEAST));
}

void block_take_duty(drive_t *drive)
{
    const pm_q_t emf = pm_mul(drive->config.machine.psi_m, LINE_OF_PHASES); /* at base speed */
    const pm_q_t omega = pm_div(pm_mul(pm_abs(drive->duty_target), drive->status.v_dc), emf);
    drive->omega_target = drive->duty_target < 0 ? -omega : omega;
}

void block_report(drive_t *drive, pm_q_t i_q)
{
    const block_t *self = &drive->block;
    const pm_q_t i = pm_mul(self->i, Q_OF_LINE);
    drive->i_ref = (pm_dq_t){.d = 0, .q = i_q};
    drive->status.i = (pm_dq_t){.d = 0, .q = self->six_step.reverse ? -i : i};
    const pm_q_t v = pm_mul(pm_mul(self->current.u, drive->status.v_dc), PM_Q(1 / 1.6539866862653761));
    drive->v_next =
        pm_park_inverse((pm_dq_t){.d = 0, .q = self->six_step.reverse ? -v : v}, pm_dir(self->pll.theta));
}

static bool follows_duty(const drive_t *drive)
{
    return drive->command.mode == DRIVE_MODE_DUTY && drive->state != DRIVE_STOPPING;
}

/* With less the rotor would not keep its speed. */
static pm_q_t in_q(const drive_t *drive, pm_q_t i)
{
    return pm_max(pm_mul_sat(i, Q_OF_LINE), drive->config.i_max / 8);
}

/* Narrowed to the currents with which a crossing is seen in time, where the freewheeling lasts longest: of one that drives into a
 * sector whose new leg is chopped, of one that brakes into one whose is not. What a speed or a torque brakes with is the user's. */
static void narrow(const drive_t *drive, pm_q_t *i_min, pm_q_t *i_max)
{
    const block_config_t *c = &drive->config.block;
    const block_t *self = &drive->block;
    const pattern_id_t pattern = c->six_step.pattern.id;
    freewheeling_in_t in = {.pattern = pattern,
                            .sector = pattern_chops_incoming(pattern, 1) ? 1U : 0U,
                            .u = self->current.u,
                            .v_dc = drive->status.v_dc,
                            .omega = pm_max(pm_abs(self->pll.omega), 1)};
    const pm_q_t left = pm_max(PM_Q(0.5235987755982988) - pm_mul(in.omega, c->blind), 0);
    const pm_q_t drives = in_q(drive, freewheeling_current(&c->freewheeling, &in, left));
    pm_q_t brakes = drives;
    if (follows_duty(drive)) {
        in.sector = pattern_chops_incoming(pattern, 0) ? 1U : 0U;
        brakes = in_q(drive, freewheeling_braking(&c->freewheeling, &in, left));
    }
    *i_min = pm_max(*i_min, self->six_step.reverse ? -drives : -brakes);
    *i_max = pm_min(*i_max, self->six_step.reverse ? brakes : drives);
}

/* What the duty may change by in a millisecond. A rotor that is light enough to follow it at once must not outrun t_60, the mean of the
 * last six sectors. */
static pm_q_t duty_step(const drive_t *drive)
{
    const block_config_t *c = &drive->config.block;
    const pm_q_t u = pm_max(pm_abs(drive->block.duty), PM_ONE / 32);
    const pm_q_t of_turn = pm_mul_sat(pm_mul_sat(u, pm_abs(drive->block.pll.omega)), c->duty_turn);
    const bool rises = pm_abs(drive->duty_target) > u && (drive->duty_target < 0) == (drive->block.duty < 0);
    return rises ? pm_min(c->duty_step, of_turn + 1) : c->duty_step;
}

/* The voltage is given, and the current is what it makes. */
static void follow_duty(drive_t *drive, pm_q_t i_min, pm_q_t i_max)
{
    block_t *self = &drive->block;
    const bool reverse = self->six_step.reverse;
    self->duty = pm_approach(self->duty, drive->duty_target, duty_step(drive));
    block_prepare(drive, reverse ? i_min : i_max);
    line_current_give(&self->current, pm_max(reverse ? -self->duty : self->duty, 0),
                      pm_mul(reverse ? -i_max : i_min, LINE_OF_Q));
    drive->status.limits |= self->current.held ? DRIVE_LIMIT_CURRENT : 0U;
    self->current.held = false;
    const pm_q_t i_q = pm_mul(reverse ? -self->i : self->i, Q_OF_LINE);
    speed_control_reset(&drive->speed, self->pll.omega, pm_clamp(i_q, i_min, i_max));
    block_report(drive, i_q);
}

void block_follow(drive_t *drive)
{
    block_t *self = &drive->block;
    drive->status.limits |= self->current.limited != 0U ? DRIVE_LIMIT_VOLTAGE : 0U;
    if (drive->block_ms == 0U) { /* the ramp begins at the voltage that there is */
        self->duty = self->six_step.reverse ? -self->current.u : self->current.u;
    }
    pm_q_t i_min;
    pm_q_t i_max;
    reference_range(drive, drive->config.i_max, &i_min, &i_max);
    if (drive->config.block.limit) {
        narrow(drive, &i_min, &i_max);
    }
    if (follows_duty(drive)) {
        follow_duty(drive, i_min, i_max);
    } else {
        const pm_q_t i_q = reference_torque(drive, self->pll.omega, i_min, i_max);
        block_prepare(drive, i_q);
        block_report(drive, i_q);
    }
}

#endif
