#include "sim_plant/mechanics.h"

#include <math.h>

#define BREAKAWAY (1.0 + 1e-9) /* for the same reason */

#define LOAD_HARMONICS (int)(sizeof((plant_mech_t){0}.load_angle) / sizeof(plant_harmonic_t))

static bool two_masses(const mechanics_t *mech)
{
    return mech->parameters.J_load_kgm2 > 0.0;
}

static bool by_angle(const plant_mech_t *p)
{
    bool any = false;
    for (int n = 0; n < LOAD_HARMONICS; n++) {
        any = any || (p->load_angle[n].order != 0 && p->load_angle[n].amplitude != 0.0);
    }
    return any;
}

void mechanics_init(mechanics_t *mech, const plant_mech_t *parameters)
{
    *mech = (mechanics_t){.parameters = *parameters, .drag_Nms = parameters->B_Nms};
    if (!two_masses(mech)) {
        mech->drag_Nms += parameters->load_Nms;
        mech->drag_Nms2 = parameters->load_Nms2;
        mech->plain = !by_angle(parameters);
    }
    mechanics_settle(mech, &(mechanics_motion_t){0}, 0.0);
}

void mechanics_impose(mechanics_t *mech, double omega_mech_rad_s)
{
    mech->imposed = true;
    mech->imposed_rad_s = omega_mech_rad_s;
    mech->ramping = false;
}

static double load_by_angle_Nm(const plant_mech_t *p, double theta_rad)
{
    double torque_Nm = 0.0;
    for (int n = 0; n < LOAD_HARMONICS; n++) {
        const plant_harmonic_t *h = &p->load_angle[n];
        if (h->order != 0) {
            torque_Nm += h->amplitude * cos(h->order * theta_rad + h->phase_rad);
        }
    }
    return torque_Nm;
}

static double load_by_speed_Nm(const plant_mech_t *p, double omega_rad_s)
{
    return (p->load_Nms + p->load_Nms2 * fabs(omega_rad_s)) * omega_rad_s;
}

static double shaft_Nm(const plant_mech_t *p, const mechanics_motion_t *m)
{
    return p->k_shaft_Nm * m->twist_rad + p->d_shaft_Nms * (m->omega_mech_rad_s - m->omega_load_rad_s);
}

/* What opposes the rotor beside bias_Nm and the drag. */
static double resisting_Nm(const mechanics_t *mech, const mechanics_motion_t *m)
{
    return two_masses(mech) ? shaft_Nm(&mech->parameters, m)
                            : load_by_angle_Nm(&mech->parameters, m->theta_mech_rad);
}

/* The constant load's share in it. */
static double constant_Nm(const mechanics_t *mech)
{
    return two_masses(mech) ? 0.0 : mech->load_Nm;
}

/* Torque on the rotor at rest, which friction may hold. */
static double drive_Nm(const mechanics_t *mech, const mechanics_motion_t *motion, double torque_Nm)
{
    return torque_Nm - resisting_Nm(mech, motion) - constant_Nm(mech);
}

/* Locked, or imposed: then the speed asked for, or where a ramp has brought it. */
static double given_speed(mechanics_t *mech, double omega_mech_rad_s)
{
    mech->slide = 0.0;
    if (mech->parameters.locked) {
        mech->ramping = false;
        return 0.0;
    }
    if (mech->ramping) {
        mech->imposed_rad_s = omega_mech_rad_s;
    }
    mech->ramping = mech->imposed_rate_rad_s2 != 0.0;
    mech->given_rad_s2 = mech->imposed_rate_rad_s2;
    return mech->imposed_rad_s;
}

/* Sticking or sliding; returns the speed. */
static double rub(mechanics_t *mech, const mechanics_motion_t *motion, double torque_Nm)
{
    double omega_rad_s = motion->omega_mech_rad_s;
    double moving = mech->slide * omega_rad_s;
    if (omega_rad_s != 0.0 && (mech->slide == 0.0 || moving > -MECHANICS_REVERSED_RAD_S)) {
        mech->slide = mech->slide == 0.0 ? copysign(1.0, omega_rad_s) : mech->slide;
        return omega_rad_s;
    }
    double drive = drive_Nm(mech, motion, torque_Nm);
    mech->stuck = fabs(drive) <= mech->parameters.T_coulomb_Nm * BREAKAWAY;
    mech->slide = mech->stuck ? 0.0 : copysign(1.0, drive);
    return 0.0;
}

double mechanics_settle(mechanics_t *mech, const mechanics_motion_t *motion, double torque_Nm)
{
    double friction_Nm = mech->parameters.T_coulomb_Nm;
    double omega_rad_s = motion->omega_mech_rad_s;
    mech->gain_1_kgm2 = 0.0;
    mech->bias_Nm = 0.0;
    mech->given_rad_s2 = 0.0;
    mech->stuck = false;
    if (mech->parameters.locked || mech->imposed) {
        return given_speed(mech, omega_rad_s);
    }
    if (friction_Nm > 0.0) {
        omega_rad_s = rub(mech, motion, torque_Nm);
    }
    if (!mech->stuck) {
        mech->gain_1_kgm2 = 1.0 / mech->parameters.J_kgm2;
        mech->bias_Nm = -constant_Nm(mech) - mech->slide * friction_Nm;
    }
    return omega_rad_s;
}

double mechanics_stuck_excess(const mechanics_t *mech, const mechanics_motion_t *motion, double torque_Nm)
{
    return fabs(drive_Nm(mech, motion, torque_Nm)) / mech->parameters.T_coulomb_Nm - BREAKAWAY;
}

void mechanics_rates(const mechanics_t *mech, const mechanics_motion_t *m, double torque_Nm,
                     mechanics_motion_rate_t *rate)
{
    const plant_mech_t *p = &mech->parameters;
    double resisting_torque_Nm = resisting_Nm(mech, m);
    *rate = (mechanics_motion_rate_t){
        .omega_mech_rad_s2 = mechanics_rate(mech, m->omega_mech_rad_s, torque_Nm - resisting_torque_Nm),
    };
    if (two_masses(mech)) {
        double load_Nm = load_by_speed_Nm(p, m->omega_load_rad_s) +
                         load_by_angle_Nm(p, m->theta_mech_rad - m->twist_rad) + mech->load_Nm;
        rate->omega_load_rad_s2 = (resisting_torque_Nm - load_Nm) / p->J_load_kgm2;
        rate->twist_rad_s = m->omega_mech_rad_s - m->omega_load_rad_s;
    }
}
