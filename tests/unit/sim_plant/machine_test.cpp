// machine.h: the flux map is the gradient of one energy, and has the figures of METHODS.md 14.
extern "C" {
#include "sim_plant/machine.h"
}

#include <gtest/gtest.h>

#include <cmath>

namespace
{

// Central differences of smooth functions: about eps^(2/3) of the value.
constexpr double difference_tolerance = 1e-8;
constexpr double step_Wb = 1e-6;
// The figures of METHODS.md 14 are given to two or three digits: half of the last.
constexpr double figure_mH = 0.05, figure_unsat_mH = 0.5, figure_Nm = 0.005;

const plant_machine_t ipm_1000 = {6.0, 46.3e-3, 76.9e-3, 105.0, 0.236, 3};

class FluxMap : public testing::Test
{
  protected:
    FluxMap()
    {
        machine_set(&machine, &ipm_1000);
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
    auto energy = [&](double d, double q) { return machine_energy_J(&machine, dq_t{d, q}); };
    EXPECT_NEAR(slope([&](double x) { return energy(x, psi.q); }, psi.d), 1.5 * i.d, 1e-8);
    EXPECT_NEAR(slope([&](double x) { return energy(psi.d, x); }, psi.q), 1.5 * i.q, 1e-8);
}

// Virtual work: with the flux linkages held, a turn of the rotor takes its work from the field.
TEST_F(FluxMap, TorqueIsVirtualWork)
{
    for (double angle = -3.0; angle < 3.1; angle += 0.5) {
        dq_t psi = {0.236 + 0.1 * std::cos(angle), 0.25 * std::sin(angle)};
        auto energy = [&](double turn) {
            rotor_t rotor = {std::cos(turn), std::sin(turn)};
            return machine_energy_J(&machine, frame_to_dq(ab_t{psi.d, psi.q}, rotor));
        };
        double torque = machine_torque_Nm(&machine, psi, machine_current_A(&machine, psi));
        EXPECT_NEAR(torque, -ipm_1000.pole_pairs * slope(energy, 0.0), 1e-7) << angle;
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

TEST(Frame, SmallTurnsAgreeWithTheLibrary)
{
    for (double turn = -FRAME_TURN_MAX_RAD; turn <= FRAME_TURN_MAX_RAD; turn += 0.01) {
        rotor_t r = frame_turn(rotor_t{std::cos(1.0), std::sin(1.0)}, turn);
        EXPECT_NEAR(r.c, std::cos(1.0 + turn), 3e-13);
        EXPECT_NEAR(r.s, std::sin(1.0 + turn), 3e-13);
    }
}

} // namespace
