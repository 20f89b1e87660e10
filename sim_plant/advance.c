#include "sim_plant/steps.h"

#include <assert.h>

#define MAX_EVENTS 10000 /* of a segment; more would be chatter */

double circuit_advance(circuit_t *c, double duration_s)
{
    bool event = false;
    if ((c->bridge.floating | c->bridge.swinging) != 0u) { /* diodes that stop are events */
        circuit_settle_legs(c);
    }
    double left_s = circuit_symmetrical(c) || circuit_two_phase(c) ? steps_symmetrical(c, duration_s, &event)
                                                                   : steps_general(c, duration_s, &event);
    if (event) {
        c->events++;
        assert(c->events < MAX_EVENTS);
        circuit_settle(c);
    } else {
        c->events = 0;
    }
    return left_s;
}
