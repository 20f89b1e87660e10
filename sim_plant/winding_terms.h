/* What the parameters of the phases are in coordinates: the terms of winding.h. Its tests are those of
 * winding. */
#ifndef PLANT_WINDING_TERMS_H
#define PLANT_WINDING_TERMS_H

#include "sim_plant/winding.h"

#define WINDING_SHORT 6 /* coordinate of the fault branch */

/* Resistance, inductance and magnet flux of a winding whose connection is known; see winding_init(). */
void winding_terms(winding_t *winding, const plant_winding_t *parameters, double R_s_ohm, double psi_m_Wb,
                   double psi_core_Wb, double magnet_scale);

/* The inductance of one order, made if there is none yet. */
inductance_term_t *winding_inductance(winding_t *winding, int order);

/* Component of coordinate c of its set along a phase. */
double winding_axis(int phase, int c);

/* Of a coordinate in a power. */
double winding_weight(int c);

#endif
