// A break of 1 us at any instant while the motor runs. Its cause is gone once the bridge is open.
#include "bench.h"

#include <sys/wait.h>
#include <unistd.h>

#include <map>

namespace
{

using bench::Bench;

constexpr int breaks = 1000;
constexpr int spread = 617; // prime to it: the instants follow each other all over the period
constexpr double width_s = 1e-6;
constexpr double short_s = 0.5e-6; // the filter of the break input wants 0.75 us
constexpr double passed_ms = 2.0;  // the main loop looks every 0.25 ms, and emergencies are sent
constexpr int code_hardware = 0x2320;

enum verdict_t { STAYED_OFF, STAYED_ON, ARMED_AGAIN, OTHER_FAULT, NOT_TOLD, BROKEN_RUN };

bool told(Bench *b)
{
    bool found = false;
    board_frame_t frame;
    while (board_can_receive(b->board, &frame)) {
        found = found || (frame.id == 0x081 && (frame.data[0] | frame.data[1] << 8) == code_hardware);
    }
    return found;
}

verdict_t after_break(Bench *b, double after_s, double pulse_s)
{
    told(b);
    board_pulse_break(b->board, after_s, pulse_s);
    bool opened = false;
    for (int period = 0; period < static_cast<int>(10.0 * passed_ms); period++) {
        if (!board_run_period(b->board)) {
            return BROKEN_RUN;
        }
        const bool on = tim1_main_output(&board_inside(b->board)->tim1);
        if (opened && on) {
            return ARMED_AGAIN;
        }
        opened = !on;
    }
    if (!opened) {
        return STAYED_ON;
    }
    if (b->watched()->drive.fault != DRIVE_FAULT_HARDWARE) {
        return OTHER_FAULT;
    }
    return told(b) ? STAYED_OFF : NOT_TOLD;
}

// In a copy of this process: the board runs on here as if nothing had been.
verdict_t tried(Bench *b, double after_s, double pulse_s)
{
    const pid_t child = fork();
    if (child == 0) {
        _exit(after_break(b, after_s, pulse_s));
    }
    int status = 0;
    const bool ended = child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status);
    return ended ? static_cast<verdict_t>(WEXITSTATUS(status)) : BROKEN_RUN;
}

TEST(BoardBreak, OfAThousandAtAnyInstantNoneIsArmedAgainAndEachIsReported)
{
    Bench b;
    b.running();
    std::vector<int> seen(BROKEN_RUN + 1);
    for (int n = 0; n < breaks; n++) {
        const double share = static_cast<double>(n * spread % breaks) / breaks;
        seen[tried(&b, share * board_period_s(b.board), width_s)]++;
        if (n % 250 == 0) {
            b.command(true, DRIVE_MODE_CURRENT, 0); // the master stays
        }
        b.run_ms(0.1);
    }
    RecordProperty("stayed_off", seen[STAYED_OFF]);
    EXPECT_THAT(seen, testing::ElementsAre(breaks, 0, 0, 0, 0, 0))
        << "stayed off, stayed on, armed again, other fault, not told, broken run";
    EXPECT_TRUE(b.bridge_on());
}

// From calibration over the pulses and a run to the end of the stop.
TEST(BoardBreak, OfAThousandInAnyStateNoneIsArmedAgain)
{
    plant_config_t config = bench::plant_config();
    config.mech.locked = false;
    Bench b(config);
    b.store(0, bench::params(), 1);
    b.boot();
    b.run_ms(5);
    std::map<int, int> in_state;
    std::vector<int> seen(BROKEN_RUN + 1);
    for (int n = 0; n < breaks; n++) {
        if (n % 200 == 0) {
            b.command(n < 800, DRIVE_MODE_SPEED, 20000);
        }
        b.run_ms(n < 800 ? 0.5 : 0.2);
        if (!tim1_main_output(&board_inside(b.board)->tim1)) {
            continue;
        }
        in_state[b.watched()->drive.state]++;
        const double share = static_cast<double>(n * spread % breaks) / breaks;
        seen[tried(&b, share * board_period_s(b.board), width_s)]++;
    }
    EXPECT_THAT(seen, testing::ElementsAre(testing::Gt(breaks * 9 / 10), 0, 0, 0, 0, 0));
    for (int state : {DRIVE_CALIBRATING, DRIVE_FINDING, DRIVE_RUNNING, DRIVE_STOPPING}) {
        EXPECT_GT(in_state[state], 30) << state;
    }
}

TEST(BoardBreak, ShorterThanTheFilterIsNone)
{
    Bench b;
    b.running();
    for (int n = 0; n < 10; n++) {
        EXPECT_EQ(tried(&b, n / 10.0 * board_period_s(b.board), short_s), STAYED_ON);
        b.run_ms(0.1);
    }
}

// The user's reset is the only way back.
TEST(BoardBreak, ARepeatedCommandDoesNotArmAgain)
{
    Bench b;
    b.running();
    board_pulse_break(b.board, 0.0, width_s);
    b.run_ms(1);
    for (int n = 0; n < 5; n++) {
        b.command(true, DRIVE_MODE_CURRENT, 0);
        b.run_ms(50);
        EXPECT_FALSE(b.bridge_on());
    }
    EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_HARDWARE);
    b.command(false, DRIVE_MODE_CURRENT, 0, 0, true);
    b.run_ms(5);
    b.command(true);
    b.run_ms(300);
    EXPECT_TRUE(b.bridge_on()) << b.console();
}

} // namespace
