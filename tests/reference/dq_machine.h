// The machine of METHODS.md 0.1 in the rotor frame, for any flux map, with the shorted eddy loop of E19:
//
//   d psi/dt = v - R i - omega J psi,   i = i_core(psi) + i_e,   L_e d i_e/dt = d psi/dt - R_e i_e,
//   T = P (1.5 (psi_d i_q - psi_q i_d) + dW'/dtheta)
//
// A star of three phases with the first leg on axis A; its zero sequence carries no current.
#ifndef TESTS_REFERENCE_DQ_MACHINE_H
#define TESTS_REFERENCE_DQ_MACHINE_H

#include "tests/reference/flux_map.h"
#include "tests/reference/ode.h"

#include <Eigen/Core>

namespace reference
{

struct DqParameters {
    CurrentMap core;
    double R_s_ohm;
    int pole_pairs;
    double J_kgm2, B_Nms;
    double L_eddy_d_H = 0.0, L_eddy_q_H = 0.0, R_eddy_ohm = 0.0; // 0: none
};

class DqMachine
{
  public:
    // Without current: psi is the magnet's.
    DqMachine(DqParameters parameters, const Eigen::Vector2d &psi_Wb, double theta_e_rad);
    DqMachine(const DqMachine &) = delete; // its rates refer to it
    DqMachine &operator=(const DqMachine &) = delete;

    void impose_speed(double omega_mech_rad_s);
    void free_speed();
    void set_load(double torque_Nm);
    void advance(const double v_leg_V[], double rate_rad_s2, double duration_s);

    double current_A(int phase) const;
    double theta_e_rad() const;
    double omega_mech_rad_s() const;
    double torque_Nm() const;

  private:
    enum { PSI_D, PSI_Q, EDDY_D, EDDY_Q, THETA_E, OMEGA_MECH, STATES };
    struct Point {
        Eigen::Vector2d psi_Wb, i_A; // i: of the terminals
        double torque_Nm;
    };
    Point point(const State &x) const;
    void rates(const State &x, State &dxdt) const;

    DqParameters p_;
    State x_;
    double v_alpha_V_ = 0.0, v_beta_V_ = 0.0;
    bool imposed_ = false;
    double rate_rad_s2_ = 0.0, load_Nm_ = 0.0;
    Ode ode_;
};

} // namespace reference

#endif
