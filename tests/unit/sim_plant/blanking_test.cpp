// blanking.h: windows; what a blanked comparator of probe.h shows; and the commanded edges of a bridge.
#include "rig.h"

#include <gtest/gtest.h>

#include <vector>

extern "C" {
#include "sim_plant/probe.h"
}

namespace
{

constexpr double capture_s = 1e-8, length_s = 2e-6;

TEST(Blanking, WindowsThatOverlapAreOne)
{
    blanking_t b{};
    b.length_s = length_s;
    for (double at_s : {10e-6, 11e-6, 13.5e-6}) {
        blanking_edge(&b, at_s);
    }
    EXPECT_EQ(b.windows, 2);
    EXPECT_FALSE(blanking_holds(&b, 9.9e-6));
    EXPECT_TRUE(blanking_holds(&b, 10e-6));
    EXPECT_TRUE(blanking_holds(&b, 12.9e-6));
    EXPECT_FALSE(blanking_holds(&b, 13.1e-6));
    EXPECT_EQ(blanking_end_s(&b, 0.0, 20e-6), 11e-6 + length_s);
    EXPECT_EQ(blanking_end_s(&b, 13.1e-6, 20e-6), 13.5e-6 + length_s);
    EXPECT_GT(blanking_end_s(&b, 13.1e-6, 14e-6), 1.0);
    blanking_pass(&b, 13.1e-6);
    EXPECT_EQ(b.windows, 1);
    blanking_start_period(&b, 14e-6);
    EXPECT_NEAR(blanking_end_s(&b, 0.0, 1.0), 1.5e-6, 1e-15);
}

TEST(Blanking, WithoutLengthThereIsNone)
{
    blanking_t b{};
    blanking_edge(&b, 1e-6);
    EXPECT_EQ(b.windows, 0);
}

TEST(Blanking, MoreEdgesThanRoomExtendTheLastWindow)
{
    blanking_t b{};
    b.length_s = 1e-6;
    for (int n = 0; n < BLANKING_WINDOWS + 3; n++) {
        blanking_edge(&b, n * 1e-5);
    }
    EXPECT_EQ(b.windows, BLANKING_WINDOWS);
    EXPECT_TRUE(blanking_holds(&b, (BLANKING_WINDOWS + 2) * 1e-5 + 0.5e-6));
}

struct Edge {
    double t_s;
    bool rising;
};

// A comparator of terminal 0 against the mean along straight lines between the points {t, v}, with a
// commanded edge at 10 us; the window ends at 12 us.
std::vector<Edge> seen(const std::vector<std::pair<double, double>> &points)
{
    plant_sensor_t sensor{};
    sensor.capture_s = capture_s;
    sensor.comparator_blanking_s = length_s;
    probe_t probe{};
    probe_init(&probe, &sensor, 3, 1);
    probe_command_edge(&probe, 10e-6);
    for (size_t n = 1; n < points.size(); n++) {
        const double before_V[PROBE_CHANNELS] = {points[n - 1].second};
        const double after_V[PROBE_CHANNELS] = {points[n].second};
        probe_advance(&probe, points[n - 1].first, points[n].first - points[n - 1].first, before_V, after_V);
    }
    std::vector<Edge> edges;
    for (int n = 0; n < probe.edges; n++) {
        if (probe.edge[n].leg == 0) {
            edges.push_back({probe.edge[n].count * capture_s, probe.edge[n].rising});
        }
    }
    return edges;
}

TEST(Blanking, AnEdgeBeforeOrAfterKeepsItsInstant)
{
    const std::vector<Edge> before = seen({{8e-6, -1.0}, {10e-6, 1.0}, {20e-6, 2.0}});
    ASSERT_EQ(before.size(), 1u);
    EXPECT_NEAR(before[0].t_s, 9e-6, capture_s);
    const std::vector<Edge> after = seen({{8e-6, -5.0}, {18e-6, 5.0}});
    ASSERT_EQ(after.size(), 1u);
    EXPECT_NEAR(after[0].t_s, 13e-6, capture_s);
}

// Within one step, or in one of its own that ends before the window does.
TEST(Blanking, AnEdgeWithinHasTheEndOfTheWindow)
{
    for (const auto &points : {std::vector<std::pair<double, double>>{{8e-6, -3.0}, {14e-6, 3.0}},
                               {{9e-6, -2.0}, {11.5e-6, 0.5}, {11.8e-6, 0.8}, {16e-6, 5.0}}}) {
        const std::vector<Edge> edges = seen(points);
        ASSERT_EQ(edges.size(), 1u);
        EXPECT_NEAR(edges[0].t_s, 12e-6, capture_s);
        EXPECT_TRUE(edges[0].rising);
    }
}

TEST(Blanking, ThereAndBackWithinIsNoEdge)
{
    EXPECT_TRUE(seen({{9.9e-6, -1.0}, {10.5e-6, 2.0}, {11.5e-6, -2.0}, {20e-6, -2.0}}).empty());
}

// Rising within, falling after: both, the first at the end of the window.
TEST(Blanking, ThereWithinAndBackAfter)
{
    const std::vector<Edge> edges = seen({{9.9e-6, -1.0}, {10.5e-6, 2.0}, {14.5e-6, -2.0}});
    ASSERT_EQ(edges.size(), 2u);
    EXPECT_NEAR(edges[0].t_s, 12e-6, capture_s);
    EXPECT_TRUE(edges[0].rising);
    EXPECT_NEAR(edges[1].t_s, 12.5e-6, capture_s);
    EXPECT_FALSE(edges[1].rising);
}

// Terminal a chopped between b, held low, and c, held high: it passes half the link at its commanded edges.
class BlankedBridge : public testing::Test
{
  protected:
    // Edges of the last of four periods.
    std::vector<Edge> run(double duty, double blanking_s, int periods = 4)
    {
        plant_config_t config = rig::ipm_1000();
        config.sensor.capture_s = capture_s;
        config.sensor.comparator_blanking_s = blanking_s;
        config.sensor.comparator_reference = PLANT_REFERENCE_HALF_LINK;
        rig::Plant plant(config);
        plant_pwm_t pwm = rig::pwm(duty, 0.0, 0.0);
        pwm.state[1] = PLANT_LEG_LOW;
        pwm.state[2] = PLANT_LEG_HIGH;
        plant.run(pwm, periods);
        plant_capture_t captured[16];
        const int count = plant_captured(plant, captured, 16);
        std::vector<Edge> edges;
        for (int n = 0; n < count; n++) {
            EXPECT_EQ(captured[n].leg, 0);
            edges.push_back({captured[n].count * capture_s, captured[n].rising});
        }
        return edges;
    }
    static constexpr double half_s = 50e-6;
};

TEST_F(BlankedBridge, CommandedEdgesAreSeenAtTheEndOfTheirWindow)
{
    for (double blanking_s : {0.0, 3e-6}) {
        const std::vector<Edge> edges = run(0.25, blanking_s);
        ASSERT_EQ(edges.size(), 2u) << blanking_s;
        EXPECT_NEAR(edges[0].t_s, 0.75 * half_s + blanking_s, capture_s);
        EXPECT_NEAR(edges[1].t_s, 1.25 * half_s + blanking_s, capture_s);
        EXPECT_TRUE(edges[0].rising);
    }
}

// A pulse of 2 us in windows of 3 us, which are one.
TEST_F(BlankedBridge, AShortPulseIsHidden)
{
    EXPECT_EQ(run(0.02, 0.0).size(), 2u);
    EXPECT_TRUE(run(0.02, 3e-6).empty());
}

// A window that goes on in the next period: the falling edge at 96 us is seen at 1 us of that.
TEST_F(BlankedBridge, WindowsCrossTheEndOfThePeriod)
{
    const std::vector<Edge> edges = run(0.95, 5e-6);
    EXPECT_EQ(run(0.95, 0.0).size(), 2u);
    EXPECT_TRUE(edges.empty()); // falls at 97.5, rises at 102.5 us: hidden, as the pulse above
    const std::vector<Edge> apart = run(0.92, 5e-6); // falls at 96, rises at 104 us
    ASSERT_EQ(apart.size(), 2u);
    EXPECT_NEAR(apart[0].t_s, 1e-6, capture_s);
    EXPECT_FALSE(apart[0].rising);
    EXPECT_NEAR(apart[1].t_s, 9e-6, capture_s);
}

// b and c go to the other rail through their diodes at once.
TEST_F(BlankedBridge, ATripIsACommandedEdge)
{
    plant_config_t config = rig::ipm_1000();
    config.sensor.capture_s = capture_s;
    config.sensor.comparator_blanking_s = 3e-6;
    config.sensor.comparator_reference = PLANT_REFERENCE_HALF_LINK;
    rig::Plant plant(config);
    plant_pwm_t pwm = rig::pwm(0.25, 0.0, 0.0);
    pwm.state[1] = PLANT_LEG_LOW;
    pwm.state[2] = PLANT_LEG_HIGH;
    plant.run(pwm, 6);
    plant_move(plant, 20e-6);
    plant_trip(plant);
    plant_run_period(plant);
    plant_capture_t captured[16];
    const int count = plant_captured(plant, captured, 16);
    bool b = false, c = false;
    for (int n = 0; n < count; n++) {
        EXPECT_GE(captured[n].count * capture_s, 23e-6 - capture_s);
        b = b || (captured[n].leg == 1 && captured[n].rising && captured[n].count * capture_s < 23.1e-6);
        c = c || (captured[n].leg == 2 && !captured[n].rising && captured[n].count * capture_s < 23.1e-6);
    }
    EXPECT_TRUE(b && c);
}

} // namespace
