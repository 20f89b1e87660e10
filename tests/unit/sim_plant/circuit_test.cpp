// circuit.h through the plant on an ideal inverter: closed forms, and a second implementation in rotor
// coordinates with small fixed steps.
#include "rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace
{

using rig::pi;

// Closed forms: the integrator's 1e-6 local error, of the final value.
constexpr double closed_form = 2e-6;
// METHODS.md asks for 1e-4 of rated after a second; ten times better is had, so ask for it.
constexpr double reference_tolerance = 1e-5;
constexpr double rated_A = 4.0, rated_rad_s = 1000.0 * pi / 30.0, rated_Nm = 4.01;

// Locked rotor, one voltage vector for ever: two first-order lags in the rotor frame.
TEST(Circuit, LockedRotorStepResponse)
{
    plant_config_t config = rig::ipm_1000();
    config.machine = {6.0, 43e-3, 75e-3, 0.0, 0.236, 3};
    config.mech.locked = true;
    double theta = 0.7;
    rig::Plant plant(config, theta);
    plant.run(rig::pwm(1, 0, 0)); // acts from the next period on
    double v_d = 200.0 * std::cos(theta), v_q = -200.0 * std::sin(theta);
    for (int k = 1; k <= 500; k++) {
        plant.run(rig::pwm(1, 0, 0));
        plant_truth_t t = plant.truth();
        double i_d = v_d / 6.0 * -std::expm1(-6.0 / 43e-3 * k * 1e-4);
        double i_q = v_q / 6.0 * -std::expm1(-6.0 / 75e-3 * k * 1e-4);
        ASSERT_NEAR(t.i_d_A, i_d, closed_form * 200.0 / 6.0) << k;
        ASSERT_NEAR(t.i_q_A, i_q, closed_form * 200.0 / 6.0) << k;
        ASSERT_NEAR(t.torque_Nm, 4.5 * (0.236 * i_q + (43e-3 - 75e-3) * i_d * i_q), 1e-3);
        ASSERT_NEAR(t.v_mean_alpha_V, 200.0, 1e-9);
        ASSERT_NEAR(t.v_mean_beta_V, 0.0, 1e-9);
    }
}

// All lower switches closed on a turning rotor: the steady short-circuit currents.
TEST(Circuit, ShortCircuitCurrents)
{
    double R = 6.0, L_d = 43e-3, L_q = 75e-3, psi_m = 0.236;
    plant_config_t config = rig::ipm_1000();
    config.machine = {R, L_d, L_q, 0.0, psi_m, 3};
    for (double omega_mech : {30.0, -100.0}) {
        rig::Plant plant(config);
        plant_set_speed(plant, omega_mech);
        plant.run(rig::pwm(0, 0, 0), 3000);
        double w = 3 * omega_mech;
        double det = R * R + w * w * L_d * L_q;
        plant_truth_t t = plant.truth();
        EXPECT_NEAR(t.i_d_A, -w * w * L_q * psi_m / det, closed_form * 5.0);
        EXPECT_NEAR(t.i_q_A, -w * R * psi_m / det, closed_form * 5.0);
        EXPECT_LT(t.torque_Nm * omega_mech, 0.0);
        EXPECT_EQ(t.e_in_J, 0.0);
    }
}

TEST(Circuit, NoLoadEmfAtTheTerminals)
{
    rig::Plant plant(rig::ipm_1000(), 0.4);
    plant_set_speed(plant, 100.0);
    plant.run(rig::all_off(), 20);
    for (int k = 0; k < 200; k++) {
        plant.run(rig::all_off());
        plant_truth_t t = plant.truth();
        double e = -300.0 * 0.236; // e_A = -omega psi_m sin(theta)
        double e_ab = e * (std::sin(t.theta_e_rad) - std::sin(t.theta_e_rad - 2 * pi / 3));
        double e_bc = e * (std::sin(t.theta_e_rad - 2 * pi / 3) - std::sin(t.theta_e_rad + 2 * pi / 3));
        ASSERT_NEAR(t.v_leg_V[0] - t.v_leg_V[1], e_ab, 1e-8);
        ASSERT_NEAR(t.v_leg_V[1] - t.v_leg_V[2], e_bc, 1e-8);
        // mean over the last period of 0.03 rad: its middle, times sin(0.015)/0.015
        double middle = t.theta_e_rad - 0.015;
        double chord = std::sin(0.015) / 0.015;
        ASSERT_NEAR(t.v_mean_alpha_V, e * std::sin(middle) * chord,
                    1e-5); // integrated: a tenth of closed_form
        ASSERT_NEAR(t.v_mean_beta_V, -e * std::cos(middle) * chord, 1e-5);
    }
}

// The machine of METHODS.md 0.2 E1 in rotor coordinates, ideal legs, link and load; classical Runge-Kutta of
// fourth order in steps of at most 2 us between the edges that it computes from the compare values itself.
class Reference
{
  public:
    explicit Reference(const plant_config_t &config) : c(config)
    {
        double m = c.machine.psi_m_Wb;
        i_f = m / c.machine.L_d0_H + c.machine.c_A_Wb5 * std::pow(m, 5);
        y = {m, 0.0, 0.0, 0.0, c.dclink.v_source_V};
    }

    void run(const plant_pwm_t &pwm)
    {
        double T = 1.0 / c.inverter.f_pwm_Hz;
        double rise[3], fall[3];
        std::vector<double> edges = {0.0, T};
        for (int k = 0; k < 3; k++) {
            rise[k] = 0.5 * T - 0.5 * T * pwm.compare[k][0] / c.inverter.timer_counts;
            fall[k] = 0.5 * T + 0.5 * T * pwm.compare[k][1] / c.inverter.timer_counts;
            edges.push_back(rise[k]);
            edges.push_back(fall[k]);
        }
        std::sort(edges.begin(), edges.end());
        for (size_t n = 1; n < edges.size(); n++) {
            double middle = 0.5 * (edges[n] + edges[n - 1]);
            for (int k = 0; k < 3; k++) {
                high[k] = middle > rise[k] && middle < fall[k] ? 1.0 : 0.0;
            }
            double span = edges[n] - edges[n - 1];
            int steps = static_cast<int>(std::ceil(span / 2e-6));
            for (int k = 0; k < steps; k++) {
                step(span / steps);
            }
        }
    }

    double i_d() const
    {
        return current_d(y);
    }
    double i_q() const
    {
        return current_q(y);
    }
    double omega_mech() const
    {
        return y[2];
    }
    double theta_e() const
    {
        return y[3];
    }
    double v_dc() const
    {
        return y[4];
    }
    double torque() const
    {
        return 1.5 * c.machine.pole_pairs * (y[0] * i_q() - y[1] * i_d());
    }

    double load = 0.0;

  private:
    using State = std::array<double, 5>; // psi_d, psi_q, omega_mech, theta_e, v_dc

    double current_d(const State &s) const
    {
        double psi2 = s[0] * s[0] + s[1] * s[1];
        return s[0] / c.machine.L_d0_H + c.machine.c_A_Wb5 * s[0] * psi2 * psi2 - i_f;
    }

    double current_q(const State &s) const
    {
        double psi2 = s[0] * s[0] + s[1] * s[1];
        return s[1] / c.machine.L_q0_H + c.machine.c_A_Wb5 * s[1] * psi2 * psi2;
    }

    State rate(const State &s) const
    {
        double i_d = current_d(s), i_q = current_q(s);
        double v_d = 0.0, v_q = 0.0, i_dc = 0.0;
        for (int k = 0; k < 3; k++) {
            double cosine = std::cos(s[3] - k * 2 * pi / 3), sine = std::sin(s[3] - k * 2 * pi / 3);
            v_d += 2.0 / 3.0 * s[4] * high[k] * cosine;
            v_q -= 2.0 / 3.0 * s[4] * high[k] * sine;
            i_dc += high[k] * (i_d * cosine - i_q * sine);
        }
        double P = c.machine.pole_pairs, w = P * s[2], R = c.machine.R_s_ohm;
        double T_e = 1.5 * P * (s[0] * i_q - s[1] * i_d);
        double dv = 0.0;
        if (c.dclink.c_F > 0.0) {
            dv = ((c.dclink.v_source_V - s[4]) / c.dclink.r_source_ohm - i_dc) / c.dclink.c_F;
        }
        return {v_d - R * i_d + w * s[1], v_q - R * i_q - w * s[0],
                (T_e - load - c.mech.B_Nms * s[2]) / c.mech.J_kgm2, w, dv};
    }

    void step(double h)
    {
        auto moved = [this](const State &k, double by) {
            State s = y;
            for (size_t n = 0; n < s.size(); n++) {
                s[n] += by * k[n];
            }
            return s;
        };
        State k1 = rate(y), k2 = rate(moved(k1, h / 2)), k3 = rate(moved(k2, h / 2)), k4 = rate(moved(k3, h));
        for (size_t n = 0; n < y.size(); n++) {
            y[n] += h / 6 * (k1[n] + 2 * k2[n] + 2 * k3[n] + k4[n]);
        }
    }

    plant_config_t c;
    double i_f;
    State y{};
    double high[3] = {};
};

// A second of acceleration, load step and braking of a saturated machine on a soft link.
TEST(Circuit, FreeRunAgainstASecondImplementation)
{
    plant_config_t config = rig::ipm_1000();
    config.dclink = rig::dclink(300.0, 0.5, 470e-6);
    rig::Plant plant(config);
    Reference reference(config);
    rig::CurrentControl control(config);
    plant_pwm_t acting = rig::pwm(0.5, 0.5, 0.5);
    plant.run(acting);
    double worst_A = 0.0, worst_rad_s = 0.0, worst_Nm = 0.0, worst_V = 0.0, worst_rad = 0.0;
    for (int k = 0; k < 10000; k++) {
        double load = k > 3000 ? 2.0 : 0.0;
        plant_set_load(plant, load);
        reference.load = load;
        plant_truth_t before = plant.truth();
        plant_pwm_t next = control.step(before, k > 2000 ? -1.0 : 0.0, k < 7000 ? 4.0 : -2.0);
        plant.run(next);
        reference.run(acting);
        acting = next;
        plant_truth_t t = plant.truth();
        worst_A =
            std::max({worst_A, std::fabs(t.i_d_A - reference.i_d()), std::fabs(t.i_q_A - reference.i_q())});
        worst_rad_s = std::max(worst_rad_s, std::fabs(t.omega_mech_rad_s - reference.omega_mech()));
        worst_Nm = std::max(worst_Nm, std::fabs(t.torque_Nm - reference.torque()));
        worst_V = std::max(worst_V, std::fabs(t.v_dc_V - reference.v_dc()));
        worst_rad = std::max(worst_rad, std::fabs(t.theta_e_rad - reference.theta_e()));
    }
    EXPECT_GT(plant.truth().omega_mech_rad_s, 10.0);
    RecordProperty("current", std::to_string(1e9 * worst_A / rated_A) + "e-9");
    RecordProperty("speed", std::to_string(1e9 * worst_rad_s / rated_rad_s) + "e-9");
    RecordProperty("torque", std::to_string(1e9 * worst_Nm / rated_Nm) + "e-9");
    RecordProperty("link", std::to_string(1e9 * worst_V / 300.0) + "e-9");
    RecordProperty("angle", std::to_string(1e9 * worst_rad) + "e-9");
    EXPECT_LT(worst_A, reference_tolerance * rated_A);
    EXPECT_LT(worst_rad_s, reference_tolerance * rated_rad_s);
    EXPECT_LT(worst_Nm, reference_tolerance * rated_Nm);
    EXPECT_LT(worst_V, reference_tolerance * 300.0);
    EXPECT_LT(worst_rad, 1e-4);
}

} // namespace
