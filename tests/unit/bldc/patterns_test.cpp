#include "bldc/patterns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "tests/unit/bldc/rig.h"

namespace
{

using bldc_rig::fixed;
using bldc_rig::kDegree;
using bldc_rig::real;

constexpr uint16_t kN = 2125;
constexpr double kDuty = 1.0 / kN + 1e-9;    // half a count of each leg
constexpr double kRipple = 0.15, kRms = 0.3; // METHODS-ADDENDUM.md B (c), row 109

pattern_config_t make(pattern_id_t id, bool complementary = true)
{
    return {id, complementary, kN, 170, 1000, false, PM_ONE, PM_ONE};
}

pattern_sample_t sample_of(const pattern_config_t &c, uint32_t sector, pm_q_t u)
{
    const pattern_on_t on = pattern_on(&c, u);
    return pattern_sample(&c, pattern_kind(c.id, sector), &on);
}

// Of a sector at a mean voltage.
struct Asked {
    Asked(const pattern_config_t &c, uint32_t sector, bool reverse, double u)
        : legs(pattern_states(c.id, c.complementary, sector, reverse))
    {
        const pattern_on_t on = pattern_on(&c, fixed(u, 28));
        pattern_write(&on, sector, reverse, compare);
    }
    double duty(uint32_t leg) const
    {
        return compare[leg][0] / double(kN);
    }

    uint16_t compare[PM_LEGS][2], legs;
};

// Is a terminal at the upper rail at a count of the period?
bool high_at(pm_leg_t state, double duty, double count)
{
    const double from = kN * (1 - duty), to = kN * (1 + duty);
    const bool pulse = count >= from && count < to;
    return state == PM_LEG_HIGH || (state == PM_LEG_INVERTED ? !pulse : state != PM_LEG_LOW && pulse);
}

// METHODS.md 0.1: EMF of a phase, angles in degrees.
double emf(int leg, double theta_deg)
{
    return -std::sin((theta_deg - 120 * leg) * kDegree);
}

TEST(Sectors, AreThoseOfTheEmf)
{
    for (const bool reverse : {false, true}) {
        const double way = reverse ? -1 : 1;
        for (uint32_t s = 0; s < SECTORS; ++s) {
            const sector_t at = sector_legs(s, reverse);
            const double middle = way * (60 + 60.0 * s);
            // driven by the legs with the highest and the lowest EMF, which has the sign of the speed
            EXPECT_NEAR(way * emf(at.high, middle), std::sqrt(0.75), 1e-9) << s;
            EXPECT_NEAR(way * emf(at.low, middle), -std::sqrt(0.75), 1e-9) << s;
            EXPECT_NEAR(emf(at.open, middle), 0, 1e-9) << s;
            EXPECT_EQ(way * emf(at.open, middle + way) > 0, sector_rising(s)) << s;
            const sector_t next = sector_legs(sector_next(s), reverse);
            EXPECT_EQ(sector_rising(s) ? next.high : next.low, at.open) << s;
            EXPECT_EQ(sector_rising(s) ? next.low : next.high, sector_rising(s) ? at.low : at.high) << s;
        }
    }
    EXPECT_EQ(sector_distance(5, 0), 1U);
    EXPECT_EQ(sector_distance(1, 5), 4U);
    EXPECT_EQ(sector_distance(3, 3), 0U);
}

// METHODS.md 10.3.1: which of a leg's two sectors is chopped.
TEST(Patterns, ChopWhatTheirNameSays)
{
    struct {
        pattern_id_t id;
        bool upper_first, upper_last, lower_first, lower_last;
    } const list[] = {{PATTERN_H_PWM_L_PWM, true, true, true, true},
                      {PATTERN_H_PWM_L_ON, true, true, false, false},
                      {PATTERN_H_ON_L_PWM, false, false, true, true},
                      {PATTERN_PWM_ON, true, false, true, false},
                      {PATTERN_ON_PWM, false, true, false, true},
                      {PATTERN_H_PWM_L_PWM_ALTERNATING, true, true, true, true}};
    for (const auto &p : list) {
        for (const bool reverse : {false, true}) {
            for (const bool complementary : {false, true}) {
                const pattern_config_t c = make(p.id, complementary);
                for (uint32_t s = 0; s < SECTORS; ++s) {
                    const uint16_t legs = pattern_states(c.id, c.complementary, s, reverse);
                    const sector_t at = sector_legs(s, reverse);
                    const bool upper_comes =
                        !sector_rising(s); // it was open in the sector before, which rose
                    const bool upper = upper_comes ? p.upper_first : p.upper_last;
                    const bool lower = upper_comes ? p.lower_last : p.lower_first;
                    EXPECT_EQ(pm_leg(legs, at.open), PM_LEG_OFF);
                    EXPECT_EQ(pm_leg(legs, at.high), !upper          ? PM_LEG_HIGH
                                                     : complementary ? PM_LEG_PWM
                                                                     : PM_LEG_UPPER);
                    const bool at_once = p.id == PATTERN_H_PWM_L_PWM;
                    const pm_leg_t both = at_once ? PM_LEG_INVERTED : PM_LEG_PWM;
                    const pm_leg_t one = at_once ? PM_LEG_LOWER_INVERTED : PM_LEG_LOWER;
                    EXPECT_EQ(pm_leg(legs, at.low), !lower ? PM_LEG_LOW : complementary ? both : one);
                }
            }
        }
    }
}

// u is the mean line voltage, whatever the pattern; duties do not change where legs stay or come.
TEST(Patterns, LineVoltageIsTheCommand)
{
    for (int id = 0; id < PATTERN_COUNT; ++id) {
        const pattern_config_t c = make(static_cast<pattern_id_t>(id));
        for (const bool reverse : {false, true}) {
            for (const double u : {0.0, 0.2, 0.7, 1.0}) {
                for (uint32_t s = 0; s < SECTORS; ++s) {
                    const Asked out(c, s, reverse, u), then(c, sector_next(s), reverse, u);
                    const sector_t at = sector_legs(s, reverse), next = sector_legs(sector_next(s), reverse);
                    const auto mean = [&](uint32_t leg) {
                        const pm_leg_t state = pm_leg(out.legs, leg);
                        const double duty = out.duty(leg);
                        return state == PM_LEG_HIGH       ? 1
                               : state == PM_LEG_LOW      ? 0
                               : state == PM_LEG_INVERTED ? 1 - duty
                                                          : duty;
                    };
                    EXPECT_NEAR(mean(at.high) - mean(at.low), u, kDuty);
                    EXPECT_EQ(out.compare[next.high][0], then.compare[next.high][0]);
                    EXPECT_EQ(out.compare[next.low][0], then.compare[next.low][0]);
                }
            }
        }
    }
}

// Where it shows the on time every sample is of it; a little below some are not.
TEST(Patterns, ShowsWhereSamplesAreThoseOfTheOnTime)
{
    for (int id = 0; id < PATTERN_COUNT; ++id) {
        pattern_config_t c = make(static_cast<pattern_id_t>(id));
        c.least = static_cast<uint16_t>(c.half_period / 5);
        const double pulses = id == PATTERN_H_PWM_L_PWM_ALTERNATING ? 2 : 1;
        for (double u = 0.003; u < 1; u += 0.01) {
            const bool shows = pattern_shows(&c, fixed(u, 28));
            EXPECT_EQ(shows, id == PATTERN_H_PWM_L_PWM || u >= 1.25 * 0.1 * pulses) << id << ' ' << u;
            for (uint32_t s = 0; s < SECTORS; ++s) {
                const bool on = sample_of(c, s, fixed(u, 28)).legs == ZERO_LEGS_APART;
                EXPECT_TRUE(on || !shows) << id << ' ' << u << ' ' << s;
            }
        }
    }
}

// At the instant of a sample the legs are where the reference says, for `lead` before and what is left of the least time.
TEST(Patterns, SamplesAreTakenWhereTheLegsAreAsTold)
{
    for (int id = 0; id < PATTERN_COUNT; ++id) {
        const pattern_config_t c = make(static_cast<pattern_id_t>(id));
        for (double u = 0.02; u < 0.985; u += 0.06) {
            for (uint32_t s = 0; s < SECTORS; ++s) {
                const pattern_sample_t sample = sample_of(c, s, fixed(u, 28));
                ASSERT_GE(sample.at, 1);
                ASSERT_LT(sample.at, 2 * kN);
                const Asked out(c, s, false, u);
                const sector_t at = sector_legs(s, false);
                const double share = id == PATTERN_H_PWM_L_PWM               ? (1 + u) / 2
                                     : id == PATTERN_H_PWM_L_PWM_ALTERNATING ? u / 2
                                                                             : u;
                EXPECT_EQ(sample.legs == ZERO_LEGS_APART, 2 * kN * share >= c.least - 1) << id << u;
                for (int ahead = 0; ahead >= -100; ahead -= 50) {
                    const double count = sample.at + ahead;
                    const bool up = high_at(pm_leg(out.legs, at.high), out.duty(at.high), count);
                    const bool down = high_at(pm_leg(out.legs, at.low), out.duty(at.low), count);
                    EXPECT_EQ(up, sample.legs != ZERO_LEGS_LOW) << id << ' ' << u << ' ' << s;
                    EXPECT_EQ(down, sample.legs == ZERO_LEGS_HIGH) << id << ' ' << u << ' ' << s;
                }
            }
        }
    }
}

// A shunt below a lower switch that has conducted for kBlind of a period before its end shows the current; which leg it does not,
// and up to which voltage one of the two is seen.
TEST(Patterns, LowSideShuntsHideWhatTheLegsSay)
{
    constexpr double kBlind = 0.064;
    struct {
        pattern_id_t id;
        double shown, most;
    } const list[] = {{PATTERN_H_PWM_L_PWM, -1, 1 - 4 * kBlind},
                      {PATTERN_H_PWM_L_ON, 1 - 2 * kBlind, 1},
                      {PATTERN_H_PWM_L_PWM_ALTERNATING, 1 - 4 * kBlind, 1}};
    for (const auto &p : list) {
        pattern_config_t c = make(p.id);
        c.low_side = true;
        c.shown = fixed(p.shown, 28);
        for (double u = 0.005; u < p.most; u += 0.01) {
            for (const bool reverse : {false, true}) {
                for (uint32_t s = 0; s < SECTORS; ++s) {
                    const Asked out(c, s, reverse, u);
                    const sector_t at = sector_legs(s, reverse);
                    uint32_t expected = 0;
                    for (const uint8_t leg : {at.high, at.low}) {
                        const bool high =
                            high_at(pm_leg(out.legs, leg), out.duty(leg), 2 * kN * (1 - kBlind)) ||
                            high_at(pm_leg(out.legs, leg), out.duty(leg), 2 * kN - 1);
                        expected |= high ? 1U << leg : 0U;
                    }
                    const uint32_t hidden = fixed(u, 28) > c.shown ? pattern_hidden(&c, s, reverse) : 0;
                    EXPECT_EQ(hidden, expected) << p.id << ' ' << u << ' ' << s;
                    EXPECT_EQ(pattern_hides_open(&c, s, false), sector_rising(s));
                    EXPECT_EQ(pattern_hides_open(&c, s, true), !sector_rising(s));
                }
            }
        }
    }
}

// Row 109, peak to peak, of two legs that conduct with the EMF of the speed behind them: 1.6 times as much with both chopped at
// once, half with both in turn.
TEST(Patterns, RippleOfTheCurrentIsThatOfTheFormula)
{
    using namespace bldc_rig;
    Machine m = hs();
    m.plant.inverter.dead_time_s = 0.3e-6;
    const double u = 0.45, T_s = 1 / m.plant.inverter.f_pwm_Hz, L = m.plant.machine.L_d0_H;
    double of[PATTERN_COUNT];
    for (int id = 0; id < PATTERN_COUNT; ++id) {
        Options o;
        o.pattern = static_cast<pattern_id_t>(id);
        Rig r(m, o, electrical(m, 46e3));
        r.watch = true;
        r.measure(30, 20, u);
        const double share = id == PATTERN_H_PWM_L_PWM               ? (1 - u * u) / 2
                             : id == PATTERN_H_PWM_L_PWM_ALTERNATING ? u * (1 - u) / 2
                                                                     : u * (1 - u);
        of[id] = r.ripples.mean();
        ASSERT_GT(r.ripples.n, 100);
        EXPECT_FALSE(r.six_step.lost);
        EXPECT_NEAR(of[id] / (share * 24 * T_s / (2 * L)), 1, kRipple) << id;
    }
    const double D = (1 + u) / 2;
    for (const int id : {PATTERN_H_PWM_L_ON, PATTERN_H_ON_L_PWM, PATTERN_PWM_ON, PATTERN_ON_PWM}) {
        EXPECT_NEAR(of[PATTERN_H_PWM_L_PWM] / of[id] / (2 * D * (1 - D) / (u * (1 - u))), 1, kRipple) << id;
        // Twin: pulses in turn
        EXPECT_LE(of[PATTERN_H_PWM_L_PWM_ALTERNATING] / of[id], 0.5 * (1 + kRipple)) << id;
    }
}

// Row 109: BLDC-HS at 40,000 r/min by any pattern; against 0 in place of v_dc / 2 by none.
TEST(Patterns, EachShowsTheCrossings)
{
    using namespace bldc_rig;
    for (int id = 0; id < PATTERN_COUNT; ++id) {
        for (const bool complementary : {true, false}) {
            Options o;
            o.pattern = static_cast<pattern_id_t>(id);
            o.complementary = complementary;
            const double u = pattern_chops_both(o.pattern) ? 0.58 : 0.5; // twice the dead time
            Rig r(hs(), o, electrical(hs(), 40e3)), twin(hs(), o, electrical(hs(), 40e3));
            r.measure(30, 40, u);
            EXPECT_FALSE(r.six_step.lost);
            EXPECT_LE(r.commutations.rms(), kRms) << id << complementary;
            twin.wrong_reference_V = 12;
            twin.measure(30, 40, u);
            EXPECT_TRUE(twin.six_step.lost) << id << complementary;
        }
    }
}

// An on time of `least` is long enough: u = 1/2 is N counts of the period, or N/2 in each of two pulses.
TEST(Patterns, TheOnTimeIsSampledDownToTheLeast)
{
    for (const auto &[id, on] : {std::pair{PATTERN_H_PWM_L_ON, kN - 1},
                                 {PATTERN_H_ON_L_PWM, kN - 1},
                                 {PATTERN_H_PWM_L_PWM_ALTERNATING, (kN - 1) / 2}}) {
        pattern_config_t c = make(id);
        c.half_period = kN - 1; // even
        c.least = static_cast<uint16_t>(on);
        EXPECT_EQ(sample_of(c, 0, PM_ONE / 2).legs, ZERO_LEGS_APART) << id;
        c.least++;
        EXPECT_NE(sample_of(c, 0, PM_ONE / 2).legs, ZERO_LEGS_APART) << id;
    }
}

// 1 ... 2 N - 1, also where the lead reaches beyond the period before, or there is none before its end.
TEST(Patterns, SamplesStayWithinThePeriod)
{
    pattern_config_t c = make(PATTERN_H_ON_L_PWM);
    c.lead = 600;
    EXPECT_EQ(sample_of(c, 0, fixed(0.25, 28)).at, 1); // the pulse ends at N / 4
    c.lead = 1;
    EXPECT_EQ(sample_of(c, 0, 0).at, 2 * kN - 1); // the off time at 2 N
    c.lead = 2;
    EXPECT_EQ(sample_of(c, 0, 0).at, 2 * kN - 2);
}

} // namespace
