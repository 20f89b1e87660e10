#include "tools/pmsim/rig_sample.h"

#include <math.h>

#include "tools/pmsim/record_layout.h"

_Static_assert((int)RIG_OFF == (int)DRIVE_OFF && (int)RIG_CALIBRATING == (int)DRIVE_CALIBRATING &&
                   (int)RIG_FINDING == (int)DRIVE_FINDING && (int)RIG_RUNNING == (int)DRIVE_RUNNING &&
                   (int)RIG_STOPPING == (int)DRIVE_STOPPING && (int)RIG_FAULT == (int)DRIVE_FAULT,
               "states");
_Static_assert((int)RIG_SPEED == (int)DRIVE_MODE_SPEED && (int)RIG_TORQUE == (int)DRIVE_MODE_TORQUE &&
                   (int)RIG_DUTY == (int)DRIVE_MODE_DUTY && (int)RIG_CURRENT == (int)DRIVE_MODE_CURRENT &&
                   (int)RIG_IDENTIFY == (int)DRIVE_MODE_IDENTIFY,
               "modes");

static const double two_pi = 6.283185307179586;

static double si(pm_num_t base)
{
    return ldexp((double)base.m, base.e);
}

rig_scale_t rig_scale(const drive_base_t *base, int32_t pole_pairs, uint32_t slow_divider)
{
    const double omega_mech = si(base->omega) / pole_pairs;
    const double t_slow_s = slow_divider * si(base->t_s);
    return (rig_scale_t){
        .v_V = si(base->v) / PM_ONE,
        .i_A = si(base->i) / PM_ONE,
        .omega_mech = omega_mech / PM_ONE,
        .psi_Wb = si(base->psi) / PM_ONE,
        .torque_Nm = si(base->torque) / PM_ONE,
        .J_kgm2 = si(base->torque) * COMMISSIONING_J_STEPS * t_slow_s / omega_mech / PM_ONE,
        .fault_seen = UINT32_MAX,
    };
}

int32_t rig_whole(double value)
{
    const double rounded = round(value);
    return rounded >= 2147483647.0 ? INT32_MAX : (rounded <= -2147483648.0 ? INT32_MIN : (int32_t)rounded);
}

drive_command_t rig_drive_command(const rig_command_t *command)
{
    const uint8_t alone[] = {COMMISSIONING_SALIENCY, COMMISSIONING_NEUTRAL}; /* RIG_SALIENCY and the next */
    const bool is_alone = command->mode >= RIG_SALIENCY;
    return (drive_command_t){.enable = command->enable,
                             .mode = is_alone ? DRIVE_MODE_IDENTIFY : (drive_mode_t)command->mode,
                             .routines = is_alone ? alone[command->mode - RIG_SALIENCY] : (uint8_t)0,
                             .speed_mrad_s = rig_whole(1e3 * command->speed_rad_s),
                             .torque_uNm = rig_whole(1e6 * command->torque_Nm),
                             .current_mA = rig_whole(1e3 * command->current_A),
                             PM_IN_IMAGE(six_step, .duty_ppm = rig_whole(1e6 * command->duty))};
}

/* The status is renewed at 1 kHz; the record says at once. */
static drive_fault_t fault_now(rig_scale_t *scale, const drive_t *drive)
{
    const drive_fault_t shown = drive_status(drive)->fault;
    const drive_fault_record_t *record = drive_fault_record(drive);
    if (shown != DRIVE_FAULT_NONE) {
        scale->fault_seen = record->period;
        return shown;
    }
    return record->period != scale->fault_seen ? record->fault : DRIVE_FAULT_NONE;
}

#if PM_HAS(saliency_map)
static rig_saliency_t saliency(double L_H, const saliency_point_t *point)
{
    return (rig_saliency_t){L_H * point->L_d, L_H * point->L_q, L_H * point->L_dq};
}

static void add_map(const rig_scale_t *scale, const saliency_map_result_t *map, rig_identified_t *found)
{
    const double L_H = scale->psi_Wb / scale->i_A / PM_ONE;
    for (int row = 0; row < RIG_MAP_SIDE; ++row) {
        for (int column = 0; column < RIG_MAP_SIDE; ++column) {
            found->map[row][column] = saliency(L_H, &map->point[row][column]);
        }
    }
    found->half = saliency(L_H, &map->half);
    found->rated = saliency(L_H, &map->rated);
    found->map_current_A = scale->i_A * map->i;
    found->circle_centre_A = scale->i_A * map->centre;
    found->circle_radius_A = scale->i_A * map->radius;
}
#endif

#if PM_HAS(zero_inductance)
static void add_neutral(const rig_scale_t *scale, const zero_inductance_result_t *r, rig_identified_t *found)
{
    const double L_H = scale->psi_Wb / scale->i_A / PM_ONE;
    found->dL_0_H = L_H * r->dL_0;
    found->L_c0_H = L_H * r->L_c0;
    found->star[0] = ldexp(r->star.alpha, -PM_Q_BITS);
    found->star[1] = ldexp(r->star.beta, -PM_Q_BITS);
    found->zero_falls = r->margin == 0 ? 2 : r->falls;
}
#endif

static rig_identified_t identified(const rig_scale_t *scale, const commissioning_report_t *report)
{
    const commissioning_result_t *r = &report->result;
    const double R_ohm = scale->v_V / scale->i_A / PM_ONE;
    const double L_H = scale->psi_Wb / scale->i_A / PM_ONE;
    return (rig_identified_t){
        .state = report->state,
        .reason = report->reason,
        .R_s_ohm = R_ohm * r->R,
        .lost_V = scale->v_V * r->lost,
        .move_A = scale->i_A * r->move,
        .L_d_H = L_H * r->L_d,
        .L_q_H = L_H * r->L_q,
        .L_q_rated_H = L_H * r->L_q_rated,
        .L_qh_rated_H = L_H * commissioning_tangent(r, 16),
        .L_dq_rated_H = L_H * r->L_dq_rated,
        .psi_m_Wb = scale->psi_Wb * r->psi_m,
        .J_kgm2 = scale->J_kgm2 * r->J,
        .viscous_Nms = scale->torque_Nm / scale->omega_mech / PM_ONE * r->viscous,
        .coulomb_Nm = scale->torque_Nm * r->coulomb,
    };
}

void rig_fill_sample(rig_scale_t *scale, const drive_t *drive, const drive_out_t *out, rig_sample_t *sample)
{
    const drive_status_t *status = drive_status(drive);
    sample->state = (int)status->state;
    sample->fault = (int)fault_now(scale, drive);
    sample->limits = status->limits;
    sample->theta_hat_e_rad = ldexp((double)status->theta, -32) * two_pi;
    const double error = sample->truth.theta_e_rad - sample->theta_hat_e_rad;
    sample->angle_error_rad = error - two_pi * floor(error / two_pi + 0.5);
    sample->omega_hat_mech_rad_s = scale->omega_mech * status->omega;
    sample->omega_ref_mech_rad_s = scale->omega_mech * status->omega_ref;
    sample->i_d_hat_A = scale->i_A * status->i.d;
    sample->i_q_hat_A = scale->i_A * status->i.q;
    sample->i_d_ref_A = scale->i_A * status->i_ref.d;
    sample->i_q_ref_A = scale->i_A * status->i_ref.q;
    sample->v_alpha_V = scale->v_V * drive->v_next.alpha; /* of every period; the status has that of 1 kHz */
    sample->v_beta_V = scale->v_V * drive->v_next.beta;
    sample->v_dc_hat_V = scale->v_V * status->v_dc;
    sample->weight = (double)status->weight / PM_ONE;
    sample->quality = (double)status->quality / PM_ONE;
    sample->settles = status->state == DRIVE_FINDING && drive->stage == STAGE_VECTOR;
    sample->dragged = drive->stage == STAGE_OPEN_LOOP;
    sample->margin = (double)drive->sequence.margin / PM_SIGMA_ONE;
    sample->refusal = (int)status->refusal.reason;
    sample->driven = out->legs != PM_LEGS_OFF;
    if (sample->asks_identified) {
        sample->identified = identified(scale, &drive->commissioning_report);
        PM_IN_IMAGE(saliency_map, add_map(scale, &drive->saliency_map, &sample->identified);)
        PM_IN_IMAGE(zero_inductance, add_neutral(scale, &drive->zero_inductance, &sample->identified);)
    }
}

void rig_record_legs(const drive_in_t *in, const drive_out_t *out, record_period_t *record)
{
    record->v_dc = in->v_dc;
    record->hw_fault = in->hw_fault;
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        record->i_leg[leg] = in->i_leg[leg];
        record->compare[leg][0] = out->compare[leg][0];
        record->compare[leg][1] = out->compare[leg][1];
        record->driven[leg] = pm_leg(out->legs, (uint32_t)leg) != PM_LEG_OFF;
    }
}

void rig_layout(uint32_t layout[RECORD_LAYOUT])
{
    record_layout(layout);
}
