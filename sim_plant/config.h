/* Refuses a plant configuration that makes no physical sense. */
#ifndef PLANT_CONFIG_H
#define PLANT_CONFIG_H

#include "sim_plant/plant.h"

/* NULL, or a message in static storage that names the field. */
const char *config_fault(const plant_config_t *config);

#endif
