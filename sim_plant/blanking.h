/* Blanking of the terminal comparators after commanded switching edges (METHODS.md 0.2 E18).
 *
 * A window begins with each edge and ends length_s later; windows that overlap are one. Times are seconds
 * since the start of the period. An edge may be announced before the circuit gets there, in order of time.
 * What lies less than 0.1 ns ahead of an edge belongs to its window, as the circuit's time is a sum of steps.
 * Tests: blanking_test.cpp. */
#ifndef PLANT_BLANKING_H
#define PLANT_BLANKING_H

#include <stdbool.h>

#define BLANKING_WINDOWS 16 /* announced and not passed; beyond these the last one is extended */

typedef struct {
    double length_s; /* 0: none */
    int windows;
    struct {
        double from_s, until_s;
    } window[BLANKING_WINDOWS];
} blanking_t;

void blanking_edge(blanking_t *blanking, double at_s);

/* Whether an instant lies in a window; its end does not. */
bool blanking_holds(const blanking_t *blanking, double at_s);

/* End of the first window that ends after one instant and not after another; infinite: none. */
double blanking_end_s(const blanking_t *blanking, double after_s, double until_s);

/* Forgets windows that have ended. */
void blanking_pass(blanking_t *blanking, double at_s);

/* Counts from the end of a period of that length on. */
void blanking_start_period(blanking_t *blanking, double period_s);

#endif
