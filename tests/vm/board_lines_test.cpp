// The reset sequences as the pins of the board see them.
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "tests/vm/gpio_sim.h"

extern "C" {
#include "hal/linux/board_lines.h"
}

namespace
{

using Clock = std::chrono::steady_clock;

constexpr int kBoot0 = 0, kNrst = 1;

struct Levels {
    bool boot0, nrst;
    double since_ms;
};

bool operator==(const Levels &a, const Levels &b)
{
    return a.boot0 == b.boot0 && a.nrst == b.nrst;
}

void PrintTo(const Levels &levels, std::ostream *out)
{
    *out << "BOOT0 " << levels.boot0 << " NRST " << levels.nrst << " at " << levels.since_ms << " ms";
}

// The pins while `sequence` runs. Between two reads they may both have changed.
std::vector<Levels> watch(bool (*sequence)(const board_lines_t *), const board_lines_t &lines)
{
    std::vector<Levels> seen;
    std::atomic<bool> done{false};
    bool well = false;
    std::thread runner([&] {
        well = sequence(&lines);
        done = true;
    });
    const auto start = Clock::now();
    for (bool last = false; !last;) {
        last = done;
        const std::chrono::duration<double, std::milli> passed = Clock::now() - start;
        const Levels now = {gpio_sim::level(kBoot0), gpio_sim::pulled_level(kNrst, true), passed.count()};
        if (seen.empty() || !(seen.back() == now)) {
            seen.push_back(now);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    runner.join();
    EXPECT_TRUE(well);
    return seen;
}

// Without what was there for less than 5 ms: the two lines are set one after the other.
std::vector<Levels> settled(const std::vector<Levels> &seen)
{
    std::vector<Levels> result;
    for (size_t n = 0; n < seen.size(); ++n) {
        const bool last = n + 1 == seen.size();
        if ((last || seen[n + 1].since_ms - seen[n].since_ms > 5.0) &&
            (result.empty() || !(result.back() == seen[n]))) {
            result.push_back(seen[n]);
        }
    }
    return result;
}

class BoardLines : public testing::Test
{
  protected:
    void SetUp() override
    {
        gpio_sim::pull(kBoot0, false);
        gpio_sim::pull(kNrst, true);
        char error[200] = "";
        ASSERT_TRUE(board_lines_open(&lines_, gpio_sim::name(kBoot0).c_str(),
                                     gpio_sim::name(kNrst, "!").c_str(), error, sizeof error))
            << error;
    }
    void TearDown() override
    {
        board_lines_close(&lines_);
    }
    board_lines_t lines_{};
};

TEST_F(BoardLines, OpeningLeavesTheBoardAlone)
{
    EXPECT_FALSE(gpio_sim::level(kBoot0));
    EXPECT_TRUE(gpio_sim::level(kNrst));
}

TEST_F(BoardLines, BootHoldsBoot0OverTheEndOfReset)
{
    const auto seen = settled(watch(&board_lines_boot, lines_));
    const Levels held = {true, false, 0}, started = {true, true, 0}, left = {false, true, 0};
    ASSERT_GE(seen.size(), 3U);
    const size_t first = seen.size() - 3; // the rest of it is what was there before
    EXPECT_EQ(seen[first], held);
    EXPECT_EQ(seen[first + 1], started);
    EXPECT_EQ(seen[first + 2], left);
    EXPECT_GT(seen[first + 2].since_ms - seen[first + 1].since_ms, 0.8 * BOARD_START_MS);
}

TEST_F(BoardLines, RunResetsWithBoot0Off)
{
    bool in_reset = false;
    for (const Levels &levels : watch(&board_lines_run, lines_)) {
        EXPECT_FALSE(levels.boot0);
        in_reset = in_reset || !levels.nrst;
    }
    EXPECT_TRUE(in_reset);
    EXPECT_TRUE(gpio_sim::pulled_level(kNrst, true));
}

TEST_F(BoardLines, AnotherMayHoldNrst)
{
    EXPECT_TRUE(board_lines_run(&lines_));
    EXPECT_FALSE(gpio_sim::pulled_level(kNrst, false)); // a debugger
    EXPECT_TRUE(board_lines_run(&lines_));
    EXPECT_FALSE(gpio_sim::level(kNrst));
    EXPECT_TRUE(gpio_sim::pulled_level(kNrst, true));
}

TEST_F(BoardLines, ALineInUseIsRefusedAndTheOtherReleased)
{
    char error[200] = "";
    board_lines_t second;
    EXPECT_FALSE(board_lines_open(&second, gpio_sim::name(3).c_str(), gpio_sim::name(kNrst, "!").c_str(),
                                  error, sizeof error));
    EXPECT_NE(std::string(error).find(gpio_sim::name(kNrst)), std::string::npos) << error;
    EXPECT_TRUE(gpio_sim::open(gpio_sim::name(3), GPIO_INPUT));
}

} // namespace
