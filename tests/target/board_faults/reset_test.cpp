// Faults that end in a reset: the bridge is off at once, and the image says afterwards what it was.
#include "bench.h"

#include <algorithm>

namespace
{

using bench::Bench;
using testing::HasSubstr;

// Periods until that has come true, or -1
template <typename Condition> int until(Bench *b, int most, Condition condition)
{
    for (int n = 0; n < most; n++) {
        if (condition()) {
            return n;
        }
        if (!board_run_period(b->board)) {
            ADD_FAILURE() << board_error(b->board);
            return -1;
        }
    }
    return -1;
}

// 20 ms of a slow clock, and what is left of its last millisecond
TEST(BoardReset, WatchdogEndsAProcessorThatHangs)
{
    Bench b;
    b.running();
    cpu_halt(board_cpu(b.board), true);
    int periods = until(&b, 1000, [&] { return board_resets(b.board) == 1; });
    EXPECT_GE(periods, 185);
    EXPECT_LE(periods, 205);
    EXPECT_FALSE(b.bridge_on());
    b.run_ms(50);
    EXPECT_THAT(b.console(), HasSubstr("reset: watchdog"));
    EXPECT_FALSE(b.bridge_on());
    EXPECT_EQ(board_resets(b.board), 1u);
}

// Interrupts go on, the main loop does not: b .
TEST(BoardReset, WatchdogEndsAMainLoopThatHangs)
{
    Bench b;
    b.running();
    std::vector<uint16_t> before = b.patch({0xE7FE});
    int periods = until(&b, 3000, [&] { return board_resets(b.board) == 1; });
    EXPECT_GE(periods, 1100); // 100 ms of patience, then the watchdog's 20
    EXPECT_LE(periods, 1250);
    EXPECT_FALSE(b.bridge_on());
    b.put_back(before);
    b.run_ms(50);
    EXPECT_THAT(b.console(), HasSubstr("reset: watchdog"));
    EXPECT_FALSE(b.bridge_on());
}

TEST(BoardReset, AStuckConverterOpensTheBridgeWithinMilliseconds)
{
    Bench b;
    b.running();
    board_stick_converter(b.board, true);
    int periods = until(&b, 100, [&] { return !b.bridge_on(); });
    EXPECT_GE(periods, 1);
    EXPECT_LE(periods, 30);
    EXPECT_GE(until(&b, 1000, [&] { return board_resets(b.board) == 1; }), 0);
    EXPECT_FALSE(b.bridge_on());
}

// Clock security breaks the timer in hardware; the handler leaves its last words: exception 2.
TEST(BoardReset, ALostCrystalOpensTheBridgeAtOnceAndIsRefusedAfterwards)
{
    Bench b;
    b.running();
    board_stop_oscillator(b.board, true);
    EXPECT_FALSE(b.bridge_on());
    EXPECT_GE(until(&b, 100, [&] { return board_resets(b.board) == 1; }), 0);
    b.run_ms(100);
    EXPECT_THAT(b.console(), HasSubstr("reset: software"));
    EXPECT_THAT(b.console(), HasSubstr("last run ended by exception 0x00000002"));
    EXPECT_THAT(b.console(), HasSubstr("clock"));
    EXPECT_EQ(board_clock_Hz(b.board), 170000000u); // from HSI
    b.command(true);
    b.run_ms(300);
    EXPECT_FALSE(b.bridge_on());
}

// Without the PLL the processor stays at 16 MHz: it says so, keeps off the bus and never arms.
TEST(BoardReset, APllThatDoesNotLockIsRefused)
{
    Bench b;
    b.store(0, bench::params(), 1);
    board_fail_pll(b.board, true);
    b.boot();
    b.run_ms(100);
    EXPECT_EQ(board_clock_Hz(b.board), 16000000u);
    EXPECT_THAT(b.console(), HasSubstr("clock"));
    b.command(true);
    b.run_ms(300);
    EXPECT_FALSE(b.bridge_on());
    EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_PARAMETERS);
    board_frame_t frame;
    EXPECT_FALSE(board_can_receive(b.board, &frame));
    EXPECT_EQ(board_resets(b.board), 0u);
}

// Where flash holds the text of a fault, which nobody reads at the start.
uint32_t find_text(board_t *board, drive_fault_t fault)
{
    const uint32_t flash = 0x08000000;
    std::vector<uint8_t> image(124 * 1024);
    board_read_flash(board, flash, image.data(), image.size());
    const std::string text = drive_fault_text(fault);
    const auto found = std::search(image.begin(), image.end(), text.begin(), text.end());
    EXPECT_NE(found, image.end());
    return flash + uint32_t(found - image.begin());
}

// One bit of it: the console says so, and the bridge stays off.
TEST(BoardReset, ADamagedImageNeverArms)
{
    for (const drive_fault_t fault : {DRIVE_FAULT_OVER_CURRENT, DRIVE_FAULT_STALL, DRIVE_FAULT_OVERLOAD}) {
        Bench b;
        b.store(0, bench::params(), 1);
        const uint32_t address = find_text(b.board, fault) & ~1u;
        uint16_t word = 0;
        board_read_flash(b.board, address, &word, sizeof word);
        word ^= 0x0400;
        board_program(b.board, address, &word, sizeof word);
        b.boot();
        b.run_ms(100);
        EXPECT_THAT(b.console(), HasSubstr("the image is damaged")) << fault;
        b.command(true);
        b.run_ms(300);
        EXPECT_FALSE(b.bridge_on()) << fault;
        EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_PARAMETERS);
        EXPECT_EQ(board_resets(b.board), 0u);
    }
}

TEST(BoardReset, AnErrorOfTheMemorysParityOpensTheBridgeAtOnce)
{
    for (bool checked : {false, true}) {
        Bench b;
        board_check_parity(b.board, checked);
        b.running();
        board_flip_ram(b.board);
        EXPECT_EQ(b.bridge_on(), !checked);
        b.run_ms(100); // the new start checks the whole image first
        EXPECT_EQ(board_resets(b.board), checked ? 1u : 0u);
        if (checked) {
            EXPECT_THAT(b.console(), HasSubstr("last run ended by exception 0x00000002"));
            EXPECT_FALSE(b.bridge_on());
        }
    }
}

// push {r0-r7} without end: the guard below the stack, 32 bytes at the bottom of the memory, stops it.
TEST(BoardReset, AnOverflowOfTheStackHitsTheGuard)
{
    Bench b;
    b.running();
    std::vector<uint16_t> before = b.patch({0xB4FF, 0xE7FD});
    EXPECT_GE(until(&b, 1000, [&] { return board_resets(b.board) == 1; }), 0);
    EXPECT_FALSE(b.bridge_on());
    b.put_back(before);
    b.run_ms(80); // 10 of them for the CRC of the image
    EXPECT_THAT(b.console(), HasSubstr("last run ended by exception 0x00000004"));
    EXPECT_THAT(b.console(), HasSubstr("address 0x200000"));
    EXPECT_FALSE(b.bridge_on());
}

TEST(BoardReset, ANullPointerIsAFaultWithItsAddress)
{
    Bench b;
    b.running();
    std::vector<uint16_t> before = b.patch({0x2000, 0x6840, 0xE7FE}); // movs r0, #0; ldr r0, [r0, #4]
    EXPECT_GE(until(&b, 1000, [&] { return board_resets(b.board) == 1; }), 0);
    EXPECT_FALSE(b.bridge_on());
    b.put_back(before);
    b.run_ms(80); // 10 of them for the CRC of the image
    EXPECT_THAT(b.console(), HasSubstr("last run ended by exception 0x00000004"));
    EXPECT_THAT(b.console(), HasSubstr("address 0x00000004"));
}

// Power lost while the newer page was written: the older one holds.
TEST(BoardReset, APageCutShortFallsBackToTheOther)
{
    drive_params_t older = bench::params();
    drive_params_t newer = bench::params();
    newer.i_trip = 45000;
    for (bool cut : {false, true}) {
        Bench b;
        b.store(0, older, 1);
        b.store(1, newer, 2);
        if (cut) {
            const std::vector<uint8_t> erased(256, 0xFF);
            board_program(b.board, 0x0801F800 + 128, erased.data(), erased.size());
        }
        b.boot();
        b.run_ms(20);
        drive_t expected;
        drive_init(&expected, cut ? &older : &newer, PM_CHANNELS);
        EXPECT_EQ(b.watched()->drive.config.protection.i_trip_squared,
                  expected.config.protection.i_trip_squared);
        EXPECT_THAT(b.console(), HasSubstr("parameters: stored"));
    }
}

// The contract image writes its pages; the power goes in the midst of one double word, and it starts anew.
TEST(BoardReset, PowerLostWhileAPageIsWritten)
{
    for (uint32_t after : {1u, 2u, 4u}) {
        plant_config_t config = bench::plant_config();
        config.inverter.f_pwm_Hz = 20e3; // as that image has them
        config.inverter.timer_counts = 4250;
        config.inverter.dead_time_s = 500e-9;
        Bench b(config, bench::contract);
        b.boot();
        board_cut_flash(b.board, after);
        ASSERT_GE(until(&b, 50000, [&] { return board_resets(b.board) == 1; }), 0);
        EXPECT_FALSE(b.bridge_on());
        EXPECT_GE(until(&b, 100000, [&] { return b.console().find("DONE 0 ") != std::string::npos; }), 0);
        EXPECT_THAT(b.console(), HasSubstr("DONE 0 "));
    }
}

} // namespace
