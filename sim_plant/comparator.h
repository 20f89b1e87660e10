/* Over-current comparators: the circuit's advance that stops where one of them sees too much.
 *
 * Checks the ends of a segment, and every WATCH_S once a current is beyond half of its level; the instant is
 * then found by halving to FOUND_S. A current that leaves half of the level, passes the level and is back
 * below half within one segment is missed. Tests: comparator_test.cpp. */
#ifndef PLANT_COMPARATOR_H
#define PLANT_COMPARATOR_H

#include "sim_plant/circuit.h"

typedef struct {
    double inv_above_1_A[PLANT_LEGS], inv_below_1_A[PLANT_LEGS]; /* 0: never */
    double delay_s;
    bool in_line; /* shunts see their currents always */
} comparator_t;

void comparator_init(comparator_t *comparator, const plant_break_t *levels, bool in_line);

/* What they see, the nearest one in units of its level: beyond 1 it acts. */
double comparator_sees(const comparator_t *comparator, const circuit_t *circuit);

/* By *left_s, or less: to where a comparator acts, then true, or to an event. *left_s becomes what is left.
 */
bool comparator_advance(const comparator_t *comparator, circuit_t *circuit, double *left_s);

#endif
