// mechanics.h through the plant: stiction, friction, load, imposed and locked speed.
#include "rig.h"

#include <gtest/gtest.h>

#include <cmath>

namespace
{

// Closed forms against an integrator of 1e-6 local error whose steps are short for the electrical side.
constexpr double closed_form = 1e-6;

// A machine without magnet takes no part: only the load moves the rotor.
plant_config_t idle_machine()
{
    plant_config_t c = rig::ipm_1000();
    c.machine.psi_m_Wb = 0.0;
    c.mech = {0.01, 0.0, 0.0, false};
    return c;
}

TEST(Mechanics, RunsDownAgainstViscousFriction)
{
    plant_config_t config = idle_machine();
    config.mech.B_Nms = 0.05; // time constant 0.2 s
    rig::Plant plant(config);
    plant_set_speed(plant, 100.0);
    plant.run(rig::all_off());
    plant_free_speed(plant);
    plant.run(rig::all_off(), 3000);
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(t.omega_mech_rad_s, 100.0 * std::exp(-0.3 / 0.2), closed_form * 100.0);
    double turned = 100.0 * 1e-4 + 100.0 * 0.2 * (1.0 - std::exp(-0.3 / 0.2));
    EXPECT_NEAR(t.theta_e_rad, 3 * turned, closed_form * 3 * turned);
}

TEST(Mechanics, LoadOpposesPositiveRotation)
{
    rig::Plant plant(idle_machine());
    plant_set_load(plant, 2.0);
    plant.run(rig::all_off(), 1000);
    EXPECT_NEAR(plant.truth().omega_mech_rad_s, -2.0 / 0.01 * 0.1, closed_form * 20.0);
}

TEST(Mechanics, DryFrictionHoldsTheRotorExactly)
{
    plant_config_t config = idle_machine();
    config.mech.T_coulomb_Nm = 0.5;
    rig::Plant plant(config, 0.7);
    for (double load : {0.49, -0.499, 0.5}) {
        plant_set_load(plant, load);
        plant.run(rig::all_off(), 1000);
        EXPECT_EQ(plant.truth().omega_mech_rad_s, 0.0);
        EXPECT_EQ(plant.truth().theta_e_rad, 0.7);
    }
    plant_set_load(plant, 0.6); // breaks away: 0.1 N m are left to accelerate
    plant.run(rig::all_off(), 1000);
    EXPECT_NEAR(plant.truth().omega_mech_rad_s, -0.1 / 0.01 * 0.1, closed_form);
}

TEST(Mechanics, DryFrictionStopsTheRotorInFiniteTimeAndForGood)
{
    plant_config_t config = idle_machine();
    config.mech.T_coulomb_Nm = 0.5;
    rig::Plant plant(config);
    plant_set_speed(plant, 10.0);
    plant.run(rig::all_off());
    plant_free_speed(plant);
    plant.run(rig::all_off(), 1999); // stops after J omega / T = 0.2 s
    EXPECT_GT(plant.truth().omega_mech_rad_s, 0.0);
    plant.run(rig::all_off(), 2);
    EXPECT_EQ(plant.truth().omega_mech_rad_s, 0.0);
    double theta = plant.truth().theta_e_rad;
    EXPECT_NEAR(theta, 3 * (10.0 * 1e-4 + 0.5 * 10.0 * 0.2), 1e-5);
    plant.run(rig::all_off(), 1000);
    EXPECT_EQ(plant.truth().theta_e_rad, theta);
}

TEST(Mechanics, DryFrictionTurnsWithTheSpeed)
{
    plant_config_t config = idle_machine();
    config.mech.T_coulomb_Nm = 0.5;
    rig::Plant plant(config);
    plant_set_speed(plant, 10.0);
    plant.run(rig::all_off());
    plant_free_speed(plant);
    plant_set_load(plant, 1.5); // 200 rad/s^2 against, 10 rad/s: 0.05 s; then 100 rad/s^2 backwards
    plant.run(rig::all_off(), 1500);
    EXPECT_NEAR(plant.truth().omega_mech_rad_s, -100.0 * 0.1, 1e-5);
}

// The torque pulses of a PWM-fed motor at the edge of breaking away: no chatter, no creep backwards.
TEST(Mechanics, StickingUnderPulsatingTorque)
{
    plant_config_t config = rig::ipm_1000_real();
    config.mech.T_coulomb_Nm = 1.0;
    rig::Plant plant(config, -rig::pi / 2); // current along phase A is q current
    rig::CurrentControl control(config);
    double theta = plant.truth().theta_e_rad;
    for (int k = 0; k < 1000; k++) {
        plant.run(control.step(plant.truth(), 0.0, 0.9));
    }
    EXPECT_EQ(plant.truth().theta_e_rad, theta) << "0.9 A make less than the friction torque";
    for (int k = 0; k < 3000; k++) {
        plant.run(control.step(plant.truth(), 0.0, 2.0));
    }
    EXPECT_GT(plant.truth().omega_mech_rad_s, 10.0);
}

TEST(Mechanics, LockedRotorRestsAndImposedSpeedHolds)
{
    plant_config_t config = rig::ipm_1000_real();
    config.mech.locked = true;
    rig::Plant plant(config, 1.0);
    plant_set_load(plant, 5.0);
    plant.run(rig::pwm(0.5, 0.6, 0.5), 100);
    EXPECT_EQ(plant.truth().theta_e_rad, 1.0);
    EXPECT_GT(std::fabs(plant.truth().torque_Nm), 0.1);
    plant_set_locked(plant, false);
    plant_set_speed(plant, -20.0);
    plant.run(rig::pwm(0.5, 0.6, 0.5), 100);
    EXPECT_EQ(plant.truth().omega_mech_rad_s, -20.0);
    EXPECT_NEAR(plant.truth().theta_e_rad, 1.0 - 20.0 * 3 * 0.01, 1e-12);
}

} // namespace
