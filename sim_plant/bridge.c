#include "sim_plant/bridge.h"

#include <math.h>
#include <string.h>

/* Margins against rounding: what counts as no current, and how far beyond a diode's threshold a floating
 * terminal must be, so that a diode never stops and starts for the same instant. */
#define NO_CURRENT     1e-9 /* of the converter's full scale */
#define START_MARGIN_V 1e-6 /* V */

#define ZONE          (1.0 / 2000.0)
#define R_THROUGH_OHM 1e-3 /* least resistance of a switch that shorts the link */

void bridge_init(bridge_t *bridge, const plant_config_t *config, int legs)
{
    *bridge = (bridge_t){
        .v_switch_V = config->inverter.v_switch_V,
        .v_diode_V = config->inverter.v_diode_V,
        .r_on_ohm = config->inverter.r_on_ohm,
        .c_leg_F = config->inverter.c_leg_F,
        .inv_c_leg_1_F = config->inverter.c_leg_F > 0.0 ? 1.0 / config->inverter.c_leg_F : 0.0,
        .zone_A = ZONE * config->sensor.i_full_scale_A,
        .switched_1_A = 1.0 / (ZONE * config->sensor.i_full_scale_A),
        .legs = legs,
    };
    for (int k = 0; k < legs; k++) {
        bridge->leg[k] = bridge->c_leg_F > 0.0 ? LEG_SWINGING : LEG_FLOATING;
    }
}

/* What each kind of leg is */
typedef struct {
    unsigned counts; /* 4 bits each: floating, swinging, diode, both, source */
    unsigned masks;  /* a byte each: tied to the upper rail; by a diode to it, and to the lower one; swings */
    double upper;
    double switched;
} facts_t;

static const facts_t facts[] = {
    [LEG_FLOATING] = {.counts = 0x1},
    [LEG_SWINGING] = {.counts = 0x10, .masks = 0x1000000},
    [LEG_LOW] = {.switched = 1.0},
    [LEG_HIGH] = {.switched = 1.0, .masks = 0x1, .upper = 1.0},
    [LEG_BOTH] = {.counts = 0x1000, .upper = 0.5},
    [LEG_DIODE_LOW] = {.counts = 0x100, .masks = 0x10000},
    [LEG_DIODE_HIGH] = {.counts = 0x100, .masks = 0x101, .upper = 1.0},
    [LEG_SOURCE] = {.counts = 0x10000},
};

/* Voltages that the legs have whatever the currents, by coordinate; only where all are tied or swing. Of a
 * single star the other side adds nothing. */
static void sum_rails(bridge_t *b, const winding_t *w)
{
    const double *upper = w->side[0][b->masks[0] & 7u];
    const double *other = w->side[1][b->masks[1] & 7u];
    double rail[ACTIVE];
    for (int a = 0; a < ACTIVE; a++) {
        rail[a] = upper[a] + other[a];
    }
    memcpy(b->rail, rail, sizeof rail);
}

static void sum_diodes(bridge_t *b, const winding_t *w)
{
    double diode_V[ACTIVE] = {0.0};
    for (int side = 0; side < b->legs / 3; side++) {
        const double *high = w->side[side][b->masks[side] >> 8 & 7u];
        const double *low = w->side[side][b->masks[side] >> 16 & 7u];
        for (int a = 0; a < ACTIVE; a++) {
            diode_V[a] += b->v_diode_V * (high[a] - low[a]);
        }
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

void bridge_summarise(bridge_t *b, const winding_t *w)
{
    unsigned counts = 0u, masks[PLANT_SETS] = {0u};
    for (int side = 0; side < b->legs / 3; side++) {
        for (int n = 0; n < 3; n++) {
            const facts_t *is = &facts[b->leg[3 * side + n]];
            counts += is->counts;
            masks[side] |= is->masks << n;
            b->inv_zone_1_A[3 * side + n] = is->switched * b->switched_1_A;
            b->upper[3 * side + n] = is->upper;
        }
    }
    b->floating = (int)(counts & 15u);
    b->swinging = (int)(counts >> 4 & 15u);
    b->diodes = (int)(counts >> 8 & 15u);
    b->both = (int)(counts >> 12 & 15u);
    bool sources = counts >> 16 > 0u;
    b->g_through_S = b->both > 0 ? 0.5 * b->both / fmax(b->r_on_ohm, R_THROUGH_OHM) : 0.0;
    b->r_series_ohm = sources ? 0.0 : (w->legs > w->phases ? 2.0 : 1.0) * b->r_on_ohm;
    memcpy(b->masks, masks, sizeof masks);
    b->diode_legs = ((masks[0] >> 8 | masks[0] >> 16) & 7u) | ((masks[1] >> 8 | masks[1] >> 16) & 7u) << 3;
    b->swinging_legs = (masks[0] >> 24) | (masks[1] >> 24) << 3;
    sum_rails(b, w);
    if (b->v_diode_V != 0.0) {
        sum_diodes(b, w);
    }
    if (sources || b->sources) {
        sum_sources(b, w);
    }
    b->sources = sources;
}

static double no_current_A(const bridge_t *bridge)
{
    return NO_CURRENT / ZONE * bridge->zone_A;
}

leg_t bridge_released(const bridge_t *bridge, double i_A)
{
    if (fabs(i_A) <= no_current_A(bridge)) {
        return bridge->c_leg_F > 0.0 ? LEG_SWINGING : LEG_FLOATING;
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
    leg_t diode = bridge_released(bridge, i_A);
    bool same_rail =
        (leg == LEG_LOW && diode == LEG_DIODE_LOW) || (leg == LEG_HIGH && diode == LEG_DIODE_HIGH);
    return bridge->c_leg_F == 0.0 || same_rail ? diode : LEG_SWINGING;
}

double bridge_reverse(const bridge_t *bridge, int k, double i_A)
{
    double reverse_A = bridge->leg[k] == LEG_DIODE_LOW ? -i_A : i_A;
    return reverse_A * ZONE * bridge->switched_1_A - NO_CURRENT;
}

double bridge_beyond_V(const bridge_t *bridge, double v_dc_V, double v_leg_V)
{
    return fabs(v_leg_V - 0.5 * v_dc_V) - 0.5 * v_dc_V - bridge->v_diode_V - START_MARGIN_V;
}
