// comparator.h and what plant.h has for a timer's hardware: breaks and changes of legs within a
// period, against the closed form of a current through R and L.
#include "rig.h"

#include <gtest/gtest.h>

namespace
{

constexpr double found_s = 0.06e-6; // halving to 0.05 us, and the integrator
constexpr double short_L_H = 1e-6;  // of plant_set_short()
constexpr double short_R_ohm = 0.1;

plant_config_t locked()
{
    plant_config_t c = rig::spm_400_linear();
    c.mech.locked = true;
    return c;
}

plant_break_t above(int leg, double i_A, double delay_s = 0.0)
{
    plant_break_t b{};
    b.above_A[leg] = i_A;
    b.delay_s = delay_s;
    return b;
}

// Phase A at the link, the others at its foot, from a period's start: when its current passes a level.
double slow_crossing_s(double i_A)
{
    return -3.24e-3 / 0.373 * std::log(1.0 - i_A * 0.373 / 24.0);
}

// Between two shorted legs, the winding's own current left out (0.03 %).
double steep_crossing_s(double i_A)
{
    return -short_L_H / short_R_ohm * std::log(1.0 - i_A * short_R_ohm / 36.0);
}

TEST(Comparator, FindsTheInstantOfASlowCurrent)
{
    rig::Plant plant(locked());
    plant_break_t b = above(0, 0.4);
    plant_set_break(plant, &b);
    plant.run(rig::pwm(1, 0, 0));
    plant_run_period(plant);
    double after_s = 0.0;
    ASSERT_TRUE(plant_broke(plant, &after_s));
    EXPECT_NEAR(after_s, slow_crossing_s(0.4), found_s);
    EXPECT_FALSE(plant_broke(plant, &after_s));
    EXPECT_LT(plant.truth().i_A[0], 0.4); // freewheels since, against the link
    plant_run_period(plant);
    EXPECT_EQ(plant.truth().i_A[0], 0.0); // and the bridge stays off
}

TEST(Comparator, FindsTheInstantOfASteepCurrentAndActsWithItsDelay)
{
    for (double delay_s : {0.0, 0.3e-6, 5e-6}) {
        rig::Plant plant(locked());
        plant_set_short(plant, 0, 1, short_R_ohm);
        plant_break_t b = above(0, 60.0, delay_s);
        plant_set_break(plant, &b);
        plant.run(rig::pwm(1, 0, 0));
        plant_run_period(plant);
        double after_s = 0.0;
        ASSERT_TRUE(plant_broke(plant, &after_s));
        EXPECT_NEAR(after_s, steep_crossing_s(60.0) + delay_s, found_s);
    }
}

TEST(Comparator, LevelsAreOfOneLegAndOneDirection)
{
    struct {
        plant_break_t levels;
        bool acts;
    } cases[] = {{above(0, 0.4), true}, {above(1, 0.1), false}, {{}, false}, {{}, true}};
    cases[2].levels.below_A[0] = 0.1;
    cases[3].levels.below_A[1] = 0.1;
    for (const auto &c : cases) {
        rig::Plant plant(locked());
        plant_set_break(plant, &c.levels);
        plant.run(rig::pwm(1, 0, 0));
        plant_run_period(plant);
        double after_s = 0.0;
        EXPECT_EQ(plant_broke(plant, &after_s), c.acts);
    }
}

TEST(Comparator, ALowSideShuntSeesNothingWhileTheUpperPathConducts)
{
    plant_config_t config = locked();
    config.sensor.shunt = PLANT_LOW_SIDE;
    rig::Plant plant(config);
    plant_break_t b = above(0, 0.2);
    plant_set_break(plant, &b);
    plant.run(rig::pwm(0.8, 0, 0)); // high from 10 to 90 us: passes the level at 37 us
    plant_run_period(plant);
    double after_s = 0.0;
    ASSERT_TRUE(plant_broke(plant, &after_s));
    EXPECT_NEAR(after_s, 90e-6, found_s);
    EXPECT_TRUE(plant_break_held(plant));
}

TEST(Comparator, WhatItSeesLateInAPeriodActsInTheNext)
{
    rig::Plant plant(locked());
    double level_A = 24.0 / 0.373 * (1.0 - std::exp(-98e-6 * 0.373 / 3.24e-3));
    plant_break_t b = above(0, level_A, 4e-6);
    plant_set_break(plant, &b);
    plant.run(rig::pwm(1, 0, 0));
    plant_run_period(plant);
    double after_s = 0.0;
    EXPECT_FALSE(plant_broke(plant, &after_s));
    plant_run_period(plant);
    ASSERT_TRUE(plant_broke(plant, &after_s));
    EXPECT_NEAR(after_s, 2e-6, found_s);
}

TEST(Comparator, DoesNotDisturbWhatStaysBelow)
{
    rig::Plant with(locked());
    rig::Plant without(locked());
    plant_break_t b = above(0, 100.0);
    plant_set_break(with, &b);
    for (rig::Plant *plant : {&with, &without}) {
        plant->run(rig::pwm(0.7, 0.3, 0.4), 20);
    }
    EXPECT_EQ(with.truth().i_A[0], without.truth().i_A[0]);
    EXPECT_GT(with.truth().i_A[0], 1.0);
}

TEST(PlantWithin, TripActsAtItsInstant)
{
    rig::Plant plant(locked());
    plant.run(rig::pwm(1, 0, 0));
    double top_A = 24.0 / 0.373 * (1.0 - std::exp(-40e-6 * 0.373 / 3.24e-3));
    EXPECT_NEAR(plant.at(40e-6).i_A[0], top_A, 1e-6);
    plant_trip(plant);
    EXPECT_LT(plant.at(45e-6).i_A[0], 0.95 * top_A);
    plant_run_period(plant);
    plant_run_period(plant);
    EXPECT_EQ(plant.truth().i_A[0], 0.0);
}

TEST(PlantWithin, LegsChangeAtTheGivenInstant)
{
    plant_pwm_t later = rig::pwm(1, 0, 0);
    later.driven_after_s = 25e-6;
    rig::Plant queued(locked());
    queued.run(later);
    EXPECT_EQ(queued.at(25e-6).i_A[0], 0.0);
    double end_A = 24.0 / 0.373 * (1.0 - std::exp(-75e-6 * 0.373 / 3.24e-3));
    plant_run_period(queued);
    EXPECT_NEAR(queued.truth().i_A[0], end_A, 1e-6);

    plant_pwm_t off = rig::pwm(1, 0, 0);
    const bool legs[] = {true, true, true, false, false, false};
    off.driven[0] = off.driven[1] = off.driven[2] = false;
    rig::Plant moved(locked());
    moved.run(off);
    plant_move(moved, 25e-6);
    plant_drive(moved, legs);
    plant_run_period(moved);
    EXPECT_NEAR(moved.truth().i_A[0], end_A, 1e-6);
}

TEST(PlantWithin, SamplesAtAnyInstant)
{
    rig::Plant plant(locked());
    plant.run(rig::pwm(1, 0, 0));
    plant_adc_t early, late;
    plant_sample_at(plant, 20e-6, &early);
    plant_sample_at(plant, 60e-6, &late);
    plant_run_period(plant);
    auto code = [](double t_s) {
        return 32768.0 + 32768.0 / 10.0 * 24.0 / 0.373 * (1.0 - std::exp(-t_s * 0.373 / 3.24e-3));
    };
    EXPECT_NEAR(early.i_leg[0], code(20e-6), 0.6);
    EXPECT_NEAR(late.i_leg[0], code(60e-6), 0.6);
}

} // namespace
