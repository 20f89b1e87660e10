// A locked machine on its inverter, whose legs a start procedure drives by duty: for methods that are no pulse train.
#ifndef TESTS_UNIT_INJECTION_LEG_RIG_H
#define TESTS_UNIT_INJECTION_LEG_RIG_H

#include <functional>

#include "tests/unit/injection/pulse_rig.h"

namespace leg_rig
{

using namespace pulse_rig;

struct LegRun {
    pm_procedure_t result = PM_RUNNING;
    int periods = 0;
    double i_most_A = 0, turned_Nms = 0;
};

// step(i, out): a period; each_ms: what belongs to 1 kHz.
inline LegRun run_legs(
    const Rig &r, double theta_rad, uint64_t seed,
    const std::function<pm_procedure_t(pm_abc_t, pulses_out_t *)> &step,
    const std::function<void()> &each_ms = [] {})
{
    plant_config_t config = r.plant;
    config.sensor.seed = seed;
    const char *error = nullptr;
    const std::unique_ptr<plant_t, void (*)(plant_t *)> plant(plant_create(&config, theta_rad, &error),
                                                              &plant_destroy);
    EXPECT_EQ(error, nullptr);
    LegRun x;
    while (x.result == PM_RUNNING && x.periods < 5000) {
        plant_adc_t adc;
        plant_sample(plant.get(), &adc);
        pulses_out_t out;
        x.result = step(currents(adc), &out);
        plant_pwm_t pwm = {};
        for (int leg = 0; leg < 3; ++leg) {
            const double counts = real(out.duty[leg]) * config.inverter.timer_counts;
            EXPECT_GE(counts, 0);
            EXPECT_LE(counts, config.inverter.timer_counts);
            pwm.compare[leg][0] = pwm.compare[leg][1] = static_cast<uint32_t>(counts);
            pwm.driven[leg] = out.driven;
        }
        plant_set_pwm(plant.get(), &pwm);
        plant_run_period(plant.get());
        plant_truth_t truth;
        plant_truth(plant.get(), &truth);
        x.turned_Nms += truth.torque_Nm * r.base.period_s;
        x.i_most_A = std::max(x.i_most_A, std::hypot(truth.i_d_A, truth.i_q_A));
        ++x.periods;
        if (x.periods % 10 == 0) {
            each_ms();
        }
    }
    each_ms();
    return x;
}

// The same machine without saturation, as salient as at zero current.
inline Rig linear(Rig r)
{
    r.plant.machine.c_A_Wb5 = 0;
    r.plant.machine.L_d0_H = r.L_d_H;
    r.plant.machine.L_q0_H = r.L_q_H;
    return r;
}

} // namespace leg_rig

#endif
