/* One rotating mass: J domega/dt = T - T_load - B omega - T_coulomb sgn(omega) (METHODS.md 0.2 E15).
 *
 * Dry friction sticks: at standstill it takes any torque up to T_coulomb, so the rotor rests exactly and
 * breaks away only when the torque exceeds it. A locked rotor and an imposed speed have no dynamics.
 * mechanics_excess() tells the integrator where the motion changes its kind. Tests: mechanics_test.cpp. */
#ifndef PLANT_MECHANICS_H
#define PLANT_MECHANICS_H

#include "sim_plant/plant.h"

typedef struct {
    plant_mech_t parameters;
    double load_Nm;
    double imposed_rad_s;
    bool imposed;
    double slide; /* direction of sliding friction: -1, 0 (stuck, or no friction), 1 */
    bool stuck;
    /* domega/dt = gain (T + bias - B omega); gain = 0 when the speed is given */
    double gain_1_kgm2;
    double bias_Nm;
} mechanics_t;

void mechanics_init(mechanics_t *mech, const plant_mech_t *parameters);

/* Decides between sticking, sliding and the given speed, and returns the speed: exactly zero when the
 * rotor rests. To be called after any change of load or mode, and where mechanics_excess() passed zero. */
double mechanics_settle(mechanics_t *mech, double omega_mech_rad_s, double torque_Nm);

static inline double mechanics_rate(const mechanics_t *m, double omega_mech_rad_s, double torque_Nm)
{
    return m->gain_1_kgm2 * (torque_Nm + m->bias_Nm - m->parameters.B_Nms * omega_mech_rad_s);
}

/* Above zero once the present kind of motion has ended; only a friction torque can end it. */
double mechanics_excess(const mechanics_t *mech, double omega_mech_rad_s, double torque_Nm);

#endif
