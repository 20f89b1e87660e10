// The saliency map by the drive's own functions; with all effects of the plant in tests/scenario/saliency_map.yaml.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "firmware/drive/commissioning/commissioning_parts.h"
#include "tests/support/plants.h"
#include "tests/unit/drive/direct.h"

#include "hal/sim/sim_loop.h"

namespace
{

using bench::real;

constexpr double kHenry = 450.0 / 540.0 / 10;

class Bench
{
  public:
    explicit Bench(const plant_config_t &config, double theta = 2.0)
        : plant_(plant_create(&config, theta, &error_), &plant_destroy)
    {
        const drive_params_t p = direct::params(2);
        sim_loop_init(&loop, plant_.get(), &p);
    }

    void command(bool enable)
    {
        drive_command_t c = {};
        c.enable = enable;
        c.mode = DRIVE_MODE_IDENTIFY;
        c.current_mA = 4000;
        c.routines = COMMISSIONING_SALIENCY;
        drive_command(&loop.app.drive, &c);
    }

    void run_s(double time_s)
    {
        for (int k = 0; k < std::lround(time_s * 1e4) && report().state <= COMMISSIONING_RUNNING; ++k) {
            EXPECT_LT(report().progress, 100);
            sim_loop_step(&loop);
        }
    }

    void measure()
    {
        command(true);
        run_s(16);
        ASSERT_EQ(report().state, COMMISSIONING_DONE);
    }

    const commissioning_report_t &report() const
    {
        return loop.app.drive.commissioning_report;
    }

    const saliency_map_result_t &map() const
    {
        return loop.app.drive.saliency_map;
    }

    bool driven() const
    {
        return loop.app.out.legs != PM_LEGS_OFF;
    }

    plant_t *plant()
    {
        return plant_.get();
    }

    sim_loop_t loop = {};

  private:
    const char *error_ = nullptr;
    std::unique_ptr<plant_t, decltype(&plant_destroy)> plant_;
};

plant_config_t locked()
{
    plant_config_t c = plants::ipm_1000();
    c.mech.locked = true;
    return c;
}

TEST(SaliencyMap, FollowsThePoleOfTheRotor)
{
    Bench north(locked(), 2.0), south(locked(), 2.0 + M_PI);
    for (Bench *x : {&north, &south}) {
        x->measure();
        EXPECT_EQ(x->report().progress, 100);
        sim_loop_step(&x->loop);
        EXPECT_FALSE(x->driven());
    }
    for (int row = 0; row < SALIENCY_MAP_SIDE; ++row) {
        for (int column = 0; column < SALIENCY_MAP_SIDE; ++column) {
            const saliency_point_t &a = north.map().point[row][column], &b = south.map().point[row][column];
            EXPECT_NEAR(real(a.L_d) / real(b.L_d), 1, 0.005);
            EXPECT_NEAR(real(a.L_q) / real(b.L_q), 1, 0.005);
            EXPECT_NEAR(real(a.L_dq) * kHenry, real(b.L_dq) * kHenry, 0.4e-3); // half a percent of L_q
        }
    }
    EXPECT_LT(north.map().rated.L_dq, north.map().half.L_dq); // -4.5 mH and -2.6 mH
    EXPECT_LT(north.map().half.L_dq, 0);
}

TEST(SaliencyMap, ResultsAreThoseOfTheIdentification)
{
    Bench x(locked());
    x.command(true);
    x.run_s(16);
    EXPECT_EQ(x.report().result.L_d, x.map().point[0][2].L_d);
    EXPECT_EQ(x.report().result.L_q, x.map().point[0][2].L_q);
    EXPECT_EQ(x.report().result.R, 0); // not measured
}

TEST(SaliencyMap, OpenPhasesAreNoCurrent)
{
    plant_config_t c = locked();
    c.machine.R_s_ohm = 4000;
    Bench x(c);
    x.command(true);
    x.run_s(16);
    EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
    EXPECT_EQ(x.report().reason, COMMISSIONING_NO_CURRENT);
    EXPECT_EQ(x.map().i, 0);
}

TEST(SaliencyMap, ARoundMachineHasNoAxis)
{
    plant_config_t c = locked();
    c.machine.L_q0_H = c.machine.L_d0_H;
    c.machine.c_A_Wb5 = 0;
    Bench x(c);
    x.command(true);
    x.run_s(16);
    EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
    EXPECT_EQ(x.report().reason, COMMISSIONING_ROUND);
}

TEST(SaliencyMap, EndsAtOnceWithTheCommand)
{
    Bench x(locked());
    x.command(true);
    x.run_s(3);
    ASSERT_EQ(x.report().state, COMMISSIONING_RUNNING);
    EXPECT_TRUE(x.driven());
    x.command(false);
    for (int k = 0; k < 20; ++k) {
        sim_loop_step(&x.loop);
    }
    EXPECT_FALSE(x.driven());
    EXPECT_EQ(x.report().reason, COMMISSIONING_ABORTED);
    EXPECT_EQ(x.map().i, 0);
}

// With R and L_d as identification has found them the current is led in, though what was told is far off.
TEST(SaliencyMap, TakesWhatIdentificationHasFound)
{
    Bench told(locked()), found(locked());
    found.loop.app.drive.config.machine.R_s *= 8;
    found.loop.app.drive.config.machine.L_d /= 16;
    commissioning_result_t &before = found.loop.app.drive.commissioning_report.result;
    before.R = told.loop.app.drive.config.machine.R_s;
    before.L_d = told.loop.app.drive.config.machine.L_d;
    for (Bench *x : {&told, &found}) {
        x->measure();
    }
    EXPECT_NEAR(real(told.map().rated.L_q) / real(found.map().rated.L_q), 1, 0.005);
}

// The carrier sees its inductance, but no more than a fifth of the link is led into the winding.
TEST(SaliencyMap, ACurrentThatDoesNotComeIsNoCurrent)
{
    plant_config_t c = locked();
    c.machine.R_s_ohm = 60;
    Bench x(c);
    x.command(true);
    x.run_s(16);
    EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
    EXPECT_EQ(x.report().reason, COMMISSIONING_NO_CURRENT);
}

// Told no flux of its carrier, it finds no inductance where there is an answer.
TEST(SaliencyMap, AnInductanceThatIsNotPositiveIsImplausible)
{
    for (const pm_q_t sign : {0, -1}) {
        Bench x(locked());
        x.loop.app.drive.config.saliency_map.flux *= sign;
        x.command(true);
        x.run_s(16);
        EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
        EXPECT_EQ(x.report().reason, COMMISSIONING_IMPLAUSIBLE);
        EXPECT_EQ(x.map().i, 0);
    }
}

TEST(SaliencyMap, ARotorThatHasTurnedIsSaid)
{
    for (const double turn_deg : {3.0, -3.0}) {
        Bench x(locked());
        x.command(true);
        x.run_s(8);
        ASSERT_EQ(x.report().state, COMMISSIONING_RUNNING);
        plant_turn_rotor(x.plant(), turn_deg * M_PI / 180);
        x.run_s(8);
        EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
        EXPECT_EQ(x.report().reason, COMMISSIONING_TURNED);
    }
}

// Told that L_d rises with the magnet's flux, the drive takes the other pole: d and q of the map change their signs.
TEST(SaliencyMap, TheOtherPoleIsThatOfAnInverseMachine)
{
    Bench as_it_is(locked()), inverse(locked());
    inverse.loop.app.drive.config.saliency_map.reversed =
        !as_it_is.loop.app.drive.config.saliency_map.reversed;
    inverse.loop.app.drive.config.saliency_map.best = false;
    for (Bench *x : {&as_it_is, &inverse}) {
        x->measure();
    }
    for (int row = 0; row < SALIENCY_MAP_SIDE; ++row) {
        for (int column = 0; column < SALIENCY_MAP_SIDE; ++column) {
            const saliency_point_t &a = as_it_is.map().point[row][column];
            const saliency_point_t &b = inverse.map().point[row][SALIENCY_MAP_SIDE - 1 - column];
            EXPECT_NEAR(real(a.L_d) / real(b.L_d), 1, 0.01);
            EXPECT_NEAR(real(a.L_dq) * kHenry, -real(b.L_dq) * kHenry, 0.6e-3);
        }
    }
    EXPECT_EQ(inverse.map().rated.L_d, inverse.map().point[4][2].L_d) << "i_d = 0";
}

} // namespace
