#include "sim_plant/map_axis.h"

#include <stdlib.h>
#include <string.h>

#define BINS_PER_NODE 4

bool map_axis_init(map_axis_t *axis, int count, const double *x_A)
{
    axis->count = count + 2;
    axis->bins = BINS_PER_NODE * axis->count;
    axis->x_A = malloc((size_t)axis->count * sizeof *axis->x_A);
    axis->cell_of_bin = calloc((size_t)axis->bins, sizeof *axis->cell_of_bin);
    if (axis->x_A == NULL || axis->cell_of_bin == NULL) {
        return false;
    }
    memcpy(axis->x_A + 1, x_A, (size_t)count * sizeof *x_A);
    axis->low_A = x_A[0];
    axis->high_A = x_A[count - 1];
    return true;
}

void map_axis_free(map_axis_t *axis)
{
    free(axis->x_A);
    free(axis->cell_of_bin);
}

void map_axis_set_margin(map_axis_t *axis, double width_A)
{
    int last = axis->count - 1;
    axis->x_A[0] = axis->low_A - width_A;
    axis->x_A[last] = axis->high_A + width_A;
    double bin_A = (axis->x_A[last] - axis->x_A[0]) / axis->bins;
    axis->bins_1_A = 1.0 / bin_A;
    int cell = 0;
    for (int bin = 0; bin < axis->bins; bin++) {
        /* rounding must not put a current into a bin whose cell lies above it */
        while (cell < last - 1 && axis->x_A[cell + 1] <= axis->x_A[0] + (bin - 0.5) * bin_A) {
            cell++;
        }
        axis->cell_of_bin[bin] = cell;
    }
}

/* With v the distance from the data and l the length over which s levels off, u = v/l:
 * s' = 1 - 3u^2 + 2u^3, so v - s is l (u^3 - u^4/2) and half of l at its end. */
map_reach_t map_axis_reach_beyond(const map_axis_t *axis, double i_A)
{
    int side = i_A > axis->high_A ? 1 : 0;
    double sign = side == 1 ? 1.0 : -1.0;
    double edge_A = side == 1 ? axis->high_A : axis->low_A;
    double length_A = 2.0 * (axis->x_A[axis->count - 1] - axis->high_A);
    double v = sign * (i_A - edge_A);
    double u = v < length_A ? v / length_A : 1.0;
    double past = v < length_A ? 0.0 : v - length_A;
    double gap = length_A * u * u * u * (1.0 - 0.5 * u) + past;
    double gap_sum =
        length_A * length_A * u * u * u * u * (0.25 - 0.1 * u) + past * (0.5 * length_A + 0.5 * past);
    double s1 = 1.0 - u * u * (3.0 - 2.0 * u);
    double s2 = -sign * 6.0 * u * (1.0 - u) / length_A;
    double psi = axis->psi_end_Wb[side], L = axis->L_end_H[side];
    return (map_reach_t){
        .s = edge_A + sign * (v - gap),
        .s1 = s1,
        .s2 = s2,
        .g = sign * psi * gap + L * gap_sum,
        .g1 = psi * (1.0 - s1) + sign * L * gap,
        .g2 = -psi * s2 + L * (1.0 - s1),
    };
}
