/* Checks of the plant's configuration: NULL, or which member makes no sense, as "section.member must ...". */
#ifndef PLANT_CONFIG_CHECK_H
#define PLANT_CONFIG_CHECK_H

#include "sim_plant/plant.h"

const char *config_fault(const plant_config_t *config);
const char *config_machine_fault(const plant_config_t *config);
const char *config_sensor_fault(const plant_sensor_t *sensor, double period_s);

#endif
