// The observer changed by parameter, on the plant with switching inverter, dead time, converter noise and
// delay.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/application.h"
#include "tests/support/plants.h"
#include "tests/unit/drive/direct.h"

namespace
{

constexpr double kRated_Nm = 4.0;
// A jump of the torque beyond its ripple before, of the rated torque.
constexpr double kJump = 0.05;
constexpr double kPosition_deg = 6;

// Those that run on IPM-1000.
std::vector<int32_t> observers()
{
    std::vector<int32_t> all;
    for (int32_t id = 0; id < OBSERVER_COUNT; ++id) {
        drive_params_t p = direct::params();
        p.observer = id;
        drive_config_t c = {};
        if (drive_configure(&c, &p, PM_CHANNELS).ok) {
            all.push_back(id);
        }
    }
    return all;
}

class Closed
{
  public:
    explicit Closed(int32_t observer) : plant_(plant_create(&config_, 1.0, &error_), &plant_destroy)
    {
        params_.observer = observer;
        sim_loop_init(&loop, plant_.get(), &params_);
    }

    void speed(double rad_s, bool enable = true)
    {
        drive_command_t c = {};
        c.enable = enable;
        c.speed_mrad_s = static_cast<int32_t>(std::lround(1000 * rad_s));
        drive_command(&loop.app.drive, &c);
    }

    void load(double torque_Nm)
    {
        plant_set_load(plant_.get(), torque_Nm);
    }

    void observer(int32_t id)
    {
        params_.observer = id;
        drive_config_t c = {};
        ASSERT_TRUE(drive_configure(&c, &params_, PM_CHANNELS).ok) << id;
        ASSERT_TRUE(drive_same_frame(&c, &loop.app.drive.config));
        drive_reconfigure(&loop.app.drive, &c);
    }

    struct Range {
        double least = 1e9, most = -1e9, error_deg = 0;
    };

    Range run_ms(int ms)
    {
        Range range;
        for (int k = 0; k < 10 * ms; ++k) {
            sim_loop_step(&loop);
            plant_truth_t t;
            plant_truth(plant_.get(), &t);
            range.least = std::min(range.least, t.torque_Nm);
            range.most = std::max(range.most, t.torque_Nm);
            range.error_deg = std::max(range.error_deg, std::abs(error_deg(t)));
        }
        return range;
    }

    // Of the position at the last sample: the truth is one period further.
    double error_deg(const plant_truth_t &t) const
    {
        const double theta = bench::rad(drive_status(&loop.app.drive)->theta);
        return bench::wrapped(t.theta_e_rad - theta) / bench::kDegree;
    }

    drive_state_t state() const
    {
        return drive_status(&loop.app.drive)->state;
    }

    sim_loop_t loop;

  private:
    plant_config_t config_ = plants::ipm_1000();
    drive_params_t params_ = direct::params();
    const char *error_ = nullptr;
    std::unique_ptr<plant_t, void (*)(plant_t *)> plant_;
};

TEST(Switching, EachToEachWhileRunningWithoutAJumpOfTheTorque)
{
    const std::vector<int32_t> all = observers();
    ASSERT_GE(all.size(), 3U);
    for (const double speed_rad_s : {60.0, -95.0}) {
        Closed x(all[0]);
        x.speed(speed_rad_s);
        x.run_ms(1100);
        x.load(speed_rad_s > 0 ? 2.0 : -2.0);
        x.run_ms(600);
        ASSERT_EQ(x.state(), DRIVE_RUNNING);
        for (size_t from = 0; from < all.size(); ++from) {
            for (size_t to = 0; to < all.size(); ++to) {
                if (to == from) {
                    continue;
                }
                x.observer(all[from]);
                x.run_ms(150);
                const Closed::Range before = x.run_ms(60);
                x.observer(all[to]);
                const Closed::Range after = x.run_ms(150);
                EXPECT_LT(after.most, before.most + kJump * kRated_Nm) << all[from] << " to " << all[to];
                EXPECT_GT(after.least, before.least - kJump * kRated_Nm) << all[from] << " to " << all[to];
                EXPECT_LT(after.error_deg, kPosition_deg) << all[from] << " to " << all[to];
                EXPECT_EQ(x.state(), DRIVE_RUNNING);
            }
        }
    }
}

TEST(Switching, WhileInjectionLeadsNothingHappens)
{
    for (const int32_t to : observers()) {
        Closed x(0);
        x.speed(5);
        x.run_ms(600);
        const Closed::Range before = x.run_ms(100);
        x.observer(to);
        const Closed::Range after = x.run_ms(200);
        EXPECT_LT(after.most - after.least, before.most - before.least + kJump * kRated_Nm) << to;
        EXPECT_EQ(x.state(), DRIVE_RUNNING);
    }
}

TEST(Switching, OnAStoppedDriveTheNextStartHasTheNewOne)
{
    for (const int32_t to : observers()) {
        Closed x(0);
        x.run_ms(5);
        x.observer(to);
        x.speed(60);
        x.run_ms(1000);
        EXPECT_EQ(x.state(), DRIVE_RUNNING) << to;
        EXPECT_EQ(x.loop.app.drive.config.position.observer.id, to);
        EXPECT_LT(x.run_ms(100).error_deg, kPosition_deg) << to;
    }
}

} // namespace
