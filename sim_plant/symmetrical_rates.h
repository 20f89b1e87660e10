/* First and second derivatives of a symmetrical machine on legs that are tied or swing; for symmetrical.c.
 *
 * All follows from the currents, and these move by the tangent of the field, so that a point of the field
 * gives both in closed form: voltages of the legs, then d psi/dt = v - R i - omega psi_x', from it di/dt, and
 * from that how voltages, power and torque move. */
#ifndef PLANT_SYMMETRICAL_RATES_H
#define PLANT_SYMMETRICAL_RATES_H

#include "sim_plant/circuit_rates.h"
#include "sim_plant/field.h"

/* Of the legs at a point */
typedef struct {
    pair_t v_V[PAIRS], drop_V[PAIRS];
    double i_leg_A[PLANT_LEGS], share[PLANT_LEGS]; /* of the drop of closed switches, when there is one */
    double i_dc_A;
} tied_t;

/* Rates at the start of a step, and what they say about it. */
typedef struct {
    double rate[ELEMENTS], bend[ELEMENTS];  /* first and second derivative, */
    pair_t flux_V[PAIRS], flux_V_s[PAIRS];  /* and of the field's flux */
    double omega_jerk;                      /* third derivative of the angle */
    double v_leg_V_s3[PLANT_LEGS];          /* and of swinging terminals, nearly, */
    pair_t v_V_s2[PAIRS], flux_V_s2[PAIRS]; /* and what these do to voltages and linkages */
    pair_t core_V[PLANT_SETS], i_A_s[PAIRS];
    tied_t tied;
} start_t;

/* Coordinates that leg k has a part in: of two stars those of its own set. */
INLINE int leg_first(shape_t shape, int k)
{
    return shape.sets > 1 ? k / 3 : 0;
}

INLINE int leg_end(shape_t shape, int k)
{
    return shape.sets > 1 ? k / 3 + 1 : pairs(shape);
}

INLINE double along(const winding_t *w, shape_t shape, int k, const pair_t x[])
{
    pair_t sum = {0.0};
    for (int p = leg_first(shape, k); p < leg_end(shape, k); p++) {
        sum += pair_at(&w->axis[k][2 * p]) * x[p];
    }
    return total(sum);
}

INLINE void spread(const winding_t *w, shape_t shape, int k, double v_V, pair_t to_V[])
{
    for (int p = leg_first(shape, k); p < leg_end(shape, k); p++) {
        to_V[p] += pair_at(&w->share[k][2 * p]) * both(v_V);
    }
}

/* Into the rates of the state: that of a zero sequence is a current. */
INLINE pair_t of_state(const machine_t *m, shape_t shape, int p, pair_t flux)
{
    return p < shape.sets ? flux : flux * both(m->loose_gamma_1_H[2 * shape.sets]);
}

INLINE void add_drops(const circuit_t *c, const field_t *f, shape_t shape, bool swings, tied_t *t)
{
    const bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    bool each = swings || b->v_switch_V != 0.0;
    for (int k = 0; k < shape.legs; k++) {
        t->i_leg_A[k] = each ? along(w, shape, k, f->i_A) : 0.0;
        t->share[k] = 0.0;
    }
    for (int k = 0; k < shape.legs && b->v_switch_V != 0.0; k++) {
        t->share[k] = bridge_switch_share(t->i_leg_A[k] * b->inv_zone_1_A[k]);
        spread(w, shape, k, b->v_switch_V * t->share[k], t->drop_V);
    }
}

INLINE void tied_at(const circuit_t *c, const field_t *f, const double x[], shape_t shape, bool swings,
                    tied_t *t)
{
    const bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    pair_t i_dc_A = {0.0}, swing_V[PAIRS] = {{0.0}};
    for (int p = 0; p < pairs(shape); p++) {
        t->drop_V[p] = both(b->r_series_ohm) * f->i_A[p] - pair_at(&b->diode_V[2 * p]);
        i_dc_A += weights(shape, p) * pair_at(&b->rail[2 * p]) * f->i_A[p];
    }
    add_drops(c, f, shape, swings, t);
    for (int k = 0; k < shape.legs && swings; k++) {
        if (b->leg[k] == LEG_SWINGING) {
            spread(w, shape, k, x[V_LEG(k)], swing_V);
            spread(w, shape, k, -b->r_on_ohm * t->i_leg_A[k], t->drop_V);
        }
    }
    for (int p = 0; p < pairs(shape); p++) {
        t->v_V[p] = pair_at(&b->rail[2 * p]) * both(x[V_DC]) + pair_at(&b->source_V[2 * p]) - t->drop_V[p];
        t->v_V[p] = swings ? t->v_V[p] + swing_V[p] : t->v_V[p];
    }
    t->i_dc_A = total(i_dc_A);
}

INLINE void rates_at(const circuit_t *c, const field_t *f, const double x[], shape_t shape, bool swings,
                     tied_t *t, double rate[], pair_t flux_V[])
{
    const machine_t *m = &c->machine;
    const bridge_t *b = &c->bridge;
    double omega = x[OMEGA_MECH], v_dc = x[V_DC];
    double omega_e = m->pole_pairs * omega;
    pair_t in_W = {0.0}, copper = {0.0}, device_W = {0.0};
    tied_at(c, f, x, shape, swings, t);
    for (int p = 0; p < pairs(shape); p++) {
        pair_t power = weights(shape, p) * f->i_A[p];
        pair_t rest_V = t->v_V[p] - both(m->R_s_ohm) * f->i_A[p] - both(omega_e) * f->slope_Wb[p];
        flux_V[p] = of_state(m, shape, p, rest_V);
        in_W = b->sources ? in_W + power * pair_at(&b->source_V[2 * p]) : in_W;
        copper += power * f->i_A[p];
        device_W += power * t->drop_V[p];
    }
    for (int k = 0; k < shape.legs && swings; k++) {
        rate[V_LEG(k)] = b->leg[k] == LEG_SWINGING ? -t->i_leg_A[k] * b->inv_c_leg_1_F : 0.0;
    }
    rate[THETA_E] = omega_e;
    rate[OMEGA_MECH] = mechanics_rate(&c->mech, omega, f->torque_Nm);
    rate[V_DC] = dclink_plain_rate(&c->link, v_dc, t->i_dc_A);
    rate[INT_V_ALPHA] = t->v_V[0][0];
    rate[INT_V_BETA] = t->v_V[0][1];
    rate[INT_IN] = v_dc * t->i_dc_A + total(in_W);
    rate[INT_COPPER] = m->R_s_ohm * total(copper);
    rate[INT_DEVICE] = total(device_W);
    rate[INT_MECH] = f->torque_Nm * omega;
}

/* How voltages of the legs move with the currents. */
INLINE void tied_bends(const circuit_t *c, const pair_t i_A_s[], shape_t shape, bool swings, start_t *s,
                       pair_t drop_V_s[], pair_t v_V_s[])
{
    const bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    pair_t swing_V_s[PAIRS] = {{0.0}};
    for (int p = 0; p < pairs(shape); p++) {
        drop_V_s[p] = both(b->r_series_ohm) * i_A_s[p];
    }
    for (int k = 0; k < shape.legs && b->v_switch_V != 0.0; k++) {
        double x = s->tied.i_leg_A[k] * b->inv_zone_1_A[k];
        if (x > -1.0 && x < 1.0) {
            double slope = b->v_switch_V * 1.5 * (1.0 - x * x) * b->inv_zone_1_A[k];
            spread(w, shape, k, slope * along(w, shape, k, i_A_s), drop_V_s);
        }
    }
    for (int k = 0; k < shape.legs && swings; k++) {
        s->bend[V_LEG(k)] = 0.0;
        if (b->leg[k] == LEG_SWINGING) {
            double moves_A_s = along(w, shape, k, i_A_s);
            s->bend[V_LEG(k)] = -moves_A_s * b->inv_c_leg_1_F;
            spread(w, shape, k, s->rate[V_LEG(k)], swing_V_s);
            spread(w, shape, k, -b->r_on_ohm * moves_A_s, drop_V_s);
        }
    }
    for (int p = 0; p < pairs(shape); p++) {
        v_V_s[p] = pair_at(&b->rail[2 * p]) * both(s->rate[V_DC]) - drop_V_s[p];
        v_V_s[p] = swings ? v_V_s[p] + swing_V_s[p] : v_V_s[p];
    }
}

/* Second derivatives of link and rotor, with those of torque and link current. */
INLINE void other_bends(const circuit_t *c, double torque_Nm_s, double i_dc_A_s, start_t *s)
{
    const double *x = c->now.x;
    double v_dc_s = s->rate[V_DC], omega_s = s->rate[OMEGA_MECH];
    bool fed = c->link.connected && !(c->link.blocks && c->link.v_source_V < x[V_DC]);
    double bend_V = (-(fed ? c->link.g_source_S * v_dc_s : 0.0) - i_dc_A_s) * c->link.inv_C_1_F;
    s->bend[THETA_E] = c->machine.pole_pairs * omega_s;
    s->bend[OMEGA_MECH] = c->mech.gain_1_kgm2 * (torque_Nm_s - c->mech.parameters.B_Nms * omega_s);
    s->bend[V_DC] = x[V_DC] > 0.0 ? bend_V : 0.0;
    s->bend[INT_IN] += v_dc_s * s->tied.i_dc_A + x[V_DC] * i_dc_A_s;
    s->bend[INT_MECH] = torque_Nm_s * x[OMEGA_MECH] + c->field.torque_Nm * omega_s;
    s->omega_jerk = c->machine.pole_pairs * s->bend[OMEGA_MECH];
}

/* Second derivatives from those of the currents. */
INLINE void bends_at(const circuit_t *c, const pair_t i_A_s[], shape_t shape, bool swings, start_t *s)
{
    const field_t *f = &c->field;
    const machine_t *m = &c->machine;
    const bridge_t *b = &c->bridge;
    pair_t drop_V_s[PAIRS], v_V_s[PAIRS];
    pair_t i_dc_A_s = {0.0}, source_W_s = {0.0}, copper = {0.0}, device_W_s = {0.0}, harmonic = {0.0};
    double omega_e = s->rate[THETA_E], omega_e_s = m->pole_pairs * s->rate[OMEGA_MECH];
    double product = 0.0;
    tied_bends(c, i_A_s, shape, swings, s, drop_V_s, v_V_s);
    for (int p = 0; p < pairs(shape); p++) {
        pair_t i = weights(shape, p) * f->i_A[p], moves = weights(shape, p) * i_A_s[p];
        pair_t turning = both(omega_e) * f->bend_Wb[p];
        s->flux_V_s[p] = of_state(m, shape, p,
                                  v_V_s[p] - both(m->R_s_ohm) * i_A_s[p] - both(omega_e_s) * f->slope_Wb[p] -
                                      both(omega_e) * turning);
        i_dc_A_s += pair_at(&b->rail[2 * p]) * moves;
        source_W_s = b->sources ? source_W_s + pair_at(&b->source_V[2 * p]) * moves : source_W_s;
        copper += i * i_A_s[p];
        device_W_s += i * drop_V_s[p] + moves * s->tied.drop_V[p];
        harmonic += moves * f->slope_Wb[p] + i * turning;
    }
    for (int set = 0; set < shape.sets; set++) {
        product += cross(s->flux_V[set], f->i_A[set]) + cross(f->flux[set], i_A_s[set]);
    }
    s->bend[INT_V_ALPHA] = v_V_s[0][0];
    s->bend[INT_V_BETA] = v_V_s[0][1];
    s->bend[INT_IN] = total(source_W_s);
    s->bend[INT_COPPER] = 2.0 * m->R_s_ohm * total(copper);
    s->bend[INT_DEVICE] = total(device_W_s);
    other_bends(c, m->torque_gain * product + m->pole_pairs * total(harmonic), total(i_dc_A_s), s);
}

/* Third derivatives that swinging terminals bring, without those of rotation. */
INLINE void swing_bends(const circuit_t *c, shape_t shape, start_t *s)
{
    const machine_t *m = &c->machine;
    pair_t core_V_s[PLANT_SETS], i_A_s2[PAIRS];
    field_rates(m, c->now.rotor, 0.0, shape, &c->field, s->flux_V_s, core_V_s, i_A_s2);
    for (int p = 0; p < pairs(shape); p++) {
        s->v_V_s2[p] = both(-c->bridge.r_series_ohm) * i_A_s2[p];
    }
    for (int k = 0; k < shape.legs; k++) {
        s->v_leg_V_s3[k] = 0.0;
        if (c->bridge.leg[k] == LEG_SWINGING) {
            s->v_leg_V_s3[k] = -along(&m->winding, shape, k, i_A_s2) * c->bridge.inv_c_leg_1_F;
            spread(&m->winding, shape, k, s->bend[V_LEG(k)], s->v_V_s2);
        }
    }
    for (int p = 0; p < pairs(shape); p++) {
        s->flux_V_s2[p] = of_state(m, shape, p, s->v_V_s2[p] - both(m->R_s_ohm) * i_A_s2[p]);
    }
}

INLINE void begin(const circuit_t *c, shape_t shape, bool swings, start_t *s)
{
    rates_at(c, &c->field, c->now.x, shape, swings, &s->tied, s->rate, s->flux_V);
    field_rates(&c->machine, c->now.rotor, s->rate[THETA_E], shape, &c->field, s->flux_V, s->core_V,
                s->i_A_s);
    bends_at(c, s->i_A_s, shape, swings, s);
    if (swings) {
        swing_bends(c, shape, s);
    }
}

#endif
