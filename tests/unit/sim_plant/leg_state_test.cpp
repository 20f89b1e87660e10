// States of the legs (plant.h) through the plant: one switch chopped and the other off, against the closed
// form of a winding between two legs that freewheels through a diode.
#include "rig.h"

#include <gtest/gtest.h>

#include <cmath>

namespace
{

// A sum of exponentials against a step of the integrator with a tolerance of 1e-6 of full scale.
constexpr double current_A = 2e-5;
constexpr double R = 0.373, L = 3.24e-3, V = 36.0;
constexpr double T = 100e-6, tau_s = L / R; // two phases in series: 2 L / 2 R

plant_config_t locked(double v_diode_V)
{
    plant_config_t c = rig::spm_400_linear();
    c.mech.locked = true;
    c.inverter = rig::inverter(1.0 / T, 2e-6, 0.0, v_diode_V, 0.0);
    return c;
}

// Leg A chopped by one switch, B held at the rail it freewheels to, C off.
plant_pwm_t chopped(plant_leg_state_t state, double share)
{
    bool upper = state == PLANT_LEG_UPPER;
    plant_pwm_t pwm = rig::pwm(upper ? share : 1.0 - share, 0.5, 0.5);
    pwm.state[0] = state;
    pwm.state[1] = upper ? PLANT_LEG_LOW : PLANT_LEG_HIGH;
    pwm.driven[2] = false;
    return pwm;
}

struct Chopped {
    const char *name;
    plant_leg_state_t state;
};

class OneSwitch : public testing::TestWithParam<Chopped>
{
  protected:
    const plant_leg_state_t state = GetParam().state;
    const double sign = state == PLANT_LEG_UPPER ? 1.0 : -1.0;
    // The lower switch is on at the ends of the period, the upper one in its middle.
    const double middle_of_on = state == PLANT_LEG_UPPER ? 0.5 : 0.0;

    // Current of leg A at an instant of the period, counted from the middle of the on-time
    double current(rig::Plant &plant, const plant_pwm_t &pwm, double after_s)
    {
        plant.run(pwm);
        double at_s = middle_of_on * T + after_s;
        at_s -= at_s >= T ? T : 0.0;
        return sign * plant.at(at_s).i_A[0];
    }
};

// In every period: on for D T towards V / 2R, off for the rest towards -v_diode / 2R.
TEST_P(OneSwitch, FreewheelsThroughTheDiodeOfTheOther)
{
    constexpr double share = 0.25, v_diode_V = 0.8;
    rig::Plant plant(locked(v_diode_V));
    plant_pwm_t pwm = chopped(state, share);
    plant.run(pwm, 2000); // 23 time constants
    double on = std::exp(-share * T / tau_s), off = std::exp(-(1.0 - share) * T / tau_s);
    double up_A = V / (2.0 * R), down_A = -v_diode_V / (2.0 * R);
    double most_A = (up_A * (1.0 - on) + down_A * on * (1.0 - off)) / (1.0 - on * off);
    double least_A = down_A + (most_A - down_A) * off;
    ASSERT_GT(least_A, 1.0);
    EXPECT_NEAR(current(plant, pwm, 0.5 * share * T), most_A, current_A);
    EXPECT_NEAR(current(plant, pwm, -0.5 * share * T + T), least_A, current_A);
    double quarter_s = 0.25 * T;
    EXPECT_NEAR(current(plant, pwm, 0.5 * share * T + quarter_s),
                down_A + (most_A - down_A) * std::exp(-quarter_s / tau_s), current_A);
}

// Little current: it ends within the off-time and stays so, as no switch carries it back. The terminal then
// shows the neutral, which at standstill is the other leg's rail.
TEST_P(OneSwitch, CurrentEndsWithinThePeriod)
{
    constexpr double share = 0.1, v_diode_V = 20.0;
    rig::Plant plant(locked(v_diode_V));
    plant_pwm_t pwm = chopped(state, share);
    plant.run(pwm, 3);
    double most_A = V / (2.0 * R) * -std::expm1(-share * T / tau_s);
    double lasts_s = tau_s * std::log1p(most_A * 2.0 * R / v_diode_V);
    ASSERT_LT(lasts_s, 0.5 * T);
    double end_s = 0.5 * share * T + lasts_s;
    EXPECT_NEAR(current(plant, pwm, 0.5 * share * T), most_A, current_A);
    EXPECT_GT(current(plant, pwm, end_s - 0.1e-6), 0.0);
    EXPECT_EQ(current(plant, pwm, end_s + 0.1e-6), 0.0);
    EXPECT_EQ(current(plant, pwm, end_s + 20e-6), 0.0);
    EXPECT_NEAR(plant.truth().v_leg_V[0], state == PLANT_LEG_UPPER ? 0.0 : V, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Leg, OneSwitch,
                         testing::Values(Chopped{"Upper", PLANT_LEG_UPPER},
                                         Chopped{"Lower", PLANT_LEG_LOWER}),
                         [](const testing::TestParamInfo<Chopped> &which) { return which.param.name; });

// Both switches, at the same light load: the current reverses within the period instead.
TEST(LegState, ComplementarySwitchesCarryTheCurrentBack)
{
    rig::Plant plant(locked(20.0));
    plant_pwm_t pwm = chopped(PLANT_LEG_UPPER, 0.1);
    pwm.state[0] = PLANT_LEG_PWM;
    plant.run(pwm, 2000);
    double mean_A = 0.0;
    for (int n = 0; n < 100; n++) {
        mean_A += plant.at(n * 1e-6).i_A[0] / 100.0;
    }
    EXPECT_GT(mean_A, 0.5 * 0.1 * V / (2.0 * R)) << "of D V / 2R, less the dead time";
    EXPECT_GT(plant.truth().i_A[0], 1.0);
}

TEST(LegState, ChangesWithinThePeriod)
{
    rig::Plant plant(locked(0.0));
    plant_pwm_t pwm = chopped(PLANT_LEG_UPPER, 0.0);
    plant.run(pwm, 3);
    plant_move(plant, 30e-6);
    const bool driven[PLANT_LEGS] = {true, true, false};
    const plant_leg_state_t state[PLANT_LEGS] = {PLANT_LEG_HIGH, PLANT_LEG_LOW};
    plant_drive_legs(plant, driven, state);
    plant_run_period(plant); // until its end: from 32 us on at the upper rail, of leg A that was off
    EXPECT_NEAR(plant.truth().i_A[0], V / (2.0 * R) * -std::expm1(-68e-6 / tau_s), current_A);
}

} // namespace
