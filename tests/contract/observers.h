// Every observer of observers/observers.def for a linear machine, configured as the drive does it: by its maker,
// from SI parameters.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"

namespace bench
{

// Of the star point: third harmonic and L_s2 - M_s2.
constexpr double kPsi3_Wb = 7e-3, kDL0_H = 2e-3;

// v_0 with currents that stand in the rotor's frame (METHODS.md 0.2, E3).
inline double star_point_V(double theta_rad, double omega_rad_s, Complex i_dq_A)
{
    const Complex flux = kPsi3_Wb - 0.5 * kDL0_H * i_dq_A;
    return (kJ * 3.0 * omega_rad_s * flux * std::polar(1.0, 3 * theta_rad)).real();
}

// A second set of windings lies 30 degrees on; with one bridge there is none.
constexpr double kSecondSet_rad = kPi / 6;

inline void give_second_set(drive_params_t &p, int32_t observer)
{
    if (observer == OBSERVER_third_pair || observer == OBSERVER_third_pair_flux) {
        p.winding = WINDING_TWO_SETS;
        p.start_method = 2;
    }
}

struct ObserverCase {
    std::string name;
    observer_config_t config;
};

// The machine without saturation, on an inverter that has these bases.
inline drive_params_t parameters(const Machine &linear, const Base &b)
{
    drive_params_t p;
    drive_params_default(&p);
    const auto set = [&p](drive_param_id_t id, double si) {
        drive_param_set(&p, id, static_cast<int32_t>(std::lround(si * std::pow(10, -drive_param_exp10[id]))));
    };
    set(DRIVE_PARAM_f_pwm, 1 / b.period_s);
    set(DRIVE_PARAM_v_full_scale, b.v_V);
    set(DRIVE_PARAM_i_full_scale, b.i_A);
    set(DRIVE_PARAM_speed_trip, b.omega_rad_s / linear.pole_pairs);
    set(DRIVE_PARAM_pole_pairs, linear.pole_pairs);
    set(DRIVE_PARAM_R_s, linear.R_ohm);
    for (const auto id : {DRIVE_PARAM_L_d, DRIVE_PARAM_L_dh_rated}) {
        set(static_cast<drive_param_id_t>(id), linear.L_d0_H);
    }
    for (const auto id : {DRIVE_PARAM_L_q, DRIVE_PARAM_L_q_rated, DRIVE_PARAM_L_qh_rated}) {
        set(static_cast<drive_param_id_t>(id), linear.L_q0_H);
    }
    set(DRIVE_PARAM_L_dqh_rated, 0);
    set(DRIVE_PARAM_cross_half, 0);
    set(DRIVE_PARAM_psi_m, linear.psi_m_Wb);
    set(DRIVE_PARAM_neutral_full_scale, kNeutral.full_scale_V);
    set(DRIVE_PARAM_psi_3, kPsi3_Wb);
    set(DRIVE_PARAM_dL_0, kDL0_H);
    set(DRIVE_PARAM_neutral_filter, 0);
    return p;
}

// As the drive makes it. An observer for round machines refuses a salient one; it gets L_q for both axes, which
// is the same machine without i_d.
inline ObserverCase observer_case(observer_id_t id, const char *name, const Machine &m, const Base &b)
{
    drive_params_t p = parameters(m, b);
    p.observer = static_cast<int32_t>(id);
    give_second_set(p, p.observer);
    drive_config_t config = {};
    if (id == OBSERVER_zero_vector) { // sees its EMF at higher speeds only
        p.speed_low = static_cast<int32_t>(0.3 * p.speed_trip);
        p.speed_high = static_cast<int32_t>(0.38 * p.speed_trip);
        p.speed_max = static_cast<int32_t>(0.5 * p.speed_trip);
    }
    if (!drive_configure(&config, &p, PM_CHANNELS).ok) {
        p.L_d = p.L_q;
        p.L_dh_rated = p.L_qh_rated;
        p.start_method = 2;
    }
    const drive_result_t result = drive_configure(&config, &p, PM_CHANNELS);
    return {result.ok ? name : name + (": " + std::string(drive_param_table[result.param].name)),
            result.ok ? config.position.observer : observer_config_t{OBSERVER_COUNT, {}}};
}

inline std::vector<ObserverCase> observer_cases(const Machine &m = kIpmLinear, const Base &b = kIpmBase)
{
    return {
#define PM_METHOD(x, help, traits, needs) observer_case(OBSERVER_##x, #x, m, b),
#include "observers/observers.def"
#undef PM_METHOD
    };
}

struct InjectionCase {
    std::string name;
    unsigned traits;
    injection_config_t config;
};

// Every low-speed source of injection/injections.def, as the drive makes it.
inline std::vector<InjectionCase> injection_cases(const Machine &m = kIpmLinear, const Base &b = kIpmBase)
{
    std::vector<InjectionCase> all;
    const auto add = [&](injection_id_t id, const char *name, unsigned traits) {
        drive_params_t p = parameters(m, b);
        p.injection = static_cast<int32_t>(id);
        p.start_method = 1;
        p.regulator = (traits & SOURCE_IN_REFERENCE) != 0 ? static_cast<int32_t>(REGULATOR_deadbeat) : 0;
        p.neutral_filter = static_cast<int32_t>(std::lround(kNeutral.filter_s * 1e9));
        if (id == INJECTION_zero_pair_anti_rotating || id == INJECTION_zero_pair_rotating) {
            p.winding = WINDING_TWO_SETS; // without mutual inductance
            p.start_method = 3;
        }
        drive_config_t config = {};
        const drive_result_t result = drive_configure(&config, &p, PM_CHANNELS);
        injection_config_t none = {};
        none.id = INJECTION_COUNT;
        all.push_back({result.ok ? name : name + (": " + std::string(drive_param_table[result.param].name)),
                       traits, result.ok ? config.position.injection : none});
    };
#define PM_METHOD(name, help, traits, needs) add(INJECTION_##name, #name, traits);
#include "injection/injections.def"
#undef PM_METHOD
    return all;
}

} // namespace bench
