// gates.h: edges where the compare values put them, dead time after each, nothing at joined periods.
extern "C" {
#include "sim_plant/gates.h"
}

#include <gtest/gtest.h>

#include <vector>

namespace
{

// Instants are sums of a few doubles of 1e-4 s.
constexpr double time_tolerance_s = 1e-18;
constexpr double T = 100e-6, dead = 2e-6;
constexpr uint32_t counts = 1000; // 50 ns

struct Change {
    double t;
    gate_t gate; // of leg A
};

class Gates : public testing::Test
{
  protected:
    explicit Gates(double dead_time = dead)
    {
        plant_inverter_t inverter{};
        inverter.f_pwm_Hz = 1.0 / T;
        inverter.dead_time_s = dead_time;
        inverter.timer_counts = counts;
        gates_init(&gates, &inverter);
        gates_load(&gates, &pwm);
    }

    // One period with leg A at these compare values; B and C at half duty. Returns what A did.
    std::vector<Change> run(uint32_t first, uint32_t second, bool driven = true)
    {
        for (int k = 0; k < PLANT_LEGS; k++) {
            pwm.compare[k][0] = k == 0 ? first : counts / 2;
            pwm.compare[k][1] = k == 0 ? second : counts / 2;
            pwm.driven[k] = k == 0 ? driven : true;
        }
        gates_load(&gates, &pwm);
        std::vector<Change> changes;
        for (double t = 0.0; t < T; t = gates_next_s(&gates, t)) {
            gate_t before = gates.leg[0].gate;
            gates_update(&gates, t);
            if (gates.leg[0].gate != before) {
                changes.push_back({t, gates.leg[0].gate});
            }
        }
        return changes;
    }

    void expect(const std::vector<Change> &is, const std::vector<Change> &should) const
    {
        ASSERT_EQ(is.size(), should.size());
        for (size_t k = 0; k < is.size(); k++) {
            EXPECT_NEAR(is[k].t, should[k].t, time_tolerance_s) << k;
            EXPECT_EQ(is[k].gate, should[k].gate) << k;
        }
    }

    gates_t gates{};
    plant_pwm_t pwm{};
};

class GatesWithoutDeadTime : public Gates
{
  protected:
    GatesWithoutDeadTime() : Gates(0.0)
    {
    }
};

TEST_F(Gates, EdgesOfBothHalvesWithDeadTime)
{
    run(0, 0);
    expect(run(600, 200),
           {{20e-6, GATE_OFF}, {20e-6 + dead, GATE_HIGH}, {60e-6, GATE_OFF}, {60e-6 + dead, GATE_LOW}});
}

TEST_F(GatesWithoutDeadTime, EdgesChangeOver)
{
    run(0, 0);
    expect(run(600, 200), {{20e-6, GATE_HIGH}, {60e-6, GATE_LOW}});
}

TEST_F(Gates, ZeroAndFullDutyHaveNoEdges)
{
    run(0, 0);
    EXPECT_TRUE(run(0, 0).empty());
    run(counts, counts);
    EXPECT_TRUE(run(counts, counts).empty());
    EXPECT_TRUE(run(counts + 1, 3 * counts).empty()); // beyond the carrier is full
    EXPECT_EQ(gates.leg[0].gate, GATE_HIGH);
}

TEST_F(Gates, FullDutyOnOneSideOfTheBoundaryIsOneEdge)
{
    run(0, 0);
    run(500, counts);
    expect(run(500, 500), {{0.0, GATE_OFF},
                           {dead, GATE_LOW},
                           {25e-6, GATE_OFF},
                           {25e-6 + dead, GATE_HIGH},
                           {75e-6, GATE_OFF},
                           {75e-6 + dead, GATE_LOW}});
}

TEST_F(Gates, PulseShorterThanTheDeadTimeIsSwallowed)
{
    run(0, 0);
    expect(run(10, 10), {{49.5e-6, GATE_OFF}, {50.5e-6 + dead, GATE_LOW}});
}

TEST_F(Gates, GapShorterThanTheDeadTimeIsSwallowed)
{
    run(counts, counts);
    // low from 99.5 us into the next period until 0.5 us: the lower switch never closes
    run(counts, counts - 10);
    expect(run(counts - 10, counts), {{0.5e-6 + dead, GATE_HIGH}});
}

TEST_F(Gates, DeadTimeReachesIntoTheNextPeriod)
{
    run(500, 500);
    run(500, counts - 10);
    expect(run(0, 0), {{-0.5e-6 + dead, GATE_LOW}});
}

TEST_F(Gates, LegSwitchesOffAtOnceAndOnAfterADeadTime)
{
    run(counts, counts);
    expect(run(counts, counts, false), {{0.0, GATE_OFF}});
    expect(run(counts, counts), {{dead, GATE_HIGH}});
}

TEST_F(Gates, TripOpensAll)
{
    run(counts, counts);
    gates_off(&gates);
    for (const auto &leg : gates.leg) {
        EXPECT_EQ(leg.gate, GATE_OFF);
    }
    EXPECT_EQ(gates_next_s(&gates, 0.0), gates.period_s);
}

TEST_F(Gates, CoincidentEdgesAreOneEvent)
{
    run(0, 0);
    run(500, 500); // all three legs alike
    gates_load(&gates, &pwm);
    int events = 0;
    for (double t = 0.0; t < T; t = gates_next_s(&gates, t)) {
        gates_update(&gates, t);
        events++;
    }
    EXPECT_EQ(events, 5); // start, two edges, two ends of dead time
}

} // namespace
