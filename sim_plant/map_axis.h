/* One current axis of a flux map: the grid with a margin on either side, and the range beyond the data.
 *
 * For map_table.c. The map is evaluated at s(i): i itself within the data; beyond, it levels off and reaches
 * the outer node after twice the margin. A co-energy g(i) of its own is added, so that the flux
 *
 *   psi = s' W_i(s) + g'
 *       = s' W_i(s) + (1 - s') psi_end + L_end (i - s)
 *
 * passes from that of the map to psi_end. With psi_end at least (below the grid: at most) every W_i of the
 * margin and L_end > 0 the sum is convex wherever W is:
 *
 *   W_i s'' + g'' >= L_end (1 - s') */
#ifndef PLANT_MAP_AXIS_H
#define PLANT_MAP_AXIS_H

#include <stdbool.h>

typedef struct {
    int count; /* nodes with the two of the margin */
    double *x_A;
    double low_A, high_A; /* of the data */
    int bins;             /* uniform, for finding a cell */
    int *cell_of_bin;
    double bins_1_A;
    double psi_end_Wb[2]; /* beyond low, beyond high */
    double L_end_H[2];
} map_axis_t;

typedef struct {
    double s, s1, s2; /* argument of the map and its derivatives by the current */
    double g, g1, g2; /* added co-energy / 1.5 and its derivatives */
} map_reach_t;

bool map_axis_init(map_axis_t *axis, int count, const double *x_A); /* false: memory is short */
void map_axis_free(map_axis_t *axis);
void map_axis_set_margin(map_axis_t *axis, double width_A);

map_reach_t map_axis_reach_beyond(const map_axis_t *axis, double i_A);

static inline map_reach_t map_axis_reach(const map_axis_t *axis, double i_A)
{
    if (i_A < axis->low_A || i_A > axis->high_A) {
        return map_axis_reach_beyond(axis, i_A);
    }
    return (map_reach_t){.s = i_A, .s1 = 1.0};
}

/* The cell that holds s: between nodes k and k + 1. */
static inline int map_axis_cell(const map_axis_t *axis, double s)
{
    double place = (s - axis->x_A[0]) * axis->bins_1_A;
    int bin = place > 0.0 ? (place < axis->bins - 1 ? (int)place : axis->bins - 1) : 0;
    int cell = axis->cell_of_bin[bin];
    while (cell < axis->count - 2 && s >= axis->x_A[cell + 1]) {
        cell++;
    }
    return cell;
}

/* Where s lies in a cell, 0 ... 1. */
static inline double map_axis_part(const map_axis_t *axis, int cell, double s)
{
    return (s - axis->x_A[cell]) / (axis->x_A[cell + 1] - axis->x_A[cell]);
}

#endif
