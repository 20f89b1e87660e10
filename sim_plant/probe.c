#include "sim_plant/probe.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#define ROUNDING_V      1e-9  /* differences below this are rounding, not signal: no edges from it */
#define ROUNDING_COUNT  1e-3  /* of an instant, in counts of the timer */
#define CROSSING_SHARE  1e-12 /* accuracy of an instant, within the step */
#define CROSSING_V      1e-11 /* or of the voltage, where that is so flat that rounding decides */
#define CROSSING_ROUNDS 60    /* enough for bisection alone */

/* A step of the filter: v_new = v + (before - v) gap + (after - before) late. */
typedef struct {
    double start_s, duration_s;
    double constants; /* duration in time constants */
    double gap, late;
} step_t;

/* Difference at a comparator within the step. Being linear in channels with the same RC, it is itself the
 * response of that RC to the difference of the inputs. */
typedef struct {
    double constants; /* 0: no filter */
    double start_V;
    double input_V, change_V; /* input at the start, and how far it moves during the step */
} response_t;

void probe_init(probe_t *probe, const plant_sensor_t *sensor, int legs, int sets)
{
    assert(legs % 3 == 0 && legs <= PLANT_LEGS && sets <= PLANT_SETS);
    *probe = (probe_t){
        .filter_s = sensor->filter_s,
        .capture_s = sensor->capture_s,
        .reference = sensor->comparator_reference,
        .blanking.length_s = sensor->capture_s > 0.0 ? sensor->comparator_blanking_s : 0.0,
        .threshold_V = fmax(0.5 * sensor->hysteresis_V, ROUNDING_V),
        .legs = legs,
        .sets = sets,
    };
    for (int n = 0; n < PLANT_LEGS + PLANT_SETS; n++) {
        probe->gain[n] = 1.0 + sensor->divider_error[n];
    }
    memcpy(probe->offset_V, sensor->comparator_offset_V, sizeof probe->offset_V);
}

void probe_start_period(probe_t *probe, double period_s)
{
    probe->edges = 0;
    probe->lost = 0;
    blanking_start_period(&probe->blanking, period_s);
}

double probe_voltage(const probe_t *probe, int channel)
{
    return probe->v_V[channel];
}

static step_t filter_step(const probe_t *probe, double start_s, double duration_s)
{
    step_t step = {.start_s = start_s, .duration_s = duration_s, .gap = 1.0, .late = 1.0};
    if (probe->filter_s > 0.0) {
        step.constants = duration_s / probe->filter_s;
        step.gap = -expm1(-step.constants);
        step.late = 1.0 - step.gap / step.constants;
    }
    return step;
}

static void filter(probe_t *probe, const step_t *step, int channel, double before_V, double after_V)
{
    double *v_V = &probe->v_V[channel];
    if (probe->filter_s > 0.0) {
        *v_V += (before_V - *v_V) * step->gap + (after_V - before_V) * step->late;
    } else {
        *v_V = after_V;
    }
}

static double reference_V(const probe_t *probe, int set, const double v_V[])
{
    const double *set_V = &v_V[3 * set];
    switch (probe->reference) {
    case PLANT_REFERENCE_HALF_LINK:
        return 0.5 * v_V[PROBE_LINK];
    case PLANT_REFERENCE_NEUTRAL:
        return probe->gain[PLANT_LEGS + set] * v_V[PLANT_LEGS + set];
    default:
        return (set_V[0] + set_V[1] + set_V[2]) / 3.0;
    }
}

/* At comparator k */
static double difference_V(const probe_t *probe, int k, const double v_V[])
{
    return probe->gain[k] * v_V[k] - reference_V(probe, k / 3, v_V) + probe->offset_V[k];
}

/* share: of the step, 0 to 1; the slope is that per step */
static double response_V(const response_t *response, double share, double *slope_V)
{
    double change_V = response->change_V;
    if (response->constants == 0.0) {
        *slope_V = change_V;
        return response->input_V + change_V * share;
    }
    double gap = -expm1(-response->constants * share);
    double behind_V = response->input_V - response->start_V;
    *slope_V = behind_V * response->constants * (1.0 - gap) + change_V * gap;
    return response->start_V + behind_V * gap + change_V * (share - gap / response->constants);
}

/* Where the response turns round, which it does once at most; 1 when it does not. */
static double turning_share(const response_t *response, double gap)
{
    double first_V = (response->input_V - response->start_V) * response->constants; /* slopes per step */
    double last_V = first_V + (response->change_V - first_V) * gap;
    if (first_V * last_V >= 0.0) {
        return 1.0;
    }
    return fmin(log1p(-first_V / response->change_V) / response->constants, 1.0);
}

/* Between shares a and b, on either side of the level: Newton's method, and bisection where that leads out.
 */
static double crossing_share(const response_t *response, double level_V, bool rising, double a, double b)
{
    double share = 0.5 * (a + b);
    double moved = 1.0;
    for (int n = 0; n < CROSSING_ROUNDS && moved > CROSSING_SHARE; n++) {
        double slope_V;
        double beyond_V = response_V(response, share, &slope_V) - level_V;
        if (fabs(beyond_V) < CROSSING_V) {
            break;
        }
        if ((beyond_V > 0.0) == rising) {
            b = share;
        } else {
            a = share;
        }
        double next = share - beyond_V / slope_V;
        next = next >= a && next <= b ? next : 0.5 * (a + b);
        moved = fabs(next - share);
        share = next;
    }
    return share;
}

/* Keeps the order of time among the comparators of one step. */
static void record(probe_t *probe, plant_capture_t edge)
{
    int n = probe->edges;
    if (n < PROBE_EDGES) {
        probe->edges++;
    } else {
        probe->lost++;
        n--;
        if (probe->edge[n].count <= edge.count) {
            return;
        }
    }
    for (; n > 0 && probe->edge[n - 1].count > edge.count; n--) {
        probe->edge[n] = probe->edge[n - 1];
    }
    probe->edge[n] = edge;
}

/* Comparator k goes high or low, at that instant to the timer. */
static void capture(probe_t *probe, int k, double at_s)
{
    double counts = at_s / probe->capture_s;
    record(probe, (plant_capture_t){.count = (uint32_t)fmin(counts + ROUNDING_COUNT, UINT32_MAX),
                                    .leg = (uint8_t)k,
                                    .rising = probe->high[k]});
    probe->shown[k] = probe->high[k];
}

/* The comparator has stayed as it is between two instants: where a window ends there the timer sees it. */
static void unblank(probe_t *probe, int k, double from_s, double to_s)
{
    if (probe->shown[k] != probe->high[k]) {
        double end_s = blanking_end_s(&probe->blanking, from_s, to_s);
        if (end_s <= to_s) {
            capture(probe, k, end_s);
        }
    }
}

/* Over a stretch of the step in which the response moves one way only. *seen_s: the comparator's last change,
 * or the start of the step. */
static void compare(probe_t *probe, int k, const step_t *step, const response_t *response, double from,
                    double from_V, double to, double to_V, double *seen_s)
{
    double sign = probe->high[k] ? -1.0 : 1.0;
    double threshold_V = probe->threshold_V;
    if (sign * to_V <= threshold_V) {
        return;
    }
    double share = from;
    if (sign * from_V < threshold_V) {
        share = crossing_share(response, sign * threshold_V, !probe->high[k], from, to);
    }
    double at_s = step->start_s + share * step->duration_s;
    unblank(probe, k, *seen_s, at_s);
    *seen_s = at_s;
    probe->high[k] = !probe->high[k];
    if (probe->high[k] != probe->shown[k] && !blanking_holds(&probe->blanking, at_s)) {
        capture(probe, k, at_s);
    }
}

static void watch(probe_t *probe, int k, const step_t *step, const response_t *response)
{
    double end_V = difference_V(probe, k, probe->v_V);
    double start_V = response->start_V;
    double seen_s = step->start_s;
    compare(probe, k, step, response, 0.0, start_V, 0.0, start_V, &seen_s); /* a jump ahead of the step */
    double turn = turning_share(response, step->gap);
    if (turn < 1.0) {
        double slope_V;
        double turn_V = response_V(response, turn, &slope_V);
        compare(probe, k, step, response, 0.0, start_V, turn, turn_V, &seen_s);
        compare(probe, k, step, response, turn, turn_V, 1.0, end_V, &seen_s);
    } else {
        compare(probe, k, step, response, 0.0, start_V, 1.0, end_V, &seen_s);
    }
    unblank(probe, k, seen_s, step->start_s + step->duration_s);
}

void probe_advance(probe_t *probe, double start_s, double duration_s, const double before_V[],
                   const double after_V[])
{
    assert(start_s >= 0.0 && duration_s >= 0.0);
    if (duration_s == 0.0) {
        return;
    }
    step_t step = filter_step(probe, start_s, duration_s);
    double was_V[PROBE_CHANNELS];
    memcpy(was_V, probe->filter_s > 0.0 ? probe->v_V : before_V, sizeof was_V);
    for (int k = 0; k < probe->legs; k++) {
        filter(probe, &step, k, before_V[k], after_V[k]);
    }
    for (int set = 0; set < probe->sets; set++) {
        int channel = PLANT_LEGS + set;
        filter(probe, &step, channel, before_V[channel], after_V[channel]);
    }
    filter(probe, &step, PROBE_LINK, before_V[PROBE_LINK], after_V[PROBE_LINK]);
    for (int k = 0; probe->capture_s > 0.0 && k < probe->legs; k++) {
        double input_V = difference_V(probe, k, before_V);
        response_t response = {.constants = step.constants,
                               .start_V = difference_V(probe, k, was_V),
                               .input_V = input_V,
                               .change_V = difference_V(probe, k, after_V) - input_V};
        watch(probe, k, &step, &response);
    }
    blanking_pass(&probe->blanking, start_s + duration_s);
}
