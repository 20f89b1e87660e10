#include "firmware/drive/drive_parts.h"

#include "firmware/math/root.h"

/* What does not fit saturates at 4, and the limits below clamp it with a flag. */
static pm_q_t to_signal(int32_t value, pm_num_t unit)
{
    return pm_half(pm_num_times(value, unit, PM_Q_BITS + 1));
}

void reference_take(drive_t *drive)
{
    const drive_command_t *command = &drive->command;
    drive->omega_target = to_signal(command->speed_mrad_s, drive->config.per_mrad_s);
    drive->torque_target = to_signal(command->torque_uNm, drive->config.per_uNm);
    drive->i_target = to_signal(command->current_mA, drive->config.per_mA);
#if PM_HAS(six_step)
    const pm_num_t millionth = {.m = 1125899907, .e = -50}; /* 10^-6 x 2^50, rounded */
    drive->duty_target = pm_clamp(to_signal(command->duty_ppm, millionth), -PM_ONE, PM_ONE);
#endif
}

void reference_reset(drive_t *drive, pm_q_t i_q)
{
    speed_control_reset(&drive->speed, drive->position.pll.omega, i_q);
    drive->position.speed.ready = false;
    drive->field_weakening.i_d = 0;
    drive->i_open = 0;
    drive->i_ref = (pm_dq_t){.d = 0, .q = i_q};
}

/* T = psi_a i_q in per-unit, psi_a = psi_m + (L_d - L_q) i_d with the present reference. */
static pm_q_t current_for(const drive_t *drive, pm_q_t torque)
{
    const drive_config_t *c = &drive->config;
    const pm_q_t psi = pm_max(c->machine.psi_m + pm_mul(c->machine.L_d - c->machine.L_q, drive->i_ref.d),
                              c->machine.psi_m / 4);
    const pm_q_t i = pm_div(pm_abs(torque), psi);
    return torque < 0 ? -i : i;
}

static pm_q_t flux_current(drive_t *drive, pm_q_t i_q)
{
    const drive_config_t *c = &drive->config;
    const pm_q_t v_top = pm_unit(drive->status.v_dc, c->v_share);
    const field_weakening_in_t in = {
        .v = {.d = pm_narrow(drive->voltage.v.d), .q = pm_narrow(drive->voltage.v.q)},
        .v_top = v_top - v_top / 20,
        .omega = drive->position.pll.omega,
        .R_s = c->machine.R_s,
        .L_d = c->machine.L_d,
    };
    const pm_q_t weak = field_weakening_step(&drive->field_weakening, &c->field_weakening, &in);
    const pm_q_t light = pm_mul(c->i_d_light, drive->position.weight);
    const pm_q_t i_d = light < 0 ? -light : pm_min(mtpa_i_d(&c->mtpa, i_q), -light);
    return pm_max(i_d + weak, -c->i_max);
}

static pm_q_t measured_speed(drive_t *drive)
{
    const pm_pll_t *p = &drive->position.pll;
    const speed_in_t in = {.theta = p->theta, .omega = p->omega, .i = drive->status.i};
    return speed_step(&drive->position.speed, &drive->config.position.speed, &in);
}

void reference_range(drive_t *drive, pm_q_t most, pm_q_t *i_min, pm_q_t *i_max)
{
    protection_current_limits(drive, i_min, i_max);
    *i_min = pm_max(*i_min, -most);
    *i_max = pm_min(*i_max, most);
}

pm_q_t reference_torque(drive_t *drive, pm_q_t omega, pm_q_t i_min, pm_q_t i_max)
{
    const drive_config_t *c = &drive->config;
    const bool stopping = drive->state == DRIVE_STOPPING;
    bool limited = false;
    pm_q_t i_q;
    if (drive->command.mode == DRIVE_MODE_TORQUE && !stopping) {
        const pm_q_t wanted = current_for(drive, drive->torque_target);
        const pm_q_t allowed = pm_clamp(wanted, i_min, i_max);
        limited = allowed != wanted;
        i_q = speed_control_below(&drive->speed, &c->speed, c->omega_max, omega, allowed);
        drive->status.limits |= i_q != allowed ? DRIVE_LIMIT_SPEED : 0U;
    } else {
        const pm_q_t wanted = stopping ? 0 : drive->omega_target;
        const pm_q_t target = pm_clamp(wanted, -c->omega_max, c->omega_max);
        drive->status.limits |= target != wanted ? DRIVE_LIMIT_SPEED : 0U;
        i_q = speed_control_step(&drive->speed, &c->speed, target, omega, i_min, i_max, &limited);
        if ((drive->status.limits & (uint32_t)DRIVE_LIMIT_VOLTAGE) != 0U) {
            speed_control_follow(&drive->speed, &c->speed, i_q, drive->status.i.q);
        }
    }
    drive->status.limits |= limited ? DRIVE_LIMIT_CURRENT : 0U;
    return i_q;
}

void reference_vector(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const pm_q_t share = pm_mul(drive->i_ref.d, drive->i_ref.d);
    pm_q_t i_min;
    pm_q_t i_max;
    const pm_q_t most = pm_sqrt(pm_mul(c->i_max, c->i_max) - share);
    reference_range(drive, drive->position.inject ? pm_min(most, c->i_injection) : most, &i_min, &i_max);
    const pm_q_t i_q = reference_torque(drive, measured_speed(drive), i_min, i_max);
    /* at once it would disturb an observer in proportion to the errors of R and L */
    drive->i_open -= drive->i_open / 16;
    drive->i_ref = (pm_dq_t){.d = flux_current(drive, i_q) + drive->i_open, .q = i_q};
    const pm_q_t injected = position_injected(&drive->position);
    if (c->position.mismatch.id == (uint8_t)MISMATCH_D_AXIS) {
        drive->i_ref.d += injected;
    } else if (!mismatch_is_apart(&drive->position.window, &c->position.mismatch)) {
        drive->i_ref.q = pm_clamp(i_q + injected, i_min, i_max);
    } else {
        /* two_sets.h has it */
    }
}
