// Third harmonic of the terminals in closed loop on the switching plant with 2 us of dead time, 12 bits and noise
// (METHODS-ADDENDUM.md B (d), rows 123 and 126), in electrical degrees.
#include "bldc/virtual_third.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/unit/bldc/rig.h"

namespace
{

using namespace bldc_rig;

constexpr double kShare = 0.03;    // row 123, of 1/2 and 1/3
constexpr double kOffset_V = 0.05; // of the signal at the crossing: a step of the channels is 10 mV
constexpr double kEnvelopeRms = 1, kEnvelope = 1.5; // row 126

Options virtual_third_of(bool reverse)
{
    Options o;
    o.virtual_third = true;
    o.reverse = reverse;
    return o;
}

double load_duty(const Machine &m, double omega)
{
    return std::min(0.95, duty(m, omega, m.trapezoid ? 3 : 10) + 0.08); // 0.08: dead time
}

// EMF of the leg that is open at the last sample by the plant's angle and flux, V.
double open_emf_V(const Rig &r, double omega)
{
    const double at = wrapped_deg(r.seen.angle_rad - (60 + 60.0 * r.seen.sector) * kDegree);
    const double e = r.machine.trapezoid ? at / 30 : std::sin(at * kDegree);
    return (r.seen.sector % 2 == 0 ? 1 : -1) * e * r.machine.peak_Vs() * omega;
}

// y = share e + offset, by least squares.
struct Line {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;

    void add(double e, double v)
    {
        n += 1;
        x += e;
        y += v;
        xx += e * e;
        xy += e * v;
    }
    double share() const
    {
        return (n * xy - x * y) / (n * xx - x * x);
    }
    double offset() const
    {
        return (y - share() * x) / n;
    }
};

// e_0 of what is said of the open terminal.
double e_0_V(const zero_sample_t &sample, zero_legs_t legs)
{
    const double open = real(virtual_third_terminal(&sample, legs)), n = legs;
    return kBase_V * (open - n * real(sample.v_dc) / 2) / 3;
}

struct Signal {
    Line line, bare; // less what the legs put there, and without
};

// On-time samples within 15 degrees of the crossing, which are behind the freewheeling here.
Signal signal_of(const Machine &m, double omega, bool reverse)
{
    Signal s;
    Rig r(m, virtual_third_of(reverse), omega);
    const double u = load_duty(m, omega);
    r.run_for(0.03, u);
    for (int n = 0; n < 4000; ++n) {
        r.period(u);
        const double off = wrapped_deg(r.seen.angle_rad - (60 + 60.0 * r.seen.sector) * kDegree);
        if (r.seen.there && r.seen.legs == ZERO_LEGS_APART && std::abs(off) < 15) {
            const double e = open_emf_V(r, omega);
            s.line.add(e, e_0_V(r.seen.sample, ZERO_LEGS_APART));
            s.bare.add(e, e_0_V(r.seen.sample, ZERO_LEGS_LOW));
        }
    }
    EXPECT_FALSE(r.six_step.lost);
    EXPECT_GT(s.line.n, 500);
    return s;
}

// Row 123, with its twin: the mean alone, which is half of v_dc off; a third of the open terminal alone would be v_dc / 6 off.
TEST(VirtualThird, IsHalfOfASineAndAThirdOfATrapezoid)
{
    for (const bool reverse : {false, true}) {
        for (const double rpm : {20e3, 40e3, 80e3}) {
            const Signal s = signal_of(hs(), electrical(hs(), rpm), reverse);
            EXPECT_NEAR(s.line.share(), 1.0 / 2, kShare / 2) << rpm;
            EXPECT_NEAR(s.line.offset(), 0, kOffset_V) << rpm;
            EXPECT_NEAR(s.bare.offset(), 12, 0.5) << rpm;
        }
        for (const double rpm : {600.0, 1500.0, 3000.0}) {
            const Signal s = signal_of(fan(), electrical(fan(), rpm), reverse);
            EXPECT_NEAR(s.line.share(), 1.0 / 3, kShare / 3) << rpm;
            EXPECT_NEAR(s.line.offset(), 0, kOffset_V) << rpm;
            EXPECT_NEAR(s.bare.offset(), 12, 0.5) << rpm;
        }
    }
}

void expect_envelope(const Rig &r)
{
    EXPECT_FALSE(r.six_step.lost);
    ASSERT_GT(r.commutations.n, 200);
    EXPECT_LE(r.commutations.rms(), kEnvelopeRms);
    EXPECT_LE(r.commutations.most, kEnvelope);
}

// 15 periods of the carrier in a turn at this speed.
Machine fifteen(Machine m, double rpm)
{
    m.plant.inverter.f_pwm_Hz = 15 * electrical(m, rpm) / 2 / kPi;
    m.plant.inverter.timer_counts = static_cast<uint32_t>(85e6 / m.plant.inverter.f_pwm_Hz);
    while (m.plant.inverter.timer_counts > 8500) {
        m.plant.inverter.timer_counts /= 2;
    }
    return m;
}

struct Point {
    Machine machine;
    double rpm;
};

std::vector<Point> points()
{
    std::vector<Point> list;
    for (const double of : {0.975, 0.991, 1.0, 1.021}) {
        list.push_back({fifteen(hs(), 80e3), of * 80e3});
        list.push_back({fifteen(fan(), 3000), of * 3000});
    }
    return list;
}

// Row 126: on times.
TEST(VirtualThird, EnvelopeWith15PeriodsInATurn)
{
    for (const bool reverse : {false, true}) {
        for (const Point &p : points()) {
            const double omega = electrical(p.machine, p.rpm);
            Rig r(p.machine, virtual_third_of(reverse), omega);
            r.measure(60, 50, load_duty(p.machine, omega));
            SCOPED_TRACE(p.rpm);
            expect_envelope(r);
        }
    }
}

// On times at random to either side of the one from which samples are of the on time.
void run_joined(Rig &r, int turns_to_settle, int turns, double omega, double u)
{
    const double t_s = 2 * kPi / omega, until_s = r.t_s + (turns_to_settle + turns) * t_s;
    const double from_s = r.t_s + turns_to_settle * t_s;
    bool cleared = false;
    uint32_t draw = 1;
    while (r.t_s < until_s) {
        if (!cleared && r.t_s >= from_s) {
            r.clear();
            cleared = true;
        }
        draw = draw * 1664525 + 1013904223;
        r.period(draw >> 31 == 0 ? u - 0.03 : u + 0.03);
    }
}

Options joined(bool reverse, pattern_id_t pattern, const Machine &m, double u)
{
    Options o = virtual_third_of(reverse);
    o.pattern = pattern;
    o.least_s = u / m.plant.inverter.f_pwm_Hz;
    return o;
}

// Row 126: samples of on and off times in one sector, at the lower rail and at the upper one.
TEST(VirtualThird, EnvelopeJoinsOnAndOffTimes)
{
    for (const pattern_id_t pattern :
         {PATTERN_H_PWM_L_ON, PATTERN_H_ON_L_PWM, PATTERN_PWM_ON, PATTERN_ON_PWM}) {
        for (const bool reverse : {false, true}) {
            for (const Point &p : points()) {
                const double omega = electrical(p.machine, p.rpm);
                const double u = load_duty(p.machine, omega) - 0.1;
                Rig r(p.machine, joined(reverse, pattern, p.machine, u), omega);
                run_joined(r, 60, 50, omega, u);
                SCOPED_TRACE(p.rpm);
                SCOPED_TRACE(pattern);
                expect_envelope(r);
            }
        }
    }
}

// Twin: what is subtracted does not follow the carrier.
// With 15 periods in a turn to the digit each turn has the same samples, and those that are off the slope are passed over.
TEST(VirtualThird, TwinReferenceThatIsNotSwitchedIsLost)
{
    for (const Point &p : points()) {
        if (p.rpm == 80e3 || p.rpm == 3000) {
            continue;
        }
        const double omega = electrical(p.machine, p.rpm), u = load_duty(p.machine, omega) - 0.1;
        Options o = joined(false, PATTERN_H_PWM_L_ON, p.machine, u);
        o.legs_unknown = true;
        Rig r(p.machine, o, omega);
        run_joined(r, 60, 50, omega, u);
        EXPECT_TRUE(r.six_step.lost || r.commutations.most > 5) << p.rpm << " " << r.commutations.most;
    }
}

// Five patterns, both freewheelings, as the open terminal.
TEST(VirtualThird, CommutatesInAllPatterns)
{
    for (int id = 0; id < PATTERN_COUNT; ++id) {
        for (const bool complementary : {false, true}) {
            for (const Machine &m : {hs(), fan()}) {
                Options o = virtual_third_of(false);
                o.pattern = static_cast<pattern_id_t>(id);
                o.complementary = complementary;
                const double omega = electrical(m, m.trapezoid ? 1500 : 40e3);
                Rig r(m, o, omega);
                r.measure(30, 40, m.trapezoid ? 0.55 : 0.5);
                SCOPED_TRACE(id);
                expect_envelope(r);
            }
        }
    }
}

// The mean in place of each of the three.
TEST(VirtualThird, OneChannelIsEnough)
{
    for (const double rpm : {600.0, 1500.0, 3000.0}) {
        const double omega = electrical(fan(), rpm);
        Options o = virtual_third_of(false);
        o.one_channel = true;
        Rig r(fan(), o, omega);
        r.measure(20, 50, load_duty(fan(), omega));
        SCOPED_TRACE(rpm);
        expect_envelope(r);
    }
}

} // namespace
