#include "tools/pmsim/open_loop_feed.h"

#include <algorithm>
#include <cmath>

namespace pmsim
{
namespace
{

using Complex = std::complex<double>;

const double pi = 3.14159265358979324;
const double start_s = 0.1;
const double duty_range = 0.48; // either way from the middle
const Complex j(0.0, 1.0);

bool is_open(const plant_config_t &config)
{
    return config.winding.connection == PLANT_OPEN;
}

// The energy form gives currents of fluxes; this is its inverse. Saturation makes a full step overshoot; half
// steps converge.
Complex energy_form_Wb(const plant_machine_t &m, Complex i_A)
{
    const double i_f_A = m.psi_m_Wb / m.L_d0_H + m.c_A_Wb5 * std::pow(m.psi_m_Wb, 5);
    Complex psi_Wb(m.psi_m_Wb, 0.0);
    for (int k = 0; k < 60; ++k) {
        const double saturation_1_H = m.c_A_Wb5 * std::norm(psi_Wb) * std::norm(psi_Wb);
        const Complex next_Wb((i_A.real() + i_f_A) / (1.0 / m.L_d0_H + saturation_1_H),
                              i_A.imag() / (1.0 / m.L_q0_H + saturation_1_H));
        psi_Wb = 0.5 * (psi_Wb + next_Wb);
    }
    return psi_Wb;
}

// Of a set, with equal currents in both if there are two.
Complex flux_Wb(const plant_config_t &config, Complex i_A)
{
    const Complex mutual_Wb(config.winding.M_d_H * i_A.real(), config.winding.M_q_H * i_A.imag());
    if (config.map == nullptr) {
        return energy_form_Wb(config.machine, i_A) + mutual_Wb;
    }
    map_point_t point;
    map_table_eval(config.map, {i_A.real(), i_A.imag()}, 0.0, &point);
    return Complex(point.psi_Wb.d, point.psi_Wb.q) + mutual_Wb;
}

// To 1 degree, which costs 2e-4 of the torque.
Complex current_of_most_torque_A(const Setup &setup)
{
    Complex best_A;
    double most = -1.0; // of psi x i
    for (int deg = 90; deg <= 180; ++deg) {
        const Complex i_A = std::polar(setup.rated.i_rated_A, deg * pi / 180.0);
        const double torque = (std::conj(flux_Wb(setup.plant, i_A)) * i_A).imag();
        if (torque > most) {
            most = torque;
            best_A = i_A;
        }
    }
    return best_A;
}

// Fundamental of what dead time and drops take from a phase (METHODS.md 5.6.1), so that rated current flows
// in machines of little resistance too; of an open winding two legs take it.
Complex inverter_V(const plant_config_t &config, Complex i_A)
{
    const plant_inverter_t &inverter = config.inverter;
    const double late_s = inverter.dead_time_s + inverter.turn_on_s - inverter.turn_off_s;
    const double square_V = config.dclink.v_source_V * late_s * inverter.f_pwm_Hz + inverter.v_switch_V;
    const Complex leg_V = 4.0 / pi * square_V * i_A / std::abs(i_A) + inverter.r_on_ohm * i_A;
    return is_open(config) ? 2.0 * leg_V : leg_V;
}

std::array<Complex, PLANT_LEGS> leg_phasors(const plant_config_t &config)
{
    const bool open = is_open(config);
    std::array<Complex, PLANT_LEGS> leg;
    for (int k = 0; k < PLANT_LEGS; ++k) {
        const double axis_rad = 2.0 * pi / 3.0 * (k % 3) + (k >= 3 && !open ? pi / 6.0 : 0.0);
        leg[size_t(k)] = std::polar(open ? 0.5 : 1.0, -axis_rad) * (open && k >= 3 ? -1.0 : 1.0);
    }
    return leg;
}

} // namespace

OpenLoopFeed::OpenLoopFeed(const Setup &setup)
    : setup_(setup), i_A_(current_of_most_torque_A(setup)), leg_(leg_phasors(setup.plant)),
      period_s_(1.0 / setup.plant.inverter.f_pwm_Hz)
{
    const plant_config_t &config = setup_.plant;
    if (std::abs(i_A_) == 0.0) {
        throw InputError(setup.file + ": rated.i_rated_A is missing: there is no rated current to feed");
    }
    const char *error = nullptr;
    plant_.reset(plant_create(&config, 0.0, &error));
    if (plant_ == nullptr) {
        refuse_plant(setup, error);
    }
    const Complex psi_Wb = flux_Wb(config, i_A_),
                  drop_V = config.machine.R_s_ohm * i_A_ + inverter_V(config, i_A_);
    const double most_V = duty_range * config.dclink.v_source_V * (is_open(config) ? 2.0 : 1.0);
    double omega_mech_rad_s = 0.5 * setup.rated.speed_rated_rad_s;
    do {
        omega_e_rad_s_ = config.machine.pole_pairs * omega_mech_rad_s;
        v_rated_V_ = drop_V + j * omega_e_rad_s_ * psi_Wb;
        omega_mech_rad_s *= 0.99;
    } while (std::abs(v_rated_V_) > most_V && std::abs(drop_V) < most_V);
    v_start_V_ = j * omega_e_rad_s_ * flux_Wb(config, 0.0);
    plant_set_speed(plant_.get(), omega_e_rad_s_ / config.machine.pole_pairs);
}

void OpenLoopFeed::step()
{
    plant_adc_t adc;
    plant_sample(plant_.get(), &adc);

    const double t_s = (periods_ + 1.5) * period_s_; // centre of the period for which this PWM is
    const Complex v_dq_V = v_start_V_ + (v_rated_V_ - v_start_V_) * std::min(t_s / start_s, 1.0);
    const Complex v_V = v_dq_V * std::polar(1.0, omega_e_rad_s_ * t_s);
    const double counts = setup_.plant.inverter.timer_counts;
    plant_pwm_t pwm{};
    for (size_t k = 0; k < size_t(leg_count(setup_.plant)); ++k) {
        const double duty = 0.5 + (v_V * leg_[k]).real() / setup_.plant.dclink.v_source_V;
        const double compare = std::round(counts * std::clamp(duty, 0.0, 1.0));
        pwm.compare[k][0] = pwm.compare[k][1] = uint32_t(compare);
        pwm.driven[k] = true;
    }
    plant_set_pwm(plant_.get(), &pwm);
    plant_run_period(plant_.get());
    periods_ += 1.0;
}

} // namespace pmsim
