#include "sim_plant/bridge.h"

#include <math.h>

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
static const struct {
    int floating, swinging, diode, both, source;
    bool low_diode, high_diode;
    double upper; /* tied to the upper rail */
    double switched;
} facts[] = {
    [LEG_FLOATING] = {.floating = 1},
    [LEG_SWINGING] = {.swinging = 1},
    [LEG_LOW] = {.switched = 1.0},
    [LEG_HIGH] = {.switched = 1.0, .upper = 1.0},
    [LEG_BOTH] = {.both = 1, .upper = 0.5},
    [LEG_DIODE_LOW] = {.diode = 1, .low_diode = true},
    [LEG_DIODE_HIGH] = {.diode = 1, .high_diode = true, .upper = 1.0},
    [LEG_SOURCE] = {.source = 1},
};

/* Voltages that the legs have whatever the currents, by coordinate; only where all are tied or swing. */
static void sum_rails(bridge_t *b, const winding_t *w, int sources)
{
    for (int a = 0; a < w->active; a++) {
        b->rail[a] = 0.0;
        b->source_V[a] = 0.0;
        b->diode_V[a] = 0.0;
    }
    for (int side = 0; side < b->legs / 3; side++) {
        unsigned upper = 0u, high = 0u, low = 0u;
        for (int n = 0; n < 3; n++) {
            leg_t leg = b->leg[3 * side + n];
            upper |= (unsigned)(facts[leg].upper == 1.0) << n;
            high |= (unsigned)facts[leg].high_diode << n;
            low |= (unsigned)facts[leg].low_diode << n;
        }
        for (int a = 0; a < w->active; a++) {
            b->rail[a] += w->side[side][upper][a];
            b->diode_V[a] += b->v_diode_V * (w->side[side][high][a] - w->side[side][low][a]);
        }
    }
    for (int k = 0; k < b->legs && sources > 0; k++) {
        for (int a = 0; a < w->active && b->leg[k] == LEG_SOURCE; a++) {
            b->source_V[a] += w->share[k][a] * b->v_source_V[k];
        }
    }
}

void bridge_summarise(bridge_t *b, const winding_t *w)
{
    int sources = 0;
    b->floating = 0;
    b->swinging = 0;
    b->diodes = 0;
    b->both = 0;
    for (int k = 0; k < b->legs; k++) {
        leg_t leg = b->leg[k];
        b->floating += facts[leg].floating;
        b->swinging += facts[leg].swinging;
        b->diodes += facts[leg].diode;
        b->both += facts[leg].both;
        sources += facts[leg].source;
        b->inv_zone_1_A[k] = facts[leg].switched * b->switched_1_A;
        b->upper[k] = facts[leg].upper;
    }
    b->g_through_S = b->both > 0 ? 0.5 * b->both / fmax(b->r_on_ohm, R_THROUGH_OHM) : 0.0;
    b->r_series_ohm = sources > 0 ? 0.0 : (w->legs > w->phases ? 2.0 : 1.0) * b->r_on_ohm;
    if (b->floating == 0 && b->both == 0) {
        sum_rails(b, w, sources);
    }
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
