/* Timer and gate drivers: compare values in, the state of six switches out (METHODS.md 0.2 E6, E9).
 *
 * Centre-aligned carrier, period [0, T): the command of leg X is high from (1 - d0) T/2 to (1 + d1) T/2
 * with d = compare / timer_counts of each half. Compare values beyond timer_counts count as
 * timer_counts. Full duty on both sides of a period boundary joins without an edge.
 *
 * A command edge opens the conducting switch at once; the other closes dead_time_s later. An edge within
 * the dead time starts it anew, so a pulse shorter than the dead time never reaches its switch, as in a
 * timer with a dead-time generator. A leg that becomes driven also waits one dead time.
 *
 * Edges closer than 1e-9 T are one event. Times are relative to the start of the period.
 * Tests: gates_test.cpp. */
#ifndef PLANT_GATES_H
#define PLANT_GATES_H

#include "sim_plant/plant.h"

typedef enum { GATE_OFF, GATE_LOW, GATE_HIGH } gate_t; /* which switch of a leg conducts */

typedef struct {
    double period_s;
    double dead_time_s;
    double coincident_s;
    uint32_t timer_counts;
    struct {
        bool driven;
        double rise_s, fall_s; /* command edges of this period */
        gate_t command;        /* before dead time */
        double ready_s;        /* end of the dead time, when gate != command */
        gate_t gate;
    } leg[PLANT_LEGS];
} gates_t;

void gates_init(gates_t *gates, const plant_inverter_t *inverter);

/* Start of a period with the given PWM. */
void gates_load(gates_t *gates, const plant_pwm_t *pwm);

/* All switches open, now. */
void gates_off(gates_t *gates);

/* Brings the gates to time t; true when one of them changed. */
bool gates_update(gates_t *gates, double t_s);

/* The next instant after t at which gates_update() has something to do; T when nothing is left. */
double gates_next_s(const gates_t *gates, double t_s);

#endif
