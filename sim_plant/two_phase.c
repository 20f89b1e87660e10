#include "sim_plant/two_phase.h"
#include "sim_plant/symmetrical_rates.h"

#include <math.h>

static void terminals(const circuit_t *c, const point_t *p, pair_t v_V, double v_leg_V[PLANT_LEGS])
{
    double mean_V = two_phase_mean_V(c, p->i_A, p->x[V_DC], v_V);
    for (int k = 0; k < STAR.legs; k++) {
        v_leg_V[k] = mean_V + two_phase_above_V(c, k, v_V);
    }
}

void circuit_two_phase_terminals(const circuit_t *c, const point_t *p, double v_leg_V[PLANT_LEGS])
{
    terminals(c, p, pair_at(p->open_V), v_leg_V);
}

void circuit_two_phase_at(const circuit_t *c, const point_t *p, double v_leg_V[PLANT_LEGS],
                          double i_A_s[ACTIVE])
{
    double omega_e = c->machine.pole_pairs * p->x[OMEGA_MECH];
    field_t f;
    tied_t tied;
    rates_t rate;
    pair_t core_V[PLANT_SETS], moved_A_s[PAIRS];
    field_from_cores(&c->machine, p->rotor, STAR, &p->x[U], 0.0, &f);
    no_drops(STAR, &tied);
    rates_at(c, p->rotor, &f, p->x, STAR, NULL, true, c->bridge.v_switch_V == 0.0, &tied, &rate);
    field_rates(&c->machine, p->rotor, omega_e, STAR, &f, rate.flux_V, core_V, moved_A_s);
    pair_put(i_A_s, moved_A_s[0]);
    terminals(c, p, tied.v_V[0], v_leg_V);
}

void circuit_settle_two_phase(circuit_t *c, double small_A)
{
    double worst_A = 0.0;
    know_field(c, STAR);
    for (unsigned legs = c->bridge.floating; legs != 0u; legs &= legs - 1u) {
        worst_A = fmax(worst_A, fabs(circuit_leg_A(c, &c->now, bridge_first(legs))));
    }
    if (worst_A > small_A) {
        two_phase_release(c, c->now.rotor, &c->field);
        pair_put(&c->now.x[U], c->field.flux[0]);
        pair_put(&c->now.i_A[0], c->field.i_A[0]);
        c->now.torque_Nm = c->field.torque_Nm;
    }
}
