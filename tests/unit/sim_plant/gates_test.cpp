// gates.h: edges where the compare values put them, dead time after each, nothing at joined periods; delays
// of the switches, and what conducts when one of them has failed.
extern "C" {
#include "sim_plant/gates.h"
}

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
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
    explicit Gates(double dead_time = dead, double turn_on = 0.0, double turn_off = 0.0, int legs = 3)
    {
        plant_inverter_t inverter{};
        inverter.f_pwm_Hz = 1.0 / T;
        inverter.dead_time_s = dead_time;
        inverter.turn_on_s = turn_on;
        inverter.turn_off_s = turn_off;
        inverter.timer_counts = counts;
        gates_init(&gates, &inverter, legs);
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
        for (double t = 0.0; t < T; t = gates_next_s(&gates)) {
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

class GatesWithBootstrap : public Gates
{
  protected:
    static constexpr double charge_s = 200e-6, hold_s = 1e-3, lockout = 0.7;

    GatesWithBootstrap()
    {
        plant_inverter_t inverter{};
        inverter.f_pwm_Hz = 1.0 / T;
        inverter.dead_time_s = dead;
        inverter.timer_counts = counts;
        inverter.bootstrap_charge_s = charge_s;
        inverter.bootstrap_hold_s = hold_s;
        inverter.bootstrap_lockout = lockout;
        gates_init(&gates, &inverter, 3);
    }
};

// Full after ln(1 / 0.3) = 1.204 time constants: 241 us, in the third period with the lower switch on.
TEST_F(GatesWithBootstrap, TheUpperSwitchStaysOpenUntilItsCapacitorIsCharged)
{
    expect(run(500, 500), {{dead, GATE_LOW}, {25e-6, GATE_OFF}, {75e-6 + dead, GATE_LOW}});
    const double low_s = 25e-6 - dead;
    const double charge = 1.0 - std::exp(-low_s / charge_s) - (50e-6 + dead) * (1.0 - lockout) / hold_s;
    EXPECT_NEAR(gates.leg[0].charge, std::fmax(charge, 0.0), 1e-12);
    run(0, 0);
    run(0, 0);
    run(0, 0);
    EXPECT_GT(gates.leg[0].charge, lockout);
    expect(run(500, 500),
           {{25e-6, GATE_OFF}, {25e-6 + dead, GATE_HIGH}, {75e-6, GATE_OFF}, {75e-6 + dead, GATE_LOW}});
}

// From full it lasts hold_s, at full duty and with the leg off alike.
TEST_F(GatesWithBootstrap, FullDutyLastsAsLongAsTheCharge)
{
    for (int period = 0; period < 50; period++) {
        run(0, 0);
    }
    const double full = gates.leg[0].charge;
    EXPECT_NEAR(full, 1.0, 1e-6);
    run(500, counts);
    const double at_s = 25e-6; // begins to fall
    int periods = 1;
    std::vector<Change> changes;
    for (; changes.empty() && periods < 20; periods++) {
        changes = run(counts, counts);
    }
    ASSERT_EQ(changes.size(), 1u);
    EXPECT_EQ(changes[0].gate, GATE_OFF);
    EXPECT_NEAR((periods - 1) * T + changes[0].t - at_s, hold_s, 1e-9);
    EXPECT_TRUE(run(counts, counts).empty()); // stays open
    EXPECT_EQ(gates.leg[0].gate, GATE_OFF);
}

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
    EXPECT_EQ(gates_next_s(&gates), gates.period_s);
}

// Switches that follow their signals late, the opening one less so than the closing one.
class SlowSwitches : public Gates
{
  protected:
    static constexpr double on = 0.7e-6, off = 1.1e-6, closing = dead + on;

    SlowSwitches() : Gates(dead, on, off)
    {
    }
};

TEST_F(SlowSwitches, OpenAndCloseTheirDelaysAfterTheEdges)
{
    run(0, 0);
    expect(run(600, 200), {{20e-6 + off, GATE_OFF},
                           {20e-6 + closing, GATE_HIGH},
                           {60e-6 + off, GATE_OFF},
                           {60e-6 + closing, GATE_LOW}});
}

TEST_F(SlowSwitches, PulseIsLongerByTheOpeningAndShorterByTheClosingDelay)
{
    run(0, 0);
    expect(run(30, 30), {{48.5e-6 + off, GATE_OFF},
                         {48.5e-6 + closing, GATE_HIGH},
                         {51.5e-6 + off, GATE_OFF},
                         {51.5e-6 + closing, GATE_LOW}});
}

TEST_F(SlowSwitches, PulseShorterThanTheClosingDelayIsSwallowed)
{
    run(0, 0);
    expect(run(26, 26), {{48.7e-6 + off, GATE_OFF}, {51.3e-6 + closing, GATE_LOW}});
}

// A command that has changed back before the switch has opened: it opens all the same, for its signal was
// gone, and closes again a dead time after the second edge.
TEST_F(SlowSwitches, GlitchWithinTheOpeningDelayOpensTheSwitch)
{
    run(0, 0);
    expect(run(10, 10), {{49.5e-6 + off, GATE_OFF}, {50.5e-6 + closing, GATE_LOW}});
}

TEST_F(SlowSwitches, DelaysReachIntoTheNextPeriod)
{
    run(500, 500);
    run(500, counts - 10); // falls at 99.5 us
    expect(run(0, 0), {{-0.5e-6 + off, GATE_OFF}, {-0.5e-6 + closing, GATE_LOW}});
}

TEST_F(SlowSwitches, TripDoesNotWaitForThem)
{
    run(counts, counts);
    gates_off(&gates);
    EXPECT_EQ(gates.leg[0].gate, GATE_OFF);
    EXPECT_EQ(gates_next_s(&gates), gates.period_s);
}

class SixLegs : public Gates
{
  protected:
    SixLegs() : Gates(dead, 0.7e-6, 1.1e-6, 6)
    {
    }
};

TEST_F(SixLegs, EachFollowsItsOwnCompareValues)
{
    std::vector<Change> changes[PLANT_LEGS];
    for (int k = 0; k < PLANT_LEGS; k++) {
        pwm.driven[k] = true;
    }
    for (uint32_t first : {0u, 100u}) { // of leg A; each further leg 100 counts more
        for (int k = 0; k < PLANT_LEGS; k++) {
            pwm.compare[k][0] = pwm.compare[k][1] = first > 0 ? first + 100 * static_cast<uint32_t>(k) : 0;
            changes[k].clear();
        }
        gates_load(&gates, &pwm);
        for (double t = 0.0; t < T; t = gates_next_s(&gates)) {
            gate_t before[PLANT_LEGS];
            for (int k = 0; k < PLANT_LEGS; k++) {
                before[k] = gates.leg[k].gate;
            }
            gates_update(&gates, t);
            for (int k = 0; k < PLANT_LEGS; k++) {
                if (gates.leg[k].gate != before[k]) {
                    changes[k].push_back({t, gates.leg[k].gate});
                }
            }
        }
    }
    for (int k = 0; k < PLANT_LEGS; k++) {
        double half_s = 0.5 * T * 0.1 * (k + 1);
        expect(changes[k], {{50e-6 - half_s + 1.1e-6, GATE_OFF},
                            {50e-6 - half_s + 2.7e-6, GATE_HIGH},
                            {50e-6 + half_s + 1.1e-6, GATE_OFF},
                            {50e-6 + half_s + 2.7e-6, GATE_LOW}});
    }
}

// Whatever the compare values: a switch closes only after the other has been open for the dead time and the
// difference of the delays, and nothing happens between the announced instants.
TEST_F(SixLegs, NeverOverlapNorMissAnInstant)
{
    std::mt19937 random(1);
    auto draw = [&](uint32_t below) { return static_cast<uint32_t>(random() % below); };
    double opened[PLANT_LEGS] = {};
    int closings = 0;
    for (int period = 0; period < 2000; period++) {
        for (int k = 0; k < PLANT_LEGS; k++) {
            for (uint32_t &compare : pwm.compare[k]) {
                uint32_t kind = draw(8);
                compare = kind == 0 ? 0 : kind == 1 ? counts : kind < 4 ? draw(60) : draw(counts);
            }
            pwm.driven[k] = draw(16) != 0;
        }
        gates_load(&gates, &pwm);
        double start = period * T;
        for (double t = 0.0; t < T;) {
            gate_t before[PLANT_LEGS];
            for (int k = 0; k < PLANT_LEGS; k++) {
                before[k] = gates.leg[k].gate;
            }
            gates_update(&gates, t);
            for (int k = 0; k < PLANT_LEGS; k++) {
                gate_t gate = gates.leg[k].gate;
                if (gate == before[k]) {
                    continue;
                }
                ASSERT_TRUE(gate == GATE_OFF || before[k] == GATE_OFF) << period << " leg " << k;
                if (gate == GATE_OFF) {
                    opened[k] = start + t;
                } else {
                    closings++;
                    ASSERT_GE(start + t - opened[k], 2.7e-6 - 1.1e-6 - 2.0 * gates.coincident_s) << k;
                }
            }
            double next = gates_next_s(&gates);
            ASSERT_GT(next, t);
            if (next - t > 3.0 * gates.coincident_s) {
                ASSERT_FALSE(gates_update(&gates, 0.5 * (t + next))) << period << " after " << t;
            }
            t = next;
        }
    }
    EXPECT_GT(closings, 10000);
}

// One switch chopped: both are off for the rest, and it closes without dead time but for the first time.
TEST_F(SlowSwitches, OneSwitchChoppedClosesWithoutDeadTime)
{
    run(0, 0);
    pwm.state[0] = PLANT_LEG_UPPER;
    expect(run(600, 200), {{off, GATE_OFF}, {20e-6 + closing, GATE_HIGH}, {60e-6 + off, GATE_OFF}});
    expect(run(600, 200), {{20e-6 + on, GATE_HIGH}, {60e-6 + off, GATE_OFF}});
    pwm.state[0] = PLANT_LEG_LOWER;
    expect(run(600, 200), {{closing, GATE_LOW}, {20e-6 + off, GATE_OFF}, {60e-6 + on, GATE_LOW}});
    expect(run(600, 200), {{20e-6 + off, GATE_OFF}, {60e-6 + on, GATE_LOW}});
}

// The switches exchanged: the lower one about the middle of the period.
TEST_F(SlowSwitches, InvertedLegsExchangeTheirSwitches)
{
    run(0, 0);
    run(600, 200);
    pwm.state[0] = PLANT_LEG_LOWER_INVERTED;
    run(600, 200);
    expect(run(600, 200), {{20e-6 + on, GATE_LOW}, {60e-6 + off, GATE_OFF}});
    pwm.state[0] = PLANT_LEG_INVERTED;
    run(600, 200);
    expect(run(600, 200), {{20e-6 + off, GATE_OFF},
                           {20e-6 + closing, GATE_LOW},
                           {60e-6 + off, GATE_OFF},
                           {60e-6 + closing, GATE_HIGH}});
}

TEST_F(Gates, HeldLegsIgnoreTheCarrier)
{
    run(0, 0);
    pwm.state[0] = PLANT_LEG_HIGH;
    expect(run(600, 200), {{0.0, GATE_OFF}, {dead, GATE_HIGH}});
    EXPECT_TRUE(run(600, 200).empty());
    pwm.state[0] = PLANT_LEG_LOW;
    expect(run(600, 200), {{0.0, GATE_OFF}, {dead, GATE_LOW}});
    EXPECT_TRUE(run(600, 200).empty());
    expect(run(600, 200, false), {{0.0, GATE_OFF}}); // not driven: off, whatever its state
}

TEST_F(Gates, StateChangesWithinThePeriod)
{
    run(0, 0);
    run(0, 0);
    const bool driven[PLANT_LEGS] = {true, true, true};
    const plant_leg_state_t high[PLANT_LEGS] = {PLANT_LEG_HIGH};
    gates_drive(&gates, driven, high, 30e-6);
    std::vector<Change> changes;
    for (double t = 0.0; t < T; t = gates_next_s(&gates)) {
        gate_t before = gates.leg[0].gate;
        gates_update(&gates, t);
        if (gates.leg[0].gate != before) {
            changes.push_back({t, gates.leg[0].gate});
        }
    }
    expect(changes, {{30e-6, GATE_OFF}, {30e-6 + dead, GATE_HIGH}});
}

// In any sequence of states a switch closes only after the other one has been open for the dead time and the
// difference of the delays.
TEST_F(SixLegs, StatesNeverOverlap)
{
    std::mt19937 random(2);
    double opened[PLANT_LEGS][2] = {};
    int closings[PLANT_LEG_LOW + 1] = {};
    for (int period = 0; period < 3000; period++) {
        for (int k = 0; k < PLANT_LEGS; k++) {
            for (uint32_t &compare : pwm.compare[k]) {
                compare = static_cast<uint32_t>(random() % (random() % 4 == 0 ? 60 : counts));
            }
            pwm.driven[k] = random() % 16 != 0;
            pwm.state[k] = static_cast<plant_leg_state_t>(random() % (PLANT_LEG_LOW + 1));
        }
        pwm.driven_after_s = random() % 3 == 0 ? 1e-9 * static_cast<double>(random() % 100000) : 0.0;
        gates_load(&gates, &pwm);
        double start = period * T;
        for (double t = 0.0; t < T; t = gates_next_s(&gates)) {
            gate_t before[PLANT_LEGS];
            for (int k = 0; k < PLANT_LEGS; k++) {
                before[k] = gates.leg[k].gate;
            }
            gates_update(&gates, t);
            for (int k = 0; k < PLANT_LEGS; k++) {
                gate_t gate = gates.leg[k].gate;
                if (gate == before[k]) {
                    continue;
                }
                ASSERT_TRUE(gate == GATE_OFF || before[k] == GATE_OFF) << period << " leg " << k;
                if (gate == GATE_OFF) {
                    opened[k][before[k] == GATE_HIGH] = start + t;
                } else {
                    closings[gates.leg[k].state]++;
                    ASSERT_GE(start + t - opened[k][gate == GATE_LOW],
                              2.7e-6 - 1.1e-6 - 2.0 * gates.coincident_s)
                        << period << " leg " << k;
                }
            }
        }
    }
    for (int count : closings) {
        EXPECT_GT(count, 1000);
    }
}

struct Fault {
    plant_leg_fault_t fault;
    gate_t off, low, high; // what conducts with that gate
};

class FailedSwitch : public Gates, public testing::WithParamInterface<Fault>
{
};

TEST_P(FailedSwitch, FaultySwitchIgnoresItsGate)
{
    const Fault &f = GetParam();
    gates.leg[1].fault = f.fault;
    const gate_t gate[] = {GATE_OFF, GATE_LOW, GATE_HIGH};
    const gate_t conducting[] = {f.off, f.low, f.high};
    for (int n = 0; n < 3; n++) {
        gates.leg[0].gate = gate[n];
        gates.leg[1].gate = gate[n];
        EXPECT_EQ(gates_conducting(&gates, 1), conducting[n]);
        EXPECT_EQ(gates_conducting(&gates, 0), gate[n]) << "the leg beside it is healthy";
    }
}

INSTANTIATE_TEST_SUITE_P(Faults, FailedSwitch,
                         testing::Values(Fault{PLANT_HEALTHY, GATE_OFF, GATE_LOW, GATE_HIGH},
                                         Fault{PLANT_UPPER_OPEN, GATE_OFF, GATE_LOW, GATE_OFF},
                                         Fault{PLANT_LOWER_OPEN, GATE_OFF, GATE_OFF, GATE_HIGH},
                                         Fault{PLANT_UPPER_SHORT, GATE_HIGH, GATE_BOTH, GATE_HIGH},
                                         Fault{PLANT_LOWER_SHORT, GATE_LOW, GATE_LOW, GATE_BOTH},
                                         Fault{PLANT_WIRE_OPEN, GATE_OFF, GATE_LOW, GATE_HIGH}));

TEST_F(Gates, CoincidentEdgesAreOneEvent)
{
    run(0, 0);
    run(500, 500); // all three legs alike
    gates_load(&gates, &pwm);
    int events = 0;
    for (double t = 0.0; t < T; t = gates_next_s(&gates)) {
        gates_update(&gates, t);
        events++;
    }
    EXPECT_EQ(events, 5); // start, two edges, two ends of dead time
}

} // namespace
