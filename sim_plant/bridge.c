#include "sim_plant/bridge.h"

#include <math.h>

/* Margins against rounding: what counts as no current, and how far beyond a diode's threshold a floating
 * terminal must be, so that a diode never stops and starts for the same instant. */
#define NO_CURRENT     1e-9 /* of the converter's full scale */
#define START_MARGIN_V 1e-6 /* V */

#define ZONE (1.0 / 2000.0)

void bridge_init(bridge_t *bridge, const plant_config_t *config)
{
    *bridge = (bridge_t){
        .v_switch_V = config->inverter.v_switch_V,
        .v_diode_V = config->inverter.v_diode_V,
        .r_on_ohm = config->inverter.r_on_ohm,
        .zone_A = ZONE * config->sensor.i_full_scale_A,
        .switched_1_A = 1.0 / (ZONE * config->sensor.i_full_scale_A),
        .floating = PLANT_LEGS,
    };
}

static double no_current_A(const bridge_t *bridge)
{
    return NO_CURRENT / ZONE * bridge->zone_A;
}

static bool is_diode(const bridge_t *bridge, int k)
{
    return bridge->leg[k] == LEG_DIODE_LOW || bridge->leg[k] == LEG_DIODE_HIGH;
}

static void summarise(bridge_t *bridge)
{
    abc_t upper, drop_V;
    bridge->floating = 0;
    bridge->diodes = 0;
    for (int k = 0; k < PLANT_LEGS; k++) {
        leg_t leg = bridge->leg[k];
        bridge->floating += leg == LEG_FLOATING;
        bridge->diodes += is_diode(bridge, k);
        bridge->inv_zone_1_A[k] = leg == LEG_LOW || leg == LEG_HIGH ? bridge->switched_1_A : 0.0;
        upper.x[k] = leg == LEG_HIGH || leg == LEG_DIODE_HIGH ? 1.0 : 0.0;
        drop_V.x[k] = leg == LEG_DIODE_LOW ? bridge->v_diode_V : 0.0;
        drop_V.x[k] = leg == LEG_DIODE_HIGH ? -bridge->v_diode_V : drop_V.x[k];
    }
    bridge->rail = frame_from_abc(upper);
    bridge->diode_drop_V = frame_from_abc(drop_V);
}

static leg_t diode_for(const bridge_t *bridge, double i_A)
{
    if (fabs(i_A) <= no_current_A(bridge)) {
        return LEG_FLOATING;
    }
    return i_A > 0.0 ? LEG_DIODE_LOW : LEG_DIODE_HIGH;
}

/* Without a second path there is no current, so a single conducting diode is none. */
static void drop_lone_diode(bridge_t *bridge)
{
    summarise(bridge);
    if (bridge->floating < PLANT_LEGS - 1 || bridge->diodes == 0) {
        return;
    }
    for (int k = 0; k < PLANT_LEGS; k++) {
        if (is_diode(bridge, k)) {
            bridge->leg[k] = LEG_FLOATING;
        }
    }
    summarise(bridge);
}

void bridge_switch(bridge_t *bridge, const gates_t *gates, ab_t i_A)
{
    for (int k = 0; k < PLANT_LEGS; k++) {
        gate_t gate = gates->leg[k].gate;
        bool was_switched = bridge->leg[k] == LEG_LOW || bridge->leg[k] == LEG_HIGH;
        if (gate != GATE_OFF) {
            bridge->leg[k] = gate == GATE_HIGH ? LEG_HIGH : LEG_LOW;
        } else if (was_switched) {
            bridge->leg[k] = diode_for(bridge, frame_dot(frame_axis[k], i_A));
        }
    }
    drop_lone_diode(bridge);
}

void bridge_reassign(bridge_t *bridge, ab_t i_A)
{
    for (int k = 0; k < PLANT_LEGS; k++) {
        if (is_diode(bridge, k)) {
            bridge->leg[k] = diode_for(bridge, frame_dot(frame_axis[k], i_A));
        }
    }
    drop_lone_diode(bridge);
}

/* EMF of the phases at zero current */
static double emf_V(const motor_port_t *port, int k)
{
    ab_t emf = {-port->omega_e_rad_s * port->psi_Wb.beta, port->omega_e_rad_s * port->psi_Wb.alpha};
    return frame_dot(frame_axis[k], emf);
}

/* One floating leg: i = R(theta) g(R(-theta) psi) gives di/dt = G (v - R i) + omega (J i - G J psi), and its
 * own leg voltage u must make axis . di/dt vanish. */
static double single_floating_V(const bridge_t *bridge, const machine_t *machine, const motor_port_t *port,
                                int k)
{
    ab_t drop = bridge_drop_V(bridge, port->i_A);
    double R = machine->R_s_ohm + bridge->r_on_ohm;
    ab_t v = {bridge->rail.alpha * port->v_dc_V - drop.alpha - R * port->i_A.alpha,
              bridge->rail.beta * port->v_dc_V - drop.beta - R * port->i_A.beta};
    dq_t v_dq = frame_to_dq(v, port->rotor);
    dq_t psi = frame_to_dq(port->psi_Wb, port->rotor);
    dq_t axis = frame_to_dq(frame_axis[k], port->rotor);
    machine_tangent_t g = machine_tangent_1_H(machine, psi);
    dq_t w = {g.d * axis.d + g.dq * axis.q, g.dq * axis.d + g.q * axis.q};
    double transformer = w.d * v_dq.d + w.q * v_dq.q;
    double motion = frame_axis[k].beta * port->i_A.alpha - frame_axis[k].alpha * port->i_A.beta +
                    w.d * psi.q - w.q * psi.d;
    return -1.5 * (transformer + port->omega_e_rad_s * motion) / (axis.d * w.d + axis.q * w.q);
}

/* The two legs of three floating ones with the largest line voltage */
static double widest_line_V(const motor_port_t *port, int *high, int *low)
{
    *high = 0;
    *low = 0;
    for (int k = 1; k < PLANT_LEGS; k++) {
        *high = emf_V(port, k) > emf_V(port, *high) ? k : *high;
        *low = emf_V(port, k) < emf_V(port, *low) ? k : *low;
    }
    return emf_V(port, *high) - emf_V(port, *low);
}

double bridge_floating_V(const bridge_t *bridge, const machine_t *machine, const motor_port_t *port, int k)
{
    if (bridge->floating == 1) {
        return single_floating_V(bridge, machine, port, k);
    }
    for (int tied = 0; tied < PLANT_LEGS; tied++) {
        if (bridge->leg[tied] != LEG_FLOATING) {
            double v_tied_V = bridge->leg[tied] == LEG_HIGH ? port->v_dc_V : 0.0;
            return v_tied_V + emf_V(port, k) - emf_V(port, tied);
        }
    }
    int high, low;
    widest_line_V(port, &high, &low);
    return 0.5 * (port->v_dc_V - emf_V(port, high) - emf_V(port, low)) + emf_V(port, k);
}

double bridge_leg_V(const bridge_t *bridge, const machine_t *machine, const motor_port_t *port, int k)
{
    if (bridge->leg[k] == LEG_FLOATING) {
        return bridge_floating_V(bridge, machine, port, k);
    }
    double i_A = frame_dot(frame_axis[k], port->i_A);
    double drop_V = bridge->r_on_ohm * i_A;
    drop_V += bridge->v_switch_V * bridge_switch_share(i_A * bridge->inv_zone_1_A[k]);
    if (is_diode(bridge, k)) {
        drop_V += bridge->leg[k] == LEG_DIODE_LOW ? bridge->v_diode_V : -bridge->v_diode_V;
    }
    bool upper = bridge->leg[k] == LEG_HIGH || bridge->leg[k] == LEG_DIODE_HIGH;
    return (upper ? port->v_dc_V : 0.0) - drop_V;
}

/* How far the terminal of leg k is beyond the nearer diode's threshold, V */
static double beyond_V(const bridge_t *bridge, double v_dc_V, double v_leg_V)
{
    return fabs(v_leg_V - 0.5 * v_dc_V) - 0.5 * v_dc_V - bridge->v_diode_V - START_MARGIN_V;
}

/* Starts what conducts first; true when something started. */
static bool start_diode(bridge_t *bridge, const machine_t *machine, const motor_port_t *port)
{
    if (bridge->floating == PLANT_LEGS) {
        int high, low;
        if (widest_line_V(port, &high, &low) <= port->v_dc_V + 2.0 * (bridge->v_diode_V + START_MARGIN_V)) {
            return false;
        }
        bridge->leg[high] = LEG_DIODE_HIGH;
        bridge->leg[low] = LEG_DIODE_LOW;
        return true;
    }
    int first = -1;
    double most_V = 0.0;
    double v_first_V = 0.0;
    for (int k = 0; k < PLANT_LEGS; k++) {
        if (bridge->leg[k] == LEG_FLOATING) {
            double v_leg_V = bridge_floating_V(bridge, machine, port, k);
            double excess_V = beyond_V(bridge, port->v_dc_V, v_leg_V);
            if (excess_V > most_V) {
                first = k;
                most_V = excess_V;
                v_first_V = v_leg_V;
            }
        }
    }
    if (first >= 0) {
        bridge->leg[first] = v_first_V > 0.5 * port->v_dc_V ? LEG_DIODE_HIGH : LEG_DIODE_LOW;
    }
    return first >= 0;
}

/* Reverse current through diode k in units of full scale */
static double reverse_current(const bridge_t *bridge, ab_t i_A, int k)
{
    double i_leg_A = frame_dot(frame_axis[k], i_A);
    double reverse_A = bridge->leg[k] == LEG_DIODE_LOW ? -i_leg_A : i_leg_A;
    return reverse_A * ZONE * bridge->switched_1_A - NO_CURRENT;
}

void bridge_stop_diodes(bridge_t *bridge, ab_t i_A)
{
    bool stopped = false;
    for (int k = 0; k < PLANT_LEGS && bridge->diodes > 0; k++) {
        if (is_diode(bridge, k) && reverse_current(bridge, i_A, k) > 0.0) {
            bridge->leg[k] = LEG_FLOATING;
            stopped = true;
        }
    }
    if (stopped) {
        drop_lone_diode(bridge);
    }
}

void bridge_start_diodes(bridge_t *bridge, const machine_t *machine, const motor_port_t *port)
{
    while (bridge->floating > 0 && start_diode(bridge, machine, port)) {
        summarise(bridge);
    }
}

double bridge_excess(const bridge_t *bridge, const machine_t *machine, const motor_port_t *port)
{
    double excess = -1.0;
    for (int k = 0; k < PLANT_LEGS; k++) {
        if (is_diode(bridge, k)) {
            excess = fmax(excess, reverse_current(bridge, port->i_A, k));
        }
    }
    if (bridge->floating == PLANT_LEGS) {
        int high, low;
        double line_V = widest_line_V(port, &high, &low);
        double limit_V = port->v_dc_V + 2.0 * (bridge->v_diode_V + START_MARGIN_V);
        return fmax(excess, (line_V - limit_V) / (fabs(port->v_dc_V) + 1.0));
    }
    for (int k = 0; k < PLANT_LEGS && bridge->floating > 0; k++) {
        if (bridge->leg[k] == LEG_FLOATING) {
            double v_leg_V = bridge_floating_V(bridge, machine, port, k);
            excess = fmax(excess, beyond_V(bridge, port->v_dc_V, v_leg_V) / (fabs(port->v_dc_V) + 1.0));
        }
    }
    return excess;
}
