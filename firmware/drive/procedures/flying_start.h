/* A rotor that turns already is caught: its angle and speed from the currents that its EMF drives through windings which
 * are shorted for moments, all low switches on and then all switches off. First in every sequence (sequence.h), before
 * anything else is driven; a rotor at rest is left to what comes then.
 *
 * From zero current, with s = L_q / L_d and tau the length of the pulse:
 *   |i| = |w| psi_m tau / L_q                                   while tau is small against L / R and a turn
 *   angle of i = theta -+ (90 degrees + delta),  tan delta = s tan(|w| c),   - forwards, + backwards
 *   c = tau / 2 / (1 + y/3 - x/6 + 0.04 x y),  x = R tau / L_q,  y = R tau / L_d
 * theta belongs to the end of the pulse. What the devices took is given back: V_drop tau / L_q in each leg; of which what lies along
 * d, once theta is known, is s times as much. Less is given to a leg with a current within four times its noise, whose sign is not
 * sure, or within a tenth of the whole, as it conducted for only a part of the pulse, while the rotor turned.
 *
 * The first pulse is a period long; on boards that have PWM on one switch and different halves of a period, a 64th of one,
 * at its end. A pulse twice or four times as long follows while it cannot carry more than about 40 % of rated current, is not
 * longer than 3.2 ms, and the rotor does not turn by more than 0.2 rad meanwhile: then an error of L_q / L_d costs little. What
 * has no angle yet is not enough.
 * Six of the length that is left, at distances that double, give the speed: each tells how many turns lie before the next.
 *   w = (angle of i_n - angle of i_0) / (t_n - t_0)
 * At rest (PM_FAILED_NOT_TURNING): currents below twenty times their noise or one and a half i_drop, or a turn that noise could
 * make, 0.16 |i| |turn in rad| below 1.5 times the noise of a current. A 12-bit converter of 2.5 times rated current sees 5 to
 * 10 % of rated speed, and less where L is small.
 *
 * Largest current: that of the first pulse, |w| psi_m tau / L_q, or 40 % of rated. All takes at most 15 ms, without the wait for
 * zero current: where the EMF exceeds the link the diodes conduct, and no switch closes until that ends, which the offsets wait
 * for (calibrate.h). A look that no calibration precedes waits itself, for a pause without a current as long as a sixth of a turn
 * at the speed whose EMF is two thirds of v_dc_nominal; faster, the pauses of the diodes are shorter:
 *   pause = (pi / 3) root(3) psi_m / (2/3 v_dc_nominal)
 * No longer may the current of the first pulse take to end, as the second must come within half a turn. Where the EMF is within a
 * few percent of the link it takes longer, and the look begins again.
 * PM_FAILED_TIMEOUT after 65,535 periods. Between pulses the diodes take the current back to zero, and the link takes its
 * energy, 3/4 L i^2. What rings on for longer than four periods is that of the legs' capacitance, v_dc root(C / L_d) at
 * its most, and ends no wait.
 * On boards with PM_BOOTSTRAP the pulses go on until the low switches have been on for what charge.h takes, since the
 * caught rotor must not be shorted for as long.
 * The control interrupt takes at most 324 instructions with it. Tests: tests/unit/drive/flying_start_test.cpp,
 * tests/scenario/flying_start.yaml, flying_start_above_link.yaml, tests/contract/procedure_contract_test.cpp, tests/target/board. */
#ifndef DRIVE_PROCEDURES_FLYING_START_H
#define DRIVE_PROCEDURES_FLYING_START_H

#include "firmware/drive/slip.h"
#include "firmware/math/frames.h"
#include "firmware/math/procedure.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define FLYING_START_PULSES 6
#define FLYING_START_PARTS  32 /* of a period */
#define FLYING_START_LEAST  20 /* times its noise: a current that has an angle, of 3 degrees rms */

typedef struct {
    bool on;
    uint8_t shortest; /* pulse, in parts; those shorter than a period need PWM on one switch */
    uint16_t longest;
    uint16_t span;   /* periods in which the pulses begin and end */
    uint16_t pause;  /* periods, see above; a quarter turn where the EMF is v_dc_nominal */
    uint32_t charge; /* parts for which the low switches must have been on at the end */
    pm_q_t i_zero;   /* currents below count as zero */
    pm_q_t i_rings;  /* the same when the legs have been off for long enough */
    pm_q_t i_enough; /* a pulse that reaches it is not made twice as long */
    pm_q_t noise;    /* of one current */
    pm_q_t decay;    /* R T_s / (64 L_q) */
    pm_q_t drop;     /* V_drop T_s / (64 L_q), a current */
} flying_start_config_t;

typedef struct {
    pm_ab_t i;   /* at its end ... */
    uint16_t at; /* ... in that period */
} flying_start_pulse_t;

/* What is known of the pulses: first nothing. */
typedef struct {
    pm_q_t eighth;      /* of what a device takes of a current */
    pm_unit_t per_sure; /* that over the current from which on it is sure to */
    pm_q_t ratio;       /* L_q / L_d */
    pm_angle_t behind;  /* from a current to d, at the end of its pulse */
    pm_angle_t half;    /* that the rotor has turned since the middle of it */
    uint32_t periods;   /* from the first pulse to the last, */
    int32_t turn;       /* in one of them, */
    pm_angle_t angle;   /* and the current of the last */
    uint8_t calls;      /* of flying_start_find() */
} flying_start_reading_t;

typedef struct {
    flying_start_pulse_t pulse[FLYING_START_PULSES];
    flying_start_reading_t reading;
    uint32_t charged; /* parts for which the low switches were on */
    uint16_t length;  /* parts */
    uint16_t timer;   /* periods so far, */
    uint16_t began;   /* and of those before the first pulse */
    uint16_t since;   /* periods since the last one with the low switches on */
    uint16_t wait;    /* of those, until the next pulse */
    uint16_t left;    /* periods of the present pulse */
    uint16_t quiet;   /* samples of zero current, */
    uint16_t more;    /* and of those before the first pulse, more than a pulse takes */
    uint8_t count;
    bool begun, ended; /* the first pulse, the last */
    pm_angle_t theta;  /* found, at the end of the last pulse */
    pm_q_t omega;
} flying_start_t;

/* One period; *low: parts of the coming one for which all low switches are on. */
pm_procedure_t flying_start_step(flying_start_t *self, const flying_start_config_t *config, pm_abc_t i,
                                 uint16_t period, uint32_t *low);

/* After PM_DONE: theta and omega; k_theta is that of pm_omega_to_angle(). Not for the control interrupt. In three calls, PM_RUNNING
 * after the first two, so that each, and what begins after the last, fits into 1 kHz at 40 kHz; in two where L_q / L_d is within an
 * eighth of 1, as the angle of a fast rotor is known less well with each millisecond. */
pm_procedure_t flying_start_find(flying_start_t *self, const flying_start_config_t *config,
                                 const pm_machine_t *machine, int32_t k_theta);

void make_flying_start(maker_t *m, flying_start_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
