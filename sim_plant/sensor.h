/* Current and voltage converters (METHODS.md 0.2 E8).
 *
 * code = round(((1 + gain_error) i + offset) / full scale * 2^(bits-1) + noise) + 2^(bits-1), clipped to
 * the range of the converter and left-aligned to 16 bits; the DC-link channel is unipolar and has noise
 * only. bits = 0: sixteen bits, the finest that the answer can carry, without noise.
 * The noise is Gaussian from an own generator: equal seeds give equal runs. Tests: sensor_test.cpp. */
#ifndef PLANT_SENSOR_H
#define PLANT_SENSOR_H

#include "sim_plant/plant.h"

typedef struct {
    uint64_t state;
    double spare; /* the second value of a Gaussian pair */
    bool has_spare;
} noise_t;

void noise_seed(noise_t *noise, uint64_t seed);
double noise_gaussian(noise_t *noise);

uint16_t sensor_current(const plant_sensor_t *sensor, noise_t *noise, int leg, double i_A);
uint16_t sensor_voltage(const plant_sensor_t *sensor, noise_t *noise, double v_V);

#endif
