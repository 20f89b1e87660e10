// What a healthy image does on its board.
#include "bench.h"

#include <cmath>

namespace
{

using bench::Bench;
using testing::HasSubstr;

TEST(BoardRun, SendsBootUp)
{
    Bench b;
    b.store(0, bench::params(), 1);
    b.boot();
    b.run_ms(20);
    EXPECT_THAT(b.console(), HasSubstr("B-G431B-ESC1"));
    EXPECT_THAT(b.console(), HasSubstr("reset: power-on"));
    EXPECT_THAT(b.console(), HasSubstr("parameters: stored"));
    EXPECT_EQ(board_clock_Hz(b.board), 170000000u);
    EXPECT_NEAR(board_period_s(b.board), 100e-6, 1e-12);
    EXPECT_EQ(board_resets(b.board), 0u);
    EXPECT_FALSE(b.bridge_on());
    EXPECT_FALSE(board_led(b.board));
}

TEST(BoardRun, WithoutParametersNothingArms)
{
    Bench b;
    b.boot();
    b.run_ms(5);
    b.command(true);
    b.run_ms(300);
    EXPECT_FALSE(b.bridge_on());
    EXPECT_THAT(b.console(), HasSubstr("none stored"));
}

TEST(BoardRun, ArmsAndItsCompareValuesAreTheDrives)
{
    Bench b;
    b.running();
    EXPECT_TRUE(board_led(b.board));
    for (int n = 0; n < 20; n++) {
        b.run_ms(0.1); // its end is the update event that takes over what the control interrupt has written
        const tim1_t *tim = &board_inside(b.board)->tim1;
        for (uint32_t leg = 0; leg < DRIVE_LEGS; leg++) {
            EXPECT_EQ(tim->compare[leg], b.watched()->out.compare[leg][0]);
            EXPECT_EQ(pm_leg(b.watched()->out.legs, leg), PM_LEG_PWM);
        }
    }
}

TEST(BoardRun, CurrentsArriveWithSignAndScale)
{
    Bench b;
    b.running();
    double most_A = 0.0;
    for (int n = 0; n < 50; n++) {
        plant_truth_t before =
            b.truth(); // at the centre of the zero vector: what the image is about to sample
        b.run_ms(0.1);
        const drive_in_t &in = b.watched()->in;
        for (int leg = 0; leg < DRIVE_LEGS; leg++) {
            double seen_A = BOARD_I_FULL_SCALE_A * (in.i_leg[leg] / 32768.0 - 1.0);
            EXPECT_NEAR(seen_A, before.i_A[leg],
                        0.03 * bench::kAmperes); // 0.6 us later, 12 bits, 0.5 LSB of noise
            most_A = std::fmax(most_A, std::fabs(before.i_A[leg]));
        }
        EXPECT_NEAR(BOARD_V_FULL_SCALE_V * in.v_dc / 65536.0, before.v_dc_V, 0.5 * bench::kVolts);
    }
    EXPECT_GT(most_A, 1.0 * bench::kAmperes);
}

TEST(BoardRun, TemperatureDialAndButton)
{
    Bench b;
    b.store(0, bench::params(), 1);
    b.boot();
    board_set_temperature(b.board, 57.0);
    board_set_dial(b.board, 0.75);
    board_press_button(b.board, true);
    b.run_ms(20);
    EXPECT_NEAR(b.watched()->slow.temperature_dC, 570, 8);
    EXPECT_EQ(b.watched()->slow.dial, 0xC000);
    EXPECT_TRUE(b.watched()->slow.button);
}

TEST(BoardRun, SendsItsStateOnTheBus)
{
    Bench b;
    b.running();
    board_frame_t frame;
    while (board_can_receive(b.board, &frame)) {
    }
    b.run_ms(100);
    int frames = 0;
    while (board_can_receive(b.board, &frame)) {
        if (frame.id == 0x181) { // the node's first TPDO begins with the statusword
            frames++;
            EXPECT_EQ(frame.data[0] & 0x6F, 0x27); // operation enabled
        }
    }
    EXPECT_GE(frames, 1);
}

TEST(BoardRun, StackIsUsedAndHasRoom)
{
    Bench b;
    b.running();
    EXPECT_GT(board_stack_used(b.board), 200u);
    EXPECT_LT(board_stack_used(b.board), 2048u);
}

} // namespace
