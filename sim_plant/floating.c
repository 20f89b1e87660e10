#include "sim_plant/floating.h"

#include <math.h>

#define MAX_ROUNDS 20
#define SINGULAR   1e-9 /* of the largest pivot */

typedef struct {
    int count;
    int leg[PLANT_LEGS];
    double matrix[PLANT_LEGS][PLANT_LEGS]; /* axis_k . Y share_l */
    double x[PLANT_LEGS];
} equations_t;

static double along(const winding_t *w, int leg, const double x[ACTIVE])
{
    double sum = 0.0;
    for (int a = 0; a < w->active; a++) {
        sum += w->axis[leg][a] * x[a];
    }
    return sum;
}

static void set_up(const bridge_t *bridge, const machine_t *machine, const machine_state_t *state,
                   const machine_point_t *point, equations_t *e)
{
    const winding_t *w = &machine->winding;
    double Y[ACTIVE][ACTIVE];
    machine_admittance(machine, state, point, Y);
    e->count = 0;
    for (int k = 0; k < bridge->legs; k++) {
        if (bridge->leg[k] == LEG_FLOATING) {
            e->leg[e->count++] = k;
        }
    }
    for (int column = 0; column < e->count; column++) {
        double response[ACTIVE] = {0.0};
        for (int a = 0; a < w->active; a++) {
            for (int b = 0; b < w->active; b++) {
                response[a] += Y[a][b] * w->share[e->leg[column]][b];
            }
        }
        for (int row = 0; row < e->count; row++) {
            e->matrix[row][column] = along(w, e->leg[row], response);
        }
    }
}

/* Symmetric elimination with diagonal pivots. An unknown that the others already determine, as the potential
 * of a group that is tied to nothing, becomes zero. */
static void solve(equations_t *e)
{
    bool done[PLANT_LEGS] = {false};
    double largest = 0.0;
    int order[PLANT_LEGS];
    int rank = 0;
    for (int round = 0; round < e->count; round++) {
        int pivot = -1;
        for (int k = 0; k < e->count; k++) {
            if (!done[k] && (pivot < 0 || e->matrix[k][k] > e->matrix[pivot][pivot])) {
                pivot = k;
            }
        }
        largest = fmax(largest, e->matrix[pivot][pivot]);
        if (e->matrix[pivot][pivot] <= SINGULAR * largest) {
            break;
        }
        done[pivot] = true;
        order[rank++] = pivot;
        for (int row = 0; row < e->count; row++) {
            if (done[row]) {
                continue;
            }
            double factor = e->matrix[row][pivot] / e->matrix[pivot][pivot];
            for (int column = 0; column < e->count; column++) {
                e->matrix[row][column] -= done[column] ? 0.0 : factor * e->matrix[pivot][column];
            }
            e->x[row] -= factor * e->x[pivot];
        }
    }
    for (int k = 0; k < e->count; k++) {
        e->x[k] = done[k] ? e->x[k] : 0.0;
    }
    for (int round = rank - 1; round >= 0; round--) {
        int pivot = order[round];
        for (int later = round + 1; later < rank; later++) {
            e->x[pivot] -= e->matrix[pivot][order[later]] * e->x[order[later]];
        }
        e->x[pivot] /= e->matrix[pivot][pivot];
    }
}

/* Legs whose currents add up to none: those of a star, or both ends of an open phase. */
static int group_of(const winding_t *w, int leg)
{
    return w->legs > w->phases ? leg % 3 : leg / 3;
}

static void centre_groups(const bridge_t *bridge, const winding_t *w, double v_dc_V, double v_leg_V[])
{
    for (int group = 0; group < 3; group++) {
        double high_V = -(double)INFINITY;
        double low_V = (double)INFINITY;
        bool tied = false;
        for (int k = 0; k < w->legs; k++) {
            if (group_of(w, k) == group) {
                tied = tied || bridge->leg[k] != LEG_FLOATING ||
                       (w->branch >= 0 && w->axis[k][w->branch] != 0.0);
                high_V = fmax(high_V, v_leg_V[k]);
                low_V = fmin(low_V, v_leg_V[k]);
            }
        }
        for (int k = 0; k < w->legs && !tied; k++) {
            v_leg_V[k] += group_of(w, k) == group ? 0.5 * (v_dc_V - high_V - low_V) : 0.0;
        }
    }
}

void floating_voltages(const bridge_t *bridge, const machine_t *machine, const machine_state_t *state,
                       const machine_point_t *point, double omega_e_rad_s, double v_dc_V, double v_V[ACTIVE],
                       double v_leg_V[PLANT_LEGS], machine_rate_t *rate)
{
    const winding_t *w = &machine->winding;
    equations_t e;
    machine_rates(machine, state, point, omega_e_rad_s, v_V, rate);
    set_up(bridge, machine, state, point, &e);
    for (int k = 0; k < e.count; k++) {
        e.x[k] = -along(w, e.leg[k], rate->i_A_s);
    }
    solve(&e);
    for (int k = 0; k < e.count; k++) {
        v_leg_V[e.leg[k]] = e.x[k];
        for (int a = 0; a < w->active; a++) {
            v_V[a] += w->share[e.leg[k]][a] * e.x[k];
        }
    }
    machine_rates(machine, state, point, omega_e_rad_s, v_V, rate);
    centre_groups(bridge, w, v_dc_V, v_leg_V);
}

/* At once, and exactly, where that moves nothing else: neither another set nor eddy circuits. */
static void idle_sets(const bridge_t *bridge, const machine_t *machine, machine_state_t *state)
{
    const winding_t *w = &machine->winding;
    bool eddy = machine->gamma_eddy_d_1_H > 0.0 || machine->gamma_eddy_q_1_H > 0.0;
    if (w->branch >= 0 || eddy || (w->sets > 1 && !machine->loose)) {
        return;
    }
    for (int set = 0; set < w->sets; set++) {
        int first = 3 * set;
        int tied = 0;
        int most = w->legs > w->phases ? 0 : 1; /* a lone tied leg of a star carries nothing either */
        for (int k = first; k < first + (w->legs > w->phases ? 6 : 3); k++) {
            tied += bridge->leg[k] != LEG_FLOATING;
        }
        if (tied <= most) {
            machine_idle(machine, state, set);
        }
    }
}

void floating_project(const bridge_t *bridge, const machine_t *machine, double small_A,
                      machine_state_t *state, machine_point_t *point)
{
    const winding_t *w = &machine->winding;
    idle_sets(bridge, machine, state);
    machine_evaluate(machine, state, point);
    for (int round = 0; round < MAX_ROUNDS; round++) {
        double worst_A = 0.0;
        for (int k = 0; k < bridge->legs; k++) {
            if (bridge->leg[k] == LEG_FLOATING) {
                worst_A = fmax(worst_A, fabs(along(w, k, point->i_A)));
            }
        }
        if (worst_A <= small_A) {
            return;
        }
        equations_t e;
        double kick_Wb[ACTIVE] = {0.0};
        set_up(bridge, machine, state, point, &e);
        for (int k = 0; k < e.count; k++) {
            e.x[k] = -along(w, e.leg[k], point->i_A);
        }
        solve(&e);
        for (int k = 0; k < e.count; k++) {
            for (int a = 0; a < w->active; a++) {
                kick_Wb[a] += w->share[e.leg[k]][a] * e.x[k];
            }
        }
        machine_kick(machine, state, point, kick_Wb);
        machine_evaluate(machine, state, point);
    }
}
