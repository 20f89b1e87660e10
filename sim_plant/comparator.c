#include "sim_plant/comparator.h"

#include <math.h>

#define WATCH_S 1e-6
#define FOUND_S 0.05e-6
#define NEAR    0.5

bool comparator_sees(const comparator_t *comparator, const circuit_t *circuit, double share)
{
    const plant_break_t *levels = &comparator->levels;
    for (int k = 0; k < circuit->bridge.legs; k++) {
        leg_t leg = circuit->bridge.leg[k];
        bool low = leg == LEG_LOW || leg == LEG_DIODE_LOW || leg == LEG_BOTH;
        if (leg == LEG_FLOATING || !(low || comparator->in_line)) {
            continue;
        }
        double i_A = circuit_leg_A(circuit, &circuit->now, k);
        if ((levels->above_A[k] > 0.0 && i_A > share * levels->above_A[k]) ||
            (levels->below_A[k] > 0.0 && i_A < -share * levels->below_A[k])) {
            return true;
        }
    }
    return false;
}

/* The level is passed between `from` and length h after it: moves the circuit just beyond. */
static double find(const comparator_t *comparator, const circuit_t *from, double h, circuit_t *circuit)
{
    double below = 0.0;
    double beyond = h;
    while (beyond - below > FOUND_S) {
        double middle = 0.5 * (below + beyond);
        *circuit = *from;
        circuit_advance(circuit, middle);
        *(comparator_sees(comparator, circuit, 1.0) ? &beyond : &below) = middle;
    }
    *circuit = *from;
    circuit_advance(circuit, beyond);
    return beyond;
}

bool comparator_advance(const comparator_t *comparator, circuit_t *circuit, double *duration_s)
{
    if (comparator_sees(comparator, circuit, 1.0)) {
        *duration_s = 0.0;
        return true;
    }
    bool near = comparator_sees(comparator, circuit, NEAR);
    for (double taken = 0.0; taken < *duration_s;) {
        double left = *duration_s - taken;
        double h = near ? fmin(left, WATCH_S) : left;
        circuit_t before = *circuit;
        circuit_advance(circuit, h);
        bool was_near = near;
        near = comparator_sees(comparator, circuit, NEAR);
        if (near && !was_near && h > WATCH_S) {
            *circuit = before; /* it may have passed the level and come back: again, closer */
            continue;
        }
        if (comparator_sees(comparator, circuit, 1.0)) {
            *duration_s = taken + find(comparator, &before, h, circuit);
            return true;
        }
        taken += h;
    }
    return false;
}
