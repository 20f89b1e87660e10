// Distortion of an injected voltage by dead time and output capacitance (5.6.2).
#include "validation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace validation
{
namespace
{

using reference::measured;

constexpr double bound_resistance = 0.10; // as the slope of the voltage error itself, 5.6.1.2
constexpr double carrier_Hz = 500.0, injected_V = 10.0, corner_A = 0.3;

// SPM-like, locked, 3 us of dead time; the terminals need all of it to swing at corner_A.
plant_config_t distorting()
{
    plant_config_t c = ideal(6.0, 43e-3, 43e-3, 0.0, 3, 300.0);
    c.mech.locked = true;
    c.inverter.dead_time_s = 3e-6;
    c.inverter.c_leg_F = corner_A * c.inverter.dead_time_s / c.dclink.v_source_V;
    return c;
}

struct Carrier {
    Complex voltage, current; // on alpha, at the carrier
    double mean_A;
};

// Carrier and a constant voltage on alpha for whole carrier periods, after it has settled.
Carrier inject(const plant_config_t &config, double constant_V)
{
    rig::Plant plant(config);
    double T = plant.period_s(), v_dc_V = config.dclink.v_source_V;
    Carrier sum{};
    constexpr int settling = 2000, counted = 400; // 20 periods of the carrier, at 20 samples each
    double before_A = 0.0;
    for (int k = 0; k < settling + counted; k++) {
        double x = 2.0 * rig::pi * carrier_Hz * k * T;
        double v = (constant_V + injected_V * std::cos(x)) / v_dc_V;
        plant.run(rig::pwm(0.5 + 2.0 / 3.0 * v, 0.5 - v / 3.0, 0.5 - v / 3.0, config.inverter.timer_counts));
        plant_truth_t t = plant.truth();
        if (k >= settling) {
            Complex turn = std::exp(-j * x) * (2.0 / counted);
            sum.voltage += t.v_mean_alpha_V * turn; // of the period that ends here, as is the current's mean
            sum.current += 0.5 * (t.i_A[0] + before_A) * turn;
            sum.mean_A += t.i_A[0] / counted;
        }
        before_A = t.i_A[0];
    }
    return sum;
}

// What the carrier loses, as a resistance: R_Xh of 5.6.2.
double resistance_ohm(double constant_V, double *mean_A)
{
    plant_config_t clean = distorting();
    clean.inverter.dead_time_s = 0.0;
    clean.inverter.c_leg_F = 0.0;
    clean.inverter.timer_counts = 1000000; // rounding of a timer is not the question
    plant_config_t config = distorting();
    config.inverter.timer_counts = clean.inverter.timer_counts;
    Carrier with = inject(config, constant_V);
    *mean_A = with.mean_A;
    return std::real((inject(clean, constant_V).voltage - with.voltage) / with.current);
}

// Within the corner the error is dV i / (2 corner), so each phase has dV/(2 corner) in series; far from zero
// the error is constant and the carrier passes unharmed.
TEST(Distortion, CarrierMeetsAResistanceNearZeroCurrentOnly)
{
    plant_config_t config = distorting();
    double error_V = config.dclink.v_source_V * config.inverter.dead_time_s * config.inverter.f_pwm_Hz;
    double expected = error_V / (2.0 * corner_A);
    double mean_A = 0.0;
    double near = resistance_ohm(0.0, &mean_A);
    EXPECT_NEAR(mean_A, 0.0, 0.01);
    measured("distortion_near_zero", std::fabs(near / expected - 1.0), bound_resistance, "relative", "5.6.2");
    double far = resistance_ohm(4.0 / 3.0 * error_V + 6.0 * 6.0, &mean_A);
    EXPECT_GT(mean_A, 8.0 * corner_A); // and half of it in the other phases
    measured("distortion_far_from_zero", std::fabs(far / expected), bound_resistance, "relative", "5.6.2");
}

} // namespace
} // namespace validation
