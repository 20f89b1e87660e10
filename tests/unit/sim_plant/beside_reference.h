// One second of the plant beside a machine of tests/reference: double-precision initial-value problems at
// 1e-10, written independently in phase coordinates and in the rotor frame. Same leg voltages for both,
// constant over 100 us.
#ifndef TESTS_UNIT_SIM_PLANT_BESIDE_REFERENCE_H
#define TESTS_UNIT_SIM_PLANT_BESIDE_REFERENCE_H

#include "validation.h"

#include "tests/reference/dq_machine.h"
#include "tests/reference/phase_machine.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

namespace validation
{

// Issue: currents to 1e-4 of rated, angle to 1e-4 rad over 1 s.
constexpr double bound_current = 1e-4;
constexpr double bound_angle_rad = 1e-4;

constexpr double step_s = 100e-6;
constexpr double start_rad = 0.7;

struct Deviation {
    double current_A = 0.0, angle_rad = 0.0, torque_Nm = 0.0;
    double peak_A = 0.0, peak_rad_s = 0.0; // of the run: it must have been one
};

enum class Speed { imposed, free };

// Keeps the currents of the reference near a changing target; the plant gets the voltages that follow.
class Drive
{
  public:
    Drive(const plant_config_t &config, double rated_A)
        : sets_(config.winding.sets == 2 ? 2 : 1), open_(config.winding.connection == PLANT_OPEN),
          gain_ohm_(1000.0 * config.machine.L_d0_H + 2.0 * config.machine.R_s_ohm), rated_A_(rated_A),
          psi_m_Wb_(config.machine.psi_m_Wb), poles_(config.machine.pole_pairs)
    {
    }

    template <class Machine> Legs voltages(const Machine &machine, double t_s) const
    {
        Legs v_V{};
        for (int set = 0; set < sets_; set++) {
            double axis_rad = set * 30.0 * deg;
            double own = machine.theta_e_rad() - axis_rad;
            Complex i_A = alphabeta(machine.current_A(3 * set), machine.current_A(3 * set + 1),
                                    machine.current_A(3 * set + 2)) *
                          std::polar(1.0, -own);
            double omega_e = poles_ * machine.omega_mech_rad_s();
            Complex v_dq_V = gain_ohm_ * (target(t_s, set) - i_A) + Complex(0.0, omega_e * psi_m_Wb_);
            set_legs(v_V, 3 * set, v_dq_V * std::polar(1.0, own));
        }
        for (size_t k = 0; k < 3; k++) {
            // An open winding shares the voltage between its ends and gets 0.4 V of zero sequence.
            v_V[k + 3] += open_ ? -0.4 * v_V[k] - 0.4 : -10.0;
            v_V[k] *= open_ ? 0.6 : 1.0;
            v_V[k] += 7.0; // common modes, which a star must not notice
            v_V[k + 3] += 7.0;
        }
        return v_V;
    }

  private:
    Complex target(double t_s, int set) const
    {
        double side = set == 0 ? 1.0 : 0.8;
        if (t_s < 0.3) {
            return rated_A_ * side * Complex(-0.25, 0.75);
        }
        return rated_A_ * side * (t_s < 0.6 ? Complex(0.25, -1.0) : Complex(-0.6, 0.6));
    }

    int sets_;
    bool open_;
    double gain_ohm_, rated_A_, psi_m_Wb_;
    int poles_;
};

template <class Machine>
void note(Deviation &worst, const plant_truth_t &t, const Machine &machine, int phases)
{
    for (int k = 0; k < phases; k++) {
        worst.current_A = std::max(worst.current_A, std::fabs(t.i_A[k] - machine.current_A(k)));
        worst.peak_A = std::max(worst.peak_A, std::fabs(t.i_A[k]));
    }
    worst.angle_rad = std::max(worst.angle_rad, std::fabs(t.theta_e_rad - machine.theta_e_rad()));
    worst.torque_Nm = std::max(worst.torque_Nm, std::fabs(t.torque_Nm - machine.torque_Nm()));
    worst.peak_rad_s = std::max(worst.peak_rad_s, std::fabs(t.omega_mech_rad_s));
}

// One second: imposed, the speed runs from 20 rad/s up and down again; free, the torque moves the rotor.
template <class Machine>
Deviation compare(const plant_config_t &config, Machine &machine, double rated_A, Speed speed)
{
    rig::Plant plant(config, start_rad);
    Drive drive(config, rated_A);
    if (speed == Speed::imposed) {
        plant_set_speed(plant, 20.0);
        machine.impose_speed(20.0);
    }
    int phases = config.winding.sets == 2 ? 6 : 3;
    int steps = static_cast<int>(std::lround(1.0 / step_s));
    Deviation worst;
    for (int k = 0; k < steps; k++) {
        Legs v_V = drive.voltages(machine, k * step_s);
        double rate_rad_s2 = speed == Speed::free ? 0.0 : (k < steps / 2 ? 150.0 : -200.0);
        if (k == steps * 4 / 5) {
            plant_set_load(plant, 0.5 * rated_A / 4.0);
            machine.set_load(0.5 * rated_A / 4.0);
        }
        plant_run_voltages(plant, v_V.data(), rate_rad_s2, step_s);
        machine.advance(v_V.data(), rate_rad_s2, step_s);
        note(worst, plant.truth(), machine, phases);
    }
    EXPECT_GT(worst.peak_A, 0.75 * rated_A);
    EXPECT_GT(worst.peak_rad_s, 20.0);
    return worst;
}

inline void report(const std::string &id, const Deviation &worst, double rated_A, const std::string &section)
{
    reference::measured(id + "_current", worst.current_A / rated_A, bound_current, "of_rated", section);
    reference::measured(id + "_angle", worst.angle_rad, bound_angle_rad, "rad", section);
}

inline const char *name(Speed speed)
{
    return speed == Speed::imposed ? "imposed" : "free";
}

inline Deviation in_phases(const plant_config_t &config, double rated_A, Speed speed,
                           const std::optional<reference::FluxMap> &core = {})
{
    reference::PhaseMachine machine(reference::phase_parameters(config, core), start_rad);
    return compare(config, machine, rated_A, speed);
}

inline Deviation in_dq(const plant_config_t &config, const reference::CurrentMap &core, double psi_m_Wb,
                       Speed speed)
{
    const plant_winding_t &w = config.winding;
    reference::DqMachine machine({core, config.machine.R_s_ohm, config.machine.pole_pairs, config.mech.J_kgm2,
                                  config.mech.B_Nms, w.L_eddy_d_H, w.L_eddy_q_H, w.R_eddy_ohm},
                                 {psi_m_Wb, 0.0}, start_rad);
    return compare(config, machine, ipm_rated_A, speed);
}

} // namespace validation

#endif
