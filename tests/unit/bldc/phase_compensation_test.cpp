// Uneven crossings of the third harmonic of the terminals: what makes them and their compensation, in closed loop on the switching
// plant with 2 us of dead time, 12 bits and noise (METHODS-ADDENDUM.md B (d), rows 135 and 136), in electrical degrees.
#include "bldc/phase_compensation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/bldc/rig.h"

namespace
{

using namespace bldc_rig;

constexpr double kFormula = 0.15;            // rows 112 and 135
constexpr double kNoise_deg = 0.1;           // mean of 40 turns
constexpr double kBefore = 4, kSpread = 0.5; // row 136

double u_of(double rpm)
{
    return rpm <= 20e3 ? 0.33 : rpm <= 40e3 ? 0.5 : 0.85;
}

struct Unlike {
    double dL[3], dR[3], eps[3]; // relative
};

constexpr Unlike kInductances = {{0.1, -0.1, 0}, {0, 0, 0}, {0, 0, 0}};
constexpr Unlike kResistances = {{0, 0, 0}, {0.3, -0.3, 0}, {0, 0, 0}};
constexpr Unlike kDividers = {{0, 0, 0}, {0, 0, 0}, {0.01, -0.01, 0}};
constexpr Unlike kAll = {{0.1, -0.1, 0}, {0, 0, 0}, {0.01, -0.01, 0}};

Machine with(Machine m, const Unlike &x)
{
    for (int leg = 0; leg < 3; ++leg) {
        m.plant.winding.dL_H[leg] = x.dL[leg] * m.plant.machine.L_d0_H;
        m.plant.winding.dR_ohm[leg] = x.dR[leg] * m.plant.machine.R_s_ohm;
        m.plant.sensor.divider_error[leg] = x.eps[leg];
    }
    return m;
}

Options virtual_third_of(bool reverse, double k)
{
    Options o;
    o.virtual_third = true;
    o.reverse = reverse;
    o.k_V = o.k_H = k;
    return o;
}

double spread(const Rig &r)
{
    double lowest = 1e9, highest = -1e9;
    for (const Statistics &s : r.of_sector) {
        lowest = std::min(lowest, s.mean());
        highest = std::max(highest, s.mean());
    }
    return highest - lowest;
}

// How late the crossing of a sector is seen: phase_compensation.h, with di/dt of the on time of a sine's line voltage.
double formula_deg(const Machine &m, const Unlike &x, double omega, uint32_t sector, bool reverse, double i_A)
{
    const sector_t legs = sector_legs(sector, reverse);
    const double E = omega * m.peak_Vs(), R = m.plant.machine.R_s_ohm, K = m.slope_Vs() * omega;
    const double L_di_V = (24 - std::sqrt(3.0) * E - 2 * R * i_A) / 2;
    const double dv =
        R * (x.dR[legs.high] - x.dR[legs.low]) * i_A + (x.dL[legs.high] - x.dL[legs.low]) * L_di_V;
    const double dividers = (x.eps[legs.high] + x.eps[legs.open] / 2) * 24;
    return (sector_rising(sector) ? 1 : -1) * (dv / 2 - dividers) / K / kDegree;
}

// Row 135. Mean of the six apart: it is not seen in a commutation, which is half of the mean interval behind.
TEST(PhaseCompensation, UnevenCrossingsAreThoseOfTheFormula)
{
    for (const bool reverse : {false, true}) {
        for (const double rpm : {20e3, 40e3, 80e3}) {
            for (const Unlike &x : {kInductances, kResistances, kDividers}) {
                const Machine m = with(hs(), x);
                const double omega = electrical(m, rpm);
                Rig r(m, virtual_third_of(reverse, 0), omega);
                r.measure(40, 40, u_of(rpm));
                EXPECT_FALSE(r.six_step.lost);
                for (uint32_t s = 0; s < SECTORS; ++s) {
                    const double expected = formula_deg(m, x, omega, s, reverse, r.conducted_A());
                    EXPECT_NEAR(r.of_sector[s].mean(), expected, kFormula * std::abs(expected) + kNoise_deg)
                        << rpm << " sector " << s << " reverse " << reverse;
                }
            }
        }
    }
}

// Table of row 112, which is the open terminal's: voltage and slope are both a third.
TEST(PhaseCompensation, UnlikePhasesDoTheSameAsToTheOpenTerminal)
{
    const struct {
        double rpm, table_deg;
    } list[] = {{20e3, -14}, {40e3, -5.3}, {80e3, -1.1}};
    for (const auto &x : list) {
        const Machine m = with(hs(), kInductances);
        Rig r(m, virtual_third_of(false, 0), electrical(m, x.rpm));
        r.measure(40, 40, u_of(x.rpm));
        EXPECT_NEAR(r.of_sector[0].mean(), x.table_deg, kFormula * std::abs(x.table_deg)) << x.rpm;
        EXPECT_NEAR(r.of_sector[3].mean(), x.table_deg, kFormula * std::abs(x.table_deg)) << x.rpm;
    }
}

void expect_even(const Rig &r)
{
    EXPECT_FALSE(r.six_step.lost);
    ASSERT_GT(r.commutations.n, 200);
    EXPECT_LE(spread(r), kSpread);
}

// Row 136, 200 turns as rows 114 and 115; twin: not compensated.
TEST(PhaseCompensation, TakesTheSpreadOffWithin200Turns)
{
    for (const bool reverse : {false, true}) {
        for (const double rpm : {20e3, 40e3, 80e3}) {
            for (const Unlike &x : {kInductances, kAll}) {
                const Machine m = with(hs(), x);
                const double omega = electrical(m, rpm);
                Rig r(m, virtual_third_of(reverse, 0.05), omega);
                r.measure(200, 40, u_of(rpm));
                SCOPED_TRACE(rpm);
                expect_even(r);
                Rig twin(m, virtual_third_of(reverse, 0), omega);
                twin.measure(40, 40, u_of(rpm));
                EXPECT_GE(spread(twin), rpm > 40e3 ? 0 : kBefore)
                    << rpm; // above, what is left to take off is little
            }
        }
        const Machine m = with(fan(), kAll);
        Rig r(m, virtual_third_of(reverse, 0.05), electrical(m, 1500));
        r.measure(200, 40, 0.55);
        expect_even(r);
    }
}

// Voltages were learnt, not times: what holds at one speed is near at another.
TEST(PhaseCompensation, FollowsAStepOfTheSpeed)
{
    const Machine m = with(hs(), kAll);
    for (const double step : {0.8, 1.2}) {
        Rig r(m, virtual_third_of(false, 0.05), electrical(m, 50e3));
        r.measure(200, 1, 0.6);
        r.impose(electrical(m, 50e3 * step));
        r.measure(6, 10, 0.6 * step);
        EXPECT_FALSE(r.six_step.lost);
        for (const Statistics &s : r.of_sector) {
            EXPECT_LE(std::abs(s.mean()), 1) << step;
        }
    }
}

// The star point behind its filter, where there is no voltage to compare with: unlike phases and an offset of the channel.
TEST(PhaseCompensation, ServesTheStarPointToo)
{
    for (const bool reverse : {false, true}) {
        Machine m = with(hs(), kInductances);
        m.plant.winding.emf[0] = {3, 0.1 * m.plant.machine.psi_m_Wb, 0};
        m.plant.sensor.v_zero_full_scale_V = 10;
        m.plant.sensor.v_zero_noise_lsb = 0.5;
        m.plant.sensor.v_zero_offset_V = 0.1;
        m.plant.sensor.v_zero_filter_s = 20e-6;
        Options o;
        o.third = true;
        o.reverse = reverse;
        const double omega = electrical(m, 40e3);
        Rig twin(m, o, omega);
        twin.measure(40, 40, 0.5);
        o.k_V = o.k_H = 0.05;
        Rig r(m, o, omega);
        r.measure(200, 40, 0.5);
        expect_even(r);
        EXPECT_GE(spread(twin), 1);
    }
}

// The share of t_60 that a deviation is of the swing, both signs, up to 3/8.
TEST(PhaseCompensation, IsTheShareOfTheSwing)
{
    const pm_q_t swing = PM_Q(0.2);
    for (const double share : {-1.0, -0.25, -1e-4, 0.0, 0.1, 0.375, 2.0}) {
        thresholds_t learnt = {};
        learnt.u_V[0] = fixed(share * 0.2, PM_Q_BITS);
        phase_compensation_t self = {};
        phase_compensation_slow(&self, &learnt, false, 100000, swing);
        const double expected = 100000 * std::min(0.375, std::max(-0.375, share));
        EXPECT_NEAR(self.shift[2], expected, 4) << share; // A upwards
        EXPECT_NEAR(self.shift[5], -expected, 4) << share;
        EXPECT_EQ(self.shift[0], 0);
    }
}

// shift = t_60 u / swing of each sector, up to 3/8 of t_60; what stands behind the six is left alone.
TEST(PhaseCompensation, ShiftsAreTheShareOfTheSwing)
{
    struct {
        phase_compensation_t self;
        int32_t behind[2];
    } x = {{}, {77, 78}};
    constexpr uint32_t kT60 = 60000;
    constexpr double kSwing = 0.4;
    const thresholds_t learnt = {{fixed(0.04, 28), fixed(-0.02, 28), fixed(0.3, 28)},
                                 {fixed(0.01, 28), fixed(0.03, 28), fixed(-0.04, 28)}};
    for (const bool reverse : {false, true}) {
        phase_compensation_slow(&x.self, &learnt, reverse, kT60, fixed(kSwing, 28));
        for (uint32_t s = 0; s < SECTORS; ++s) {
            const uint8_t leg = sector_legs(s, reverse).open;
            const double u = (s % 2 == 0 ? 1 : -1) * real(learnt.u_V[leg]) +
                             (reverse ? 1 : -1) * real(learnt.u_H[leg]); // thresholds.h
            const double share = std::max(-0.375, std::min(0.375, u / kSwing));
            EXPECT_NEAR(x.self.shift[s], share * kT60, 2) << s;
        }
        EXPECT_EQ(x.behind[0], 77);
        EXPECT_EQ(x.behind[1], 78);
    }
}

} // namespace
