// probe.h: the RC of a voltage channel against its closed form, however the interval is cut; the comparators'
// edges against the instants that follow from sine, offset, hysteresis and filter; the timer's resolution.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

extern "C" {
#include "sim_plant/probe.h"
}

namespace
{

constexpr double pi = 3.14159265358979323846;

// Sums of up to 1e4 steps in double precision, on volts up to 300.
constexpr double rounding_V = 1e-9;

struct Channels {
    double V[PROBE_CHANNELS];
};

struct Edge {
    double t_s;
    int leg;
    bool rising;
};

class Probe : public testing::Test
{
  protected:
    void init(int legs = 3, int sets = 1)
    {
        probe_init(&probe, &sensor, legs, sets);
    }

    void advance(double start_s, double duration_s, const Channels &before, const Channels &after)
    {
        probe_advance(&probe, start_s, duration_s, before.V, after.V);
    }

    // A step with terminal 0 alone off zero. The reference is a third of it, the difference two thirds.
    void advance(double start_s, double duration_s, double before_V, double after_V)
    {
        advance(start_s, duration_s, Channels{{before_V}}, Channels{{after_V}});
    }

    // Follows voltages(t) by straight lines, in periods; all edges with their time since the start.
    template <class Voltages>
    std::vector<Edge> follow(Voltages voltages, double step_s, int steps, int periods = 1)
    {
        std::vector<Edge> edges;
        for (int p = 0; p < periods; p++) {
            double period_s = p * steps * step_s;
            probe_start_period(&probe, 0.0);
            for (int n = 0; n < steps; n++) {
                advance(n * step_s, step_s, voltages(period_s + n * step_s),
                        voltages(period_s + (n + 1) * step_s));
            }
            EXPECT_EQ(probe.lost, 0u);
            for (int e = 0; e < probe.edges; e++) {
                const plant_capture_t &c = probe.edge[e];
                edges.push_back({period_s + c.count * sensor.capture_s, c.leg, c.rising});
            }
        }
        return edges;
    }

    plant_sensor_t sensor{};
    probe_t probe{};
};

TEST_F(Probe, ActiveWithFilterOrTimer)
{
    init();
    EXPECT_FALSE(probe_active(&probe));
    sensor.filter_s = 1e-6;
    init();
    EXPECT_TRUE(probe_active(&probe));
    sensor.filter_s = 0.0;
    sensor.capture_s = 1e-7;
    init();
    EXPECT_TRUE(probe_active(&probe));
}

TEST_F(Probe, WithoutFilterAChannelIsItsVoltage)
{
    sensor.capture_s = 1e-7;
    sensor.divider_error[1] = 0.02; // the converter's business
    init(6, 2);
    Channels before{}, after{};
    for (int k = 0; k < PROBE_CHANNELS; k++) {
        before.V[k] = 7.3 * k;
        after.V[k] = 100.1 + k;
    }
    advance(0.0, 1e-5, before, after);
    for (int k = 0; k < PROBE_CHANNELS; k++) {
        EXPECT_EQ(probe_voltage(&probe, k), after.V[k]) << k;
    }
}

// Neutrals keep their channel when there are fewer legs.
TEST_F(Probe, NeutralsFollowAllTerminals)
{
    sensor.filter_s = 1e-5;
    init(3, 1);
    Channels v{};
    v.V[PLANT_LEGS] = 100.0;
    advance(0.0, 1e-5, v, v);
    EXPECT_NEAR(probe_voltage(&probe, PLANT_LEGS), 100.0 * (1.0 - std::exp(-1.0)), rounding_V);
}

// Every channel with its own line a + b t from rest: v = a (1 - e) + b (t - tau (1 - e)), e = exp(-t / tau).
TEST_F(Probe, StepAndRampAreExactHoweverTheyAreCut)
{
    constexpr double duration_s = 1e-4;
    for (double tau_s : {1e-8, 3e-6, 1e-4, 0.1, 1e4}) {
        sensor.filter_s = tau_s;
        for (int cuts : {1, 3, 10000}) {
            init(6, 2);
            auto line = [&](double t_s) {
                Channels v;
                for (int k = 0; k < PROBE_CHANNELS; k++) {
                    v.V[k] = 50.0 + 10.0 * k + 1e5 * (k - 3) * t_s;
                }
                return v;
            };
            for (int n = 0; n < cuts; n++) { // of unequal length
                double from_s = duration_s * n * n / cuts / cuts;
                double to_s = duration_s * (n + 1) * (n + 1) / cuts / cuts;
                advance(from_s, to_s - from_s, line(from_s), line(to_s));
            }
            double gap = -std::expm1(-duration_s / tau_s);
            // t - tau gap, by its series where the difference would cancel
            double x = duration_s / tau_s;
            double lag_s =
                x < 1e-3 ? duration_s * x * (0.5 - x / 6.0 + x * x / 24.0) : duration_s - tau_s * gap;
            for (int k = 0; k < PROBE_CHANNELS; k++) {
                double expected_V = (50.0 + 10.0 * k) * gap + 1e5 * (k - 3) * lag_s;
                EXPECT_NEAR(probe_voltage(&probe, k), expected_V, rounding_V)
                    << "channel " << k << ", tau " << tau_s << ", cuts " << cuts;
            }
        }
    }
}

// A step a billion times shorter than the RC still counts: 1e4 of them are 1e-5 of the RC.
TEST_F(Probe, StepsMuchShorterThanTheFilterAddUp)
{
    sensor.filter_s = 1e-3;
    init();
    for (int n = 0; n < 10000; n++) {
        advance(n * 1e-12, 1e-12, 300.0, 300.0);
    }
    EXPECT_NEAR(probe_voltage(&probe, 0), -300.0 * std::expm1(-1e-5), 1e-12);
}

// Pulses at a duty: in the steady state the filter swings between the values of the periodic solution.
TEST_F(Probe, SwitchingJumpsLieBetweenSteps)
{
    constexpr double period_s = 1e-4, duty = 0.3, link_V = 300.0, tau_s = 40e-6;
    sensor.filter_s = tau_s;
    init();
    for (int n = 0; n < 100; n++) {
        advance(0.0, duty * period_s, link_V, link_V);
        advance(duty * period_s, (1.0 - duty) * period_s, 0.0, 0.0);
    }
    double low_V = link_V * (std::exp(duty * period_s / tau_s) - 1.0) / (std::exp(period_s / tau_s) - 1.0);
    EXPECT_NEAR(probe_voltage(&probe, 0), low_V, rounding_V);
}

// Three terminals, A sin(w t - 2 pi k / 3) + 150 V, with an offset and a divider error on the first one:
// the comparator of leg 0 sees A sin x + 2/3 offset + error (A sin x + 150 + offset).
class SineProbe : public Probe
{
  protected:
    static constexpr double amplitude_V = 100.0, middle_V = 150.0, omega_rad_s = 2.0 * pi * 50.0;
    // A chord in place of an arc of 1e-5 s misses the sine by up to A (w h)^2 / 8 = 1.2e-4 V, and a crossing
    // by (w h)^2 / 8 / w = 4e-9 s.
    static constexpr double step_s = 1e-5, chord_s = 4e-9;
    static constexpr int steps = 100, periods = 60; // three turns

    SineProbe()
    {
        sensor.capture_s = 1e-9;
    }

    std::vector<Edge> run(double offset_V = 0.0, double ripple_V = 0.0)
    {
        init();
        return follow(
            [=](double t_s) {
                Channels v{};
                for (int k = 0; k < 3; k++) {
                    v.V[k] = middle_V + amplitude_V * std::sin(omega_rad_s * t_s - 2.0 * pi * k / 3.0);
                }
                v.V[0] += offset_V + ripple_V * std::cos(pi * t_s / step_s);
                return v;
            },
            step_s, steps, periods);
    }

    // Edges of leg 0 from the second turn on lie at `late_rad` after n pi, rising, and `late_fall_rad`
    // falling.
    void expect_edges(const std::vector<Edge> &edges, double late_rad, double late_fall_rad) const
    {
        int found = 0;
        for (const Edge &edge : edges) {
            double x = omega_rad_s * edge.t_s;
            if (edge.leg != 0 || x < 3.0 || x > 18.0) {
                continue;
            }
            double base = edge.rising ? 2.0 * pi : pi;
            double n = std::round((x - base) / (2.0 * pi));
            double late = edge.rising ? late_rad : late_fall_rad;
            double expected_s = (base + 2.0 * pi * n + late) / omega_rad_s;
            EXPECT_NEAR(edge.t_s, expected_s, chord_s + sensor.capture_s) << x;
            found++;
        }
        EXPECT_EQ(found, 5); // pi ... 5 pi
    }
};

TEST_F(SineProbe, EdgesOfASymmetricalSetComeEverySixtyDegrees)
{
    std::vector<Edge> edges = run();
    expect_edges(edges, 0.0, 0.0);
    // rising 0, falling 2, rising 1, falling 0, rising 2, falling 1 of positive rotation
    constexpr int legs[] = {0, 2, 1};
    int n = 0;
    for (const Edge &edge : edges) {
        double x = omega_rad_s * edge.t_s;
        if (x < 6.0 || x > 18.5) {
            continue;
        }
        EXPECT_EQ(edge.leg, legs[n % 3]) << n;
        EXPECT_EQ(edge.rising, n % 2 == 0) << n;
        EXPECT_NEAR(edge.t_s, (2.0 * pi + n * pi / 3.0) / omega_rad_s, chord_s + sensor.capture_s) << n;
        n++;
    }
    EXPECT_EQ(n, 12);
}

TEST_F(SineProbe, OffsetMovesRisingAndFallingEdgesApart)
{
    double shift = std::asin(2.0 / 3.0 * 9.0 / amplitude_V);
    expect_edges(run(9.0), -shift, shift);
}

TEST_F(SineProbe, HysteresisDelaysBothEdges)
{
    sensor.hysteresis_V = 12.0; // in all: 6 V each way
    double delay = std::asin(6.0 / amplitude_V);
    expect_edges(run(), delay, delay);
}

// Gain against a reference without error: METHODS 10.4.2, here with the full common voltage.
TEST_F(SineProbe, DividerErrorShiftsByTheCommonVoltage)
{
    constexpr double error = 0.02;
    sensor.divider_error[0] = error;
    double shift = std::asin(error * middle_V / (1.0 + error) / amplitude_V);
    expect_edges(run(), -shift, shift);
}

// The whole set behind the same RC: amplitude and phase of the first-order lag.
TEST_F(SineProbe, FilterDelaysByItsPhaseAndHysteresisByMore)
{
    constexpr double tau_s = 400e-6;
    sensor.filter_s = tau_s;
    sensor.hysteresis_V = 12.0;
    double lag = std::atan(omega_rad_s * tau_s);
    double delay = lag + std::asin(6.0 / (amplitude_V * std::cos(lag)));
    expect_edges(run(), delay, delay);
}

// A ripple of 6 V, 4 V at the comparator, changing sign every step: many edges at each crossing without
// hysteresis, one with 10 V of it.
TEST_F(SineProbe, HysteresisSuppressesChatter)
{
    size_t without = run(0.0, 6.0).size();
    EXPECT_GT(without, 50u);
    sensor.hysteresis_V = 10.0;
    std::vector<Edge> edges = run(0.0, 6.0);
    int of_leg_0 = 0;
    for (const Edge &edge : edges) {
        of_leg_0 += edge.leg == 0;
    }
    EXPECT_EQ(of_leg_0, 6); // in three turns from just before a rising edge
    RecordProperty("edges_without_hysteresis", std::to_string(without));
}

// Rising through the level 2/3 v = h/2 of a ramp, and of its RC.
TEST_F(Probe, RampCrossesAtItsInstant)
{
    sensor.capture_s = 1e-12;
    sensor.hysteresis_V = 4.0;
    init();
    advance(2e-5, 1e-5, -1.0, 9.0); // crosses 3 V after 0.4 of the step
    ASSERT_EQ(probe.edges, 1);
    EXPECT_NEAR(probe.edge[0].count, 24e6, 1);
    EXPECT_EQ(probe.edge[0].leg, 0);
    EXPECT_TRUE(probe.edge[0].rising);
}

// 200 V (1 - exp(-t / tau)) at the comparator of terminal 0, through a share of the 200 V, in one step of up
// to 1e7 time constants.
TEST_F(Probe, FilteredStepCrossesAtItsInstant)
{
    for (double tau_s : {1e-9, 1e-6, 1e-5, 1e-4, 8e-3}) {
        for (double share : {0.01, 0.5, 1.0 - 1e-6}) {
            sensor.capture_s = tau_s * 1e-6;
            sensor.hysteresis_V = 2.0 * 200.0 * share;
            sensor.filter_s = tau_s;
            init();
            constexpr double duration_s = 1e-2;
            double expected_s = -tau_s * std::log1p(-share);
            advance(0.0, duration_s, 300.0, 300.0);
            if (expected_s > duration_s) {
                EXPECT_EQ(probe.edges, 0) << tau_s << " s, " << share;
                continue;
            }
            ASSERT_EQ(probe.edges, 1) << tau_s << " s, " << share; // legs 1 and 2, at -100 V, stay low
            // besides the timer, what probe.c solves to: a share of the step, or a voltage of 1e-11 V
            double slope_V_s = 200.0 * (1.0 - share) / tau_s;
            double margin_s = sensor.capture_s + 1e-12 * duration_s + 1e-11 / slope_V_s;
            EXPECT_NEAR(probe.edge[0].count * sensor.capture_s, expected_s, margin_s)
                << tau_s << " s, " << share;
        }
    }
}

// From 90 V, with the input rising from -120 V to 60 V in three time constants: the response dips below zero
// and comes back within one step, as 90 - 210 (1 - e^-x) + 60 (x - 1 + e^-x).
TEST_F(Probe, DipWithinOneStepGivesBothEdges)
{
    constexpr double tau_s = 1e-5;
    sensor.filter_s = tau_s;
    sensor.capture_s = 1e-11;
    init();
    advance(0.0, 1.0, 90.0, 90.0);
    ASSERT_EQ(probe.edges, 1);
    probe_start_period(&probe, 0.0);
    advance(0.0, 3.0 * tau_s, -120.0, 60.0);
    auto response_V = [](double x) {
        return 90.0 + (-210.0) * -std::expm1(-x) + 60.0 * (x + std::expm1(-x));
    };
    auto root = [&](double positive, double negative) {
        for (int n = 0; n < 100; n++) {
            double middle = 0.5 * (positive + negative);
            (response_V(middle) > 0.0 ? positive : negative) = middle;
        }
        return positive * tau_s;
    };
    double bottom = std::log(270.0 / 60.0); // slope -210 e^-x + 60 (1 - e^-x)
    ASSERT_LT(response_V(bottom), -1.0);
    ASSERT_GT(response_V(3.0), 1.0);
    std::vector<plant_capture_t> of_leg_0;
    for (int e = 0; e < probe.edges; e++) {
        if (probe.edge[e].leg == 0) {
            of_leg_0.push_back(probe.edge[e]);
        }
        if (e > 0) { // the three legs, solved one after another, in order of time
            EXPECT_LE(probe.edge[e - 1].count, probe.edge[e].count);
        }
    }
    ASSERT_EQ(of_leg_0.size(), 2u);
    EXPECT_FALSE(of_leg_0[0].rising);
    EXPECT_NEAR(of_leg_0[0].count * 1e-11, root(0.0, bottom), 1.1e-11);
    EXPECT_TRUE(of_leg_0[1].rising);
    EXPECT_NEAR(of_leg_0[1].count * 1e-11, root(3.0, bottom), 1.1e-11);
    EXPECT_EQ(probe.edges, 6);
}

// A jump ahead of a step, and a way back within it.
TEST_F(Probe, JumpIsAnEdgeAtTheStartOfItsStep)
{
    sensor.capture_s = 1e-7;
    init();
    advance(0.0, 1e-5, -10.0, -10.0);
    probe_start_period(&probe, 0.0);
    advance(2e-5, 1e-5, 5.0, -15.0);
    std::vector<plant_capture_t> of_leg_0;
    for (int e = 0; e < probe.edges; e++) {
        if (probe.edge[e].leg == 0) {
            of_leg_0.push_back(probe.edge[e]);
        }
    }
    ASSERT_EQ(of_leg_0.size(), 2u);
    EXPECT_TRUE(of_leg_0[0].rising);
    EXPECT_EQ(of_leg_0[0].count, 200u);
    EXPECT_FALSE(of_leg_0[1].rising);
    EXPECT_EQ(of_leg_0[1].count, 225u);
}

TEST_F(Probe, InstantsAreRoundedDownToTheTimer)
{
    constexpr double capture_s = 1e-6;
    sensor.capture_s = capture_s;
    struct {
        double instant_counts;
        uint32_t count;
    } const cases[] = {{0.0, 0}, {0.3, 0}, {0.99, 0}, {3.0, 3}, {3.5, 3}, {6.99, 6}, {7.0, 7}, {99.5, 99}};
    for (const auto &c : cases) {
        init();
        advance(c.instant_counts * capture_s, 1e-7, 10.0, 10.0);
        ASSERT_EQ(probe.edges, 1);
        EXPECT_EQ(probe.edge[0].count, c.count) << c.instant_counts;
    }
    // the last count is the end of the timer
    init();
    advance(1e4, 1e-7, 10.0, 10.0);
    ASSERT_EQ(probe.edges, 1);
    EXPECT_EQ(probe.edge[0].count, UINT32_MAX);
}

// Edges of the PWM fall onto counts of the same timer; the time of the plant, a sum of steps since the start
// of a run, has them a little early.
TEST_F(Probe, EdgesOnACountBelongToIt)
{
    sensor.capture_s = 0.5e-4 / 8400;
    for (uint32_t n = 1; n < 8400; n += 7) {
        init();
        double start_s = 100.0; // seconds into the run
        double edge_s = start_s + (1.0 - (8400 - n) / 8400.0) * 0.5e-4;
        advance(edge_s - start_s, 1e-7, 10.0, 10.0);
        ASSERT_EQ(probe.edges, 1);
        EXPECT_EQ(probe.edge[0].count, n);
    }
}

TEST_F(Probe, SetsHaveTheirOwnReference)
{
    sensor.capture_s = 1e-7;
    init(6, 2);
    Channels v{{10.0, 0.0, 0.0, 200.0, 200.0, 230.0}};
    advance(0.0, 1e-5, v, v);
    ASSERT_EQ(probe.edges, 2);
    EXPECT_EQ(probe.edge[0].leg, 0);
    EXPECT_EQ(probe.edge[1].leg, 5);
}

// Equal terminals, whose difference is nothing but rounding.
TEST_F(Probe, RoundingIsNoSignal)
{
    sensor.capture_s = 1e-7;
    for (double filter_s : {0.0, 1e-5}) {
        sensor.filter_s = filter_s;
        init();
        for (int n = 0; n < 1000; n++) {
            double v_V = 300.0 * std::sin(0.1 * n);
            Channels all{{v_V, v_V, v_V}};
            advance(0.0, 1e-6, all, all);
        }
        EXPECT_EQ(probe.edges, 0) << filter_s;
    }
}

TEST_F(Probe, OverflowKeepsTheEarliestAndCountsTheRest)
{
    sensor.capture_s = 1e-7;
    init();
    // terminal 0 alone: each step sends leg 0 one way, legs 1 and 2 the other
    for (int n = 0; n < 30; n++) {
        double v_V = n % 2 == 0 ? -10.0 : 10.0;
        advance(n * 1e-6, 1e-6, v_V, v_V);
    }
    // leg 0 starts low: its first step is no edge
    constexpr int edges = 30 * 3 - 1;
    EXPECT_EQ(probe.edges, PROBE_EDGES);
    EXPECT_EQ(probe.lost, static_cast<unsigned>(edges - PROBE_EDGES));
    for (int e = 0; e < PROBE_EDGES; e++) {
        EXPECT_EQ(probe.edge[e].count, 10u * static_cast<uint32_t>((e + 1) / 3)) << e;
    }
    probe_start_period(&probe, 0.0);
    EXPECT_EQ(probe.edges, 0);
    EXPECT_EQ(probe.lost, 0u);
}

// One place left and three edges: leg 0 after 0.8 of the step, leg 1 after 0.2, leg 2 after 0.5.
TEST_F(Probe, OverflowWithinAStepIsPlacedByItsTime)
{
    sensor.capture_s = 1e-7;
    init();
    Channels before{{-8.0, -2.0, 10.0}}, after{{2.0, 8.0, -10.0}};
    advance(0.0, 1e-6, before, before);
    probe.edges = PROBE_EDGES - 1;
    advance(1e-6, 1e-6, before, after);
    EXPECT_EQ(probe.edges, PROBE_EDGES);
    EXPECT_EQ(probe.edge[PROBE_EDGES - 1].leg, 1);
    EXPECT_EQ(probe.edge[PROBE_EDGES - 1].count, 12u);
    EXPECT_EQ(probe.lost, 2u);
}

TEST_F(Probe, NoTimerNoEdges)
{
    sensor.filter_s = 1e-6;
    init();
    advance(0.0, 1e-5, 10.0, 10.0);
    advance(1e-5, 1e-5, -10.0, -10.0);
    EXPECT_EQ(probe.edges, 0);
    EXPECT_EQ(probe.lost, 0u);
}

TEST_F(Probe, StepWithoutDurationHasNoEffect)
{
    sensor.filter_s = 1e-6;
    sensor.capture_s = 1e-7;
    init();
    advance(0.0, 0.0, 10.0, 20.0);
    EXPECT_EQ(probe_voltage(&probe, 0), 0.0);
    EXPECT_EQ(probe.edges, 0);
}

} // namespace
