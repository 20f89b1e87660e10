/* Identification: the drive measures its machine (docs/identify.md). Types; the parts are in the files
 * beside.
 *
 * Wanted beforehand: bases, timing, pole pairs and a current that the machine bears; nothing else of the
 * machine. One sequence, of which each routine takes what it needs and the rest is left out: sweep voltage
 * rises until the current flows; the vector turns the rotor onto phase A resistance four currents, regulated
 * slowly by the voltage: slope R, intercept 4/3 of a leg's lost voltage L_d, L_q   square wave of +-V along
 * each axis without mean: change of flux over change of current rotation   the current vector turns and takes
 * the rotor along: up, two currents at speed, down L_q rated  square wave on q at rated current and the i_d
 * of most torque per ampere: saturation, cross-coupling The bridge is opened at the end, by a failure, a
 * fault, or within a period of the enable's end.
 *
 * drive_step() and drive_slow() call these in STAGE_IDENTIFY; cost below that of injection. Tests:
 * tests/unit/drive/commissioning_test.cpp, tests/scenario/identify*.yaml. */
#ifndef DRIVE_COMMISSIONING_COMMISSIONING_H
#define DRIVE_COMMISSIONING_COMMISSIONING_H

#include "firmware/math/frames.h"
#include "firmware/math/pi.h"

/* What to identify: a sum; 0 is all. The offsets of the current sensors are measured at each start. */
enum {
    COMMISSIONING_RESISTANCE = 1,
    COMMISSIONING_INDUCTANCE = 2,
    COMMISSIONING_FLUX = 4,
    COMMISSIONING_MECHANICS = 8,
    COMMISSIONING_ALL = 15,
};

typedef enum {
    COMMISSIONING_IDLE,
    COMMISSIONING_RUNNING,
    COMMISSIONING_DONE,
    COMMISSIONING_FAILED,
} commissioning_state_t;

typedef enum {
    COMMISSIONING_NO_REASON,
    COMMISSIONING_NO_CURRENT,  /* the current does not come with the highest voltage: a phase is open */
    COMMISSIONING_UNEVEN,      /* the phases do not share the current as they must: a phase is open */
    COMMISSIONING_IMPLAUSIBLE, /* a result that no machine has */
    COMMISSIONING_NOT_TURNING, /* the rotor did not follow the vector: locked, or the current is too small */
    COMMISSIONING_ABORTED,     /* enable was taken away, or a fault came */
} commissioning_reason_t;

/* Per-unit of the drive's bases; 0: not measured yet. */
typedef struct {
    pm_q_t R;          /* v / i */
    pm_q_t lost;       /* v; of a leg, by dead time and drops */
    pm_q_t L_d, L_q;   /* psi / i; at zero current */
    pm_q_t L_q_rated;  /* psi_q / i_q at the test current */
    pm_q_t L_dq_rated; /* incremental cross inductance there */
    pm_q_t psi_m;      /* psi */
    pm_q_t J;          /* torque per COMMISSIONING_J_STEPS times omega mechanical in one slow step */
    pm_q_t viscous;    /* torque per omega mechanical */
    pm_q_t coulomb;    /* torque */
} commissioning_result_t;

#define COMMISSIONING_J_STEPS 1024

/* Incremental L_q at sixteenths of the square of the test current, 16: at all of it; an estimate. psi / i
 * falls with the square of the current, L_q + (L_q_rated - L_q) (i / i_rated)^2, its tangent three times as
 * much; but saturation is steeper than that, and psi / i was measured with the i_d that lessens it: four
 * times. */
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

/* At work; shares its place with the estimators of the position. */
typedef struct {
    int64_t sum[5];
    int32_t taken;
    pm_ab_t v;       /* what the bridge is to give next */
    int32_t rest[3]; /* of the timer's counts, 128ths */
    pm_pi_config_t pi;
    pm_q_t R, lost, L_d, L_q; /* per-unit, as far as they are known */
    uint16_t ms;              /* in this phase */
    uint8_t phase, part, kind;
    union {
        square_t square;
        struct {
            pm_q_t U;
            pm_q_t R_hat;                  /* voltage over current, with what is lost */
            pm_q_t slope_v, slope_i, v, i; /* over the levels: weighted with 3, 1, -1, -3, and plain */
        } resistance;
        struct {
            pm_q_t omega, omega_ref; /* at the top, and now, without what damps the swing */
            pm_q_t u_d;              /* mean of a quarter of a second */
            int32_t count;           /* of the torques in the sum */
            pm_q_t psi_full;         /* magnet flux, measured at full current */
            pm_q_t tau_up, tau_even; /* u_d / omega while speeding up, at speed */
        } rotation;
    } of;
} commissioning_t;

typedef struct {
    commissioning_result_t result;
    uint8_t routines, state, reason, progress; /* progress in % */
} commissioning_report_t;

#endif
