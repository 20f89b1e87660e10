// A machine of three or six phases in phase coordinates, from METHODS.md 1.3.1.1 and 0.2, without any frame
// transformation: nothing is shared with sim_plant but the numbers.
//
//   v_k = R_k i_k + d psi_k/dt,   psi = L(theta) i + psi_magnet(theta)  [+ psi_core(i, theta)]
//   T = P (i' dL/dtheta i/2 + i' dpsi_magnet/dtheta)  [+ virtual work of the core]
//
// A star makes the sum of its currents zero; the voltage of its neutral is the Lagrange multiplier of that.
// An open winding has both ends of each phase on a leg and no constraint. Eddy loops (E19) sit on the axes of
// a core, which then carries i - i_e: L_e d i_e/dt = d psi_core/dt - R_e i_e.
#ifndef TESTS_REFERENCE_PHASE_MACHINE_H
#define TESTS_REFERENCE_PHASE_MACHINE_H

#include "sim_plant/plant_config.h"
#include "tests/reference/flux_map.h"
#include "tests/reference/ode.h"

#include <Eigen/Core>

#include <array>
#include <optional>
#include <vector>

namespace reference
{

constexpr int most_unknowns = 12; // six currents, two neutrals, four eddy currents
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_unknowns, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_unknowns, most_unknowns>;

struct Harmonic {
    int order;
    double amplitude, phase_rad;
};

struct PhaseParameters {
    int phases = 3; // axes at 0, 120, 240 and then 30, 150, 270 degrees
    bool open = false;
    int pole_pairs = 1;
    // L_AA = L_s0 - L_s2 cos 2 theta - L_c sin 2 theta, M_AB = M_s0 - M_s2 cos(2 theta + 240 deg) - M_c
    // sin(..). The second set is the first one turned by 30 degrees.
    double L_s0_H = 0, L_s2_H = 0, L_c_H = 0, M_s0_H = 0, M_s2_H = 0, M_c_H = 0;
    double M_d_H = 0, M_q_H = 0; // between the sets
    Vector R_ohm, emf_gain, emf_shift_rad;
    Matrix L_added_H;
    std::vector<Harmonic> magnet;        // psi_n cos(n (theta - gamma_k - shift_k) + phase), Wb
    std::vector<Harmonic> saliency;      // 2/3 L cos(x - gamma_k - gamma_j), x = n theta + phase, H
    std::vector<Harmonic> zero_saliency; // L/3 (cos(x + gamma_k) + cos(x + gamma_j)), H
    std::vector<Harmonic> cogging;       // T sin(n theta + phase), Nm
    std::optional<FluxMap> core;         // saturating part of each set with its fundamental magnet flux; ...
    double core_psi_m_Wb = 0;            // ... of this amplitude: what emf_gain and emf_shift act on
    double L_eddy_d_H = 0, L_eddy_q_H = 0, R_eddy_ohm = 0; // with a core; 0: none
    double J_kgm2 = 0, B_Nms = 0;
};

// The machine that a plant_config_t describes. A core is needed if c_A_Wb5 or map is set, and is not made
// from them here.
PhaseParameters phase_parameters(const plant_config_t &config, std::optional<FluxMap> core = {});

class PhaseMachine
{
  public:
    PhaseMachine(PhaseParameters parameters, double theta_e_rad);
    PhaseMachine(const PhaseMachine &) = delete; // its rates refer to it
    PhaseMachine &operator=(const PhaseMachine &) = delete;

    void impose_speed(double omega_mech_rad_s);
    void free_speed();
    void set_load(double torque_Nm);

    // Holds the legs at these voltages; an imposed speed moves linearly with the rate.
    void advance(const double v_leg_V[], double rate_rad_s2, double duration_s);

    double current_A(int phase) const;
    double theta_e_rad() const;
    double omega_mech_rad_s() const;
    double torque_Nm() const;
    // Mean of the leg voltages of a star against its neutral, with the legs at these voltages.
    double zero_voltage_V(const double v_leg_V[], int set) const;

  private:
    struct Core { // of one set, at its current less that of the eddy loops
        Eigen::Matrix<double, 2, 3> to_dq;
        Eigen::Matrix2d L_H;
        Eigen::Vector2d theta_Wb; // d psi_dq/d theta at constant phase and eddy currents
    };
    struct Flux {
        Matrix L_H;       // tangent
        Vector theta_Wb;  // d psi/d theta at constant currents
        double torque_Nm; // electromagnetic
        std::array<Core, 2> core;
    };
    int sets() const;
    int stars() const;
    bool eddy() const;
    double axis_rad(int phase) const;
    double self_or_mutual_H(int k, int j, double theta, double *by_theta) const;
    void add_magnet(double theta, const Vector &i, Flux &flux) const;
    void add_core(const State &x, int set, Flux &flux) const;
    void add_eddy_loops(const State &x, double omega_e, const Flux &flux, Matrix &a, Vector &b) const;
    Flux flux(const State &x) const;
    Vector phase_voltages_V(const double v_leg_V[]) const;
    Vector solve(const Vector &v, const State &x, Flux &flux) const; // di/dt, neutral voltages, di_e/dt
    void rates(const State &x, State &dxdt) const;
    Vector currents(const State &x) const;
    Eigen::Vector2d eddy_A(const State &x, int set) const;

    PhaseParameters p_;
    State x_; // currents, theta_e, omega_mech, eddy currents d and q of each set
    Vector v_V_;
    bool imposed_ = false;
    double rate_rad_s2_ = 0.0, load_Nm_ = 0.0;
    Ode ode_;
};

} // namespace reference

#endif
