/* Zero-sequence flux linkage of a flux map: psi_0 over i_d, i_q and theta, beside the map of psi_d and psi_q.
 *
 * psi_0 is that of the mean of the three phases, at i_0 = 0. With a zero-sequence current, which an open
 * winding has, the co-energy is
 *
 *   W' = W'(i_d, i_q, theta) + 3 (psi_0(i_d, i_q, theta) i_0 + L_0 i_0^2 / 2),
 *
 * so what links the currents to psi_0 links i_0 to the fluxes and the torque (machine.h):
 *
 *   psi_d  = dW'/di_d / 1.5 = psi_d(i_d, i_q, theta) + 2 i_0 dpsi_0/di_d
 *   psi_q  = dW'/di_q / 1.5 = psi_q(i_d, i_q, theta) + 2 i_0 dpsi_0/di_q
 *   torque = P (... + 3 i_0 dpsi_0/dtheta)
 *
 * Between the nodes psi_0 is a biquintic spline of class C2 through the data, over the angle a trigonometric
 * series as the map itself. Fluxes psi_d, psi_q that repeat after 60 or 180 degrees have a psi_0 that then
 * changes its sign, since the phases do: such data are half a period of it. Beyond the data it levels off
 * with the map.
 *
 * Tests: map_table_test.cpp, machine_test.cpp, validation_zero_sequence_test.cpp. */
#ifndef PLANT_MAP_ZERO_H
#define PLANT_MAP_ZERO_H

#include "sim_plant/map_table.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    double psi_Wb;
    double d_H, q_H;               /* derivatives by i_d, i_q, */
    double dd_H_A, dq_H_A, qq_H_A; /* again by the currents, */
    double theta_Wb;               /* by the electrical angle, */
    double d_theta_H, q_theta_H;   /* and that by the currents */
} map_zero_t;

/* psi_0 at the points of the data that the map was made of, in their order; they need angles. Copies them.
 * False and a message in *error (static storage) when they make no sense. */
bool map_zero_add(map_table_t *map, const map_table_data_t *data, const double *psi_0_Wb, const char **error);

bool map_zero_given(const map_table_t *map);

/* Of a map that has it. Cost as map_table_eval(). */
void map_zero_eval(const map_table_t *map, dq_t i_A, double theta_e_rad, map_zero_t *zero);

#ifdef __cplusplus
}
#endif

#endif
