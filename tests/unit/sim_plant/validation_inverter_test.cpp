// The inverter against formulas: dead-time voltage error (5.6.1.1) and output capacitance (5.6.1.2).
#include "validation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace validation
{
namespace
{

using reference::measured;

constexpr double bound_dead_time = 0.03; // issue: 3 %
constexpr double bound_slope = 0.10;     // issue: 10 %

double sign(double x)
{
    return x > 0.0 ? 1.0 : -1.0;
}

// Both switches of a leg are open for this long at every edge.
double gap_s(const plant_inverter_t &v)
{
    return v.dead_time_s + v.turn_on_s - v.turn_off_s;
}

Complex duties(const plant_pwm_t &pwm)
{
    auto d = [&](int k) { return 1.0 * pwm.compare[k][0] / rig::counts; };
    return alphabeta(d(0), d(1), d(2));
}

Complex mean_voltage(const plant_truth_t &t)
{
    return {t.v_mean_alpha_V, t.v_mean_beta_V};
}

// 5.6.1.1: each leg loses V_dc gap/T_s and its drops against its current; the diode has it during the gaps.
Complex lost_V(const plant_config_t &config, Complex i_A)
{
    const plant_inverter_t &v = config.inverter;
    double share = gap_s(v) * v.f_pwm_Hz;
    double leg_V =
        config.dclink.v_source_V * share + v.v_switch_V * (1.0 - 2.0 * share) + v.v_diode_V * 2.0 * share;
    Legs i{};
    set_legs(i, 0, i_A);
    return alphabeta(sign(i[0]) * leg_V, sign(i[1]) * leg_V, sign(i[2]) * leg_V) + v.r_on_ohm * i_A;
}

// Locked, 4 A along an angle that keeps all three currents away from zero. Relative to the formula.
double dead_time_deviation(const plant_config_t &config, double angle)
{
    rig::Plant plant(config);
    Complex i_A = std::polar(4.0, angle);
    Legs v_V = legs((config.machine.R_s_ohm * i_A + lost_V(config, i_A)) / config.dclink.v_source_V);
    plant_pwm_t pwm = rig::pwm(0.5 + v_V[0], 0.5 + v_V[1], 0.5 + v_V[2]);
    double settled_s = 12.0 * config.machine.L_q0_H / config.machine.R_s_ohm;
    plant.run(pwm, static_cast<int>(settled_s / plant.period_s()));
    plant_truth_t t = plant.truth();
    Complex error_V = config.dclink.v_source_V * duties(pwm) - mean_voltage(t);
    EXPECT_LT(std::abs(current(t) - i_A), 0.1); // it is the state that was meant
    return std::abs(error_V - lost_V(config, current(t))) / std::abs(lost_V(config, current(t)));
}

struct Times {
    double dead_s, on_s, off_s;
};
constexpr Times times[] = {
    {0.5e-6, 0, 0}, {2e-6, 0, 0}, {4e-6, 0, 0}, {2e-6, 0.9e-6, 0.2e-6}, {2e-6, 0.1e-6, 0.8e-6}};

double worst_dead_time(plant_config_t config, double v_dc_V, const Times &time)
{
    config.mech.locked = true;
    config.dclink.v_source_V = v_dc_V;
    config.inverter = rig::inverter(10e3, time.dead_s, 0.8, 0.6, 0.02);
    config.inverter.turn_on_s = time.on_s;
    config.inverter.turn_off_s = time.off_s;
    double worst = 0.0;
    for (int at : {0, 45, 105, 180, 225, 285}) {
        worst = std::max(worst, dead_time_deviation(config, at * deg));
    }
    return worst;
}

TEST(DeadTimeError, LowVoltage)
{
    double worst = 0.0;
    for (const Times &time : times) {
        for (double v_dc_V : {24.0, 48.0}) {
            worst = std::max(worst, worst_dead_time(spm_linear(), v_dc_V, time));
        }
    }
    measured("dead_time_low_voltage", worst, bound_dead_time, "relative", "5.6.1.1");
}

TEST(DeadTimeError, HighVoltage)
{
    double worst = 0.0;
    for (const Times &time : times) {
        for (double v_dc_V : {300.0, 560.0}) {
            worst = std::max(worst, worst_dead_time(ipm_linear(), v_dc_V, time));
        }
    }
    measured("dead_time_high_voltage", worst, bound_dead_time, "relative", "5.6.1.1");
}

// Leg A alone switches, into an inductance that makes its current constant; the others stay low.
struct Swing {
    double v_dc_V, c_F;
    Times time;

    plant_config_t config() const
    {
        plant_config_t c = ideal(1.0, 100.0, 100.0, 0.0, 1, v_dc_V);
        c.mech.locked = true;
        c.inverter.dead_time_s = time.dead_s;
        c.inverter.turn_on_s = time.on_s;
        c.inverter.turn_off_s = time.off_s;
        c.inverter.c_leg_F = c_F;
        c.sensor.i_full_scale_A = 1.0;
        return c;
    }

    double full_V() const // without capacitance
    {
        return v_dc_V * gap_s(config().inverter) * config().inverter.f_pwm_Hz;
    }

    // A constant current takes the terminal from rail to rail in just the gap.
    double edge_A() const
    {
        return c_F * v_dc_V / gap_s(config().inverter);
    }
};

// What leg A loses in a period at i_A.
double swing_error_V(const Swing &swing, double i_A)
{
    plant_config_t config = swing.config();
    rig::Plant plant(config);
    hold(plant, legs(sign(i_A) * 1e4), config.machine.L_d0_H * std::fabs(i_A) / 1e4);
    hold(plant, Legs{}, 1e-6); // and stays so until the PWM takes over
    plant_pwm_t pwm = rig::pwm(0.5, 0.0, 0.0);
    plant.run(pwm, 3);
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(t.i_A[0], i_A, 1e-3);
    return 1.5 * (swing.v_dc_V * duties(pwm) - mean_voltage(t)).real();
}

/* One of the two edges of a period waits for the current to move the terminal by dv/dt = i/C. The
 * voltage-time area that it keeps is C V_dc^2/(2 i) if it arrives within the gap, V_dc gap - i gap^2/(2 C) if
 * not. In parts of the loss without capacitance, and with x = i gap/(C V_dc), what remains is x/2 below x = 1
 * and 1 - 1/(2 x) beyond. */
double swing_model(double x)
{
    return std::fabs(x) < 1.0 ? 0.5 * x : sign(x) - 0.5 / x;
}

struct SwingFigures {
    double curve = 0.0, slope = 0.0;
};

SwingFigures swing_figures(const Swing &swing)
{
    SwingFigures figures;
    double before = -2.0, sum_xy = 0.0, sum_xx = 0.0;
    for (double x : {-5.0, -2.0, -1.2, -0.9, -0.6, -0.3, -0.1, 0.1, 0.3, 0.6, 0.9, 1.2, 2.0, 5.0}) {
        double y = swing_error_V(swing, x * swing.edge_A()) / swing.full_V();
        EXPECT_GT(y, before) << "not monotone at " << x;
        before = y;
        figures.curve = std::max(figures.curve, std::fabs(y - swing_model(x)));
        sum_xy += std::fabs(x) < 1.0 ? x * y : 0.0;
        sum_xx += std::fabs(x) < 1.0 ? x * x : 0.0;
    }
    // The clip law of 5.6.1.2, clip(i/I_th), has this slope with I_th = 2 C V_dc/gap, and is then up to 1/4
    // too high at its corner; with half of that, which 5.6.1.2 gives as an estimate, it would be twice as
    // steep.
    figures.slope = std::fabs(2.0 * sum_xy / sum_xx - 1.0);
    return figures;
}

const Swing swings[] = {
    {300.0, 0.5e-9, times[1]}, {36.0, 2e-9, times[1]}, {560.0, 1e-9, times[2]}, {300.0, 0.5e-9, times[3]}};

TEST(OutputCapacitance, CurveAndSlope)
{
    SwingFigures worst;
    for (const Swing &swing : swings) {
        SwingFigures figures = swing_figures(swing);
        worst.curve = std::max(worst.curve, figures.curve);
        worst.slope = std::max(worst.slope, figures.slope);
    }
    measured("capacitance_slope", worst.slope, bound_slope, "relative", "5.6.1.2");
    measured("capacitance_curve", worst.curve, bound_dead_time, "of_full_loss", "5.6.1.2");
}

// Without capacitance the whole loss is there at any current.
TEST(OutputCapacitance, NoneNoSlope)
{
    double small_A = 0.1 * swings[0].edge_A();
    Swing none = swings[0];
    none.c_F = 0.0;
    EXPECT_NEAR(swing_error_V(none, small_A), none.full_V(), 1e-6 * none.full_V());
    EXPECT_NEAR(swing_error_V(none, -small_A), -none.full_V(), 1e-6 * none.full_V());
}

} // namespace
} // namespace validation
