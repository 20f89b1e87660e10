// Six-step operation of the BLDC machines of METHODS.md 14, open loop from the true angle.
#ifndef TESTS_UNIT_SIM_PLANT_SIX_STEP_H
#define TESTS_UNIT_SIM_PLANT_SIX_STEP_H

#include "validation.h"

#include <array>
#include <cmath>

namespace validation
{

// EMF with a flat top of 120 degrees: e = E sum of 24/(pi n)^2 sin(n 30 deg) sin(n x). psi_m is the
// fundamental's, so that E = omega psi_m pi^2/12.
inline plant_config_t bldc_fan()
{
    plant_config_t c = ideal(0.40, 0.50e-3, 0.50e-3, 7.5e-3, 4, 24.0);
    for (int k = 0; k < PLANT_HARMONICS; k++) {
        int n = 2 * k + 3;
        c.winding.emf[k] = {n, 2.0 * 7.5e-3 * std::sin(n * 30.0 * deg) / std::pow(n, 3), 0.0};
    }
    c.inverter.f_pwm_Hz = 20e3;
    return c;
}

inline plant_config_t bldc_hs()
{
    plant_config_t c = ideal(0.025, 0.025e-3, 0.025e-3, 1.25e-3, 1, 24.0);
    c.inverter.f_pwm_Hz = 40e3;
    c.sensor.i_full_scale_A = 40.0;
    return c;
}

inline bool is_trapezoid(const plant_config_t &config)
{
    return config.winding.emf[0].order == 3;
}

// E of a trapezoid, E_m of a sine.
inline double peak_V(const plant_config_t &config, double omega_e)
{
    return omega_e * config.machine.psi_m_Wb * (is_trapezoid(config) ? rig::pi * rig::pi / 12.0 : 1.0);
}

inline double emf_V(const plant_config_t &config, int k, double omega_e, double theta_e)
{
    double own = theta_e - k * 120.0 * deg;
    double psi_Wb = config.machine.psi_m_Wb * std::sin(own);
    for (const plant_harmonic_t &h : config.winding.emf) {
        psi_Wb += h.order * h.amplitude * std::sin(h.order * own + h.phase_rad);
    }
    return -omega_e * psi_Wb;
}

enum class Pattern { h_pwm_l_pwm, h_pwm_l_on, h_on_l_pwm, pwm_on, on_pwm }; // 10.3.1
constexpr Pattern patterns[] = {Pattern::h_pwm_l_pwm, Pattern::h_pwm_l_on, Pattern::h_on_l_pwm,
                                Pattern::pwm_on, Pattern::on_pwm};

// 0.1: from 30 degrees on B+A-, C+A-, C+B-, A+B-, A+C-, B+C-. The leg that has just come is the lower one in
// even sectors, the upper one in odd ones.
struct Sector {
    int number, high, low, open;

    explicit Sector(double theta_e)
        : number((static_cast<int>(std::floor(theta_e / (60.0 * deg) + 1e-9 - 0.5)) % 6 + 6) % 6),
          high((number + 3) / 2 % 3), low(number / 2), open(3 - high - low)
    {
    }

    bool upper_has_come() const
    {
        return number % 2 == 1;
    }

    bool chops_high(Pattern p) const
    {
        return p == Pattern::h_pwm_l_pwm || p == Pattern::h_pwm_l_on ||
               (p == Pattern::pwm_on && upper_has_come()) || (p == Pattern::on_pwm && !upper_has_come());
    }

    bool chops_low(Pattern p) const
    {
        return p == Pattern::h_pwm_l_pwm || p == Pattern::h_on_l_pwm ||
               (p == Pattern::pwm_on && !upper_has_come()) || (p == Pattern::on_pwm && upper_has_come());
    }

    // Shares of the period for which legs are on the upper rail, by a device that is on for `duty` of it.
    std::array<double, 3> duties(Pattern p, double duty) const
    {
        std::array<double, 3> d{};
        d[static_cast<size_t>(high)] = chops_high(p) ? duty : 1.0;
        d[static_cast<size_t>(low)] = chops_low(p) ? 1.0 - duty : 0.0;
        return d;
    }
};

// A drive at a given speed. 60 degrees are a whole number of periods, so it commutates at its angles.
class SixStep
{
  public:
    SixStep(const plant_config_t &config_, Pattern pattern_, double duty_, double about_rad_s)
        : config(config_), pattern(pattern_), duty(duty_),
          step_rad(60.0 * deg / std::ceil(60.0 * deg * config.inverter.f_pwm_Hz / about_rad_s)),
          omega_e(step_rad * config.inverter.f_pwm_Hz), plant(config, start_rad), sector(start_rad)
    {
        plant_set_speed(plant, omega_e / config.machine.pole_pairs);
    }

    // To the start of the next period; true when it is a commutation.
    bool run()
    {
        int before = sector.number;
        periods_++;
        sector = Sector(start_rad + periods_ * step_rad);
        std::array<double, 3> d = sector.duties(pattern, duty);
        plant_pwm_t pwm = rig::pwm(d[0], d[1], d[2]);
        pwm.driven[sector.open] = false;
        plant.run(pwm);
        return sector.number != before;
    }

    void run_sectors(int count)
    {
        while (count > 0) {
            count -= run() ? 1 : 0;
        }
    }

    const plant_config_t config;
    const Pattern pattern;
    const double duty;
    const double step_rad; // of a period
    const double omega_e;
    rig::Plant plant;
    Sector sector; // in force

  private:
    static constexpr double start_rad = 30.0 * deg;
    int periods_ = 0;
};

// Duty that drives about i_A through two phases.
inline double duty_for(const plant_config_t &config, Pattern pattern, double omega_e, double i_A)
{
    double line = is_trapezoid(config) ? 2.0 : std::sqrt(3.0) * 3.0 / rig::pi; // mean over a sector
    double share =
        (line * peak_V(config, omega_e) + 2.0 * config.machine.R_s_ohm * i_A) / config.dclink.v_source_V;
    return pattern == Pattern::h_pwm_l_pwm ? 0.5 + 0.5 * share : share;
}

} // namespace validation

#endif
