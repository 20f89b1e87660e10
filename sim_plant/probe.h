/* Circuits at terminals and neutrals between the samples: dividers with their RC (METHODS.md 0.2 E12), and
 * comparators whose edges a timer captures (E18).
 *
 * Channels: terminals 0 to PLANT_LEGS - 1, then neutrals, volts ahead of the divider. Every channel is
 *
 *   filter_s dv/dt = v_in - v
 *
 * solved exactly for an input that moves linearly within the step; with filter_s = 0 it is the input itself.
 * The comparator of terminal k compares (1 + divider_error) v_k with the mean of the terminals of its set of
 * three, a virtual neutral without error. It goes high above +hysteresis_V / 2 and low below the negative of
 * that, and starts low. The instant is that of the exact response, rounded down to counts of capture_s; an
 * instant on a count but for rounding belongs to that count.
 *
 * Divider, filter and timer are those at init. Cost of three legs: about 50 ns a step, and 0.2 us an edge
 * behind a filter. Tests: probe_test.cpp. */
#ifndef PLANT_PROBE_H
#define PLANT_PROBE_H

#include "sim_plant/plant.h"

#define PROBE_CHANNELS (PLANT_LEGS + PLANT_SETS)
#define PROBE_EDGES    64

typedef struct {
    double filter_s;
    double capture_s;
    double threshold_V; /* half the hysteresis */
    double gain[PLANT_LEGS];
    int legs, sets;
    double v_V[PROBE_CHANNELS];
    bool high[PLANT_LEGS];
    plant_capture_t edge[PROBE_EDGES]; /* of the present period, oldest first */
    int edges;
    unsigned lost; /* later ones, for which there was no room */
} probe_t;

/* All channels at zero; legs a multiple of three. */
void probe_init(probe_t *probe, const plant_sensor_t *sensor, int legs, int sets);

/* There is a filter or a timer. Without, a channel is its node's voltage and probe_advance() not needed. */
static inline bool probe_active(const probe_t *probe)
{
    return probe->filter_s > 0.0 || probe->capture_s > 0.0;
}

/* Forgets the captured edges. */
void probe_start_period(probe_t *probe);

/* One step, from start_s after the start of the period, with the voltages of all PROBE_CHANNELS at its ends.
 * Between two calls they may jump. A step without duration has no effect. */
void probe_advance(probe_t *probe, double start_s, double duration_s, const double before_V[],
                   const double after_V[]);

/* Behind the filter, without the divider's error (which the converter applies). */
double probe_voltage(const probe_t *probe, int channel);

#endif
