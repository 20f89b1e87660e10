#include "sim_plant/comparator.h"

#include <assert.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#define WATCH_S 1e-6
#define FOUND_S 0.05e-6
#define NEAR    0.5

/* What moves in a segment: everything but the machine, which is large and stands first. */
static_assert(offsetof(circuit_t, machine) == 0, "the machine stands first");
#define MOVING (sizeof(circuit_t) - offsetof(circuit_t, bridge))

static void keep(const circuit_t *circuit, circuit_t *kept)
{
    memcpy((char *)kept + offsetof(circuit_t, bridge), (const char *)circuit + offsetof(circuit_t, bridge),
           MOVING);
}

static void give_back(const circuit_t *kept, circuit_t *circuit)
{
    memcpy((char *)circuit + offsetof(circuit_t, bridge), (const char *)kept + offsetof(circuit_t, bridge),
           MOVING);
}

static double per_ampere(double level_A)
{
    return level_A > 0.0 ? 1.0 / level_A : 0.0;
}

void comparator_init(comparator_t *comparator, const plant_break_t *levels, bool in_line)
{
    *comparator = (comparator_t){.delay_s = levels->delay_s, .in_line = in_line};
    for (int k = 0; k < PLANT_LEGS; k++) {
        comparator->inv_above_1_A[k] = per_ampere(levels->above_A[k]);
        comparator->inv_below_1_A[k] = -per_ampere(levels->below_A[k]);
    }
}

double comparator_sees(const comparator_t *comparator, const circuit_t *circuit)
{
    double most = 0.0;
    for (int k = 0; k < circuit->bridge.legs; k++) {
        leg_t leg = circuit->bridge.leg[k];
        bool low = leg == LEG_LOW || leg == LEG_DIODE_LOW || leg == LEG_BOTH;
        if (low || (comparator->in_line && leg != LEG_FLOATING)) {
            double i_A = circuit_leg_A(circuit, &circuit->now, k);
            double seen = i_A * (i_A > 0.0 ? comparator->inv_above_1_A[k] : comparator->inv_below_1_A[k]);
            most = seen > most ? seen : most;
        }
    }
    return most;
}

static void advance(circuit_t *circuit, double duration_s)
{
    for (double left_s = duration_s; left_s > 0.0;) {
        left_s = circuit_advance(circuit, left_s);
    }
}

/* The level is passed between `from` and length h after it: moves the circuit just beyond. */
static double find(const comparator_t *comparator, const circuit_t *from, double h, circuit_t *circuit)
{
    double below = 0.0;
    double beyond = h;
    while (beyond - below > FOUND_S) {
        double middle = 0.5 * (below + beyond);
        give_back(from, circuit);
        advance(circuit, middle);
        *(comparator_sees(comparator, circuit) > 1.0 ? &beyond : &below) = middle;
    }
    give_back(from, circuit);
    advance(circuit, beyond);
    return beyond;
}

bool comparator_advance(const comparator_t *comparator, circuit_t *circuit, double *left_s)
{
    circuit_t before;
    double sees = comparator_sees(comparator, circuit);
    bool watch = sees > NEAR;
    bool event = false;
    while (sees <= 1.0 && *left_s > 0.0 && !event) {
        double wanted = watch ? fmin(*left_s, WATCH_S) : *left_s;
        keep(circuit, &before);
        double missing = circuit_advance(circuit, wanted);
        double h = wanted - missing;
        sees = comparator_sees(comparator, circuit);
        if (sees > NEAR && !watch && h > WATCH_S) {
            give_back(&before, circuit); /* it may have passed the level and come back: again, closer */
            watch = true;
            sees = 0.0;
            continue;
        }
        double taken = sees > 1.0 ? find(comparator, &before, h, circuit) : h;
        event = missing > 0.0;
        *left_s = taken < *left_s ? *left_s - taken : 0.0;
        watch = sees > NEAR;
    }
    return sees > 1.0;
}
