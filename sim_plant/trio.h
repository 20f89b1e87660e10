/* Legs by threes, as vectors of four lanes: what the closed-form steps do to each leg of a set (symmetrical_rates.h), for all of them at
 * once. Group g has the legs from 3 g on. Tests: tests/unit/sim_plant/ringing_test.cpp, plant_test.cpp. */
#ifndef SIM_PLANT_TRIO_H
#define SIM_PLANT_TRIO_H

#include "sim_plant/circuit.h"
#include "sim_plant/field.h"

#include <string.h>

/* Of three legs, the fourth is nothing. Never an argument by value: how that is passed depends on the
 * processor. */
typedef double trio_t __attribute__((vector_size(32)));
typedef int64_t trio_mask_t __attribute__((vector_size(32)));

INLINE void trio_pick(const trio_mask_t *where, const trio_t *there, const trio_t *elsewhere, trio_t *to)
{
    *to = (trio_t)((*where & (trio_mask_t)*there) | (~*where & (trio_mask_t)*elsewhere));
}

INLINE bool trio_any(const trio_mask_t *mask)
{
    return ((*mask)[0] | (*mask)[1] | (*mask)[2]) != 0;
}

/* Coordinates that the legs of group g have a part in: of two stars their own set. */
INLINE int groups(shape_t shape)
{
    return shape.legs / 3;
}

INLINE int group_first(shape_t shape, int g)
{
    return shape.sets > 1 ? g : 0;
}

INLINE int group_end(shape_t shape, int g)
{
    return shape.sets > 1 ? g + 1 : pairs(shape);
}

INLINE double along(const winding_t *w, shape_t shape, int k, const pair_t x[])
{
    pair_t sum = {0.0};
    for (int p = group_first(shape, k / 3); p < group_end(shape, k / 3); p++) {
        sum += pair_at(&w->axis[k][2 * p]) * x[p];
    }
    return total(sum);
}

/* The same of a group. */
INLINE void along_group(const winding_t *w, shape_t shape, int g, const pair_t x[], trio_t *to)
{
    trio_t first = {0.0}, second = {0.0}, axis;
    for (int p = group_first(shape, g); p < group_end(shape, g); p++) {
        memcpy(&axis, w->by_leg[g][2 * p], sizeof axis);
        first += axis * x[p][0];
        memcpy(&axis, w->by_leg[g][2 * p + 1], sizeof axis);
        second += axis * x[p][1];
    }
    *to = first + second;
}

INLINE void spread_group(const winding_t *w, shape_t shape, int g, const trio_t *v_V, pair_t to_V[])
{
    for (int p = group_first(shape, g); p < group_end(shape, g); p++) {
        for (int n = 0; n < 3; n++) {
            to_V[p] += pair_at(&w->share[3 * g + n][2 * p]) * both((*v_V)[n]);
        }
    }
}

/* Of each leg of a group */
INLINE void legs_at(const double x[], int g, trio_t *to)
{
    *to = (trio_t){x[3 * g], x[3 * g + 1], x[3 * g + 2], 0.0};
}

INLINE void terminals_at(const double x[], int g, trio_t *to)
{
    *to = (trio_t){x[V_LEG(3 * g)], x[V_LEG(3 * g + 1)], x[V_LEG(3 * g + 2)], 0.0};
}

INLINE void terminals_put(double x[], int g, const trio_t *from)
{
    for (int n = 0; n < 3; n++) {
        x[V_LEG(3 * g + n)] = (*from)[n];
    }
}

INLINE void find_swinging(const bridge_t *b, shape_t shape, trio_t swinging[])
{
    for (int g = 0; g < groups(shape); g++) {
        unsigned legs = b->swinging >> (3 * g);
        swinging[g] = (trio_t){legs & 1u, legs >> 1 & 1u, legs >> 2 & 1u, 0.0};
    }
}

#endif
