#include "firmware/drive/drive.h"

#include <stddef.h>

#include "firmware/drive/drive_parts.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

/* The modulator's smallest link voltage; below, the bridge is off anyway. */
#define V_DC_LEAST PM_Q(0.0625)

drive_result_t drive_init(drive_t *drive, const drive_params_t *params)
{
    *drive = (drive_t){.state = DRIVE_OFF, .stage = STAGE_OFF};
    const drive_result_t result = drive_configure(&drive->config, params);
    if (!result.ok) {
        drive_trip(drive, DRIVE_FAULT_PARAMETERS);
    }
    return result;
}

static bool same(pm_num_t a, pm_num_t b)
{
    return a.m == b.m && a.e == b.e;
}

bool drive_same_frame(const drive_config_t *a, const drive_config_t *b)
{
    const drive_base_t *x = &a->base;
    const drive_base_t *y = &b->base;
    return same(x->v, y->v) && same(x->i, y->i) && same(x->omega, y->omega) && same(x->t_s, y->t_s) &&
           same(a->pole_pairs, b->pole_pairs) && a->modulator.counts == b->modulator.counts &&
           a->injection == b->injection && a->align_first == b->align_first;
}

void drive_reconfigure(drive_t *drive, const drive_config_t *config)
{
    drive->config = *config;
    if (drive->fault == DRIVE_FAULT_PARAMETERS) {
        drive->fault = DRIVE_FAULT_NONE;
        drive->state = DRIVE_OFF;
        drive->stage = STAGE_OFF;
    }
}

void drive_command(drive_t *drive, const drive_command_t *command)
{
    const drive_mode_t mode = drive->state == DRIVE_OFF ? command->mode : drive->command.mode;
    drive->command = *command;
    drive->command.mode = mode;
}

bool drive_clear_fault(drive_t *drive)
{
    if (drive->fault == DRIVE_FAULT_NONE) {
        return true;
    }
    if (drive->fault == DRIVE_FAULT_PARAMETERS || drive->command.enable || protection_cause_present(drive)) {
        return false;
    }
    drive->fault = DRIVE_FAULT_NONE;
    drive->state = DRIVE_OFF;
    drive->stage = STAGE_OFF;
    return true;
}

const drive_status_t *drive_status(const drive_t *drive)
{
    return &drive->status;
}

const drive_fault_record_t *drive_fault_record(const drive_t *drive)
{
    return &drive->record;
}

static void measure(drive_t *drive, const drive_in_t *in)
{
    const int32_t *offset = drive->calibration.offset;
    /* full scale of a code is one: a shift, no product */
    drive->i_abc = (pm_abc_t){
        .a = pm_shl((int32_t)in->i_leg[0] - offset[0], PM_Q_BITS - 15),
        .b = pm_shl((int32_t)in->i_leg[1] - offset[1], PM_Q_BITS - 15),
        .c = pm_shl((int32_t)in->i_leg[2] - offset[2], PM_Q_BITS - 15),
    };
    drive->i_ab = pm_clarke(drive->i_abc);
    drive->status.v_dc = pm_max(pm_shl((int32_t)in->v_dc, PM_Q_BITS - 16), V_DC_LEAST);
    drive->hw_fault = in->hw_fault;
}

static void calibrate(calibration_t *self, const drive_in_t *in)
{
    if (self->count >= DRIVE_OFFSET_PERIODS) {
        return;
    }
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        self->sum[x] += in->i_leg[x];
    }
    self->count++;
    if (self->count == DRIVE_OFFSET_PERIODS) {
        for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
            self->offset[x] = self->sum[x] / (int32_t)DRIVE_OFFSET_PERIODS;
        }
    }
}

static void pulses(drive_t *drive, drive_out_t *out)
{
    initial_pulses_out_t p = {.driven = false};
    if (drive->pulses_state == PM_RUNNING) {
        drive->pulses_state = initial_pulses_step(&drive->pulses, &drive->config.pulses, drive->i_ab, &p);
    }
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        const int32_t on = pm_mulh(p.duty[x], pm_shl(drive->config.modulator.counts, 32 - PM_Q_BITS));
        out->compare[x][0] = (uint16_t)on;
        out->compare[x][1] = (uint16_t)on;
        out->driven[x] = p.driven;
    }
}

static inline pm_ab_t *voltage_slot(drive_t *drive)
{
    return &drive->v[drive->period & 1U];
}

static void write_out(drive_t *drive, pm_ab_t v, pm_ab_t i, drive_out_t *out)
{
    modulator_out_t m;
    modulator_step(&drive->config.modulator, v, drive->status.v_dc, i, &m);
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        out->compare[x][0] = (uint16_t)m.on[x];
        out->compare[x][1] = (uint16_t)m.on[x];
        out->driven[x] = true;
    }
    *voltage_slot(drive) = m.v;
    drive->limited = m.limited;
}

/* Current control in the frame of `theta` and its voltage one and a half periods later, when it acts. */
static void control(drive_t *drive, pm_angle_t theta, pm_q_t omega, pm_dq_t i, drive_out_t *out)
{
    const drive_config_t *c = &drive->config;
    const bool inject = drive->position.inject && drive->stage == STAGE_VECTOR;
    pm_q_t v_max = pm_unit(drive->status.v_dc, c->v_linear);
    if (inject) { /* a sagging link must not leave nothing to control with */
        v_max = pm_max(v_max - c->position.square.v_h, pm_half(pm_half(v_max)));
    }
    current_control_out_t u;
    current_control_step(&drive->current, &c->current, i, drive->i_ref, omega, v_max, &u);
    drive->u = u.v;
    drive->status.i = i;

    const int32_t turn = pm_omega_to_angle(omega, c->k_theta);
    const pm_dir_t ahead = pm_dir(theta + (pm_angle_t)turn + (pm_angle_t)pm_half(turn));
    if (inject) {
        u.v.d += pulsating_square_output(&drive->position.square, &c->position.square).d;
    }
    write_out(drive, pm_park_inverse(u.v, ahead), pm_park_inverse(i, ahead), out);
    drive->limited |= u.limited;
}

static void vector(drive_t *drive, drive_out_t *out)
{
    const bool imposed = drive->stage == STAGE_OPEN_LOOP;
    pm_pll_t open = {0};
    if (imposed) {
        drive->theta_open += (pm_angle_t)pm_omega_to_angle(drive->omega_open, drive->config.k_theta);
        open = (pm_pll_t){.theta = drive->theta_open, .omega = drive->omega_open};
    }
    /* below this speed the observer would drift on an imposed angle: it is led along */
    const bool led = imposed && pm_abs(open.omega) < drive->config.position.omega_low;
    position_out_t p;
    position_step(&drive->position, &drive->config.position, *voltage_slot(drive), drive->i_ab,
                  led ? &open : NULL, &p);
    if (imposed) {
        p.i = pm_park(drive->i_ab, pm_dir(open.theta));
    } else {
        open = drive->position.pll;
    }
    control(drive, open.theta, open.omega, p.i, out);
}

static void off(drive_out_t *out)
{
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        out->driven[x] = false;
    }
}

void drive_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    drive->period++;
    measure(drive, in);
    protection_step(drive, in);
    out->trip = drive->fault != DRIVE_FAULT_NONE;
    if (!out->trip && drive->stage >= STAGE_OPEN_LOOP) {
        vector(drive, out);
    } else {
        *voltage_slot(drive) = (pm_ab_t){0, 0};
        if (!out->trip && drive->stage == STAGE_PULSES) {
            pulses(drive, out);
        } else {
            off(out);
            if (drive->stage == STAGE_CALIBRATE) {
                calibrate(&drive->calibration, in);
            }
        }
    }
    drive->status.theta = drive->position.pll.theta;
}
