// Phases that are not alike: negative sequence that follows from R, L, M and EMF (METHODS.md 3.6.1, 5.5.1).
#include "validation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace validation
{
namespace
{

using reference::measured;

constexpr double bound_formula = 1e-3; // issue: 0.1 %

struct Sequences {
    Complex positive, negative;
};

// Steady currents of the locked, non-salient machine with a turning voltage, 400 steps a turn. Sampling at
// the steps' ends lets their ripple alias to 1/400^2.
Sequences turned(const plant_config_t &config, double omega)
{
    constexpr int steps = 400;
    rig::Plant plant(config);
    Fourier positive, negative;
    double step_s = 2.0 * rig::pi / (omega * steps);
    int settled = static_cast<int>(std::ceil(0.15 / (steps * step_s))) * steps; // 17 time constants
    for (int n = 0; n < settled + steps; n++) {
        hold(plant, legs(std::polar(4.0, 2.0 * rig::pi * n / steps)), step_s);
        if (n >= settled) {
            double angle = 2.0 * rig::pi * (n + 1) / steps;
            positive.add(current(plant.truth()), angle);
            negative.add(current(plant.truth()), -angle);
        }
    }
    return {positive.value(), negative.value()};
}

// With Z i + Z_delta conj(i) = v and no negative sequence in v, Z(-omega) I_n = - Z_delta conj(I_p): the
// voltage that the asymmetry makes is Z_delta I, 3.6.1.1.
Complex unlike_ohm(const plant_config_t &config, double omega)
{
    Sequences i_A = turned(config, omega);
    double mean_R = 0.0, mean_L = 0.0;
    for (int k = 0; k < 3; k++) {
        mean_R += config.winding.dR_ohm[k] / 3.0;
        mean_L += (config.winding.dL_H[k] - config.winding.dM_H[0][k]) / 3.0;
    }
    Complex Z_ohm(config.machine.R_s_ohm + mean_R, -omega * (config.machine.L_d0_H + mean_L));
    return -Z_ohm * i_A.negative / std::conj(i_A.positive);
}

plant_config_t locked_spm()
{
    plant_config_t config = spm_linear();
    config.mech.locked = true;
    return config;
}

TEST(Asymmetry, Resistance)
{
    plant_config_t config = locked_spm();
    const double dR_ohm[3] = {0.3 * 0.373, -0.02, 0.05};
    Complex sum = 0.0;
    for (int k = 0; k < 3; k++) {
        config.winding.dR_ohm[k] = dR_ohm[k];
        sum += dR_ohm[k] * std::polar(1.0, 240.0 * deg * k);
    }
    measured("asymmetry_R", std::abs(unlike_ohm(config, 100.0) / (sum / 3.0) - 1.0), bound_formula,
             "relative", "3.6.1.1");
}

// The formula of R with L; a mutual inductance between two phases counts twice, at the sum of their angles.
TEST(Asymmetry, Inductance)
{
    plant_config_t config = locked_spm();
    const double dL_H[3] = {2e-4, -5e-5, 1e-4};
    const double dM_H[3] = {-3e-5, 4e-5, 1e-5}; // AB, BC, CA
    Complex sum = 0.0;
    for (int k = 0; k < 3; k++) {
        config.winding.dL_H[k] = dL_H[k];
        config.winding.dM_H[0][k] = dM_H[k];
        double angle = 120.0 * deg * k;
        double other = 120.0 * deg * ((k + 1) % 3);
        sum += dL_H[k] * std::polar(1.0, 2.0 * angle) + 2.0 * dM_H[k] * std::polar(1.0, angle + other);
    }
    double omega = 300.0;
    // d/dt of conj(i) turning backwards: - j omega.
    Complex expected_ohm = -j * omega * sum / 3.0;
    measured("asymmetry_L", std::abs(unlike_ohm(config, omega) / expected_ohm - 1.0), bound_formula,
             "relative", "3.6.1.2");
}

// E_A = (1 + gain) E e^{-j shift}: its third less E/3 turns backwards.
TEST(Asymmetry, Emf)
{
    plant_config_t config = spm_linear();
    config.dclink.v_source_V = 100.0; // no diode conducts
    config.winding.emf_gain[0] = 0.06;
    config.winding.emf_shift_rad[1] = 0.05;
    rig::Plant plant(config);
    double omega = 2.0 * rig::pi * 50.0;
    plant_set_speed(plant, omega / 5.0);
    Fourier negative;
    for (int n = 0; n < 200; n++) {
        plant.run(rig::all_off());
        plant_truth_t t = plant.truth();
        negative.add(alphabeta(t.v_leg_V[0], t.v_leg_V[1], t.v_leg_V[2]), -t.theta_e_rad);
    }
    // Phase k adds (2/3) e_k e^{j gamma_k}, e_k = Re(E_k e^{j theta}); half of it turns backwards with
    // conj(E_k).
    Complex E_V = j * omega * 77.6e-3;
    Complex change_A = 0.06 * E_V;
    Complex change_B = (std::polar(1.0, -0.05) - 1.0) * E_V * std::polar(1.0, -120.0 * deg);
    Complex expected_V = (std::conj(change_A) + std::conj(change_B) * std::polar(1.0, 120.0 * deg)) / 3.0;
    measured("asymmetry_emf", std::abs(negative.value() / expected_V - 1.0), bound_formula, "relative",
             "3.6.1.3");
}

} // namespace
} // namespace validation
