// Flux maps of one three-phase set in the rotor frame, peak values (METHODS.md 0.1).
#ifndef TESTS_REFERENCE_FLUX_MAP_H
#define TESTS_REFERENCE_FLUX_MAP_H

#include <Eigen/Core>

#include <functional>

namespace reference
{

// Elements d, q.
struct FluxPoint {
    Eigen::Vector2d psi_Wb;
    Eigen::Matrix2d L_H;           // tangent
    Eigen::Vector2d psi_theta_Wb;  // by the electrical angle at constant i_dq; 0 for a mean map
    double coenergy_theta_J = 0.0; // likewise
};
using FluxMap = std::function<FluxPoint(const Eigen::Vector2d &i_A, double theta_e_rad)>;

struct CurrentPoint {
    Eigen::Vector2d i_A;
    Eigen::Matrix2d gamma_1_H; // tangent
    double coenergy_theta_J = 0.0;
};
using CurrentMap = std::function<CurrentPoint(const Eigen::Vector2d &psi_Wb, double theta_e_rad)>;

FluxMap linear_flux(double L_d_H, double L_q_H, double psi_m_Wb);

// E1: i_d = psi_d/L_d0 + c psi_d |psi|^4 - i_f, i_q = psi_q/L_q0 + c psi_q |psi|^4, i_f from psi_m.
CurrentMap energy_form(double L_d0_H, double L_q0_H, double c_A_Wb5, double psi_m_Wb);

// A saturating and cross-coupling map in closed form, the gradient of
//   U = L_d i_d^2/2 + L_q i_q^2/2 + K s,   s = sqrt(1 + u^2 + w^2), u = (i_d + i_f)/I_d, w = i_q/I_q.
// U is the co-energy W'/1.5. Constants of an interior machine like IPM-1000.
struct RootMap {
    double L_d_H = 10e-3, L_q_H = 12e-3;
    double K_J = 3.46;
    double I_d_A = 8.0, I_q_A = 7.0, i_f_A = 5.0;

    double coenergy_J(const Eigen::Vector2d &i_A) const; // U
    FluxPoint operator()(const Eigen::Vector2d &i_A, double theta_e_rad) const;
};

// Newton's method to rounding.
CurrentMap inverse(FluxMap map);
FluxMap inverse(CurrentMap map);

} // namespace reference

#endif
