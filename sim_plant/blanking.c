#include "sim_plant/blanking.h"

#include <math.h>
#include <string.h>

#define ROUNDING_S 1e-10

void blanking_edge(blanking_t *b, double at_s)
{
    if (b->length_s <= 0.0) {
        return;
    }
    int last = b->windows - 1;
    if (last < 0 || (at_s - ROUNDING_S > b->window[last].until_s && b->windows < BLANKING_WINDOWS)) {
        last = b->windows++;
        b->window[last].from_s = at_s - ROUNDING_S;
        b->window[last].until_s = at_s;
    }
    b->window[last].from_s = fmin(b->window[last].from_s, at_s - ROUNDING_S); /* a trip comes unannounced */
    b->window[last].until_s = fmax(b->window[last].until_s, at_s + b->length_s);
}

bool blanking_holds(const blanking_t *b, double at_s)
{
    for (int n = 0; n < b->windows; n++) {
        if (at_s >= b->window[n].from_s && at_s < b->window[n].until_s) {
            return true;
        }
    }
    return false;
}

double blanking_end_s(const blanking_t *b, double after_s, double until_s)
{
    for (int n = 0; n < b->windows; n++) {
        double end_s = b->window[n].until_s;
        if (end_s > after_s && end_s <= until_s) {
            return end_s;
        }
    }
    return (double)INFINITY;
}

void blanking_pass(blanking_t *b, double at_s)
{
    int passed = 0;
    while (passed < b->windows && b->window[passed].until_s <= at_s) {
        passed++;
    }
    b->windows -= passed;
    memmove(b->window, &b->window[passed], (size_t)b->windows * sizeof b->window[0]);
}

void blanking_start_period(blanking_t *b, double period_s)
{
    for (int n = 0; n < b->windows; n++) {
        b->window[n].from_s -= period_s;
        b->window[n].until_s -= period_s;
    }
}
