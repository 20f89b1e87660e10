/* Fits one co-energy to tabulated fluxes: derivatives of W'/1.5 at the nodes of a grid. For map_table.c.
 *
 * Along grid lines the fluxes are cubics with the slopes of map_slope.h. W' is the least-squares fit to the
 * increments these make along all grid edges. What remains is the part of the data that no co-energy has:
 * the fluxes are moved until edges and co-energy agree. The cross inductance is the mean of its two
 * estimates, higher cross derivatives are spline slopes. Tests: map_table_test.cpp. */
#ifndef PLANT_MAP_FIT_H
#define PLANT_MAP_FIT_H

#include "sim_plant/map_table.h"

typedef struct {
    int count_d, count_q;
    const double *i_d_A, *i_q_A;
} map_grid_t;

typedef struct {
    double cross_H2; /* sum over the nodes of (dpsi_d/di_q - dpsi_q/di_d)^2 as given ... */
    double self_H2;  /* ... and of the mean square of the two self-inductances */
    double moved_Wb; /* largest change of a flux */
} map_fit_report_t;

/* Row-major as map_table_data_t; the fluxes are moved in place. A harmonic over the angle has no reason to
 * be monotone: limit is false. Returns false when memory is short. */
bool map_fit_nodes(const map_grid_t *grid, bool limit, double *psi_d_Wb, double *psi_q_Wb, map_node_t *nodes,
                   map_fit_report_t *report);

#endif
