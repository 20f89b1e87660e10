/* Rotor and load: one mass, or two on an elastic shaft (METHODS.md 0.2 E15).
 *
 *   J dw/dt = T - T_shaft - B w - T_coulomb sgn(w)                                      rotor
 *   T_shaft = k twist + d (w - w_load),   dtwist/dt = w - w_load
 *   J_load dw_load/dt = T_shaft - T_load                                                second mass
 *   T_load = a w_load + b w_load |w_load| + sum T_n cos(n theta_load + phase) + load_Nm
 *
 * twist is the angle of the rotor less that of the load. Without a second mass T_load acts on the rotor, with
 * its speed and angle. Fan and pump are b, a compressor the sum with its mean in load_Nm, a hoist load_Nm
 * alone: it pulls at standstill too.
 *
 * Dry friction sticks: at standstill it takes any torque up to T_coulomb, so the rotor rests exactly and
 * breaks away only when the torque exceeds it. A locked rotor and an imposed speed follow no torque, but
 * leave the second mass free. mechanics_excess() tells the integrator where the motion changes its kind.
 * Tests: mechanics_test.cpp. */
#ifndef PLANT_MECHANICS_H
#define PLANT_MECHANICS_H

#include <math.h>

#include "sim_plant/plant_config.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    plant_mech_t parameters;
    double load_Nm; /* constant part of T_load; takes effect with mechanics_settle() */
    bool imposed;
    double imposed_rad_s;       /* by mechanics_impose(); follows a ramp */
    double imposed_rate_rad_s2; /* slope of it; 0: constant */
    bool ramping;
    double slide; /* direction of sliding friction: -1, 0 (stuck, or no friction), 1 */
    bool stuck;
    bool plain; /* see mechanics_plain() */
    /* dw/dt = given + gain (T + bias - (drag + drag2 |w|) w); gain = 0 when the speed is given. The drag is that of the rotor
     * and, without a second mass, of the load. */
    double drag_Nms, drag_Nms2;
    double gain_1_kgm2;
    double bias_Nm;
    double given_rad_s2;
} mechanics_t;

typedef struct {
    double omega_mech_rad_s;
    double theta_mech_rad;   /* both of the rotor */
    double omega_load_rad_s; /* of the second mass; unused without one, as is the twist */
    double twist_rad;        /* zero at the start */
} mechanics_motion_t;

typedef struct {
    double omega_mech_rad_s2;
    double omega_load_rad_s2; /* 0 without a second mass, */
    double twist_rad_s;       /* and so is this */
} mechanics_motion_rate_t;

void mechanics_init(mechanics_t *mech, const plant_mech_t *parameters);

/* From the next mechanics_settle() on the speed is this one, then moves by imposed_rate_rad_s2. */
void mechanics_impose(mechanics_t *mech, double omega_mech_rad_s);

/* Decides between sticking, sliding and the given speed, and returns the rotor's speed: exactly zero when it
 * rests. To be called after any change of load or mode, and where mechanics_excess() passed zero. */
double mechanics_settle(mechanics_t *mech, const mechanics_motion_t *motion, double torque_Nm);

/* A motion that has just begun must not end by rounding. */
#define MECHANICS_REVERSED_RAD_S 1e-9

/* Above zero once the present kind of motion has ended; only a friction torque can end it. */
double mechanics_stuck_excess(const mechanics_t *mech, const mechanics_motion_t *motion, double torque_Nm);
static inline double mechanics_sliding_excess(const mechanics_t *mech, double omega_mech_rad_s)
{
    return -mech->slide * omega_mech_rad_s - MECHANICS_REVERSED_RAD_S;
}
static inline double mechanics_excess(const mechanics_t *mech, const mechanics_motion_t *motion,
                                      double torque_Nm)
{
    return mech->stuck          ? mechanics_stuck_excess(mech, motion, torque_Nm)
           : mech->slide != 0.0 ? mechanics_sliding_excess(mech, motion->omega_mech_rad_s)
                                : -1.0;
}

/* One mass whose load does not depend on the angle: then mechanics_rate() says all. */
static inline bool mechanics_plain(const mechanics_t *m)
{
    return m->plain;
}

static inline double mechanics_rate(const mechanics_t *m, double omega_mech_rad_s, double torque_Nm)
{
    double drag_Nms = m->drag_Nms + m->drag_Nms2 * fabs(omega_mech_rad_s);
    return m->given_rad_s2 + m->gain_1_kgm2 * (torque_Nm + m->bias_Nm - drag_Nms * omega_mech_rad_s);
}

/* How that moves. */
static inline double mechanics_bend(const mechanics_t *m, double omega_mech_rad_s, double omega_mech_rad_s2,
                                    double torque_Nm_s)
{
    double drag_Nms = m->drag_Nms + 2.0 * m->drag_Nms2 * fabs(omega_mech_rad_s);
    return m->gain_1_kgm2 * (torque_Nm_s - drag_Nms * omega_mech_rad_s2);
}

/* Rates of any shaft and load. */
void mechanics_rates(const mechanics_t *mech, const mechanics_motion_t *motion, double torque_Nm,
                     mechanics_motion_rate_t *rate);

#ifdef __cplusplus
}
#endif

#endif
