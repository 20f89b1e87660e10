#include "tests/reference/flux_map.h"

#include <Eigen/LU>

#include <cmath>
#include <stdexcept>
#include <tuple>
#include <utility>

namespace reference
{

using Eigen::Matrix2d;
using Eigen::Vector2d;

FluxMap linear_flux(double L_d_H, double L_q_H, double psi_m_Wb)
{
    return [=](const Vector2d &i_A, double) {
        FluxPoint p;
        p.L_H = Vector2d(L_d_H, L_q_H).asDiagonal();
        p.psi_Wb = p.L_H * i_A + Vector2d(psi_m_Wb, 0.0);
        p.psi_theta_Wb.setZero();
        return p;
    };
}

CurrentMap energy_form(double L_d0_H, double L_q0_H, double c_A_Wb5, double psi_m_Wb)
{
    Vector2d gamma(1.0 / L_d0_H, 1.0 / L_q0_H);
    double i_f_A = gamma(0) * psi_m_Wb + c_A_Wb5 * std::pow(psi_m_Wb, 5);
    return [=](const Vector2d &psi_Wb, double) {
        double psi2 = psi_Wb.squaredNorm();
        CurrentPoint p;
        p.i_A = gamma.cwiseProduct(psi_Wb) + c_A_Wb5 * psi2 * psi2 * psi_Wb - Vector2d(i_f_A, 0.0);
        p.gamma_1_H = gamma.asDiagonal();
        p.gamma_1_H += c_A_Wb5 * psi2 * (psi2 * Matrix2d::Identity() + 4.0 * psi_Wb * psi_Wb.transpose());
        return p;
    };
}

double RootMap::coenergy_J(const Vector2d &i_A) const
{
    double u = (i_A(0) + i_f_A) / I_d_A;
    double w = i_A(1) / I_q_A;
    return 0.5 * (L_d_H * i_A(0) * i_A(0) + L_q_H * i_A(1) * i_A(1)) + K_J * std::sqrt(1.0 + u * u + w * w);
}

FluxPoint RootMap::operator()(const Vector2d &i_A, double) const
{
    double u = (i_A(0) + i_f_A) / I_d_A;
    double w = i_A(1) / I_q_A;
    double s = std::sqrt(1.0 + u * u + w * w);
    double s3 = s * s * s;
    FluxPoint p;
    p.psi_Wb << L_d_H * i_A(0) + K_J * u / (s * I_d_A), L_q_H * i_A(1) + K_J * w / (s * I_q_A);
    double cross = -K_J * u * w / (s3 * I_d_A * I_q_A);
    p.L_H << L_d_H + K_J * (1.0 + w * w) / (s3 * I_d_A * I_d_A), cross, cross,
        L_q_H + K_J * (1.0 + u * u) / (s3 * I_q_A * I_q_A);
    p.psi_theta_Wb.setZero();
    return p;
}

namespace
{

// Solves value(x) = target; the functor returns value and Jacobian. The maps are gradients of convex
// functions, so that halving a step that does not help always leads on.
template <class Function> Vector2d newton(Function at, const Vector2d &target, Vector2d x)
{
    auto [value, jacobian] = at(x);
    Vector2d rest = target - value;
    for (int k = 0; k < 100; k++) {
        Vector2d step = jacobian.inverse() * rest;
        if (!step.allFinite()) {
            break;
        }
        double part = 1.0;
        for (;; part *= 0.5) {
            std::tie(value, jacobian) = at(x + part * step);
            if ((target - value).norm() < rest.norm() || part * step.norm() <= 1e-14 * (1.0 + x.norm())) {
                break;
            }
        }
        x += part * step;
        rest = target - value;
        if (part * step.norm() <= 1e-14 * (1.0 + x.norm())) {
            return x;
        }
    }
    throw std::runtime_error("reference: no inverse of the flux map");
}

} // namespace

CurrentMap inverse(FluxMap map)
{
    return [map = std::move(map)](const Vector2d &psi_Wb, double theta_e_rad) {
        auto at = [&](const Vector2d &i_A) {
            FluxPoint p = map(i_A, theta_e_rad);
            return std::pair<Vector2d, Matrix2d>(p.psi_Wb, p.L_H);
        };
        CurrentPoint p;
        p.i_A = newton(at, psi_Wb, Vector2d::Zero());
        FluxPoint there = map(p.i_A, theta_e_rad);
        p.gamma_1_H = there.L_H.inverse();
        p.coenergy_theta_J = there.coenergy_theta_J;
        return p;
    };
}

FluxMap inverse(CurrentMap map)
{
    return [map = std::move(map)](const Vector2d &i_A, double theta_e_rad) {
        auto at = [&](const Vector2d &psi_Wb) {
            CurrentPoint p = map(psi_Wb, theta_e_rad);
            return std::pair<Vector2d, Matrix2d>(p.i_A, p.gamma_1_H);
        };
        FluxPoint p;
        p.psi_Wb = newton(at, i_A, Vector2d::Zero());
        p.L_H = map(p.psi_Wb, theta_e_rad).gamma_1_H.inverse();
        p.psi_theta_Wb.setZero(); // the energy form knows no angle
        return p;
    };
}

} // namespace reference
