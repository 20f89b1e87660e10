/* What no caller of the plant needs to know, but a test of its cost: the length of the next step. */
#ifndef TESTS_UNIT_SIM_PLANT_STEP_LENGTH_H
#define TESTS_UNIT_SIM_PLANT_STEP_LENGTH_H

#include "sim_plant/plant.h"

#ifdef __cplusplus
extern "C" {
#endif

/* As the error control would have it, s. */
double step_length_s(const plant_t *plant);

#ifdef __cplusplus
}
#endif

#endif
