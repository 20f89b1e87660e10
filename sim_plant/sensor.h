/* Current, voltage and temperature converters (METHODS.md 0.2 E8, E12).
 *
 *   code = round(((1 + gain_error) i + offset) / full scale * 2^(bits-1) + noise) + 2^(bits-1)
 * clipped to the range of the converter and left-aligned to 16 bits. bits = 0: sixteen bits, the finest that
 * the code can carry, without noise. Position of the current sensors:
 *   in line       the leg's current; always settled
 *   low side      the leg's current while its lower switch or diode conducts, else zero current
 *   single shunt  the link current in i_leg[0], with gain_error[0] and offset_A[0]
 * Channels without a shunt read mid-scale. A shunt's amplifier starts from zero current, after the lower path
 * of its leg has closed or, with a single shunt, after the last edge of any leg, and approaches the current
 * with the time constant settle_s / 5. At settle_s the remaining e^-5 (0.7 %) counts as none: from there on
 * the reading is exact and its `settled` bit is set. Where the current ends, the reading is zero at once.
 *
 * Voltages are unipolar and clip at zero and full scale without notice: a terminal on its lower diode and a
 * neutral below the negative rail read zero. The DC link has offset and noise; terminals and neutrals, which
 * the caller has filtered (probe.h), have the gain of their divider too. Temperature is bipolar, without
 * noise. The differential channel is bipolar and clips at either end:
 *
 *   share of full scale = ((1 + v_zero_gain_error) v / (1 + network/(3 load)) + v_zero_offset) / full scale
 *
 * with converter steps and noise of its own, drawn after those before. It reads mid-scale where there is
 * none. So does the sensor of the link current, which has the noise of the legs' and is drawn last.
 *
 * The noise is Gaussian from a generator of its own: equal seeds give equal runs. Drawn in the order i_leg,
 * v_dc, v_leg, v_neutral; the last two only with v_leg_full_scale_V > 0, else they have no noise.
 * Tests: sensor_test.cpp. */
#ifndef PLANT_SENSOR_H
#define PLANT_SENSOR_H

#include "sim_plant/plant.h"

typedef struct {
    uint64_t state;
    double spare; /* the second value of a Gaussian pair */
    bool has_spare;
} noise_t;

typedef struct {
    double i_A[PLANT_LEGS];
    double v_leg_V[PLANT_LEGS]; /* behind the filter, as v_neutral_V */
    double v_neutral_V[PLANT_SETS];
    double v_zero_V[PLANT_SETS]; /* behind its own */
    double v_dc_V;
    double i_dc_A;   /* of the single shunt, */
    double i_link_A; /* and of the link's own sensor, behind its filter */
    double temperature_degC;
    double
        low_for_s[PLANT_LEGS]; /* how long the lower switch or diode has conducted; negative: it does not */
    double quiet_s;            /* since the last edge of any leg */
    int legs, sets;
} sensor_input_t;

void noise_seed(noise_t *noise, uint64_t seed);
double noise_gaussian(noise_t *noise);

/* Writes every member of *adc; currents beyond legs read mid-scale, voltages zero. */
void sensor_convert(const plant_sensor_t *sensor, noise_t *noise, const sensor_input_t *input,
                    plant_adc_t *adc);

#endif
