// The state machine of CiA 402: every transition, and none that is not there.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

extern "C" {
#include "firmware/can/cia402.h"
#include "firmware/can/dictionary_slots.h"
}

namespace
{

enum : uint16_t {
    DISABLE_VOLTAGE = 0x00,
    QUICK_STOP = 0x02,
    SHUTDOWN = 0x06,
    SWITCH_ON = 0x07,
    ENABLE = 0x0F,
    RESET = 0x80,
    HALT = 0x100
};

class Profile
{
  public:
    Profile()
    {
        cia402_init(&self);
        in.ready = true;
        in.off = true;
        in.voltage = true;
        step();
    }

    cia402_out_t step()
    {
        return out = cia402_step(&self, &in);
    }

    cia402_state_t command(uint16_t word)
    {
        put(OD_LIVE_CONTROLWORD, word);
        step();
        return self.state;
    }

    uint32_t put(uint16_t slot, int32_t value)
    {
        uint32_t code = 1;
        EXPECT_TRUE(cia402_put(&self, slot, value, &code));
        return code;
    }

    int32_t get(uint16_t slot)
    {
        int32_t value = 0;
        EXPECT_TRUE(cia402_get(&self, slot, &value));
        return value;
    }

    // To a state, from the beginning
    void reach(cia402_state_t state)
    {
        const uint16_t words[] = {SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP};
        const int steps[] = {0, 0, 1, 2, 3, 4};
        for (int n = 0; n < steps[state]; ++n) {
            command(words[n]);
            in.off = self.state != CIA402_OPERATION_ENABLED && self.state != CIA402_QUICK_STOP_ACTIVE;
        }
        ASSERT_EQ(self.state, state);
    }

    uint16_t status()
    {
        return cia402_statusword(&self, &in);
    }

    cia402_t self = {};
    cia402_in_t in = {};
    cia402_out_t out = {};
};

TEST(Cia402, BeginsDisabledAndDoesNothing)
{
    Profile x;
    EXPECT_EQ(x.self.state, CIA402_SWITCH_ON_DISABLED);
    EXPECT_FALSE(x.out.enable);
    EXPECT_FALSE(x.out.clear_fault);
}

TEST(Cia402, EveryTransition)
{
    const cia402_state_t D = CIA402_SWITCH_ON_DISABLED, R = CIA402_READY_TO_SWITCH_ON, S = CIA402_SWITCHED_ON,
                         E = CIA402_OPERATION_ENABLED, Q = CIA402_QUICK_STOP_ACTIVE;
    const uint16_t words[] = {DISABLE_VOLTAGE, QUICK_STOP, SHUTDOWN, SWITCH_ON, ENABLE};
    const struct {
        cia402_state_t from, to[5];
    } table[] = {
        {D, {D, D, R, D, D}}, {R, {D, D, R, S, E}}, // 3 and 4 at once
        {S, {D, D, R, S, E}}, {E, {D, Q, R, S, E}},
        {Q, {D, Q, Q, Q, Q}}, // with option 1 there is no way back
    };
    for (const auto &row : table) {
        for (size_t n = 0; n < 5; ++n) {
            Profile x;
            x.reach(row.from);
            EXPECT_EQ(x.command(words[n]), row.to[n]) << row.from << " " << words[n];
        }
    }
}

TEST(Cia402, StatusBitsOfEveryState)
{
    const std::pair<cia402_state_t, std::pair<int, int>> all[] = {
        {CIA402_SWITCH_ON_DISABLED, {0x4F, 0x40}}, {CIA402_READY_TO_SWITCH_ON, {0x6F, 0x21}},
        {CIA402_SWITCHED_ON, {0x6F, 0x23}},        {CIA402_OPERATION_ENABLED, {0x6F, 0x27}},
        {CIA402_QUICK_STOP_ACTIVE, {0x6F, 0x07}},
    };
    for (const auto &row : all) {
        Profile x;
        x.reach(row.first);
        EXPECT_EQ(x.status() & row.second.first, row.second.second);
        EXPECT_EQ(x.status() & 0x0210, 0x0210); // remote, voltage
    }
    Profile x;
    x.in.fault = true;
    x.in.off = false;
    x.step();
    EXPECT_EQ(x.status() & 0x4F, 0x0F);
    x.in.off = true;
    x.step();
    EXPECT_EQ(x.status() & 0x4F, 0x08);
}

TEST(Cia402, NotReadyIsNotSwitchedOn)
{
    Profile x;
    x.in.ready = false;
    EXPECT_EQ(x.command(SHUTDOWN), CIA402_SWITCH_ON_DISABLED);
    x.in.ready = true;
    EXPECT_EQ(x.command(SHUTDOWN), CIA402_READY_TO_SWITCH_ON);
    x.in.ready = false;
    EXPECT_EQ(x.command(ENABLE), CIA402_SWITCH_ON_DISABLED);
}

TEST(Cia402, EnablesWithTheModeOfThatMoment)
{
    Profile x;
    x.put(OD_LIVE_MODE, CIA402_MODE_TORQUE);
    x.put(OD_LIVE_TARGET_TORQUE, -250);
    x.put(OD_LIVE_TARGET_VELOCITY, 1000);
    x.reach(CIA402_OPERATION_ENABLED);
    EXPECT_TRUE(x.out.enable);
    EXPECT_EQ(x.out.mode, CIA402_MODE_TORQUE);
    EXPECT_EQ(x.out.torque, -250);
    EXPECT_EQ(x.put(OD_LIVE_MODE, CIA402_MODE_VELOCITY), 0U);
    x.step();
    EXPECT_EQ(x.get(OD_LIVE_MODE_DISPLAY), CIA402_MODE_TORQUE);
    EXPECT_EQ(x.out.mode, CIA402_MODE_TORQUE);
    x.command(SWITCH_ON);
    EXPECT_EQ(x.get(OD_LIVE_MODE_DISPLAY), CIA402_MODE_VELOCITY);
    x.command(ENABLE);
    EXPECT_EQ(x.out.mode, CIA402_MODE_VELOCITY);
    EXPECT_EQ(x.out.velocity, 1000);
    EXPECT_EQ(x.out.torque, 0);
}

TEST(Cia402, WithoutAModeThereIsNoOperation)
{
    Profile x;
    x.put(OD_LIVE_MODE, CIA402_MODE_NONE);
    x.reach(CIA402_SWITCHED_ON);
    EXPECT_EQ(x.command(ENABLE), CIA402_SWITCHED_ON);
    EXPECT_FALSE(x.out.enable);
}

TEST(Cia402, OnlyModesThatThereAre)
{
    Profile x;
    for (int mode = -128; mode < 128; ++mode) {
        const bool known = mode == -3 || mode == -2 || mode == -1 || mode == 0 || mode == 3 || mode == 4;
        EXPECT_EQ(x.put(OD_LIVE_MODE, mode), known ? 0U : 0x06090030U) << mode;
    }
}

TEST(Cia402, CurrentModeGivesCurrentAndTurns)
{
    Profile x;
    x.put(OD_LIVE_MODE, CIA402_MODE_CURRENT);
    x.put(OD_LIVE_TARGET_CURRENT, 1500);
    x.put(OD_LIVE_TARGET_VELOCITY, 20000);
    x.reach(CIA402_OPERATION_ENABLED);
    EXPECT_EQ(x.out.mode, CIA402_MODE_CURRENT);
    EXPECT_EQ(x.out.current, 1500);
    EXPECT_EQ(x.out.velocity, 20000);
}

TEST(Cia402, DutyModeGivesTheDutyAndNothingElseDoes)
{
    for (const int mode : {CIA402_MODE_DUTY, CIA402_MODE_CURRENT, CIA402_MODE_VELOCITY, CIA402_MODE_TORQUE}) {
        Profile x;
        x.put(OD_LIVE_MODE, mode);
        x.put(OD_LIVE_TARGET_DUTY, -2500);
        x.reach(CIA402_OPERATION_ENABLED);
        EXPECT_EQ(x.out.mode, mode);
        EXPECT_EQ(x.out.duty, mode == CIA402_MODE_DUTY ? -2500 : 0) << mode;
        x.command(ENABLE | HALT);
        EXPECT_TRUE(x.out.enable);
        EXPECT_EQ(x.out.duty, 0) << "halted";
    }
}

TEST(Cia402, TargetsReadBack)
{
    Profile x;
    int32_t value = 0;
    for (const uint16_t slot : {OD_LIVE_TARGET_VELOCITY, OD_LIVE_TARGET_TORQUE, OD_LIVE_TARGET_CURRENT,
                                OD_LIVE_TARGET_DUTY, OD_LIVE_VELOCITY_WINDOW, OD_LIVE_VELOCITY_THRESHOLD}) {
        EXPECT_EQ(x.put(slot, ++value), 0U);
        EXPECT_EQ(x.get(slot), value);
    }
}

TEST(Cia402, CurrentIsGivenToTheModesOfOurOwnAlone)
{
    for (const int mode : {CIA402_MODE_IDENTIFY, CIA402_MODE_CURRENT, CIA402_MODE_NONE, CIA402_MODE_VELOCITY,
                           CIA402_MODE_TORQUE}) {
        Profile x;
        x.self.state = CIA402_OPERATION_ENABLED;
        x.self.active_mode = int16_t(mode);
        x.put(OD_LIVE_TARGET_CURRENT, 1500);
        x.put(OD_LIVE_CONTROLWORD, ENABLE);
        x.in.off = false;
        x.step();
        EXPECT_EQ(x.out.current, mode < 0 ? 1500 : 0) << mode;
    }
}

TEST(Cia402, HowItIsSwitchedOffFollowsTheOptions)
{
    const struct {
        uint16_t slot, word;
        int32_t option;
        bool coast;
    } all[] = {
        {OD_LIVE_SHUTDOWN_OPTION, SHUTDOWN, 0, true},     {OD_LIVE_SHUTDOWN_OPTION, SHUTDOWN, 1, false},
        {OD_LIVE_DISABLE_OPTION, SWITCH_ON, 0, true},     {OD_LIVE_DISABLE_OPTION, SWITCH_ON, 1, false},
        {OD_LIVE_QUICK_STOP_OPTION, QUICK_STOP, 0, true}, {OD_LIVE_QUICK_STOP_OPTION, QUICK_STOP, 1, false},
    };
    for (const auto &row : all) {
        Profile x;
        EXPECT_EQ(x.put(row.slot, row.option), 0U);
        x.reach(CIA402_OPERATION_ENABLED);
        x.command(row.word);
        EXPECT_FALSE(x.out.enable);
        EXPECT_EQ(x.out.coast, row.coast) << row.slot << " " << row.option;
        x.command(DISABLE_VOLTAGE); // at once, also while it stops
        EXPECT_TRUE(x.out.coast);
    }
}

TEST(Cia402, QuickStopEndsDisabledOrStays)
{
    Profile x;
    x.reach(CIA402_QUICK_STOP_ACTIVE);
    EXPECT_FALSE(x.out.enable);
    x.step();
    EXPECT_EQ(x.self.state, CIA402_QUICK_STOP_ACTIVE);
    x.in.off = true; // it stands
    x.step();
    EXPECT_EQ(x.self.state, CIA402_SWITCH_ON_DISABLED);
    Profile y;
    y.put(OD_LIVE_QUICK_STOP_OPTION, 5);
    y.put(OD_LIVE_TARGET_VELOCITY, 5000);
    y.reach(CIA402_QUICK_STOP_ACTIVE);
    y.in.off = false;
    y.step();
    EXPECT_TRUE(y.out.enable);
    EXPECT_EQ(y.out.velocity, 0);
    EXPECT_EQ(y.command(ENABLE), CIA402_OPERATION_ENABLED);
    EXPECT_EQ(y.out.velocity, 5000);
}

TEST(Cia402, OptionsThatTheDriveDoesNotHaveAreRefused)
{
    Profile x;
    const struct {
        uint16_t slot;
        std::vector<int32_t> good;
    } all[] = {{OD_LIVE_QUICK_STOP_OPTION, {0, 1, 5}},
               {OD_LIVE_SHUTDOWN_OPTION, {0, 1}},
               {OD_LIVE_DISABLE_OPTION, {0, 1}},
               {OD_LIVE_HALT_OPTION, {1}},
               {OD_LIVE_FAULT_OPTION, {0}}};
    for (const auto &row : all) {
        for (int32_t value = -3; value < 9; ++value) {
            const bool good = std::count(row.good.begin(), row.good.end(), value) > 0;
            EXPECT_EQ(x.put(row.slot, value), good ? 0U : 0x06090030U) << row.slot << " " << value;
            if (good) {
                EXPECT_EQ(x.get(row.slot), value);
            }
        }
    }
}

TEST(Cia402, HaltStopsAndStaysEnabled)
{
    Profile x;
    x.put(OD_LIVE_TARGET_VELOCITY, 5000);
    x.reach(CIA402_OPERATION_ENABLED);
    x.in.following = true;
    x.command(ENABLE | HALT);
    EXPECT_TRUE(x.out.enable);
    EXPECT_EQ(x.out.velocity, 0);
    x.in.velocity = 4000;
    EXPECT_EQ(x.status() & 0x0400, 0);
    x.in.velocity = 900;
    EXPECT_EQ(x.status() & 0x1400, 0x1400);
    x.command(ENABLE);
    EXPECT_EQ(x.out.velocity, 5000);
}

TEST(Cia402, StandstillIsABitOfTheVelocityModeAlone)
{
    for (const int mode : {CIA402_MODE_VELOCITY, CIA402_MODE_TORQUE}) {
        Profile x;
        x.put(OD_LIVE_MODE, mode);
        x.reach(CIA402_OPERATION_ENABLED);
        EXPECT_EQ((x.status() & 0x1000) != 0, mode == CIA402_MODE_VELOCITY) << mode;
        x.in.velocity = 4000;
        EXPECT_EQ(x.status() & 0x1000, 0) << mode;
    }
}

TEST(Cia402, FaultIsLeftByTheRisingEdgeAfterItsCauseAlone)
{
    for (const cia402_state_t state : {CIA402_SWITCH_ON_DISABLED, CIA402_SWITCHED_ON,
                                       CIA402_OPERATION_ENABLED, CIA402_QUICK_STOP_ACTIVE}) {
        Profile x;
        x.reach(state);
        x.command(ENABLE | RESET); // the bit stands before the fault
        x.in.fault = true;
        x.in.off = true;
        x.step();
        EXPECT_EQ(x.self.state, CIA402_FAULT);
        EXPECT_FALSE(x.out.enable);
        for (int n = 0; n < 5; ++n) {
            x.step();
            EXPECT_FALSE(x.out.clear_fault);
        }
        x.command(ENABLE);
        EXPECT_EQ(x.self.state, CIA402_FAULT);
        x.command(RESET);
        EXPECT_TRUE(x.out.clear_fault);
        x.step(); // the cause is still there
        EXPECT_EQ(x.self.state, CIA402_FAULT);
        EXPECT_FALSE(x.out.clear_fault);
        x.in.fault = false; // it goes by itself: that alone changes nothing
        x.step();
        EXPECT_EQ(x.self.state, CIA402_FAULT);
        x.command(0);
        EXPECT_EQ(x.command(RESET), CIA402_SWITCH_ON_DISABLED);
        x.command(ENABLE); // and nothing starts by itself
        EXPECT_FALSE(x.out.enable);
    }
}

TEST(Cia402, FaultResetWaitsForTheBridge)
{
    Profile x;
    x.reach(CIA402_OPERATION_ENABLED);
    x.in.fault = true;
    x.in.off = false;
    x.step();
    EXPECT_EQ(x.self.state, CIA402_FAULT_REACTION_ACTIVE);
    x.command(RESET);
    EXPECT_FALSE(x.out.clear_fault);
}

TEST(Cia402, TargetReached)
{
    Profile x;
    x.put(OD_LIVE_TARGET_VELOCITY, 100000);
    x.put(OD_LIVE_VELOCITY_WINDOW, 500);
    x.reach(CIA402_OPERATION_ENABLED);
    x.in.velocity = 99600;
    EXPECT_EQ(x.status() & 0x4400, 0);
    x.in.following = true;
    EXPECT_EQ(x.status() & 0x4400, 0x4400);
    x.in.velocity = 99499;
    EXPECT_EQ(x.status() & 0x0400, 0);
    x.in.velocity = INT32_MIN;
    x.put(OD_LIVE_TARGET_VELOCITY, INT32_MAX);
    EXPECT_EQ(x.status() & 0x0400, 0);
    x.in.limited = true;
    x.in.warning = true;
    EXPECT_EQ(x.status() & 0x0880, 0x0880);
}

} // namespace
