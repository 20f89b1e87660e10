// Fast response: high-frequency admittance of the switching plant (METHODS.md 4.2) and of the eddy loop
// (E19), current at the end of a voltage pulse (9.2).
#include "root_table.h"
#include "validation.h"

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace validation
{
namespace
{

using reference::measured;

constexpr double bound_admittance = 0.02; // issue: 2 %
constexpr double bound_pulse = 0.05;      // issue: 5 %

using Complex2 = Eigen::Vector2cd;

// Fourier sums of alpha and beta by themselves.
struct Fourier2 {
    Fourier alpha, beta;

    void add(Complex value, double angle_rad)
    {
        alpha.add(value.real(), angle_rad);
        beta.add(value.imag(), angle_rad);
    }

    Complex2 value() const
    {
        return {alpha.value(), beta.value()};
    }
};

// 10 V at 500 Hz, 20 PWM periods of 10 kHz, for ten cycles.
constexpr int carrier_periods = 20;
constexpr int cycles = 10;

struct Response {
    Complex2 u_V, slope_A_s; // voltage behind R and slope of the current, both at the carrier
    Complex i_A;             // mean
};

plant_pwm_t pwm_of(Complex v_V, double v_dc_V)
{
    Legs v = legs(v_V);
    return rig::pwm(0.5 + v[0] / v_dc_V, 0.5 + v[1] / v_dc_V, 0.5 + v[2] / v_dc_V);
}

// Locked at theta with a mean current, sine on top along an axis. The mean voltage of a period and the
// currents at its ends hold exactly: slope = Gamma u.
Response respond(const plant_config_t &config, double theta, Complex i_dq_A, Complex axis)
{
    double R_ohm = config.machine.R_s_ohm;
    double v_dc_V = config.dclink.v_source_V;
    rig::Plant plant(config, theta);
    Complex v_mean_V = R_ohm * i_dq_A * std::polar(1.0, theta);
    plant.run(pwm_of(v_mean_V, v_dc_V), 1500); // 12 time constants
    Fourier2 u, slope;
    Fourier mean;
    Complex before_A = current(plant.truth());
    for (int n = 0; n < cycles * carrier_periods; n++) {
        double angle = 2.0 * rig::pi * n / carrier_periods;
        plant.run(pwm_of(v_mean_V + 10.0 * axis * std::sin(angle), v_dc_V));
        plant_truth_t t = plant.truth();
        Complex i_A = current(t);
        Complex v_V(t.v_mean_alpha_V, t.v_mean_beta_V);
        u.add(v_V - 0.5 * R_ohm * (before_A + i_A), angle);
        slope.add((i_A - before_A) / plant.period_s(), angle);
        mean.add(i_A, 0.0);
        before_A = i_A;
    }
    return {u.value(), slope.value(), mean.value()};
}

// Largest deviation of the admittance from the tangent of the map, relative to its norm, over the angle.
double admittance_error(const plant_config_t &config, const reference::FluxMap &flux, Complex i_dq_A,
                        int step_deg)
{
    double worst = 0.0;
    for (int at = 0; at < 360; at += step_deg) {
        double theta = at * deg;
        Response along = respond(config, theta, i_dq_A, 1.0);
        Response across = respond(config, theta, i_dq_A, j);
        Eigen::Matrix2cd u, slope;
        u << along.u_V, across.u_V;
        slope << along.slope_A_s, across.slope_A_s;
        Eigen::Matrix2cd gamma = slope * u.inverse();
        Complex i_A = 0.5 * (along.i_A + across.i_A) * std::polar(1.0, -theta);
        Eigen::Matrix2d turn;
        turn << std::cos(theta), -std::sin(theta), std::sin(theta), std::cos(theta);
        Eigen::Matrix2d expected =
            turn * flux({i_A.real(), i_A.imag()}, theta).L_H.inverse() * turn.transpose();
        worst = std::max(worst, (gamma - expected.cast<Complex>()).norm() / expected.norm());
    }
    return worst;
}

std::string name(Complex i_dq_A)
{
    return "d" + std::to_string(std::lround(i_dq_A.real())) + "_q" +
           std::to_string(std::lround(i_dq_A.imag()));
}

TEST(Hf, AdmittanceIsTheTangentOfTheEnergyForm)
{
    plant_config_t config = ipm_saturating();
    config.mech.locked = true;
    reference::FluxMap flux = reference::inverse(energy_form(config.machine));
    for (Complex i_dq_A : {Complex(0, 0), Complex(0, 4), Complex(-3, 3), Complex(2, -2)}) {
        measured("hf_admittance_" + name(i_dq_A), admittance_error(config, flux, i_dq_A, 15),
                 bound_admittance, "relative", "4.2");
    }
}

TEST(Hf, AdmittanceIsTheTangentOfATable)
{
    reference::RootMap map;
    Table table = table_of(map);
    plant_config_t config = ipm_linear();
    config.mech.locked = true;
    config.map = table.get();
    for (Complex i_dq_A : {Complex(0, 0), Complex(-3, 3)}) {
        measured("hf_admittance_table_" + name(i_dq_A), admittance_error(config, map, i_dq_A, 45),
                 bound_admittance, "relative", "4.2");
    }
}

// Direction that a saliency method finds: that of the anisotropy of the currents' response to two short
// pulses, from rest.
double found_axis_rad(const plant_config_t &config, double theta)
{
    constexpr double pulse_s = 1e-6; // R takes less than 1e-4 of it
    Complex along, across;
    for (Complex *i_A : {&along, &across}) {
        rig::Plant plant(config, theta);
        hold(plant, legs(30.0 * (i_A == &along ? Complex(1.0) : j)), pulse_s);
        *i_A = current(plant.truth());
    }
    double cross = 0.5 * (along.imag() + across.real());
    return 0.5 *
           std::arg(Complex(0.5 * (along.real() - across.imag()), cross) * std::polar(1.0, -2.0 * theta));
}

// METHODS-ADDENDUM.md 5.4: a saliency of order k, a tenth of the second, misleads by 1/2 0.1 sin((k - 2)
// theta + phase): the 6th order for -4 and 8, the 12th for -10 and 14.
TEST(Hf, SaliencyHarmonicsMisleadByTheOrderOfTheBook)
{
    constexpr double ratio = 0.1, phase = 0.3;
    constexpr int angles = 96;
    for (int order : {-4, 8, -10, 14}) {
        plant_config_t config = ipm_linear();
        config.machine.psi_m_Wb = 0.0;
        config.mech.locked = true;
        config.winding.saliency[0] = {order, 0.5 * ratio * (config.machine.L_q0_H - config.machine.L_d0_H),
                                      phase};
        Fourier own, other[3];
        int others[3] = {2, 4, std::abs(order - 2) == 6 ? 12 : 6};
        double worst_rad = 0.0;
        for (int n = 0; n < angles; n++) {
            double theta = 2.0 * rig::pi * n / angles;
            double error_rad = found_axis_rad(config, theta);
            // the magnet's anisotropy is -K e^{j 2 theta}
            double expected_rad = 0.5 * std::arg(1.0 - std::polar(ratio, (order - 2) * theta + phase));
            worst_rad = std::max(worst_rad, std::fabs(error_rad - expected_rad));
            own.add(2.0 * error_rad, std::abs(order - 2) * theta);
            for (int k = 0; k < 3; k++) {
                other[k].add(2.0 * error_rad, others[k] * theta);
            }
        }
        measured("saliency_order_" + std::to_string(order), worst_rad / (0.5 * ratio), 0.002, "of_peak",
                 "5.4");
        EXPECT_NEAR(std::abs(own.value()) / deg, 2.865, 0.01) << order;
        for (int k = 0; k < 3; k++) { // the square of the ratio makes the double order: a quarter of it
            EXPECT_LT(std::abs(other[k].value()) / deg, others[k] == 2 * std::abs(order - 2) ? 0.15 : 0.01)
                << order << " " << others[k];
        }
    }
}

TEST(Hf, AdmittanceIsIndependentOfTolerance)
{
    plant_config_t config = ipm_saturating();
    config.mech.locked = true;
    reference::FluxMap flux = reference::inverse(energy_form(config.machine));
    config.tolerance = 1e-6;
    double coarse = admittance_error(config, flux, Complex(0, 4), 90);
    config.tolerance = 0.5e-6;
    double fine = admittance_error(config, flux, Complex(0, 4), 90);
    measured("tolerance_hf_admittance", std::fabs(fine - coarse), 0.1 * bound_admittance, "relative",
             "step size");
}

// Impedance of one axis of the locked machine: sine in 128 steps a cycle; the mean of a step turns by half a
// step and shrinks by its sinc.
Complex impedance_ohm(const plant_config_t &config, Complex axis, double f_Hz)
{
    constexpr int steps = 128;
    rig::Plant plant(config);
    Fourier v, i;
    double step_s = 1.0 / (f_Hz * steps);
    int settled = static_cast<int>(std::ceil(0.25 * f_Hz)) * steps;
    for (int n = 0; n < settled + steps; n++) {
        double angle = 2.0 * rig::pi * n / steps;
        double v_V = 20.0 * std::cos(angle);
        hold(plant, legs(v_V * axis), step_s);
        if (n >= settled) {
            v.add(v_V, angle);
            i.add((current(plant.truth()) / axis).real(), angle + 2.0 * rig::pi / steps);
        }
    }
    double half = rig::pi / steps;
    return v.value() * std::polar(std::sin(half) / half, -half) / i.value();
}

// L beside L_eddy with R_eddy in it: 1/(j w L_eff) = 1/(j w L) + 1/(R_eddy + j w L_eddy).
TEST(Hf, EddyLoop)
{
    plant_config_t config = ipm_linear();
    config.mech.locked = true;
    config.winding.L_eddy_d_H = 0.2;
    config.winding.L_eddy_q_H = 0.3;
    config.winding.R_eddy_ohm = 150.0;
    double worst = 0.0;
    for (double f_Hz : {30.0, 100.0, 300.0, 1000.0}) {
        Complex s = 2.0 * rig::pi * f_Hz * j;
        Complex z_d = 6.0 + 1.0 / (1.0 / (s * 43e-3) + 1.0 / (150.0 + s * 0.2));
        Complex z_q = 6.0 + 1.0 / (1.0 / (s * 75e-3) + 1.0 / (150.0 + s * 0.3));
        worst = std::max(worst, std::abs(impedance_ohm(config, 1.0, f_Hz) / z_d - 1.0));
        worst = std::max(worst, std::abs(impedance_ohm(config, j, f_Hz) / z_q - 1.0));
    }
    // Ten times better than 4.2 asks for, so that 10 % of R_eddy is seen; 0.03 % is the ripple of the steps.
    measured("hf_eddy_impedance", worst, 0.1 * bound_admittance, "relative", "E19");
}

// 9.2: current at the end of a pulse of flux F along gamma. b = d2 i_d/d psi_d2, c = d2 i_d/d psi_q2 of the
// energy form at the magnet's flux.
Complex pulse_model_A(const plant_machine_t &m, double F_Wb, double gamma, double theta)
{
    double c4 = m.c_A_Wb5 * std::pow(m.psi_m_Wb, 4);
    double Gamma_d = 1.0 / m.L_d0_H + 5.0 * c4; // 1/L_dh
    double Gamma_q = 1.0 / m.L_q0_H + c4;
    double b = 20.0 * c4 / m.psi_m_Wb;
    double c = 4.0 * c4 / m.psi_m_Wb;
    Complex linear = 0.5 * F_Wb *
                     ((Gamma_d + Gamma_q) * std::polar(1.0, gamma) +
                      (Gamma_d - Gamma_q) * std::polar(1.0, 2.0 * theta - gamma));
    Complex second = 2.0 * (b + c) * std::polar(1.0, theta) + (b + c) * std::polar(1.0, 2.0 * gamma - theta) +
                     (b - 3.0 * c) * std::polar(1.0, 3.0 * theta - 2.0 * gamma);
    return linear + F_Wb * F_Wb / 8.0 * second;
}

struct Pulse {
    double worst_A = 0.0, sum2 = 0.0, peak_A = 0.0;
    int count = 0;
};

// Six pulses on each of 24 rotor angles, legs at V_dc and 0.
Pulse pulses(const plant_config_t &config, double T_s)
{
    double v_dc_V = config.dclink.v_source_V;
    Pulse pulse;
    for (int at = 0; at < 360; at += 15) {
        for (int sector = 0; sector < 6; sector++) {
            double gamma = sector * 60.0 * deg;
            rig::Plant plant(config, at * deg);
            Legs v_V{};
            for (size_t k = 0; k < 3; k++) {
                v_V[k] = std::cos(gamma - static_cast<double>(k) * 120.0 * deg) > 0.0 ? v_dc_V : 0.0;
            }
            hold(plant, v_V, T_s);
            Complex i_A = current(plant.truth());
            double F_Wb = 2.0 / 3.0 * v_dc_V * T_s;
            double off_A = std::abs(i_A - pulse_model_A(config.machine, F_Wb, gamma, at * deg));
            pulse.worst_A = std::max(pulse.worst_A, off_A);
            pulse.sum2 += off_A * off_A;
            pulse.peak_A = std::max(pulse.peak_A, std::abs(i_A));
            pulse.count++;
        }
    }
    return pulse;
}

void report_pulse(const std::string &id, plant_config_t config, double T_s, double peak_A, double bound)
{
    config.mech.locked = true;
    Pulse pulse = pulses(config, T_s);
    EXPECT_NEAR(pulse.peak_A, peak_A, 0.05 * peak_A) << id;
    measured(id + "_max", pulse.worst_A / peak_A, bound, "of_peak", "9.2");
    measured(id + "_rms", std::sqrt(pulse.sum2 / pulse.count) / peak_A, bound, "of_peak", "9.2");
}

// At the rated peak of 4 A. The terms of third order that 9.2 leaves out would be 7 % here, but they and the
// drop over R, which it leaves out too, go against each other.
TEST(Pulse, IpmAtRatedPeak)
{
    report_pulse("pulse_ipm", ipm_saturating(), 800e-6, 4.0, bound_pulse);
}

TEST(Pulse, SpmAtRatedPeak)
{
    plant_config_t config = ideal(0.373, 3.385e-3, 3.385e-3, 77.6e-3, 5, 36.0);
    config.machine.c_A_Wb5 = 2.09e5;
    report_pulse("pulse_spm", config, 480e-6, 4.0, bound_pulse);
}

// Neither left-out part: without R, at a quarter of the current, where the third order is 7 %/16.
TEST(Pulse, SecondOrderAlone)
{
    plant_config_t config = ipm_saturating();
    config.machine.R_s_ohm = 1e-3;
    report_pulse("pulse_ipm_second_order", config, 205e-6, 1.0, 0.01);
}

} // namespace
} // namespace validation
