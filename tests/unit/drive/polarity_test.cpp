// Lock onto the saliency and the steps that tell the pole, as the drive runs them: on the plant with switching
// inverter, dead time, converter noise and delay.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>

#include "tests/support/application.h"
#include "tests/support/plants.h"
#include "tests/unit/drive/direct.h"
#include "tests/unit/drive/start.h"

namespace
{

using bench::kDegree;
using bench::kPi;
using bench::rad;
using bench::wrapped;
using start::Start;

// METHODS-ADDENDUM.md B (b), rows 94 and 96.
constexpr double kRatioIpm = 1.15, kRatioSpm = 1.05, kSigma94 = 50;
constexpr double kSigma96 = 3.5; // 35 V, 500 Hz, after 50 ms; a step there goes on until five sigma
constexpr double kPhaseTwin = 0.15;
constexpr double kRatioAlong = 1.23, kRatioAcross = 1.077, kRatioWithin = 0.02; // D (e), row 95
constexpr int kMs94 = 150, kMs96 = 66, kMs97 = 230;
constexpr double kSecond = 0.05;       // of the formula; resistance takes 2 % of it
constexpr double kSecondTurn_deg = 30; // by 6 ohm, in flux and answer: 15 and 26 degrees
constexpr double kWithin97 = 0.2;      // of constants that were found when all had settled
constexpr double kAcross97 = 0.35;     // Z_4 left out, and at first what saturation makes of the mean current
// What the carrier and the step of a period make of a continuous current and voltage.
constexpr double kJump_A = 0.1;

plant_config_t ipm()
{
    plant_config_t c = plants::ipm_1000();
    c.inverter.c_leg_F = 0.5e-9;
    c.mech.T_coulomb_Nm = 0.02;
    c.sensor.gain_error[0] = 0.01;
    c.sensor.gain_error[2] = -0.01;
    return c;
}

plant_config_t spm()
{
    plant_config_t c = plants::spm_400();
    c.inverter.c_leg_F = 2e-9;
    c.mech.T_coulomb_Nm = 0.02;
    return c;
}

drive_params_t sine(int32_t polarity, int32_t v_mV = 35000, int32_t f_mHz = 500000)
{
    drive_params_t p = direct::params(1);
    p.position_find = 1;
    p.polarity = polarity;
    p.start_fallback = 0;
    p.injection = INJECTION_pulsating_sine;
    p.v_injection = v_mV;
    p.f_injection = f_mHz;
    p.injection_bandwidth = 7000;
    p.speed_bandwidth = 2000;
    p.leg_capacitance = 500;
    p.i_noise = 2820; // 0.5 LSB and the quantisation of 12 bits
    return p;
}

drive_params_t sine_of_spm(int32_t polarity)
{
    drive_params_t p = sine(polarity, 8000);
    direct::make_spm(p);
    return p;
}

// Also where a loop that begins at zero would stay: at 90 and 270 degrees.
TEST(Lock, FindsTheAxisFromAnywhereWithoutMovement)
{
    for (int k = 0; k < 36; ++k) {
        const double theta = 10 * k * kDegree;
        Start x(ipm(), sine(1), theta);
        const double before = x.truth().theta_e_rad;
        x.run_past(PROCEDURE_lock);
        ASSERT_EQ(drive_status(&x.drive())->refusal.reason, 0) << k;
        const double error = wrapped(2 * (theta - rad(x.drive().sequence.theta))) / 2;
        EXPECT_LE(std::abs(error), 3 * kDegree) << k;
        EXPECT_LE(std::abs(x.truth().theta_e_rad - before), 0.1 * kDegree) << k;
    }
}

TEST(Lock, RefusesAMachineWithoutSaliency)
{
    plant_config_t round = ipm();
    round.machine.c_A_Wb5 = 0;
    round.machine.L_q0_H = round.machine.L_d0_H;
    for (int k = 0; k < 8; ++k) {
        round.sensor.seed = static_cast<uint64_t>(k) + 1;
        Start x(round, sine(1), 1.0);
        x.run_past(PROCEDURE_lock);
        EXPECT_EQ(drive_status(&x.drive())->refusal.reason, PM_FAILED_SALIENCY);
    }
}

// What turns is the estimate: no over-speed of the rotor, which is at rest.
TEST(Lock, ALoopThatRunsAwayIsRefused)
{
    drive_params_t p = sine(1);
    p.start_fallback = 0;
    Start x(ipm(), p, 1.0);
    x.run([](const drive_t &d) {
        return d.sequence.procedure == PROCEDURE_lock && !lock_looks(&d.beside.lock);
    });
    x.drive().position.pll.omega = PM_Q(0.7);
    for (int k = 0; k < 20; ++k) {
        x.period();
    }
    EXPECT_EQ(drive_status(&x.drive())->refusal.procedure, PROCEDURE_lock);
    EXPECT_EQ(drive_status(&x.drive())->refusal.reason, PM_FAILED_SALIENCY);
    EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_POSITION_NOT_FOUND);
}

// 1.237 and 1.082 in double precision.
void expect_ratio(const plant_config_t &plant, const drive_params_t &p, double ratio)
{
    for (int k = 0; k < 12; ++k) {
        Start x(plant, p, (30 * k + 7) * kDegree);
        x.run_to(PROCEDURE_d_current);
        d_current_t last = {};
        const int periods = x.run([&last](const drive_t &d) {
            const bool ended = d.sequence.procedure != PROCEDURE_d_current;
            last = ended ? last : d.beside.d_current;
            return ended;
        });
        EXPECT_LE(periods, 10 * kMs94);
        const double first = last.first;
        const double h[2] = {first + polarity_mean(&last.h[0]), first + polarity_mean(&last.h[1])};
        EXPECT_GE(std::max(h[0], h[1]) / std::min(h[0], h[1]), ratio) << k;
        EXPECT_GE(x.drive().sequence.margin / 256.0, kSigma94) << k;
        EXPECT_LE(std::abs(x.error_rad()), 90 * kDegree) << k;
    }
}

TEST(DCurrent, AmplitudesDifferAsTheMachineSaturates)
{
    expect_ratio(ipm(), sine(2), kRatioIpm);
    expect_ratio(spm(), sine_of_spm(2), kRatioSpm);
}

plant_config_t with_neutral()
{
    plant_config_t c = ipm();
    c.winding.dL_0_H = 2e-3;
    c.sensor.v_zero_full_scale_V = 10;
    c.sensor.v_zero_filter_s = 100e-6;
    c.sensor.v_zero_noise_lsb = 0.5;
    return c;
}

drive_params_t rotating()
{
    drive_params_t p = sine(2);
    p.position_find = 0;
    p.injection = INJECTION_zero_rotating;
    p.dL_0 = 2000000;
    p.zero_falls = 0;
    p.neutral_full_scale = 10000;
    p.neutral_filter = 100000;
    p.injection_bandwidth = 20000;
    p.speed_bandwidth = 3000;
    return p;
}

// Greater over smaller voltage at the neutral, and whether the greater is that with the magnetising current.
double ratio_at_the_neutral(double theta_rad)
{
    Start x(with_neutral(), rotating(), theta_rad);
    x.run_to(PROCEDURE_d_current);
    d_current_t last = {};
    const int periods = x.run([&last](const drive_t &d) {
        const bool ended = d.sequence.procedure != PROCEDURE_d_current;
        last = ended ? last : d.beside.d_current;
        return ended;
    });
    EXPECT_LE(periods, 10 * kMs94);
    EXPECT_LE(std::abs(x.error_rad()), 5 * kDegree);
    const double first = last.first;
    return (first + polarity_mean(&last.h[0])) / (first + polarity_mean(&last.h[1]));
}

// 1 / L_dh shows where cos 6 theta = 1, 1 / L_qh where it is -1.
TEST(DCurrent, VoltagesAtTheNeutralDifferAsTheMachineSaturates)
{
    for (int k = 0; k < 6; ++k) {
        EXPECT_NEAR(ratio_at_the_neutral(60 * k * kDegree), kRatioAlong, kRatioWithin * kRatioAlong) << k;
        EXPECT_NEAR(ratio_at_the_neutral((60 * k + 30) * kDegree), kRatioAcross, kRatioWithin * kRatioAcross)
            << k;
    }
}

// The mean and its noise when the first number of values is there.
struct Second {
    double mean = 0, noise = 0;
    int periods = 0;
};

Second second_harmonic(const plant_config_t &plant, const drive_params_t &p, double theta_rad)
{
    Start x(plant, p, theta_rad);
    x.run_to(PROCEDURE_secondary_current);
    Second s;
    s.periods = x.run([&s](const drive_t &d) {
        const secondary_current_t *self = &d.beside.secondary_current;
        const bool there = self->x.count == d.config.polarity.values;
        if (there) {
            s.mean = polarity_mean(&self->x);
            s.noise =
                std::max(polarity_noise(&self->x), polarity_rest(d.config.polarity.noise, self->x.count));
        }
        return there || d.sequence.procedure != PROCEDURE_secondary_current;
    });
    return s;
}

// Mean of all angles: a margin in sigma has itself a sigma of one.
TEST(SecondaryCurrent, ShowsInFiftyMilliseconds)
{
    double margin = 0;
    for (int k = 0; k < 24; ++k) {
        const double theta = (15 * k + 2) * kDegree;
        const Second weak = second_harmonic(ipm(), sine(3), theta);
        const double right = k < 12 ? 1 : -1; // the frame is that of 0 to 180 degrees
        margin += right * weak.mean / weak.noise / 24;
        EXPECT_LE(weak.periods, 10 * kMs96);
    }
    EXPECT_GE(margin, kSigma96);
}

// 34 degrees at 35 V and 500 Hz.
TEST(SecondaryCurrent, TwinWithAFixedPhaseSeesLess)
{
    double right = 0, fixed_phase = 0;
    for (int k = 0; k < 12; ++k) {
        const double theta = (30 * k + 2) * kDegree;
        drive_params_t p = sine(3);
        right += std::abs(second_harmonic(ipm(), p, theta).mean);
        p.injection_post_comp = 0;
        fixed_phase += std::abs(second_harmonic(ipm(), p, theta).mean);
    }
    EXPECT_LE(fixed_phase, (1 - kPhaseTwin) * right);
}

drive_params_t second_of_rotating()
{
    drive_params_t p = rotating();
    p.polarity = 4;
    p.v_injection = 70000;
    p.f_injection = 250000;
    p.zero_second = 33120;
    p.zero_second_phase = 527000;
    p.zero_second_even = 6000;
    return p;
}

// z of the last value of the step, V, and the position: the mean current has settled.
std::complex<double> second_at_the_neutral(Start &x, const drive_params_t &p, double *theta_rad)
{
    x.run_to(PROCEDURE_secondary_voltage);
    std::complex<double> z;
    x.run([&z, &x, theta_rad](const drive_t &d) {
        const secondary_voltage_t &self = d.beside.secondary_voltage;
        if (self.count > 0 && self.x.count == 7) {
            z = std::complex<double>(self.sum.alpha, self.sum.beta) / (self.count * std::ldexp(1.0, 28));
            *theta_rad = x.truth().theta_e_rad;
        }
        return d.sequence.procedure != PROCEDURE_secondary_voltage;
    });
    const double L_d = 1e-9 * p.L_d, L_q = 1e-9 * p.L_q;
    return z * (8 * 1e-9 * p.dL_0 * 1e-3 * p.v_injection * (L_d + L_q) / 2 / (2 * L_d * L_q));
}

// Z_1 = j dL_0 F^2 omega_h / 8 (b + c), Z_5 = j dL_0 F^2 omega_h / 8 (b - 3 c), of the energy form b = 20 C psi_m^3 and
// c = 4 C psi_m^3, on an inverter without dead time, drops and capacitance. Resistance turns them, and the filter makes what
// does not change with the pole.
TEST(SecondaryVoltage, IsWhatSaturationMakesOfTheCarrier)
{
    plant_config_t plant = with_neutral();
    plant.inverter.dead_time_s = 0;
    plant.inverter.c_leg_F = 0;
    plant.inverter.v_switch_V = plant.inverter.v_diode_V = 0;
    drive_params_t p = second_of_rotating();
    p.dead_time = p.leg_capacitance = p.device_drop = 0;
    std::complex<double> z_1, z_5;
    for (int k = 0; k < 12; ++k) {
        Start x(plant, p, 30 * k * kDegree);
        double theta = 0;
        const std::complex<double> z = second_at_the_neutral(x, p, &theta);
        z_1 += z * std::polar(1.0 / 12, -theta);
        z_5 += z * std::polar(1.0 / 12, 5 * theta);
    }
    const double omega = 2 * kPi * 250, F = 70 / omega, cube = 105 * std::pow(0.236, 3);
    const double each = 2e-3 * F * F * omega / 8;
    EXPECT_NEAR(std::abs(z_1), each * 24 * cube, kSecond * each * 24 * cube);
    EXPECT_NEAR(std::abs(z_5), each * 8 * cube, kSecond * each * 8 * cube);
    EXPECT_NEAR(std::arg(z_1), kPi / 2, kSecondTurn_deg * kDegree);
    EXPECT_NEAR(std::arg(z_5), kPi / 2, kSecondTurn_deg * kDegree);
}

// It is |r| that is seen at the north, nothing across, and the same from the south.
TEST(SecondaryVoltage, ShowsThePole)
{
    for (int k = 0; k < 12; ++k) {
        for (const int told : {0, 1}) { // the pulses leave north or south
            drive_params_t p = second_of_rotating();
            p.L_d_falls = told;
            Start x(with_neutral(), p, (30 * k + 4) * kDegree);
            x.run_to(PROCEDURE_secondary_voltage);
            secondary_voltage_t last = {};
            const int periods = x.run([&last](const drive_t &d) {
                const bool ended = d.sequence.procedure != PROCEDURE_secondary_voltage;
                last = ended ? last : d.beside.secondary_voltage;
                return ended;
            });
            EXPECT_LE(periods, 10 * kMs97);
            const double sign = told == 0 ? 1 : -1;
            EXPECT_NEAR(sign * polarity_mean(&last.x) / last.r, 1, kWithin97) << k << ' ' << told;
            EXPECT_NEAR(1.0 * polarity_mean(&last.y) / last.r, 0, kAcross97) << k << ' ' << told;
            EXPECT_LE(std::abs(x.error_rad()), 5 * kDegree);
        }
    }
}

// The frame turns by half a turn and nothing else does.
TEST(Polarity, HandOverKeepsTheCurrent)
{
    for (const int32_t polarity : {2, 3}) {
        int turned = 0;
        for (const double theta : {0.4, 0.4 + kPi}) {
            Start x(ipm(), sine(polarity, 70000, 250000), theta);
            x.run([](const drive_t &d) { return d.state == DRIVE_RUNNING; });
            ASSERT_EQ(x.drive().state, DRIVE_RUNNING);
            EXPECT_EQ(x.drive().stage, STAGE_VECTOR);
            EXPECT_LE(std::abs(x.error_rad()), 5 * kDegree);
            turned += std::abs(wrapped(rad(x.drive().sequence.theta))) > kPi / 2 ? 1 : 0;
            const plant_truth_t before = x.truth();
            double most_A = 0;
            for (int k = 0; k < 400; ++k) {
                x.period();
                const plant_truth_t now = x.truth();
                most_A = std::max(most_A, std::abs(now.i_q_A - before.i_q_A));
            }
            EXPECT_LE(most_A, kJump_A) << polarity << ' ' << theta;
            EXPECT_LE(std::abs(x.error_rad()), 5 * kDegree);
        }
        EXPECT_EQ(turned, 1);
    }
}

TEST(Polarity, DualPulsesTellThePole)
{
    int turned = 0;
    for (const double theta : {0.4, 0.4 + kPi}) {
        Start x(ipm(), sine(1, 70000, 250000), theta);
        x.run_past(PROCEDURE_lock);
        const double axis = rad(x.drive().sequence.theta);
        x.run([](const drive_t &d) { return d.state == DRIVE_RUNNING; });
        ASSERT_EQ(x.drive().state, DRIVE_RUNNING);
        EXPECT_LE(std::abs(x.error_rad()), 5 * kDegree);
        turned += std::abs(wrapped(rad(x.drive().sequence.theta) - axis)) > kPi / 2 ? 1 : 0;
    }
    EXPECT_EQ(turned, 1);
}

TEST(Polarity, ALinearMachineIsRefusedByEach)
{
    const procedure_id_t steps[] = {PROCEDURE_dual_pulses, PROCEDURE_d_current, PROCEDURE_secondary_current,
                                    PROCEDURE_secondary_voltage};
    plant_config_t linear = with_neutral();
    linear.machine.c_A_Wb5 = 0;
    for (const int32_t polarity : {1, 2, 3, 4}) {
        Start x(linear, polarity == 4 ? second_of_rotating() : sine(polarity, 70000, 250000), 0.4);
        x.run([](const drive_t &d) { return d.state == DRIVE_FAULT; });
        EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_POSITION_NOT_FOUND) << polarity;
        EXPECT_EQ(drive_status(&x.drive())->refusal.procedure, steps[polarity - 1]);
        EXPECT_EQ(drive_status(&x.drive())->refusal.reason, PM_FAILED_POLARITY) << polarity;
    }
}

// A carrier that makes no current, and a frame that has turned away from its axis.
TEST(Polarity, AStepNeedsItsCarrierAndItsAxis)
{
    const procedure_id_t steps[] = {PROCEDURE_d_current, PROCEDURE_secondary_current,
                                    PROCEDURE_secondary_voltage};
    for (const int32_t polarity : {2, 3, 4}) {
        const procedure_id_t step = steps[polarity - 2];
        for (const pm_procedure_t reason : {PM_FAILED_NO_CURRENT, PM_FAILED_SALIENCY}) {
            Start x(with_neutral(), polarity == 4 ? second_of_rotating() : sine(polarity, 70000, 250000),
                    0.4);
            x.run_to(step);
            if (reason == PM_FAILED_NO_CURRENT) {
                x.drive().config.polarity.h_d *= 5;
            } else if (polarity == 2) {
                x.drive().beside.d_current.theta += PM_TURN(0.25);
            } else if (polarity == 4) {
                x.run([](const drive_t &d) { return d.beside.secondary_voltage.x.count > 0; });
                x.drive().beside.secondary_voltage.theta += PM_TURN(0.25);
            } else {
                x.run([](const drive_t &d) { return d.beside.secondary_current.x.count > 0; });
                x.drive().beside.secondary_current.theta += PM_TURN(0.25);
            }
            x.run([](const drive_t &d) { return d.state == DRIVE_FAULT; });
            EXPECT_EQ(drive_status(&x.drive())->refusal.procedure, step);
            EXPECT_EQ(drive_status(&x.drive())->refusal.reason, reason) << polarity;
        }
    }
}

// Of a carrier for which no blocks were made, and of another one, nothing is said.
TEST(Polarity, TheSecondHarmonicIsNotJudgedWithoutItsBlocks)
{
    for (const int32_t polarity : {3, 4}) {
        for (const bool other : {true, false}) {
            Start x(with_neutral(), polarity == 4 ? second_of_rotating() : sine(polarity, 70000, 250000),
                    0.4);
            x.run_to(PROCEDURE_lock);
            if (other) {
                x.drive().config.position.injection.id = INJECTION_pulsating_square;
            } else {
                x.drive().config.polarity.block_ms = 0;
            }
            const pm_procedure_t result = polarity == 4 ? procedure_secondary_voltage_slow(&x.drive())
                                                        : procedure_secondary_current_slow(&x.drive());
            EXPECT_EQ(result, PM_FAILED_POLARITY) << polarity;
        }
    }
}

// Of a linear machine twice as many values are taken each time; with the shortest of blocks up to 256, in as many milliseconds.
TEST(Polarity, NoMoreThan256ValuesAreTaken)
{
    plant_config_t linear = with_neutral();
    linear.machine.c_A_Wb5 = 0;
    Start x(linear, sine(3, 70000, 250000), 0.4);
    x.run_to(PROCEDURE_secondary_current);
    x.drive().config.polarity.block_ms = 1;
    uint32_t values = 0;
    const int periods = x.run([&values](const drive_t &d) {
        values = std::max(values, uint32_t(d.beside.secondary_current.x.count));
        return d.sequence.procedure != PROCEDURE_secondary_current;
    });
    EXPECT_EQ(values, 256U);
    EXPECT_NEAR(periods, 2560, 100);
    EXPECT_EQ(drive_status(&x.drive())->refusal.reason, PM_FAILED_POLARITY);
}

// What is left of a pulse's current, of any winding; of a pulse beyond the time constant, what a time constant leaves.
TEST(Polarity, DecayOfDualPulsesIsThatOfTheWinding)
{
    double shortest = 1, longest = 0;
    for (const int32_t R_ohm : {1, 6, 15, 24, 30, 36, 50}) {
        drive_params_t p = direct::params(1);
        p.polarity = 1;
        p.R_s = R_ohm * 1000000;
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        ASSERT_TRUE(r.ok) << drive_param_table[r.param].name << ' ' << r.reason;
        const double T_s = double(c.dual_pulses.periods) / p.f_pwm;
        const double x = std::min(1.0, T_s * R_ohm / (1e-9 * p.L_d));
        EXPECT_NEAR(std::ldexp(c.dual_pulses.decay, -31), (std::exp(-x) + std::exp(-3 * x)) / 2, 0.02) << x;
        shortest = std::min(shortest, x);
        longest = std::max(longest, x);
    }
    EXPECT_LT(shortest, 0.1);
    EXPECT_EQ(longest, 1);
}

TEST(Polarity, AParameterThatCannotBeIsRefusedByName)
{
    const auto refused = [](void (*change)(drive_params_t &)) {
        drive_params_t p = direct::params(1);
        change(p);
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_FALSE(r.ok);
        return r.param;
    };
    EXPECT_EQ(refused([](drive_params_t &p) { p.position_find = 1; }), DRIVE_PARAM_polarity);
    EXPECT_EQ(refused([](drive_params_t &p) { p.polarity = 3; }), DRIVE_PARAM_polarity);
    EXPECT_EQ(refused([](drive_params_t &p) {
                  p.polarity = 2;
                  p.injection = INJECTION_stationary_square;
              }),
              DRIVE_PARAM_polarity);
    for (const injection_id_t blind : {INJECTION_zero_anti_rotating, INJECTION_zero_pulsating}) {
        drive_params_t p = rotating();
        p.injection = blind; // no voltage at the neutral where it locks, or not at standstill
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_FALSE(r.ok);
        EXPECT_EQ(r.param, DRIVE_PARAM_polarity);
    }
    for (const bool by_current : {false, true}) { // which way the answer at the neutral goes was not found
        drive_params_t p = rotating();
        p.zero_falls = 2;
        p.polarity = by_current ? 2 : 0;
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_EQ(r.ok, !by_current);
        EXPECT_TRUE(r.ok || r.param == DRIVE_PARAM_zero_falls);
    }
    EXPECT_EQ(refused([](drive_params_t &p) {
                  p.position_find = 1;
                  p.polarity = 1;
                  p.injection = INJECTION_inform;
                  p.injection_bandwidth = 15000;
              }),
              DRIVE_PARAM_position_find);
    EXPECT_EQ(refused([](drive_params_t &p) {
                  p.polarity = 2;
                  p.i_polarity = p.i_max + 1;
              }),
              DRIVE_PARAM_i_polarity);
    EXPECT_EQ(refused([](drive_params_t &p) {
                  p.polarity = 2;
                  p.J /= 100;
              }),
              DRIVE_PARAM_i_polarity);
    EXPECT_EQ(refused([](drive_params_t &p) { // 2 us at 10 kHz of 300 V are 6 V
                  p.polarity = 3;
                  p.injection = INJECTION_pulsating_sine;
                  p.injection_bandwidth = 7000;
                  p.v_injection = 23000;
              }),
              DRIVE_PARAM_v_injection);
    EXPECT_EQ(refused([](drive_params_t &p) { // 15 periods of the PWM in one of the carrier
                  p.polarity = 3;
                  p.injection = INJECTION_pulsating_sine;
                  p.injection_bandwidth = 7000;
                  p.f_injection = 10000000 / 15;
              }),
              DRIVE_PARAM_f_injection);
    EXPECT_EQ(refused([](drive_params_t &p) {
                  p.position_find = 2;
                  p.v_injection = 200000;
              }),
              DRIVE_PARAM_v_injection);
}

// Row 97: a rotating carrier, and one that shows more of the poles than of the inverter.
TEST(Polarity, TheSecondHarmonicNeedsItsCarrier)
{
    const auto refused = [](void (*change)(drive_params_t &)) {
        drive_params_t p = second_of_rotating();
        change(p);
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_FALSE(r.ok);
        return r.param;
    };
    for (const injection_id_t other :
         {INJECTION_zero_anti_rotating, INJECTION_zero_pulsating, INJECTION_pulsating_sine}) {
        drive_params_t p = second_of_rotating();
        p.injection = other;
        p.injection_bandwidth = 7000;
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_FALSE(r.ok);
        EXPECT_EQ(r.param, DRIVE_PARAM_polarity);
    }
    EXPECT_EQ(refused([](drive_params_t &p) { p.zero_second = 0; }), DRIVE_PARAM_polarity);
    EXPECT_EQ(refused([](drive_params_t &p) {
                  p.v_injection = 35000;
                  p.f_injection = 500000;
              }),
              DRIVE_PARAM_v_injection);
}

// A start that uses none of it does not depend on it.
TEST(Polarity, AnOpenMotorIsRefusedByEach)
{
    for (const int32_t polarity : {1, 2}) {
        drive_params_t p = direct::params(1);
        p.position_find = 1;
        p.polarity = polarity;
        p.start_fallback = 0;
        direct::Drive x(p);
        x.enable(true);
        x.run_ms(400);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_POSITION_NOT_FOUND);
        EXPECT_EQ(drive_status(&x.d)->refusal.procedure, PROCEDURE_lock);
        EXPECT_EQ(drive_status(&x.d)->refusal.reason, PM_FAILED_NO_CURRENT);
    }
}

} // namespace
