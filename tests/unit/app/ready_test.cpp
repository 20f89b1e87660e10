// What a drive is after a reset: whether it may be switched on, and that it says so once.
#include "tests/unit/app/bench.h"

using app_test::Bench;
using app_test::defaults;

namespace
{

const uint32_t save = 0x65766173, load = 0x64616F6C;

// Ready means that the machine's parameters are a user's, each of them.
TEST(Ready, OtherGroupsDoNotMakeAnEmptyDriveReady)
{
    Bench x;
    x.boot(nullptr);
    x.run_ms(5);
    for (const uint8_t group : {uint8_t(2), uint8_t(3)}) { // communication, application
        EXPECT_EQ(x.set(0x1010, group, save), 0U);
        EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_NOT_STORED));
        sim_loop_boot(&x.loop);
        x.run_ms(5);
        EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_NOT_STORED));
        x.run_enabled_ms(300);
        EXPECT_FALSE(x.loop.hal.armed);
    }
    EXPECT_EQ(x.set(0x1010, 4, save), 0U);
    sim_loop_boot(&x.loop);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
    EXPECT_EQ(x.set(0x1011, 4, load), 0U);
    sim_loop_boot(&x.loop);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_NOT_STORED));
}

// A page that lacks one of them, as another version may leave it
TEST(Ready, EachParameterOfTheMachineMustBeStored)
{
    const drive_params_t params = defaults();
    uint32_t page[STORE_WORDS];
    app_page(&params, 1, page);
    const int32_t count = store_check(page);
    int of_machine = 0;
    for (int32_t left_out = 0; left_out < count; ++left_out) {
        Bench x;
        uint32_t *to = x.loop.hal.store[0];
        store_writer_t writer;
        store_begin(&writer, 1, od_schema, uint32_t(count - 1), to);
        to += STORE_HEADER;
        for (int32_t n = 0; n < count; ++n) {
            if (n != left_out) {
                store_put(&writer, store_pair(page, uint32_t(n)), to);
                to += 2;
            }
        }
        store_end(&writer, to);
        const store_pair_t pair = store_pair(page, uint32_t(left_out));
        bool has;
        const bool machine = od_find(uint16_t(pair.id >> 8 & 0xFFFF), uint8_t(pair.id & 0xFF), &has)->group ==
                             OD_GROUP_MACHINE;
        of_machine += machine ? 1 : 0;
        drive_params_t back;
        uint32_t unknown;
        EXPECT_EQ(app_load(&x.loop.hal, &back, &unknown), !machine) << std::hex << pair.id;
    }
    EXPECT_GT(of_machine, 10);
}

TEST(BusNode, SendsOneBootUpForEachReset)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    const auto boot_ups = [&] {
        int seen = 0;
        for (const hal_can_frame_t &frame : x.take(0x701)) {
            seen += frame.length == 1 && frame.data[0] == 0 ? 1 : 0;
        }
        return seen;
    };
    EXPECT_EQ(boot_ups(), 1);
    x.give(0, {130, 1});
    x.run_ms(20);
    EXPECT_EQ(boot_ups(), 1);
    x.give(0, {129, 1});
    x.run_ms(20); // until the restart, whoever makes it
    EXPECT_TRUE(x.loop.hal.reset);
    EXPECT_EQ(boot_ups(), 0);
    sim_loop_boot(&x.loop);
    x.run_ms(20);
    EXPECT_EQ(boot_ups(), 1);
}

} // namespace
