/* Timer and gate drivers: compare values in, the state of the switches out (METHODS.md 0.2 E6, E9).
 *
 * Centre-aligned carrier, period [0, T): the command of leg X is high from (1 - d0) T/2 to (1 + d1) T/2 with
 *   d = compare / timer_counts               of each half, at most 1
 * Full duty on both sides of a period boundary joins without an edge.
 *
 * A command edge opens the conducting switch turn_off_s later; the other closes dead_time_s + turn_on_s after
 * the edge. An edge before that restarts the dead time, so a pulse shorter than the dead time never reaches
 * its switch, as in a timer with a dead-time generator. A leg that becomes driven also waits. Which legs are
 * driven changes once in a period, by default at its start.
 *
 * A leg of which one switch is chopped alone (plant_leg_state_t) opens both for the rest. That switch closes
 * turn_on_s after its edge, as the other one is off; where the leg's other switch was the last one on, its
 * first closing waits for the dead time too.
 *
 * With bootstrap_charge_s each upper switch lives on a capacitor, empty at first, whose charge q
 *   rises by   dq/dt = (1 - q) / bootstrap_charge_s                    while the lower switch conducts
 *   falls by   dq/dt = -(1 - bootstrap_lockout) / bootstrap_hold_s     else
 * At or below bootstrap_lockout the driver keeps the upper switch open, or opens it, until the next command.
 *
 * A faulty switch keeps its state whatever its gate. Edges closer than 1e-9 T are one event. Times are
 * relative to the start of the period. Tests: gates_test.cpp. */
#ifndef PLANT_GATES_H
#define PLANT_GATES_H

#include "sim_plant/plant.h"

/* which switches of a leg conduct; both only with a short-circuited one */
typedef enum { GATE_OFF, GATE_LOW, GATE_HIGH, GATE_BOTH } gate_t;

typedef struct {
    bool driven, to_drive;
    plant_leg_state_t state, to_state;
    double rise_s, fall_s; /* command edges of this period */
    gate_t command;        /* before dead time */
    gate_t last;           /* the last command that was not off, */
    double clear_s;        /* and when the other switch was off for the dead time */
    gate_t gate;           /* of healthy switches */
    plant_leg_fault_t fault;
    double charge, charge_at_s; /* of the upper switch's capacitor, and when */
    /* What happens next, and when; infinite: it does not. */
    double drive_s; /* `driven` becomes `to_drive`, `state` `to_state` */
    double edge_s;  /* rise or fall; -1: the command is to be looked at */
    double off_s;   /* the conducting switch opens */
    double on_s;    /* the commanded one closes */
    double next_s;  /* the first of these, or of the capacitor's lock-out; -1: at the next update */
} gates_leg_t;

typedef struct {
    double period_s;
    double closing_s; /* dead time and turn-on delay */
    double turn_on_s;
    double turn_off_s;
    double coincident_s;
    double charge_s, fall_1_s, lockout; /* of the bootstrap capacitors; charge_s 0: none */
    uint32_t timer_counts;
    int legs;
    double edge_s;  /* the last change of any gate */
    bool commanded; /* the last update, or gates_off(), had a command edge, those to and from off included */
    bool in_blocks; /* some legs are driven and others not, or one switch alone is: block commutation */
    double next_s;  /* nothing happens to any leg between the last update and this */
    gates_leg_t leg[PLANT_LEGS];
} gates_t;

void gates_init(gates_t *gates, const plant_inverter_t *inverter, int legs);

/* Start of a period with the given PWM. */
void gates_load(gates_t *gates, const plant_pwm_t *pwm);

/* All switches open, now. */
void gates_off(gates_t *gates);

/* From time t on these legs are driven, in these states; NULL: as they are. */
void gates_drive(gates_t *gates, const bool driven[], const plant_leg_state_t state[], double t_s);

/* Brings the gates to time t; the legs of which one has changed, bit k for leg k. */
unsigned gates_update(gates_t *gates, double t_s);

/* What conducts in leg k, by its fault and its gate. */
extern const gate_t gates_conduct[][GATE_HIGH + 1];
static inline gate_t gates_conducting(const gates_t *gates, int k)
{
    return gates_conduct[gates->leg[k].fault][gates->leg[k].gate];
}

/* The next instant at which gates_update() has something to do, after the last one; T when nothing is left. */
static inline double gates_next_s(const gates_t *gates)
{
    return gates->next_s;
}

#endif
