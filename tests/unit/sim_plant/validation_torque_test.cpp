// Torque of square-wave and sine-wave operation (1.5): T = 2 E I / omega_m and 1.5 E I / omega_m.
#include "six_step.h"

#include <gtest/gtest.h>

#include <cmath>

namespace validation
{
namespace
{

using reference::measured;

constexpr double bound_torque = 0.03; // 1.5: 3 %

// Mean over the part of each sector in which two phases alone conduct: the outgoing current has ceased.
TEST(Torque, SquareCurrentOnATrapezoid)
{
    plant_config_t config = bldc_fan();
    double omega_e = 60.0;
    SixStep drive(config, Pattern::h_pwm_l_on, duty_for(config, Pattern::h_pwm_l_on, omega_e, 4.0), omega_e);
    drive.run_sectors(12);
    double torque_Nm = 0.0, current_A = 0.0;
    int count = 0;
    for (int sectors = 0; sectors < 6;) {
        sectors += drive.run() ? 1 : 0;
        plant_truth_t t = drive.plant.truth();
        if (std::fabs(t.i_A[drive.sector.open]) < 1e-9) {
            torque_Nm += t.torque_Nm;
            current_A += t.i_A[drive.sector.high];
            count++;
        }
    }
    ASSERT_GT(count, 100);
    double omega_m = drive.omega_e / config.machine.pole_pairs;
    double expected_Nm = 2.0 * peak_V(config, drive.omega_e) * (current_A / count) / omega_m;
    EXPECT_GT(current_A / count, 1.0);
    measured("torque_square", std::fabs(torque_Nm / count / expected_Nm - 1.0), bound_torque, "relative",
             "1.5");
}

TEST(Torque, SineCurrentOnASine)
{
    plant_config_t config = spm_linear();
    rig::Plant plant(config);
    rig::CurrentControl control(config);
    double omega_m = 20.0;
    plant_set_speed(plant, omega_m);
    double torque_Nm = 0.0, current_A = 0.0;
    for (int k = 0; k < 4000; k++) {
        plant.run(control.step(plant.truth(), 0.0, 4.0));
        plant_truth_t t = plant.truth();
        torque_Nm += k >= 2000 ? t.torque_Nm / 2000 : 0.0;
        current_A += k >= 2000 ? std::hypot(t.i_d_A, t.i_q_A) / 2000 : 0.0;
    }
    double E = omega_m * config.machine.pole_pairs * config.machine.psi_m_Wb;
    measured("torque_sine", std::fabs(torque_Nm / (1.5 * E * current_A / omega_m) - 1.0), bound_torque,
             "relative", "1.5");
}

} // namespace
} // namespace validation
