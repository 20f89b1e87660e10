/* The drive's memory. Users of drive.h allocate it and read it only through drive_status(). */
#ifndef DRIVE_DRIVE_STATE_H
#define DRIVE_DRIVE_STATE_H

#include "firmware/drive/block.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/follow.h"
#include "firmware/drive/held.h"
#include "firmware/drive/open_phase.h"
#include "firmware/drive/procedures/procedure.h"
#include "firmware/drive/procedures/sequence.h"

/* What drive_step() does; drive_slow() moves it on. */
typedef enum {
    STAGE_OFF,
    STAGE_SHORT,     /* after a fault: all low switches on (fault_short.h) */
    STAGE_PROCEDURE, /* a procedure has the legs, each by itself */
    STAGE_SIX_STEP,  /* block commutation by the zero crossings (block.h) */
    STAGE_OPEN_LOOP, /* current vector at an imposed angle */
    STAGE_VECTOR,    /* field-oriented control at the estimated angle */
} drive_stage_t;

/* In the order in which a period needs it: one instruction loads or stores two neighbours up to 1,020 bytes from the
 * beginning, and one alone up to 4,095. */
struct drive {
    drive_fault_t fault; /* latched; while it is set, the stage is STAGE_OFF or STAGE_SHORT */
    drive_state_t state;
    drive_stage_t stage;
    uint32_t period;

    pm_q_t zero[DRIVE_LEGS]; /* code of the current channels at zero current, one being full scale */
    modulator_t modulator;   /* begins with what is hidden of the currents */
    pm_abc_t i_abc;
    pm_ab_t i_ab;
#if PM_CARRIES(NEEDS_NEUTRAL)
    neutral_t neutral;
#endif
    PM_IN_IMAGE(open_winding, open_winding_t open_winding;)
    PM_IN_IMAGE(two_sets, two_sets_t two_sets;)
    bool hw_fault;
    bool carrier;      /* injection is on */
    bool forced;       /* open loop: the observer is forced to the ramp angle */
    bool usual;        /* estimated angle and REGULATOR_INLINE: one branch per period for all that is not */
    bool round;        /* the start has found no saliency: without injection until the next one */
    bool tried;        /* open loop: once more, with more current */
    bool rests;        /* the start measured its offsets, while no current flowed */
    pm_dir_t ahead;    /* one and a half periods of rotation: from the sample to where the voltage acts */
    pm_unit_t v_share; /* share of v_dc for current control */
    pm_ab_t v_acting;  /* commanded at k-1: acts over [k, k+1) */
    pm_ab_t v_next;    /* commanded at k: acts over [k+1, k+2) */

    regulator_out_t voltage; /* of the current control, without carrier */
    PM_IF_HELD(held_t held;) /* where it holds the legs */
    regulator_t regulator;
    regulator_config_t regulator_config; /* the configured one, slowed while injection asks for it */
    pm_dq_t i_ref;
    pm_angle_t theta_open; /* open loop: angle of the current vector, */
    pm_q_t omega_open;     /* its speed, which yields to a swinging rotor, */
    int32_t turn_open;     /* and the turn of a period at that speed */

    union {                    /* the stage says which: */
        pm_pll_t pll;          /* always, the first of all: angle and speed, zero below STAGE_SIX_STEP */
        position_t position;   /* from STAGE_OPEN_LOOP on */
        procedure_t procedure; /* in STAGE_PROCEDURE */
        PM_IN_IMAGE(six_step, block_t block;) /* in STAGE_SIX_STEP */
    };

    drive_config_t config; /* begins with what a period needs, too */

    drive_status_t status;
    uint32_t completed; /* the last period with a current that followed from the others */

    /* of 1 kHz */
    speed_control_t speed;
    field_weakening_t field_weakening;
    pm_q_t omega_ramp; /* open loop: speed that is wanted */
    pm_q_t emf_open;   /* mean EMF beside that of the ramp */
    pm_q_t i_vector;   /* open loop: current that is wanted */
    pm_q_t i_open;     /* open loop: its current; after the hand-over: what is left of it on the d-axis */

    /* references in per-unit, made from the command */
    pm_q_t omega_target;
    pm_q_t torque_target;
    pm_q_t i_target;

    pm_q_t v_dc_before, v_dc_ahead; /* a millisecond ago, and in two */
    uint16_t state_ms;              /* since the state or stage was entered */
    uint16_t stall_ms, sum_ms;
    PM_IN_IMAGE(two_sets, uint16_t second_sum_ms;)
    uint16_t lost;     /* eighths of a ms without a position */
    uint16_t still_ms; /* standstill while stopping */
    uint16_t agree_ms; /* observer and imposed angle turn alike */
    uint16_t wait_ms;  /* for that, where the observer should */
    uint16_t rest_ms;  /* until the vector turns once more, or its current has settled */
    follow_t follow;
    PM_IN_IMAGE(six_step, uint16_t block_ms; /* in STAGE_SIX_STEP */
                uint8_t block_tries;         /* to find synchronism again */
                pm_q_t duty_target;          /* -1 ... 1 */
                thresholds_t thresholds;)    /* learnt, from start to start */
    int32_t temperature_dC;
    pm_q_t heat;        /* of the windings: the current's square, through the low-pass of t_winding */
    pm_q_t bridge_heat; /* the same of the bridge, t_bridge */
#if PM_HAS(carrier_rest)
    rest_t rest;
#endif
    open_phase_t open_phase;
    PM_IN_IMAGE(two_sets, open_phase_t second_open_phase;)
    fault_short_t fault_short;

    /* not of a control period */
    drive_command_t command;
    drive_fault_record_t record;
    commissioning_report_t commissioning_report;
    PM_IN_IMAGE(saliency_map, saliency_map_result_t saliency_map;)
    PM_IN_IMAGE(zero_inductance, zero_inductance_result_t zero_inductance;)
    sequence_t sequence;
    procedure_beside_t beside;
};

#endif
