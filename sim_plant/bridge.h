/* The legs: which rail each motor terminal is tied to, and through what (METHODS.md 0.2 E6, E7, E10; rows 57
 * to 59).
 *
 * A leg is tied to a rail by a closed switch (either direction of current, drop v_switch against it), or by
 * a diode (one direction, drop v_diode); all paths have r_on in series. With neither it floats: without
 * output capacitance it has no current, and its terminal takes the voltage that keeps it so (floating.h);
 * with capacitance its current charges that, and the terminal swings until a diode catches it. A leg may also
 * be a given voltage source. A terminal that has come off its leg has no diodes either.
 *
 * A switch drop reverses over +-zone_A with continuous slope instead of jumping, so that a current
 * creeping through zero under a closed switch makes no train of events. zone_A is a 2000th of the
 * converter's full scale, the step of 12 bits.
 *
 * The legs of a short have no output capacitance: with the 1 uH of the short it would ring at 10 MHz, hardly
 * damped, and that only shortens the integrator's steps. Tests: bridge_test.cpp, shorts: fault_test.cpp. */
#ifndef PLANT_BRIDGE_H
#define PLANT_BRIDGE_H

#include "sim_plant/gates.h"
#include "sim_plant/winding.h"

typedef enum {
    LEG_FLOATING,
    LEG_SWINGING, /* floating, with output capacitance */
    LEG_LOW,
    LEG_HIGH,
    LEG_BOTH,
    LEG_DIODE_LOW,
    LEG_DIODE_HIGH,
    LEG_SOURCE
} leg_t;

typedef struct {
    double v_switch_V;
    double v_diode_V;
    double r_on_ohm;
    double c_leg_F, inv_c_leg_1_F;
    double g_winding_S; /* of the resistors across the windings */
    double zone_A;
    double switched_1_A; /* 1 / zone_A */
    double no_current_A; /* what counts as none */
    int legs;
    leg_t leg[PLANT_LEGS];
    bool off_wire[PLANT_LEGS];
    unsigned bare; /* legs without output capacitance, bit k for leg k: those of a short */
    double v_source_V[PLANT_LEGS];
    /* what follows from leg[] */
    uint64_t kinds;                            /* a byte for each, of which bit k is leg k; see bridge.c */
    uint64_t summed;                           /* those that the following stand for */
    unsigned floating, swinging, diodes, both; /* legs, bit k for leg k */
    bool sources;
    double rail[ACTIVE];             /* by active coordinate: share of the upper rail, */
    double source_V[ACTIVE];         /* of given sources */
    double diode_V[ACTIVE];          /* and of diode drops, with their sign */
    double r_series_ohm;             /* of every phase: r_on of its legs, or none with sources */
    double upper[PLANT_LEGS];        /* 1: tied to the upper rail */
    double inv_zone_1_A[PLANT_LEGS]; /* 0: no switch closed */
    double g_through_S;              /* of legs with both switches closed */
} bridge_t;

/* What each kind of leg is */
typedef struct {
    uint64_t kinds; /* of leg 0, as in bridge_t */
    gate_t rail;    /* whose switch or diode conducts alone, if one does */
    double upper;
    double switched; /* 1: by a switch */
    double diode;    /* drop of its diode beyond the rail, in units of v_diode */
} bridge_kind_t;

extern const bridge_kind_t bridge_kinds[];

void bridge_init(bridge_t *bridge, const plant_config_t *config, int legs);

/* Brings up to date what follows from leg[]. */
void bridge_summarise(bridge_t *bridge, const winding_t *winding);

/* The same for those who change legs by bridge_put() alone: once after some of these. */
void bridge_sum(bridge_t *bridge, const winding_t *winding);
static inline void bridge_put(bridge_t *b, int k, leg_t leg)
{
    const bridge_kind_t *was = &bridge_kinds[b->leg[k]], *is = &bridge_kinds[leg];
    b->leg[k] = leg;
    b->kinds ^= (was->kinds ^ is->kinds) << k;
    b->inv_zone_1_A[k] = is->switched * b->switched_1_A;
    b->upper[k] = is->upper;
}

/* Leg k after a change of its gate; i_A is its current. */
leg_t bridge_commutated(const bridge_t *bridge, int k, gate_t gate, double i_A);

/* Leg k without gate anew after a jump of its current. */
leg_t bridge_released(const bridge_t *bridge, int k, double i_A);

/* How far a terminal is beyond the nearer diode's threshold, V. */
double bridge_beyond_V(const bridge_t *bridge, double v_dc_V, double v_leg_V);

/* Output capacitance of leg k; without it the leg floats where it would swing. */
static inline double bridge_output_F(const bridge_t *bridge, int k)
{
    return (bridge->bare >> k & 1u) != 0u ? 0.0 : bridge->c_leg_F;
}

/* Of a set of legs, which is not empty, the first. */
static inline int bridge_first(unsigned legs)
{
    return __builtin_ctz(legs);
}

static inline bool bridge_is_diode(const bridge_t *bridge, int k)
{
    return bridge->leg[k] == LEG_DIODE_LOW || bridge->leg[k] == LEG_DIODE_HIGH;
}

/* Drop of a closed switch at a current x in units of the zone, in units of v_switch. */
static inline double bridge_switch_share(double x)
{
    x = x > 1.0 ? 1.0 : x;
    x = x < -1.0 ? -1.0 : x;
    return x * (1.5 - 0.5 * x * x);
}

/* Reverse current of a diode leg beyond what counts as none, A; above zero: it stops. */
static inline double bridge_reverse_A(const bridge_t *bridge, int k, double i_A)
{
    return (bridge->leg[k] == LEG_DIODE_LOW ? -i_A : i_A) - bridge->no_current_A;
}

/* Voltage of a leg that is tied to something, against the negative rail. */
static inline double bridge_tied_V(const bridge_t *b, int k, double i_A, double v_dc_V)
{
    if (b->leg[k] == LEG_SOURCE) {
        return b->v_source_V[k];
    }
    double r_ohm = b->leg[k] == LEG_BOTH ? 0.5 * b->r_on_ohm : b->r_on_ohm;
    double drop_V = r_ohm * i_A + b->v_switch_V * bridge_switch_share(i_A * b->inv_zone_1_A[k]);
    if (bridge_is_diode(b, k)) {
        drop_V += b->leg[k] == LEG_DIODE_LOW ? b->v_diode_V : -b->v_diode_V;
    }
    return b->upper[k] * v_dc_V - drop_V;
}

#endif
