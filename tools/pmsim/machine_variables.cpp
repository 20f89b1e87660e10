#include "tools/pmsim/machine_variables.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "firmware/drive/config.h"
#include "firmware/params/parameters.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const double two_pi = 6.283185307179586;

// Of the demonstration, for a pace of 1, s.
const double found_s = 0.4, up_s = 1.05, turned_s = 1.3, stopped_s = 0.55, loaded_s = 0.18;
const double dip = 0.3; // of rated speed; under a fan the integral then settles with 2 dip load_ramp_s
const double control_reserve = 0.95; // of the largest voltage is left for control
const double rounded_deg = 0.1;      // what rounded values make of it
const double settled = 4.0;          // of its speed control's bandwidth, Hz s

double si(const Setup &setup, drive_param_id_t id)
{
    return parameter_si(*setup.params, id);
}

// What the drive refuses is said when it is made.
bool starts_by_saliency(const Setup &setup)
{
    drive_config_t config = {};
    return drive_configure(&config, setup.params.get(), PM_CHANNELS).ok && config.injection;
}

double load_ramp_s(const Setup &setup)
{
    const double w_s = two_pi * si(setup, DRIVE_PARAM_speed_bandwidth);
    const double speed = setup.rated.speed_rated_rad_s;
    const double lost = setup.rated.torque_rated_Nm / (setup.plant.mech.J_kgm2 * w_s); // by a step
    return lost <= dip * speed ? 0.0 : 4.0 * lost / (w_s * dip * speed);
}

double pace(const Setup &setup, bool salient, double load_s)
{
    const double ramp_s = setup.rated.speed_rated_rad_s / si(setup, DRIVE_PARAM_acceleration);
    const double dragged_s =
        salient ? 0.0
                : si(setup, DRIVE_PARAM_speed_high) / si(setup, DRIVE_PARAM_open_loop_acceleration) + 0.1;
    const double late_s = salient ? 0.0 : std::max(0.0, si(setup, DRIVE_PARAM_t_align) + 0.1 - found_s);
    return std::max({1.0, (late_s + dragged_s + ramp_s) / up_s, 2.0 * (dragged_s + ramp_s) / turned_s,
                     (dragged_s + ramp_s) / stopped_s, settled / si(setup, DRIVE_PARAM_speed_bandwidth),
                     load_s / loaded_s});
}

// What the drive is told of the motor, in SI.
struct Motor {
    double p, R_ohm, L_d_H, L_q_H, psi_Wb, i_rated_A;

    explicit Motor(const Setup &setup)
        : p(si(setup, DRIVE_PARAM_pole_pairs)), R_ohm(si(setup, DRIVE_PARAM_R_s)),
          L_d_H(si(setup, DRIVE_PARAM_L_d)), L_q_H(si(setup, DRIVE_PARAM_L_q_rated)),
          psi_Wb(si(setup, DRIVE_PARAM_psi_m)), i_rated_A(setup.rated.i_rated_A)
    {
    }

    double active_Wb(double i_d) const
    {
        return psi_Wb - (L_q_H - L_d_H) * i_d;
    }

    // i_d of most torque with a current i (section 1.3.2.3)
    double mtpa_A(double i) const
    {
        const double salient_H = L_q_H - L_d_H;
        return salient_H > 0
                   ? (psi_Wb - std::hypot(psi_Wb, std::sqrt(8.0) * salient_H * i)) / (4.0 * salient_H)
                   : 0.0;
    }

    std::complex<double> current_A(double torque_Nm, double i_d) const
    {
        return {i_d, torque_Nm / (1.5 * p * active_Wb(i_d))};
    }

    // By the most torque a current has: a current of that torque.
    std::complex<double> least_A(double torque_Nm) const
    {
        std::complex<double> i = current_A(torque_Nm, 0.0);
        for (int round = 0; round < 50; ++round) {
            i = current_A(torque_Nm, mtpa_A(std::abs(i)));
        }
        return i;
    }

    double voltage_V(std::complex<double> i, double omega_e) const
    {
        const std::complex<double> psi = {psi_Wb + L_d_H * i.real(), L_q_H * i.imag()};
        return std::abs(R_ohm * i + std::complex<double>(0.0, omega_e) * psi);
    }
};

// At rated speed with that torque of the shaft.
bool link_bears(const Setup &setup, const Motor &motor, double torque_Nm)
{
    const double link_V = setup.plant.dclink.v_source_V / (leg_count(setup.plant) > 3 ? 1.0 : std::sqrt(3.0));
    const double top_V = control_reserve * si(setup, DRIVE_PARAM_voltage_limit) * link_V;
    const double omega_e = motor.p * setup.rated.speed_rated_rad_s;
    const double weakest_A = std::min(motor.mtpa_A(motor.i_rated_A), -si(setup, DRIVE_PARAM_i_fw_max));
    const int steps = 50;
    bool bears = false;
    for (int k = 0; k <= steps; ++k) {
        const std::complex<double> i = motor.current_A(torque_Nm, weakest_A * k / steps);
        bears =
            bears || (std::abs(i) <= si(setup, DRIVE_PARAM_i_max) && motor.voltage_V(i, omega_e) <= top_V);
    }
    return bears;
}

double drag_Nm(const Setup &setup)
{
    const double speed = setup.rated.speed_rated_rad_s;
    return setup.plant.mech.T_coulomb_Nm + setup.plant.mech.B_Nms * speed;
}

double bears(const Setup &setup, const Motor &motor)
{
    const int parts = 100;
    int part = parts;
    while (part > 1 &&
           !link_bears(setup, motor, setup.rated.torque_rated_Nm * part / parts + drag_Nm(setup))) {
        --part;
    }
    return static_cast<double>(part) / parts;
}

double told_deg(const Setup &setup, const Motor &motor, double torque_Nm)
{
    const plant_machine_t &m = setup.plant.machine;
    if (setup.flux_map || m.L_q0_H <= 0) {
        return 0.0;
    }
    const double L_q_H = 1.0 / (1.0 / m.L_q0_H + m.c_A_Wb5 * std::pow(m.psi_m_Wb, 4)); // without current
    const double miss_H = motor.L_q_H * (L_q_H / si(setup, DRIVE_PARAM_L_q) - 1.0);
    const std::complex<double> i = motor.least_A(torque_Nm);
    const double deg = 360.0 / two_pi * std::atan(std::abs(miss_H * i.imag() / motor.active_Wb(i.real())));
    return deg < rounded_deg ? 0.0 : deg;
}

double start_turn_deg(const Setup &setup, const Motor &motor, bool salient)
{
    const bool saturates = setup.flux_map || setup.plant.machine.c_A_Wb5 != 0.0;
    return salient ? (saturates ? 5.0 : std::max(5.0, 105.0 / motor.p)) : 360.0 / motor.p;
}

} // namespace

Variables machine_variables(const Setup &setup)
{
    const int digits = 12;
    const bool salient = starts_by_saliency(setup);
    const double load_s = load_ramp_s(setup);
    const Motor motor(setup);
    const double share = bears(setup, motor);
    return {
        {"machine", setup.name},
        {"salient", salient ? "1" : "0"},
        {"round", salient ? "0" : "1"},
        {"start_turn_deg", format(start_turn_deg(setup, motor, salient), digits)},
        {"bears", format(share, digits)},
        {"drag_rel", format(drag_Nm(setup) / setup.rated.torque_rated_Nm, digits)},
        {"told_deg", format(told_deg(setup, motor, share * setup.rated.torque_rated_Nm), digits)},
        {"load_ramp_s", format(load_s, digits)},
        {"pace", format(pace(setup, salient, load_s), digits)},
    };
}

} // namespace pmsim
