// dclink.h through the plant: charging against the closed form, blocking source, balance with the legs.
#include "rig.h"

#include <gtest/gtest.h>

#include <cmath>

namespace
{

// Closed form against an integrator of 1e-6 local error over five time constants.
constexpr double closed_form = 2e-6;
// Two integrals of one trajectory, both of third order.
constexpr double balance = 1e-5;

plant_config_t with_link()
{
    plant_config_t c = rig::ipm_1000();
    c.dclink = {300.0, 2.0, 500e-6, false}; // 1 ms
    return c;
}

TEST(DcLink, FollowsAStepOfTheSource)
{
    rig::Plant plant(with_link());
    EXPECT_EQ(plant.truth().v_dc_V, 300.0);
    plant_set_source(plant, 200.0);
    for (int k = 1; k <= 50; k++) {
        plant.run(rig::all_off());
        EXPECT_NEAR(plant.truth().v_dc_V, 200.0 + 100.0 * std::exp(-0.1 * k), closed_form * 300.0);
    }
}

TEST(DcLink, IsStiffWithoutCapacitor)
{
    rig::Plant plant(rig::ipm_1000());
    plant_set_source(plant, 200.0);
    EXPECT_EQ(plant.truth().v_dc_V, 200.0);
    plant.run(rig::pwm(0.6, 0.5, 0.4), 10);
    EXPECT_EQ(plant.truth().v_dc_V, 200.0);
}

TEST(DcLink, BlockingSourceTakesNothingBack)
{
    plant_config_t config = with_link();
    config.dclink.source_blocks = true;
    rig::Plant plant(config);
    plant_set_source(plant, 200.0);
    plant.run(rig::all_off(), 100);
    EXPECT_EQ(plant.truth().v_dc_V, 300.0);
    plant_set_source(plant, 310.0);
    plant.run(rig::all_off(), 100);
    EXPECT_NEAR(plant.truth().v_dc_V, 310.0 - 10.0 * std::exp(-10.0), closed_form * 300.0);
}

// A braking motor lifts a link that nothing discharges by exactly what the legs give back.
TEST(DcLink, RisesByTheEnergyOfABrakingMotor)
{
    plant_config_t config = rig::ipm_1000_real();
    config.dclink = {300.0, 0.5, 2e-3, true};
    rig::Plant plant(config);
    plant_set_speed(plant, 100.0);
    rig::CurrentControl control(config);
    for (int k = 0; k < 200; k++) {
        plant.run(control.step(plant.truth(), 0.0, -1.5));
    }
    plant_truth_t a = plant.truth();
    ASSERT_GT(a.v_dc_V, 300.0);
    for (int k = 0; k < 1000; k++) {
        plant.run(control.step(plant.truth(), 0.0, -1.5));
    }
    plant_truth_t b = plant.truth();
    double stored_J = 0.5 * 2e-3 * (b.v_dc_V * b.v_dc_V - a.v_dc_V * a.v_dc_V);
    EXPECT_GT(stored_J, 1.0);
    EXPECT_NEAR(stored_J, a.e_in_J - b.e_in_J, balance * stored_J);
}

TEST(DcLink, SagsUnderLoadByItsResistance)
{
    plant_config_t config = rig::ipm_1000_real();
    rig::Plant plant(config);
    plant_set_speed(plant, 100.0);
    rig::CurrentControl control(config);
    for (int k = 0; k < 500; k++) {
        plant.run(control.step(plant.truth(), 0.0, 4.0));
    }
    plant_truth_t a = plant.truth();
    double charge = 0.0; // of the source, from its own voltage drop, trapezoidal over the periods
    double before_V = a.v_dc_V;
    for (int k = 0; k < 1000; k++) {
        plant.run(control.step(plant.truth(), 0.0, 4.0));
        double now_V = plant.truth().v_dc_V;
        charge += 1e-4 * (300.0 - 0.5 * (before_V + now_V)) / config.dclink.r_source_ohm;
        before_V = now_V;
    }
    plant_truth_t b = plant.truth();
    // power of the legs at nearly constant voltage is what the source delivers; ripple is the rest
    EXPECT_NEAR(charge * 0.5 * (a.v_dc_V + b.v_dc_V), b.e_in_J - a.e_in_J, 0.01 * (b.e_in_J - a.e_in_J));
}

TEST(DcLink, EmptiesToZeroAndNotBelow)
{
    plant_config_t config = rig::ipm_1000_real();
    config.dclink = {30.0, 1.0, 20e-6, true};
    rig::Plant plant(config);
    plant.run(rig::pwm(1, 0, 0), 50);
    plant_set_source(plant, 0.0);
    for (int k = 0; k < 200; k++) {
        plant.run(rig::pwm(1, 0, 0));
        ASSERT_GE(plant.truth().v_dc_V, -1e-3);
    }
    EXPECT_NEAR(plant.truth().v_dc_V, 0.0, 1e-3);
}

} // namespace
