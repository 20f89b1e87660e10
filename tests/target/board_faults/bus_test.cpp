// The image on a bus where others do wrong.
#include "bench.h"

extern "C" {
#include "tools/pmsim_board/bus_load.h"
}

namespace
{

using bench::Bench;

constexpr board_frame_t start = {0, 2, {1, 1, 0, 0, 0, 0, 0, 0}};
constexpr board_frame_t namesake = {0x701, 1, {127, 0, 0, 0, 0, 0, 0, 0}};

// Error codes of the emergency messages that have come
std::vector<int> told(Bench *b)
{
    std::vector<int> codes;
    board_frame_t frame;
    while (board_can_receive(b->board, &frame)) {
        if (frame.id == 0x081) {
            codes.push_back(frame.data[0] | frame.data[1] << 8);
        }
    }
    return codes;
}

// Boot-ups since asked last
int boot_ups(Bench *b)
{
    int seen = 0;
    board_frame_t frame;
    while (board_can_receive(b->board, &frame)) {
        seen += frame.id == 0x701 && frame.length == 1 && frame.data[0] == 0 ? 1 : 0;
    }
    return seen;
}

TEST(BoardBus, SaysOnceThatItIsThereAfterEachReset)
{
    Bench b;
    b.store(0, bench::params(), 1);
    b.boot();
    b.run_ms(20);
    EXPECT_EQ(boot_ups(&b), 1);
    const board_frame_t communication = {0, 2, {130, 1, 0, 0, 0, 0, 0, 0}};
    ASSERT_TRUE(board_can_send(b.board, &communication));
    b.run_ms(20);
    EXPECT_EQ(boot_ups(&b), 1);
    EXPECT_EQ(board_resets(b.board), 0u);
    const board_frame_t node = {0, 2, {129, 1, 0, 0, 0, 0, 0, 0}};
    ASSERT_TRUE(board_can_send(b.board, &node));
    b.run_ms(100);
    EXPECT_EQ(boot_ups(&b), 1);
    EXPECT_EQ(board_resets(b.board), 1u);
}

// Nothing of the master's comes through any more, nor of the image's.
TEST(BoardBus, ABabblerBeforeWhichNothingPassesOpensTheBridgeInTime)
{
    Bench b;
    b.running();
    double off_ms = 100.0; // since the last command
    for (; b.bridge_on() && off_ms < 700.0; off_ms += 0.1) {
        while (board_can_waiting(b.board) < 4) {
            const board_frame_t frame = {0x001, 0, {}};
            ASSERT_TRUE(board_can_send(b.board, &frame));
        }
        b.run_ms(0.1);
    }
    EXPECT_GE(off_ms, 490.0);
    EXPECT_LE(off_ms, 505.0);
    EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_REMOTE_LOST);
    EXPECT_EQ(board_resets(b.board), 0u);
}

TEST(BoardBus, ANamesakeBarsTheStart)
{
    Bench b;
    b.store(0, bench::params(), 1);
    b.boot();
    b.run_ms(5);
    ASSERT_TRUE(board_can_send(b.board, &namesake));
    b.run_ms(5);
    EXPECT_THAT(told(&b), testing::Contains(0x8150));
    b.command(true);
    b.run_ms(300);
    EXPECT_FALSE(b.bridge_on());
}

TEST(BoardBus, ANamesakeDoesNotStopWhatRuns)
{
    Bench b;
    b.running();
    told(&b);
    ASSERT_TRUE(board_can_send(b.board, &namesake));
    ASSERT_TRUE(board_can_send(b.board, &start)); // it is what everybody is told
    b.run_ms(50);
    EXPECT_THAT(told(&b), testing::Contains(0x8150));
    EXPECT_TRUE(b.bridge_on());
}

} // namespace
