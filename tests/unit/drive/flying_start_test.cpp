// Catching a rotor that turns: the pulses against the equations of a shorted machine in double precision, and the start as
// the drive runs it on the plant with switching inverter, dead time, drops, converter noise and delay.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <utility>

#include "tests/support/application.h"
#include "tests/support/plants.h"
#include "tests/unit/drive/direct.h"

namespace
{

using bench::kDegree;
using bench::kPi;
using bench::rad;
using bench::wrapped;

pm_q_t q28(double x)
{
    return static_cast<pm_q_t>(std::lround(x * PM_ONE));
}

// What is asked for: 10 degrees within 20 ms at no more than half of rated current.
constexpr double kAngle_rad = 10 * kDegree, kTime_s = 20e-3, kCurrent = 0.5;
// The formulas against the exact machine: the centre of the EMF is an approximation, and so is the saliency of a long pulse.
constexpr double kFormula_rad = 4 * kDegree, kSpeedError = 0.03;

// --- The pulses alone ----------------------------------------------------------------------------------------------

struct Machine {
    double R_ohm, L_d_H, L_q_H, psi_Wb, period_s, i_rated_A, i_full_A, drop_V;
};

struct Turning {
    Machine m;
    double omega_1_s, theta_rad;
    double i_d_A = 0, i_q_A = 0;

    // By the devices of the three legs, along d and q.
    std::pair<double, double> taken(double d_A, double q_A) const
    {
        double d_V = 0, q_V = 0;
        for (int k = 0; k < 3 && m.drop_V > 0; ++k) {
            const double g = theta_rad - 2 * kPi / 3 * k;
            const double leg_A = d_A * std::cos(g) - q_A * std::sin(g);
            const double leg_V = m.drop_V * std::clamp(leg_A / (1e-3 * m.i_full_A), -1.0, 1.0);
            d_V += 2.0 / 3 * leg_V * std::cos(g);
            q_V -= 2.0 / 3 * leg_V * std::sin(g);
        }
        return {d_V, q_V};
    }

    // Shorted, by the rotor's equations: Heun in 200 steps.
    void shorted(double t_s)
    {
        const int n = 200;
        const double dt = t_s / n;
        const auto rate = [this](double d, double q, double *d_d, double *d_q) {
            const auto [taken_d_V, taken_q_V] = taken(d, q);
            *d_d = (-taken_d_V - m.R_ohm * d + omega_1_s * m.L_q_H * q) / m.L_d_H;
            *d_q = (-taken_q_V - m.R_ohm * q - omega_1_s * (m.L_d_H * d + m.psi_Wb)) / m.L_q_H;
        };
        for (int k = 0; k < n; ++k) {
            double d0 = 0, q0 = 0, d1 = 0, q1 = 0;
            rate(i_d_A, i_q_A, &d0, &q0);
            rate(i_d_A + dt * d0, i_q_A + dt * q0, &d1, &q1);
            i_d_A += dt * (d0 + d1) / 2;
            i_q_A += dt * (q0 + q1) / 2;
            theta_rad += omega_1_s * dt;
        }
    }

    void period(uint32_t low)
    {
        const double share = low == 0U ? 0 : (low < 32U ? low / 64.0 : 1.0);
        theta_rad += omega_1_s * (1 - share) * m.period_s;
        if (share > 0) {
            shorted(share * m.period_s);
        } else {
            i_d_A = i_q_A = 0; // the link takes it back in a moment
        }
    }

    pm_abc_t seen(std::mt19937_64 &random, double noise_A) const
    {
        std::normal_distribution<double> noise(0, noise_A);
        double leg[3];
        for (int k = 0; k < 3; ++k) {
            const double g = theta_rad - 2 * kPi / 3 * k;
            leg[k] = (i_d_A * std::cos(g) - i_q_A * std::sin(g) + noise(random)) / m.i_full_A;
        }
        return {q28(leg[0]), q28(leg[1]), q28(leg[2])};
    }
};

struct Found {
    pm_procedure_t result = PM_RUNNING;
    double angle_error_rad = 0, speed_error = 0, most_A = 0, time_s = 0;
};

// In as many calls as it takes.
pm_procedure_t find(flying_start_t *self, const flying_start_config_t *c, const pm_machine_t *machine,
                    int32_t k_theta)
{
    pm_procedure_t result = PM_RUNNING;
    for (int call = 0; call < 3 && result == PM_RUNNING; ++call) {
        result = flying_start_find(self, c, machine, k_theta);
    }
    return result;
}

Found pulses(Turning x, bool fine, uint64_t seed)
{
    const double omega_base = 1.3 * std::max(std::abs(x.omega_1_s), 1.0);
    flying_start_config_t c = {};
    c.on = true;
    c.shortest = fine ? 1 : 32;
    c.longest = 32;
    while (2.0 * c.longest / 32 * x.m.period_s <= 3.2e-3) {
        c.longest = static_cast<uint16_t>(2 * c.longest);
    }
    c.span = static_cast<uint16_t>(16e-3 / x.m.period_s);
    c.pause = UINT16_MAX / 2;
    c.noise = q28(0.3e-3);
    c.i_zero = c.i_rings = q28(2e-3);
    c.i_enough = q28(0.12 * x.m.i_rated_A / x.m.i_full_A);
    c.decay = q28(x.m.R_ohm * x.m.period_s / (64 * x.m.L_q_H));
    c.drop = q28(x.m.drop_V * x.m.period_s / (64 * x.m.L_q_H) / x.m.i_full_A);
    pm_machine_t machine = {};
    machine.L_d = q28(x.m.L_d_H / x.m.L_q_H * 0.5);
    machine.L_q = q28(0.5);
    const auto k_theta = static_cast<int32_t>(16 * omega_base * x.m.period_s / (2 * kPi) * (1 << 30));

    std::mt19937_64 random(seed);
    flying_start_t self = {};
    Found f;
    uint32_t acting = 0;
    uint16_t k = 65500; // the count of periods wraps
    for (; f.result == PM_RUNNING && f.time_s < 0.1; ++k) {
        uint32_t low = 0;
        f.result = flying_start_step(&self, &c, x.seen(random, 0.3e-3 * x.m.i_full_A), k, &low);
        f.time_s += x.m.period_s;
        f.most_A = std::max(f.most_A, std::hypot(x.i_d_A, x.i_q_A));
        if (f.result == PM_RUNNING) {
            x.period(acting);
            acting = low;
        }
    }
    if (f.result == PM_DONE) {
        f.result = find(&self, &c, &machine, k_theta);
        const int since = static_cast<uint16_t>(k - 1 - self.pulse[self.count - 1].at);
        const double turned = self.omega / double(PM_ONE) * omega_base * x.m.period_s * since;
        f.angle_error_rad = wrapped(x.theta_rad - turned - rad(self.theta));
        f.speed_error = self.omega / double(PM_ONE) * omega_base / x.omega_1_s - 1;
    }
    return f;
}

Turning draw(std::mt19937_64 &random)
{
    const auto uniform = [&random](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    Turning x = {};
    x.m.period_s = 1 / (10e3 * std::pow(4, uniform(0, 1)));
    const double omega_rated = std::min(std::exp(uniform(std::log(200), std::log(6000))), 0.2 / x.m.period_s);
    const double v = 100, i = 10; // phase voltage at rated speed and rated current: all is in proportion
    const double reactance = std::exp(uniform(std::log(0.1), std::log(0.8)));
    x.m.i_rated_A = i;
    x.m.i_full_A = 2.5 * i;
    x.m.psi_Wb = uniform(0.3, 0.8) * v / omega_rated;
    x.m.L_d_H = reactance * v / i / omega_rated;
    x.m.L_q_H = uniform(0.9, 3) * x.m.L_d_H;
    x.m.R_ohm = std::exp(uniform(std::log(0.01), std::log(0.15))) * v / i;
    x.omega_1_s = uniform(0.15, 1.2) * omega_rated * (uniform(0, 1) < 0.5 ? -1 : 1);
    x.theta_rad = uniform(-kPi, kPi);
    return x;
}

TEST(FlyingStart, FindsAngleAndSpeedOfRandomMachines)
{
    std::mt19937_64 random(16);
    for (int n = 0; n < 400; ++n) {
        const Turning x = draw(random);
        for (const bool fine : {true, false}) {
            const Found f = pulses(x, fine, random());
            ASSERT_EQ(f.result, PM_DONE) << n;
            EXPECT_LE(std::abs(f.angle_error_rad), kFormula_rad) << n << ' ' << fine;
            EXPECT_LE(std::abs(f.speed_error), kSpeedError) << n << ' ' << fine;
            EXPECT_LE(f.time_s, kTime_s) << n;
            if (fine) {
                EXPECT_LE(f.most_A, 0.3 * x.m.i_rated_A) << n;
            }
        }
    }
}

// What devices drop, a tenth of the EMF here, drives more current along d than along q: given back by L_q alone, 24 of the 400 angles
// are off by more than 10 degrees, the worst by 14. Given back to a leg from six times its noise on only, 10 of six draws of 400 are,
// by up to 13; as it is now none, 9.3 degrees and a quarter of the speed at most.
TEST(FlyingStart, DropsTakeMoreAlongTheDirectAxis)
{
    std::mt19937_64 random(19);
    int found = 0;
    for (int n = 0; n < 400; ++n) {
        Turning x = draw(random);
        x.m.L_q_H = std::uniform_real_distribution<double>(2.5, 5)(random) * x.m.L_d_H;
        x.m.drop_V = 0.1 * x.m.psi_Wb * std::abs(x.omega_1_s);
        const Found f = pulses(x, false, random());
        if (f.result == PM_FAILED_NOT_TURNING) { // the smallest currents are not one and a half times i_drop
            continue;
        }
        ASSERT_EQ(f.result, PM_DONE) << n;
        ++found;
        EXPECT_LE(std::abs(f.angle_error_rad), kAngle_rad) << n;
        EXPECT_LE(std::abs(f.speed_error), 10 * kSpeedError) << n;
    }
    EXPECT_GE(found, 395);
}

// Noise is no speed, whichever way it points.
TEST(FlyingStart, ARotorAtRestIsNotTurning)
{
    std::mt19937_64 random(17);
    for (int n = 0; n < 400; ++n) {
        Turning x = draw(random);
        x.omega_1_s = 0;
        EXPECT_EQ(pulses(x, n % 2 == 0, random()).result, PM_FAILED_NOT_TURNING) << n;
    }
}

// Of a single pulse no speed is known.
TEST(FlyingStart, OnePulseIsNoSpeed)
{
    const flying_start_config_t c = {};
    const pm_machine_t machine = {0, 0, q28(0.5), q28(0.5)};
    for (const int count : {0, 1}) {
        flying_start_t self = {};
        self.length = 32;
        self.count = static_cast<decltype(self.count)>(count);
        self.pulse[0].i = {q28(0.5), 0};
        EXPECT_EQ(find(&self, &c, &machine, 1 << 28), PM_FAILED_NOT_TURNING);
    }
}

// Slower and slower: found with the right sign, or not at all.
TEST(FlyingStart, ASlowRotorIsFoundRightOrNotAtAll)
{
    std::mt19937_64 random(18);
    int found = 0;
    for (int n = 0; n < 1000; ++n) {
        Turning x = draw(random);
        x.omega_1_s *= 0.05 * (n % 10) / 10.0 + 0.002;
        const Found f = pulses(x, n % 2 == 0, random());
        if (f.result == PM_DONE) {
            ++found;
            EXPECT_LE(std::abs(f.angle_error_rad), kAngle_rad) << n;
            EXPECT_LE(std::abs(f.speed_error), 1) << n;
        } else {
            EXPECT_EQ(f.result, PM_FAILED_NOT_TURNING) << n;
        }
    }
    EXPECT_GE(found, 100);
    EXPECT_LE(found, 900);
}

// --- The drive on the plant ------------------------------------------------------------------------------------------

drive_params_t ipm_params()
{
    drive_params_t p = direct::params(1);
    p.flying_start = 1;
    p.i_noise = 2820;
    p.leg_capacitance = 500;
    return p;
}

drive_params_t spm_params()
{
    drive_params_t p = direct::params(0);
    p.flying_start = 1;
    p.i_noise = 2820;
    direct::make_spm(p);
    p.v_injection = 12000;
    return p;
}

class Catch
{
  public:
    Catch(plant_config_t plant, const drive_params_t &p, double omega_mech_1_s, uint32_t without = 0,
          drive_mode_t mode = DRIVE_MODE_TORQUE)
        : config_(plant), params_(p), plant_(plant_create(&config_, 1.0, &error_), &plant_destroy)
    {
        const drive_result_t result = sim_loop_init(&loop, plant_.get(), &params_);
        EXPECT_TRUE(result.ok) << result.param << ' ' << result.reason;
        if (without != 0U) {
            drive_config_t c = {};
            EXPECT_TRUE(drive_configure(&c, &params_, hal_channels(&loop.hal) & ~without).ok);
            drive_reconfigure(&loop.app.drive, &c);
        }
        plant_set_speed(plant_.get(), omega_mech_1_s);
        drive_command_t c = {};
        c.enable = true;
        c.mode = mode;
        drive_command(&loop.app.drive, &c);
    }

    const drive_t &drive() const
    {
        return loop.app.drive;
    }

    void period()
    {
        sim_loop_step(&loop);
        const plant_truth_t t = truth();
        most_A = std::max(most_A, std::hypot(t.i_d_A, t.i_q_A));
    }

    // From the end of the calibration until the drive runs or has chosen another way.
    double look()
    {
        const uint8_t look = PROCEDURE_flying_start;
        for (int k = 0; k < 2000 && drive().sequence.procedure != look; ++k) {
            period();
        }
        EXPECT_EQ(drive().sequence.procedure, look);
        int periods = 0;
        for (; periods < 2000 && drive().sequence.procedure == look; ++periods) {
            period();
        }
        return periods / config_.inverter.f_pwm_Hz;
    }

    void run_ms(int ms)
    {
        const int periods = static_cast<int>(ms * 1e-3 * config_.inverter.f_pwm_Hz);
        for (int k = 0; k < periods; ++k) {
            period();
            error_rad =
                std::max(error_rad, std::abs(wrapped(truth().theta_e_rad - rad(drive().status.theta))));
        }
    }

    plant_truth_t truth() const
    {
        plant_truth_t t;
        plant_truth(plant_.get(), &t);
        return t;
    }

    plant_t *plant()
    {
        return plant_.get();
    }

  private:
    plant_config_t config_;
    drive_params_t params_;
    const char *error_ = nullptr;
    std::unique_ptr<plant_t, void (*)(plant_t *)> plant_;

  public:
    sim_loop_t loop = {};
    double most_A = 0, error_rad = 0;
};

plant_config_t ipm()
{
    plant_config_t c = plants::ipm_1000();
    c.inverter.c_leg_F = 0.5e-9;
    c.sensor.gain_error[0] = 0.01;
    c.sensor.gain_error[2] = -0.01;
    return c;
}

plant_config_t spm()
{
    plant_config_t c = plants::spm_400();
    c.inverter.c_leg_F = 2e-9;
    return c;
}

void expect_caught(Catch &x, double speed)
{
    EXPECT_LE(x.look(), kTime_s) << speed;
    ASSERT_EQ(drive_status(&x.drive())->state, DRIVE_RUNNING) << speed;
    ASSERT_EQ(x.drive().stage, STAGE_VECTOR);
    x.run_ms(100);
    EXPECT_EQ(x.drive().fault, DRIVE_FAULT_NONE) << speed;
    EXPECT_LE(x.error_rad, kAngle_rad) << speed;
    EXPECT_LE(x.most_A, kCurrent * 4.0) << speed;
}

// Rated current is 4 A in both.
TEST(FlyingStart, CatchesOnThePlant)
{
    for (const uint32_t without : {0U, NEEDS_ONE_SWITCH | NEEDS_HALVES}) {
        for (const double speed : {0.15, -0.15, 0.4, -0.6, 0.9, -0.9, 1.2, -1.2}) {
            Catch i(ipm(), ipm_params(), speed * 104.72, without);
            expect_caught(i, speed);
            Catch s(spm(), spm_params(), speed * 41.888, without);
            expect_caught(s, speed);
        }
    }
}

// Twin: injection takes a rotor at rest for granted.
TEST(FlyingStart, TwinThatDoesNotLookLosesTheRotor)
{
    drive_params_t p = ipm_params();
    p.flying_start = 0;
    Catch x(ipm(), p, 0.6 * 104.72);
    x.run_ms(200);
    EXPECT_TRUE(x.drive().fault != DRIVE_FAULT_NONE || x.error_rad > 60 * kDegree);
}

TEST(FlyingStart, ARotorAtRestOrNearlyStartsAsEver)
{
    for (const double speed : {0.0, 0.003, -0.003}) {
        Catch x(ipm(), ipm_params(), speed * 104.72);
        x.look();
        EXPECT_EQ(x.drive().sequence.procedure == PROCEDURE_initial_pulses || x.drive().sequence.begins,
                  true);
        EXPECT_EQ(drive_status(&x.drive())->refusal.reason, 0);
        x.run_ms(50);
        EXPECT_EQ(x.drive().sequence.procedure, PROCEDURE_NONE);
        EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_NONE);
    }
}

// The command is zero: the rotor is braked, and the drive holds it there.
TEST(FlyingStart, BrakesToAStandstill)
{
    for (const double speed : {1.2, -0.6}) {
        Catch x(ipm(), ipm_params(), speed * 104.72, 0, DRIVE_MODE_SPEED);
        x.look();
        ASSERT_EQ(drive_status(&x.drive())->state, DRIVE_RUNNING) << speed;
        plant_free_speed(x.plant());
        x.run_ms(1500);
        EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_NONE) << speed;
        EXPECT_LE(std::abs(x.truth().omega_mech_rad_s), 0.01 * 104.72) << speed;
        EXPECT_LE(x.error_rad, kAngle_rad) << speed;
    }
}

// A vector that takes over at low speed knows of R what the drive was told: there was no align.
TEST(FlyingStart, AnImposedVectorBehindItKnowsR)
{
    drive_params_t p = spm_params();
    p.L_d = p.L_q;
    p.L_dh_rated = p.L_qh_rated;
    Catch x(spm(), p, 0.8 * 41.888, 0, DRIVE_MODE_SPEED);
    x.look();
    ASSERT_EQ(x.drive().stage, STAGE_VECTOR);
    EXPECT_EQ(x.drive().follow.R, x.drive().config.machine.R_s);
    EXPECT_EQ(x.drive().follow.R_doubt, x.drive().config.machine.R_s / 4);
    plant_free_speed(x.plant());
    x.run_ms(3000);
    EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_NONE);
    EXPECT_EQ(x.drive().stage, STAGE_OPEN_LOOP);
    EXPECT_LE(std::abs(x.truth().omega_mech_rad_s), 0.01 * 41.888);
}

// The current along d is there at once, as far as its flux is small beside that of the magnets.
TEST(FlyingStart, TheCurrentOfALightLoadFlowsAtOnce)
{
    for (const int32_t part : {2, 40}) {
        drive_params_t p = spm_params();
        p.i_d_light = p.i_rated / 10 * part / 40;
        Catch x(spm(), p, 0.8 * 41.888);
        x.look();
        const drive_config_t &c = x.drive().config;
        const double most = bench::real(c.machine.psi_m) / 16 / bench::real(c.machine.L_q);
        const double light = bench::real(c.i_d_light);
        EXPECT_NEAR(bench::real(x.drive().i_open), std::max(light - most, 0.0), 1e-4) << part;
    }
}

// An EMF beyond 95 % of the link's is weakened at once.
TEST(FlyingStart, AnEmfAtTheEndOfTheLinkIsWeakened)
{
    for (const double speed : {1.1, 1.3}) {
        Catch x(spm(), spm_params(), speed * 41.888);
        x.look();
        ASSERT_EQ(drive_status(&x.drive())->state, DRIVE_RUNNING) << speed;
        const drive_config_t &c = x.drive().config;
        const double emf = std::abs(bench::real(x.drive().sequence.omega)) * bench::real(c.machine.psi_m);
        const double top = 0.95 * bench::real(x.drive().status.v_dc) * c.v_share / 2147483648.0;
        EXPECT_EQ(x.drive().field_weakening.i_d<0, emf> top) << speed;
        EXPECT_EQ(speed > 1.2, emf > top) << speed;
    }
}

// Where neither source sees it, a vector along its d-axis goes on with it.
TEST(FlyingStart, ASlowRotorWithoutInjectionIsHeldByAVector)
{
    for (const double speed : {0.06, -0.06}) {
        drive_params_t p = spm_params();
        p.L_d = p.L_q; // as told: nothing to inject for
        p.L_dh_rated = p.L_qh_rated;
        Catch x(spm(), p, speed * 41.888);
        x.look();
        ASSERT_EQ(drive_status(&x.drive())->state, DRIVE_RUNNING) << speed;
        ASSERT_EQ(x.drive().stage, STAGE_OPEN_LOOP) << speed;
        EXPECT_LE(std::abs(wrapped(x.truth().theta_e_rad - rad(x.drive().theta_open))), kAngle_rad) << speed;
        EXPECT_GT(speed * x.drive().omega_open, 0) << speed;
    }
}

// --- The drive without a motor ---------------------------------------------------------------------------------------

direct::Drive calibrated(uint32_t channels, drive_mode_t mode)
{
    direct::Drive x(ipm_params());
    const drive_params_t p = ipm_params();
    drive_init(&x.d, &p, channels);
    x.command.current_mA = 1000;
    x.enable(true, mode);
    for (int ms = 0; ms < 120 && x.d.sequence.procedure <= PROCEDURE_calibrate; ++ms) {
        x.run_ms(1);
    }
    return x;
}

TEST(FlyingStart, ComesFirstButWhereACurrentIsCommanded)
{
    const uint32_t board = PM_CHANNELS | PM_BOOTSTRAP;
    EXPECT_EQ(calibrated(board, DRIVE_MODE_SPEED).d.sequence.procedure, PROCEDURE_flying_start);
    EXPECT_EQ(calibrated(board, DRIVE_MODE_TORQUE).d.sequence.procedure, PROCEDURE_flying_start);
    EXPECT_EQ(calibrated(board, DRIVE_MODE_CURRENT).d.sequence.procedure, PROCEDURE_charge);
    EXPECT_EQ(calibrated(board, DRIVE_MODE_IDENTIFY).d.sequence.procedure, PROCEDURE_charge);
}

// The diodes conduct: the EMF is above the link.
TEST(FlyingStart, ClosesNoSwitchWhileACurrentFlows)
{
    direct::Drive x = calibrated(PM_CHANNELS, DRIVE_MODE_SPEED);
    x.in.i_leg[0] = direct::current_code(0.05);
    x.in.i_leg[1] = direct::current_code(-0.05);
    for (int k = 0; k < 6000; ++k) {
        x.run_ms(1);
        ASSERT_FALSE(x.driven()) << k;
        ASSERT_EQ(x.fault(), DRIVE_FAULT_NONE) << k;
    }
    x.run_ms(1000);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_POSITION_NOT_FOUND);
    EXPECT_EQ(drive_fault_record(&x.d)->refusal.reason, PM_FAILED_TIMEOUT);
}

flying_start_config_t with_a_pause(uint16_t pause)
{
    flying_start_config_t c = {};
    c.longest = c.shortest = 32;
    c.span = 160;
    c.pause = pause;
    c.i_zero = c.i_rings = q28(2e-3);
    c.i_enough = q28(0.05);
    return c;
}

// The period of the first pulse, of 1000 in which the diodes conduct each 17th, and 100 without a current; -1: none.
int first_pulse(uint16_t more)
{
    const flying_start_config_t c = with_a_pause(17);
    flying_start_t self = {};
    self.more = more;
    for (int k = 0; k < 1100; ++k) {
        const pm_q_t i = k < 1000 && k % 17 == 0 ? q28(0.05) : 0;
        uint32_t low = 0;
        flying_start_step(&self, &c, {i, -i, 0}, static_cast<uint16_t>(k), &low);
        if (low != 0U) {
            return k;
        }
    }
    return -1;
}

// No calibration has waited for the diodes: the pauses of their current, shorter than a sixth of a turn, are no end. Twin: two samples.
TEST(FlyingStart, PausesOfTheDiodesAreNoEnd)
{
    EXPECT_EQ(first_pulse(17), 986 + 19); // 986 was the last
    EXPECT_LT(first_pulse(0), 17);
}

// Of a look whose first current lasts as long, in 45 periods.
int pulses_kept(int lasts, uint16_t pause)
{
    const flying_start_config_t c = with_a_pause(pause);
    flying_start_t self = {};
    for (int k = 0, since = 1000; k < 45; ++k, ++since) {
        const pm_q_t i = since >= 2 && since < lasts ? q28(0.05) : 0;
        uint32_t low = 0;
        EXPECT_EQ(flying_start_step(&self, &c, {i, -i, 0}, static_cast<uint16_t>(k), &low), PM_RUNNING);
        since = low != 0U ? 0 : since;
    }
    return self.count;
}

// The second pulse must come within half a turn: a current that takes longer to end is that of an EMF near the link. Twin: any time
// is short enough.
TEST(FlyingStart, BeginsAgainWhereTheFirstCurrentDoesNotEnd)
{
    EXPECT_EQ(pulses_kept(10, 17), 4);
    EXPECT_EQ(pulses_kept(30, 17), 0);
    EXPECT_EQ(pulses_kept(30, UINT16_MAX / 2), 2);
}

// The upper switches' supply has been charged when the rotor is caught, though nothing was on for 2 ms.
TEST(FlyingStart, ChargesTheUpperSwitchesInPulses)
{
    std::mt19937_64 random(19);
    flying_start_config_t c = {};
    c.longest = c.shortest = 32;
    c.span = 160;
    c.pause = UINT16_MAX / 2;
    c.charge = 20 * 32;
    c.noise = q28(0.3e-3);
    c.i_zero = c.i_rings = q28(2e-3);
    c.i_enough = q28(0.05);
    Turning x = draw(random);
    x.omega_1_s = 500;
    x.m.period_s = 1e-4;
    flying_start_t self = {};
    pm_procedure_t result = PM_RUNNING;
    uint32_t acting = 0;
    int driven = 0, row = 0;
    for (uint16_t k = 0; k < 1000 && result == PM_RUNNING; ++k) {
        uint32_t low = 0;
        result = flying_start_step(&self, &c, x.seen(random, 0), k, &low);
        driven += low == 32U ? 1 : 0;
        row = low == 32U ? row + 1 : 0;
        ASSERT_LE(row, 1);
        x.period(acting);
        acting = low;
    }
    EXPECT_EQ(result, PM_DONE);
    EXPECT_EQ(driven, 20);
}

// Devices take from each leg's current towards zero; one that they take wholly is what is left of the error: 3.5 degrees, without
// what is given back 5.2 and more.
TEST(FlyingStart, WhatTheDevicesTookIsGivenBack)
{
    const double drop = 0.02;
    flying_start_config_t c = {};
    c.noise = q28(0.3e-3);
    c.drop = q28(drop / 64); // of a whole period
    c.decay = 1;
    pm_machine_t machine = {};
    machine.L_d = machine.L_q = q28(0.5);
    for (double at = 5; at < 360; at += 15) {
        flying_start_t self = {};
        self.length = 32;
        self.count = 2;
        for (int n = 0; n < 2; ++n) {
            const double angle = (at + 20 * n) * kDegree;
            double leg[3];
            for (int k = 0; k < 3; ++k) {
                const double i = 0.1 * std::cos(angle - 2 * kPi / 3 * k);
                leg[k] = std::abs(i) < drop ? 0 : i - std::copysign(drop, i);
            }
            const double sum = (leg[0] + leg[1] + leg[2]) / 3; // the star has none
            self.pulse[n] = {pm_clarke({q28(leg[0] - sum), q28(leg[1] - sum), q28(leg[2] - sum)}),
                             static_cast<uint16_t>(10 * n)};
        }
        ASSERT_EQ(find(&self, &c, &machine, INT32_C(1) << 30), PM_DONE);
        const double theta = rad(self.theta) - 90 * kDegree;
        EXPECT_LE(std::abs(wrapped(theta - (at + 20) * kDegree)), 4.5 * kDegree) << at;
    }
}

} // namespace
