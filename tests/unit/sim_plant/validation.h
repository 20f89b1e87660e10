// What the validation tests share: machines of METHODS.md 14 on ideal sources, and Fourier sums.
#ifndef TESTS_UNIT_SIM_PLANT_VALIDATION_H
#define TESTS_UNIT_SIM_PLANT_VALIDATION_H

#include "rig.h"
#include "tests/reference/flux_map.h"
#include "tests/reference/measured.h"

#include <array>
#include <cmath>
#include <complex>

namespace validation
{

using Legs = std::array<double, PLANT_LEGS>;
using Complex = std::complex<double>;

constexpr double deg = rig::pi / 180.0;
constexpr Complex j(0.0, 1.0);

// A stiff inverter with no errors at all, for a machine that is given.
inline plant_config_t ideal(double R_s_ohm, double L_d_H, double L_q_H, double psi_m_Wb, int pole_pairs,
                            double v_dc_V)
{
    plant_config_t c{};
    c.machine.R_s_ohm = R_s_ohm;
    c.machine.L_d0_H = L_d_H;
    c.machine.L_q0_H = L_q_H;
    c.machine.psi_m_Wb = psi_m_Wb;
    c.machine.pole_pairs = pole_pairs;
    c.mech.J_kgm2 = 0.01;
    c.mech.B_Nms = 1e-3;
    c.inverter.f_pwm_Hz = 10e3;
    c.inverter.timer_counts = rig::counts;
    c.dclink.v_source_V = v_dc_V;
    c.sensor.i_full_scale_A = 10.0;
    c.sensor.v_full_scale_V = 1.5 * v_dc_V;
    return c;
}

constexpr double ipm_rated_A = 4.0;

// IPM-1000 with its inductances at zero current, not saturating.
inline plant_config_t ipm_linear()
{
    return ideal(6.0, 43e-3, 75e-3, 0.236, 3, 300.0);
}

inline plant_config_t ipm_saturating()
{
    plant_config_t c = ideal(6.0, 46.3e-3, 76.9e-3, 0.236, 3, 300.0);
    c.machine.c_A_Wb5 = 105.0;
    return c;
}

inline reference::CurrentMap energy_form(const plant_machine_t &m)
{
    return reference::energy_form(m.L_d0_H, m.L_q0_H, m.c_A_Wb5, m.psi_m_Wb);
}

// SPM-400, linear; rated 4 A.
inline plant_config_t spm_linear()
{
    return ideal(0.373, 3.24e-3, 3.24e-3, 77.6e-3, 5, 36.0);
}

// DTP-400, linear, with mutual inductance between the sets.
inline plant_config_t dtp_linear(double mutual)
{
    plant_config_t c = ideal(1.096, 3.0e-3, 3.3e-3, 73.4e-3, 5, 40.0);
    c.winding.sets = 2;
    c.winding.M_d_H = mutual * c.machine.L_d0_H;
    c.winding.M_q_H = mutual * c.machine.L_q0_H;
    return c;
}

// SPM-400 with both ends of its phases on the inverter.
inline plant_config_t open_winding()
{
    plant_config_t c = spm_linear();
    c.winding.connection = PLANT_OPEN;
    c.winding.L_0_H = 2.25e-3;
    c.winding.emf[0] = {3, 3.0e-3, 0.0};
    return c;
}

// Voltages of three legs, first phase at angle axis_rad.
inline void set_legs(Legs &v_V, int first, Complex v_alphabeta_V, double axis_rad = 0.0)
{
    for (int k = 0; k < 3; k++) {
        double own = axis_rad + k * 120.0 * deg;
        v_V[static_cast<size_t>(first + k)] = (v_alphabeta_V * std::polar(1.0, -own)).real();
    }
}

inline Legs legs(Complex v_alphabeta_V)
{
    Legs v_V{};
    set_legs(v_V, 0, v_alphabeta_V);
    return v_V;
}

inline void hold(plant_t *plant, const Legs &v_V, double duration_s)
{
    plant_run_voltages(plant, v_V.data(), 0.0, duration_s);
}

// alpha + j beta of three values.
inline Complex alphabeta(double a, double b, double c)
{
    return {(2.0 * a - b - c) / 3.0, (b - c) / std::sqrt(3.0)};
}

inline Complex current(const plant_truth_t &t)
{
    return alphabeta(t.i_A[0], t.i_A[1], t.i_A[2]);
}

// Part of a sampled value that turns with e^{j angle}: feed whole periods.
class Fourier
{
  public:
    void add(Complex value, double angle_rad)
    {
        sum_ += value * std::polar(1.0, -angle_rad);
        count_++;
    }

    Complex value() const
    {
        return sum_ / static_cast<double>(count_);
    }

  private:
    Complex sum_ = 0.0;
    int count_ = 0;
};

} // namespace validation

#endif
