// Configurations of the Kalman filters from their headers' formulas.
#pragma once

#include <algorithm>

#include "tests/contract/bench.h"

namespace bench
{

// Standard deviations. The last two are densities: what the speed and the angle wander in a second.
struct EkfNoise {
    double current_A = 3.5e-3; // a sample of the converter with its quantisation
    double voltage_V = 2.0;    // a period's mean: dead time, link, model
    double speed_rad_s = 100;
    double angle_rad = 0.05;
};

inline int32_t variance(double sigma, double least, double most)
{
    return static_cast<int32_t>(std::clamp(std::ldexp(sigma * sigma, PM_KALMAN_BITS), least, most));
}

template <int N> int32_t process(double sigma)
{
    return variance(sigma, PM_KALMAN_LEAST(N), PM_KALMAN_MOST_Q);
}

inline int32_t measurement(double sigma)
{
    return variance(sigma, PM_KALMAN_LEAST_R, PM_KALMAN_MOST_R);
}

inline ekf_full_config_t ekf_full_config(const Machine &m, const Base &b, EkfNoise noise = {})
{
    const double u_Wb = m.psi_m_Wb * b.omega_rad_s * b.period_s; // EMF of base speed in a period
    const double root = std::sqrt(b.period_s);
    ekf_full_config_t c = {};
    c.model = model(m, b);
    c.per_unit = fixed(b.psi_Wb() / u_Wb, 20);
    c.q_lambda = process<4>(noise.voltage_V * b.period_s / u_Wb);
    c.q_omega = process<4>(noise.speed_rad_s * root / (0.25 * b.omega_rad_s));
    c.q_delta = process<4>(noise.angle_rad * root / 0.25);
    c.r_d = measurement(m.L_d0_H * noise.current_A / u_Wb);
    c.r_q = measurement(m.L_q0_H * noise.current_A / u_Wb);
    return c;
}

// A current enters rho twice.
inline ekf_reduced_config_t ekf_reduced_config(const Machine &m, const Base &b, EkfNoise noise = {})
{
    const double u_Wb = m.psi_m_Wb * b.omega_rad_s * b.period_s;
    const double root = std::sqrt(b.period_s);
    const double rho = std::hypot(noise.voltage_V * b.period_s, std::sqrt(2) * m.L_d0_H * noise.current_A);
    ekf_reduced_config_t c = {};
    c.model = model(m, b);
    c.omega_min = fixed(std::max(rho / u_Wb, 0.02), 28);
    c.q_omega = process<2>(noise.speed_rad_s * root / b.omega_rad_s);
    c.q_delta = process<2>(noise.angle_rad * root);
    c.r = measurement(rho / u_Wb);
    return c;
}

} // namespace bench
