/* Interface between the parts of the drive; not for users of drive.h. */
#ifndef DRIVE_DRIVE_PARTS_H
#define DRIVE_DRIVE_PARTS_H

#include "firmware/drive/drive_state.h"
#include "firmware/math/pair.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a method asked for is asked for in that period alone. */
static inline void drive_clear_instants(drive_out_t *out)
{
    (void)out;
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    for (uint32_t n = 0; n < PM_SAMPLES; n++) {
        out->instants.sample_at[n] = 0;
    }
#endif
#if PM_CARRIES(NEEDS_COMMUTATE)
    out->instants.commutate_at = 0;
    out->instants.then = 0;
#endif
}

static inline void drive_write_out(const modulator_out_t *m, drive_out_t *out)
{
    pm_write_leg(out->compare[0], m->on[0]);
    pm_write_leg(out->compare[1], m->on[1]);
    pm_write_leg(out->compare[2], m->on[2]);
    out->legs = PM_LEGS_PWM;
    out->trip = 0;
    drive_clear_instants(out);
}

/* Each period while the bridge is driven: currents and DC link within their limits. */
static inline bool protection_currents_passed(const drive_t *drive, int32_t top)
{
    const pm_abc_t i = drive->i_abc;
    const int32_t a = pm_mulh_sub(top, i.a, i.a);
    const int32_t b = pm_mulh_sub(top, i.b, i.b);
    const int32_t c = pm_mulh_sub(top, i.c, i.c);
#if PM_HAS(two_sets)
    const pm_abc_t j = drive->two_sets.i; /* none with one set */
    if (pm_mulh_sub(top, j.a, j.a) < 0 || pm_mulh_sub(top, j.b, j.b) < 0 || pm_mulh_sub(top, j.c, j.c) < 0) {
        return false;
    }
#endif
    return a >= 0 && b >= 0 && c >= 0;
}

static inline bool protection_passed(const drive_t *drive, int32_t top)
{
    const protection_config_t *c = &drive->config.protection;
    const pm_pair_t v_dc = pm_pair(&c->v_dc_min, &c->v_dc_span);
    const uint32_t above = (uint32_t)drive->status.v_dc - (uint32_t)v_dc.first;
    return above <= (uint32_t)v_dc.second && protection_currents_passed(drive, top);
}

/* The smallest link voltage that is divided by; below v_dc_min, which is more, the bridge is off. */
#define DRIVE_V_DC_LEAST PM_Q(1.0 / 16)

/* Injection leads at low speed: as configured, unless the start has found the machine round. */
static inline bool drive_injects(const drive_t *drive)
{
    return drive->config.injection && !drive->round;
}

/* Block commutation is at work. */
static inline bool drive_commutates(const drive_t *drive)
{
    return PM_HAS(six_step) != 0 && drive->stage == STAGE_SIX_STEP;
}

/* drive.c: at 1 kHz, what the step needs of the present operating point and stage. */
void drive_prepare(drive_t *drive);

/* drive_slow.c */

void drive_switch_off(drive_t *drive);
/* Current and voltage stay as they are; both have other coordinates in the frame that has been turned. */
void drive_turn_frame(drive_t *drive, pm_angle_t turn, pm_dq_t v);
/* The vector goes on with a rotor whose angle and speed are known, and with i_q. */
void drive_take_over(drive_t *drive, const pm_pll_t *known, pm_q_t i_q);

/* start.c: the sequence of procedures that finds the rotor, at 1 kHz. */

void start_begin(drive_t *drive);
void start_slow(drive_t *drive);
void start_step(
    drive_t *drive); /* begins the next procedure; from drive_slow() itself: the deepest stack of all */
void start_again(drive_t *drive); /* behind the calibration, which looks for a rotor that turns first */
/* The rotor stands at theta, and injection takes over. */
void start_injection(drive_t *drive, pm_angle_t theta);
/* A step that this start or this board does without. */
bool start_passes_over(const drive_t *drive, uint8_t procedure);

/* protection.c */

void protection_step(drive_t *drive);   /* names the fault of a period that has not passed */
void protection_slow(drive_t *drive);   /* 1 kHz: temperature, speed, position, stall, sum */
void protection_heat(drive_t *drive);   /* 1 kHz, in every state: what windings and bridge bear */
void protection_link(drive_t *drive);   /* 1 kHz, in every state: where the DC link will be in 2 ms */
void protection_phases(drive_t *drive); /* 1 kHz, while the references are those of the currents */

drive_fault_t protection_fault_of_lost(const drive_t *drive); /* POSITION_LOST, or what it was lost for */
bool protection_cause_present(const drive_t *drive); /* of the faults that show with the bridge off */

/* Limits of the q-axis current after derating, for the present direction of rotation. */
void protection_current_limits(drive_t *drive, pm_q_t *i_min, pm_q_t *i_max);

/* fault_short.c */

drive_stage_t fault_short_stage(drive_t *drive, drive_fault_t fault); /* that the fault leads to */
void fault_short_step(drive_t *drive, drive_out_t *out);
void fault_short_slow(drive_t *drive); /* 1 kHz: ends it */

/* reference.c: at 1 kHz, from the command to current references. */
void reference_take(drive_t *drive);   /* command to per-unit */
void reference_vector(drive_t *drive); /* speed or torque -> i_ref */
void reference_range(drive_t *drive, pm_q_t most, pm_q_t *i_min,
                     pm_q_t *i_max); /* of i_q: within +-most and the limits */
pm_q_t reference_torque(drive_t *drive, pm_q_t omega, pm_q_t i_min,
                        pm_q_t i_max); /* speed or torque -> i_q */
void reference_reset(drive_t *drive, pm_q_t i_q);

/* rest.c: at 1 kHz, while the vector is controlled: the carrier goes off and on again. */
void rest_slow(drive_t *drive);

#if PM_HAS(six_step)
/* block.c */

typedef enum {
    BLOCK_RUNS,
    BLOCK_SLOW,    /* below the speed at which the crossings show */
    BLOCK_LOST,    /* the crossings are not where they belong; all legs are off */
    BLOCK_STALLED, /* nor have they been since the start */
} block_result_t;

#define BLOCK_SETTLED_MS 1000U /* after these a loss of synchronism is the first one */

bool block_may_begin(const drive_t *drive); /* in STAGE_VECTOR */
void block_begin(drive_t *drive);
bool block_from_rest(
    drive_t *drive); /* in STAGE_OPEN_LOOP, at rest behind the align; false: not its kind of start */
void block_step(drive_t *drive, const drive_in_t *in, drive_out_t *out);
block_result_t block_slow(drive_t *drive);
drive_fault_t block_fault(const drive_t *drive, drive_fault_t fault); /* or what it was for */
/* In STAGE_SIX_STEP the open leg's current is not measured. */
static inline bool block_hides_open(const drive_t *drive)
{
    const block_t *self = &drive->block;
    return pattern_hides_open(&drive->config.block.six_step.pattern, self->six_step.plan[1].sector,
                              self->i < 0);
}
/* block_current.c */
pm_q_t block_emf(const drive_t *drive); /* between the two legs, of the speed that the crossings say */
void block_prepare(drive_t *drive, pm_q_t i_q); /* the current control, for 1 ms */
void block_report(drive_t *drive, pm_q_t i_q);  /* in the status: what is wanted and what there is */
void block_follow(drive_t *drive);              /* both, by mode, reference and limits */
void block_take_duty(drive_t *drive);           /* mode duty: its speed without a load is what is wanted */
#endif

/* open_loop.c: align, open-loop start, current mode, hand-over to the observer and back. */
void open_loop_start(drive_t *drive);
void open_loop_begin(drive_t *drive);  /* the stage alone: vector and position are what they are */
void open_loop_hold(drive_t *drive);   /* the vector stays, but for a rotor that swings */
void open_loop_rested(drive_t *drive); /* the end of the align: what its voltage says of R */
void open_loop_slow(drive_t *drive);
void open_loop_resume(drive_t *drive);
void open_loop_release(
    drive_t *drive); /* the observer goes its own way from here, from where the rotor is seen */
bool open_loop_ramps(const drive_t *drive); /* the imposed speed is not what is wanted yet */

#ifdef __cplusplus
}
#endif

#endif
