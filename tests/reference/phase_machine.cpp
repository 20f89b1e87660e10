#include "tests/reference/phase_machine.h"

#include <Eigen/LU>

#include <cmath>
#include <utility>

namespace reference
{

namespace
{
constexpr double deg = 3.14159265358979323846 / 180.0;
}

PhaseMachine::PhaseMachine(PhaseParameters parameters, double theta_e_rad)
    : p_(std::move(parameters)),
      x_(static_cast<size_t>(p_.phases) + 2 + (eddy() ? 2 * static_cast<size_t>(sets()) : 0), 0.0),
      ode_([this](const State &x, State &dxdt) { rates(x, dxdt); })
{
    x_[static_cast<size_t>(p_.phases)] = theta_e_rad;
}

int PhaseMachine::sets() const
{
    return p_.phases / 3;
}

int PhaseMachine::stars() const
{
    return p_.open ? 0 : sets();
}

bool PhaseMachine::eddy() const
{
    return p_.core && p_.R_eddy_ohm > 0.0;
}

double PhaseMachine::axis_rad(int phase) const
{
    return (120.0 * (phase % 3) + 30.0 * (phase / 3)) * deg;
}

// Each entry of the phase matrices of 1.3.1.1 turns with 2 theta - gamma_k - gamma_j: 2 theta for AA,
// 2 theta - 120 = 2 (theta + 120) for AB, and so on. Set 2 has its own angle theta - 30 degrees, from which
// its own axes 0, 120, 240 follow.
double PhaseMachine::self_or_mutual_H(int k, int j, double theta, double *by_theta) const
{
    double axes = axis_rad(k) + axis_rad(j);
    double x = 2.0 * theta - axes;
    if (k / 3 != j / 3) {
        double sum = (p_.M_d_H + p_.M_q_H) / 3.0;
        double difference = (p_.M_d_H - p_.M_q_H) / 3.0;
        *by_theta = -2.0 * difference * std::sin(x);
        return sum * std::cos(axis_rad(k) - axis_rad(j)) + difference * std::cos(x);
    }
    double mean = k == j ? p_.L_s0_H : p_.M_s0_H;
    double second = k == j ? p_.L_s2_H : p_.M_s2_H;
    double cross = k == j ? p_.L_c_H : p_.M_c_H;
    double value = mean - second * std::cos(x) - cross * std::sin(x);
    *by_theta = 2.0 * second * std::sin(x) - 2.0 * cross * std::cos(x);
    double set_rad = 30.0 * (k / 3) * deg;
    for (const Harmonic &h : p_.saliency) {
        double y = h.order * (theta - set_rad) + h.phase_rad - (axes - 2.0 * set_rad);
        value += 2.0 / 3.0 * h.amplitude * std::cos(y);
        *by_theta -= 2.0 / 3.0 * h.amplitude * h.order * std::sin(y);
    }
    for (const Harmonic &h : p_.zero_saliency) {
        double y = h.order * (theta - set_rad) + h.phase_rad - set_rad;
        value += h.amplitude / 3.0 * (std::cos(y + axis_rad(k)) + std::cos(y + axis_rad(j)));
        *by_theta -= h.order * h.amplitude / 3.0 * (std::sin(y + axis_rad(k)) + std::sin(y + axis_rad(j)));
    }
    return value;
}

void PhaseMachine::add_magnet(double theta, const Vector &i, Flux &flux) const
{
    for (int k = 0; k < p_.phases; k++) {
        double own = theta - axis_rad(k);
        double shifted = own - p_.emf_shift_rad(k);
        double slope = 0.0;
        for (const Harmonic &h : p_.magnet) {
            slope -= h.amplitude * h.order * std::sin(h.order * shifted + h.phase_rad);
        }
        slope *= 1.0 + p_.emf_gain(k);
        // The fundamental of a saturating core is in the core; here is what the phase deviates by.
        slope -= p_.core_psi_m_Wb * ((1.0 + p_.emf_gain(k)) * std::sin(shifted) - std::sin(own));
        flux.theta_Wb(k) += slope;
        flux.torque_Nm += p_.pole_pairs * i(k) * slope;
    }
}

// psi_k = psi_d cos(theta - gamma_k) - psi_q sin(theta - gamma_k), with psi_dq of
// i_d = 2/3 sum i_k cos(theta - gamma_k), i_q = -2/3 sum i_k sin(theta - gamma_k), set by set.
void PhaseMachine::add_core(const State &x, int set, Flux &flux) const
{
    double theta = x[static_cast<size_t>(p_.phases)];
    int first = 3 * set;
    Eigen::Matrix<double, 2, 3> axes, turned;
    for (int k = 0; k < 3; k++) {
        double own = theta - axis_rad(first + k);
        axes.col(k) << std::cos(own), -std::sin(own);
        turned.col(k) << -std::sin(own), -std::cos(own);
    }
    Eigen::Vector3d i_A = currents(x).segment<3>(first);
    Eigen::Vector2d i_theta_A = 2.0 / 3.0 * turned * i_A;
    FluxPoint point = (*p_.core)(2.0 / 3.0 * axes * i_A - eddy_A(x, set), theta - axis_rad(first));
    Core &core = flux.core[static_cast<size_t>(set)];
    core.to_dq = 2.0 / 3.0 * axes;
    core.L_H = point.L_H;
    core.theta_Wb = point.L_H * i_theta_A + point.psi_theta_Wb;
    flux.L_H.block<3, 3>(first, first) += axes.transpose() * point.L_H * core.to_dq;
    flux.theta_Wb.segment<3>(first) += turned.transpose() * point.psi_Wb + axes.transpose() * core.theta_Wb;
    flux.torque_Nm += p_.pole_pairs * (1.5 * point.psi_Wb.dot(i_theta_A) + point.coenergy_theta_J);
}

PhaseMachine::Flux PhaseMachine::flux(const State &x) const
{
    double theta = x[static_cast<size_t>(p_.phases)];
    Vector i = currents(x);
    Flux f{p_.L_added_H, Vector::Zero(p_.phases), 0.0, {}};
    Matrix L_theta = Matrix::Zero(p_.phases, p_.phases);
    for (int k = 0; k < p_.phases; k++) {
        for (int j = 0; j < p_.phases; j++) {
            double by_theta = 0.0;
            f.L_H(k, j) += self_or_mutual_H(k, j, theta, &by_theta);
            L_theta(k, j) = by_theta;
        }
    }
    f.theta_Wb += L_theta * i;
    f.torque_Nm = 0.5 * p_.pole_pairs * i.dot(L_theta * i);
    add_magnet(theta, i, f);
    for (int set = 0; p_.core && set < sets(); set++) {
        add_core(x, set, f);
    }
    for (const Harmonic &h : p_.cogging) {
        f.torque_Nm += h.amplitude * std::sin(h.order * theta + h.phase_rad);
    }
    return f;
}

Vector PhaseMachine::currents(const State &x) const
{
    return Eigen::Map<const Eigen::VectorXd>(x.data(), p_.phases);
}

Eigen::Vector2d PhaseMachine::eddy_A(const State &x, int set) const
{
    if (!eddy()) {
        return Eigen::Vector2d::Zero();
    }
    size_t at = static_cast<size_t>(p_.phases) + 2 + 2 * static_cast<size_t>(set);
    return {x[at], x[at + 1]};
}

Vector PhaseMachine::phase_voltages_V(const double v_leg_V[]) const
{
    Vector v(p_.phases);
    for (int k = 0; k < p_.phases; k++) {
        v(k) = v_leg_V[k] - (p_.open ? v_leg_V[k + 3] : 0.0);
    }
    return v;
}

// The core's flux changes by L_core (to_dq di/dt - di_e/dt) + omega theta_Wb, which drives the loops.
void PhaseMachine::add_eddy_loops(const State &x, double omega_e, const Flux &flux, Matrix &a,
                                  Vector &b) const
{
    Eigen::Vector2d L_eddy_H(p_.L_eddy_d_H, p_.L_eddy_q_H);
    for (int set = 0; set < sets(); set++) {
        const Core &core = flux.core[static_cast<size_t>(set)];
        int row = p_.phases + stars() + 2 * set;
        int first = 3 * set;
        a.block<3, 2>(first, row) = -1.5 * core.to_dq.transpose() * core.L_H;
        a.block<2, 3>(row, first) = -core.L_H * core.to_dq;
        a.block<2, 2>(row, row) = core.L_H;
        a.block<2, 2>(row, row) += L_eddy_H.asDiagonal();
        b.segment<2>(row) = omega_e * core.theta_Wb - p_.R_eddy_ohm * eddy_A(x, set);
    }
}

// L di/dt + v_N = v - R i - omega dpsi/dtheta with sum di/dt = 0 in each star.
Vector PhaseMachine::solve(const Vector &v, const State &x, Flux &at) const
{
    int n = p_.phases;
    double omega_e = p_.pole_pairs * x[static_cast<size_t>(n) + 1];
    Vector i = currents(x);
    at = flux(x);
    int unknowns = n + stars() + (eddy() ? 2 * sets() : 0);
    Matrix a = Matrix::Zero(unknowns, unknowns);
    Vector b = Vector::Zero(unknowns);
    a.topLeftCorner(n, n) = at.L_H;
    b.head(n) = v - p_.R_ohm.cwiseProduct(i) - omega_e * at.theta_Wb;
    for (int star = 0; star < stars(); star++) {
        a.block<3, 1>(3 * star, n + star).setOnes();
        a.block<1, 3>(n + star, 3 * star).setOnes();
    }
    if (eddy()) {
        add_eddy_loops(x, omega_e, at, a, b);
    }
    return a.partialPivLu().solve(b);
}

void PhaseMachine::rates(const State &x, State &dxdt) const
{
    auto n = static_cast<size_t>(p_.phases);
    Flux at;
    Vector solved = solve(v_V_, x, at);
    for (size_t k = 0; k < n; k++) {
        dxdt[k] = solved(static_cast<Eigen::Index>(k));
    }
    for (size_t k = n + 2; k < x.size(); k++) {
        dxdt[k] = solved(static_cast<Eigen::Index>(k - 2) + stars());
    }
    double omega = x[n + 1];
    dxdt[n] = p_.pole_pairs * omega;
    dxdt[n + 1] = imposed_ ? rate_rad_s2_ : (at.torque_Nm - p_.B_Nms * omega - load_Nm_) / p_.J_kgm2;
}

void PhaseMachine::impose_speed(double omega_mech_rad_s)
{
    imposed_ = true;
    x_[static_cast<size_t>(p_.phases) + 1] = omega_mech_rad_s;
}

void PhaseMachine::free_speed()
{
    imposed_ = false;
}

void PhaseMachine::set_load(double torque_Nm)
{
    load_Nm_ = torque_Nm;
}

void PhaseMachine::advance(const double v_leg_V[], double rate_rad_s2, double duration_s)
{
    v_V_ = phase_voltages_V(v_leg_V);
    rate_rad_s2_ = rate_rad_s2;
    ode_.advance(x_, duration_s);
}

double PhaseMachine::current_A(int phase) const
{
    return x_[static_cast<size_t>(phase)];
}

double PhaseMachine::theta_e_rad() const
{
    return x_[static_cast<size_t>(p_.phases)];
}

double PhaseMachine::omega_mech_rad_s() const
{
    return x_[static_cast<size_t>(p_.phases) + 1];
}

double PhaseMachine::torque_Nm() const
{
    return flux(x_).torque_Nm;
}

double PhaseMachine::zero_voltage_V(const double v_leg_V[], int set) const
{
    Flux at;
    Vector solved = solve(phase_voltages_V(v_leg_V), x_, at);
    double mean_V = (v_leg_V[3 * set] + v_leg_V[3 * set + 1] + v_leg_V[3 * set + 2]) / 3.0;
    return mean_V - solved(p_.phases + set);
}

} // namespace reference
