// Identification as a master sees it.
#include "tests/contract/bench.h"
#include "tests/unit/app/bench.h"

using app_test::Bench;
using app_test::defaults;

namespace
{

// What is read while an identification is on the way to its beginning, or was not begun at all
TEST(BusIdentification, ItsStateIsNeverThatOfTheOneBefore)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    const auto state = [&] { return x.get(0x3000, 2) & 0xFF; };
    const auto enable = [&] {
        x.give(0, {1, 0});
        for (const int word : {0x06, 0x07, 0x0F}) {
            x.control(uint16_t(word), -2, 0);
        }
        x.run_ms(1);
    };
    const auto held = [&](int ms) {
        for (int done = 0; done < ms && state() == COMMISSIONING_RUNNING; done += 100) {
            x.run_ms(100);
            x.control(0x0F, -2, 0);
        }
    };
    ASSERT_EQ(x.set(0x3000, 1, COMMISSIONING_RESISTANCE), 0U);
    EXPECT_EQ(state(), uint32_t(COMMISSIONING_IDLE));
    enable();
    EXPECT_EQ(state(), uint32_t(COMMISSIONING_RUNNING)); // the sensors are calibrated first
    held(10000);
    ASSERT_EQ(state(), uint32_t(COMMISSIONING_DONE));
    x.control(0x06, -2, 0);
    x.run_ms(20);
    EXPECT_EQ(state(), uint32_t(COMMISSIONING_DONE));

    enable(); // the same again
    EXPECT_EQ(state(), uint32_t(COMMISSIONING_RUNNING));
    x.control(0x06, -2, 0); // taken back before it has begun
    x.run_ms(20);
    EXPECT_EQ(state(), uint32_t(COMMISSIONING_FAILED));
    EXPECT_EQ(x.get(0x3000, 4) & 0xFF, uint32_t(COMMISSIONING_ABORTED));

    enable();
    x.loop.hal.hw_fault = true; // so does a fault
    x.run_ms(5);
    EXPECT_EQ(state(), uint32_t(COMMISSIONING_FAILED));
    x.loop.hal.hw_fault = false;
    ASSERT_EQ(x.set(0x3000, 1, COMMISSIONING_RESISTANCE), 0U); // the next, which does not start
    EXPECT_EQ(state(), uint32_t(COMMISSIONING_IDLE));
    EXPECT_EQ(x.get(0x3000, 4) & 0xFF, uint32_t(COMMISSIONING_NO_REASON));
}

// A drive that is new: nothing stored, and no motor that anyone knows
TEST(BusIdentification, AnUnknownMachineIsIdentifiedAndNothingElse)
{
    Bench x;
    x.boot(nullptr);
    x.run_ms(5);
    const auto enable = [&](int8_t mode) {
        x.give(0, {1, 0});
        for (const int word : {0x06, 0x07, 0x0F}) {
            x.control(uint16_t(word), mode, 0);
        }
    };
    for (const auto mode : {int8_t(3), int8_t(4), int8_t(-1)}) {
        enable(mode);
        x.run_ms(50);
        EXPECT_FALSE(x.loop.hal.armed) << int(mode);
        EXPECT_EQ(x.statusword() & 0x4F, 0x40) << int(mode);
    }
    ASSERT_EQ(x.set(0x3000, 1, COMMISSIONING_RESISTANCE), 0U);
    enable(-2);
    for (int done = 0; done < 10000 && (x.get(0x3000, 2) & 0xFF) != uint32_t(COMMISSIONING_DONE);
         done += 100) {
        x.run_ms(100);
        x.control(0x0F, done < 500 ? -2 : 3, 0); // another mode is for the next time
        EXPECT_EQ(x.loop.app.drive.command.mode, DRIVE_MODE_IDENTIFY);
    }
    EXPECT_EQ(x.get(0x3000, 2) & 0xFF, uint32_t(COMMISSIONING_DONE));
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.control(0x06, 3, 0);
    x.run_ms(20);
    enable(3);
    x.run_ms(50);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_NOT_STORED));
    EXPECT_EQ(x.set(0x1010, 4, 0x65766173), 0U); // what was found is the user's now
    enable(3);
    x.run_ms(50);
    EXPECT_TRUE(x.loop.hal.armed);
}

TEST(BusIdentification, TheSaliencyMapIsInAmperesAndHenries)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    saliency_map_result_t &map = x.loop.app.drive.saliency_map;
    map.centre = PM_ONE / 32;
    map.radius = PM_ONE / 128;
    const double base_A = bench::kIpmBase.i_A;
    EXPECT_NEAR(x.get(0x3000, 23), base_A / 32 * 1e6, 2);
    EXPECT_NEAR(x.get(0x3000, 24), base_A / 128 * 1e6, 2);
}

} // namespace
