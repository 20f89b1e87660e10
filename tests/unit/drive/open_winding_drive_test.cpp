// The drive of an open winding: what it refuses, what trips it, and that either bridge is off, or tied to the rail, with the other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "firmware/drive/drive_parts.h"
#include "hal/sim/sim_loop.h"
#include "tests/unit/drive/driven_legs.h"
#include "tests/unit/drive/open_winding_machine.h"

namespace
{

using bench::real;
using direct::current_code;

struct Drive : direct::Drive {
    explicit Drive(const drive_params_t &p = ow::params()) : direct::Drive(p)
    {
        in.v_dc = static_cast<uint16_t>(ow::kLink * 65536);
    }

    // Of the legs of the first bridge; i along phase A.
    void feed(double i_A, double i_zero_A)
    {
        in.i_leg[0] = current_code((i_A + i_zero_A) / ow::kA);
        in.i_leg[1] = current_code((-i_A / 2 + i_zero_A) / ow::kA);
        in.i_leg[2] = in.i_leg[1];
    }
};

TEST(OpenWindingDrive, IdentificationIsRefused)
{
    Drive x;
    x.enable(true, DRIVE_MODE_IDENTIFY);
    for (int k = 0; k < 300; ++k) {
        x.run_ms(1);
        ASSERT_EQ(x.state(), DRIVE_OFF);
        ASSERT_FALSE(x.driven());
    }
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.enable(false);
    x.run_ms(5);
    x.start_current_mode(0); // the same drive, in a mode that it has
    EXPECT_EQ(x.state(), DRIVE_RUNNING);
}

TEST(OpenWindingDrive, WithoutControlTheSecondBridgeTiesItsEnds)
{
    Drive x;
    for (int leg = 0; leg < 3; ++leg) {
        x.out.second[leg] = 77;
    }
    x.step();
    for (const uint16_t compare : x.out.second) {
        EXPECT_EQ(compare, 0);
    }
    EXPECT_FALSE(x.driven());
}

// A start after a fault does not begin with the voltage of before.
TEST(OpenWindingDrive, WithoutControlWhatWasGatheredIsForgotten)
{
    Drive x;
    x.start_current_mode(0);
    x.feed(0, 1.0);
    x.run_ms(2);
    ASSERT_NE(x.d.open_winding.y, 0);
    drive_trip(&x.d, DRIVE_FAULT_OVERLOAD);
    x.step();
    EXPECT_EQ(x.d.open_winding.y | x.d.open_winding.q | x.d.open_winding.v_next | x.d.open_winding.i, 0);
}

// Half of i_max is 2.5 A. It flows: where it is held at zero, the voltage for that is not explained.
TEST(OpenWindingDrive, AZeroSequenceCurrentOfHalfTheLargestIsASensorFault)
{
    drive_params_t p = ow::params();
    p.zero_current = 0;
    Drive x(p);
    x.start_current_mode(0);
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    for (const double sign : {1.0, -1.0}) {
        x.feed(0, sign * 2.45);
        x.run_ms(20);
        ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
        x.feed(0, sign * 2.55);
        x.run_ms(2);
        ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
        x.feed(0, 0);
        x.run_ms(2);
    }
    x.feed(0, -2.55);
    x.run_ms(3);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_SENSOR_SUM);
    x.step();
    EXPECT_FALSE(x.driven());
}

// Nothing flows, as of a motor that is not there, and nothing holds the voltage that is to drive it.
TEST(OpenWindingDrive, ACurrentThatIsNotSeenIsAnOpenPhase)
{
    Drive x;
    x.start_current_mode(4000);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OPEN_PHASE);
    EXPECT_FALSE(x.driven());
}

TEST(OpenWindingDrive, AZeroSequenceCurrentThatIsNotHeldIsAnOpenPhase)
{
    Drive x;
    x.start_current_mode(0);
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    x.run_ms(20);
    ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.feed(0, 0.7);
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.run_ms(8);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OPEN_PHASE);
    EXPECT_FALSE(x.driven());
}

// i_trip is 9 A.
TEST(OpenWindingDrive, OverCurrentOfALegCountsTheZeroSequence)
{
    for (const double i_zero_A : {-2.2, 0.0, 1.9, 2.2}) {
        Drive x;
        x.start_current_mode(0);
        ASSERT_EQ(x.state(), DRIVE_RUNNING);
        x.feed(7.0, i_zero_A);
        x.step();
        const bool trips = 7.0 + i_zero_A > 9.0;
        EXPECT_EQ(x.d.fault, trips ? DRIVE_FAULT_OVER_CURRENT : DRIVE_FAULT_NONE) << i_zero_A; // at once
        EXPECT_EQ(x.driven(), !trips) << i_zero_A;
    }
}

// Magnets so weak that a short is allowed, and a link so low that their EMF can exceed it; running at this EMF of a phase, as a share
// of the link.
struct Fast : Drive {
    static drive_params_t weak()
    {
        drive_params_t p = ow::params();
        p.psi_m = 13000000;
        p.fault_short = 1;
        p.v_dc_min = 4000;
        p.v_dc_nominal = 5000;
        return p;
    }

    explicit Fast(double emf) : Drive(weak())
    {
        (void)ow::configured(weak()); // or says what is refused
        in.v_dc = static_cast<uint16_t>(4.1 / ow::kV * 65536);
        start_current_mode();
        d.pll.omega = static_cast<pm_q_t>(emf * d.status.v_dc / real(d.config.machine.psi_m));
        EXPECT_LT(d.pll.omega, PM_ONE);
    }
};

TEST(OpenWindingDrive, AProtectiveShortTiesBothBridgesToTheRail)
{
    Fast x(1.08);
    ASSERT_EQ(x.state(), DRIVE_RUNNING);
    ASSERT_GT(*std::max_element(x.out.second, x.out.second + 3), 0);
    drive_trip(&x.d, DRIVE_FAULT_OVERLOAD);
    ASSERT_EQ(x.d.stage, STAGE_SHORT);
    x.step();
    EXPECT_EQ(x.out.legs, PM_LEGS_PWM);
    EXPECT_EQ(x.out.trip, 0);
    for (int leg = 0; leg < 3; ++leg) {
        EXPECT_EQ(x.out.compare[leg][0] | x.out.compare[leg][1] | x.out.second[leg], 0) << leg;
    }
}

// The diodes at both ends of a phase rectify what exceeds the link, in a star 1 / sqrt(3) of it.
TEST(OpenWindingDrive, AProtectiveShortBeginsWhereAPhaseExceedsTheLink)
{
    for (const double emf : {0.65, 1.04}) {
        Fast x(emf);
        drive_trip(&x.d, DRIVE_FAULT_OVERLOAD);
        EXPECT_EQ(x.d.stage, STAGE_OFF) << emf;
    }
    for (const double emf : {0.92, 0.95}) {
        Fast x(1.08);
        drive_trip(&x.d, DRIVE_FAULT_OVERLOAD);
        ASSERT_EQ(x.d.stage, STAGE_SHORT);
        x.d.pll.omega = static_cast<pm_q_t>(emf * x.d.status.v_dc / real(x.d.config.machine.psi_m));
        x.d.fault_short.turn = pm_half(pm_omega_to_angle(x.d.pll.omega, x.d.config.k_theta));
        drive_slow(&x.d, &x.slow);
        EXPECT_EQ(x.d.stage, emf < 15.0 / 16 ? STAGE_OFF : STAGE_SHORT) << emf;
    }
}

// --- on the plant --------------------------------------------------------------------------------------------

struct Loop {
    pmsim::Setup setup = ow::setup();
    const char *error = nullptr;
    std::unique_ptr<plant_t, decltype(&plant_destroy)> plant{nullptr, &plant_destroy};
    sim_loop_t loop = {};

    Loop()
    {
        plant.reset(plant_create(&setup.plant, 1.0, &error));
        EXPECT_NE(plant, nullptr) << error;
        const drive_result_t result = sim_loop_init(&loop, plant.get(), &*setup.params);
        EXPECT_TRUE(result.ok) << result.reason;
        command(0);
        run(700);
        EXPECT_EQ(status().state, DRIVE_RUNNING);
    }

    void command(int32_t speed_mrad_s)
    {
        drive_command_t c = {};
        c.enable = true;
        c.mode = DRIVE_MODE_CURRENT;
        c.current_mA = 2000;
        c.speed_mrad_s = speed_mrad_s;
        drive_command(&loop.app.drive, &c);
    }

    const drive_status_t &status() const
    {
        return *drive_status(&loop.app.drive);
    }

    void run(int ms)
    {
        for (int k = 0; k < 10 * ms; ++k) {
            sim_loop_step(&loop);
        }
    }

    int driven() const
    {
        return driven_legs(plant.get());
    }

    plant_truth_t truth() const
    {
        plant_truth_t t;
        plant_truth(plant.get(), &t);
        return t;
    }
};

TEST(OpenWindingDrive, CurrentGoesInAtOneBridgeAndBackAtTheOther)
{
    Loop x;
    EXPECT_EQ(x.driven(), 6);
    const plant_truth_t t = x.truth();
    double most_A = 0;
    for (int leg = 0; leg < 3; ++leg) {
        EXPECT_NEAR(t.i_A[leg], -t.i_A[leg + 3], 1e-9) << leg;
        most_A = std::max(most_A, std::fabs(t.i_A[leg]));
    }
    EXPECT_NEAR(std::hypot(t.i_d_A, t.i_q_A), 2.0, 0.1);
    EXPECT_GT(most_A, 1.5);
}

// A vector of current takes the rotor along up to 60 % of rated speed, where 1.2 A would flow by itself. What is left is what the
// dead time of legs whose current passes zero leaves of v_0.
TEST(OpenWindingDrive, TheZeroSequenceCurrentIsHeldOnThePlant)
{
    Loop x;
    x.command(25000);
    x.run(1500);
    ASSERT_EQ(x.status().fault, DRIVE_FAULT_NONE);
    ASSERT_NEAR(x.truth().omega_mech_rad_s, 25.0, 1.0);
    const double omega = 25.0 * x.setup.plant.machine.pole_pairs;
    const double free_A = 3 * omega * ow::kPsi_3_Wb / std::hypot(0.393, 3 * omega * 2.25e-3);
    EXPECT_GT(free_A, 1.0);
    double square = 0;
    constexpr int kPeriods = 2000;
    for (int k = 0; k < kPeriods; ++k) {
        sim_loop_step(&x.loop);
        square += x.truth().i_zero_A * x.truth().i_zero_A;
    }
    EXPECT_LT(std::sqrt(square / kPeriods), 0.01 * free_A);
}

TEST(OpenWindingDrive, EveryFaultOpensBothBridgesAtOnce)
{
    for (int fault = DRIVE_FAULT_NONE + 1; fault < DRIVE_FAULT_COUNT; ++fault) {
        Loop x;
        ASSERT_EQ(x.driven(), 6) << fault;
        drive_trip(&x.loop.app.drive, static_cast<drive_fault_t>(fault));
        sim_loop_step(&x.loop);
        EXPECT_EQ(x.driven(), 0) << fault;
        sim_loop_step(&x.loop);
        EXPECT_EQ(x.driven(), 0) << fault;
        x.run(5);
        const plant_truth_t t = x.truth();
        for (int leg = 0; leg < 6; ++leg) {
            EXPECT_LT(std::fabs(t.i_A[leg]), 0.01) << fault << ' ' << leg;
        }
    }
}

// The break input, which acts without the processor.
TEST(OpenWindingDrive, ABreakOpensBothBridges)
{
    Loop x;
    sim_break(&x.loop.hal);
    EXPECT_EQ(x.driven(), 0);
    x.run(1);
    EXPECT_EQ(x.status().fault, DRIVE_FAULT_HARDWARE);
    EXPECT_EQ(x.driven(), 0);
}

} // namespace
