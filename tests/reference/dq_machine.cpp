#include "tests/reference/dq_machine.h"

#include <cmath>
#include <utility>

namespace reference
{

using Eigen::Vector2d;

DqMachine::DqMachine(DqParameters parameters, const Vector2d &psi_Wb, double theta_e_rad)
    : p_(std::move(parameters)), x_{psi_Wb(0), psi_Wb(1), 0.0, 0.0, theta_e_rad, 0.0},
      ode_([this](const State &x, State &dxdt) { rates(x, dxdt); })
{
}

DqMachine::Point DqMachine::point(const State &x) const
{
    Point at;
    at.psi_Wb << x[PSI_D], x[PSI_Q];
    CurrentPoint core = p_.core(at.psi_Wb, x[THETA_E]);
    at.i_A = core.i_A + Vector2d(x[EDDY_D], x[EDDY_Q]);
    double cross = at.psi_Wb(0) * at.i_A(1) - at.psi_Wb(1) * at.i_A(0);
    at.torque_Nm = p_.pole_pairs * (1.5 * cross + core.coenergy_theta_J);
    return at;
}

void DqMachine::rates(const State &x, State &dxdt) const
{
    Point at = point(x);
    double c = std::cos(x[THETA_E]);
    double s = std::sin(x[THETA_E]);
    double omega_e = p_.pole_pairs * x[OMEGA_MECH];
    dxdt[PSI_D] = c * v_alpha_V_ + s * v_beta_V_ - p_.R_s_ohm * at.i_A(0) + omega_e * at.psi_Wb(1);
    dxdt[PSI_Q] = c * v_beta_V_ - s * v_alpha_V_ - p_.R_s_ohm * at.i_A(1) - omega_e * at.psi_Wb(0);
    bool eddy = p_.R_eddy_ohm > 0.0;
    dxdt[EDDY_D] = eddy ? (dxdt[PSI_D] - p_.R_eddy_ohm * x[EDDY_D]) / p_.L_eddy_d_H : 0.0;
    dxdt[EDDY_Q] = eddy ? (dxdt[PSI_Q] - p_.R_eddy_ohm * x[EDDY_Q]) / p_.L_eddy_q_H : 0.0;
    dxdt[THETA_E] = omega_e;
    dxdt[OMEGA_MECH] =
        imposed_ ? rate_rad_s2_ : (at.torque_Nm - p_.B_Nms * x[OMEGA_MECH] - load_Nm_) / p_.J_kgm2;
}

void DqMachine::impose_speed(double omega_mech_rad_s)
{
    imposed_ = true;
    x_[OMEGA_MECH] = omega_mech_rad_s;
}

void DqMachine::free_speed()
{
    imposed_ = false;
}

void DqMachine::set_load(double torque_Nm)
{
    load_Nm_ = torque_Nm;
}

void DqMachine::advance(const double v_leg_V[], double rate_rad_s2, double duration_s)
{
    v_alpha_V_ = 2.0 / 3.0 * (v_leg_V[0] - 0.5 * v_leg_V[1] - 0.5 * v_leg_V[2]);
    v_beta_V_ = (v_leg_V[1] - v_leg_V[2]) / std::sqrt(3.0);
    rate_rad_s2_ = rate_rad_s2;
    ode_.advance(x_, duration_s);
}

double DqMachine::current_A(int phase) const
{
    double own = x_[THETA_E] - phase * 2.0 / 3.0 * 3.14159265358979323846;
    Vector2d i_A = point(x_).i_A;
    return i_A(0) * std::cos(own) - i_A(1) * std::sin(own);
}

double DqMachine::theta_e_rad() const
{
    return x_[THETA_E];
}

double DqMachine::omega_mech_rad_s() const
{
    return x_[OMEGA_MECH];
}

double DqMachine::torque_Nm() const
{
    return point(x_).torque_Nm;
}

} // namespace reference
