#include "tools/pmsim/rig_sample.h"

#include <math.h>

#include "tools/pmsim/record_layout.h"

_Static_assert((int)RIG_OFF == (int)DRIVE_OFF && (int)RIG_CALIBRATING == (int)DRIVE_CALIBRATING &&
                   (int)RIG_FINDING == (int)DRIVE_FINDING && (int)RIG_RUNNING == (int)DRIVE_RUNNING &&
                   (int)RIG_STOPPING == (int)DRIVE_STOPPING && (int)RIG_FAULT == (int)DRIVE_FAULT,
               "states");
_Static_assert((int)RIG_SPEED == (int)DRIVE_MODE_SPEED && (int)RIG_TORQUE == (int)DRIVE_MODE_TORQUE &&
                   (int)RIG_CURRENT == (int)DRIVE_MODE_CURRENT &&
                   (int)RIG_IDENTIFY == (int)DRIVE_MODE_IDENTIFY,
               "modes");

static const double two_pi = 6.283185307179586;

rig_scale_t rig_scale(const drive_base_t *base, int32_t pole_pairs)
{
    return (rig_scale_t){
        .v_V = ldexp((double)base->v.m, base->v.e - PM_Q_BITS),
        .i_A = ldexp((double)base->i.m, base->i.e - PM_Q_BITS),
        .omega_mech = ldexp((double)base->omega.m, base->omega.e - PM_Q_BITS) / pole_pairs,
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
    return (drive_command_t){
        .enable = command->enable,
        .mode = (drive_mode_t)command->mode,
        .speed_mrad_s = rig_whole(1e3 * command->speed_rad_s),
        .torque_uNm = rig_whole(1e6 * command->torque_Nm),
        .current_mA = rig_whole(1e3 * command->current_A),
    };
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

static rig_identified_t identified(const commissioning_report_t *report)
{
    const commissioning_result_t *r = &report->result;
    return (rig_identified_t){
        .state = report->state,
        .reason = report->reason,
        .R_s_ohm = 1e-6 * r->R_s_uohm,
        .lost_V = 1e-3 * r->lost_mV,
        .L_d_H = 1e-9 * r->L_d_nH,
        .L_q_H = 1e-9 * r->L_q_nH,
        .L_q_rated_H = 1e-9 * r->L_q_rated_nH,
        .L_dq_rated_H = 1e-9 * r->L_dq_rated_nH,
        .psi_m_Wb = 1e-9 * r->psi_m_nWb,
        .J_kgm2 = 1e-9 * r->J_nkgm2,
        .viscous_Nms = 1e-9 * r->viscous_nNms,
        .coulomb_Nm = 1e-6 * r->coulomb_uNm,
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
    sample->v_alpha_V = scale->v_V * status->v.alpha;
    sample->v_beta_V = scale->v_V * status->v.beta;
    sample->v_dc_hat_V = scale->v_V * status->v_dc;
    sample->weight = (double)status->weight / PM_ONE;
    sample->quality = (double)status->quality / PM_ONE;
    sample->driven = out->driven[0] || out->driven[1] || out->driven[2];
    sample->identified = identified(&drive->commissioning_report);
}

void rig_record_legs(const drive_in_t *in, const drive_out_t *out, record_period_t *record)
{
    record->v_dc = in->v_dc;
    record->hw_fault = in->hw_fault;
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        record->i_leg[leg] = in->i_leg[leg];
        record->compare[leg][0] = out->compare[leg][0];
        record->compare[leg][1] = out->compare[leg][1];
        record->driven[leg] = out->driven[leg];
    }
}

void rig_layout(uint32_t layout[RECORD_LAYOUT])
{
    record_layout(layout);
}
