// machine.h: the flux map is the gradient of one energy, and has the figures of METHODS.md 14; machines of
// every kind obey Faraday and keep energy.
extern "C" {
#include "sim_plant/machine.h"
}

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace
{

// Central differences of smooth functions: about eps^(2/3) of the value.
constexpr double difference_tolerance = 1e-8;
constexpr double step_Wb = 1e-6;
// The figures of METHODS.md 14 are given to two or three digits: half of the last.
constexpr double figure_mH = 0.05, figure_unsat_mH = 0.5, figure_Nm = 0.005;

const plant_machine_t ipm_1000 = {6.0, 46.3e-3, 76.9e-3, 105.0, 0.236, 3};

rotor_t rotor_at(double theta)
{
    return rotor_t{std::cos(theta), std::sin(theta)};
}

class FluxMap : public testing::Test
{
  protected:
    FluxMap()
    {
        plant_config_t config{};
        config.machine = ipm_1000;
        machine_set(&machine, &config, 25.0, 25.0);
    }

    // Stored energy with the given flux in stationary coordinates and a turned rotor.
    double energy(double psi_alpha, double psi_beta, double turn = 0.0) const
    {
        machine_state_t state{};
        machine_point_t point;
        state.u[0] = psi_alpha;
        state.u[1] = psi_beta;
        state.rotor = rotor_at(turn);
        machine_evaluate(&machine, &state, &point);
        return machine_energy_J(&machine, &state, &point);
    }

    dq_t current(double psi_d, double psi_q) const
    {
        return machine_current_A(&machine, dq_t{psi_d, psi_q});
    }

    // Flux for a current, by nested bisection: each current rises with its own flux.
    dq_t flux(double i_d, double i_q) const
    {
        auto root = [](auto f) {
            double low = -1.0, high = 1.0;
            for (int k = 0; k < 60; k++) {
                double mid = 0.5 * (low + high);
                (f(mid) > 0.0 ? high : low) = mid;
            }
            return 0.5 * (low + high);
        };
        auto psi_q_of = [&](double psi_d) {
            return root([&](double psi_q) { return current(psi_d, psi_q).q - i_q; });
        };
        double psi_d = root([&](double d) { return current(d, psi_q_of(d)).d - i_d; });
        return dq_t{psi_d, psi_q_of(psi_d)};
    }

    machine_t machine{};
};

// Flux for a core current, from one nearby, by Newton's method with the tangent that the tests above verify.
dq_t flux_near(const machine_t &machine, dq_t i_A, dq_t psi_Wb)
{
    for (int k = 0; k < 20; k++) {
        dq_t now = machine_current_A(&machine, psi_Wb);
        machine_tangent_t g = machine_tangent_1_H(&machine, psi_Wb);
        double det = g.d * g.q - g.dq * g.dq;
        double d = i_A.d - now.d, q = i_A.q - now.q;
        psi_Wb.d += (g.q * d - g.dq * q) / det;
        psi_Wb.q += (g.d * q - g.dq * d) / det;
    }
    return psi_Wb;
}

template <typename F> double slope(F f, double x)
{
    return (f(x + step_Wb) - f(x - step_Wb)) / (2.0 * step_Wb);
}

TEST_F(FluxMap, MagnetFluxIsTheFluxAtZeroCurrent)
{
    dq_t i = current(ipm_1000.psi_m_Wb, 0.0);
    EXPECT_NEAR(i.d, 0.0, 1e-14);
    EXPECT_EQ(i.q, 0.0);
}

TEST_F(FluxMap, IsReciprocalAndHasTheTangentItStates)
{
    for (double psi_d = -0.1; psi_d < 0.45; psi_d += 0.11) {
        for (double psi_q = -0.35; psi_q < 0.36; psi_q += 0.14) {
            double dd = slope([&](double x) { return current(x, psi_q).d; }, psi_d);
            double dq = slope([&](double x) { return current(psi_d, x).d; }, psi_q);
            double qd = slope([&](double x) { return current(x, psi_q).q; }, psi_d);
            double qq = slope([&](double x) { return current(psi_d, x).q; }, psi_q);
            machine_tangent_t tangent = machine_tangent_1_H(&machine, dq_t{psi_d, psi_q});
            EXPECT_NEAR(dq, qd, difference_tolerance * dd);
            EXPECT_NEAR(tangent.d, dd, difference_tolerance * dd);
            EXPECT_NEAR(tangent.dq, dq, difference_tolerance * dd);
            EXPECT_NEAR(tangent.q, qq, difference_tolerance * dd);
        }
    }
}

TEST_F(FluxMap, CurrentsAreTheSlopeOfTheEnergy)
{
    dq_t psi = {0.19, 0.21};
    dq_t i = machine_current_A(&machine, psi);
    EXPECT_NEAR(slope([&](double x) { return energy(x, psi.q); }, psi.d), 1.5 * i.d, 1e-8);
    EXPECT_NEAR(slope([&](double x) { return energy(psi.d, x); }, psi.q), 1.5 * i.q, 1e-8);
}

// Virtual work: with the flux linkages held, a turn of the rotor takes its work from the field.
TEST_F(FluxMap, TorqueIsVirtualWork)
{
    for (double angle = -3.0; angle < 3.1; angle += 0.5) {
        dq_t psi = {0.236 + 0.1 * std::cos(angle), 0.25 * std::sin(angle)};
        auto turned = [&](double turn) { return energy(psi.d, psi.q, turn); };
        double torque = machine_torque_Nm(&machine, psi, machine_current_A(&machine, psi));
        EXPECT_NEAR(torque, -ipm_1000.pole_pairs * slope(turned, 0.0), 1e-7) << angle;
    }
}

TEST_F(FluxMap, HasTheIncrementalInductancesOfTheBook)
{
    auto incremental_mH = [&](double i_q, double *d, double *q, double *dq) {
        machine_tangent_t g = machine_tangent_1_H(&machine, flux(0.0, i_q));
        double det = g.d * g.q - g.dq * g.dq;
        *d = 1e3 * g.q / det;
        *q = 1e3 * g.d / det;
        *dq = -1e3 * g.dq / det;
    };
    double d, q, dq;
    incremental_mH(0.0, &d, &q, &dq);
    EXPECT_NEAR(d, 43.0, figure_unsat_mH);
    EXPECT_NEAR(q, 75.0, figure_unsat_mH);
    EXPECT_NEAR(dq, 0.0, 1e-9);
    incremental_mH(4.0, &d, &q, &dq);
    EXPECT_NEAR(d, 39.6, figure_mH);
    EXPECT_NEAR(q, 55.1, figure_mH);
    EXPECT_NEAR(dq, -6.8, figure_mH);
}

TEST_F(FluxMap, HasTheRatedTorque)
{
    dq_t psi = flux(0.0, 4.0);
    EXPECT_NEAR(machine_torque_Nm(&machine, psi, machine_current_A(&machine, psi)), 4.01, figure_Nm);
}

TEST_F(FluxMap, SaturatesTowardsTheMagnetOnly)
{
    // what tells north from south: the same current adds less flux along the magnet than against it
    double with = flux(4.0, 0.0).d - ipm_1000.psi_m_Wb;
    double against = ipm_1000.psi_m_Wb - flux(-4.0, 0.0).d;
    EXPECT_LT(with, 0.95 * against);
}

// A machine of each kind, at 25 degC unless it drifts.
struct Kind {
    const char *name;
    void (*make)(plant_config_t &);
};

void saturating(plant_config_t &c)
{
    c.machine = ipm_1000;
}

void asymmetric(plant_config_t &c)
{
    saturating(c);
    c.winding.dR_ohm[0] = 0.5;
    c.winding.dR_ohm[2] = -0.3;
    c.winding.dL_H[1] = 3e-3;
    c.winding.dM_H[0][2] = -2e-3;
    c.winding.emf_gain[0] = 0.05;
    c.winding.emf_shift_rad[1] = 0.03;
    c.winding.saliency[0] = {-4, 2e-3, 0.5};
    c.winding.emf[0] = {5, 8e-3, 0.1};
    c.winding.emf[1] = {7, -3e-3, 0.0};
}

void harmonics_only(plant_config_t &c)
{
    saturating(c);
    c.winding.emf[0] = {5, 8e-3, 0.1};
    c.winding.emf[1] = {11, -3e-3, 0.4};
}

void two_sets(plant_config_t &c)
{
    saturating(c);
    c.winding.sets = 2;
}

void two_linked_sets(plant_config_t &c)
{
    two_sets(c);
    c.winding.M_d_H = 20e-3;
    c.winding.M_q_H = 35e-3;
    c.winding.emf[0] = {3, 10e-3, 0.0};
    c.winding.emf[1] = {5, 4e-3, 0.0};
    c.winding.dR_ohm[4] = 0.4;
}

void open_winding(plant_config_t &c)
{
    saturating(c);
    c.winding.connection = PLANT_OPEN;
    c.winding.L_0_H = 12e-3;
    c.winding.dL_0_H = 6e-3;
    c.winding.L_c0_H = -2e-3;
    c.winding.emf[0] = {3, 20e-3, 0.3};
    c.winding.emf[1] = {9, 2e-3, 0.0};
}

void plain_open_winding(plant_config_t &c)
{
    saturating(c);
    c.winding.connection = PLANT_OPEN;
    c.winding.L_0_H = 12e-3;
}

void eddy(plant_config_t &c)
{
    saturating(c);
    c.winding.L_eddy_d_H = 90e-3;
    c.winding.L_eddy_q_H = 150e-3;
    c.winding.R_eddy_ohm = 40.0;
}

void eddy_on_one_axis(plant_config_t &c)
{
    two_linked_sets(c);
    c.winding.L_eddy_q_H = 150e-3;
    c.winding.R_eddy_ohm = 40.0;
}

void cogging(plant_config_t &c)
{
    saturating(c);
    c.winding.cogging[0] = {6, 0.08, 0.3};
    c.winding.alpha_R_1_K = 3.9e-3;
    c.winding.alpha_psi_1_K = -1.2e-3;
}

// Flux and co-energy of a table, with a sixth harmonic: the gradient of W/1.5 = psi_m i_d + L_d i_d^2/2 +
// L_q i_q^2/2 - x i_d i_q^2 + (y i_d + z i_q^2) cos 6 theta.
map_table_t *table()
{
    constexpr int across = 9, turns = 16;
    std::vector<double> grid, psi_d, psi_q;
    for (int k = 0; k < across; k++) {
        grid.push_back(-10.0 + 20.0 * k / (across - 1));
    }
    for (double d : grid) {
        for (double q : grid) {
            for (int k = 0; k < turns; k++) {
                double sixth = std::cos(2 * 3.14159265358979323846 * k / turns);
                psi_d.push_back(0.236 + 0.04 * d - 1e-4 * q * q + 4e-3 * sixth);
                psi_q.push_back(0.06 * q - 2e-4 * d * q + 1e-3 * q * sixth);
            }
        }
    }
    map_table_data_t data = {across, across, turns, 6, grid.data(), grid.data(), psi_d.data(), psi_q.data()};
    map_table_report_t report;
    const char *error = nullptr;
    map_table_t *map = map_table_create(&data, &report, &error);
    EXPECT_NE(map, nullptr) << error;
    return map;
}

void from_a_table(plant_config_t &c)
{
    static const std::unique_ptr<map_table_t, void (*)(map_table_t *)> map(table(), &map_table_destroy);
    saturating(c);
    c.map = map.get();
}

void table_with_the_rest(plant_config_t &c)
{
    two_linked_sets(c);
    from_a_table(c);
    c.winding.L_eddy_d_H = 90e-3;
    c.winding.L_eddy_q_H = 150e-3;
    c.winding.R_eddy_ohm = 40.0;
    c.winding.dL_H[4] = 2e-3;
    c.winding.alpha_psi_1_K = -1.2e-3;
}

class AnyMachine : public testing::TestWithParam<Kind>
{
  protected:
    static constexpr double turn_rad_s = 500.0; // electrical

    AnyMachine()
    {
        GetParam().make(config);
        machine_set(&machine, &config, 80.0, 60.0);
        if (HasBranch()) {
            const double axis[PLANT_LEGS] = {1.0, -1.0};
            machine_set_branch(&machine, axis, 3.0);
        }
        n = machine.winding.active;
    }

    static bool HasBranch()
    {
        return std::string(GetParam().name).find("shorted") == 0;
    }

    // Somewhere within the rated range, the same for the same seed.
    void at_random(unsigned seed)
    {
        std::mt19937 generator(seed);
        std::uniform_real_distribution<double> any(-1.0, 1.0);
        state = {};
        double theta = 3.0 * any(generator);
        state.theta_e_rad = theta;
        state.rotor = rotor_at(theta);
        for (int set = 0; set < machine.winding.sets; set++) {
            dq_t u = {0.2 + 0.15 * any(generator), 0.25 * any(generator)};
            if (config.map != nullptr) {
                u = dq_t{4.0 * any(generator), 5.0 * any(generator)};
            }
            ab_t turned = frame_to_ab(u, state.rotor);
            state.u[2 * set] = turned.alpha;
            state.u[2 * set + 1] = turned.beta;
            state.eddy_A[2 * set] = config.winding.L_eddy_d_H > 0.0 ? any(generator) : 0.0;
            state.eddy_A[2 * set + 1] = config.winding.L_eddy_q_H > 0.0 ? any(generator) : 0.0;
        }
        for (int a = 2 * machine.winding.sets; a < n; a++) {
            state.u[a] = 3.0 * any(generator);
        }
        for (int a = 0; a < n; a++) {
            v_V[a] = 150.0 * any(generator);
        }
        machine_evaluate(&machine, &state, &point);
        machine_rates(&machine, &state, &point, turn_rad_s, v_V, &rate);
    }

    struct Seen {
        machine_state_t state;
        machine_point_t point;
        std::array<double, ACTIVE> psi; // total, by coordinates
    };

    Seen seen(const machine_state_t &s) const
    {
        Seen x{s, {}, {}};
        machine_evaluate(&machine, &s, &x.point);
        for (int set = 0; set < machine.winding.sets; set++) {
            ab_t core = frame_to_ab(x.point.core[set].psi_Wb, s.rotor);
            x.psi[static_cast<size_t>(2 * set)] = core.alpha;
            x.psi[static_cast<size_t>(2 * set) + 1] = core.beta;
        }
        winding_point_t added{};
        winding_at(&machine.winding, s.rotor, n, &added);
        for (size_t a = 0; a < static_cast<size_t>(n); a++) {
            x.psi[a] += added.psi[a];
            for (int b = 0; b < n; b++) {
                x.psi[a] += added.L[a][b] * x.point.i_A[b];
            }
        }
        return x;
    }

    // By the rates, straight on or back
    Seen later(double t_s) const
    {
        machine_state_t s = state;
        for (int a = 0; a < n; a++) {
            s.u[a] += t_s * rate.u[a];
        }
        for (int e = 0; e < 2 * machine.winding.sets; e++) {
            s.eddy_A[e] += t_s * rate.eddy_A_s[e];
        }
        s.theta_e_rad += t_s * turn_rad_s;
        s.rotor = rotor_at(s.theta_e_rad);
        return seen(s);
    }

    double energy(const Seen &x) const
    {
        return machine_energy_J(&machine, &x.state, &x.point);
    }

    plant_config_t config{};
    machine_t machine{};
    int n = 0;
    machine_state_t state{};
    machine_point_t point{};
    machine_rate_t rate{};
    double v_V[ACTIVE]{};
};

void resistive_drop(const machine_t &machine, const double i_A[ACTIVE], double drop_V[ACTIVE])
{
    for (int a = 0; a < machine.winding.active; a++) {
        drop_V[a] = 0.0;
        for (int b = 0; b < machine.winding.active; b++) {
            drop_V[a] += machine.winding.R_ohm[a][b] * i_A[b];
        }
    }
}

// Central differences over 2 x 100 ns: h^2/6 (12 x 500/s)^3 of the smallest, and rounding, of some 100 V.
constexpr double h_s = 1e-7, faraday_V = 5e-6, faraday_A_s = 1e-2;
constexpr unsigned states = 20;

TEST_P(AnyMachine, VoltageIsResistiveDropAndChangeOfFlux)
{
    for (unsigned seed = 0; seed < states; seed++) {
        at_random(seed);
        Seen before = later(-h_s), after = later(h_s);
        double drop_V[ACTIVE];
        resistive_drop(machine, point.i_A, drop_V);
        for (size_t a = 0; a < static_cast<size_t>(n); a++) {
            double change_V = (after.psi[a] - before.psi[a]) / (2 * h_s);
            EXPECT_NEAR(drop_V[a] + change_V, v_V[a], faraday_V) << seed << " coordinate " << a;
        }
    }
}

TEST_P(AnyMachine, CurrentsMoveAsTheRatesSay)
{
    for (unsigned seed = 0; seed < states; seed++) {
        at_random(seed);
        Seen before = later(-h_s), after = later(h_s);
        for (int a = 0; a < n; a++) {
            double slope = (after.point.i_A[a] - before.point.i_A[a]) / (2 * h_s);
            EXPECT_NEAR(rate.i_A_s[a], slope, faraday_A_s + 1e-7 * std::fabs(slope)) << seed << " " << a;
        }
    }
}

// E19: L_eddy di_e/dt + R_eddy i_e = dpsi_core/dt in rotor coordinates; an axis without has no current.
TEST_P(AnyMachine, EddyCircuitsFollowTheCore)
{
    const double L[] = {config.winding.L_eddy_d_H, config.winding.L_eddy_q_H};
    for (unsigned seed = 0; seed < states; seed++) {
        at_random(seed);
        Seen before = later(-h_s), after = later(h_s);
        for (int set = 0; set < machine.winding.sets; set++) {
            dq_t b = before.point.core[set].psi_Wb, a = after.point.core[set].psi_Wb;
            const double emf_V[] = {(a.d - b.d) / (2 * h_s), (a.q - b.q) / (2 * h_s)};
            for (int axis = 0; axis < 2; axis++) {
                int e = 2 * set + axis;
                double law_V = L[axis] * rate.eddy_A_s[e] + config.winding.R_eddy_ohm * state.eddy_A[e];
                EXPECT_NEAR(law_V, L[axis] > 0.0 ? emf_V[axis] : 0.0, faraday_V) << seed << " " << e;
            }
        }
    }
}

TEST_P(AnyMachine, PowerBalances)
{
    for (unsigned seed = 0; seed < states; seed++) {
        at_random(seed);
        double stored_W = (energy(later(h_s)) - energy(later(-h_s))) / (2 * h_s);
        double drop_V[ACTIVE], in_W = 0.0, copper_W = 0.0;
        resistive_drop(machine, point.i_A, drop_V);
        for (int a = 0; a < n; a++) {
            in_W += machine.winding.weight[a] * v_V[a] * point.i_A[a];
            copper_W += machine.winding.weight[a] * drop_V[a] * point.i_A[a];
        }
        for (double i : state.eddy_A) {
            copper_W += 1.5 * config.winding.R_eddy_ohm * i * i;
        }
        double shaft_W = point.torque_Nm * turn_rad_s / config.machine.pole_pairs;
        EXPECT_NEAR(in_W, copper_W + stored_W + shaft_W,
                    1e-7 * (std::fabs(in_W) + std::fabs(copper_W) + 100.0))
            << seed;
    }
}

// At constant currents of terminals and eddy circuits the torque is the slope of the co-energy, the sum of
// flux times current less the energy.
TEST_P(AnyMachine, TorqueIsTheSlopeOfTheCoenergy)
{
    for (unsigned seed = 0; seed < states; seed++) {
        at_random(seed);
        auto coenergy = [&](double turn) {
            machine_state_t s = state;
            s.theta_e_rad += turn;
            s.rotor = rotor_at(s.theta_e_rad);
            for (int set = 0; set < machine.winding.sets; set++) {
                dq_t i = frame_to_dq(ab_t{point.i_A[2 * set], point.i_A[2 * set + 1]}, s.rotor);
                dq_t core = {i.d - state.eddy_A[2 * set], i.q - state.eddy_A[2 * set + 1]};
                dq_t u = config.map != nullptr ? core : flux_near(machine, core, point.core[set].psi_Wb);
                ab_t turned = frame_to_ab(u, s.rotor);
                s.u[2 * set] = turned.alpha;
                s.u[2 * set + 1] = turned.beta;
            }
            Seen x = seen(s);
            double sum = -energy(x);
            for (size_t a = 0; a < static_cast<size_t>(n); a++) {
                sum += machine.winding.weight[a] * x.psi[a] * point.i_A[a];
            }
            for (int set = 0; set < machine.winding.sets; set++) {
                dq_t psi = x.point.core[set].psi_Wb;
                double d = state.eddy_A[2 * set], q = state.eddy_A[2 * set + 1];
                sum += 1.5 * ((config.winding.L_eddy_d_H * d - psi.d) * d +
                              (config.winding.L_eddy_q_H * q - psi.q) * q);
            }
            return sum;
        };
        double step = 1e-5;
        double slope = (coenergy(step) - coenergy(-step)) / (2 * step);
        EXPECT_NEAR(point.torque_Nm, config.machine.pole_pairs * slope, 1e-6) << seed;
    }
}

TEST_P(AnyMachine, KickAddsItsFluxToTheWindings)
{
    const double L[] = {config.winding.L_eddy_d_H, config.winding.L_eddy_q_H};
    for (unsigned seed = 0; seed < states; seed++) {
        at_random(seed);
        Seen before = seen(state);
        double kick_Wb[ACTIVE], Y[ACTIVE][ACTIVE];
        for (int a = 0; a < n; a++) {
            kick_Wb[a] = 1e-8 * v_V[a]; // about 1e-6, and its square is nothing
        }
        machine_state_t s = state;
        machine_kick(&machine, &s, &point, kick_Wb);
        machine_admittance(&machine, &state, &point, Y);
        Seen after = seen(s);
        for (size_t a = 0; a < static_cast<size_t>(n); a++) {
            double move_A = 0.0;
            for (int b = 0; b < n; b++) {
                move_A += Y[a][b] * kick_Wb[b];
            }
            EXPECT_NEAR(after.psi[a] - before.psi[a], kick_Wb[a], 1e-10) << seed << " " << a;
            EXPECT_NEAR(after.point.i_A[a] - before.point.i_A[a], move_A, 1e-3 * std::fabs(move_A) + 1e-8);
        }
        for (int e = 0; e < 2 * machine.winding.sets; e++) {
            dq_t b = before.point.core[e / 2].psi_Wb, a = after.point.core[e / 2].psi_Wb;
            double core_Wb = e % 2 == 0 ? a.d - b.d : a.q - b.q;
            double moved_Wb = L[e % 2] * (s.eddy_A[e] - state.eddy_A[e]);
            EXPECT_NEAR(moved_Wb, L[e % 2] > 0.0 ? core_Wb : 0.0, 1e-10) << seed << " " << e;
        }
    }
}

TEST_P(AnyMachine, IdleSetsCarryNothing)
{
    if (HasBranch()) {
        GTEST_SKIP() << "a set with a shorted terminal is never idle";
    }
    for (unsigned seed = 0; seed < states; seed++) {
        at_random(seed);
        for (int set = 0; set < machine.winding.sets; set++) {
            machine_state_t s = state;
            machine_idle(&machine, &s, set);
            Seen x = seen(s);
            EXPECT_NEAR(x.point.i_A[2 * set], 0.0, 1e-12);
            EXPECT_NEAR(x.point.i_A[2 * set + 1], 0.0, 1e-12);
            if (machine.winding.zero >= 0) {
                EXPECT_EQ(x.point.i_A[machine.winding.zero], 0.0);
            }
            for (int e = 0; e < 2 * machine.winding.sets; e++) {
                EXPECT_EQ(s.eddy_A[e], state.eddy_A[e]) << "eddy currents go on";
            }
            if (machine.winding.sets == 2) {
                EXPECT_EQ(s.u[2 - 2 * set], state.u[2 - 2 * set]) << "the other set is left alone";
            }
        }
    }
}

TEST_P(AnyMachine, FluxOfTheFirstSetIsThatOfItsWinding)
{
    at_random(7);
    dq_t psi = machine_flux_Wb(&machine, &state, &point);
    Seen x = seen(state);
    dq_t expected = frame_to_dq(ab_t{x.psi[0], x.psi[1]}, state.rotor);
    EXPECT_NEAR(psi.d, expected.d, 1e-14);
    EXPECT_NEAR(psi.q, expected.q, 1e-14);
}

TEST_P(AnyMachine, IsSound)
{
    EXPECT_TRUE(machine_is_sound(&machine));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, AnyMachine,
    testing::Values(Kind{"saturating", saturating}, Kind{"asymmetric", asymmetric},
                    Kind{"harmonics_only", harmonics_only}, Kind{"two_sets", two_sets},
                    Kind{"two_linked_sets", two_linked_sets}, Kind{"open_winding", open_winding},
                    Kind{"plain_open_winding", plain_open_winding}, Kind{"eddy", eddy},
                    Kind{"eddy_on_one_axis", eddy_on_one_axis}, Kind{"cogging", cogging},
                    Kind{"from_a_table", from_a_table}, Kind{"table_with_the_rest", table_with_the_rest},
                    Kind{"shorted", saturating}, Kind{"shorted_and_asymmetric", asymmetric},
                    Kind{"shorted_two_sets", two_linked_sets}, Kind{"shorted_open_winding", open_winding}),
    [](const testing::TestParamInfo<Kind> &test) { return test.param.name; });

machine_t machine_of(void (*make)(plant_config_t &), double winding_degC, double magnet_degC,
                     void (*spoil)(plant_config_t &) = nullptr)
{
    plant_config_t config{};
    make(config);
    if (spoil != nullptr) {
        spoil(config);
    }
    machine_t machine;
    machine_set(&machine, &config, winding_degC, magnet_degC);
    return machine;
}

TEST(Machine, PlainOneIsKnownAndItsRatesAreVoltageLessDrop)
{
    machine_t machine = machine_of(saturating, 25.0, 25.0);
    EXPECT_TRUE(machine.plain);
    for (auto make : {asymmetric, two_sets, open_winding, eddy, cogging, from_a_table}) {
        EXPECT_FALSE(machine_of(make, 25.0, 25.0).plain);
    }
    machine_state_t state{};
    state.rotor = rotor_at(0.6);
    state.u[0] = 0.3;
    state.u[1] = 0.1;
    machine_point_t point;
    machine_evaluate(&machine, &state, &point);
    dq_t i = machine_current_A(&machine, frame_to_dq(ab_t{0.3, 0.1}, state.rotor));
    ab_t i_A = frame_to_ab(i, state.rotor);
    EXPECT_NEAR(point.i_A[0], i_A.alpha, 1e-14);
    EXPECT_NEAR(point.i_A[1], i_A.beta, 1e-14);
    const double v_V[ACTIVE] = {40.0, -70.0};
    machine_rate_t rate;
    machine_rates(&machine, &state, &point, 300.0, v_V, &rate);
    EXPECT_NEAR(rate.u[0], 40.0 - 6.0 * i_A.alpha, 1e-12);
    EXPECT_NEAR(rate.u[1], -70.0 - 6.0 * i_A.beta, 1e-12);
}

TEST(Machine, DriftsWithTemperature)
{
    machine_t machine = machine_of(cogging, 125.0, 75.0);
    EXPECT_NEAR(machine.R_s_ohm, 6.0 * 1.39, 1e-12);
    EXPECT_NEAR(machine.psi_m_Wb, 0.236 * 0.94, 1e-12);
    EXPECT_NEAR(machine.winding.R_ohm[0][0], 6.0 * 1.39, 1e-12);
    dq_t i = machine_current_A(&machine, dq_t{0.236 * 0.94, 0.0});
    EXPECT_NEAR(i.d, 0.0, 1e-13);
    // harmonics of the magnet as its fundamental, that of a table too
    auto weak = [](plant_config_t &c) { c.winding.alpha_psi_1_K = -1.2e-3; };
    machine_t harmonics = machine_of(harmonics_only, 25.0, 75.0, weak);
    EXPECT_NEAR(harmonics.winding.flux[0].cosine[0], 0.94 * 8e-3 * std::cos(0.1), 1e-12);
    machine_t table = machine_of(from_a_table, 25.0, 75.0, weak);
    machine_state_t state{};
    state.rotor = rotor_at(0.0);
    machine_point_t point;
    machine_evaluate(&table, &state, &point);
    EXPECT_NEAR(machine_flux_Wb(&table, &state, &point).d, 0.24 - 0.06 * 0.236,
                1e-6); // with 4 mWb of the sixth
}

// One at which no current makes sense, in each way that a winding can spoil it.
TEST(Machine, IsNotSoundWithANegativeInductance)
{
    auto sound = [](void (*make)(plant_config_t &), void (*spoil)(plant_config_t &)) {
        machine_t machine = machine_of(make, 25.0, 25.0, spoil);
        return machine_is_sound(&machine);
    };
    // L_d = 43 mH and L_q = 75 mH without current; what a phase adds counts two thirds of it along its axis
    EXPECT_TRUE(sound(saturating, [](plant_config_t &c) { c.winding.dL_H[0] = -60e-3; }));
    EXPECT_FALSE(sound(saturating, [](plant_config_t &c) { c.winding.dL_H[0] = -70e-3; }));
    EXPECT_TRUE(sound(saturating, [](plant_config_t &c) { c.winding.saliency[0] = {-4, 40e-3, 0.0}; }));
    EXPECT_FALSE(sound(saturating, [](plant_config_t &c) { c.winding.saliency[0] = {-4, 46e-3, 0.0}; }));
    EXPECT_TRUE(sound(two_sets, [](plant_config_t &c) { c.winding.M_d_H = 40e-3; }));
    EXPECT_FALSE(sound(two_sets, [](plant_config_t &c) { c.winding.M_d_H = 46e-3; }));
    EXPECT_FALSE(sound(two_sets, [](plant_config_t &c) { c.winding.M_q_H = -78e-3; }));
    EXPECT_FALSE(sound(plain_open_winding, [](plant_config_t &c) { c.winding.L_0_H = -1e-3; }));
    EXPECT_FALSE(sound(plain_open_winding, [](plant_config_t &c) { c.winding.dL_0_H = 90e-3; }));
    // eddy circuits take from the inductance at once: 43 || 30 mH leaves 17.7
    EXPECT_FALSE(sound(saturating, [](plant_config_t &c) {
        c.winding.L_eddy_d_H = 30e-3;
        c.winding.dL_H[0] = -60e-3;
    }));
}

TEST(Frame, SmallTurnsAgreeWithTheLibrary)
{
    for (double turn = -FRAME_TURN_MAX_RAD; turn <= FRAME_TURN_MAX_RAD; turn += 0.01) {
        rotor_t r = frame_turn(rotor_t{std::cos(1.0), std::sin(1.0)}, turn);
        EXPECT_NEAR(r.c, std::cos(1.0 + turn), 3e-13);
        EXPECT_NEAR(r.s, std::sin(1.0 + turn), 3e-13);
    }
}

} // namespace
