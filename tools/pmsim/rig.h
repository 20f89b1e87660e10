/* The test rig: drive and plant as one thing in SI units, for the runner.
 *
 * Two of them: rig.c, a thin layer over hal/sim, and tools/pmsim_board, the emulated board. The drive's
 * per-unit status is converted to SI with the drive's own bases and paired with the plant's truth of the same
 * sample instant. Called once per control period. */
#ifndef PMSIM_RIG_H
#define PMSIM_RIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/params/types.h"
#include "hal/can_frame.h"
#include "sim_plant/plant.h"
#include "tools/pmsim/record.h"

/* In the order of drive_state_t and drive_mode_t; rig.c checks it. */
enum { RIG_OFF, RIG_CALIBRATING, RIG_FINDING, RIG_RUNNING, RIG_STOPPING, RIG_FAULT, RIG_STATES };
enum {
    RIG_SPEED,
    RIG_TORQUE,
    RIG_DUTY,
    RIG_CURRENT,
    RIG_IDENTIFY,
    RIG_SALIENCY,
    RIG_NEUTRAL,
    RIG_MODES
}; /* the last: identify, its map */

typedef struct {
    bool enable;
    int mode;
    double speed_rad_s; /* mechanical */
    double torque_Nm;
    double current_A;
    double duty; /* of v_dc */
} rig_command_t;

/* Incremental inductances at a point of currents. */
typedef struct {
    double L_dh_H, L_qh_H, L_dqh_H;
} rig_saliency_t;

#define RIG_MAP_SIDE 5

/* What the drive has found out about its machine; 0: nothing yet. */
typedef struct {
    int state, reason; /* COMMISSIONING_... */
    double R_s_ohm, lost_V, move_A;
    double L_d_H, L_q_H, L_q_rated_H, L_qh_rated_H, L_dq_rated_H;
    double psi_m_Wb;
    double J_kgm2, viscous_Nms, coulomb_Nm;
    rig_saliency_t map[RIG_MAP_SIDE][RIG_MAP_SIDE]; /* [i_q][i_d], procedures/saliency_map.h */
    rig_saliency_t half, rated;                     /* with the drive's i_d */
    double map_current_A, circle_centre_A, circle_radius_A;
    double dL_0_H, L_c0_H; /* procedures/zero_inductance.h */
    double star[2];        /* alpha, beta */
    int zero_falls;        /* 2: not known */
} rig_identified_t;

typedef struct {
    plant_truth_t truth;    /* at the sample instant, without the voltages of nodes */
    int state;              /* RIG_... */
    int fault;              /* code, 0: none */
    uint32_t limits;        /* DRIVE_LIMIT_... */
    double theta_hat_e_rad; /* 0 ... 2 pi */
    double angle_error_rad; /* theta - theta_hat, -pi ... pi */
    double omega_hat_mech_rad_s;
    double omega_ref_mech_rad_s;
    double i_d_hat_A, i_q_hat_A;
    double i_d_ref_A, i_q_ref_A;
    double v_alpha_V, v_beta_V; /* the drive's idea of the voltage it applies */
    double v_dc_hat_V;
    double weight, quality;
    bool settles;         /* injection, on the position that the search has found */
    bool dragged;         /* align or open loop: the vector is imposed */
    double margin;        /* of what the start has found, in sigma */
    int refusal;          /* why a procedure of this start has refused, PM_FAILED_...; 0: none has */
    bool driven;          /* any leg, in the output of this period */
    bool asks_identified; /* by the caller: the next one is wanted; it costs as much as all the others */
    rig_identified_t identified;
} rig_sample_t;

typedef struct rig rig_t;

/* NULL and a text in `error` when the plant refuses its data, or the drive does and that is not the point of
 * the run (`refusal_expected`). */
rig_t *rig_create(const plant_config_t *plant, double theta_e_rad, const drive_params_t *params,
                  bool refusal_expected, char *error, size_t error_size);
void rig_destroy(rig_t *rig);

plant_t *rig_plant(rig_t *rig);
void rig_command(rig_t *rig, const rig_command_t *command);
bool rig_clear_fault(rig_t *rig);
bool rig_turn_estimate(rig_t *rig, double theta_e_rad); /* the drive's position; false: out of reach */
void rig_set_temperature(rig_t *rig, double temperature_degC);
void rig_set_hw_fault(rig_t *rig, bool held);
void rig_set_break(rig_t *rig, double i_break_A); /* over-current comparators; 0: none */

/* Frames to and from the drive's node; false: its ring is full, none waits. Its status also becomes known by
 * them. */
bool rig_send(rig_t *rig, const hal_can_frame_t *frame);
bool rig_receive(rig_t *rig, hal_can_frame_t *frame);
void rig_set_can_state(rig_t *rig, hal_can_state_t state);

void rig_step(rig_t *rig, rig_sample_t *sample);
uint32_t rig_slow_divider(const rig_t *rig);

/* What went into and came out of the drive in the last period. */
void rig_layout(uint32_t layout[RECORD_LAYOUT]); /* record_layout.h */
void rig_record(const rig_t *rig, record_period_t *record);

/* Half of a period each, driven by a record: the plant alone, and the drive alone. The latter says whether
 * the drive's output is the recorded one. */
void rig_step_plant(rig_t *rig, const record_period_t *record);
bool rig_step_drive(rig_t *rig, const record_period_t *record);

#endif
