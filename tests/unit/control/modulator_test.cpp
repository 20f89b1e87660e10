#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"
#include "tests/unit/math/samples.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::real;

// A leg is rounded to the nearest count; the scale is cut, relative (v + 1/v) 2^-16 of half the counts.
constexpr double kLeg_counts = 1.0;
// Compensation is rounded once more, and the positive end of the zone is one below its full value.
constexpr double kCompensation_counts = 2.0;
// METHODS.md 1.3.2.1 (e).
constexpr double kFundamental = 0.005;
constexpr double kAngle_deg = 1.0;
// pm_ratio(): 2^-16 ... 2^-15 of the span that was asked for.
constexpr double kShorten = 0x1p-15;

constexpr int kCounts = 8500;
constexpr double kLink = 300.0 / 450.0;

modulator_config_t plain(int counts = kCounts)
{
    modulator_config_t c = {};
    c.counts = counts;
    c.whole = pm_share_whole(counts);
    c.top = PM_SHARE_ONE;
    return c;
}

// 2 us at 10 kHz, 1 V of 450 V, linear below 30 mA of 10 A.
constexpr double kDead = 0.02, kDrop = 1.0 / 450, kZone = 0.003;

modulator_config_t compensating(int counts = kCounts)
{
    modulator_config_t c = plain(counts);
    c.dead = fixed(kDead, PM_SHARE_BITS);
    c.drop = fixed(kDrop, 28);
    c.per_zone[0] = fixed(1 / kZone, PM_ZONE_BITS + 6); // 2^PM_ZONE_BITS at the edge: zone/4 2^28 gain 2^-32
    c.per_zone[1] = c.per_zone[0];
    return c;
}

struct Legs {
    double x[3];

    double top() const
    {
        return *std::max_element(x, x + 3);
    }
    double bottom() const
    {
        return *std::min_element(x, x + 3);
    }
};

Legs phases(Complex v)
{
    return {{v.real(), -0.5 * v.real() + std::sqrt(0.75) * v.imag(),
             -0.5 * v.real() - std::sqrt(0.75) * v.imag()}};
}

// Duties of the textbook: each phase about the middle of the largest and the smallest.
Legs reference(Complex v, double v_dc)
{
    const Legs u = phases(v);
    const double zero = (u.top() + u.bottom()) / 2;
    Legs duty = {};
    for (int leg = 0; leg < 3; ++leg) {
        duty.x[leg] = 0.5 + (u.x[leg] - zero) / v_dc;
    }
    return duty;
}

Complex realised(const modulator_out_t &out, int counts, double v_dc)
{
    double u[3];
    for (int leg = 0; leg < 3; ++leg) {
        u[leg] = v_dc * out.on[leg] / counts;
    }
    return {(2 * u[0] - u[1] - u[2]) / 3, (u[1] - u[2]) / std::sqrt(3.0)};
}

struct Out : modulator_out_t {
    bool limited;
};

Out step(const modulator_config_t &c, Complex v, double v_dc, Complex i = 0)
{
    modulator_t self = {};
    Out out;
    modulator_slow(&self, &c, fixed(v_dc, 28), bench::ab(v), {});
    modulator_step(&self, &c, bench::ab(v), fixed(v_dc, 28), bench::ab(i / 4.0), &out);
    out.limited = self.limited != 0;
    return out;
}

// A square wave along d that swings the current by 20 zones to either side, as make_modulator() has it.
constexpr double kSwing = 20 * kZone, kTaken = kDead + kDrop / kLink;

modulator_config_t with_square_wave()
{
    modulator_config_t c = compensating();
    c.per_zone[1] = fixed(8 / kSwing, PM_ZONE_BITS + 6);
    c.far[1] = 2;
    return c;
}

// i: in the frame of the carrier, which lies along it.
Out step_with_carrier(const modulator_config_t &c, Complex i, Complex frame)
{
    modulator_t self = {};
    Out out;
    self.carrier = true;
    modulator_slow(&self, &c, fixed(kLink, 28), {}, {fixed(i.real(), 28), fixed(i.imag(), 28)});
    modulator_step(&self, &c, bench::ab(0), fixed(kLink, 28), bench::ab(i * frame / 4.0), &out);
    return out;
}

// While a carrier moves the edges off the mean current, these two halves hold, and only then; of a current along it the second half
// is none up to 0.9 of the swing, and all from 1.15 on.
TEST(Modulator, ACarrierWidensTheZone)
{
    const modulator_config_t c = with_square_wave();
    for (const double i : {0.0625, 0.125, 0.25, 0.5, 1.0, 2.0}) {
        const double halves = (std::min(8 * i, 1.0) + std::min(i, 1.0)) / 2;
        const double across = double(step_with_carrier(c, {0, i * kSwing}, {0, -1}).on[0]) / kCounts - 0.5;
        EXPECT_NEAR(across, kTaken * halves, 3.0 / kCounts) << i;
        const double along = double(step_with_carrier(c, i * kSwing, 1).on[0]) / kCounts - 0.5;
        const double second = std::clamp((i - 0.9) / 0.25, 0.0, 1.0) * std::min(i, 1.0) / 2;
        EXPECT_NEAR(along, kTaken * (std::min(8 * i, 1.0) / 2 + second), 3.0 / kCounts) << i;
        EXPECT_NEAR(double(step(c, 0, kLink, i * kSwing).on[0]) / kCounts - 0.5, kTaken, 3.0 / kCounts) << i;
    }
}

// Mean of what a leg loses, of a turn of the frame, in that frame: the leg that the carrier lifts most switches at both ends of the
// swing, and in the next period, when it is the lowest, both times in the middle.
Complex lost_in_the_mean(Complex i)
{
    const auto sign = [](double x) { return x > 0 ? 1.0 : x < 0 ? -1.0 : 0.0; };
    Complex sum = 0;
    constexpr int steps = 3600;
    for (int n = 0; n < steps; ++n) {
        const Complex frame = std::polar(1.0, 2 * bench::kPi * (n + 0.5) / steps);
        const double mean = (i * frame).real(), off = kSwing * frame.real();
        const double lost = (2 * sign(mean) + sign(mean + off) + sign(mean - off)) / 4;
        sum += 2 * lost * std::conj(frame) / double(steps);
    }
    return sum;
}

// Error, of what is lost at full sign, 4/pi. Along d the loss is a step at the swing, which the error has on both sides. One zone up
// to half of the swing errs by 0.12 across and 0.45 along d.
TEST(Modulator, WithASquareWaveCompensationIsWhatIsLost)
{
    const modulator_config_t c = with_square_wave();
    const auto worst = [&c](Complex direction, std::initializer_list<double> sizes) {
        double error = 0;
        for (const double size : sizes) {
            const Complex i = size * kSwing * direction;
            Complex sum = 0;
            constexpr int steps = 360;
            for (int n = 0; n < steps; ++n) {
                const Complex frame = std::polar(1.0, 2 * bench::kPi * (n + 0.5) / steps);
                sum +=
                    realised(step_with_carrier(c, i, frame), kCounts, 1) * std::conj(frame) / double(steps);
            }
            error = std::max(error, std::abs(sum / kTaken - lost_in_the_mean(i)));
        }
        return error / (4 / bench::kPi);
    };
    EXPECT_LE(worst({0, 1}, {0.4, 0.6, 0.8, 0.95, 1.05, 1.3, 2.0}), 0.06);
    EXPECT_LE(worst({1, 0}, {0.4, 0.6, 0.8, 1.3, 2.0}), 0.06);
    EXPECT_LE(worst({1, 0}, {0.95, 1.05}), 0.3);
    EXPECT_LE(worst(std::polar(1.0, bench::kPi / 4), {0.4, 0.6, 0.8, 0.95, 1.05, 1.3, 2.0}), 0.16);
}

// The leg that the vector lies along switches on when the zero vector has let the current fall by |v| / L meanwhile. Where that is
// beyond the zone, the zone goes as far. Twin: told of no ripple, all is given back to a current of a quarter of it.
TEST(Modulator, RippleWidensTheZone)
{
    constexpr double kPerInductance = 0.4; // T_s / L
    for (const uint8_t far : {uint8_t{0}, uint8_t{1}}) {
        modulator_config_t c = compensating();
        c.ripple = fixed(kPerInductance / 4 / kZone, PM_ZONE_BITS + 4);
        c.far[0] = far;
        for (const double m : {0.01, 0.1, 0.3, 0.5, 0.75, 0.95}) {
            const double v = m * 2 / 3 * kLink;
            const double ripple = v * kPerInductance * (1 - reference(v, kLink).x[0]) / 2;
            const double edge = std::max(kZone, ripple), second = far * kZone / edge / 4;
            for (const double part : {0.25, 0.5, 0.9, 2.0}) {
                const double lost = (1 - second) * std::min(part, 1.0) + second * std::min(part / 8, 1.0);
                const int more = step(c, v, kLink, part * edge).on[0] - step(c, v, kLink).on[0];
                EXPECT_NEAR(double(more) / kCounts, kTaken * lost, 3.0 / kCounts) << m << ' ' << part;
            }
            modulator_config_t twin = c;
            twin.ripple = 0;
            twin.far[0] = 0;
            const int more = step(twin, v, kLink, edge / 4).on[0] - step(twin, v, kLink).on[0];
            EXPECT_NEAR(double(more) / kCounts, kTaken * std::min(edge / 4 / kZone, 1.0), 3.0 / kCounts) << m;
        }
    }
}

TEST(Modulator, DutyIsThatOfTheTextbook)
{
    for (const int counts : {200, 8500, 8501, 32767}) {
        const modulator_config_t c = plain(counts);
        for (const double v_dc : {1.0 / 16, 0.2, kLink, 1.0}) {
            for (int a = 0; a < 360; a += 3) {
                for (const double share : {0.0, 0.01, 0.3, 0.7, 1.0 - 1e-6}) {
                    const Complex v = std::polar(share * v_dc / std::sqrt(3.0), a * kDegree);
                    const Out out = step(c, v, v_dc);
                    const Legs duty = reference(v, v_dc);
                    const double scale = (v_dc + 1 / v_dc) * 0x1p-16 * counts / 2;
                    for (int leg = 0; leg < 3; ++leg) {
                        ASSERT_NEAR(out.on[leg], counts * duty.x[leg], kLeg_counts + scale)
                            << counts << ' ' << v_dc << ' ' << a << ' ' << share;
                    }
                }
            }
        }
    }
}

TEST(Modulator, FundamentalIsTheCommandBelowTheLimit)
{
    const modulator_config_t c = plain();
    for (double share = 0.05; share <= 1.0; share += 0.05) {
        const double amplitude = share * kLink / std::sqrt(3.0);
        Complex sum = 0;
        const int n = 360;
        for (int k = 0; k < n; ++k) {
            const double angle = k * 2 * bench::kPi / n;
            sum += realised(step(c, std::polar(amplitude, angle), kLink), c.counts, kLink) *
                   std::polar(1.0, -angle);
        }
        EXPECT_NEAR(std::abs(sum) / n, amplitude, kFundamental * amplitude) << share;
        EXPECT_NEAR(std::arg(sum) / kDegree, 0, 0.05) << share;
    }
}

TEST(Modulator, LinearUpToTheInscribedCircleExactly)
{
    const modulator_config_t c = plain();
    const double limit = kLink / std::sqrt(3.0);
    int limited = 0;
    for (double angle = 0; angle < 360; angle += 0.25) {
        const Complex inside = std::polar(limit * (1 - 1e-7), angle * kDegree);
        const Out out = step(c, inside, kLink);
        ASSERT_FALSE(out.limited) << angle;
        ASSERT_EQ(out.v.alpha, bench::ab(inside).alpha);
        ASSERT_EQ(out.v.beta, bench::ab(inside).beta);
        limited += step(c, std::polar(limit * 1.001, angle * kDegree), kLink).limited ? 1 : 0;
    }
    // a circle larger by e crosses the hexagon near the middle of its sides, for 2 acos(1/(1+e)) of each 60
    const double share = 2 * std::acos(1 / 1.001) / (60 * kDegree);
    EXPECT_NEAR(limited / 1440.0, share, 0.01);
}

// The corners of the hexagon are reached: 2/3 v_dc along the phases.
TEST(Modulator, LinearUpToTheCorners)
{
    const modulator_config_t c = plain();
    for (int k = 0; k < 6; ++k) {
        const Out out = step(c, std::polar(2.0 / 3 * kLink * (1 - 1e-6), k * 60 * kDegree), kLink);
        EXPECT_FALSE(out.limited);
        EXPECT_NEAR(std::abs(realised(out, c.counts, kLink)), 2.0 / 3 * kLink, 1.5 * kLink / c.counts);
    }
}

TEST(Modulator, OvermodulationKeepsTheAngleOnTheHexagon)
{
    const modulator_config_t c = plain();
    const double count = kLink / c.counts;
    for (int a = 0; a < 720; ++a) {
        for (const double times : {1.16, 1.3, 2.0, 5.0}) {
            const double angle = a * 0.5 * kDegree;
            const Complex v = std::polar(times * kLink / std::sqrt(3.0), angle);
            const Out out = step(c, v, kLink);
            ASSERT_TRUE(out.limited);
            const Complex real_v = realised(out, c.counts, kLink);
            ASSERT_LE(std::abs(std::arg(real_v * std::polar(1.0, -angle))), kAngle_deg * kDegree) << a;
            // on the hexagon: one leg always on, one always off
            ASSERT_NEAR(std::max({out.on[0], out.on[1], out.on[2]}), c.counts, 1) << a;
            ASSERT_NEAR(std::min({out.on[0], out.on[1], out.on[2]}), 0, 1) << a;
            const Legs u = phases(bench::complex(out.v));
            const Legs asked = phases(v);
            ASSERT_NEAR(u.top() - u.bottom(), kLink, kShorten * (asked.top() - asked.bottom()) + 1e-7) << a;
            // what is returned is what the counts do
            const Legs counted = phases(real_v);
            for (int leg = 0; leg < 3; ++leg) {
                ASSERT_NEAR(counted.x[leg], u.x[leg], count) << a << ' ' << times;
            }
        }
    }
}

// Every link voltage as its reciprocal tells them apart, 16 bits, at the largest of each, where a share of one is
// nearest; spans from the next number on.
TEST(Modulator, NoVectorIsTurnedRoundAtTheLimit)
{
    const modulator_config_t c = plain();
    int limited = 0;
    for (int32_t part = 1 << 12; part <= 1 << 16; ++part) {
        const int32_t link = std::min((part << 12) + 4094, PM_ONE);
        for (const double beyond : {0.0, 4e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-2, 1.0}) {
            for (const double angle : {0.0, 30.0, 90.0, 200.0}) {
                const Complex v = std::polar(1.0, angle * kDegree);
                const Legs u = phases(v);
                const double amplitude = std::min(real(link) * (1 + beyond) / (u.top() - u.bottom()), 3.99);
                const pm_ab_t asked = bench::ab(amplitude * v);
                modulator_t self = {};
                modulator_out_t out;
                modulator_slow(&self, &c, link, {}, {});
                modulator_step(&self, &c, asked, link, {0, 0}, &out);
                limited += self.limited != 0 ? 1 : 0;
                const Complex ratio = bench::complex(out.v) / bench::complex(asked);
                ASSERT_NEAR(ratio.real(), std::min(1.0, real(link) / (u.top() - u.bottom()) / amplitude),
                            3e-4)
                    << link << ' ' << beyond << ' ' << angle;
                ASSERT_NEAR(ratio.imag(), 0.0, 1e-6) << link << ' ' << beyond << ' ' << angle;
            }
        }
    }
    EXPECT_GT(limited, 1000000);
}

// Teknic's board: 0.5 us and 1.3 us of half a period of 25 us.
modulator_config_t low_side(bool compensates)
{
    modulator_config_t c = compensates ? compensating(4250) : plain(4250);
    c.dead = fixed(0.01, PM_SHARE_BITS);
    c.top = fixed(1 - 1.8 / 25, PM_SHARE_BITS);
    return c;
}

constexpr double kTop = 1 - 1.8 / 25, kLost = 0.01 + kDrop / kLink;
// Two currents in every direction, relative to v_dc/sqrt(3).
const double kReach = 2.0 / 3 * (kTop - 0.01 - 2 * kLost - 0x1p-11) * std::sqrt(3.0);

// A leg above the limit is marked, and none that is not near it; two are always below it. What the motor receives is the
// vector that is returned. At the limit a count is a leg's.
TEST(Modulator, LowSideShuntsSeeTwoLegsUpToTheirReach)
{
    ASSERT_GT(kReach, 1.0);
    for (const bool compensates : {false, true}) {
        const modulator_config_t c = low_side(compensates);
        const double least = kTop - 2 * kLost - 0x1p-10;
        int marked = 0;
        for (double size = 0.05; size < kReach; size += 0.01) {
            for (int angle = 0; angle < 360; angle += 3) {
                const Complex v = std::polar(size * kLink / std::sqrt(3.0), angle * kDegree);
                modulator_t self = {};
                modulator_out_t out;
                modulator_slow(&self, &c, fixed(kLink, 28), {}, {});
                modulator_step(&self, &c, bench::ab(v), fixed(kLink, 28), bench::ab(v / 8.0), &out);
                int hidden = 0;
                for (int leg = 0; leg < 3; ++leg) {
                    const bool mark = (self.hidden >> (8 + leg) & 1) != 0;
                    ASSERT_TRUE(mark ? out.on[leg] > 4250 * least - 1 : out.on[leg] < 4250 * kTop + 1)
                        << size << ' ' << angle;
                    hidden += mark ? 1 : 0;
                }
                ASSERT_LE(hidden, 1) << size << ' ' << angle;
                marked += hidden;
                if (!compensates) {
                    const Complex got(real(out.v.alpha, 28), real(out.v.beta, 28));
                    ASSERT_LT(std::abs(realised(out, 4250, kLink) - got), 2 * kLink / 4250)
                        << size << ' ' << angle;
                    ASSERT_EQ(self.limited != 0, std::abs(got - v) > 1e-6) << size << ' ' << angle;
                }
            }
        }
        EXPECT_GT(marked, 1000);
    }
}

// With `all`, a carrier's, none is hidden at any voltage: the vector is shortened.
TEST(Modulator, LowSideShuntsSeeAllLegsOfACarrier)
{
    for (const bool compensates : {false, true}) {
        const modulator_config_t c = low_side(compensates);
        int limited = 0;
        for (double size = 0.05; size < 3; size += 0.05) {
            for (int angle = 0; angle < 360; ++angle) {
                const Complex v = std::polar(size * kLink / std::sqrt(3.0), angle * kDegree);
                modulator_t self = {};
                modulator_out_t out;
                self.carrier = true;
                modulator_slow(&self, &c, fixed(kLink, 28), {}, {});
                modulator_step(&self, &c, bench::ab(v), fixed(kLink, 28), bench::ab(v / 8.0), &out);
                ASSERT_EQ(self.hidden, 0) << size << ' ' << angle;
                ASSERT_LT(*std::max_element(out.on, out.on + 3), 4250 * kTop + 1) << size << ' ' << angle;
                const Complex got(real(out.v.alpha, 28), real(out.v.beta, 28));
                ASSERT_GT((got * std::conj(v)).real(), 0.999 * std::abs(got) * std::abs(v));
                ASSERT_GE(std::abs(got),
                          0.999 * std::min(std::abs(v), 1.5 * kReach / 2 * kLink / std::sqrt(3.0)));
                limited += self.limited != 0 ? 1 : 0;
            }
        }
        EXPECT_GT(limited, 10000);
    }
}

// Beyond, only one current may be left.
TEST(Modulator, BeyondTheirReachLowSideShuntsDoNot)
{
    const modulator_config_t c = low_side(false);
    modulator_t self = {};
    modulator_out_t out;
    modulator_slow(&self, &c, fixed(kLink, 28), {}, {});
    const Complex v = std::polar(1.06 * kReach * kLink / std::sqrt(3.0), 60 * kDegree);
    modulator_step(&self, &c, bench::ab(v), fixed(kLink, 28), {0, 0}, &out);
    EXPECT_GT(out.on[0], 4250 * kTop);
    EXPECT_GT(out.on[1], 4250 * kTop);
}

// An output is at work when it has begun and until it has ended: the samples at both ends are marked.
TEST(Modulator, AHiddenLegCountsForBothEndsOfItsPeriod)
{
    modulator_t self = {};
    self.hidden = 2 * MODULATOR_NEXT;
    EXPECT_EQ(modulator_take_hidden(&self), 2U);
    self.hidden += 4 * MODULATOR_NEXT;
    EXPECT_EQ(modulator_take_hidden(&self), 6U);
    EXPECT_EQ(modulator_take_hidden(&self), 4U);
    EXPECT_EQ(self.hidden, 0);
}

TEST(Modulator, CountsStayWithinTheTimer)
{
    samples::Random random;
    for (int n = 0; n < 100000; ++n) {
        const int counts = 200 + (random.word() & 0x7fff) % (32768 - 200);
        modulator_config_t c = compensating(counts);
        if ((n & 1) != 0) {
            c.per_zone[0] = 0;
        }
        const Complex v = std::polar(random.within(0, 3.99), random.within(-4, 4));
        const Complex i = std::polar(random.within(0, 2), random.within(-4, 4));
        const Out out = step(c, v, random.within(1.0 / 16, 1), i);
        for (const int32_t on : out.on) {
            ASSERT_GE(on, 0) << n;
            ASSERT_LE(on, counts) << n;
        }
    }
}

double lost_counts(const modulator_config_t &c, double v_dc)
{
    return c.counts * (kDead + kDrop / v_dc);
}

TEST(Modulator, CompensationGivesBackWhatDeadTimeTakes)
{
    const modulator_config_t on = compensating();
    modulator_config_t off = on;
    off.per_zone[0] = 0;
    for (const double v_dc : {0.25, kLink, 1.0}) {
        for (int a = 0; a < 360; a += 7) {
            const Complex i = std::polar(0.3, a * kDegree);
            const Complex v = std::polar(0.3 * v_dc, 2 * a * kDegree);
            const modulator_out_t with = step(on, v, v_dc, i);
            const modulator_out_t without = step(off, v, v_dc, i);
            const Legs leg = phases(i);
            for (int x = 0; x < 3; ++x) {
                if (std::abs(leg.x[x]) > kZone) {
                    const double expected = std::copysign(lost_counts(on, v_dc), leg.x[x]);
                    ASSERT_NEAR(with.on[x] - without.on[x], expected, kCompensation_counts) << a << ' ' << x;
                }
            }
            ASSERT_EQ(with.v.alpha, without.v.alpha); // the motor sees the command
            ASSERT_EQ(with.v.beta, without.v.beta);
        }
    }
}

TEST(Modulator, CompensationIsLinearInItsZone)
{
    const modulator_config_t c = compensating();
    const double full = lost_counts(c, kLink);
    const int32_t centre = c.counts / 2;
    for (double i = -1.5 * kZone; i <= 1.5 * kZone; i += kZone / 50) {
        const double expected = full * std::clamp(i / kZone, -1.0, 1.0);
        // i along phase A: the others carry half of it, reversed
        const Out out = step(c, 0, kLink, i);
        EXPECT_NEAR(out.on[0] - centre, expected, kCompensation_counts) << i;
        const double other = full * std::clamp(-0.5 * i / kZone, -1.0, 1.0);
        EXPECT_NEAR(out.on[1] - centre, other, kCompensation_counts) << i;
        EXPECT_NEAR(out.on[2] - centre, other, kCompensation_counts) << i;
    }
}

// Against the integral of a leg's voltage: the current i moves the capacitance C from one rail to the other while both
// switches are open, and at the other edge not at all.
double lost_with_capacitance(double x) // i / I_1
{
    const int n = 20000;
    double given_back = 0;
    for (int k = 0; k < n; ++k) { // of the dead time
        given_back += std::max(0.0, 1 - x * (k + 0.5) / n) / n;
    }
    return 1 - given_back;
}

TEST(Modulator, CapacitanceOfALegIsFollowedWithinItsError)
{
    drive_params_t p;
    drive_params_default(&p);
    p.leg_capacitance = 500; // pF
    p.comp_zone = 1;
    drive_config_t c = {};
    ASSERT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
    c.modulator.drop = 0;
    const double v_dc = 300.0 / 450, I_1 = 0.5e-9 * 300 / 2e-6 / 10; // of 10 A
    const double full = c.modulator.counts * 2e-6 * 1e4;
    double largest = 0;
    for (double x = 0; x < 40; x += 0.05) {
        const Out out = step(c.modulator, 0, v_dc, x * I_1);
        const double given = (out.on[0] - c.modulator.counts / 2) / full;
        largest = std::max(largest, std::abs(given - lost_with_capacitance(x)));
    }
    EXPECT_LE(largest, 0.07 + kCompensation_counts / full);
    EXPECT_GE(largest, 0.05); // the counts of a period do not hide it
}

// A held leg that changes misses the dead time where its diode carries the current on, and nothing where the current itself moves
// the node.
TEST(Modulator, EdgesOfHeldLegsComeLateAgainstTheCurrent)
{
    constexpr pm_leg_t kHigh = PM_LEG_HIGH, kLow = PM_LEG_LOW;
    modulator_config_t c = compensating();
    c.drop = 0;
    modulator_t m = {};
    modulator_slow(&m, &c, fixed(kLink, 28), {}, {});
    const auto missed = [](pm_leg_t from, pm_leg_t to, double i) {
        const double f = std::clamp(i / kZone, -1.0, 1.0);
        const double up = -std::min(1.0, 1 + f), down = std::min(1.0, 1 - f);
        return kDead * kLink * (from == to ? 0 : (to == kHigh ? up : down));
    };
    const pm_leg_t states[] = {kHigh, kLow};
    for (int n = 0; n < 64; ++n) {
        pm_leg_t from[3], to[3];
        for (int leg = 0; leg < 3; ++leg) {
            from[leg] = states[n >> leg & 1];
            to[leg] = states[n >> (leg + 3) & 1];
        }
        for (const double size : {0.0, 0.2 * kZone, 0.1}) {
            const double i[3] = {size, -2 * size, size};
            const pm_abc_t legs = {fixed(i[0], 28), fixed(i[1], 28), fixed(i[2], 28)};
            const Complex v =
                bench::complex(modulator_edges(&m, &c, pm_legs_of(from[0], from[1], from[2]),
                                               pm_legs_of(to[0], to[1], to[2]), legs, fixed(kLink, 28)));
            Complex expected = 0;
            for (int leg = 0; leg < 3; ++leg) {
                expected +=
                    2.0 / 3 * missed(from[leg], to[leg], i[leg]) * std::polar(1.0, leg * 120 * kDegree);
            }
            EXPECT_NEAR(std::abs(v - expected), 0, 1e-5) << n << ' ' << size;
        }
    }
}

TEST(Modulator, CompensationSwitchedOffIsNone)
{
    modulator_config_t c = compensating();
    c.per_zone[0] = 0;
    const modulator_config_t none = plain();
    for (int a = 0; a < 360; a += 5) {
        const Complex i = std::polar(0.5, a * kDegree);
        const Complex v = std::polar(0.2, 3 * a * kDegree);
        const Out out = step(c, v, kLink, i);
        const modulator_out_t expected = step(none, v, kLink, i);
        for (int x = 0; x < 3; ++x) {
            ASSERT_EQ(out.on[x], expected.on[x]);
        }
    }
}

// Mean voltage of a half of the period, per-unit.
Complex of_half(const uint16_t compare[PM_LEGS][2], int half, double v_dc)
{
    modulator_out_t out = {};
    for (int leg = 0; leg < 3; ++leg) {
        out.on[leg] = compare[leg][half];
    }
    return realised(out, kCounts, v_dc);
}

struct Split {
    uint16_t compare[PM_LEGS][2];
    bool limited;
};

Split split(Complex v, Complex more, double v_dc)
{
    const modulator_config_t c = plain();
    const Out out = step(c, v, v_dc);
    Split s = {};
    for (int leg = 0; leg < 3; ++leg) {
        s.compare[leg][0] = s.compare[leg][1] = static_cast<uint16_t>(out.on[leg]);
    }
    modulator_t self = {};
    modulator_split(&self, &c, bench::ab(more), fixed(v_dc, 28), s.compare);
    s.limited = self.limited != 0;
    return s;
}

// As long as the sum of both lies in the hexagon's inner circle, whatever the zero vectors must be.
TEST(Modulator, SplitGivesToTheFirstHalfWhatItTakesFromTheSecond)
{
    constexpr double kCount_pu = 3 * kLink / kCounts; // a count per leg, twice rounded
    for (int a = 0; a < 360; a += 7) {
        for (int b = 0; b < 360; b += 11) {
            for (const double share : {0.0, 0.3, 0.6}) {
                const double circle = kLink / std::sqrt(3.0);
                const Complex v = std::polar(share * circle, a * kDegree);
                const Complex more = std::polar((1 - share - 1e-3) * circle, b * kDegree);
                const Split s = split(v, more, kLink);
                ASSERT_LT(std::abs(of_half(s.compare, 0, kLink) - (v + more)), kCount_pu) << a << ' ' << b;
                ASSERT_LT(std::abs(of_half(s.compare, 1, kLink) - (v - more)), kCount_pu) << a << ' ' << b;
                ASSERT_FALSE(s.limited) << a << ' ' << b;
            }
        }
    }
}

TEST(Modulator, NothingToSplitChangesNothing)
{
    const Split s = split(std::polar(0.2, 0.4), 0, kLink);
    for (const auto &leg : s.compare) {
        EXPECT_EQ(leg[0], leg[1]);
    }
}

// Along either axis alone as well.
TEST(Modulator, SplitAlongOneAxis)
{
    constexpr double kCount_pu = 3 * kLink / kCounts;
    for (const Complex more : {Complex{0.1, 0}, Complex{-0.1, 0}, Complex{0, 0.1}, Complex{0, -0.1}}) {
        const Split s = split(std::polar(0.1, 0.4), more, kLink);
        EXPECT_LT(std::abs(of_half(s.compare, 0, kLink) - of_half(s.compare, 1, kLink) - 2.0 * more),
                  2 * kCount_pu);
        EXPECT_FALSE(s.limited);
    }
}

// A loss of more than a quarter of the period is compensated as a quarter, and does not wrap.
TEST(Modulator, CompensationSaturatesAtAQuarterOfThePeriod)
{
    for (const double lost : {0.2, 0.24, 0.3, 0.6, 1.5}) {
        modulator_config_t c = plain();
        c.dead = fixed(lost, PM_SHARE_BITS);
        c.drop = 0;
        c.far[0] = 0;
        modulator_t self = {};
        modulator_slow(&self, &c, fixed(kLink, 28), {}, {});
        EXPECT_NEAR(real(self.near, PM_SHARE_BITS + PM_HEIGHT_BITS), std::min(lost, 0.25), 1e-5) << lost;
    }
}

TEST(Modulator, ASplitThatDoesNotFitIsFlagged)
{
    for (int b = 0; b < 360; b += 11) {
        const Split s =
            split(std::polar(0.9 * kLink / std::sqrt(3.0), 0.3), std::polar(0.7 * kLink, b * kDegree), kLink);
        EXPECT_TRUE(s.limited) << b;
        for (const auto &leg : s.compare) {
            EXPECT_LE(leg[0], kCounts);
            EXPECT_LE(leg[1], kCounts);
        }
    }
}

// Without a common part of voltage and current it is modulator_step(), bit for bit; beyond the hexagon too.
TEST(Modulator, ACommonPartOfNothingChangesNothing)
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> share(0, 1);
    int limited = 0;
    for (const modulator_config_t &c : {plain(), compensating(), compensating(1000)}) {
        for (int n = 0; n < 20000; ++n) {
            const double v_dc = 0.1 + 0.8 * share(random);
            const pm_ab_t v = bench::ab(std::polar(v_dc * share(random), 2 * bench::kPi * share(random)));
            const pm_ab_t i =
                bench::ab(std::polar(std::pow(share(random), 4) / 4, 2 * bench::kPi * share(random)));
            modulator_t a = {}, b = {};
            modulator_slow(&a, &c, fixed(v_dc, 28), {}, {});
            b = a;
            modulator_out_t out = {}, zero = {};
            modulator_step(&a, &c, v, fixed(v_dc, 28), i, &out);
            const modulator_zero_t in = {v, 0, i, 0};
            ASSERT_EQ(modulator_step_zero(&b, &c, &in, fixed(v_dc, 28), &zero), 0);
            for (int leg = 0; leg < 3; ++leg) {
                ASSERT_EQ(zero.on[leg], out.on[leg]) << n;
            }
            ASSERT_EQ(zero.v.alpha, out.v.alpha) << n;
            ASSERT_EQ(zero.v.beta, out.v.beta) << n;
            ASSERT_EQ(b.limited, a.limited) << n;
            limited += a.limited != 0 ? 1 : 0;
        }
    }
    EXPECT_GT(limited, 10000);
}

// On all legs alike, and shortened with the vector.
TEST(Modulator, ACommonPartIsAddedToEachLeg)
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> share(-1, 1);
    const modulator_config_t c = plain();
    for (int n = 0; n < 5000; ++n) {
        const Complex v = std::polar(0.7 * kLink * share(random), bench::kPi * share(random));
        const double zero = 0.2 * kLink * share(random);
        const Legs u = phases(v);
        const double fits = std::min(1.0, kLink / (u.top() - u.bottom() + 2 * std::fabs(zero)));
        modulator_t self = {};
        modulator_out_t out = {};
        modulator_slow(&self, &c, fixed(kLink, 28), {}, {});
        const modulator_zero_t in = {bench::ab(v), fixed(zero, 28), {0, 0}, 0};
        const pm_q_t acts = modulator_step_zero(&self, &c, &in, fixed(kLink, 28), &out);
        ASSERT_NEAR(real(acts), zero * fits, 2 * kShorten * std::fabs(zero) + 1e-8) << v << zero;
        ASSERT_LE(std::abs(Complex(real(out.v.alpha), real(out.v.beta)) - v * fits), 2 * kShorten)
            << v << zero;
        const Legs duty = reference(v * fits, kLink);
        for (int leg = 0; leg < 3; ++leg) {
            ASSERT_NEAR(out.on[leg], (duty.x[leg] + zero * fits / kLink) * kCounts, 2 * kLeg_counts)
                << v << zero;
        }
    }
}

} // namespace
