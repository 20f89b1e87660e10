/* The bridge while the machine is identified: plain voltages without compensation, whose mean is exact. */
#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define V_DC_LEAST PM_Q(0.0625)
/* Timer counts are carried in 128ths: what a period cannot give the next one does. */
#define PART 128

void commissioning_clear_sums(commissioning_t *self)
{
    for (uint32_t n = 0; n < sizeof self->sum / sizeof self->sum[0]; n++) {
        self->sum[n] = 0;
    }
    self->taken = 0;
}

pm_q_t commissioning_mean(const commissioning_t *self, uint32_t n)
{
    return self->taken == 0 ? 0 : (pm_q_t)(self->sum[n] / self->taken);
}

void commissioning_start_current(drive_t *drive)
{
    const pm_dq_t v = {.d = drive->identify.work.v.alpha, .q = drive->identify.work.v.beta};
    current_control_reset(&drive->current, v);
    drive->i_ref = (pm_dq_t){0, 0};
    drive->omega_open = 0;
    drive->identify.work.kind = KIND_CURRENT;
}

/* A bandwidth of f_pwm / 21: kp = 0.3 L / T_s, ki = 0.3 R. */
void commissioning_set_gains(drive_t *drive)
{
    const commissioning_t *self = &drive->identify.work;
    const pm_q_t per_period = pm_div(self->L_d, 4 * commissioning_period(drive)); /* of L / T_s, a quarter */
    const pm_gain_t kp = pm_mul_sat(per_period, PM_Q(0.3));
    const pm_gain_t ki = pm_mul(self->R, PM_Q(0.3)) / 4;
    const pm_q_t ratio = pm_sat(pm_div(ki, kp), PM_Q_BITS - 1);
    drive->identify.work.pi = (pm_pi_config_t){.kp = kp, .ki = ki, .kb = pm_shl(ratio, 31 - PM_Q_BITS)};
}

static void write_legs(drive_t *drive, pm_ab_t v, drive_out_t *out)
{
    commissioning_t *self = &drive->identify.work;
    const modulator_config_t *m = &drive->config.modulator;
    const pm_abc_t u = pm_clarke_inverse(v);
    const pm_q_t leg[DRIVE_LEGS] = {u.a, u.b, u.c};
    const int32_t per_volt = pm_per_volt(pm_max(drive->status.v_dc, V_DC_LEAST));
    const int32_t parts = pm_shl(m->counts, 39 - 31); /* PART, and a share in Q31 */
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        const int32_t share = pm_shl(pm_sat(pm_mulh(leg[x], per_volt), PM_SHARE_BITS), 31 - PM_SHARE_BITS);
        const int32_t wanted = m->counts * (PART / 2) + pm_mulh(share, parts) + self->rest[x];
        const int32_t on = pm_clamp(wanted, 0, m->counts * PART) / PART;
        self->rest[x] = (uint8_t)pm_clamp(wanted - on * PART, 0, PART);
        out->compare[x][0] = (uint16_t)on;
        out->compare[x][1] = (uint16_t)on;
        out->driven[x] = true;
    }
    out->trip = false;
    drive->v_next = v;
}

static int32_t axis_voltage(drive_t *drive, pm_pi_t *pi, pm_q_t error)
{
    const pm_pi_config_t *c = &drive->identify.work.pi;
    const pm_wide_t top = pm_widen(pm_mul(drive->status.v_dc, PM_Q(0.4)));
    const pm_wide_t u = pm_pi_output(pi, c, error, 0);
    const pm_wide_t limited = pm_clamp(u, -top, top);
    pm_pi_update(pi, c, error, limited - u);
    return pm_narrow(limited);
}

/* What the legs will lose, by the current wanted there: linear below an eighth of it. */
static pm_ab_t regained(const drive_t *drive, pm_dir_t dir)
{
    const pm_abc_t i = pm_clarke_inverse((pm_ab_t){.alpha = dir.cos / 8, .beta = dir.sin / 8}); /* Q28 */
    const pm_q_t lost = drive->identify.work.lost;
    const pm_abc_t v = {
        .a = pm_mul(lost, 8 * pm_clamp(i.a, -PM_ONE / 8, PM_ONE / 8)),
        .b = pm_mul(lost, 8 * pm_clamp(i.b, -PM_ONE / 8, PM_ONE / 8)),
        .c = pm_mul(lost, 8 * pm_clamp(i.c, -PM_ONE / 8, PM_ONE / 8)),
    };
    return pm_clarke(v);
}

/* The vector turns on; its voltage acts one and a half periods later. While it stands, q is without voltage:
 * what a swinging rotor induces there drives a current through the winding's own resistance, which damps it.
 */
static void turn(drive_t *drive)
{
    commissioning_t *self = &drive->identify.work;
    const int32_t step = pm_omega_to_angle(drive->omega_open, drive->config.k_theta);
    drive->theta_open += (pm_angle_t)step;
    const pm_dq_t i = pm_park(drive->i_ab, pm_dir(drive->theta_open));
    pm_dq_t u = {.d = axis_voltage(drive, &drive->current.d, drive->i_ref.d - i.d), .q = 0};
    if (step != 0) {
        u.q = axis_voltage(drive, &drive->current.q, -i.q);
    } else {
        drive->current.q.integral = 0;
    }
    const pm_dir_t ahead = pm_dir(drive->theta_open + (pm_angle_t)step + (pm_angle_t)pm_half(step));
    const pm_ab_t v = pm_park_inverse(u, ahead);
    const pm_ab_t more = regained(drive, ahead);
    self->v = (pm_ab_t){.alpha = v.alpha + more.alpha, .beta = v.beta + more.beta};
    drive->status.i = i;
    drive->u = u;
    self->sum[0] += u.d;
    self->sum[1] += u.q;
    self->sum[2] += i.d;
    self->sum[3] += i.q;
    self->taken++;
}

static void hold_voltage(drive_t *drive)
{
    commissioning_t *self = &drive->identify.work;
    self->sum[0] += drive->i_ab.alpha;
    self->sum[1] += drive->i_ab.beta;
    self->sum[2] += drive->v_acting.alpha;
    self->taken++;
    drive->status.i = (pm_dq_t){.d = drive->i_ab.alpha, .q = drive->i_ab.beta};
}

/* For the d-axis voltage beside a square wave on q. */
static void bias(drive_t *drive)
{
    commissioning_t *self = &drive->identify.work;
    const square_t *square = &self->of.square;
    if (square->on_q && square->bias != 0) {
        const pm_q_t wanted = square->state >= (uint8_t)SQUARE_MEASURES ? -square->bias : square->bias;
        self->v.alpha = axis_voltage(drive, &drive->current.d, wanted - drive->i_ab.alpha);
    }
}

void commissioning_step(drive_t *drive, pm_ab_t v_past, drive_out_t *out)
{
    commissioning_t *self = &drive->identify.work;
    switch (self->kind) {
    case KIND_CURRENT:
        turn(drive);
        break;
    case KIND_SQUARE:
        square_step(drive, v_past);
        bias(drive);
        break;
    case KIND_VOLTAGE:
    default:
        hold_voltage(drive);
        break;
    }
    self->i_last = drive->i_abc;
    drive->status.theta = drive->theta_open;
    write_legs(drive, self->v, out);
}
