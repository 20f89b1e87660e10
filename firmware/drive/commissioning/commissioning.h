/* Identification: the drive measures its machine (docs/identify.md). Types; the routines are in the files
 * beside this one.
 *
 * Needed beforehand: bases, timing, pole pairs and a current that the machine withstands; no other parameter
 * of the machine. One sequence; steps that the selected routines do not need are left out:
 *   sweep       voltage rises until the current flows; the vector turns the rotor onto phase A
 *   resistance  four currents, controlled slowly through the voltage:
 *               slope R, intercept 4/3 of the voltage lost in a leg; curvature: the capacitance of a leg
 *   rest        where no resistance is measured, a second of the sweep's voltage: the rotor stops swinging
 *   L_d, L_q    square wave of +-V along each axis, without mean: change of flux over change of current
 *   rotation    the current vector turns and pulls the rotor along: up, two currents at speed, down
 *   L_q rated   square wave on q at rated current with the i_d of most torque per ampere:
 *               saturation, cross-coupling
 * The bridge opens at the end, on a failure, on a fault, and within a period after enable is withdrawn.
 *
 * A procedure that owns the bridge (procedures/procedure.h); a period costs less than one with injection.
 * Tests: tests/unit/drive/commissioning_test.cpp, tests/scenario/identify*.yaml. */
#ifndef DRIVE_COMMISSIONING_COMMISSIONING_H
#define DRIVE_COMMISSIONING_COMMISSIONING_H

#include "firmware/math/frames.h"
#include "firmware/math/pi.h"

/* What to identify: a sum of these; 0 means all. The offsets of the current sensors are measured at each
 * start. */
enum {
    COMMISSIONING_RESISTANCE = 1,
    COMMISSIONING_INDUCTANCE = 2,
    COMMISSIONING_FLUX = 4,
    COMMISSIONING_MECHANICS = 8,
    COMMISSIONING_ALL = 15,
    COMMISSIONING_SALIENCY = 16, /* alone, with the rotor locked: procedures/saliency_map.h */
    COMMISSIONING_NEUTRAL = 32,  /* alone, with the rotor free: procedures/zero_inductance.h */
};

typedef enum {
    COMMISSIONING_IDLE,
    COMMISSIONING_RUNNING,
    COMMISSIONING_DONE,
    COMMISSIONING_FAILED,
} commissioning_state_t;

typedef enum {
    COMMISSIONING_NO_REASON,
    COMMISSIONING_NO_CURRENT,  /* no current even at the highest voltage: a phase is open */
    COMMISSIONING_UNEVEN,      /* the current does not divide among the phases as it must: a phase is open */
    COMMISSIONING_IMPLAUSIBLE, /* a result that no machine has */
    COMMISSIONING_NOT_TURNING, /* the rotor did not follow the vector: locked, or the current is too small */
    COMMISSIONING_ABORTED,     /* enable was withdrawn, or a fault occurred */
    COMMISSIONING_ROUND,       /* no saliency, so no axis; nothing at the neutral */
    COMMISSIONING_TURNED,      /* the rotor must be locked for this */
} commissioning_reason_t;

/* Per-unit of the drive's bases; 0: not measured yet. */
typedef struct {
    pm_q_t R;         /* v / i */
    pm_q_t lost;      /* v; voltage lost in a leg by dead time and device drops */
    pm_q_t move;      /* i; current that moves a leg's capacitance within the dead time, I_1 of modulator.h */
    pm_q_t L_d, L_q;  /* psi / i; at zero current */
    pm_q_t L_q_rated; /* psi_q / i_q at the test current */
    pm_q_t L_dq_rated; /* incremental cross inductance there */
    pm_q_t psi_m;      /* psi */
    pm_q_t J;          /* torque that changes omega mechanical by 1 / COMMISSIONING_J_STEPS in a slow step */
    pm_q_t viscous;    /* torque per omega mechanical */
    pm_q_t coulomb;    /* torque */
} commissioning_result_t;

#define COMMISSIONING_J_STEPS 1024

/* Of a current that is held beside a carrier. */
typedef struct {
    pm_ab_t v;
    pm_ab_t integral; /* of it */
    uint16_t still;   /* ms in which the current was within 1/32 of that of the test */
} commissioning_hold_t;

/* Incremental L_q at of_16/16 of the square of the test current; an estimate:
 *   psi / i   = L_q + (L_q_rated - L_q) (i / i_rated)^2
 *   tangent   = L_q + 3 (L_q_rated - L_q) (i / i_rated)^2      by this formula
 * Real saturation is steeper, and psi / i was measured with an i_d that weakens it: 4 in place of 3. */
static inline pm_q_t commissioning_tangent(const commissioning_result_t *r, int32_t of_16)
{
    return r->L_q + (r->L_q_rated - r->L_q) / 4 * of_16;
}

typedef struct {
    uint16_t half;   /* periods of half a wave */
    uint16_t count;  /* periods of the present one that have gone */
    uint16_t cycles; /* whole waves since the amplitude was found */
    uint8_t settled; /* so many of them before the first that counts, */
    uint8_t enough;  /* and when the last has been */
    uint8_t state;   /* SQUARE_... */
    bool on_q, up, leading;
    pm_q_t voltage;
    pm_q_t wanted;   /* amplitude of the current */
    pm_q_t top, low; /* of the present wave, either direction */
    pm_q_t far;      /* near the amplitude: what lies beyond shows the other axis */
    pm_q_t bias;  /* i_d meanwhile: positive while the amplitude is sought, negative while it is measured */
    pm_ab_t last; /* currents of the last period, */
    pm_abc_t i_last;  /* and the legs' */
    int32_t negative; /* sum of the edges at which a current was negative, as the axis sees them */
    pm_q_t third;     /* of the lost voltage */
} square_t;

/* At work. */
typedef struct {
    int64_t sum[5];
    int32_t samples; /* in the sums */
    pm_ab_t v;       /* what the bridge is to give next */
    pm_ab_t v_past;  /* what acted over the last period */
    int32_t rest[3]; /* of the timer's counts, 128ths */
    pm_pi_config_t pi;
    pm_pi_t axis_d, axis_q;   /* current control along the vector and across it */
    pm_q_t R, lost, L_d, L_q; /* per-unit, as far as they are known */
    uint16_t ms;              /* in this phase */
    uint8_t phase, part, kind;
    union {
        square_t square;
        struct {
            pm_q_t U;
            pm_q_t R_hat;                  /* voltage over current, with what is lost */
            pm_q_t slope_v, slope_i, v, i; /* over the levels: weighted with 3, 1, -1, -3, and plain */
            pm_q_t bend_v, bend_i;         /* with 1, -1, -1, 1 */
        } resistance;
        struct {
            pm_q_t omega, omega_ref; /* at the top, and now, without what damps the swing */
            pm_q_t u_d;              /* mean of a quarter of a second */
            int32_t count;           /* of the torques in the sum */
            pm_q_t psi_full;         /* magnet flux, measured at full current */
            pm_q_t tau_up, tau_even; /* u_d / omega while speeding up, at speed */
        } rotation;
    } of;
} identify_t;

typedef struct {
    commissioning_result_t result;
    uint8_t routines, state, reason, progress; /* progress in % */
} commissioning_report_t;

#endif
