/* One cell of a flux map: a polynomial of degree 5 in each current. For map_table.c. */
#ifndef PLANT_MAP_PATCH_H
#define PLANT_MAP_PATCH_H

#include "sim_plant/map_table.h"

#define MAP_PATCH 36 /* coefficients of t^a u^b at [6 b + a]; t, u in 0 ... 1 along i_d, i_q */

typedef struct {
    double W, d, q, dd, dq, qq; /* by t and u */
} map_value_t;

/* corner[2 p + r]: p = 1 at the upper end of i_d, r = 1 of i_q; h: size of the cell. */
void map_patch_set(double c[MAP_PATCH], const map_node_t corner[4], double h_d_A, double h_q_A);

/* The node's Taylor series of second order in each current, at a distance. */
map_node_t map_patch_extend(const map_node_t *node, double by_d_A, double by_q_A);

map_value_t map_patch_value(const double c[MAP_PATCH], double t, double u);

#endif
