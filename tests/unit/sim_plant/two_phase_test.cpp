// two_phase.h: a star with one floating leg in closed form, against one differential equation of two phases
// in series integrated to 1e-10, and against the general way of the plant (floating.h).
#include "six_step.h"

#include "tests/reference/ode.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace validation
{
namespace
{

// Two ways at a tolerance of 1e-8 each: the equations are compared, not the steps. Of full scale, of the
// link.
constexpr double tolerance = 1e-8;
constexpr double current_share = 2e-6, voltage_share = 2e-5, energy_share = 2e-6, mean_share = 2e-6;
constexpr double bound_two_phase = 2e-6; // twice the default tolerance; of rated current, of the link

// Linear salient machine, x on v_x, y on zero, the third leg on nothing: with i from x to y,
//   psi = (L_d + L_q)/2 i + (L_d - L_q)/2 e^{j 2 theta} i* + psi_m e^{j theta}
//   d(psi_x - psi_y)/dt = v_x - 2 R i
class TwoPhases
{
  public:
    TwoPhases(const plant_config_t &config, double omega_e, double theta_e, double v_V, int x, int y)
        : m_(config.machine), omega_(omega_e), v_V_(v_V), x_{0.0, theta_e}, axis_x_(axis(x)),
          axis_y_(axis(y)), ode_([this](const reference::State &at, reference::State &rate) {
              rate[0] = slope(at[0], at[1]);
              rate[1] = omega_;
          })
    {
    }

    void advance(double duration_s)
    {
        ode_.advance(x_, duration_s);
    }

    double current_A() const
    {
        return x_[0];
    }

    // v_open - v_y = e_open - e_y + R i, of the linkages' rates
    double open_V(int open) const
    {
        double i_A_s = slope(x_[0], x_[1]);
        Complex rate = turning(x_[0], x_[1]) + along(x_[1], i_A_s * unit());
        return (rate * std::conj(axis(open) - axis_y_)).real() + m_.R_s_ohm * x_[0];
    }

  private:
    static Complex axis(int k)
    {
        return std::polar(1.0, k * 120.0 * deg);
    }

    // Space vector of one ampere
    Complex unit() const
    {
        return 2.0 / 3.0 * (axis_x_ - axis_y_);
    }

    Complex along(double theta, Complex i_A) const
    {
        return 0.5 * (m_.L_d0_H + m_.L_q0_H) * i_A +
               0.5 * (m_.L_d0_H - m_.L_q0_H) * std::polar(1.0, 2.0 * theta) * std::conj(i_A);
    }

    // d psi/dt by rotation alone
    Complex turning(double i_A, double theta) const
    {
        Complex second =
            0.5 * (m_.L_d0_H - m_.L_q0_H) * std::polar(1.0, 2.0 * theta) * std::conj(i_A * unit());
        return j * omega_ * (2.0 * second + std::polar(m_.psi_m_Wb, theta));
    }

    double slope(double i_A, double theta) const
    {
        Complex line = std::conj(axis_x_ - axis_y_);
        double induced_V = (turning(i_A, theta) * line).real();
        return (v_V_ - 2.0 * m_.R_s_ohm * i_A - induced_V) / (along(theta, unit()) * line).real();
    }

    plant_machine_t m_;
    double omega_, v_V_;
    reference::State x_;
    Complex axis_x_, axis_y_;
    reference::Ode ode_;
};

TEST(TwoPhase, FollowsTwoPhasesInSeries)
{
    constexpr double omega_e = 50.0, start_rad = 0.4, link_V = 80.0;
    for (int open = 0; open < 3; open++) {
        int x = (open + 1) % 3, y = (open + 2) % 3;
        plant_config_t config = ipm_linear();
        config.dclink.v_source_V = link_V;
        config.machine.R_s_ohm = 12.0; // so that no diode conducts
        rig::Plant plant(config, start_rad);
        plant_set_speed(plant, omega_e / config.machine.pole_pairs);
        plant_pwm_t pwm{};
        pwm.driven[x] = pwm.driven[y] = true;
        pwm.compare[x][0] = pwm.compare[x][1] = rig::counts;
        plant.run(pwm);
        double theta = plant.truth().theta_e_rad;
        TwoPhases reference(config, omega_e, theta, config.dclink.v_source_V, x, y);
        double worst_A = 0.0, worst_V = 0.0, largest_A = 0.0, low_V = link_V, high_V = 0.0;
        for (int n = 0; n < 600; n++) {
            plant.run(pwm);
            reference.advance(plant.period_s());
            plant_truth_t t = plant.truth();
            worst_A = std::max(worst_A, std::fabs(t.i_A[x] - reference.current_A()));
            worst_V = std::max(worst_V, std::fabs(t.v_leg_V[open] - reference.open_V(open)));
            largest_A = std::max(largest_A, std::fabs(t.i_A[x]));
            low_V = std::min(low_V, t.v_leg_V[open]);
            high_V = std::max(high_V, t.v_leg_V[open]);
            ASSERT_NEAR(t.i_A[x], -t.i_A[y], 1e-9) << "a diode conducts";
        }
        EXPECT_GT(largest_A, 2.5);
        EXPECT_GT(low_V, 0.0) << "or a diode would have conducted";
        EXPECT_LT(high_V, link_V);
        EXPECT_GT(high_V - low_V, 10.0);
        EXPECT_LT(worst_A / ipm_rated_A, bound_two_phase);
        EXPECT_LT(worst_V / link_V, bound_two_phase);
    }
}

struct Case {
    const char *name;
    plant_config_t config;
    double omega_e, i_A;
};

plant_config_t real(plant_config_t c)
{
    c.tolerance = tolerance;
    c.inverter.dead_time_s = 0.3e-6;
    c.inverter.v_switch_V = 0.3;
    c.inverter.v_diode_V = 0.8;
    c.inverter.r_on_ohm = 0.01;
    c.dclink.r_source_ohm = 0.05;
    c.dclink.c_F = 1e-3;
    return c;
}

plant_config_t saturating()
{
    plant_config_t c = ipm_saturating();
    c.winding.L_0_H = 14e-3;
    c.winding.dL_0_H = 2e-3;
    c.winding.emf[0] = {3, 7e-3, 0.0};
    return c;
}

class BothWays : public testing::TestWithParam<Case>
{
};

// A resistance that is nothing makes the phases unlike, which the general way is for.
TEST_P(BothWays, Agree)
{
    const Case &c = GetParam();
    plant_config_t unlike = c.config;
    unlike.winding.dR_ohm[0] = 1e-15;
    double full_A = c.config.sensor.i_full_scale_A, link_V = c.config.dclink.v_source_V;
    for (Pattern pattern : {Pattern::h_pwm_l_pwm, Pattern::h_pwm_l_on, Pattern::on_pwm}) {
        double duty = duty_for(c.config, pattern, c.omega_e, c.i_A);
        SixStep closed(c.config, pattern, duty, c.omega_e), general(unlike, pattern, duty, c.omega_e);
        double worst_A = 0.0, worst_V = 0.0, worst_mean_V = 0.0, largest_A = 0.0;
        int floated = 0;
        for (int n = 0; n < 600; n++) {
            closed.run();
            general.run();
            double within_s = (0.1 + 0.8 * (n % 7) / 6.0) * closed.plant.period_s();
            plant_truth_t a = closed.plant.at(within_s), b = general.plant.at(within_s);
            for (int k = 0; k < 3; k++) {
                worst_A = std::max(worst_A, std::fabs(a.i_A[k] - b.i_A[k]));
                largest_A = std::max(largest_A, std::fabs(a.i_A[k]));
                worst_V = std::max(worst_V, std::fabs(a.v_leg_V[k] - b.v_leg_V[k]));
            }
            worst_V = std::max(worst_V, std::fabs(a.v_neutral_V[0] - b.v_neutral_V[0]));
            worst_V = std::max(worst_V, std::fabs(a.v_zero_V[0] - b.v_zero_V[0]));
            worst_mean_V = std::max({worst_mean_V, std::fabs(a.v_mean_alpha_V - b.v_mean_alpha_V),
                                     std::fabs(a.v_mean_beta_V - b.v_mean_beta_V)});
            floated += a.i_A[closed.sector.open] == 0.0 ? 1 : 0;
        }
        plant_truth_t a = closed.plant.truth(), b = general.plant.truth();
        EXPECT_GT(floated, 100) << "of 600 samples with an open leg";
        EXPECT_GT(largest_A, 0.15 * c.i_A);
        EXPECT_LT(worst_A, current_share * full_A);
        EXPECT_LT(worst_V, voltage_share * link_V);
        EXPECT_LT(worst_mean_V, mean_share * link_V);
        EXPECT_NEAR(a.torque_Nm, b.torque_Nm, current_share * full_A * c.config.machine.psi_m_Wb * 6.0);
        EXPECT_NEAR(a.e_in_J, b.e_in_J, energy_share * b.e_in_J);
        EXPECT_NEAR(a.e_device_J, b.e_device_J, energy_share * b.e_in_J);
        EXPECT_NEAR(a.e_mech_J, b.e_mech_J, energy_share * b.e_in_J);
        EXPECT_NEAR(a.e_in_J - a.e_copper_J - a.e_device_J - a.e_mech_J, a.e_field_J,
                    energy_share * a.e_in_J);
    }
}

INSTANTIATE_TEST_SUITE_P(TwoPhase, BothWays,
                         testing::Values(Case{"Sine", real(bldc_hs()), 2000.0, 40.0},
                                         Case{"Trapezoid", real(bldc_fan()), 600.0, 4.0},
                                         Case{"Saturating", real(saturating()), 200.0, 5.0}),
                         [](const testing::TestParamInfo<Case> &which) { return which.param.name; });

// The rotor free to move: what the closed form says of torque acts back.
TEST(TwoPhase, RunsUpAsTheGeneralWayDoes)
{
    plant_config_t config = real(bldc_fan()), unlike = config;
    config.mech.J_kgm2 = unlike.mech.J_kgm2 = 2e-6;
    unlike.winding.dR_ohm[0] = 1e-15;
    rig::Plant a(config, 40.0 * deg), b(unlike, 40.0 * deg);
    for (int n = 0; n < 400; n++) {
        Sector sector(a.truth().theta_e_rad);
        std::array<double, 3> d = sector.duties(Pattern::h_pwm_l_on, 0.5);
        plant_pwm_t pwm = rig::pwm(d[0], d[1], d[2]);
        pwm.driven[sector.open] = false;
        a.run(pwm);
        b.run(pwm);
    }
    EXPECT_GT(a.truth().omega_mech_rad_s, 50.0);
    EXPECT_NEAR(a.truth().omega_mech_rad_s, b.truth().omega_mech_rad_s, 1e-5 * b.truth().omega_mech_rad_s);
    EXPECT_NEAR(a.truth().theta_e_rad, b.truth().theta_e_rad, 1e-5);
}

} // namespace
} // namespace validation
