#include "injection/initial_pulses.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/injection/pulse_rig.h"

namespace
{

using namespace pulse_rig;

const Method<initial_pulses_t> kSix = {&initial_pulses_step, &initial_pulses_find};

// METHODS-ADDENDUM.md B (b), row 100, with a 12-bit converter, noise, and gains of 1.02, 1 and 0.98.
constexpr double kGain = 0.02;
constexpr double kIpmMean_deg = 0.3, kIpmMost_deg = 1;
constexpr double kSpmMean_deg = 1, kSpmMost_deg = 2.5;
constexpr double kLongest_s = 20e-3;
// The sum of six vectors cancels the saturation but for its products with the saliency.
constexpr double kIdeal_deg = 0.5;

TEST(InitialPulses, FindsIpm1000)
{
    expect_grid(kSix, ipm(kGain), kIpmMean_deg, kIpmMost_deg);
}

TEST(InitialPulses, FindsSpm400)
{
    expect_grid(kSix, spm(kGain), kSpmMean_deg, kSpmMost_deg);
}

// Without the sums of the currents: at least 3 degrees on SPM-400, of which E17 gives 3.5 per percent at most.
TEST(InitialPulses, TwinWithoutTheGainsErrs)
{
    const Method<initial_pulses_t> twin = {
        [](initial_pulses_t *self, const pulses_config_t *c, pm_abc_t i, pulses_out_t *out) {
            const pm_q_t sum = i.a + i.b + i.c; // what Clarke leaves out anyway, and nothing else
            return initial_pulses_step(self, c, {i.a - sum / 3, i.b - sum / 3, i.c - sum / 3}, out);
        },
        &initial_pulses_find};
    const Grid g = grid(twin, spm(kGain));
    EXPECT_GE(g.mean_deg, 3);
}

TEST(InitialPulses, TakesTwentyMilliseconds)
{
    for (const Rig &r : {ipm(0), spm(0)}) {
        const Result x = find(kSix, r, config(r), 0.7);
        EXPECT_LE((x.periods + x.computing) * r.base.period_s, kLongest_s);
        EXPECT_NEAR(x.computing * r.base.period_s, 5e-3, 1e-9);
        EXPECT_LE(x.periods, 6 * (2 * config(r).periods + 5)); // as the header says
    }
}

TEST(InitialPulses, ExactOnAnIdealInverter)
{
    const Rig r = ideal(ipm(0));
    for (int k = 0; k < 24; ++k) {
        const Result x = find(kSix, r, config(r), k * 15 * kDegree);
        ASSERT_EQ(x.state, PM_DONE);
        EXPECT_NEAR(x.error_deg, 0, kIdeal_deg) << k;
    }
}

// y has 3 i_noise of noise and w 2, as the header says: the spread of the angle is that of y over 2 |y|.
TEST(InitialPulses, MarginIsInDeviationsOfTheNoise)
{
    Rig r = ideal(ipm(0));
    r.plant.sensor.bits = 12;
    r.plant.sensor.noise_lsb = 4;
    r.noise_A = 4 * 2 * r.base.i_A / 4096;
    double squares = 0, margin = 0;
    constexpr int kRuns = 200;
    const double least = find(kSix, ideal(ipm(0)), config(ideal(ipm(0))), 0.4).error_deg;
    for (int k = 0; k < kRuns; ++k) {
        const Result x = find(kSix, r, config(r), 0.4, static_cast<uint64_t>(k) + 1);
        ASSERT_EQ(x.state, PM_DONE);
        squares += std::pow((x.error_deg - least) * kDegree * 2, 2) / kRuns;
        margin += x.margin / kRuns;
    }
    // The margin is the smaller one: of the polarity. That of y is the inverse of its angle's spread.
    const double y = 6 * r.i_pulse_A * 0.21 / 1.0 / (3 * r.noise_A);
    EXPECT_NEAR(1 / std::sqrt(squares), y, 0.35 * y);
    EXPECT_GT(margin, 5);
    EXPECT_LT(margin, y);
}

// A pulse and its opposite turn the rotor back and forth; the current is what was asked for.
TEST(InitialPulses, TorqueAveragesOutAndCurrentKeepsToItsPeak)
{
    const Rig r = ipm(0.01);
    for (const double theta : {0.2, 1.1, 2.5}) {
        const Result x = find(kSix, r, config(r), theta);
        const double one_pulse = 1.5 * 3 * 0.236 * r.i_pulse_A * x.periods * r.base.period_s / 12;
        EXPECT_LE(std::abs(x.turned_Nms), 0.25 * one_pulse) << theta;
        EXPECT_LE(x.i_most_A, 1.15 * r.i_pulse_A); // saturation lets it rise a little faster
        EXPECT_GE(x.i_most_A, 0.8 * r.i_pulse_A);
    }
}

// Duties: the pulse's leg high against the others, or low against them; never both switches of all legs.
TEST(InitialPulses, SequenceIsSixPulsesInPairs)
{
    pulses_config_t c = config(ipm(0.01));
    initial_pulses_t self;
    initial_pulses_reset(&self);
    std::vector<int> patterns;
    pm_procedure_t state = PM_RUNNING;
    int driven = 0;
    bool was_driven[2] = {false, false}; // by the last two calls; current flows at the end of a driven period
    for (int k = 0; k < 1000 && state == PM_RUNNING; ++k) {
        pulses_out_t out;
        const pm_q_t current = was_driven[1] ? PM_ONE / 10 : 0;
        state = initial_pulses_step(&self, &c, {current, -current / 2, -current / 2}, &out);
        was_driven[1] = was_driven[0];
        was_driven[0] = out.driven;
        const bool zero_vector = out.driven && out.duty[0] == 0 && out.duty[1] == 0 && out.duty[2] == 0;
        if (!out.driven || zero_vector) {
            EXPECT_EQ(zero_vector, driven > 0); // one behind each pulse
            driven = 0;
            continue;
        }
        int pattern = 0;
        for (int leg = 0; leg < 3; ++leg) {
            EXPECT_TRUE(out.duty[leg] == 0 || out.duty[leg] == c.duty);
            pattern |= (out.duty[leg] != 0 ? 1 : 0) << leg;
        }
        if (driven++ == 0) {
            patterns.push_back(pattern);
        }
        EXPECT_LE(driven, c.periods);
        EXPECT_EQ(pattern, patterns.back());
    }
    patterns.resize(6);
    EXPECT_EQ(patterns, (std::vector<int>{1, 6, 2, 5, 4, 3}));
}

// Commanded in n calls, a pulse acts from the second on and ends at the call after the last one's period, when a zero
// vector begins.
TEST(InitialPulses, TakesTheCurrentAtTheEndOfThePulse)
{
    const pulses_config_t c = config(ipm(0.01));
    const pm_q_t kStep = PM_ONE / 100; // a current that grows from call to call, above i_zero
    initial_pulses_t self;
    initial_pulses_reset(&self);
    for (int call = 0; call <= c.periods + 1; ++call) {
        pulses_out_t out;
        EXPECT_FALSE(self.train.decaying) << call;
        initial_pulses_step(&self, &c, {kStep * call, -kStep * call, 0}, &out);
        EXPECT_EQ(out.driven, call <= c.periods) << call;
        EXPECT_EQ(out.duty[0], call < c.periods ? c.duty : 0) << call;
    }
    EXPECT_TRUE(self.train.decaying);
    EXPECT_EQ(self.train.i.a, kStep * (c.periods + 1));
    EXPECT_EQ(self.train.i.b, -kStep * (c.periods + 1));
}

// The next pulse waits for three samples without current in a row.
TEST(InitialPulses, ACurrentBeginsTheQuietAnew)
{
    const pulses_config_t c = config(ipm(0.01));
    pulses_t train = {};
    pulses_out_t out;
    const pm_abc_t flows = {PM_ONE / 10, -PM_ONE / 20, -PM_ONE / 20}, none = {0, 0, 0};
    for (int call = 0; call <= c.periods + 1; ++call) {
        ASSERT_EQ(pulses_step(&train, &c, 0, false, flows, &out), PM_RUNNING);
    }
    ASSERT_TRUE(train.decaying);
    for (const pm_abc_t &i : {none, none, flows, none, none}) {
        EXPECT_EQ(pulses_step(&train, &c, 0, false, i, &out), PM_RUNNING);
        EXPECT_FALSE(out.driven);
    }
    EXPECT_EQ(pulses_step(&train, &c, 0, false, none, &out), PM_DONE);
}

// Each of the three rows, with the sign of its pulse, and the sum of the vectors.
TEST(InitialPulses, AddsWhatThePulsesSay)
{
    pulses_t train = {};
    train.i = {100, 20, 3};
    pulses_add(&train, 1, false);
    train.i = {7000, 500, 90};
    pulses_add(&train, 1, true);
    for (int x = 0; x < 3; ++x) {
        EXPECT_EQ(train.e[x][0], x == 1 ? -6900 : 0);
        EXPECT_EQ(train.e[x][1], x == 1 ? -480 : 0);
        EXPECT_EQ(train.e[x][2], x == 1 ? -87 : 0);
    }
}

// Currents of a machine, L_q/L_d up to 3, through sensors of known gains: these come out but for their common part.
TEST(InitialPulses, FindsTheGainsThatTheSensorsHave)
{
    for (const double saliency : {0.05, 0.3, 0.5}) {
        for (int n = 0; n < 24; ++n) {
            const double theta = n * 15 * kDegree;
            const double gains[3] = {0.05 * std::cos(n), 0.05 * std::sin(2.0 * n), -0.03};
            pulses_t train = {};
            for (int x = 0; x < 3; ++x) {
                for (int k = 0; k < 3; ++k) {
                    const double g_x = x * 2 * bench::kPi / 3, g_k = k * 2 * bench::kPi / 3;
                    const double i = std::cos(g_k - g_x) + saliency * std::cos(2 * theta - g_x - g_k);
                    train.e[x][k] = fixed(0.5 * i * (1 + gains[k]), 28);
                }
            }
            pm_procedure_t state = PM_RUNNING;
            while (state == PM_RUNNING) {
                state = pulses_balance(&train);
            }
            ASSERT_EQ(state, PM_DONE);
            const double mean = (gains[0] + gains[1] + gains[2]) / 3;
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(real(train.g[k]), gains[k] - mean, 4e-3)
                    << saliency << ' ' << n; // of second order
            }
        }
    }
}

// Two sensors exchanged, or one dead: no gains.
TEST(InitialPulses, RefusesSensorsThatAreNotWhatTheyShouldBe)
{
    for (const int fault : {0, 1}) {
        const Method<initial_pulses_t> wrong = {
            fault == 0 ? [](initial_pulses_t *self, const pulses_config_t *c, pm_abc_t i,
                            pulses_out_t *out) { return initial_pulses_step(self, c, {i.b, i.a, i.c}, out); }
                       : [](initial_pulses_t *self, const pulses_config_t *c, pm_abc_t i,
                            pulses_out_t *out) { return initial_pulses_step(self, c, {i.a, 0, i.c}, out); },
            &initial_pulses_find};
        EXPECT_EQ(find(wrong, ipm(0), config(ipm(0)), 0.5).state, PM_FAILED_UNEVEN) << fault;
    }
}

TEST(InitialPulses, FailsWithoutSaliency)
{
    Rig r = ipm(0.01);
    r.plant.machine.L_q0_H = r.plant.machine.L_d0_H = 50e-3;
    r.plant.machine.c_A_Wb5 = 0;
    for (const double theta : {0.0, 0.8, 2.0}) {
        EXPECT_EQ(find(kSix, r, config(r), theta).state, PM_FAILED_SALIENCY) << theta;
    }
}

TEST(InitialPulses, FailsWithoutPolarity)
{
    Rig r = ipm(0.01);
    r.plant.machine = {6.0, 43e-3, 75e-3, 0.0, 0.236, 3}; // salient, not saturating
    for (const double theta : {0.0, 0.8, 2.0}) {
        EXPECT_EQ(find(kSix, r, config(r), theta).state, PM_FAILED_POLARITY) << theta;
    }
}

// A current that does not end: a stuck sensor, a short circuit.
TEST(InitialPulses, FailsWhenTheCurrentDoesNotFall)
{
    const pulses_config_t c = config(ipm(0.01));
    initial_pulses_t self;
    initial_pulses_reset(&self);
    pm_procedure_t state = PM_RUNNING;
    int periods = 0;
    while (state == PM_RUNNING && periods < 10000) {
        pulses_out_t out;
        state = initial_pulses_step(&self, &c, {PM_ONE / 5, -PM_ONE / 10, -PM_ONE / 10}, &out);
        ++periods;
        if (periods > c.periods + 2) {
            EXPECT_FALSE(out.driven);
        }
    }
    EXPECT_EQ(state, PM_FAILED_TIMEOUT);
    EXPECT_LE(periods, c.periods + c.timeout + 4);
}

// A wire that is off, or a winding that is open.
TEST(InitialPulses, FailsWhenNoCurrentRises)
{
    Rig r = ipm(0.01);
    r.plant.machine.L_d0_H *= 1e4;
    r.plant.machine.L_q0_H *= 1e4;
    r.plant.machine.c_A_Wb5 = 0;
    EXPECT_EQ(find(kSix, r, config(r), 0.5).state, PM_FAILED_OPEN);
}

// Of a board whose legs ring with the winding by more than the pulse is wide: no position, but no wire is off.
TEST(InitialPulses, LessThanWhatRingsIsNotOpen)
{
    const Rig r = ipm(0.01);
    pulses_config_t c = config(r);
    c.i_zero = PM_ONE;
    EXPECT_NE(find(kSix, r, c, 0.5).state, PM_FAILED_OPEN);
    c.i_noise = PM_ONE / 4;
    EXPECT_EQ(find(kSix, r, c, 0.5).state, PM_FAILED_OPEN);
}

} // namespace
