/* Flux map of one three-phase set from data: psi_d, psi_q over a grid of i_d, i_q and, if given, theta.
 *
 * The map is the gradient of one co-energy W'(i_d, i_q, theta), a biquintic spline of class C2 in the
 * currents, so it is reciprocal and torque and power balance whatever the data. Along grid lines the flux
 * keeps to the cubic spline through the data, limited so that it is monotone where they are. Data that are
 * not reciprocal are made so by least squares, and the deviation is reported.
 *
 * Over the angle every node is a trigonometric series through its samples, with up to MAP_HARMONICS terms;
 * what higher ones would add is reported. Fluxes do not tell the co-energy without current (cogging): it is
 * taken as zero at every angle.
 *
 * Beyond the grid the map continues with its curvature at the edge. Over a margin of half the grid's range,
 * less where the tangent would lose its sign, each flux levels off to its largest value there plus a constant
 * inductance, the mean of the edge, so that the map stays smooth and its tangent positive at any current. It
 * is there to bring a simulation home, not to be believed.
 *
 * Values are of a three-phase set: W' and torque carry the factor 1.5, psi and i are peak values in dq.
 * Cost of an evaluation on a PC: 50 ns, with 12 harmonics 0.5 us. Tests: map_table_test.cpp. */
#ifndef PLANT_MAP_TABLE_H
#define PLANT_MAP_TABLE_H

#include <stdbool.h>

#include "sim_plant/frame.h"
#include "sim_plant/plant_config.h"

#ifdef __cplusplus
extern "C" {
#endif

#define MAP_HARMONICS 12 /* most over the angle, in multiples of theta_order */

/* Row-major: i_d slowest, then i_q, then theta. Grids ascend; they need not be equally spaced. */
typedef struct {
    int count_d, count_q;
    int count_theta; /* 0 or 1: mean over angle. Else equally spaced over one period of theta from 0 */
    int theta_order; /* periods of the data in one electrical turn, e.g. 6 for 60 degrees */
    const double *i_d_A, *i_q_A;
    const double *psi_d_Wb, *psi_q_Wb;
} map_table_data_t;

typedef struct {
    double reciprocity;  /* rms of dpsi_d/di_q - dpsi_q/di_d, relative to the rms self-inductance */
    double moved_Wb;     /* no flux was changed by more to make the data reciprocal */
    double L_min_H;      /* smallest eigenvalue of the tangent inductance on the grid and within its cells */
    double neglected_Wb; /* largest part of a flux in harmonics beyond MAP_HARMONICS */
} map_table_report_t;

typedef struct {
    dq_t psi_Wb;
    double L_d_H, L_dq_H, L_q_H; /* tangent inductances */
    dq_t psi_theta_Wb;           /* d psi_dq / d theta (electrical) at constant i_dq; 0 for a mean map */
    double coenergy_J;
    double coenergy_theta_J; /* d W' / d theta at constant i_dq */
} map_point_t;

/* NULL and a message in *error (static storage) for data that make no sense: too few nodes (4 each way),
 * grids that do not ascend, values that are not finite, an inductance that is not positive. Copies the data.
 */
map_table_t *map_table_create(const map_table_data_t *data, map_table_report_t *report, const char **error);
void map_table_destroy(map_table_t *map);

/* Derivatives known better than from the data (a closed form sampled at nodes), each node: */
typedef struct {
    double W, d, q;    /* co-energy / 1.5 and its gradient psi_d, psi_q */
    double dd, dq, qq; /* inductances */
    double ddq, dqq, ddqq;
} map_node_t;
map_table_t *map_table_from_nodes(int count_d, int count_q, const double *i_d_A, const double *i_q_A,
                                  const map_node_t *nodes, map_table_report_t *report, const char **error);

void map_table_eval(const map_table_t *map, dq_t i_A, double theta_e_rad, map_point_t *point);

#ifdef __cplusplus
}
#endif

#endif
