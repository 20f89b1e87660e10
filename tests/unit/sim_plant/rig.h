// What the plant's tests share: machines of METHODS.md 14, an owner for the plant, and a plain
// field-oriented controller that reads the truth, to keep a motor loaded.
#ifndef TESTS_UNIT_SIM_PLANT_RIG_H
#define TESTS_UNIT_SIM_PLANT_RIG_H

#include "sim_plant/plant.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>

namespace rig
{

constexpr double pi = 3.14159265358979323846;
constexpr uint32_t counts = 8400;

// An inverter whose switches follow their gates at once, and its link.
inline plant_inverter_t inverter(double f_pwm_Hz, double dead_time_s, double v_switch_V, double v_diode_V,
                                 double r_on_ohm, uint32_t timer_counts = counts)
{
    plant_inverter_t v{};
    v.f_pwm_Hz = f_pwm_Hz;
    v.dead_time_s = dead_time_s;
    v.v_switch_V = v_switch_V;
    v.v_diode_V = v_diode_V;
    v.r_on_ohm = r_on_ohm;
    v.timer_counts = timer_counts;
    return v;
}

inline plant_dclink_t dclink(double v_source_V, double r_source_ohm = 0.0, double c_F = 0.0,
                             bool source_blocks = false)
{
    plant_dclink_t d{};
    d.v_source_V = v_source_V;
    d.r_source_ohm = r_source_ohm;
    d.c_F = c_F;
    d.source_blocks = source_blocks;
    return d;
}

// IPM-1000 on an ideal inverter: no dead time, no drops, stiff link.
inline plant_config_t ipm_1000()
{
    plant_config_t c{};
    c.machine = {6.0, 46.3e-3, 76.9e-3, 105.0, 0.236, 3};
    c.mech.J_kgm2 = 0.01;
    c.mech.B_Nms = 1e-3;
    c.inverter = inverter(10e3, 0.0, 0.0, 0.0, 0.0);
    c.dclink = dclink(300.0);
    c.sensor.i_full_scale_A = 10.0;
    c.sensor.v_full_scale_V = 450.0;
    return c;
}

// The same with all that an inverter does wrong.
inline plant_config_t ipm_1000_real()
{
    plant_config_t c = ipm_1000();
    c.inverter = inverter(10e3, 2e-6, 1.2, 0.9, 0.05);
    c.dclink = dclink(300.0, 0.5, 470e-6);
    return c;
}

// SPM-400 without saturation, on an ideal inverter: what a closed form can follow.
inline plant_config_t spm_400_linear()
{
    plant_config_t c = ipm_1000();
    c.machine = {0.373, 3.24e-3, 3.24e-3, 0.0, 77.6e-3, 5};
    c.dclink.v_source_V = 36.0;
    c.sensor.v_full_scale_V = 60.0;
    return c;
}

inline plant_pwm_t pwm(double duty_a, double duty_b, double duty_c, uint32_t timer_counts = counts)
{
    plant_pwm_t p{};
    const double duty[3] = {duty_a, duty_b, duty_c};
    for (int k = 0; k < 3; k++) {
        auto compare = static_cast<uint32_t>(std::lround(duty[k] * timer_counts));
        p.compare[k][0] = compare;
        p.compare[k][1] = compare;
        p.driven[k] = true;
    }
    return p;
}

// Currents of the three legs of a star.
inline std::array<double, 3> currents(const plant_truth_t &t)
{
    return {t.i_A[0], t.i_A[1], t.i_A[2]};
}

inline plant_pwm_t all_off()
{
    return plant_pwm_t{};
}

class Plant
{
  public:
    explicit Plant(const plant_config_t &config, double theta_e_rad = 0.0)
        : plant_(create(config, theta_e_rad), &plant_destroy), period_s_(1.0 / config.inverter.f_pwm_Hz)
    {
    }

    operator plant_t *() const
    {
        return plant_.get();
    }

    plant_truth_t truth() const
    {
        plant_truth_t t;
        plant_truth(plant_.get(), &t);
        return t;
    }

    // One period; the PWM acts in the next.
    void run(const plant_pwm_t &next)
    {
        plant_set_pwm(plant_.get(), &next);
        plant_run_period(plant_.get());
    }

    void run(const plant_pwm_t &next, int periods)
    {
        for (int k = 0; k < periods; k++) {
            run(next);
        }
    }

    // Moves on to an instant within the present period and looks.
    plant_truth_t at(double within_period_s)
    {
        plant_sensor(plant_.get())->delay_s = within_period_s;
        plant_adc_t adc;
        plant_sample(plant_.get(), &adc);
        return truth();
    }

    double period_s() const
    {
        return period_s_;
    }

  private:
    static plant_t *create(const plant_config_t &config, double theta_e_rad)
    {
        const char *error = nullptr;
        plant_t *plant = plant_create(&config, theta_e_rad, &error);
        if (plant == nullptr) {
            throw std::invalid_argument(error);
        }
        return plant;
    }

    std::unique_ptr<plant_t, void (*)(plant_t *)> plant_;
    double period_s_;
};

// PI current control on the true currents and angle, phase voltages by sine modulation.
class CurrentControl
{
  public:
    CurrentControl(const plant_config_t &config, double bandwidth_rad_s = 1500.0)
        : period_s_(1.0 / config.inverter.f_pwm_Hz), v_dc_(config.dclink.v_source_V),
          poles_(config.machine.pole_pairs), kp_(bandwidth_rad_s * config.machine.L_d0_H),
          ki_(bandwidth_rad_s * config.machine.R_s_ohm + 1.0), psi_m_(config.machine.psi_m_Wb)
    {
    }

    plant_pwm_t step(const plant_truth_t &t, double i_d_ref, double i_q_ref)
    {
        double omega_e = poles_ * t.omega_mech_rad_s;
        double e_d = i_d_ref - t.i_d_A;
        double e_q = i_q_ref - t.i_q_A;
        integral_d_ += ki_ * period_s_ * e_d;
        integral_q_ += ki_ * period_s_ * e_q;
        double v_d = kp_ * e_d + integral_d_ - omega_e * t.psi_q_Wb;
        double v_q = kp_ * e_q + integral_q_ + omega_e * (psi_m_ > 0.0 ? t.psi_d_Wb : 0.0);
        double angle = t.theta_e_rad + 1.5 * period_s_ * omega_e;
        double v_alpha = v_d * std::cos(angle) - v_q * std::sin(angle);
        double v_beta = v_d * std::sin(angle) + v_q * std::cos(angle);
        auto duty = [this](double v) { return std::fmin(std::fmax(0.5 + v / v_dc_, 0.02), 0.98); };
        double half_beta = 0.5 * std::sqrt(3.0) * v_beta;
        return pwm(duty(v_alpha), duty(-0.5 * v_alpha + half_beta), duty(-0.5 * v_alpha - half_beta));
    }

  private:
    double period_s_, v_dc_;
    int poles_;
    double kp_, ki_, psi_m_;
    double integral_d_ = 0.0, integral_q_ = 0.0;
};

} // namespace rig

#endif
