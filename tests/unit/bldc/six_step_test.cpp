// Block commutation in closed loop on the switching plant, with 2 us of dead time, 12 bits and noise (METHODS.md 0.3).
// Bounds are those of METHODS-ADDENDUM.md B (c), in electrical degrees; each has its twin.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/bldc/rig.h"

namespace
{

using namespace bldc_rig;

constexpr double kRms = 0.3, kMost = 0.6;         // rows 110 and 111
constexpr double kRatioRms = 0.5;                 // two periods in a sector or more
constexpr double kRatioRmsLess = 2;               // 1.75
constexpr double kFormula = 0.15;                 // row 112
constexpr double kLearntRms = 0.2, kLearnt = 0.5; // rows 114 and 115

// Lines of 6 to 20 A at the speeds of the tables.
double u_of(double rpm)
{
    return rpm <= 10e3 ? 0.25 : rpm <= 20e3 ? 0.33 : rpm <= 40e3 ? 0.5 : 0.85;
}

Machine unlike(Machine m, double dL, double eps)
{
    m.plant.winding.dL_H[0] = dL * m.plant.machine.L_d0_H;
    m.plant.winding.dL_H[1] = -m.plant.winding.dL_H[0];
    m.plant.sensor.divider_error[0] = eps;
    m.plant.sensor.divider_error[1] = -eps;
    return m;
}

void expect_locked(const Rig &r, double rms, double most)
{
    EXPECT_FALSE(r.six_step.lost);
    ASSERT_GT(r.commutations.n, 50);
    EXPECT_LE(r.commutations.rms(), rms);
    EXPECT_LE(r.commutations.most, most);
}

TEST(SixStep, CommutatesBldcHsFrom10To80Krpm)
{
    for (const bool reverse : {false, true}) {
        for (const double rpm : {10e3, 20e3, 40e3, 80e3}) {
            Options o;
            o.reverse = reverse;
            Rig r(hs(), o, electrical(hs(), rpm));
            r.measure(30, 40, u_of(rpm));
            SCOPED_TRACE(rpm);
            expect_locked(r, kRms, kMost);
        }
    }
}

// On time of 0.07 periods: a dead time of 2 us leaves nothing of it.
TEST(SixStep, CommutatesBldcHsAt2Krpm)
{
    Machine m = hs();
    m.plant.inverter.dead_time_s = 0.3e-6;
    Options o;
    o.least_s = 1.2e-6;
    Rig r(m, o, electrical(m, 2e3));
    r.measure(10, 20, 0.08);
    EXPECT_FALSE(r.six_step.lost);
    EXPECT_LE(r.commutations.rms(), 1.5);
}

// Row 110. Instants of the first samples past the crossing instead of its own.
TEST(SixStep, TwinWithoutInterpolationIsLate)
{
    Rig r(hs(), {}, electrical(hs(), 40e3));
    r.measure(30, 40, u_of(40e3));
    EXPECT_GE(r.first_past.rms(), 3);
    EXPECT_LE(r.first_past.most, 6.5);
}

TEST(SixStep, CommutatesBldcFanFrom600To3000Rpm)
{
    for (const bool reverse : {false, true}) {
        for (const double rpm : {600.0, 1500.0, 3000.0}) {
            Options o;
            o.reverse = reverse;
            const double omega = electrical(fan(), rpm);
            Rig r(fan(), o, omega);
            r.measure(20, 25, std::min(0.95, duty(fan(), omega, 3) + 0.08)); // 0.08: dead time
            SCOPED_TRACE(rpm);
            expect_locked(r, kRms, kMost);
        }
    }
}

// Terminals with the capacitance of their legs, which ring with the windings.
TEST(SixStep, CommutatesWithCapacitanceOfTheLegs)
{
    for (const double rpm : {40e3, 80e3}) {
        Rig r(with_capacitance(hs(), 2e-9, 3), {}, electrical(hs(), rpm));
        r.measure(30, 40, u_of(rpm));
        SCOPED_TRACE(rpm);
        expect_locked(r, kRms, kMost);
    }
    for (const double rpm : {1500.0, 3000.0}) {
        const double omega = electrical(fan(), rpm);
        Rig r(with_capacitance(fan(), 2e-9, 1), {}, omega);
        r.measure(20, 25, std::min(0.95, duty(fan(), omega, 3) + 0.08));
        SCOPED_TRACE(rpm);
        expect_locked(r, kRms, kMost);
    }
}

// Row 110, ratio test: from 5 to 1.5 periods of the carrier in a sector, near ratios of small numbers and between them.
TEST(SixStep, TheCarrierDoesNotLockTheCommutation)
{
    double twin = 0;
    for (const double f_pwm_Hz : {40e3, 32e3, 20e3, 17e3, 16e3, 14e3, 12e3}) {
        for (const double rpm : {78e3, 79.3e3, 80e3, 81.7e3, 83e3}) {
            Machine m = hs();
            m.plant.inverter.f_pwm_Hz = f_pwm_Hz;
            m.plant.inverter.timer_counts = static_cast<uint32_t>(85e6 / f_pwm_Hz);
            const double ratio = f_pwm_Hz / (electrical(m, rpm) / 2 / kPi * 6);
            Rig r(m, {}, electrical(m, rpm));
            r.measure(60, 50, 0.85);
            SCOPED_TRACE(ratio);
            EXPECT_FALSE(r.six_step.lost);
            EXPECT_NEAR(r.commutations.n, 300, 2); // no beat: one commutation in each sector of the rotor
            EXPECT_LE(r.commutations.rms(), ratio >= 1.95 ? kRatioRms : kRatioRmsLess);
            twin = std::max(twin, r.first_past.rms());
        }
    }
    EXPECT_GE(twin, 10);
}

// Two periods in a sector, by a machine wound for that speed.
TEST(SixStep, TwoHundredThousandElectricalRpmAt40kHz)
{
    for (const bool reverse : {false, true}) {
        for (const double rpm : {195e3, 200e3, 203e3}) {
            Machine m = hs();
            m.plant.machine.psi_m_Wb /= 2.5;
            m.plant.machine.L_d0_H /= 2.5;
            m.plant.machine.L_q0_H /= 2.5;
            Options o;
            o.reverse = reverse;
            Rig r(m, o, electrical(m, rpm));
            r.measure(100, 100, 0.85);
            SCOPED_TRACE(rpm);
            expect_locked(r, kRatioRms, 3 * kRatioRms);
        }
    }
}

// Each of the five carries the machine; ideal EMF, so the crossings are those of the rotor.
TEST(SixStep, FivePatternsAtBothFreewheelings)
{
    for (int id = 0; id < PATTERN_COUNT; ++id) {
        for (const bool complementary : {false, true}) {
            Options o;
            o.pattern = static_cast<pattern_id_t>(id);
            o.complementary = complementary;
            Rig r(hs(), o, electrical(hs(), 40e3));
            r.measure(30, 40, u_of(40e3));
            SCOPED_TRACE(id);
            expect_locked(r, kRms, kMost);
            EXPECT_LE(r.crossings.rms(), 0.3);
        }
    }
}

TEST(SixStep, ThreeReferences)
{
    for (const zero_reference_t reference : {ZERO_LINK, ZERO_TERMINALS, ZERO_NEUTRAL}) {
        Options o;
        o.reference = reference;
        Rig r(hs(), o, electrical(hs(), 40e3));
        r.measure(30, 40, u_of(40e3));
        Rig t(fan(), o, electrical(fan(), 1500));
        t.measure(20, 25, 0.55);
        SCOPED_TRACE(reference);
        expect_locked(r, kRms, kMost);
        expect_locked(t, kRms, kMost);
    }
}

// Twin: the negative rail as reference of the on time.
TEST(SixStep, TwinWrongReferenceIsLost)
{
    Rig r(hs(), {}, electrical(hs(), 40e3));
    r.wrong_reference_V = 12;
    r.measure(20, 10, u_of(40e3));
    EXPECT_TRUE(r.six_step.lost);
}

TEST(SixStep, AdvanceMovesTheCommutation)
{
    for (const double advance_deg : {-5.0, 10.0, 20.0}) {
        Options o;
        o.advance_deg = advance_deg;
        Rig r(hs(), o, electrical(hs(), 40e3));
        r.measure(30, 40, u_of(40e3));
        SCOPED_TRACE(advance_deg);
        expect_locked(r, kRms, kMost); // against 90 degrees less the advance
    }
}

// Row 112: delta = dv / (2 K), dv = (L_H - L_L) (v_dc - line EMF - 2 R i) / (2 L), K = 1.5 E_m. Phase C sees most of it.
TEST(SixStep, HorizontalDeviationIsThatOfTheFormula)
{
    const struct {
        double rpm, table_deg;
    } list[] = {{20e3, -14}, {40e3, -5.3}, {80e3, -1.1}};
    for (const auto &x : list) {
        const Machine m = unlike(hs(), 0.1, 0);
        const double omega = electrical(m, x.rpm), E_m = omega * m.peak_Vs();
        Rig r(m, {}, omega);
        r.measure(40, 40, u_of(x.rpm));
        EXPECT_FALSE(r.six_step.lost);
        const double two_R_i = 2 * m.plant.machine.R_s_ohm * r.conducted_A();
        const double formula = -0.2 * (24 - std::sqrt(3.0) * E_m - two_R_i) / 2 / (2 * 1.5 * E_m) / kDegree;
        for (const uint32_t sector : {0U, 3U}) {
            EXPECT_NEAR(r.of_sector[sector].mean(), formula, kFormula * std::abs(formula)) << x.rpm;
            EXPECT_NEAR(r.of_sector[sector].mean(), x.table_deg, kFormula * std::abs(x.table_deg)) << x.rpm;
        }
    }
}

TEST(SixStep, TwinLikePhasesHaveNoDeviation)
{
    Rig r(hs(), {}, electrical(hs(), 40e3));
    r.measure(40, 40, u_of(40e3));
    for (const Statistics &s : r.of_sector) {
        EXPECT_LE(std::abs(s.mean()), 0.1);
    }
}

// Row 113: delta = eps v_dc / (2 K): 0.87 degrees at 40 krpm, inversely with the speed.
TEST(SixStep, VerticalDeviationIsThatOfTheFormula)
{
    for (const double rpm : {20e3, 40e3, 80e3}) {
        Rig r(unlike(hs(), 0, 0.01), {}, electrical(hs(), rpm));
        r.measure(40, 40, u_of(rpm));
        const double expected = 0.875 * 40e3 / rpm, bound = 0.05 * std::max(1.0, 40e3 / rpm);
        // A is told too high: its upward crossing, sector 2, is early, its downward one, 5, late; B the other way round.
        EXPECT_NEAR(r.of_sector[2].mean(), -expected, bound) << rpm;
        EXPECT_NEAR(r.of_sector[5].mean(), expected, bound) << rpm;
        EXPECT_NEAR(r.of_sector[4].mean(), expected, bound) << rpm;
        EXPECT_NEAR(r.of_sector[1].mean(), -expected, bound) << rpm;
        EXPECT_NEAR(r.of_sector[0].mean(), 0, 0.1) << rpm;
    }
}

Rig learnt(const Machine &m, double omega, double u, double k_V, double k_H, bool reverse = false)
{
    Options o;
    o.k_V = k_V;
    o.k_H = k_H;
    o.reverse = reverse;
    Rig r(m, o, omega);
    r.measure(200, 40, u);
    return r;
}

TEST(SixStep, ThresholdsTakeBothDeviationsOffWithin200Turns)
{
    for (const bool reverse : {false, true}) {
        for (const double rpm : {20e3, 40e3, 80e3}) {
            const Machine m = unlike(hs(), 0.1, 0.01);
            SCOPED_TRACE(rpm);
            expect_locked(learnt(m, electrical(m, rpm), u_of(rpm), 0.05, 0.05, reverse), kLearntRms, kLearnt);
        }
        const Machine m = unlike(fan(), 0.1, 0.01);
        expect_locked(learnt(m, electrical(m, 1500), 0.55, 0.05, 0.05, reverse), kLearntRms, kLearnt);
    }
}

TEST(SixStep, TwinThresholdsOffOrOneKindOnly)
{
    const Machine m = unlike(hs(), 0.1, 0.01);
    const double omega = electrical(m, 40e3), u = u_of(40e3);
    EXPECT_GE(learnt(m, omega, u, 0, 0).commutations.most, 5);
    EXPECT_GE(learnt(m, omega, u, 0.05, 0).commutations.most, 4);
    const Rig horizontal = learnt(m, omega, u, 0, 0.05);
    double lowest = 1e9, highest = -1e9;
    for (const Statistics &s : horizontal.of_sector) {
        lowest = std::min(lowest, s.mean());
        highest = std::max(highest, s.mean());
    }
    EXPECT_NEAR(highest - lowest, 1.7, 0.2);
}

// What was learnt at one speed, at another.
TEST(SixStep, ThresholdsFollowAStepOfTheSpeed)
{
    const Machine m = unlike(hs(), 0.1, 0.01);
    for (const double step : {0.8, 1.2}) {
        Rig r = learnt(m, electrical(m, 50e3), 0.6, 0.05, 0.05);
        r.impose(electrical(m, 50e3 * step));
        r.measure(6, 10, 0.6 * step);
        EXPECT_FALSE(r.six_step.lost);
        for (const Statistics &s : r.of_sector) {
            EXPECT_LE(std::abs(s.mean()), 1);
        }
    }
}

// METHODS.md 10.4.4 with METHODS-ADDENDUM.md E11.
TEST(SixStep, ThresholdsRaiseTorquePerAmpere)
{
    const Machine m = unlike(hs(), 0.1, 0.01);
    const double omega = electrical(m, 20e3), u = u_of(20e3);
    Rig with = learnt(m, omega, u, 0.05, 0.05), without = learnt(m, omega, u, 0, 0);
    const double gain = with.torque_per_ampere() / without.torque_per_ampere();
    EXPECT_GE(gain, 1);
    EXPECT_LE(gain, 1.1);
}

// Demagnetisation beyond 30 degrees: each crossing is behind it, and found by the late rule (10.2.3).
TEST(SixStep, SurvivesFreewheelingBeyondTheCrossing)
{
    const double omega = electrical(hs(), 40e3), R = hs().plant.machine.R_s_ohm,
                 L = hs().plant.machine.L_d0_H;
    Rig r(hs(), {}, omega);
    r.measure(60, 40, 0.9);
    const double x_V = 0.9 * 24 + 1.5 * hs().peak_Vs() * omega; // of 10.5.1.1, the faster of the two decays
    EXPECT_GT(omega * L / R * std::log1p(3 * R * r.conducted_A() / x_V), 30 * kDegree);
    expect_locked(r, kRms, kMost);
    // Twin: none is believed.
    Rig twin(hs(), {}, omega);
    twin.config.crossing.swing = 1000;
    twin.measure(60, 40, 0.9);
    EXPECT_TRUE(twin.six_step.lost);
}

// Free rotor, its load stepped from a half to one and a half times and back.
TEST(SixStep, LoadStepsKeepSynchronism)
{
    for (const bool reverse : {false, true}) {
        Machine m = with_capacitance(fan(), 2e-9, 1);
        m.plant.mech.load_Nms2 = 0;
        Options o;
        o.reverse = reverse;
        const double omega = electrical(m, 1500), way = reverse ? -1 : 1;
        Rig r(m, o, omega);
        r.run_for(20e-3, 0.6);
        plant_set_load(r.plant(), way * 0.07);
        r.release();
        r.run_for(0.3, 0.6);
        r.clear();
        for (const double load : {0.2, 0.07, 0.2, 0.0, 0.14}) {
            plant_set_load(r.plant(), way * load);
            r.run_for(0.15, 0.6);
        }
        EXPECT_FALSE(r.six_step.lost);
        EXPECT_GT(r.omega_e(), 200);
        EXPECT_LE(r.commutations.most, 15);
        r.measure(0, 20, 0.6);
        EXPECT_LE(r.commutations.rms(), 1);
    }
}

// Throttle from 15 to 95 % within 50 ms and back, with the impeller.
TEST(SixStep, FastThrottleKeepsSynchronism)
{
    Options o;
    Rig r(hs(), o, electrical(hs(), 15e3));
    r.run_for(10e-3, 0.3);
    r.release();
    for (int n = 0; n < 3; ++n) {
        for (double u = 0.3; u < 0.95; u += 0.65 / 25) {
            r.run_for(2e-3, u);
        }
        r.run_for(50e-3, 0.95);
        EXPECT_GT(r.omega_e(), electrical(hs(), 50e3));
        for (double u = 0.95; u > 0.3; u -= 0.65 / 25) {
            r.run_for(2e-3, u);
        }
        r.run_for(150e-3, 0.3);
        EXPECT_FALSE(r.six_step.lost) << n;
        EXPECT_LT(r.omega_e(), electrical(hs(), 50e3));
    }
}

// The same between 30 and 98 % with a limit of 30 A for driving and braking, while thresholds are learnt.
TEST(SixStep, ThrottleWithinACurrentLimitIsFollowedWithinADegree)
{
    for (const bool complementary : {false, true}) {
        Options o;
        o.complementary = complementary;
        o.k_V = o.k_H = 0.02;
        Rig r(hs(), o, electrical(hs(), 15e3));
        const auto run = [&r](double time_s, double from, double to) {
            for (double t_s = 0; t_s < time_s; t_s += 25e-6) {
                const double back = duty(r.machine, r.omega_e(), 0), limit = 2 * 0.025 * 30.0 / 24;
                const double u = from + (to - from) * t_s / time_s;
                r.period(std::min(
                    0.98, std::max(back - limit, std::min(u, back + limit + 0.08)))); // 0.08: dead time
            }
        };
        run(5e-3, 0.3, 0.3);
        r.release();
        run(20e-3, 0.3, 0.3);
        r.clear();
        for (int n = 0; n < 2; ++n) {
            run(50e-3, 0.3, 0.98);
            run(30e-3, 0.98, 0.98);
            run(50e-3, 0.98, 0.3);
            run(100e-3, 0.3, 0.3);
        }
        EXPECT_FALSE(r.six_step.lost);
        EXPECT_LE(r.commutations.most, 1);
    }
}

// A rotor that stops at once, or is another 180 degrees on: all legs off within a few sectors.
TEST(SixStep, LostSynchronismOpensTheBridge)
{
    Rig r(hs(), {}, electrical(hs(), 40e3));
    r.run_for(10e-3, u_of(40e3));
    EXPECT_FALSE(r.six_step.lost);
    r.impose(1);
    r.run_for(10e-3, 0.05);
    EXPECT_TRUE(r.six_step.lost);
    for (const double i_A : r.truth().i_A) {
        EXPECT_LT(std::abs(i_A), 0.5);
    }
}

// From any angle, in both directions, told up to 20 degrees and 10 % of the speed wrong.
TEST(SixStep, LocksOnFromAWrongStart)
{
    for (int n = 0; n < 24; ++n) {
        Options o;
        o.reverse = n % 2 == 1;
        const double off_deg = 20.0 * (n / 2 % 3 - 1), off_speed = n / 6 % 2 == 0 ? 0.9 : 1.1;
        Rig r(hs(), o, electrical(hs(), 40e3), off_deg, off_speed, (7 + 15 * n) * kDegree);
        r.measure(10, 20, u_of(40e3));
        SCOPED_TRACE(n);
        expect_locked(r, kRms, kMost);
    }
}

// What it is told is where it commutates: without any crossing yet.
TEST(SixStep, FirstCommutationFollowsFromTheAngleToldAtTheStart)
{
    for (int n = 0; n < 24; ++n) {
        const double theta_deg = 15 * n + 4;
        const six_step_config_t config = make(hs(), {});
        six_step_t s = {};
        six_step_reset(&s, &config, static_cast<pm_angle_t>(std::llround(std::ldexp(theta_deg / 360, 32))),
                       PM_ONE, 1000000U);
        const double t_60 = config.commutation.turn_base / 6.0;
        const double due_deg =
            (static_cast<double>(commutation_due(&s.commutation, &config.commutation)) - 1e6) / t_60 * 60;
        const double commutation_deg = 90 + 60 * s.commutation.sector; // out of it
        EXPECT_NEAR(std::remainder(theta_deg + due_deg - commutation_deg, 360), 0, 0.01) << n;
        EXPECT_LT(std::abs(due_deg), 30.1) << n; // the crossing was less than 60 degrees ago
    }
}

} // namespace
