/* Refuses a plant configuration that makes no physical sense. */
#ifndef PLANT_CONFIG_H
#define PLANT_CONFIG_H

#include "sim_plant/plant.h"

/* Each: NULL, or a message in static storage that names the field. */
const char *config_fault(const plant_config_t *config);
const char *config_machine_fault(const plant_machine_t *machine);
const char *config_sensor_fault(const plant_sensor_t *sensor, double period_s);

#endif
