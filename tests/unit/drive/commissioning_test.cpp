// Identification by the drive's own functions, on small plants: ideal ones, whose answer is known to the last
// digit, and the real ones of tests/scenario/identify*.yaml.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "firmware/drive/commissioning/commissioning_parts.h"
#include "tests/support/plants.h"
#include "tests/unit/drive/direct.h"
#include "tests/unit/drive/fan.h"

#include "hal/sim/sim_loop.h"

namespace
{

using bench::real;

// Bases of the defaults: 450 V, 10 A, 540 rad/s.
constexpr double kOhm = 45.0, kWb = 450.0 / 540.0, kHenry = kWb / 10, kTorque = 1.5 * 3 * kWb * 10;
constexpr double kJ = kTorque * COMMISSIONING_J_STEPS * 1e-3 / 180;

// Linear, no dead time, no noise, exact converter: what is left is quantisation of the pulses, 9 mV of 300 V.
plant_config_t ideal()
{
    plant_config_t c = plants::ipm_1000();
    c.machine.c_A_Wb5 = 0;
    c.inverter.dead_time_s = 0;
    c.inverter.v_switch_V = 0;
    c.inverter.v_diode_V = 0;
    c.dclink.r_source_ohm = 0;
    c.dclink.c_F = 0;
    c.sensor.bits = 0;
    c.sensor.noise_lsb = 0;
    return c;
}

// Far from the machine: what is not to be identified is taken from here.
drive_params_t wrong()
{
    drive_params_t p = direct::params(2);
    p.R_s = 2000000;
    p.L_d = 20000000;
    p.L_q = 25000000;
    p.L_q_rated = 24000000;
    p.L_dh_rated = 20000000;
    p.L_qh_rated = 24000000;
    p.L_dqh_rated = 0;
    p.psi_m = 100000000;
    return p;
}

class Bench
{
  public:
    explicit Bench(const plant_config_t &config, const drive_params_t &p = wrong())
        : plant_(plant_create(&config, 2.0, &error_), &plant_destroy)
    {
        sim_loop_init(&loop, plant_.get(), &p);
    }

    void command(bool enable, uint8_t routines = 0, int32_t current_mA = 4000, int32_t speed_mrad_s = 42000)
    {
        drive_command_t c = {};
        c.enable = enable;
        c.mode = DRIVE_MODE_IDENTIFY;
        c.current_mA = current_mA;
        c.speed_mrad_s = speed_mrad_s;
        c.routines = routines;
        drive_command(&loop.app.drive, &c);
    }

    void step()
    {
        sim_loop_step(&loop);
    }

    // Until it has ended or the time is over.
    void run_s(double time_s)
    {
        for (int k = 0; k < std::lround(time_s * 1e4) && report().state <= COMMISSIONING_RUNNING; ++k) {
            step();
        }
    }

    const commissioning_report_t &report() const
    {
        return loop.app.drive.commissioning_report;
    }

    const commissioning_result_t &result() const
    {
        return report().result;
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

TEST(Commissioning, ResistanceAlone)
{
    Bench x(ideal());
    x.command(true, COMMISSIONING_RESISTANCE);
    x.run_s(6);
    EXPECT_EQ(x.report().state, COMMISSIONING_DONE);
    EXPECT_NEAR(real(x.result().R) * kOhm, 6.0, 6.0 * 1e-3);
    EXPECT_NEAR(real(x.result().lost) * 450, 0, 0.01);
    EXPECT_EQ(x.result().L_d, 0); // not measured
    EXPECT_EQ(x.result().psi_m, 0);
    x.step();
    EXPECT_FALSE(x.driven());
}

TEST(Commissioning, LostVoltageIsSeparate)
{
    plant_config_t c = ideal();
    c.inverter.dead_time_s = 2e-6;
    c.inverter.v_switch_V = 1;
    c.inverter.v_diode_V = 1;
    Bench x(c);
    x.command(true, COMMISSIONING_RESISTANCE);
    x.run_s(6);
    EXPECT_NEAR(real(x.result().R) * kOhm, 6.0, 6.0 * 2e-3);
    EXPECT_NEAR(real(x.result().lost) * 450, 2e-6 * 1e4 * 300 + 1, 0.05);
}

TEST(Commissioning, InductancesOfALinearMachine)
{
    Bench x(ideal());
    x.command(true, COMMISSIONING_RESISTANCE | COMMISSIONING_INDUCTANCE);
    x.run_s(8);
    ASSERT_EQ(x.report().state, COMMISSIONING_DONE);
    EXPECT_NEAR(real(x.result().L_d) * kHenry, 46.3e-3, 46.3e-3 * 5e-3);
    EXPECT_NEAR(real(x.result().L_q) * kHenry, 76.9e-3, 76.9e-3 * 5e-3);
    EXPECT_NEAR(real(x.result().L_q_rated) * kHenry, 76.9e-3, 76.9e-3 * 2e-2); // the rotor moves a little
    EXPECT_NEAR(real(x.result().L_dq_rated) * kHenry, 0, 76.9e-3 * 1e-2);
}

// Anti-windup at the rate at which the integral follows: ki / kp.
TEST(Commissioning, GainsAreThoseOfTheMachineThatWasFound)
{
    direct::Drive x(direct::params(2));
    identify_t &self = x.d.procedure.identify;
    for (const double R_ohm : {0.5, 6.0, 30.0}) {
        self.R = bench::fixed(R_ohm / kOhm, PM_Q_BITS);
        self.L_d = bench::fixed(46e-3 / kHenry, PM_Q_BITS);
        commissioning_set_gains(&x.d);
        EXPECT_NEAR(double(self.pi.ki) / self.pi.kp, R_ohm * 1e-4 / 46e-3, 2e-5) << R_ohm;
        EXPECT_NEAR(real(self.pi.kb, 31), R_ohm * 1e-4 / 46e-3, 2e-5) << R_ohm;
    }
}

// A rotor that has been moved, or whose R has changed under it: the voltage gives way while the vector turns.
TEST(Commissioning, SweepGivesWayToACurrentThatIsTooLarge)
{
    direct::Drive x(direct::params(2));
    x.run_ms(1); // the DC link is known
    x.d.i_target = PM_Q(0.4);
    identify_t &self = x.d.procedure.identify;
    sweep_enter(&x.d);
    const pm_q_t U = x.d.status.v_dc / 16;
    for (const bool large : {false, true}) {
        self.part = 1;
        self.of.resistance.U = U;
        commissioning_clear_sums(&self);
        self.samples = 1;
        self.sum[0] = large ? PM_Q(2.0) : 0;
        EXPECT_FALSE(sweep_slow(&x.d).done);
        EXPECT_EQ(self.of.resistance.U < U, large);
    }
}

TEST(Commissioning, SaturationAndCrossCoupling)
{
    plant_config_t c = ideal();
    c.machine.c_A_Wb5 = 105;
    Bench x(c);
    x.command(true);
    x.run_s(15);
    ASSERT_EQ(x.report().state, COMMISSIONING_DONE);
    EXPECT_NEAR(real(x.result().L_d) * kHenry, 43.0e-3, 43.0e-3 * 0.02);
    EXPECT_NEAR(real(x.result().L_q) * kHenry, 75.0e-3, 75.0e-3 * 0.02);
    EXPECT_NEAR(real(x.result().L_q_rated) * kHenry, 70.8e-3, 70.8e-3 * 0.03);
    EXPECT_NEAR(real(x.result().L_dq_rated) * kHenry, -4.47e-3, 1e-3);
}

TEST(Commissioning, FluxInertiaAndFriction)
{
    plant_config_t c = ideal();
    c.mech.T_coulomb_Nm = 0.05;
    c.mech.B_Nms = 2e-3;
    for (const int32_t speed : {42000, -42000}) {
        Bench x(c);
        x.command(true, 0, 4000, speed);
        x.run_s(15);
        ASSERT_EQ(x.report().state, COMMISSIONING_DONE) << speed;
        EXPECT_NEAR(real(x.result().psi_m) * kWb, 0.236, 0.236 * 5e-3);
        EXPECT_NEAR(real(x.result().J) * kJ, 0.01, 0.01 * 0.04);
        EXPECT_NEAR(real(x.result().viscous) * kTorque / 180, 2e-3, 0.5e-3);
        EXPECT_NEAR(real(x.result().coulomb) * kTorque, 0.05, 0.02);
    }
}

// The flux at a quarter of the current is held against that at all of it: a rotor that follows the strong vector alone is
// not measured.
TEST(Commissioning, TheFluxAtFullCurrentIsKept)
{
    Bench x(ideal(), direct::params(2)); // the machine's own
    x.command(true, COMMISSIONING_FLUX);
    const auto &rotation = x.loop.app.drive.procedure.identify.of.rotation;
    double before = 0;
    while (x.report().state <= COMMISSIONING_RUNNING) {
        x.step();
        if (x.report().result.psi_m == 0) {
            before = real(rotation.psi_full) * kWb;
        }
    }
    ASSERT_EQ(x.report().state, COMMISSIONING_DONE);
    EXPECT_NEAR(before, 0.236, 0.236 * 0.1); // L_q of the parameters is saturated
}

// 9,600 rad/s of base speed are 9.6 rad a millisecond. Twin: one of 6,000, whose millisecond fits the format. R and the lost
// voltage are the parameters'.
TEST(Commissioning, TheFluxOfAMachineForHighSpeed)
{
    double psi_Wb[2];
    for (int fast = 0; fast < 2; ++fast) {
        fan::Fan x;
        x.params().commutation = 0;
        x.params().start_method = 2;
        x.params().speed_trip = fast != 0 ? 2400000 : 1500000;
        x.enable(DRIVE_MODE_IDENTIFY);
        x.identify(COMMISSIONING_FLUX, 100);
        const commissioning_report_t &report = x.drive().commissioning_report;
        for (int ms = 0; ms < 12000 && report.state <= COMMISSIONING_RUNNING; ++ms) {
            x.run_s(1e-3);
        }
        ASSERT_EQ(report.state, COMMISSIONING_DONE) << fast << ' ' << int(report.reason);
        psi_Wb[fast] = real(report.result.psi_m) * 40e3 / (4.0 * x.params().speed_trip);
    }
    EXPECT_NEAR(psi_Wb[0], 7.5e-3, 7.5e-4);
    EXPECT_NEAR(psi_Wb[1], psi_Wb[0], 1e-3 * psi_Wb[0]);
}

TEST(Commissioning, ValuesNotIdentifiedComeFromTheParameters)
{
    drive_params_t p = direct::params(2); // the machine's own
    Bench x(plants::ipm_1000(), p);
    x.command(true, COMMISSIONING_FLUX);
    x.run_s(12);
    ASSERT_EQ(x.report().state, COMMISSIONING_DONE);
    EXPECT_NEAR(real(x.result().psi_m) * kWb, 0.236, 0.236 * 0.02);
    EXPECT_EQ(x.result().R, 0);
    EXPECT_EQ(x.result().L_q, 0);
    EXPECT_EQ(x.result().J, 0);
}

// Results of an earlier run are what a later one builds on: the parameters stay wrong.
TEST(Commissioning, ValuesFoundBeforeAreKept)
{
    Bench x(ideal());
    x.command(true);
    x.run_s(15);
    ASSERT_EQ(x.report().state, COMMISSIONING_DONE);
    x.command(false);
    x.step();
    for (const uint8_t routine : {COMMISSIONING_INDUCTANCE, COMMISSIONING_FLUX}) {
        x.command(true, routine);
        x.run_s(12);
        ASSERT_EQ(x.report().state, COMMISSIONING_DONE);
        EXPECT_NEAR(real(x.result().L_q) * kHenry, 76.9e-3, 76.9e-3 * 5e-3);
        EXPECT_NEAR(real(x.result().psi_m) * kWb, 0.236, 0.236 * 0.02);
        EXPECT_NEAR(real(x.result().R) * kOhm, 6.0, 6.0 * 1e-3);
        x.command(false);
        x.step();
    }
}

// Without saliency no i_d helps the torque: the wave at the test current has none, and there is nothing to tell cross
// coupling from.
TEST(Commissioning, InductancesOfARoundMachine)
{
    plant_config_t c = ideal();
    c.machine.L_q0_H = c.machine.L_d0_H;
    Bench x(c);
    x.command(true, COMMISSIONING_RESISTANCE | COMMISSIONING_INDUCTANCE);
    x.run_s(8);
    ASSERT_EQ(x.report().state, COMMISSIONING_DONE);
    EXPECT_NEAR(real(x.result().L_d) * kHenry, 46.3e-3, 46.3e-3 * 5e-3);
    EXPECT_NEAR(real(x.result().L_q) * kHenry, 46.3e-3, 46.3e-3 * 5e-3);
    EXPECT_NEAR(real(x.result().L_q_rated) * kHenry, 46.3e-3, 46.3e-3 * 2e-2);
    EXPECT_EQ(x.result().L_dq_rated, 0);
}

// A wave that drives no current at all the voltage there is: the motor is not connected.
TEST(Commissioning, InductanceNeedsAMotor)
{
    Bench x(ideal());
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        plant_set_leg_fault(x.plant(), leg, PLANT_WIRE_OPEN);
    }
    x.command(true, COMMISSIONING_INDUCTANCE);
    x.run_s(8);
    EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
    EXPECT_EQ(x.report().reason, COMMISSIONING_NO_CURRENT);
    EXPECT_EQ(x.result().L_d, 0);
}

TEST(Commissioning, CurrentStaysBelowTheLimit)
{
    plant_config_t c = plants::ipm_1000();
    Bench x(c);
    x.command(true, 0, 100000); // more than i_max
    double most_A = 0;
    for (int k = 0; k < 130000; ++k) {
        x.step();
        plant_truth_t truth;
        plant_truth(x.plant(), &truth);
        most_A = std::max(most_A, std::abs(truth.i_A[0]));
    }
    EXPECT_EQ(x.report().state, COMMISSIONING_DONE);
    EXPECT_GT(most_A, 4.5);
    EXPECT_LT(most_A, 1.4 * 5); // i_max, and what a wave goes beyond it
}

TEST(Commissioning, OpenPhasesAreSeen)
{
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        Bench x(ideal());
        plant_set_leg_fault(x.plant(), leg, PLANT_WIRE_OPEN);
        x.command(true);
        x.run_s(8);
        EXPECT_EQ(x.report().state, COMMISSIONING_FAILED) << leg;
        const int reason = x.report().reason;
        EXPECT_TRUE(reason == COMMISSIONING_NO_CURRENT || reason == COMMISSIONING_UNEVEN)
            << leg << ' ' << reason;
        x.step();
        x.step();
        EXPECT_FALSE(x.driven()) << leg;
        EXPECT_EQ(x.result().R, 0) << leg; // nothing is said
    }
}

TEST(Commissioning, ALockedRotorHasNoFluxAndNoInertia)
{
    Bench x(ideal());
    plant_set_locked(x.plant(), true);
    x.command(true);
    x.run_s(15);
    EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
    EXPECT_EQ(x.report().reason, COMMISSIONING_NOT_TURNING);
    EXPECT_EQ(x.result().psi_m, 0);
    EXPECT_EQ(x.result().J, 0);
    EXPECT_NE(x.result().L_q, 0); // what was found before stays
}

TEST(Commissioning, TheEndOfEnableOpensTheBridgeInTheNextPeriod)
{
    for (int ms = 130; ms < 12500; ms += 1511) {
        Bench x(plants::ipm_1000());
        x.command(true);
        for (int k = 0; k < 10 * ms + 3; ++k) {
            x.step();
        }
        ASSERT_TRUE(x.driven()) << ms;
        x.command(false);
        x.step();
        EXPECT_FALSE(x.driven()) << ms;
        for (int k = 0; k < 20; ++k) {
            x.step();
            EXPECT_FALSE(x.driven()) << ms;
        }
        EXPECT_EQ(x.report().state, COMMISSIONING_FAILED) << ms;
        EXPECT_EQ(x.report().reason, COMMISSIONING_ABORTED) << ms;
        EXPECT_EQ(drive_status(&x.loop.app.drive)->state, DRIVE_OFF) << ms;
    }
}

TEST(Commissioning, AnotherStartAfterItFindsThePosition)
{
    Bench x(plants::ipm_1000(), direct::params());
    x.command(true, COMMISSIONING_RESISTANCE);
    x.run_s(6);
    x.command(false);
    x.run_s(0.01);
    for (int k = 0; k < 100; ++k) {
        x.step();
    }
    drive_command_t c = {};
    c.enable = true;
    c.speed_mrad_s = 50000;
    drive_command(&x.loop.app.drive, &c);
    for (int k = 0; k < 15000; ++k) {
        x.step();
    }
    EXPECT_EQ(drive_status(&x.loop.app.drive)->fault, DRIVE_FAULT_NONE);
    plant_truth_t truth;
    plant_truth(x.plant(), &truth);
    EXPECT_NEAR(truth.omega_mech_rad_s, 50, 1);
}

TEST(Commissioning, ItDoesNotStartAgainByItself)
{
    Bench x(ideal());
    x.command(true, COMMISSIONING_RESISTANCE);
    x.run_s(6);
    for (int k = 0; k < 10000; ++k) {
        x.step();
        ASSERT_FALSE(x.driven() && k > 2);
    }
    EXPECT_EQ(x.report().state, COMMISSIONING_DONE);
}

} // namespace
