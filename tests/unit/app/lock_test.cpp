// What a wrong value could destroy the hardware by is changed with the bridge off and behind a signature alone.
#include "tests/unit/app/bench.h"

using app_test::Bench;
using app_test::defaults;
using app_test::Running;
using app_test::signature_open;

namespace
{

const uint32_t save = 0x65766173, load = 0x64616F6C;
enum : uint32_t { SIGNATURE = 0x08000020, LOCKED = 0x08000021, STATE = 0x08000022 };

class Booted : public Bench
{
  public:
    Booted()
    {
        const drive_params_t params = defaults();
        boot(&params);
        run_ms(5);
    }

    uint32_t try_R_s(int32_t value)
    {
        return set_as_it_is(0x2100, 2, uint32_t(value));
    }
};

bool protects(const od_entry_t &entry)
{
    const bool of_machine = entry.kind == OD_PARAMETER && entry.index == 0x2100;
    const bool of_protection = entry.kind == OD_PARAMETER && entry.index == 0x2600;
    return (of_machine || of_protection) && (entry.flags & OD_WRITE) != 0;
}

TEST(Lock, MachineAndProtectionChangeBehindItAlone)
{
    Booted x;
    int tried = 0;
    for (uint32_t row = 0; row < od_count; ++row) {
        const od_entry_t &entry = od_table[row];
        if (protects(entry)) {
            const uint32_t value = x.get(entry.index, entry.sub);
            EXPECT_EQ(x.set_as_it_is(entry.index, entry.sub, value), LOCKED) << std::hex << entry.index;
            ++tried;
        }
    }
    EXPECT_EQ(tried, 14 + 12); // machine, protections
    EXPECT_EQ(x.get(0x2010, 5), 0U);
    EXPECT_EQ(x.set_as_it_is(0x2010, 5, signature_open), 0U);
    EXPECT_EQ(x.get(0x2010, 5), 1U);
    EXPECT_EQ(x.try_R_s(6100000), 0U);
    EXPECT_EQ(x.set_as_it_is(0x2010, 5, 0), 0U);
    EXPECT_EQ(x.try_R_s(6200000), LOCKED);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_R_s), 6100000);
    EXPECT_EQ(x.set_as_it_is(0x2200, 5, 5000), 0U); // of the controllers: as ever
}

// In a batch too, and all that would forget or take over what it protects
TEST(Lock, NoWayRoundIt)
{
    Booted x;
    EXPECT_EQ(x.set(0x2010, 1, 1), 0U);
    EXPECT_EQ(x.try_R_s(6100000), LOCKED);
    EXPECT_EQ(x.set(0x2010, 1, 0), 0U);
    for (const auto sub : {uint8_t(1), uint8_t(4)}) {
        EXPECT_EQ(x.set_as_it_is(0x1010, sub, save), LOCKED);
    }
    for (const auto sub : {uint8_t(1), uint8_t(3), uint8_t(4)}) {
        EXPECT_EQ(x.set_as_it_is(0x1011, sub, load), LOCKED);
    }
    EXPECT_EQ(x.set_as_it_is(0x1010, 2, save), 0U);
    EXPECT_EQ(x.set_as_it_is(0x1011, 2, load), 0U);
    for (const uint32_t wrong : {1U, 0x65706F6EU, save, load, 0xFFFFFFFFU}) {
        EXPECT_EQ(x.set_as_it_is(0x2010, 5, wrong), SIGNATURE);
        EXPECT_EQ(x.get(0x2010, 5), 0U);
    }
    EXPECT_EQ(x.parameter(DRIVE_PARAM_R_s), defaults().R_s);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
}

// A save that nobody meant does not make the machine of the presets the user's.
TEST(Lock, AnEmptyDriveIsNotMadeReadyByASaveAlone)
{
    Bench x;
    x.boot(nullptr);
    x.run_ms(5);
    EXPECT_EQ(x.set_as_it_is(0x1010, 1, save), LOCKED);
    EXPECT_EQ(x.set_as_it_is(0x1010, 4, save), LOCKED);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_NOT_STORED));
}

TEST(Lock, CloseIsWhatEndsTheSession)
{
    const struct {
        const char *what;
        void (*happens)(Bench &);
    } ends[] = {{"power-up", [](Bench &x) { sim_loop_boot(&x.loop); }},
                {"reset of communication",
                 [](Bench &x) {
                     x.give(0, {130, 1});
                 }},
                {"stop, and start again",
                 [](Bench &x) {
                     x.give(0, {2, 1});
                     x.give(0, {1, 1});
                 }},
                {"bus-off",
                 [](Bench &x) {
                     x.loop.hal.can_state = HAL_CAN_BUS_OFF;
                     x.run_ms(2);
                     x.loop.hal.can_state = HAL_CAN_ACTIVE;
                 }},
                {"a master's heartbeat lost", [](Bench &x) {
                     x.give(0x77F, {5});
                     x.run_ms(600);
                 }}};
    for (const auto &end : ends) {
        Booted x;
        EXPECT_EQ(x.set_as_it_is(0x2010, 5, signature_open), 0U);
        x.run_ms(2000); // while nothing happens it stays
        EXPECT_EQ(x.try_R_s(6100000), 0U);
        end.happens(x);
        x.run_ms(5);
        EXPECT_EQ(x.try_R_s(6200000), LOCKED) << end.what;
        EXPECT_EQ(x.get(0x2010, 5), 0U) << end.what;
    }
}

TEST(Lock, OpenOrNotNothingProtectedChangesWhileTheBridgeIsOn)
{
    Running x;
    int tried = 0;
    for (const bool open : {false, true}) {
        EXPECT_EQ(x.set_as_it_is(0x2010, 5, open ? signature_open : 0), 0U);
        for (uint32_t row = 0; row < od_count; ++row) {
            const od_entry_t &entry = od_table[row];
            if (protects(entry)) {
                const uint32_t value = x.get(entry.index, entry.sub);
                EXPECT_EQ(x.set_as_it_is(entry.index, entry.sub, value), STATE) << entry.sub;
                x.control(0x0F);
                ++tried;
            }
        }
    }
    EXPECT_EQ(tried, 2 * 26);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
}

} // namespace
