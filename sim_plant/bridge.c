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
    int floating, swinging, diode;
    double upper;      /* tied to the upper rail */
    double diode_drop; /* in units of v_diode, as it adds to the terminal's voltage */
    double switched, both, source;
} facts[] = {
    [LEG_FLOATING] = {.floating = 1},
    [LEG_SWINGING] = {.swinging = 1},
    [LEG_LOW] = {.switched = 1.0},
    [LEG_HIGH] = {.switched = 1.0, .upper = 1.0},
    [LEG_BOTH] = {.both = 1.0, .upper = 0.5},
    [LEG_DIODE_LOW] = {.diode = 1, .diode_drop = -1.0},
    [LEG_DIODE_HIGH] = {.diode = 1, .diode_drop = 1.0, .upper = 1.0},
    [LEG_SOURCE] = {.source = 1.0},
};

/* The usual three-phase star, which is all that many runs have */
static void summarise_star(bridge_t *b)
{
    abc_t upper, diode_V, source_V;
    for (int k = 0; k < 3; k++) {
        upper.x[k] = b->upper[k];
        diode_V.x[k] = facts[b->leg[k]].diode_drop * b->v_diode_V;
        source_V.x[k] = facts[b->leg[k]].source * b->v_source_V[k];
    }
    ab_t rail = frame_from_abc(upper);
    ab_t diode = frame_from_abc(diode_V);
    ab_t source = frame_from_abc(source_V);
    b->rail[0] = rail.alpha;
    b->rail[1] = rail.beta;
    b->diode_V[0] = diode.alpha;
    b->diode_V[1] = diode.beta;
    b->source_V[0] = source.alpha;
    b->source_V[1] = source.beta;
}

void bridge_summarise(bridge_t *b, const winding_t *winding)
{
    double both = 0.0;
    b->floating = 0;
    b->swinging = 0;
    b->diodes = 0;
    b->r_series_ohm = b->leg[0] == LEG_SOURCE ? 0.0 : b->r_on_ohm;
    for (int k = 0; k < b->legs; k++) {
        leg_t leg = b->leg[k];
        b->floating += facts[leg].floating;
        b->swinging += facts[leg].swinging;
        b->diodes += facts[leg].diode;
        b->inv_zone_1_A[k] = facts[leg].switched * b->switched_1_A;
        b->upper[k] = facts[leg].upper;
        both += facts[leg].both;
    }
    b->g_through_S = both > 0.0 ? 0.5 * both / fmax(b->r_on_ohm, R_THROUGH_OHM) : 0.0;
    if (winding->active == 2) {
        summarise_star(b);
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
