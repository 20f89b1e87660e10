// Where the crossings of block commutation are seen in time: the predicted current (freewheeling.h) against closed loops on the
// plant, the rotor at an imposed speed and the current raised (METHODS.md 10.5.2, 10.6).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "bldc/freewheeling.h"
#include "tests/unit/bldc/rig.h"

namespace
{

using namespace bldc_rig;

constexpr double kCurrent = 0.1;    // row 117
constexpr double kDeviation = 0.15; // as rows 112 and 113
constexpr double kBase_A = 40;

// A source that takes any current, sensors of 200 A.
Machine strong(Machine m)
{
    m.plant.inverter.dead_time_s = 0.3e-6;
    m.plant.sensor.i_full_scale_A = 200;
    m.plant.dclink.r_source_ohm = 0;
    m.plant.dclink.c_F = 0;
    return m;
}

Options options(pattern_id_t pattern)
{
    Options o;
    o.pattern = pattern;
    return o;
}

// What a sample ahead of the crossing must show, an eighth of the swing (six_step_slow()), lies so far ahead of it; not with fewer
// than eight samples in a sector.
double ahead_rad(const Machine &m, double omega)
{
    const double samples = kPi / 3 / omega * m.plant.inverter.f_pwm_Hz;
    return samples < 8 ? 0 : 60 * kDegree / 8;
}

// theta_f + w (t_blank + T / 2) = 30 degrees less that: of the instants of a carrier that has no ratio to the rotor half are later.
double predicted_A(const Machine &m, const Options &o, double omega, double u)
{
    const double Z = kBase_V / kBase_A, base = base_rad_s(m);
    const double emf_Vs = (m.trapezoid ? 2 : 1.5) * m.peak_Vs();
    const freewheeling_config_t config = {fixed(m.plant.machine.R_s_ohm / Z, PM_Q_BITS),
                                          fixed(m.plant.machine.L_d0_H * base / Z, PM_Q_BITS),
                                          fixed(emf_Vs * base / kBase_V, PM_Q_BITS)};
    const freewheeling_in_t in = {o.pattern, 1, fixed(u, PM_Q_BITS), fixed(24 / kBase_V, PM_Q_BITS),
                                  fixed(omega / base, PM_Q_BITS)};
    const double left =
        30 * kDegree - ahead_rad(m, omega) - omega * (o.blank_s + 0.5 / m.plant.inverter.f_pwm_Hz);
    return real(freewheeling_current(&config, &in, fixed(left, PM_Q_BITS))) * kBase_A;
}

struct Boundary {
    double i_A = 0, predicted_A = 0; // up to which half of the crossings are in time and it is not lost
    double u = 0;
};

// Between a voltage of which little current flows and all of the link's.
Boundary boundary(const Machine &m, const Options &o, double omega)
{
    Boundary b;
    const double turn_s = 2 * kPi / omega, little = duty(m, omega, 2);
    double low = little, high = 0.985;
    for (int n = 0; n < 8; ++n) {
        const double u = 0.5 * (low + high);
        Rig r(m, o, omega);
        r.run_for(5 * turn_s, little);
        for (double part = 0.1; part < 0.95; part += 0.1) {
            r.run_for(turn_s, little + part * (u - little));
        }
        r.run_for(8 * turn_s, u);
        r.freewheel = true;
        r.measure(0, 12, u);
        const bool held = !r.six_step.lost && r.in_time.mean() >= 0.5;
        (held ? low : high) = u;
        if (held) {
            b = {0.5 * (r.freewheels[0].i() + r.freewheels[1].i()), predicted_A(m, o, omega, u), u};
        }
    }
    EXPECT_LT(high, 0.98) << "no end";
    return b;
}

struct Place {
    bool fan;
    pattern_id_t pattern;
    double speed;
};

// No ratio to the carrier. BLDC-FAN with so much inductance that its link drives enough current.
const Place kPlaces[] = {{false, PATTERN_PWM_ON, 0.37},      {false, PATTERN_PWM_ON, 0.52},
                         {false, PATTERN_PWM_ON, 0.63},      {false, PATTERN_H_PWM_L_PWM, 0.52},
                         {true, PATTERN_H_PWM_L_PWM, 0.623}, {true, PATTERN_PWM_ON, 0.623}};

Machine machine(const Place &p)
{
    Machine m = strong(p.fan ? fan() : hs());
    m.plant.machine.L_d0_H = m.plant.machine.L_q0_H *= p.fan ? 1.7 : 1;
    return m;
}

// Beyond a boundary.
Rig beyond(const Machine &m, const Options &o, double omega, const Boundary &b, double factor)
{
    Rig r(m, o, omega);
    r.run_for(10 * 2 * kPi / omega, 0.9 * b.u);
    r.run_for(15 * 2 * kPi / omega, std::min(0.98, factor * b.u));
    r.freewheel = true;
    r.measure(0, 15, std::min(0.98, factor * b.u));
    return r;
}

TEST(SafeArea, CrossingsAreInTimeUpToThePredictedCurrent)
{
    for (const Place &p : kPlaces) {
        const Machine m = machine(p);
        const Options o = options(p.pattern);
        const double omega = p.speed * base_rad_s(m);
        const Boundary b = boundary(m, o, omega);
        EXPECT_GE(b.i_A / b.predicted_A, 1 - kCurrent) << p.fan << ' ' << p.pattern << ' ' << p.speed;
        EXPECT_LE(b.i_A / b.predicted_A, 1 + kCurrent) << p.fan << ' ' << p.pattern << ' ' << p.speed;
        const Rig r = beyond(m, o, omega, b, 1.15); // the late rule carries it
        EXPECT_FALSE(r.six_step.lost);
        EXPECT_GE(r.freewheels[1].i(), 1.1 * b.i_A);
        EXPECT_LE(r.commutations.most, 1);
    }
}

TEST(SafeArea, TwinWithoutTheLateRuleIsLostThere)
{
    for (const Place &p : kPlaces) {
        const Machine m = machine(p);
        Options o = options(p.pattern);
        o.late_rule = false;
        const double omega = p.speed * base_rad_s(m);
        const Boundary b = boundary(m, o, omega);
        // the link of BLDC-FAN does not drive so much
        EXPECT_TRUE(p.fan || beyond(m, o, omega, b, 1.3).six_step.lost)
            << p.fan << ' ' << p.pattern << ' ' << p.speed;
    }
}

struct Design {
    const char *name;
    double L, psi, poles; // factors
};

// BLDC-HS at 32,000 r/min.
const Design kDesigns[] = {{"as it is", 1, 1, 1},
                           {"half as much inductance again", 1.5, 1, 1},
                           {"two pole pairs, half the flux of each", 1, 0.5, 2},
                           {"less flux", 1, 0.7, 1}};

// Row 121: the safe area by L / L_lm, deviations of the crossings by K_w.
TEST(SafeArea, DesignsRankAsPredicted)
{
    std::vector<double> seen, predicted, deviation, slope;
    for (const Design &d : kDesigns) {
        Machine m = strong(hs());
        m.plant.machine.L_d0_H = m.plant.machine.L_q0_H *= d.L;
        m.plant.machine.psi_m_Wb *= d.psi;
        m.plant.machine.pole_pairs = static_cast<int>(d.poles);
        const Options o = options(PATTERN_PWM_ON);
        const double omega = 0.41 * base_rad_s(m) * d.poles;
        const Boundary b = boundary(m, o, omega);
        seen.push_back(b.i_A);
        predicted.push_back(b.predicted_A);
        EXPECT_NEAR(b.i_A / b.predicted_A, 1, kCurrent) << d.name;
        m.plant.sensor.divider_error[0] = 0.01;
        Rig r(m, o, omega);
        r.measure(20, 30, duty(m, omega, 12));
        // leg A is open in sectors 2 and 5
        deviation.push_back(std::abs(r.of_sector[2].mean() - r.of_sector[5].mean()) / 2);
        slope.push_back(0.01 * 24 / (2 * 1.5 * m.plant.machine.psi_m_Wb * omega) / kDegree);
        EXPECT_NEAR(deviation.back() / slope.back(), 1, kDeviation) << d.name;
    }
    for (size_t a = 0; a < seen.size(); ++a) {
        for (size_t b = 0; b < seen.size(); ++b) {
            if (predicted[a] > 1.05 * predicted[b]) {
                EXPECT_GT(seen[a], seen[b]) << kDesigns[a].name << ", " << kDesigns[b].name;
            }
            if (slope[a] > 1.05 * slope[b]) {
                EXPECT_GT(deviation[a], deviation[b]) << kDesigns[a].name << ", " << kDesigns[b].name;
            }
        }
    }
    // Twin: by the inductance alone two pole pairs would be as good as one.
    EXPECT_LT(seen[2], 0.7 * seen[0]);
}

} // namespace
