#include "tests/fuzz/exercise.h"

#include <chrono>
#include <cmath>
#include <memory>

namespace fuzz
{
namespace
{

const int periods = 4;
const double patience_s = 0.2; // per input: many inputs tell more than one long run

using Plant = std::unique_ptr<plant_t, decltype(&plant_destroy)>;

struct Watch {
    std::chrono::steady_clock::time_point began = std::chrono::steady_clock::now();
    bool out_of_patience() const
    {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count() > patience_s;
    }
};

// The states and what follows from them; the mean voltage of a period may not exist yet.
void check_finite(const plant_t *plant, const plant_config_t &config)
{
    plant_truth_t truth;
    plant_truth(plant, &truth);
    double sum = truth.t_s + truth.theta_e_rad + truth.omega_mech_rad_s + truth.torque_Nm + truth.v_dc_V;
    for (int leg = 0; leg < pmsim::leg_count(config); ++leg) {
        sum += truth.i_A[leg] + truth.v_leg_V[leg];
    }
    if (!std::isfinite(sum)) {
        __builtin_trap();
    }
}

plant_pwm_t pattern(const plant_config_t &config, int period)
{
    plant_pwm_t pwm{};
    for (int leg = 0; leg < pmsim::leg_count(config); ++leg) {
        const uint32_t step = config.inverter.timer_counts / 8;
        pwm.compare[leg][0] = step * uint32_t(1 + (leg + period) % 7);
        pwm.compare[leg][1] = pwm.compare[leg][0];
        pwm.driven[leg] = period != 2 || leg != 0; // once with a leg off: it freewheels
    }
    return pwm;
}

void run_inverter(plant_t *plant, const plant_config_t &config, const Watch &watch)
{
    for (int period = 0; period < periods && !watch.out_of_patience(); ++period) {
        plant_adc_t adc;
        plant_sample(plant, &adc);
        const plant_pwm_t pwm = pattern(config, period);
        plant_set_pwm(plant, &pwm);
        plant_run_period(plant);
        check_finite(plant, config);
    }
}

void run_sources(plant_t *plant, const plant_config_t &config, const Watch &watch)
{
    const double v_V = config.dclink.v_source_V > 0.0 ? config.dclink.v_source_V : 24.0;
    const double v_leg_V[PLANT_LEGS] = {v_V, 0.0, 0.5 * v_V, 0.0, v_V, 0.5 * v_V};
    for (int period = 0; period < periods && !watch.out_of_patience(); ++period) {
        plant_run_voltages(plant, v_leg_V, 0.0, 1.0 / config.inverter.f_pwm_Hz);
        check_finite(plant, config);
    }
}

} // namespace

void exercise(const pmsim::Setup &setup, double theta_e_rad)
{
    const plant_config_t &config = setup.plant;
    for (const auto run : {run_inverter, run_sources}) {
        const char *reason = nullptr;
        const Plant plant(plant_create(&config, theta_e_rad, &reason), &plant_destroy);
        if (!plant) {
            pmsim::refuse_plant(setup, reason);
        }
        run(plant.get(), config, Watch());
    }
}

} // namespace fuzz
