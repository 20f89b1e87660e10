/* Events within a step: where diodes, friction and chopper change, and swinging terminals arrive. */
#include "sim_plant/steps.h"

#include <math.h>
#include <string.h>

static double swing_excess(const circuit_t *c, const point_t *p)
{
    double excess = -1.0;
    for (unsigned legs = c->bridge.swinging; legs != 0u; legs &= legs - 1u) {
        excess = larger(excess, circuit_swing_excess(c, p, bridge_first(legs)));
    }
    return excess;
}

static double floating_excess(const circuit_t *c, const point_t *p)
{
    const bridge_t *b = &c->bridge;
    double worst = -1.0;
    double v_leg_V[PLANT_LEGS];
    if (circuit_two_phase(c)) {
        circuit_two_phase_terminals(c, p, v_leg_V);
    } else {
        circuit_terminals(c, p, v_leg_V);
    }
    for (int k = 0; k < b->legs; k++) {
        if (b->leg[k] == LEG_FLOATING && !b->off_wire[k]) {
            double beyond_V = bridge_beyond_V(b, p->x[V_DC], v_leg_V[k]);
            worst = larger(worst, beyond_V / (fabs(p->x[V_DC]) + 1.0));
        }
    }
    return worst;
}

static double other_excess(const circuit_t *c, const point_t *p)
{
    const bridge_t *b = &c->bridge;
    double worst = -1.0;
    if (!dclink_plain(&c->link)) {
        worst = larger(worst, dclink_excess(&c->link, p->x[V_DC]));
    }
    if (c->mech.slide != 0.0) {
        worst = larger(worst, mechanics_sliding_excess(&c->mech, p->x[OMEGA_MECH]));
    }
    if (c->mech.stuck) {
        mechanics_motion_t motion = circuit_motion(c, p);
        worst = larger(worst, mechanics_stuck_excess(&c->mech, &motion, p->torque_Nm));
    }
    for (unsigned legs = b->diodes; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        worst = larger(worst, bridge_reverse_A(b, k, circuit_leg_A(c, p, k)) * c->inv_i_scale_1_A);
    }
    return b->floating != 0u ? larger(worst, floating_excess(c, p)) : worst;
}

excess_t steps_excess(const circuit_t *c, const point_t *p)
{
    return (excess_t){swing_excess(c, p), other_excess(c, p)};
}

double steps_locate(const circuit_t *c, double h_late, steps_retake_t *retake, const void *start, point_t *to)
{
    double h_early = 0.0;
    excess_t early = steps_excess(c, &c->now);
    excess_t late = steps_excess(c, to);
    double g_early = larger(early.rest, early.swing);
    double finest_s = 1e-9 * h_late;
    bool bisect = false;
    while (h_late - h_early > finest_s && !steps_landed(late)) {
        double width = h_late - h_early;
        double g_late = larger(late.rest, late.swing);
        double h = h_early + width * (bisect || g_early >= 0.0 ? 0.5 : g_early / (g_early - g_late));
        h = fmin(fmax(h, h_early + 0.1 * finest_s), h_late - 0.1 * finest_s);
        point_t probe;
        retake(c, start, h, &probe);
        excess_t excess = steps_excess(c, &probe);
        if (steps_event(excess)) {
            h_late = h;
            late = excess;
            *to = probe;
        } else {
            h_early = h;
            g_early = larger(excess.rest, excess.swing);
        }
        bisect = h_late - h_early > 0.5 * width;
    }
    return h_late;
}

static void lag_inputs(const circuit_t *c, const point_t *p, const circuit_nodes_t *nodes, lagged_t *inputs)
{
    *inputs = (lagged_t){.i_dc_A = nodes->i_dc_A};
    for (int set = 0; set < c->machine.winding.sets; set++) {
        inputs->v_zero_V[set] =
            lags_zero_V(&c->lags, set, nodes->v_zero_V[set], nodes->v_leg_V, nodes->v_neutral_V);
    }
    for (int k = 0; k < c->bridge.legs; k++) {
        inputs->i_A[k] = circuit_leg_A(c, p, k);
    }
}

void steps_probe(circuit_t *c, const point_t *to, double h)
{
    circuit_nodes_t before, after;
    double v_before_V[PROBE_CHANNELS], v_after_V[PROBE_CHANNELS];
    circuit_nodes(c, &c->now, &before);
    circuit_nodes(c, to, &after);
    if (lags_active(&c->lags)) {
        lagged_t first, last;
        lag_inputs(c, &c->now, &before, &first);
        lag_inputs(c, to, &after, &last);
        lags_advance(&c->lags, h, &first, &last);
    }
    if (!probe_active(&c->probe)) {
        return;
    }
    memcpy(v_before_V, before.v_leg_V, sizeof before.v_leg_V);
    memcpy(v_after_V, after.v_leg_V, sizeof after.v_leg_V);
    memcpy(&v_before_V[PLANT_LEGS], before.v_neutral_V, sizeof before.v_neutral_V);
    memcpy(&v_after_V[PLANT_LEGS], after.v_neutral_V, sizeof after.v_neutral_V);
    v_before_V[PROBE_LINK] = c->now.x[V_DC];
    v_after_V[PROBE_LINK] = to->x[V_DC];
    probe_advance(&c->probe, c->t_s - c->period_start_s, h, v_before_V, v_after_V);
}
