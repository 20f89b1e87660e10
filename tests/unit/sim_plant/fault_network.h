// SPM-400 on a PWM whose duties do not change, at constant speed, as a linear circuit: a mean value, and one
// part at the frequency of the EMF. For the faults of validation_fault_test.cpp.
#ifndef TESTS_UNIT_SIM_PLANT_FAULT_NETWORK_H
#define TESTS_UNIT_SIM_PLANT_FAULT_NETWORK_H

#include "validation.h"

#include <Eigen/LU>

#include <algorithm>

namespace validation
{

constexpr double R_ohm = 0.373, L_H = 3.24e-3, psi_Wb = 77.6e-3, v_dc_V = 36.0, r_on_ohm = 0.05;
constexpr int turn_periods = 400; // 157 rad/s, EMF 12 V
constexpr double omega_e = 2.0 * rig::pi * 10e3 / turn_periods;

inline plant_config_t faulty()
{
    plant_config_t c = spm_linear();
    c.inverter = rig::inverter(10e3, 0.0, 0.0, 0.7, r_on_ohm);
    return c;
}

struct Phases {
    Complex A[3];
};

// The circuit at one frequency, by its node equations: sources behind r_on, or no leg at all, and the
// winding.
struct Network {
    double omega = 0.0; // with EMF; 0: the mean values
    bool tied[3] = {true, true, true};
    double source_V[3] = {0.0, 0.0, 0.0};
    int short_a = -1, short_b = -1; // short_b < 0: to the negative rail
    double short_ohm = 0.0;

    Complex emf_V(int k) const
    {
        return j * omega * psi_Wb * std::polar(1.0, -k * 120.0 * deg);
    }

    void tie(Eigen::Matrix4cd &G, int a, int b, Complex y_S) const
    {
        G(a, a) += y_S;
        if (b >= 0) {
            G(b, b) += y_S;
            G(a, b) -= y_S;
            G(b, a) -= y_S;
        }
    }

    // Terminals, then the star point.
    Eigen::Vector4cd potentials() const
    {
        Eigen::Matrix4cd G = Eigen::Matrix4cd::Identity() * 1e-9; // where nothing is tied
        Eigen::Vector4cd in_A = Eigen::Vector4cd::Zero();
        Complex y_S = 1.0 / (R_ohm + j * omega * L_H);
        for (int k = 0; k < 3; k++) {
            tie(G, k, 3, y_S);
            in_A(k) += y_S * emf_V(k);
            in_A(3) -= y_S * emf_V(k);
            if (tied[k]) {
                tie(G, k, -1, 1.0 / r_on_ohm);
                in_A(k) += source_V[k] / r_on_ohm;
            }
        }
        if (short_a >= 0) {
            tie(G, short_a, short_b, 1.0 / (short_ohm + j * omega * 1e-6));
        }
        return G.fullPivLu().solve(in_A);
    }

    Phases motor_A() const
    {
        Eigen::Vector4cd v = potentials();
        Phases i;
        for (int k = 0; k < 3; k++) {
            i.A[k] = (v(k) - v(3) - emf_V(k)) / (R_ohm + j * omega * L_H);
        }
        return i;
    }

    Phases leg_A() const
    {
        Eigen::Vector4cd v = potentials();
        Phases i;
        for (int k = 0; k < 3; k++) {
            i.A[k] = tied[k] ? (source_V[k] - v(k)) / r_on_ohm : 0.0;
        }
        return i;
    }
};

inline Network at_zero(Network mean)
{
    mean.omega = 0.0;
    return mean;
}

inline Network at_speed(Network mean)
{
    mean.omega = omega_e;
    std::fill(mean.source_V, mean.source_V + 3, 0.0); // constant duties
    return mean;
}

} // namespace validation

#endif
