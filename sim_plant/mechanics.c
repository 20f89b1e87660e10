#include "sim_plant/mechanics.h"

#include <math.h>

/* A motion that has just begun must not end by rounding: one part in 1e9 of a speed or torque. */
#define REVERSED_RAD_S 1e-9
#define BREAKAWAY      (1.0 + 1e-9)

void mechanics_init(mechanics_t *mech, const plant_mech_t *parameters)
{
    *mech = (mechanics_t){.parameters = *parameters};
    mechanics_settle(mech, 0.0, 0.0);
}

double mechanics_settle(mechanics_t *mech, double omega_mech_rad_s, double torque_Nm)
{
    double friction_Nm = mech->parameters.T_coulomb_Nm;
    double drive_Nm = torque_Nm - mech->load_Nm;

    mech->gain_1_kgm2 = 0.0;
    mech->bias_Nm = 0.0;
    mech->stuck = false;
    if (mech->parameters.locked || mech->imposed) {
        mech->slide = 0.0;
        return mech->parameters.locked ? 0.0 : mech->imposed_rad_s;
    }
    if (friction_Nm > 0.0) {
        double moving = mech->slide * omega_mech_rad_s;
        if (omega_mech_rad_s != 0.0 && (mech->slide == 0.0 || moving > -REVERSED_RAD_S)) {
            mech->slide = mech->slide == 0.0 ? copysign(1.0, omega_mech_rad_s) : mech->slide;
        } else if (fabs(drive_Nm) <= friction_Nm * BREAKAWAY) {
            mech->slide = 0.0;
            mech->stuck = true;
            return 0.0;
        } else {
            mech->slide = copysign(1.0, drive_Nm);
            omega_mech_rad_s = 0.0;
        }
    } else {
        mech->slide = 0.0;
    }
    mech->gain_1_kgm2 = 1.0 / mech->parameters.J_kgm2;
    mech->bias_Nm = -mech->load_Nm - mech->slide * friction_Nm;
    return omega_mech_rad_s;
}

double mechanics_excess(const mechanics_t *mech, double omega_mech_rad_s, double torque_Nm)
{
    double friction_Nm = mech->parameters.T_coulomb_Nm;
    if (mech->stuck) {
        return fabs(torque_Nm - mech->load_Nm) / friction_Nm - BREAKAWAY;
    }
    return mech->slide != 0.0 ? -mech->slide * omega_mech_rad_s - REVERSED_RAD_S : -1.0;
}
