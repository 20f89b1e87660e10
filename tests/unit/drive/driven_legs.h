/* Legs of a plant that the timer drives in the present period. */
#ifndef TESTS_UNIT_DRIVE_DRIVEN_LEGS_H
#define TESTS_UNIT_DRIVE_DRIVEN_LEGS_H

#include "sim_plant/plant.h"

#ifdef __cplusplus
extern "C" {
#endif

int driven_legs(const plant_t *plant);

#ifdef __cplusplus
}
#endif

#endif
