// Faults of switches and wiring in the running drive: currents against circuit theory, energy closed.
#include "fault_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace validation
{
namespace
{

using reference::measured;

// The formulas take the PWM for its mean. At their instant, the middle of a zero vector, the currents have it
// but for what the ripple of a period does over R and L: (T R/L)^2, 1e-4.
constexpr double bound_current_of_fault = 0.005;
constexpr double bound_energy = 1e-3; // issue: 0.1 %

// Mean and fundamental of the currents in legs and motor.
struct Seen {
    Fourier leg_mean[3], leg[3], motor_mean[3], motor[3];

    void add(const plant_truth_t &t)
    {
        Legs motor_A{};
        set_legs(motor_A, 0, Complex(t.i_d_A, t.i_q_A) * std::polar(1.0, t.theta_e_rad));
        for (int k = 0; k < 3; k++) {
            leg_mean[k].add(t.i_A[k], 0.0);
            leg[k].add(2.0 * t.i_A[k], t.theta_e_rad);
            motor_mean[k].add(motor_A[static_cast<size_t>(k)], 0.0);
            motor[k].add(2.0 * motor_A[static_cast<size_t>(k)], t.theta_e_rad);
        }
    }

    double deviation(const Network &network) const // of the largest current
    {
        Phases leg_dc = at_zero(network).leg_A(), leg_ac = at_speed(network).leg_A();
        Phases motor_dc = at_zero(network).motor_A(), motor_ac = at_speed(network).motor_A();
        double worst_A = 0.0, largest_A = 0.0;
        for (int k = 0; k < 3; k++) {
            for (Complex off : {leg_mean[k].value() - leg_dc.A[k], leg[k].value() - leg_ac.A[k],
                                motor_mean[k].value() - motor_dc.A[k], motor[k].value() - motor_ac.A[k]}) {
                EXPECT_TRUE(std::isfinite(std::abs(off)));
                worst_A = std::max(worst_A, std::abs(off));
            }
            largest_A =
                std::max({largest_A, std::abs(leg_dc.A[k]), std::abs(leg_ac.A[k]), std::abs(motor_ac.A[k])});
        }
        EXPECT_GT(largest_A, 3.0); // it is a fault
        return worst_A / largest_A;
    }
};

// Runs healthy on EMF and equal duties, then `fail` and the given PWM; sees a turn once that has settled.
template <class Fail>
Seen run(rig::Plant &plant, const plant_pwm_t &pwm, Fail fail, int instants_per_period = 1)
{
    plant_set_speed(plant, omega_e / 5.0);
    plant.run(rig::pwm(0.5, 0.5, 0.5), 100);
    fail();
    plant.run(pwm, 3 * turn_periods); // 14 time constants
    Seen seen;
    double first = instants_per_period > 1 ? 0.5 : 0.0;
    for (int n = 0; n < turn_periods; n++) {
        for (int k = 0; k < instants_per_period; k++) {
            seen.add(plant.at((k + first) / instants_per_period * plant.period_s()));
        }
        plant.run(pwm);
    }
    return seen;
}

// Of what became heat.
double imbalance(const plant_truth_t &t)
{
    double heat_J = t.e_copper_J + t.e_device_J;
    return std::fabs(t.e_in_J - heat_J - t.e_mech_J - t.e_field_J) / heat_J;
}

void report(const std::string &id, const Seen &seen, const Network &network, const rig::Plant &plant)
{
    measured(id + "_current", seen.deviation(network), bound_current_of_fault, "of_peak", "E11");
    measured(id + "_energy", imbalance(plant.truth()), bound_energy, "relative", "E11");
}

// An upper switch of A that never opens, the lower no longer driven: i_A = 2/3 (1 - d) V_dc/(R + r_on) and
// half of that back through B and C, besides the short-circuit current of the EMF.
TEST(Fault, ShortedUpperSwitch)
{
    rig::Plant plant(faulty());
    plant_pwm_t pwm = rig::pwm(0.0, 0.9, 0.9);
    pwm.driven[0] = false;
    Seen seen = run(plant, pwm, [&] {
        plant.run(pwm); // is in force with the next period
        plant_set_leg_fault(plant, 0, PLANT_UPPER_SHORT);
    });
    Network network;
    network.source_V[0] = v_dc_V;
    network.source_V[1] = network.source_V[2] = 0.9 * v_dc_V;
    EXPECT_NEAR(at_zero(network).leg_A().A[0].real(), 2.0 / 3.0 * 0.1 * v_dc_V / (R_ohm + r_on_ohm), 1e-6);
    report("shorted_upper", seen, network, plant);
}

TEST(Fault, ShortedLowerSwitch)
{
    rig::Plant plant(faulty());
    plant_pwm_t pwm = rig::pwm(0.15, 0.0, 0.15);
    pwm.driven[1] = false;
    Seen seen = run(plant, pwm, [&] {
        plant.run(pwm);
        plant_set_leg_fault(plant, 1, PLANT_LOWER_SHORT);
    });
    Network network;
    network.source_V[0] = network.source_V[2] = 0.15 * v_dc_V;
    report("shorted_lower", seen, network, plant);
}

// With its neighbour still driven the two tie the link together through twice r_on, and their middle drives
// the winding with half of what is left, behind r_on/2. The plant has r_on there, 0.1 % of the link.
TEST(Fault, ShootThrough)
{
    plant_config_t config = faulty();
    config.mech.locked = true;
    config.dclink = rig::dclink(v_dc_V, 0.5, 470e-6);
    rig::Plant plant(config);
    plant.run(rig::pwm(0.0, 0.0, 0.0), 20);
    plant_set_leg_fault(plant, 2, PLANT_UPPER_SHORT);
    plant.run(rig::pwm(0.0, 0.0, 0.0), 1000); // 12 time constants of the winding
    plant_truth_t t = plant.truth();
    double winding_S = 1.0 / (0.5 * r_on_ohm + R_ohm + 0.5 * (R_ohm + r_on_ohm));
    double load_S = 0.5 / r_on_ohm + 0.25 * winding_S;
    double v_V = v_dc_V / (1.0 + 0.5 * load_S);
    measured("shoot_through_link", std::fabs(t.v_dc_V / v_V - 1.0), bound_current_of_fault, "relative",
             "E11");
    measured("shoot_through_energy", imbalance(t), bound_energy, "relative", "E11");
}

// The wire of C off: i_A = -i_B = (v_AB - e_AB)/(2 (R + r_on + j w L)), and the motor shows e_C there.
TEST(Fault, OpenPhase)
{
    rig::Plant plant(faulty());
    plant_pwm_t pwm = rig::pwm(0.55, 0.45, 0.5);
    Seen seen = run(plant, pwm, [&] {
        plant.run(pwm, 40);
        EXPECT_GT(std::fabs(plant.truth().i_A[2]), 1.0); // interrupts a current
        plant_set_leg_fault(plant, 2, PLANT_WIRE_OPEN);
    });
    Network network;
    network.tied[2] = false;
    network.source_V[0] = 0.55 * v_dc_V;
    network.source_V[1] = 0.45 * v_dc_V;
    Complex e_AB_V = at_speed(network).emf_V(0) - at_speed(network).emf_V(1);
    Complex single_A = -e_AB_V / (2.0 * (R_ohm + r_on_ohm + j * omega_e * L_H));
    EXPECT_LT(std::abs(at_speed(network).leg_A().A[0] - single_A), 1e-6);
    report("open_phase", seen, network, plant);
    plant_truth_t t = plant.truth();
    double e_C_V = -omega_e * psi_Wb * std::sin(t.theta_e_rad - 240.0 * deg);
    measured("open_phase_terminal", std::fabs(t.v_leg_V[2] - t.v_neutral_V[0] - e_C_V) / (omega_e * psi_Wb),
             bound_current_of_fault, "of_emf", "E11");
}

struct Short {
    double deviation, imbalance;
};

// Terminals A and B joined and the inverter tripped: the EMF drives i = - e_AB/(2 (R + j w L) + R_short +
// j w 1 uH) through both.
Short tripped_short(double tolerance)
{
    plant_config_t config = faulty();
    config.tolerance = tolerance;
    rig::Plant plant(config);
    Seen seen = run(plant, rig::all_off(), [&] {
        plant_trip(plant);
        plant_set_short(plant, 0, 1, 0.1);
    });
    Network network;
    std::fill(network.tied, network.tied + 3, false);
    network.short_a = 0;
    network.short_b = 1;
    network.short_ohm = 0.1;
    Complex e_AB_V = at_speed(network).emf_V(0) - at_speed(network).emf_V(1);
    Complex loop_ohm = 2.0 * (R_ohm + j * omega_e * L_H) + 0.1 + j * omega_e * 1e-6;
    EXPECT_LT(std::abs(at_speed(network).motor_A().A[0] + e_AB_V / loop_ohm), 1e-6);
    return {seen.deviation(network), imbalance(plant.truth())};
}

TEST(Fault, PhasesShortedAfterATrip)
{
    Short figures = tripped_short(0.0);
    measured("phase_short_tripped_current", figures.deviation, bound_current_of_fault, "of_peak", "E11");
    measured("phase_short_tripped_energy", figures.imbalance, bound_energy, "relative", "E11");
}

TEST(Fault, IndependentOfTolerance)
{
    double change = tripped_short(1e-6).deviation - tripped_short(0.5e-6).deviation;
    measured("tolerance_phase_short", std::fabs(change), 0.1 * bound_current_of_fault, "of_peak",
             "step size");
}

// The short carries pulses: they are seen at 100 instants of each period, with all edges halfway between two.
TEST(Fault, PhasesShortedUnderPwm)
{
    for (int to : {1, -1}) { // B, or the negative rail
        rig::Plant plant(faulty());
        plant_pwm_t pwm = rig::pwm(0.6, 0.4, 0.5);
        Seen seen = run(
            plant, pwm, [&] { plant_set_short(plant, 0, to, 2.0); }, 100);
        Network network;
        network.source_V[0] = 0.6 * v_dc_V;
        network.source_V[1] = 0.4 * v_dc_V;
        network.source_V[2] = 0.5 * v_dc_V;
        network.short_a = 0;
        network.short_b = to;
        network.short_ohm = 2.0;
        report(to < 0 ? "ground_short_pwm" : "phase_short_pwm", seen, network, plant);
    }
}

} // namespace
} // namespace validation
