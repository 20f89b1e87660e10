// The clock is this test's.
#include "tools/pmsim/pace.h"

#include <gtest/gtest.h>

namespace
{

using pmsim::Pace;

TEST(Pace, WaitsForSimulatedTimeThatIsEarly)
{
    Pace pace;
    EXPECT_NEAR(pace.at(0.010, 0.007).wait_s, 0.003, 1e-12);
    EXPECT_EQ(pace.latest_s(), 0.0);
}

TEST(Pace, CatchesUpAfterADelay)
{
    Pace pace;
    const Pace::Step late = pace.at(0.010, 0.160);
    EXPECT_EQ(late.wait_s, 0.0);
    EXPECT_EQ(late.lost_s, 0.0);
    EXPECT_NEAR(pace.at(0.200, 0.190).wait_s, 0.010, 1e-12); // by the same clock as before
    EXPECT_NEAR(pace.latest_s(), 0.150, 1e-12);
    EXPECT_EQ(pace.lost_s(), 0.0);
}

TEST(Pace, SkipsALongDelayAndReportsIt)
{
    Pace pace;
    EXPECT_NEAR(pace.at(1.0, 1.5).lost_s, 0.5, 1e-12);
    EXPECT_NEAR(pace.at(1.001, 1.5).wait_s, 0.001, 1e-12);
    EXPECT_NEAR(pace.at(2.0, 2.9).lost_s, 0.4, 1e-12);
    EXPECT_NEAR(pace.lost_s(), 0.9, 1e-12);
    EXPECT_NEAR(pace.latest_s(), 0.5, 1e-12);
}

// A computer that is always a little late: an hour of slices adds no drift.
TEST(Pace, DoesNotDrift)
{
    Pace pace;
    const double slice_s = 1e-3, oversleep_s = 70e-6;
    double wall_s = 0.0;
    for (int n = 1; n <= 3600000; ++n) {
        const double t_s = n * slice_s;
        const Pace::Step step = pace.at(t_s, wall_s);
        EXPECT_EQ(step.lost_s, 0.0);
        wall_s += step.wait_s > 0.0 ? step.wait_s + oversleep_s : 0.0;
        ASSERT_NEAR(wall_s, t_s, 1e-4);
    }
}

} // namespace
