// What block commutation learns of unlike phases and dividers, and how it takes that off voltages or instants.
#include "tests/unit/bldc/six_step_bench.h"

namespace
{

using namespace six_step_bench;

TEST(SixStepLearn, ThresholdsAreTakenOffTheVoltages)
{
    const double T = 9.37 * kPeriod;
    Bench b(T, configured(T), 0);
    b.s.thresholds.u_V[2] = fixed(kDivider, PM_Q_BITS);
    b.reset();
    b.seen = divider_of_C;
    b.run(120);
    expect_on_time(b, 0, T);
    EXPECT_EQ(b.s.expected.moved, 0);
    // Twin: not taken off, C is kDivider / kSwing of a sector early upwards, which the mean of a turn leaves alone.
    Bench twin(T, configured(T), 0);
    twin.reset();
    twin.seen = divider_of_C;
    twin.run(220);
    ASSERT_GT(twin.commutations.size(), 15U);
    EXPECT_NEAR(static_cast<double>(twin.commutations[12]), twin.z(12) + (0.5 - kDivider / kSwing) * T,
                kRounding);
    EXPECT_NEAR(static_cast<double>(twin.commutations[15]), twin.z(15) + (0.5 + kDivider / kSwing) * T,
                kRounding);
}

// The same of the third harmonic of the terminals, where instants are moved and voltages left as they are.
TEST(SixStepLearn, DeviationsOfAThirdHarmonicAreTakenOffTheInstants)
{
    const double T = 9.37 * kPeriod;
    Bench b(T, configured(T), 0);
    b.config.crossings = CROSSINGS_virtual_third;
    b.config.compared = 0;
    b.s.thresholds.u_V[2] = fixed(kDivider, PM_Q_BITS);
    b.reset();
    b.seen = divider_of_C;
    six_step_slow(&b.s, &b.config);
    EXPECT_NEAR(b.s.phase.shift[0], kDivider / kSwing * T, 2);
    EXPECT_NEAR(b.s.phase.shift[3], -kDivider / kSwing * T, 2);
    b.run(120);
    expect_on_time(b, 0, T);
    EXPECT_EQ(b.s.commutation.strikes, 0);
    // With thresholds compared nothing is moved.
    b.config.compared = -1;
    b.s.phase = {};
    six_step_slow(&b.s, &b.config);
    EXPECT_EQ(b.s.phase.shift[0], 0);
}

// Diodes carry the off time of a rotor that turns, at an on time that shows its terminals, and of no other.
TEST(SixStepDiodes, CarryWhereTheOnTimeShows)
{
    for (const bool diodes : {true, false}) {
        for (const double u : {0.02, 0.9}) {
            for (const bool young : {true, false}) {
                for (const bool slow : {true, false}) {
                    const double T = 9.37 * kPeriod;
                    Bench b(T, configured(T), 0);
                    b.config.pattern.complementary = !diodes;
                    b.reset();
                    EXPECT_TRUE(b.s.complementary) << "first";
                    b.s.commutation.young = young ? 1 : 0;
                    b.s.swing =
                        zero_crossing_swing(&b.config.crossing, static_cast<uint32_t>(slow ? 1000 * T : T));
                    six_step_freewheel(&b.s, &b.config, fixed(u, PM_Q_BITS), false);
                    EXPECT_EQ(b.s.complementary, !diodes || u < 0.1 || young || slow)
                        << diodes << u << young << slow;
                }
            }
        }
    }
}

// With both legs chopped at once only a current that flows throughout.
TEST(SixStepDiodes, CarryWhatDoesNotCease)
{
    const double T = 9.37 * kPeriod;
    for (const pattern_id_t id : {PATTERN_H_PWM_L_PWM, PATTERN_H_PWM_L_ON}) {
        for (const bool flows : {true, false}) {
            Bench b(T, configured(T), 0);
            b.config.pattern.id = id;
            b.config.pattern.complementary = false;
            b.reset();
            six_step_freewheel(&b.s, &b.config, fixed(0.9, PM_Q_BITS), flows);
            EXPECT_EQ(b.s.complementary, id == PATTERN_H_PWM_L_PWM && !flows) << id << flows;
        }
    }
}

// What a rotor with an uneven terminal teaches: once for each crossing, of a turn whose six intervals are measured.
TEST(SixStepLearn, LearnsOnceACrossingFromAWholeTurn)
{
    const double T = 9.37 * kPeriod;
    for (const bool reverse : {false, true}) {
        Bench b(T, configured(T), 0, reverse);
        b.config.thresholds.k_V = fixed(1.5 * 0.05, 32);
        b.config.thresholds.k_H = fixed(0.05, 32);
        b.reset();
        b.seen = divider_of_C;
        const uint32_t leg = reverse ? 1 : 2; // C and B change places
        int learnt = 0;
        int64_t k = 0;
        pm_q_t was = 0;
        uint8_t crossed = 0;
        while (k < 30 && b.within(40)) {
            b.period();
            if (b.s.commutation.crossed != crossed) {
                crossed = b.s.commutation.crossed;
                ++k;
            }
            const pm_q_t u = b.s.thresholds.u_V[leg];
            if (u == was) {
                continue;
            }
            // Upward crossings of this leg alone teach it. Late down, early up: D_V is four times the shift of a crossing.
            EXPECT_EQ(crossed, 0);
            const double D = 4 * (kDivider - real(was)) / kSwing * T;
            const double step = 0.05 * 1.5 * kSwing * D / (6 * T);
            EXPECT_NEAR(real(u - was), step, step / 50) << k; // the threshold has moved within the turn
            if (learnt == 0) {
                EXPECT_GE(k, 7); // six intervals lie between seven crossings
                EXPECT_LE(k, 18);
            }
            ++learnt;
            was = u;
        }
        EXPECT_GE(learnt, 2);
        EXPECT_EQ(b.s.alike, SECTORS);
    }
}

// Every crossing of these teaches: no D of thresholds.h is zero.
double uneven(int64_t k)
{
    static const double late[] = {400, -300, 150, -250, 350, -100};
    return late[k % 6];
}

bool differ(const pm_q_t a[PM_LEGS], const pm_q_t b[PM_LEGS])
{
    return !std::equal(a, a + PM_LEGS, b);
}

// Off-time crossings say nothing of on-time deviations: the next seven crossings of the on time have six intervals.
TEST(SixStepLearn, ACrossingOfTheOffTimeHoldsTheLearningForATurn)
{
    const double T = 9.37 * kPeriod;
    Bench b(T, configured(T), 0);
    b.config.pattern.id = PATTERN_H_ON_L_PWM; // both legs high in the off time: EMFs of either sign are seen
    b.late = uneven;
    b.reset();
    b.run(200);
    ASSERT_EQ(b.s.alike, SECTORS);
    ASSERT_EQ(b.s.commutation.whole, SECTORS);
    for (const int off : {1, 4}) {
        b.to_crossing();
        b.u = 0.05; // 100 counts of the period: shorter than `least`
        b.run(3);   // the samples asked for before are in
        for (int n = 0; n < off; ++n) {
            b.to_crossing();
            EXPECT_EQ(b.s.alike, 0U);
            EXPECT_FALSE(b.s.learn);
        }
        ASSERT_EQ(b.s.commutation.whole, SECTORS);
        b.u = kU;
        b.run(3);
        b.config.thresholds.k_V = fixed(1.5 * 0.05, 32);
        b.config.thresholds.k_H = fixed(0.05, 32);
        const thresholds_t before = b.s.thresholds;
        for (int on = 1; on <= 7; ++on) {
            const bool upwards = b.to_crossing() % 2 == 0;
            EXPECT_EQ(b.s.learn, true);
            b.run(3);
            EXPECT_EQ(differ(before.u_V, b.s.thresholds.u_V), on == 7 && upwards) << on;
            EXPECT_EQ(differ(before.u_H, b.s.thresholds.u_H), on == 7 && !upwards) << on;
        }
        b.config.thresholds.k_V = b.config.thresholds.k_H = 0;
        b.s.thresholds = {};
        b.run(200);
    }
}

// zero_crossing.h, `seen`: an eighth of the swing, of a rotor that starts or has eight samples in a sector and more.
TEST(SixStepLearn, WhatASectorMustShowIsAnEighthOfItsSwing)
{
    six_step_t s = {};
    const double T = 4 * kPeriod;
    const six_step_config_t c = configured(T);
    six_step_reset(&s, &c, PM_TURN(0.3), fixed(kOmega, PM_Q_BITS), 0);
    EXPECT_EQ(s.expected.seen, 0);
    const struct {
        uint32_t periods;
        uint8_t young;
        bool asked;
    } cases[] = {{7, 0, false}, {8, 0, true}, {9, 0, true}, {16, 0, true},
                 {2, 1, true},  {7, 6, true}, {2, 0, false}};
    for (const auto &x : cases) {
        s.expected.t_60 = x.periods * kPeriod;
        s.commutation.young = x.young;
        six_step_slow(&s, &c);
        const double swing = kSwing * T / (x.periods * kPeriod);
        EXPECT_NEAR(real(s.expected.seen), x.asked ? swing / 8 : 0, 1e-5) << x.periods;
    }
    s.thresholds.u_H[0] = 300;
    six_step_slow(&s, &c); // no mean: thresholds.h
    EXPECT_EQ(s.thresholds.u_H[0], 200);
    EXPECT_EQ(s.thresholds.u_H[1], -100);
}

// The instant that samples are held against has the shift of its sector in it, as those have.
TEST(SixStepLearn, TheNextCrossingIsExpectedWhereItIsSeenCorrected)
{
    const double T = 9.37 * kPeriod;
    for (const bool reverse : {false, true}) {
        Bench b(T, configured(T), 4, reverse);
        b.config.crossings = CROSSINGS_virtual_third;
        b.config.compared = 0;
        b.s.thresholds.u_V[reverse ? 1 : 2] = fixed(kDivider, PM_Q_BITS);
        b.reset();
        b.seen = divider_of_C;
        for (int64_t k = 5; k < 18; ++k) {
            b.to_crossing();
            EXPECT_EQ(b.s.commutation.crossed, k % 6);
            EXPECT_NEAR(static_cast<int32_t>(b.s.expected.at), b.z(k + 1), 2 * kRounding) << k;
        }
        EXPECT_GT(std::abs(b.s.phase.shift[0]), 1000);
    }
}

// The crossing that a begin is told may be far off: no interval from it teaches, also not after a run that has learnt.
TEST(SixStepLearn, ABeginForgetsThatATurnWasMeasured)
{
    const double T = 9.37 * kPeriod;
    Bench before(T, configured(T));
    before.config.thresholds.k_V = fixed(1.5 * 0.05, 32);
    before.config.thresholds.k_H = fixed(0.05, 32);
    before.reset();
    before.run(300);
    EXPECT_EQ(before.s.alike, SECTORS);
    Bench b(T, before.config, 0, false, before.now);
    b.s = before.s;
    b.s.thresholds = {};
    constexpr double kOff = 1.0 / 18; // of a turn, 20 degrees
    b.reset(0.1);
    six_step_reset(&b.s, &b.config, turns(crossing_turn(0) + 0.1 / 6 + kOff), fixed(kOmega, PM_Q_BITS),
                   static_cast<uint32_t>(b.now));
    for (int n = 0; n < 300; ++n) {
        b.period();
        for (uint32_t leg = 0; leg < PM_LEGS; ++leg) {
            EXPECT_LT(std::abs(real(b.s.thresholds.u_V[leg])) / kSwing * 60, 0.02) << n; // degrees
            EXPECT_LT(std::abs(real(b.s.thresholds.u_H[leg])) / kSwing * 60, 0.02) << n;
        }
    }
    EXPECT_EQ(b.s.alike, SECTORS);
}

} // namespace
