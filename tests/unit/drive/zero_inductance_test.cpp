// dL_0 and L_c0 by the drive's own procedure, against those of the plant: dead time, drops, leg capacitance, noise, free rotor with
// friction. The drive is told neither.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "firmware/drive/commissioning/commissioning_parts.h"
#include "hal/sim/sim_loop.h"
#include "tests/support/plants.h"
#include "tests/unit/drive/direct.h"

namespace
{

using bench::kDegree;
using bench::real;

// 2 % of dL_0, and for L_c0 what friction leaves of the rotor's angle, half a degree: 2 delta dL_0.
constexpr double kWithin = 0.02, kAcross = 0.03, kStarWithin = 0.1;
constexpr double kLongest_s = 8;
constexpr double kHeld = 0.02; // of the current: gains of the channels 1 %, and hold.c's error of up to 3 %
constexpr int kWithProgress = 100 / 8, kWithoutProgress = 300 / 8;

struct Motor {
    const char *name;
    bool spm;
    double dL_0_H, L_c0_H, theta_deg;
};

drive_params_t parameters(const Motor &m)
{
    drive_params_t p = direct::params(2);
    p.neutral_full_scale = m.spm ? 2000 : 10000;
    p.neutral_filter = 100000;
    p.dL_0 = 0;
    if (m.spm) {
        direct::make_spm(p);
        p.v_injection = 8000;
    }
    return p;
}

plant_config_t plant_of(const Motor &m)
{
    plant_config_t c = m.spm ? plants::spm_400() : plants::ipm_1000();
    c.inverter.c_leg_F = m.spm ? 2e-9 : 0.5e-9;
    c.mech.T_coulomb_Nm = 0.02;
    c.winding.dL_0_H = m.dL_0_H;
    c.winding.L_c0_H = m.L_c0_H;
    c.sensor.gain_error[0] = 0.01;
    c.sensor.gain_error[2] = -0.01;
    c.sensor.v_zero_full_scale_V = m.spm ? 2 : 10;
    c.sensor.v_zero_filter_s = 100e-6;
    c.sensor.v_zero_noise_lsb = 0.5;
    return c;
}

class Bench
{
  public:
    Bench(const plant_config_t &config, const drive_params_t &p, double theta_deg)
        : params_(p), plant_(plant_create(&config, theta_deg * kDegree, &error_), &plant_destroy)
    {
        EXPECT_NE(plant_, nullptr) << error_;
        EXPECT_TRUE(sim_loop_init(&loop, plant_.get(), &params_).ok);
        command(true);
    }

    void command(bool enable)
    {
        drive_command_t c = {};
        c.enable = enable;
        c.mode = DRIVE_MODE_IDENTIFY;
        c.current_mA = 4000;
        c.routines = COMMISSIONING_NEUTRAL;
        drive_command(&loop.app.drive, &c);
    }

    void run_to(int progress)
    {
        for (int k = 0; k < std::lround(kLongest_s * 1e4) && report().progress < progress; ++k) {
            sim_loop_step(&loop);
        }
    }

    // Along phase A, over whole periods of the carrier.
    double mean_A(int carriers)
    {
        double sum = 0;
        for (int k = 0; k < 20 * carriers; ++k) {
            sim_loop_step(&loop);
            plant_truth_t t;
            plant_truth(plant_.get(), &t);
            sum += t.i_A[0];
        }
        return sum / (20 * carriers);
    }

    void run_s(double time_s)
    {
        for (int k = 0; k < std::lround(time_s * 1e4) && report().state <= COMMISSIONING_RUNNING; ++k) {
            sim_loop_step(&loop);
        }
    }

    const commissioning_report_t &report() const
    {
        return loop.app.drive.commissioning_report;
    }

    const zero_inductance_result_t &result() const
    {
        return loop.app.drive.zero_inductance;
    }

    double henry() const
    {
        const drive_base_t &b = loop.app.drive.config.base;
        return pm_num_to_double(b.psi) / pm_num_to_double(b.i);
    }

    double test_A() const // that is held
    {
        return pm_num_to_double(loop.app.drive.config.base.i) *
               real(loop.app.drive.procedure.zero_inductance.i);
    }

    double theta_deg() const
    {
        plant_truth_t t;
        plant_truth(plant_.get(), &t);
        return bench::wrapped(t.theta_e_rad) / kDegree;
    }

    plant_t *plant()
    {
        return plant_.get();
    }

    sim_loop_t loop = {};

  private:
    static double pm_num_to_double(pm_num_t x)
    {
        int32_t value = 0;
        (void)pm_num_to_fixed(pm_num_mul(x, pm_num(1000000)), 0, &value);
        return value * 1e-6;
    }

    drive_params_t params_;
    const char *error_ = nullptr;
    std::unique_ptr<plant_t, decltype(&plant_destroy)> plant_;
};

class ZeroInductance : public ::testing::TestWithParam<Motor>
{
};

TEST_P(ZeroInductance, IsThatOfThePlant)
{
    const Motor m = GetParam();
    Bench x(plant_of(m), parameters(m), m.theta_deg);
    x.run_s(kLongest_s);
    ASSERT_EQ(x.report().state, COMMISSIONING_DONE) << int(x.report().reason);
    EXPECT_EQ(x.report().progress, 100);
    EXPECT_NEAR(x.henry() * real(x.result().dL_0), m.dL_0_H, kWithin * std::abs(m.dL_0_H));
    EXPECT_NEAR(x.henry() * real(x.result().L_c0), m.L_c0_H, kAcross * std::abs(m.dL_0_H));
    EXPECT_GE(x.result().margin, 5 * 256); // L_sa / D grows with magnetising current
    EXPECT_FALSE(x.result().falls);
    sim_loop_step(&x.loop);
    EXPECT_EQ(x.loop.app.out.legs, PM_LEGS_OFF);
}

constexpr Motor kMotors[] = {{"ipm", false, 2e-3, 0, 20},         {"south", false, 2e-3, 0, 200},
                             {"cross", false, 2e-3, 0.5e-3, 133}, {"negative", false, -1.5e-3, -0.3e-3, 290},
                             {"spm", true, 0.3e-3, 0, 100},       {"spm cross", true, 0.3e-3, 0.1e-3, 310}};
INSTANTIATE_TEST_SUITE_P(Motors, ZeroInductance, ::testing::ValuesIn(kMotors));

// Resistors of the star 1 % apart: 0.3 % of the legs' voltage.
TEST_P(ZeroInductance, AndTheStarThatOfTheBoard)
{
    const Motor m = GetParam();
    plant_config_t c = plant_of(m);
    c.sensor.v_zero_network_error[0] = 0.01;
    c.sensor.v_zero_network_error[1] = -0.01;
    Bench x(c, parameters(m), m.theta_deg);
    x.run_s(kLongest_s);
    ASSERT_EQ(x.report().state, COMMISSIONING_DONE) << int(x.report().reason);
    const double conductance[] = {1 / 1.01, 1 / 0.99, 1};
    const double sum = conductance[0] + conductance[1] + conductance[2];
    const double alpha = (conductance[0] - conductance[1] / 2 - conductance[2] / 2) / sum;
    const double beta = (conductance[1] - conductance[2]) * std::sqrt(0.75) / sum;
    const double size = std::hypot(alpha, beta);
    EXPECT_NEAR(real(x.result().star.alpha), alpha, kStarWithin * size);
    EXPECT_NEAR(real(x.result().star.beta), beta, kStarWithin * size);
    EXPECT_NEAR(x.henry() * real(x.result().dL_0), m.dL_0_H, kWithin * std::abs(m.dL_0_H));
    EXPECT_NEAR(x.henry() * real(x.result().L_c0), m.L_c0_H, kAcross * std::abs(m.dL_0_H));
}

// What lags evenly behind a ramp is not at its end: at the first value without current there would be a quarter of it.
TEST_P(ZeroInductance, IsMeasuredWithAndWithoutTheCurrent)
{
    const Motor m = GetParam();
    Bench x(plant_of(m), parameters(m), m.theta_deg);
    x.run_to(kWithProgress);
    const double test_A = x.test_A();
    EXPECT_NEAR(x.mean_A(1), test_A, kHeld * test_A);
    x.run_to(kWithoutProgress);
    EXPECT_NEAR(x.mean_A(1), 0, kHeld * test_A);
}

// Currents up to a fifth of the channels' full scale.
TEST(ZeroInductanceCarrier, MayBeLargeAndSmall)
{
    const Motor m = {"spm", true, 0.3e-3, 0, 100};
    for (const int32_t v_mV : {4000, 10000, 14000, 20000}) {
        drive_params_t p = parameters(m);
        p.v_injection = v_mV;
        Bench x(plant_of(m), p, m.theta_deg);
        x.run_s(kLongest_s);
        ASSERT_EQ(x.report().state, COMMISSIONING_DONE) << v_mV << int(x.report().reason);
        EXPECT_NEAR(x.henry() * real(x.result().dL_0), m.dL_0_H, 2 * kWithin * m.dL_0_H) << v_mV;
    }
}

// Dead time takes most where the carrier passes zero, which is without the current; that is no fall.
TEST(ZeroInductanceFalls, IsNotSaidOfALinearMachine)
{
    const Motor m = {"linear", false, 2e-3, 0, 20};
    for (const int32_t v_mV : {35000, 70000}) {
        plant_config_t c = plant_of(m);
        c.machine.c_A_Wb5 = 0;
        drive_params_t p = parameters(m);
        p.v_injection = v_mV;
        Bench x(c, p, m.theta_deg);
        x.run_s(kLongest_s);
        ASSERT_EQ(x.report().state, COMMISSIONING_DONE) << int(x.report().reason);
        EXPECT_EQ(x.result().margin, 0) << v_mV;
        EXPECT_NEAR(x.henry() * real(x.result().dL_0), m.dL_0_H, kWithin * m.dL_0_H) << v_mV;
    }
}

// dL_0 that falls with magnetising current faster than 1 / L_dh and 1 / L_qh grow: the answer at the neutral falls. Beside
// an L_c0 that goes with i_q it falls at 0 and rises at 90 degrees, where the carrier's current along q shows dL_0 i_d - L_c0_q i_d:
// no sign is right everywhere.
TEST(ZeroInductanceFalls, IsSaidWhereItIsTheSameAcross)
{
    const Motor m = {"ipm", false, 2e-3, 0, 20};
    for (const bool differs : {false, true}) {
        plant_config_t c = plant_of(m);
        c.winding.dL_0_d_1_A = -0.04;
        c.winding.L_c0_q_H_A = differs ? -75e-6 : 0;
        Bench x(c, parameters(m), m.theta_deg);
        x.run_s(kLongest_s);
        ASSERT_EQ(x.report().state, COMMISSIONING_DONE) << int(x.report().reason);
        EXPECT_NEAR(x.henry() * real(x.result().dL_0), m.dL_0_H, kWithin * m.dL_0_H) << differs;
        EXPECT_TRUE(x.result().falls);
        if (differs) {
            EXPECT_EQ(x.result().margin, 0);
        } else {
            EXPECT_GE(x.result().margin, 5 * 256);
        }
    }
}

// Twin: a channel whose filter is told as none is off by what the filter does to the carrier.
TEST(ZeroInductanceFails, WithAnotherFilter)
{
    const Motor m = kMotors[0];
    drive_params_t p = parameters(m);
    p.neutral_filter = 50000;
    Bench x(plant_of(m), p, m.theta_deg);
    x.run_s(kLongest_s);
    const double off =
        std::hypot(x.henry() * real(x.result().dL_0) - m.dL_0_H, x.henry() * real(x.result().L_c0));
    EXPECT_GE(off, 5 * kWithin * m.dL_0_H);
}

TEST(ZeroInductanceFails, WithoutAnAnswer)
{
    Motor m = kMotors[0];
    m.dL_0_H = 0;
    Bench x(plant_of(m), parameters(m), m.theta_deg);
    x.run_s(kLongest_s);
    EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
    EXPECT_EQ(x.report().reason, COMMISSIONING_ROUND);
    EXPECT_EQ(x.result().dL_0, 0);
}

// The motor has come off while its carrier is on.
TEST(ZeroInductanceFails, WithoutACurrent)
{
    const Motor m = kMotors[0];
    Bench x(plant_of(m), parameters(m), m.theta_deg);
    x.run_s(0.5);
    ASSERT_EQ(x.report().state, COMMISSIONING_RUNNING);
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        plant_set_leg_fault(x.plant(), leg, PLANT_WIRE_OPEN);
    }
    x.run_s(kLongest_s);
    EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
    EXPECT_EQ(x.report().reason, COMMISSIONING_NO_CURRENT);
    EXPECT_EQ(x.result().dL_0, 0);
}

TEST(ZeroInductanceFails, WhenItIsStopped)
{
    const Motor m = kMotors[0];
    Bench x(plant_of(m), parameters(m), m.theta_deg);
    x.run_s(1.0);
    EXPECT_EQ(x.report().state, COMMISSIONING_RUNNING);
    x.command(false);
    x.run_s(0.1);
    EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
    EXPECT_EQ(x.report().reason, COMMISSIONING_ABORTED);
    EXPECT_EQ(x.loop.app.out.legs, PM_LEGS_OFF);
}

} // namespace
