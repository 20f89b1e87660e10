// What the drive has identified against machines whose values follow from formulas: linear ones by hand, saturating ones
// from the model of tests/contract/bench.h.
#include "tools/pmsim/metrics.h"

#include <cmath>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"
#include "tools/pmsim/setup.h"

namespace pmsim
{
namespace
{

constexpr double kExact = 1e-9;
constexpr double kNewton = 1e-7; // two iterations that end at different last bits

pmsim::Setup setup_of(double c_A_Wb5, double L_q0_H = 80e-3)
{
    pmsim::Setup setup = default_setup();
    plant_machine_t &m = setup.plant.machine;
    m.pole_pairs = 3;
    m.R_s_ohm = 2.0;
    m.L_d0_H = 40e-3;
    m.L_q0_H = L_q0_H;
    m.c_A_Wb5 = c_A_Wb5;
    m.psi_m_Wb = 0.25;
    setup.plant.inverter.r_on_ohm = 0.5;
    setup.plant.inverter.dead_time_s = 2e-6;
    setup.plant.inverter.f_pwm_Hz = 10e3;
    setup.plant.inverter.v_switch_V = 1.0;
    setup.plant.inverter.v_diode_V = 1.5;
    setup.plant.dclink.v_source_V = 300.0;
    setup.plant.mech.J_kgm2 = 2e-3;
    setup.plant.mech.B_Nms = 1e-3;
    setup.plant.mech.T_coulomb_Nm = 0.05;
    setup.rated = {4.0, 100.0, 2.0, 300.0};
    return setup;
}

MetricValue judged(const pmsim::Setup &setup, const std::string &name,
                   const std::function<void(rig_identified_t &)> &found)
{
    Expectation expectation;
    expectation.metric = name;
    const std::unique_ptr<Metric> metric = make_metric(expectation, setup);
    Sample sample{};
    sample.rig.identified.R_s_ohm = sample.rig.identified.psi_m_Wb = 77.0; // the last one counts
    metric->add(sample);
    sample.rig.identified = {};
    found(sample.rig.identified);
    metric->add(sample);
    return metric->value();
}

TEST(IdentifyMetrics, OfALinearMachineAreTheRatios)
{
    const pmsim::Setup s = setup_of(0.0);
    const auto error = [&](const char *name, double rig_identified_t::*member, double value) {
        return judged(s, name, [=](rig_identified_t &x) { x.*member = value; }).number;
    };
    EXPECT_NEAR(error("identify_R_s_error_rel", &rig_identified_t::R_s_ohm, 2.5 * 1.1), 0.1, kExact);
    EXPECT_NEAR(error("identify_L_d_error_rel", &rig_identified_t::L_d_H, 40e-3 * 0.9), -0.1, kExact);
    EXPECT_NEAR(error("identify_L_q_error_rel", &rig_identified_t::L_q_H, 80e-3 * 1.2), 0.2, kExact);
    EXPECT_NEAR(error("identify_L_q_rated_error_rel", &rig_identified_t::L_q_rated_H, 80e-3 * 1.3), 0.3,
                kExact);
    EXPECT_NEAR(error("identify_L_qh_rated_error_rel", &rig_identified_t::L_qh_rated_H, 80e-3 * 0.8), -0.2,
                kExact);
    EXPECT_NEAR(error("identify_L_dq_error_rel", &rig_identified_t::L_dq_rated_H, 4e-3), 0.05, kExact);
    EXPECT_NEAR(error("identify_psi_m_error_rel", &rig_identified_t::psi_m_Wb, 0.25 * 1.04), 0.04, kExact);
    EXPECT_NEAR(error("identify_J_error_rel", &rig_identified_t::J_kgm2, 2e-3 * 1.5), 0.5, kExact);
    // 2 % of the period is dead: 300 V * 0.02, and the switch for 96 % of the time, a diode for 4 %
    const double lost_V = 6.0 + 1.0 * 0.96 + 1.5 * 0.04;
    EXPECT_NEAR(error("identify_lost_error_rel", &rig_identified_t::lost_V, lost_V * 1.25), 0.25, kExact);
    // i t / V
    EXPECT_NEAR(error("identify_leg_capacitance_F", &rig_identified_t::move_A, 0.03), 0.03 * 2e-6 / 300.0,
                1e-18);
}

// V_h T_s / (2 sin(pi / 20)) of flux between two samples of a carrier of f_pwm / 20.
TEST(IdentifyMetrics, CircleIsThatOfTheCarrier)
{
    const pmsim::Setup s = setup_of(0.0);
    const double flux_Wb = s.params->v_injection * 1e-3 * 1e-4 / (2 * std::sin(3.14159265358979323846 / 20));
    const double centre_A = flux_Wb * (1 / 40e-3 + 1 / 80e-3) / 2,
                 radius_A = flux_Wb * (1 / 40e-3 - 1 / 80e-3) / 2;
    const auto error = [&](double centre, double radius) {
        return judged(s, "identify_circle_error_rel",
                      [=](rig_identified_t &x) {
                          x.circle_centre_A = centre * centre_A;
                          x.circle_radius_A = radius * radius_A;
                      })
            .number;
    };
    EXPECT_NEAR(error(1.1, 1), 0.1, kExact);
    EXPECT_NEAR(error(1, 0.8), 0.2, kExact);
}

TEST(IdentifyMetrics, FrictionIsJudgedAtRatedSpeed)
{
    const pmsim::Setup s = setup_of(0.0);
    const double number = judged(s, "identify_friction_error_rel", [](rig_identified_t &x) {
                              x.viscous_Nms = 2e-3; // 0.2 instead of 0.1 Nm at 100 rad/s
                              x.coulomb_Nm = 0.03;  // instead of 0.05 Nm
                          }).number;
    EXPECT_NEAR(number, (0.1 - 0.02) / 2.0, kExact);
}

TEST(IdentifyMetrics, WhatWasNotFoundIsNotJudged)
{
    const pmsim::Setup s = setup_of(0.0);
    for (const char *name : {"identify_R_s_error_rel", "identify_L_d_error_rel", "identify_psi_m_error_rel",
                             "identify_J_error_rel"}) {
        EXPECT_TRUE(std::isnan(judged(s, name, [](rig_identified_t &) {}).number)) << name;
    }
}

// At rated current in q and MTPA's i_d by the inductances at zero current; a round machine has none.
TEST(IdentifyMetrics, OfASaturatingMachineAreThoseOfItsEnergyForm)
{
    for (const double c : {105.0, 400.0}) {
        for (const double L_q0_H : {80e-3, 41e-3}) {
            const pmsim::Setup s = setup_of(c, L_q0_H);
            const plant_machine_t &p = s.plant.machine;
            const bench::Machine m = {p.R_s_ohm, p.L_d0_H, p.L_q0_H, p.c_A_Wb5, p.psi_m_Wb, 3};
            const bench::Machine::Tangent zero = m.tangent({p.psi_m_Wb, 0});
            const double dL_H = zero.L_q_H - zero.L_d_H;
            double i_d_A = 0;
            if (dL_H > 0.05 * zero.L_q_H) {
                const double h_A = p.psi_m_Wb / (2 * dL_H);
                i_d_A = h_A - std::sqrt(h_A * h_A + 4.0 * 4.0);
            }
            const bench::Complex psi = m.flux_Wb({i_d_A, 4.0});
            const bench::Machine::Tangent rated = m.tangent(psi);
            const auto error = [&](const char *name, double rig_identified_t::*member, double value) {
                return judged(s, name, [=](rig_identified_t &x) { x.*member = value; }).number;
            };
            EXPECT_NEAR(error("identify_L_d_error_rel", &rig_identified_t::L_d_H, zero.L_d_H), 0, kNewton)
                << c;
            EXPECT_NEAR(error("identify_L_q_error_rel", &rig_identified_t::L_q_H, zero.L_q_H), 0, kNewton)
                << c;
            EXPECT_NEAR(
                error("identify_L_q_rated_error_rel", &rig_identified_t::L_q_rated_H, psi.imag() / 4.0), 0,
                kNewton)
                << c << ' ' << L_q0_H;
            EXPECT_NEAR(error("identify_L_qh_rated_error_rel", &rig_identified_t::L_qh_rated_H, rated.L_q_H),
                        0, kNewton)
                << c << ' ' << L_q0_H;
            EXPECT_NEAR(error("identify_L_dq_error_rel", &rig_identified_t::L_dq_rated_H, rated.L_dq_H), 0,
                        kNewton)
                << c << ' ' << L_q0_H;
        }
    }
}

TEST(IdentifyMetrics, StateAndReasonAreWords)
{
    const pmsim::Setup s = setup_of(0.0);
    const auto words = [&](const char *name) { return find_metric(name)->words; };
    for (int n = 0; n < 3; ++n) {
        EXPECT_EQ(judged(s, "identify_state", [n](rig_identified_t &x) { x.state = n; }).text,
                  words("identify_state")[static_cast<size_t>(n)]);
        EXPECT_EQ(judged(s, "identify_reason", [n](rig_identified_t &x) { x.reason = n; }).text,
                  words("identify_reason")[static_cast<size_t>(n)]);
    }
}

} // namespace
} // namespace pmsim
