// What the port `sim` delivers beside the common measurements, against the plant's truth and closed formulas.
#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "tests/support/application.h"
#include "tests/support/plants.h"

extern "C" {
#include "hal/sim/port.h"
}

namespace
{

constexpr uint16_t kCounts = 8500;
constexpr double kPeriod_s = 100e-6;
constexpr double kFullScale_V = 450;

plant_config_t machine()
{
    plant_config_t c = plants::ipm_1000();
    c.sensor.bits = 0; // 16 bits, without noise
    c.sensor.v_leg_full_scale_V = kFullScale_V;
    c.sensor.capture_s = kPeriod_s / 2 / kCounts;
    return c;
}

struct Port {
    explicit Port(const plant_config_t &config) : plant(plant_create(&config, 0.3, &error), &plant_destroy)
    {
        sim_hal_init(&hal, plant.get());
        const hal_config_t good = {kCounts, 500, 0, 500};
        EXPECT_EQ(hal_init(&hal, &good), HAL_OK);
    }
    void step()
    {
        plant_sample(plant.get(), &hal.adc);
        hal_measure(&hal, &in);
        hal_bridge_write(&hal, &out);
        sim_run_period(&hal);
    }
    const char *error = nullptr;
    std::unique_ptr<plant_t, void (*)(plant_t *)> plant;
    hal_t hal = {};
    drive_in_t in = {};
    drive_out_t out = {};
};

void unequal_duties(drive_out_t &out)
{
    for (int leg = 0; leg < 3; ++leg) {
        out.compare[leg][0] = out.compare[leg][1] = static_cast<uint16_t>(4000 + 400 * leg);
    }
    out.legs = PM_LEGS_PWM;
}

double current_code(double i_A)
{
    return 32768 * (1 + i_A / 10.0);
}

// Asked for at k, taken in [k+1, k+2), delivered at k+2; a twin that is stopped at those instants has the truth.
TEST(SimChannels, FurtherSamplesAreOfTheirInstants)
{
    Port port(machine());
    Port twin(machine());
    const uint16_t at[2] = {3000, 14000};
    for (Port *p : {&port, &twin}) {
        ASSERT_TRUE(hal_bridge_arm(&p->hal));
        unequal_duties(p->out);
        for (int k = 0; k < 20; ++k) {
            p->step();
        }
    }
    port.out.instants.sample_at[0] = at[0];
    port.out.instants.sample_at[1] = at[1];
    port.step(); // k
    port.out.instants.sample_at[0] = port.out.instants.sample_at[1] = 0;
    EXPECT_EQ(port.in.more.sampled, 0);
    port.step(); // k+1
    EXPECT_EQ(port.in.more.sampled, 0);
    port.step(); // k+2
    EXPECT_EQ(port.in.more.sampled, 3);
    twin.step();
    for (int n = 0; n < 2; ++n) {
        plant_truth_t truth;
        plant_move(twin.plant.get(), at[n] * kPeriod_s / (2 * kCounts));
        plant_truth(twin.plant.get(), &truth);
        for (int leg = 0; leg < 3; ++leg) {
            EXPECT_NEAR(port.in.more.i_sample[n][leg], current_code(truth.i_A[leg]), 1.0) << n << leg;
            EXPECT_GT(std::fabs(truth.i_A[leg] * 3276.8 + (leg == 1 ? 1e3 : 0)), 50.0) << "nothing to see";
        }
    }
    port.step();
    EXPECT_EQ(port.in.more.sampled, 0);
}

// Without current v_n - (v_a + v_b + v_c)/3 = -d/dt psi_3 cos(3 theta + phase) = 3 omega psi_3 sin(3 theta + phase).
TEST(SimChannels, NeutralIsTheThirdHarmonicWithItsSign)
{
    plant_config_t config = machine();
    const double psi_3_Wb = 0.02, omega_e = 300.0;
    config.winding.emf[0] = {3, psi_3_Wb, 0.0};
    Port port(config);
    plant_set_speed(port.plant.get(), omega_e / config.machine.pole_pairs);
    port.step(); // from standstill
    double peak = 0.0;
    for (int k = 0; k < 100; ++k) {
        plant_truth_t truth;
        plant_truth(port.plant.get(), &truth);
        port.step();
        const double v_V = 3 * omega_e * psi_3_Wb * std::sin(3 * truth.theta_e_rad);
        EXPECT_NEAR(port.in.more.v_neutral - 32768.0, v_V / (2 * kFullScale_V) * 65536, 3.0) << k;
        peak = std::max(peak, std::fabs(v_V));
    }
    EXPECT_GT(peak, 17.0);
}

// Those of the second bridge, each set having its own; 30 degrees on, three times that of the third harmonic.
TEST(SimChannels, CurrentsAndNeutralOfASecondSet)
{
    plant_config_t config = machine();
    const double psi_3_Wb = 0.02, omega_e = 300.0;
    config.winding.sets = 2;
    config.winding.emf[0] = {3, psi_3_Wb, 0.0};
    Port still(config);
    EXPECT_NE(hal_channels(&still.hal) & NEEDS_SECOND_SET, 0U);
    ASSERT_TRUE(hal_bridge_arm(&still.hal));
    unequal_duties(still.out);
    const uint16_t second[3] = {5400, 4300, 3100};
    std::copy(second, second + 3, still.out.second);
    still.out.second_legs = PM_LEGS_PWM;
    for (int k = 0; k < 200; ++k) {
        still.step();
    }
    plant_truth_t truth;
    plant_truth(still.plant.get(), &truth);
    still.step();
    for (int leg = 0; leg < 3; ++leg) {
        EXPECT_NEAR(still.in.more.i_second[leg], current_code(truth.i_A[3 + leg]), 1.0) << leg;
    }
    EXPECT_GT(std::fabs(truth.i_A[3] - truth.i_A[0]), 0.1) << "nothing to see";
    still.out.second_legs = PM_LEGS_OFF;
    for (int k = 0; k < 500; ++k) {
        still.step();
    }
    EXPECT_NEAR(still.in.more.i_second[0], 32768, 1);
    EXPECT_GT(std::abs(still.in.i_leg[0] - 32768), 100); // the first goes on

    Port port(config);
    plant_set_speed(port.plant.get(), omega_e / config.machine.pole_pairs);
    port.step(); // from standstill
    for (int k = 0; k < 100; ++k) {
        plant_truth(port.plant.get(), &truth);
        port.step();
        const double v_V = -3 * omega_e * psi_3_Wb * std::cos(3 * truth.theta_e_rad);
        EXPECT_NEAR(port.in.more.v_neutral_second - 32768.0, v_V / (2 * kFullScale_V) * 65536, 3.0) << k;
    }
}

// Legs held against each other: their terminals are at the rails.
TEST(SimChannels, TerminalsOfHeldLegs)
{
    Port port(machine());
    ASSERT_TRUE(hal_bridge_arm(&port.hal));
    port.out.legs = pm_legs_of(PM_LEG_HIGH, PM_LEG_LOW, PM_LEG_OFF);
    for (int k = 0; k < 5; ++k) {
        port.step();
    }
    EXPECT_NEAR(port.in.more.v_terminal[0] / 65536.0 * kFullScale_V, 300.0,
                3.0); // less the drop, and the source's
    EXPECT_NEAR(port.in.more.v_terminal[1] / 65536.0 * kFullScale_V, 1.0, 0.5);
    EXPECT_NEAR(port.in.more.v_neutral, 32768 + (150.0 - (300.0 + 150.0) / 3) / (2 * kFullScale_V) * 65536,
                400);
}

// Between a leg held low and one held high a terminal passes the mean of all three where its PWM switches.
TEST(SimChannels, CapturesOfEdges)
{
    plant_config_t config = machine();
    config.inverter.dead_time_s = 0.0;
    config.inverter.v_switch_V = config.inverter.v_diode_V = 0.0;
    Port port(config);
    ASSERT_TRUE(hal_bridge_arm(&port.hal));
    port.out.legs = pm_legs_of(PM_LEG_PWM, PM_LEG_LOW, PM_LEG_HIGH);
    port.out.compare[0][0] = port.out.compare[0][1] = 1700; // on from 0.8 to 1.2 of half a period
    for (int k = 0; k < 3; ++k) {
        port.step();
    }
    const pm_measure_t &more = port.in.more;
    int seen[2] = {0, 0};
    for (int n = 0; n < more.captures; ++n) {
        if (more.capture[n].leg == 0) {
            const bool rising = more.capture[n].rising;
            EXPECT_NEAR(more.capture[n].at, rising ? 0.8 * kCounts : 1.2 * kCounts, 2.0);
            seen[rising ? 1 : 0]++;
        }
    }
    EXPECT_EQ(seen[0], 1);
    EXPECT_EQ(seen[1], 1);
}

// The differential amplifier alone: its own range, and no terminals.
TEST(SimChannels, NeutralOfTheDifferentialAmplifier)
{
    plant_config_t config = machine();
    const double psi_3_Wb = 0.02, omega_e = 300.0, full_scale_V = 12.0; // the peak is 18 V
    config.winding.emf[0] = {3, psi_3_Wb, 0.0};
    config.sensor.v_leg_full_scale_V = 0.0;
    config.sensor.v_zero_full_scale_V = full_scale_V;
    Port port(config);
    EXPECT_EQ(hal_channels(&port.hal) & (NEEDS_NEUTRAL | NEEDS_TERMINALS), NEEDS_NEUTRAL);
    plant_set_speed(port.plant.get(), omega_e / config.machine.pole_pairs);
    port.step(); // from standstill
    bool low = false, high = false;
    for (int k = 0; k < 100; ++k) {
        plant_truth_t truth;
        plant_truth(port.plant.get(), &truth);
        port.step();
        const double v_V = 3 * omega_e * psi_3_Wb * std::sin(3 * truth.theta_e_rad);
        const double code = 32768 + v_V / full_scale_V * 32768;
        EXPECT_NEAR(port.in.more.v_neutral, std::min(std::max(code, 0.0), 65535.0), 3.0) << k;
        low = low || code < 0;
        high = high || code > 65536;
    }
    EXPECT_TRUE(low && high);
}

// What a held pair takes comes from the link; with all legs low, as in the middle of a zero vector, nothing
// does.
TEST(SimChannels, LinkCurrentOfAHeldPair)
{
    plant_config_t config = machine();
    config.mech.locked = true;
    config.sensor.i_dc_full_scale_A = 20.0; // twice the legs'
    Port port(config);
    EXPECT_NE(hal_channels(&port.hal) & NEEDS_DC_CURRENT, 0U);
    ASSERT_TRUE(hal_bridge_arm(&port.hal));
    port.out.legs = pm_legs_of(PM_LEG_HIGH, PM_LEG_LOW, PM_LEG_OFF);
    for (int k = 0; k < 12; ++k) {
        port.step();
    }
    const int i_a = port.in.i_leg[0] - 32768;
    EXPECT_GT(i_a, 3000);
    EXPECT_NEAR(port.in.more.i_dc - 32768, i_a / 2, 2);
    port.out.legs = pm_legs_of(PM_LEG_LOW, PM_LEG_LOW, PM_LEG_OFF);
    for (int k = 0; k < 3; ++k) {
        port.step();
    }
    EXPECT_GT(port.in.i_leg[0] - 32768, 3000);
    EXPECT_EQ(port.in.more.i_dc, 32768);
}

// Asked for at k, done in [k+1, k+2): a twin whose legs are changed at that instant goes the same way, and one whose legs
// change a count later does not.
TEST(SimChannels, CommutatesAtItsInstant)
{
    const uint16_t at = 5000, then = pm_legs_of(PM_LEG_HIGH, PM_LEG_OFF, PM_LEG_LOW);
    Port port(machine()), twin(machine()), late(machine());
    for (Port *p : {&port, &twin, &late}) {
        EXPECT_NE(hal_channels(&p->hal) & NEEDS_COMMUTATE, 0U);
        ASSERT_TRUE(hal_bridge_arm(&p->hal));
        p->out.legs = pm_legs_of(PM_LEG_HIGH, PM_LEG_LOW, PM_LEG_OFF);
        for (int k = 0; k < 5; ++k) {
            p->step();
        }
    }
    port.out.instants.commutate_at = at;
    port.out.instants.then = then;
    port.step(); // k
    port.out.instants.commutate_at = 0;
    for (Port *p : {&twin, &late}) {
        p->step();
        plant_move(p->plant.get(), (at + (p == &late ? 1 : 0)) * kPeriod_s / (2 * kCounts));
        sim_commutate(&p->hal, then);
    }
    const auto currents = [](const Port &p) {
        plant_truth_t truth;
        plant_truth(p.plant.get(), &truth);
        return std::vector<double>{truth.i_A[0], truth.i_A[1], truth.i_A[2]};
    };
    for (Port *p : {&port, &twin, &late}) {
        p->step(); // [k+1, k+2)
    }
    EXPECT_EQ(currents(port), currents(twin));
    EXPECT_NE(currents(port), currents(late));
    EXPECT_LT(currents(port)[2], -1e-3); // c has taken over
    for (Port *p : {&port, &twin}) {
        p->step(); // as the period before said: b again
    }
    EXPECT_EQ(currents(port), currents(twin));
}

// Leg a chopped against b, c off, rotor locked, at a duty d: from the upper rail d v_dc/(2 R) flows, to it
// (1 - d) v_dc/(2 R); a leg whose switch leads to the rail of b's carries nothing, which both switches would
// change.
TEST(SimChannels, OneSwitchOfALeg)
{
    plant_config_t config = plants::spm_400();
    config.mech.locked = true;
    config.inverter.dead_time_s = config.inverter.r_on_ohm = 0.0;
    config.dclink.r_source_ohm = config.dclink.c_F = 0.0;
    config.sensor.bits = 0;
    config.winding.dR_ohm[0] = config.winding.dR_ohm[1] = 2.0;
    const double R_ohm = config.machine.R_s_ohm + 2.0, d = 0.4;
    const double to_a_A = d * 36.0 / (2 * R_ohm), from_a_A = (1 - d) * 36.0 / (2 * R_ohm);
    const struct {
        pm_leg_t a, b;
        double i_A;
    } cases[] = {{PM_LEG_UPPER, PM_LEG_LOW, to_a_A},
                 {PM_LEG_LOWER, PM_LEG_HIGH, -from_a_A},
                 {PM_LEG_UPPER, PM_LEG_HIGH, 0.0},
                 {PM_LEG_LOWER, PM_LEG_LOW, 0.0},
                 {PM_LEG_PWM, PM_LEG_HIGH, -from_a_A},
                 {PM_LEG_PWM, PM_LEG_LOW, to_a_A},
                 {PM_LEG_INVERTED, PM_LEG_HIGH, -to_a_A},
                 {PM_LEG_INVERTED, PM_LEG_LOW, from_a_A},
                 {PM_LEG_LOWER_INVERTED, PM_LEG_HIGH, -to_a_A},
                 {PM_LEG_LOWER_INVERTED, PM_LEG_LOW, 0.0}};
    for (const auto &c : cases) {
        Port port(config);
        ASSERT_TRUE(hal_bridge_arm(&port.hal));
        EXPECT_NE(hal_channels(&port.hal) & NEEDS_ONE_SWITCH, 0U);
        port.out.legs = pm_legs_of(c.a, c.b, PM_LEG_OFF);
        port.out.compare[0][0] = port.out.compare[0][1] = static_cast<uint16_t>(d * kCounts);
        for (int k = 0; k < 300; ++k) { // twenty time constants
            port.step();
        }
        // at the middle of a half of the pulse pattern the current is the mean, but for a hundredth of the
        // ripple
        EXPECT_NEAR(port.in.i_leg[0], current_code(c.i_A), 0.002 * 32768) << c.a << c.b;
    }
}

plant_config_t open_winding()
{
    plant_config_t config = plants::spm_400();
    config.winding.connection = PLANT_OPEN;
    config.winding.L_0_H = 2.25e-3;
    config.inverter.dead_time_s = 0;
    config.mech.locked = true;
    return config;
}

// A machine with six legs has one. A phase takes current where the duties of its legs differ, out of the one and into the other.
TEST(SimChannels, ASecondBridge)
{
    const Port star(plants::spm_400());
    EXPECT_EQ(hal_channels(&star.hal) & NEEDS_BRIDGES, 0U);
    for (int differs = 0; differs < 3; ++differs) {
        Port port(open_winding());
        EXPECT_NE(hal_channels(&port.hal) & NEEDS_BRIDGES, 0U);
        ASSERT_TRUE(hal_bridge_arm(&port.hal));
        unequal_duties(port.out);
        for (int leg = 0; leg < 3; ++leg) {
            port.out.second[leg] =
                static_cast<uint16_t>(port.out.compare[leg][0] - (leg == differs ? 400 : 0));
        }
        port.out.second_legs = PM_LEGS_PWM;
        for (int k = 0; k < 20; ++k) {
            port.step();
        }
        plant_truth_t truth;
        plant_truth(port.plant.get(), &truth);
        // 1.7 V for 1.8 ms: two thirds of it meet L, a third L_0 in all phases; 1.05 and 0.15 A, less what R takes
        const double volt_s = 400.0 / kCounts * 36 * 18 * kPeriod_s;
        for (int leg = 0; leg < 3; ++leg) {
            const double share = leg == differs ? 2.0 / 3 : -1.0 / 3;
            const double i_A = volt_s * (share / 3.385e-3 + 1.0 / 3 / 2.25e-3);
            EXPECT_NEAR(truth.i_A[leg], i_A, 0.15) << differs << ' ' << leg;
            EXPECT_NEAR(truth.i_A[leg + 3], -truth.i_A[leg], 1e-9) << differs << ' ' << leg;
        }
        port.out.legs = PM_LEGS_OFF;
        port.out.second_legs = PM_LEGS_OFF;
        for (int k = 0; k < 50; ++k) {
            port.step();
        }
        plant_truth(port.plant.get(), &truth);
        for (int leg = 0; leg < 6; ++leg) {
            EXPECT_NEAR(truth.i_A[leg], 0, 1e-3) << differs << ' ' << leg;
        }
    }
}

} // namespace
