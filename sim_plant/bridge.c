#include "sim_plant/bridge.h"

#include <math.h>
#include <string.h>

/* Margins against rounding: what counts as no current, and how far beyond a diode's threshold a floating
 * terminal must be, so that a diode never stops and starts for the same instant. */
#define NO_CURRENT     1e-9 /* of the converter's full scale */
#define START_MARGIN_V 1e-6 /* V */

#define ZONE          (1.0 / 2000.0)
#define R_THROUGH_OHM 1e-3 /* least resistance of a switch that shorts the link */

/* Bytes of bridge_t.kinds */
enum { UPPER, BY_HIGH_DIODE, BY_LOW_DIODE, SWINGS, FLOATS, SHORTS, GIVEN };
#define KIND(byte) ((uint64_t)1 << (8 * (byte)))
#define ALL(byte)  ((uint64_t)63 << (8 * (byte)))

const bridge_kind_t bridge_kinds[] = {
    [LEG_FLOATING] = {.kinds = KIND(FLOATS)},
    [LEG_SWINGING] = {.kinds = KIND(SWINGS)},
    [LEG_LOW] = {.rail = GATE_LOW, .switched = 1.0},
    [LEG_HIGH] = {.kinds = KIND(UPPER), .rail = GATE_HIGH, .switched = 1.0, .upper = 1.0},
    [LEG_BOTH] = {.kinds = KIND(SHORTS), .upper = 0.5},
    [LEG_DIODE_LOW] = {.kinds = KIND(BY_LOW_DIODE), .rail = GATE_LOW, .diode = -1.0},
    [LEG_DIODE_HIGH] = {.kinds = KIND(UPPER) | KIND(BY_HIGH_DIODE),
                        .rail = GATE_HIGH,
                        .upper = 1.0,
                        .diode = 1.0},
    [LEG_SOURCE] = {.kinds = KIND(GIVEN)},
};

static unsigned legs_of(const bridge_t *b, int kind)
{
    return (uint8_t)(b->kinds >> (8 * kind));
}

static void count(bridge_t *b)
{
    b->kinds = 0u;
    for (int k = 0; k < b->legs; k++) {
        const bridge_kind_t *is = &bridge_kinds[b->leg[k]];
        b->kinds |= is->kinds << k;
        b->inv_zone_1_A[k] = is->switched * b->switched_1_A;
        b->upper[k] = is->upper;
    }
    b->summed = ~b->kinds; /* nothing is */
}

void bridge_init(bridge_t *bridge, const plant_config_t *config, int legs)
{
    *bridge = (bridge_t){
        .v_switch_V = config->inverter.v_switch_V,
        .v_diode_V = config->inverter.v_diode_V,
        .r_on_ohm = config->inverter.r_on_ohm,
        .c_leg_F = config->inverter.c_leg_F,
        .inv_c_leg_1_F = config->inverter.c_leg_F > 0.0 ? 1.0 / config->inverter.c_leg_F : 0.0,
        .g_winding_S = config->winding.r_winding_ohm > 0.0 ? 1.0 / config->winding.r_winding_ohm : 0.0,
        .zone_A = ZONE * config->sensor.i_full_scale_A,
        .no_current_A = NO_CURRENT * config->sensor.i_full_scale_A,
        .switched_1_A = 1.0 / (ZONE * config->sensor.i_full_scale_A),
        .legs = legs,
    };
    for (int k = 0; k < legs; k++) {
        bridge->leg[k] = bridge->c_leg_F > 0.0 ? LEG_SWINGING : LEG_FLOATING;
    }
    count(bridge);
}

/* Voltages that the legs have whatever the currents, by coordinate; only where all are tied or swing. Those
 * of a machine whose phases are alike, who alone asks for them. */
enum { OF_ALIKE = 4 };

static void sum_rail(bridge_t *b, const winding_t *w)
{
    unsigned upper = legs_of(b, UPPER);
    const double *first = w->side[0][upper & 7u], *second = w->side[1][upper >> 3];
    double rail[OF_ALIKE];
    for (int a = 0; a < OF_ALIKE; a++) {
        rail[a] = b->legs > 3 ? first[a] + second[a] : first[a];
    }
    memcpy(b->rail, rail, sizeof rail);
}

static void sum_diodes(bridge_t *b, const winding_t *w)
{
    unsigned high = legs_of(b, BY_HIGH_DIODE), low = legs_of(b, BY_LOW_DIODE);
    const double *high_1[] = {w->side[0][high & 7u], w->side[1][high >> 3]};
    const double *low_1[] = {w->side[0][low & 7u], w->side[1][low >> 3]};
    double diode_V[OF_ALIKE];
    for (int a = 0; a < OF_ALIKE; a++) {
        double first = high_1[0][a] - low_1[0][a];
        diode_V[a] = b->v_diode_V * (b->legs > 3 ? first + (high_1[1][a] - low_1[1][a]) : first);
    }
    memcpy(b->diode_V, diode_V, sizeof diode_V);
}

static void sum_sources(bridge_t *b, const winding_t *w)
{
    for (int a = 0; a < w->active; a++) {
        b->source_V[a] = 0.0;
        for (int k = 0; k < b->legs; k++) {
            b->source_V[a] += b->leg[k] == LEG_SOURCE ? w->share[k][a] * b->v_source_V[k] : 0.0;
        }
    }
}

/* What few circuits have; by itself, as bridge_sum() is called at every edge. */
static __attribute__((noinline)) void sum_rare(bridge_t *b, const winding_t *w)
{
    bool sources = legs_of(b, GIVEN) != 0u;
    b->both = legs_of(b, SHORTS);
    b->g_through_S = 0.5 * __builtin_popcount(b->both) / fmax(b->r_on_ohm, R_THROUGH_OHM);
    b->r_series_ohm = sources ? 0.0 : (w->legs > w->phases ? 2.0 : 1.0) * b->r_on_ohm;
    if (sources || b->sources) {
        sum_sources(b, w);
    }
    b->sources = sources;
}

void bridge_sum(bridge_t *b, const winding_t *w)
{
    uint64_t moved = b->kinds ^ b->summed;
    b->summed = b->kinds;
    b->floating = legs_of(b, FLOATS);
    b->swinging = legs_of(b, SWINGS);
    b->diodes = legs_of(b, BY_HIGH_DIODE) | legs_of(b, BY_LOW_DIODE);
    if ((moved & ALL(UPPER)) != 0u) {
        sum_rail(b, w);
    }
    if ((moved & (ALL(BY_HIGH_DIODE) | ALL(BY_LOW_DIODE))) != 0u && b->v_diode_V != 0.0) {
        sum_diodes(b, w);
    }
    if ((moved & (ALL(SHORTS) | ALL(GIVEN))) != 0u || b->sources) {
        sum_rare(b, w);
    }
}

void bridge_summarise(bridge_t *b, const winding_t *w)
{
    count(b);
    bridge_sum(b, w);
}

leg_t bridge_released(const bridge_t *bridge, int k, double i_A)
{
    if (fabs(i_A) <= bridge->no_current_A) {
        return bridge_output_F(bridge, k) > 0.0 ? LEG_SWINGING : LEG_FLOATING;
    }
    return i_A > 0.0 ? LEG_DIODE_LOW : LEG_DIODE_HIGH;
}

leg_t bridge_commutated(const bridge_t *bridge, int k, gate_t gate, double i_A)
{
    leg_t leg = bridge->leg[k];
    if (bridge->off_wire[k]) {
        return LEG_FLOATING;
    }
    if (gate != GATE_OFF) {
        return gate == GATE_BOTH ? LEG_BOTH : (gate == GATE_HIGH ? LEG_HIGH : LEG_LOW);
    }
    if (leg != LEG_LOW && leg != LEG_HIGH && leg != LEG_BOTH) {
        return leg;
    }
    leg_t diode = bridge_released(bridge, k, i_A);
    bool same_rail =
        (leg == LEG_LOW && diode == LEG_DIODE_LOW) || (leg == LEG_HIGH && diode == LEG_DIODE_HIGH);
    return bridge_output_F(bridge, k) == 0.0 || same_rail ? diode : LEG_SWINGING;
}

double bridge_beyond_V(const bridge_t *bridge, double v_dc_V, double v_leg_V)
{
    return fabs(v_leg_V - 0.5 * v_dc_V) - 0.5 * v_dc_V - bridge->v_diode_V - START_MARGIN_V;
}
