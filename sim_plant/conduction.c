/* Which switch or diode of each leg conducts. */
#include "sim_plant/circuit_rates.h"
#include "sim_plant/floating.h"

#include <math.h>

#define SLOPE_MARGIN  4.0   /* of v_dc / L of a leg against the others: EMF, saturation */
#define SMALL_CURRENT 1e-12 /* of the converter's full scale: nothing, for a floating leg */

/* The output capacitance of leg k, which has become another kind, from that voltage on. What it holds more or
 * less afterwards has come from the link if the upper rail has it now, and the rest is lost in the switch. */
static void charge_output(circuit_t *c, int k, double before_V)
{
    const bridge_t *b = &c->bridge;
    if (b->leg[k] == LEG_SWINGING) {
        c->now.x[V_LEG(k)] = before_V;
        return;
    }
    double after_V = circuit_output_V(c, k);
    double charge_C = b->upper[k] == 1.0 ? b->c_leg_F * (after_V - before_V) : 0.0;
    double in_J = charge_C * c->now.x[V_DC];
    c->jump_in_J += in_J;
    c->jump_device_J += in_J + circuit_capacitor_J(c, k, before_V) - circuit_capacitor_J(c, k, after_V);
    c->now.x[V_DC] -= charge_C * c->link.inv_C_1_F;
}

/* Leg k becomes another kind. */
static void set_leg(circuit_t *c, int k, leg_t leg)
{
    bridge_t *b = &c->bridge;
    double before_V = circuit_output_V(c, k);
    if (bridge_kinds[leg].rail == GATE_LOW && bridge_kinds[b->leg[k]].rail != GATE_LOW) {
        c->low_since_s[k] = c->t_s;
    }
    bridge_put(b, k, leg);
    if (bridge_output_F(b, k) > 0.0) {
        charge_output(c, k, before_V);
    }
}

/* Diodes of one rail alone, one or several, have no path back, so they carry nothing. Output capacitances are
 * one. */
static void drop_lone_diodes(circuit_t *c)
{
    bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    int size = w->legs > w->phases ? 2 : 3;
    int stride = w->legs > w->phases ? 3 : 1;
    for (int group = 0; group < w->legs / size; group++) {
        int first = w->legs > w->phases ? group : 3 * group;
        int conducting = 0;
        int low = 0;
        int high = 0;
        for (int n = 0; n < size; n++) {
            leg_t leg = b->leg[first + n * stride];
            conducting += leg != LEG_FLOATING;
            low += leg == LEG_DIODE_LOW;
            high += leg == LEG_DIODE_HIGH;
        }
        for (int n = 0; n < size && (conducting == low || conducting == high); n++) {
            bridge_put(b, first + n * stride, LEG_FLOATING);
        }
    }
    bridge_sum(b, w);
}

void circuit_summarise(circuit_t *c)
{
    const bridge_t *b = &c->bridge;
    bridge_sum(&c->bridge, &c->machine.winding);
    if (b->diodes != 0u && b->floating != 0u && b->c_leg_F == 0.0 && c->machine.winding.branch < 0) {
        drop_lone_diodes(c);
    }
}

void circuit_switch(circuit_t *c, const gates_t *gates, unsigned legs)
{
    for (legs &= (1u << c->bridge.legs) - 1u; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        leg_t leg =
            bridge_commutated(&c->bridge, k, gates_conducting(gates, k), circuit_leg_A(c, &c->now, k));
        if (leg != c->bridge.leg[k]) {
            set_leg(c, k, leg);
        }
    }
    circuit_summarise(c);
    c->in_blocks = gates->in_blocks;
}

/* Whether leg k stays at the rail that it is at with that gate, as more than a least current can flow through
 * the diode there. */
static bool keeps_rail(const circuit_t *c, int k, gate_t gate, double least_A)
{
    gate_t rail = bridge_kinds[c->bridge.leg[k]].rail;
    if (rail == GATE_OFF || (gate != GATE_OFF && gate != rail)) {
        return false;
    }
    double i_A = circuit_leg_A(c, &c->now, k);
    return rail == GATE_LOW ? i_A >= least_A : i_A <= -least_A;
}

/* Whether all legs of the mask do, for that long. */
static bool keep_rails(const circuit_t *c, const gates_t *gates, unsigned legs, double within_s)
{
    double slope_A_s = SLOPE_MARGIN * c->machine.gamma_leg_1_H * fabs(c->now.x[V_DC]);
    double least_A = 2.0 * c->bridge.zone_A + slope_A_s * within_s;
    for (; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        if (!keeps_rail(c, k, gates_conducting(gates, k), least_A)) {
            return false;
        }
    }
    return true;
}

bool circuit_hand_over(circuit_t *c, const gates_t *gates, unsigned legs, double within_s)
{
    if (!keep_rails(c, gates, legs, within_s)) {
        return false;
    }
    for (; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        bool low = bridge_kinds[c->bridge.leg[k]].rail == GATE_LOW;
        if (gates_conducting(gates, k) == GATE_OFF) {
            set_leg(c, k, low ? LEG_DIODE_LOW : LEG_DIODE_HIGH);
        } else {
            set_leg(c, k, low ? LEG_LOW : LEG_HIGH);
        }
    }
    bridge_sum(&c->bridge, &c->machine.winding);
    return true;
}

void circuit_sources(circuit_t *c, const double v_leg_V[])
{
    for (int k = 0; k < c->bridge.legs; k++) {
        if (!c->bridge.off_wire[k]) {
            bridge_put(&c->bridge, k, LEG_SOURCE);
        }
        c->bridge.v_source_V[k] = v_leg_V[k];
    }
    circuit_summarise(c);
}

/* Moves the windings onto zero current of the floating legs. */
void circuit_project(circuit_t *c)
{
    machine_state_t state = circuit_machine_state(&c->now);
    machine_point_t point;
    floating_project(&c->bridge, &c->machine, SMALL_CURRENT / c->inv_i_scale_1_A, &state, &point);
    circuit_take_state(c, &state, &point);
}

static void stop_diodes(circuit_t *c)
{
    bool stopped = false;
    for (unsigned legs = c->bridge.diodes; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        if (bridge_reverse_A(&c->bridge, k, circuit_leg_A(c, &c->now, k)) > 0.0) {
            set_leg(c, k, bridge_output_F(&c->bridge, k) > 0.0 ? LEG_SWINGING : LEG_FLOATING);
            stopped = true;
        }
    }
    if (stopped) {
        circuit_summarise(c);
    }
}

/* Swinging terminals that have arrived at a diode. */
static void catch_swinging(circuit_t *c)
{
    bool caught = false;
    for (unsigned legs = c->bridge.swinging; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        if (circuit_swing_excess(c, &c->now, k) > 0.0) {
            bool up = c->now.x[V_LEG(k)] > 0.5 * c->now.x[V_DC];
            set_leg(c, k, up ? LEG_DIODE_HIGH : LEG_DIODE_LOW);
            caught = true;
        }
    }
    if (caught) {
        circuit_summarise(c);
    }
}

/* The floating leg furthest beyond a diode's threshold starts to conduct; true when there was one. */
static bool start_diode(circuit_t *c)
{
    double v_leg_V[PLANT_LEGS];
    circuit_terminals(c, &c->now, v_leg_V);
    int first = -1;
    double most_V = 0.0;
    for (int k = 0; k < c->bridge.legs; k++) {
        if (c->bridge.leg[k] == LEG_FLOATING && !c->bridge.off_wire[k]) {
            double beyond_V = bridge_beyond_V(&c->bridge, c->now.x[V_DC], v_leg_V[k]);
            first = beyond_V > most_V ? k : first;
            most_V = fmax(beyond_V, most_V);
        }
    }
    if (first >= 0) {
        set_leg(c, first, v_leg_V[first] > 0.5 * c->now.x[V_DC] ? LEG_DIODE_HIGH : LEG_DIODE_LOW);
        bridge_sum(&c->bridge, &c->machine.winding);
    }
    return first >= 0;
}

void circuit_settle_legs(circuit_t *c)
{
    if (c->bridge.diodes != 0u) {
        stop_diodes(c);
    }
    if (c->bridge.swinging != 0u) {
        catch_swinging(c);
    }
    if (c->bridge.floating != 0u) {
        if (circuit_two_phase(c)) {
            circuit_settle_two_phase(c, SMALL_CURRENT / c->inv_i_scale_1_A);
        } else {
            circuit_project(c);
        }
        for (int n = 0; n < PLANT_LEGS && start_diode(c); n++) {
        }
    }
}

/* After a jump of the currents: the diodes that they now flow through. */
void circuit_reassign_diodes(circuit_t *c)
{
    for (int k = 0; k < c->bridge.legs; k++) {
        if (bridge_is_diode(&c->bridge, k)) {
            set_leg(c, k, bridge_released(&c->bridge, k, circuit_leg_A(c, &c->now, k)));
        }
    }
    circuit_summarise(c);
    circuit_settle(c);
}
