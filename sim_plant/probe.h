/* Circuits at terminals and neutrals between the samples: dividers with their RC (METHODS.md 0.2 E12), and
 * comparators whose edges a timer captures (E18).
 *
 * Channels: terminals 0 to PLANT_LEGS - 1, then neutrals, then the DC link, volts ahead of the divider. Every
 * channel is
 *
 *   filter_s dv/dt = v_in - v
 *
 * solved exactly for an input that moves linearly within the step; with filter_s = 0 it is the input itself.
 * The comparator of terminal k sees
 *
 *   (1 + divider_error) v_k - v_ref + comparator_offset_V
 *
 * with v_ref behind the same RC: the mean of the terminals of its set of three, a virtual neutral without
 * error; half the DC-link voltage; or the neutral of its set, with the error of that divider. It goes high
 * above +hysteresis_V / 2 and low below the negative of that, and starts low. The instant is that of the
 * exact response, rounded down to counts of capture_s; an instant on a count but for rounding belongs to that
 * count. While it is blanked (blanking.h) a comparator goes on, but its output to the timer holds; where the
 * two differ at the end of the window, the edge has that instant.
 *
 * Divider, filter, reference and timer are those at init. Cost of three legs: about 50 ns a step, and 0.2 us
 * an edge behind a filter. Tests: probe_test.cpp, capture_test.cpp. */
#ifndef PLANT_PROBE_H
#define PLANT_PROBE_H

#include "sim_plant/blanking.h"
#include "sim_plant/plant.h"

#define PROBE_LINK     (PLANT_LEGS + PLANT_SETS) /* its channel */
#define PROBE_CHANNELS (PROBE_LINK + 1)
#define PROBE_EDGES    64

typedef struct {
    double filter_s;
    double capture_s;
    double threshold_V; /* half the hysteresis */
    double gain[PROBE_CHANNELS];
    double offset_V[PLANT_LEGS];
    plant_reference_t reference;
    int legs, sets;
    double v_V[PROBE_CHANNELS];
    bool high[PLANT_LEGS];
    bool shown[PLANT_LEGS]; /* to the timer, when there is blanking */
    blanking_t blanking;
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

/* Forgets the captured edges; the period that has ended was so long. */
void probe_start_period(probe_t *probe, double period_s);

/* A leg's commanded edge, ahead of the step that contains it. */
static inline void probe_command_edge(probe_t *probe, double at_s)
{
    if (probe->blanking.length_s > 0.0) {
        blanking_edge(&probe->blanking, at_s);
    }
}

/* One step, from start_s after the start of the period, with the voltages of all PROBE_CHANNELS at its ends.
 * Between two calls they may jump. A step without duration has no effect. */
void probe_advance(probe_t *probe, double start_s, double duration_s, const double before_V[],
                   const double after_V[]);

/* Behind the filter, without the divider's error (which the converter applies). */
double probe_voltage(const probe_t *probe, int channel);

#endif
