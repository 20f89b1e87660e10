/* The bridge during identification: voltages without dead-time compensation, whose mean is exact. */
#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/math/compiler.h"
#include "firmware/math/num.h"
#include "firmware/math/pair.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

/* Timer counts are carried in 128ths: the fraction that one period cannot output is added to the next. */
#define PART 128U

void commissioning_clear_sums(identify_t *self)
{
    for (uint32_t n = 0; n < sizeof self->sum / sizeof self->sum[0]; n++) {
        self->sum[n] = 0;
    }
    self->samples = 0;
}

pm_q_t commissioning_mean(const identify_t *self, uint32_t n)
{
    return (pm_q_t)pm_quotient(self->sum[n], self->samples);
}

void commissioning_start_current(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    self->axis_d.integral = pm_widen(self->v.alpha);
    self->axis_q.integral = pm_widen(self->v.beta);
    drive->i_ref = (pm_dq_t){0, 0};
    drive->omega_open = 0;
    self->kind = KIND_CURRENT;
}

/* A bandwidth of f_pwm / 21: kp = 0.3 L / T_s, ki = 0.3 R. */
void commissioning_set_gains(drive_t *drive)
{
    const identify_t *self = &drive->procedure.identify;
    const pm_q_t per_period = pm_div(self->L_d, 4 * commissioning_period(drive)); /* of L / T_s, a quarter */
    const pm_gain_t kp = pm_mul_sat(per_period, PM_Q(0.3));
    const pm_gain_t ki = pm_mul(self->R, PM_Q(0.3)) / 4;
    const pm_q_t ratio = pm_sat(pm_div(ki, kp), PM_Q_BITS - 1);
    drive->procedure.identify.pi = (pm_pi_config_t){.kp = kp, .ki = ki, .kb = pm_shl(ratio, 31 - PM_Q_BITS)};
}

/* A share of the period in Q20; the fraction of a count left over goes into the next period. */
static inline void write_leg(int32_t share, int32_t parts, int32_t *rest, uint16_t *compare)
{
    const pm_unit_t within = pm_share_to_unit(share);
    const uint32_t wanted = (uint32_t)pm_mulh_add(*rest, within, parts);
    *rest = (int32_t)(wanted % PART);
    pm_write_leg(compare, (int32_t)(wanted / PART));
}

/* rest: of the counts, one for each leg. */
void commissioning_write_legs(drive_t *drive, int32_t rest[3], pm_abc_t u, drive_out_t *out)
{
    const int32_t per_volt = pm_per_volt(drive->status.v_dc);
    const int32_t parts = pm_shl(drive->config.modulator.counts, 39 - 31); /* PART, and a share in Q31 */
    write_leg(pm_mulh_add(PM_SHARE_HALF, u.a, per_volt), parts, &rest[0], out->compare[0]);
    write_leg(pm_mulh_add(PM_SHARE_HALF, u.b, per_volt), parts, &rest[1], out->compare[1]);
    write_leg(pm_mulh_add(PM_SHARE_HALF, u.c, per_volt), parts, &rest[2], out->compare[2]);
    out->legs = PM_LEGS_PWM;
    out->trip = 0;
}

static inline pm_wide_t axis_voltage(const drive_t *drive, pm_pi_t *pi, pm_q_t error)
{
    const pm_pi_config_t *c = &drive->procedure.identify.pi;
    const pm_wide_t top = pm_gain(drive->status.v_dc, PM_GAIN(0.4));
    const pm_wide_t u = pm_pi_output(pi, c, error, 0);
    const pm_wide_t limited = pm_clamp(u, -top, top);
    pm_pi_update(pi, c, error, limited - u);
    return limited;
}

/* Voltage that the legs will lose at the wanted current: linear below an eighth of it. */
static inline pm_abc_t regain(pm_abc_t u, pm_half_dir_t dir, pm_q_t lost)
{
    const pm_abc_t i = pm_clarke_inverse((pm_ab_t){.alpha = dir.cos, .beta = dir.sin}); /* Q30 */
    const int32_t height = pm_shl(pm_sat(lost, 26), 5);
    return (pm_abc_t){
        .a = pm_mulh_add(u.a, pm_sat(i.a, 27), height),
        .b = pm_mulh_add(u.b, pm_sat(i.b, 27), height),
        .c = pm_mulh_add(u.c, pm_sat(i.c, 27), height),
    };
}

/* The vector turns further; its voltage acts one and a half periods later. While it stands, q has no voltage:
 * the EMF of a swinging rotor drives a current through the winding's own resistance, which damps it. */
static inline pm_abc_t turn(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    const int32_t step = drive->turn_open;
    drive->theta_open += (pm_angle_t)step;
    const pm_dir_t dir = pm_dir(drive->theta_open);
    const pm_dq_t i = pm_park(drive->i_ab, dir);
    pm_dq_t u = {.d = pm_narrow(axis_voltage(drive, &self->axis_d, drive->i_ref.d - i.d)), .q = 0};
    if (step != 0) {
        u.q = pm_narrow(axis_voltage(drive, &self->axis_q, -i.q));
    } else {
        self->axis_q.integral = 0;
    }
    drive->status.i = i;
    drive->voltage.v = u;
    self->sum[0] += u.d;
    self->sum[1] += u.q;
    self->sum[2] += i.d;
    self->sum[3] += i.q;
    self->samples++;
    const pm_half_dir_t ahead = pm_dir_sum(dir, drive->ahead);
    const pm_ab_t v = pm_park_inverse_quarter((pm_dq_t){.d = pm_shl(u.d, 2), .q = pm_shl(u.q, 2)}, ahead);
    self->v = v;
    return regain(pm_clarke_inverse(v), ahead, self->lost);
}

static void hold_voltage(drive_t *drive)
{
    identify_t *self = &drive->procedure.identify;
    self->sum[0] += drive->i_ab.alpha;
    self->sum[1] += drive->i_ab.beta;
    self->sum[2] += drive->v_acting.alpha;
    self->samples++;
    drive->status.i = (pm_dq_t){.d = drive->i_ab.alpha, .q = drive->i_ab.beta};
}

/* The voltage of the wave, and that of the d-axis during a wave on q. */
static void wave(drive_t *drive, pm_ab_t v_past)
{
    identify_t *self = &drive->procedure.identify;
    square_step(drive, v_past);
    const pm_q_t bias = self->of.square.bias;
    if (bias != 0) {
        self->v.alpha = pm_narrow(axis_voltage(drive, &self->axis_d, bias - drive->i_ab.alpha));
    }
}

PM_APART pm_procedure_t procedure_identify_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    (void)in;
    identify_t *self = &drive->procedure.identify;
    const pm_ab_t v_past = pm_pair_ab(&self->v_past);
    self->v_past = drive->v_acting;
    pm_abc_t u;
    if (self->kind == (uint8_t)KIND_CURRENT) {
        u = turn(drive);
    } else {
        if (self->kind == (uint8_t)KIND_SQUARE) {
            wave(drive, v_past);
        } else {
            hold_voltage(drive);
        }
        u = pm_clarke_inverse(self->v);
    }
    drive->status.theta = drive->theta_open;
    drive->v_next = self->v;
    commissioning_write_legs(drive, self->rest, u, out);
    return PM_RUNNING; /* its slow part knows the end */
}
