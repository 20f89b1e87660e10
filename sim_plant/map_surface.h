/* The surface W'/1.5 of a flux map: patches through given nodes, with a margin around the grid. For
 * map_table.c. */
#ifndef PLANT_MAP_SURFACE_H
#define PLANT_MAP_SURFACE_H

#include "sim_plant/map_axis.h"
#include "sim_plant/map_patch.h"

#define MAP_LAYERS (1 + 2 * MAP_HARMONICS) /* mean, then cos and sin of each harmonic */

struct map_table {
    map_axis_t d, q;
    int layers, theta_order;
    double *patch;          /* [cell of i_d][cell of i_q][layer][coefficient] */
    struct map_table *zero; /* map_zero.h: psi_0 in the place of W'/1.5, on the axes of this; NULL: none */
};

/* One angle's cos and sin of the harmonics, in the order of the layers. */
typedef struct {
    double x[MAP_LAYERS - 1];
} map_series_t;

map_series_t map_surface_series(const map_table_t *map, double theta_e_rad);

double *map_surface_patch(const map_table_t *map, int cell_d, int cell_q); /* its layers */

/* From nodes [layer][i_d][i_q] of the grid, with the margins as they are */
void map_surface_set_patches(map_table_t *map, const map_node_t *nodes);

/* The polynomial of a cell at one angle, and its derivative by the angle. */
void map_surface_sum(const map_table_t *map, int cell_d, int cell_q, const map_series_t *series,
                     double c[MAP_PATCH], double c_theta[MAP_PATCH]);

/* W'/1.5 and its derivatives by the currents, at a point of a cell. */
map_value_t map_surface_value(const map_table_t *map, int cell_d, int cell_q, const double c[MAP_PATCH],
                              double t, double u);

/* Patches, margin and zero of W', from nodes [layer][i_d][i_q] of the grid. False when the tangent inductance
 * is not positive definite somewhere on the grid; its smallest eigenvalue there in any case. */
bool map_surface_build(map_table_t *map, const map_node_t *nodes, double *L_min_H);

#endif
