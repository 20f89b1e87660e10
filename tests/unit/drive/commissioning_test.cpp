// Identification by the drive's own functions, on small plants: ideal ones, whose answer is known to the last
// digit, and the real ones of tests/scenario/identify*.yaml.
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
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

    // The command is taken back, for longer than a call of 1 kHz.
    void end()
    {
        command(false);
        for (int k = 0; k < 20; ++k) {
            step();
        }
    }

    // Past the calibration: until then the report is that of the run before.
    void run_to_its_begin()
    {
        for (int k = 0; k < 10000 && report().state != COMMISSIONING_RUNNING; ++k) {
            step();
        }
        ASSERT_EQ(report().state, COMMISSIONING_RUNNING);
    }

    const identify_t &identify() const
    {
        return loop.app.drive.procedure.identify;
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

// Results of an earlier run are what a later one builds on: the parameters stay wrong. Without the levels of the resistance the rotor
// comes to rest behind the sweep: 0.5 % of the inductances are 5 degrees, (L_q - L_d) sin^2.
TEST(Commissioning, ValuesFoundBeforeAreKept)
{
    Bench x(ideal());
    x.command(true);
    x.run_s(15);
    ASSERT_EQ(x.report().state, COMMISSIONING_DONE);
    x.end();
    for (const uint8_t routine : {COMMISSIONING_INDUCTANCE, COMMISSIONING_FLUX}) {
        x.command(true, routine);
        x.run_to_its_begin();
        EXPECT_EQ(x.identify().R, x.result().R);
        EXPECT_EQ(x.identify().lost, x.result().lost);
        EXPECT_EQ(x.identify().L_d, x.result().L_d);
        EXPECT_EQ(x.identify().L_q, x.result().L_q);
        x.run_s(12);
        ASSERT_EQ(x.report().state, COMMISSIONING_DONE);
        EXPECT_NEAR(real(x.result().L_d) * kHenry, 46.3e-3, 46.3e-3 * 5e-3);
        EXPECT_NEAR(real(x.result().L_q) * kHenry, 76.9e-3, 76.9e-3 * 5e-3);
        EXPECT_NEAR(real(x.result().psi_m) * kWb, 0.236, 0.236 * 0.02);
        EXPECT_NEAR(real(x.result().R) * kOhm, 6.0, 6.0 * 1e-3);
        x.end();
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

// A wave that drives no current at all the voltage there is: the motor is not connected any more.
TEST(Commissioning, InductanceNeedsAMotor)
{
    Bench x(ideal());
    x.command(true, COMMISSIONING_INDUCTANCE);
    x.run_to_its_begin();
    for (int k = 0; k < 40000 && x.identify().kind != KIND_SQUARE; ++k) {
        x.step();
    }
    ASSERT_EQ(x.identify().kind, KIND_SQUARE);
    ASSERT_EQ(x.report().state, COMMISSIONING_RUNNING);
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        plant_set_leg_fault(x.plant(), leg, PLANT_WIRE_OPEN);
    }
    x.run_s(8);
    EXPECT_EQ(x.report().state, COMMISSIONING_FAILED);
    EXPECT_EQ(x.report().reason, COMMISSIONING_NO_CURRENT);
    EXPECT_EQ(x.result().L_d, 0);
}

// By itself, a phase that has its sums: per-unit values.
struct Phase : direct::Drive {
    Phase() : Drive(direct::params(2))
    {
        run_ms(1); // the DC link is known
        d.i_target = PM_Q(0.4);
        self = {};
        self.R = PM_Q(0.1);
        self.L_d = PM_Q(0.4);
        self.L_q = PM_Q(0.6);
    }

    void means(std::initializer_list<double> values)
    {
        commissioning_clear_sums(&self);
        int n = 0;
        for (const double value : values) {
            self.sum[n++] = bench::fixed(value, PM_Q_BITS);
        }
        self.samples = 1;
    }

    commissioning_result_t &result()
    {
        return d.commissioning_report.result;
    }

    identify_t &self = d.procedure.identify;
};

// i and v of the four levels.
phase_result_t levels(Phase &x, double (*i)(double), double (*v)(double))
{
    phase_result_t last = {};
    levels_enter(&x.d);
    for (const double level : {0.4, 0.32, 0.24, 0.16}) {
        x.self.ms = 1000;
        x.means({i(level), 0, v(level)});
        last = levels_slow(&x.d);
    }
    return last;
}

constexpr double kLost = 0.01; // of the levels, per unit

TEST(Commissioning, FourLevelsTellResistanceAndLostVoltage)
{
    const auto as_told = [](double i) { return i; };
    Phase x;
    EXPECT_TRUE(levels(x, as_told, [](double i) { return 0.12 * i + 4.0 / 3 * kLost; }).done);
    EXPECT_NEAR(real(x.result().R), 0.12, 1e-5);
    EXPECT_NEAR(real(x.result().lost), kLost, 1e-5);
    // A voltage that is short of R i: nothing is lost, and there is no current that moves a capacitance.
    Phase none;
    EXPECT_TRUE(levels(none, as_told, [](double i) { return 0.12 * i - 0.01 - 0.0005 / i; }).done);
    EXPECT_EQ(none.result().lost, 0);
    EXPECT_EQ(none.result().move, 0);
}

// A current that stays while the voltage falls, and a voltage that stays while the current does: no sensor of this motor.
TEST(Commissioning, LevelsThatDoNotFallAreImplausible)
{
    const auto as_told = [](double i) { return i; };
    const auto same = [](double) { return 0.2; };
    Phase current, voltage;
    EXPECT_EQ(levels(current, same, [](double i) { return 0.12 * i; }).failed, COMMISSIONING_IMPLAUSIBLE);
    EXPECT_EQ(levels(voltage, as_told, same).failed, COMMISSIONING_IMPLAUSIBLE);
    EXPECT_EQ(current.result().R, 0);
    EXPECT_EQ(voltage.result().R, 0);
}

TEST(Commissioning, ALevelThatNoVoltageReachesIsNoCurrent)
{
    Phase x;
    const pm_q_t top = pm_mul(x.d.status.v_dc, PM_Q(0.45));
    levels_enter(&x.d);
    x.self.of.resistance.U = top / 2;
    x.self.of.resistance.R_hat = PM_Q(0.5);
    phase_result_t last = {};
    int ms = 0;
    for (; ms < 350 && last.failed == COMMISSIONING_NO_REASON; ++ms) {
        x.self.ms = static_cast<uint16_t>(ms);
        x.means({0, 0, 0});
        last = levels_slow(&x.d);
        ASSERT_LE(x.self.of.resistance.U, top);
    }
    EXPECT_EQ(last.failed, COMMISSIONING_NO_CURRENT);
    EXPECT_NEAR(ms, real(top) / 2 / (0.4 * 0.5 * 0.02), 2);
}

// inductance.c: h - sqrt(h^2 + i^2), at least an eighth of the current; nothing to be had of a saliency of 5 %.
TEST(Commissioning, TheCurrentOfMostTorqueIsItsFormula)
{
    const struct {
        double L_d, L_q, psi, i_d;
    } cases[] = {
        {0.4, 0.6, 0.2, 0.5 - std::sqrt(0.25 + 0.09)},
        {0.4, 0.6, 1.0, -0.3 / 8},  // 2.5 - sqrt(2.5^2 + 0.09) is less
        {0.54, 0.6, 1.0, -0.3 / 8}, // h = 8.3, beyond the format
        {0.575, 0.6, 0.2, 0},
    };
    for (const auto &at : cases) {
        Phase x;
        x.result().L_d = bench::fixed(at.L_d, PM_Q_BITS);
        x.result().L_q = bench::fixed(at.L_q, PM_Q_BITS);
        x.result().psi_m = bench::fixed(at.psi, PM_Q_BITS);
        EXPECT_NEAR(real(commissioning_best_i_d(&x.d, PM_Q(0.3))), at.i_d, 1e-5) << at.L_d << ' ' << at.psi;
    }
}

// 2 L i of a half wave at 0.3 v_dc; four fifths of its voltage to begin with, at either end of what a half wave may last, too.
TEST(Commissioning, TheWaveAtTheTestCurrentIsForeseen)
{
    const struct {
        double L_q;
        int half;
    } cases[] = {{1e-4, 2}, {0.6, 0}, {7.0, static_cast<int>(SQUARE_LONGEST)}};
    for (const auto &at : cases) {
        Phase x;
        x.self.L_q = bench::fixed(at.L_q, PM_Q_BITS);
        inductance_enter(&x.d, true, true);
        const square_t &square = x.self.of.square;
        const double flux = 2 * at.L_q * 0.4, period = real(commissioning_period(&x.d));
        const double exact = flux / (0.3 * real(x.d.status.v_dc) * period);
        EXPECT_EQ(square.half, at.half != 0 ? at.half : static_cast<int>(exact) + 1) << at.L_q;
        EXPECT_NEAR(square.half * real(square.voltage) * period, 0.8 * flux, 0.01 * flux) << at.L_q;
    }
}

// Of a wave whose current went the wrong way, or whose voltage is all lost, there is no inductance.
TEST(Commissioning, AnInductanceThatIsNotPositiveIsImplausible)
{
    const struct {
        double change, lost;
        commissioning_reason_t reason;
    } cases[] = {{0.01, 0, COMMISSIONING_NO_REASON},
                 {0, 0, COMMISSIONING_IMPLAUSIBLE},
                 {-0.01, 0, COMMISSIONING_IMPLAUSIBLE},
                 {0.01, 1, COMMISSIONING_IMPLAUSIBLE}};
    for (const auto &at : cases) {
        Phase x;
        inductance_enter(&x.d, false, false);
        x.means({0, at.change});
        x.self.of.square.voltage = PM_Q(0.2);
        x.self.of.square.negative = 3;
        x.self.lost = bench::fixed(at.lost, PM_Q_BITS);
        EXPECT_FALSE(inductance_slow(&x.d, false, false).done) << "it has not ended";
        x.self.of.square.state = SQUARE_DONE;
        const phase_result_t last = inductance_slow(&x.d, false, false);
        EXPECT_EQ(last.failed, at.reason) << at.change << ' ' << at.lost;
        EXPECT_EQ(last.done, at.reason == COMMISSIONING_NO_REASON);
        const double L = 0.2 * real(commissioning_period(&x.d)) / 0.01;
        EXPECT_NEAR(real(x.result().L_d), last.done ? L : 0, 1e-5);
    }
}

// Up to the millisecond in which it is looked at.
TEST(Commissioning, AWaveThatHasEndedDrivesNothing)
{
    Phase x;
    inductance_enter(&x.d, false, false);
    square_t &square = x.self.of.square;
    square.state = SQUARE_MEASURES;
    square.leading = false;
    square.cycles = static_cast<uint16_t>(square.enough - 1);
    square.voltage = PM_Q(0.1);
    int driven = 0;
    for (int k = 0; k < 40; ++k) {
        square_step(&x.d, {0, 0});
        driven += x.self.v.alpha != 0 ? 1 : 0;
    }
    EXPECT_EQ(square.state, SQUARE_DONE);
    EXPECT_EQ(square.cycles, square.enough);
    EXPECT_GT(driven, 0);
    EXPECT_LE(driven, 2 * square.half) << "the rest of its last wave";
    EXPECT_EQ(x.self.v.alpha, 0);
}

struct Vector {
    const char *what;
    double L_d, e_d, e_q; // per unit of speed, of a current of 0.2
    bool follows;
};

// The rotor that stands shows what its inductance makes of the current.
const Vector kVectors[] = {
    {"along", 0.4, 0, 0.3 + 0.4 * 0.2, true},
    {"stands", 0.4, 0, 0.4 * 0.2, false},
    {"stands, with L_d beyond L_q", 0.9, 0, 0.9 * 0.2, false},
    {"beyond two thirds of a right angle", 0.4, 0.25, 0.1 + 0.6 * 0.2, false},
};

void at_speed(Phase &x, const Vector &at, double sense)
{
    constexpr double kOmega = 0.3, kCurrent = 0.2;
    x.self.L_d = bench::fixed(at.L_d, PM_Q_BITS);
    x.self.of.rotation.omega = x.self.of.rotation.omega_ref = bench::fixed(sense * kOmega, PM_Q_BITS);
    x.self.ms = 1200;
    x.d.voltage.v.q = bench::fixed(0.1, PM_WIDE_BITS);
    x.means({0.1 * kCurrent + kOmega * at.e_d, sense * kOmega * at.e_q, kCurrent, 0});
}

TEST(Commissioning, ARotorThatDoesNotFollowAtSpeedIsSaid)
{
    for (const double sense : {1.0, -1.0}) {
        for (const Vector &at : kVectors) {
            Phase full;
            at_speed(full, at, sense);
            const phase_result_t first = rotation_full(&full.d);
            EXPECT_EQ(first.done, at.follows) << at.what;
            EXPECT_EQ(first.failed, at.follows ? COMMISSIONING_NO_REASON : COMMISSIONING_NOT_TURNING)
                << at.what;
            EXPECT_NEAR(real(full.self.of.rotation.psi_full), at.follows ? 0.3 : 0, 1e-4) << at.what;
            Phase less;
            at_speed(less, at, sense);
            less.self.of.rotation.psi_full = PM_Q(0.3);
            const phase_result_t second = rotation_less(&less.d);
            EXPECT_EQ(second.failed, first.failed) << at.what;
            EXPECT_NEAR(real(less.result().psi_m), at.follows ? 0.3 : 0, 1e-4) << at.what;
        }
    }
}

// Three quarters of the flux at all of the current: one that stands shows a half.
TEST(Commissioning, AFluxThatFallsWithTheCurrentIsNoMagnets)
{
    for (const double share : {0.7, 0.8}) {
        Phase x;
        at_speed(x, kVectors[0], 1);
        x.self.of.rotation.psi_full = bench::fixed(0.3 / share, PM_Q_BITS);
        EXPECT_EQ(rotation_less(&x.d).failed,
                  share < 0.75 ? COMMISSIONING_NOT_TURNING : COMMISSIONING_NO_REASON);
    }
}

// Where no inertia is asked for it need not be there.
TEST(Commissioning, ATorqueThatIsNoLargerOnTheWayUpIsNoInertia)
{
    for (const double up : {0.3, 0.2, 0.1}) {
        for (const bool asked : {true, false}) {
            Phase x;
            x.d.commissioning_report.routines = asked ? COMMISSIONING_MECHANICS : COMMISSIONING_FLUX;
            x.self.ms = 600;
            x.self.of.rotation.omega = PM_Q(0.3);
            x.self.of.rotation.omega_ref = 0;
            x.self.of.rotation.tau_up = bench::fixed(up, PM_Q_BITS);
            x.means({0, 0, 0, 0, 0.2});
            x.self.of.rotation.count = 1;
            const phase_result_t last = rotation_down(&x.d);
            const bool found = up > 0.2 || !asked;
            EXPECT_EQ(last.done, found) << up;
            EXPECT_EQ(last.failed, found ? COMMISSIONING_NO_REASON : COMMISSIONING_NOT_TURNING) << up;
            EXPECT_EQ(x.result().J > 0, asked && up > 0.2) << up;
        }
    }
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
