// A master that falls silent: what it has started does not run on.
#include <functional>

#include "tests/unit/app/bench.h"

using app_test::Bench;
using app_test::defaults;

namespace
{

constexpr int preset_ms = 1000;
constexpr int round_ms = 2;

// By SDO alone, in PRE-OPERATIONAL, without a heartbeat
class Started : public Bench
{
  public:
    explicit Started(uint32_t t_command_ms = preset_ms, uint32_t option = 1)
    {
        const drive_params_t params = defaults();
        boot(&params);
        run_ms(5);
        EXPECT_EQ(set(0x2020, 1, t_command_ms), 0U);
        EXPECT_EQ(set(0x2020, 2, option), 0U);
        EXPECT_EQ(set(0x60FF, 0, 30000), 0U);
        for (const uint32_t word : {0x06U, 0x07U, 0x0FU}) {
            EXPECT_EQ(set(0x6040, 0, word), 0U);
        }
        for (int n = 0; n < 10; ++n) {
            run_ms(100);
            statusword();
        }
        EXPECT_EQ(loop.app.drive.state, DRIVE_RUNNING);
    }

    // Milliseconds until it no longer runs; -1: it does
    int runs_ms(
        int most_ms, const std::function<void(int)> &every_ms = [](int) {})
    {
        for (int ms = 0; ms < most_ms; ++ms) {
            every_ms(ms);
            run_ms(1);
            if (loop.app.drive.state != DRIVE_RUNNING) {
                return ms + 1;
            }
        }
        return -1;
    }
};

TEST(Silence, StopsAMotorThatWasStartedBySdo)
{
    Started x;
    EXPECT_NEAR(x.runs_ms(3 * preset_ms), preset_ms, round_ms + 5);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_STOPPING); // by its ramp
    EXPECT_TRUE(x.loop.hal.armed);
    x.run_ms(1000);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_OFF);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    const auto told = x.take(0x81);
    ASSERT_EQ(told.size(), 1U);
    EXPECT_EQ(told[0].data[0] | told[0].data[1] << 8, 0x8130);
    EXPECT_EQ(x.statusword() & 0x4F, 0x40); // it is heard again, and starts by all the commands alone
    EXPECT_EQ(x.set(0x6040, 0, 0x0F), 0U);
    x.run_ms(300);
    EXPECT_FALSE(x.loop.hal.armed);
    for (const uint32_t word : {0x06U, 0x07U, 0x0FU}) {
        EXPECT_EQ(x.set(0x6040, 0, word), 0U);
    }
    x.run_ms(300);
    EXPECT_TRUE(x.loop.hal.armed);
}

TEST(Silence, OpensTheBridgeIfAskedTo)
{
    Started x(300, 0);
    EXPECT_NEAR(x.runs_ms(3 * preset_ms), 300, round_ms + 5);
    x.run_ms(1);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_REMOTE_LOST);
    EXPECT_EQ(x.get(0x603F) & 0xFFFF, 0x8130U);
}

TEST(Silence, IsNotWatchedWithATimeOfZero)
{
    Started x(0);
    EXPECT_EQ(x.runs_ms(3 * preset_ms), -1);
}

// Each of these is life; what is for others is not.
TEST(Silence, EndsWithAnyFrameForTheNode)
{
    const std::vector<uint8_t> read = {0x40, 0x41, 0x60, 0, 0, 0, 0, 0};
    const std::vector<uint8_t> process_data = {0x0F, 0, 3, 0x30, 0x75, 0, 0};
    struct {
        const char *what;
        uint16_t id;
        std::vector<uint8_t> data;
        bool life;
    } const frames[] = {{"SDO", 0x601, read, true},
                        {"NMT start of this node", 0, {1, 1}, true},
                        {"NMT start of all", 0, {1, 0}, true},
                        {"RPDO", 0x201, process_data, true},
                        {"heartbeat that is watched", 0x77F, {5}, true},
                        {"heartbeat of another", 0x77E, {5}, false},
                        {"SDO of another node", 0x602, read, false},
                        {"NMT of another node", 0, {1, 2}, false},
                        {"RPDO of another node", 0x202, process_data, false},
                        {"a short RPDO", 0x201, {0x0F}, false},
                        {"a short SDO", 0x601, {0x40}, false},
                        {"SYNC", 0x80, {}, false}};
    for (const auto &frame : frames) {
        Started x;
        EXPECT_EQ(x.set(0x1016, 1, 0x007F2000), 0U);
        x.give(0, {1, 1});
        const int ran_ms = x.runs_ms(2 * preset_ms, [&](int ms) {
            if (ms % 400 == 0) {
                x.give(frame.id, frame.data);
            }
        });
        EXPECT_EQ(ran_ms < 0, frame.life) << frame.what;
    }
}

TEST(Silence, IsKeptWithTheCommunication)
{
    Started x(0, 0);
    x.control(0);
    EXPECT_EQ(x.set(0x6040, 0, 0), 0U);
    x.run_ms(100);
    EXPECT_EQ(x.set(0x1010, 2, 0x65766173), 0U);
    sim_loop_boot(&x.loop);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x2020, 1) & 0xFFFF, 0U);
    EXPECT_EQ(x.get(0x2020, 2) & 0xFF, 0U);
}

} // namespace
