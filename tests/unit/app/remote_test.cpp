// Frames in, commands out.
#include <gtest/gtest.h>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wc++20-extensions"
extern "C" {
#include "firmware/app/remote.h"
}
#pragma GCC diagnostic pop

namespace
{

hal_can_frame_t command(uint8_t control, uint8_t mode, int32_t speed)
{
    const auto s = static_cast<uint32_t>(speed);
    return {0x201,
            6,
            {control, mode, uint8_t(s & 255U), uint8_t(s >> 8 & 255U), uint8_t(s >> 16 & 255U),
             uint8_t(s >> 24)}};
}

TEST(Remote, TakesSpeedAndMode)
{
    remote_t r = {};
    const hal_can_frame_t frame = command(1, DRIVE_MODE_TORQUE, -123456);
    EXPECT_EQ(remote_take(&r, &frame, 5), REMOTE_COMMAND);
    EXPECT_TRUE(r.command.enable);
    EXPECT_EQ(r.command.mode, DRIVE_MODE_TORQUE);
    EXPECT_EQ(r.command.speed_mrad_s, -123456);
}

TEST(Remote, TakesTorqueAndCurrent)
{
    remote_t r = {};
    const hal_can_frame_t frame = {0x301, 8, {0x40, 0x42, 0x0F, 0, 0x18, 0xFC, 0xFF, 0xFF}};
    EXPECT_EQ(remote_take(&r, &frame, 5), REMOTE_COMMAND);
    EXPECT_EQ(r.command.torque_uNm, 1000000);
    EXPECT_EQ(r.command.current_mA, -1000);
    EXPECT_FALSE(r.command.enable);
}

TEST(Remote, ClearsAtTheEdgeAlone)
{
    remote_t r = {};
    const hal_can_frame_t set = command(0x80, 0, 0), rest = command(0, 0, 0);
    EXPECT_EQ(remote_take(&r, &set, 0), REMOTE_CLEAR);
    EXPECT_EQ(remote_take(&r, &set, 0), REMOTE_COMMAND);
    EXPECT_EQ(remote_take(&r, &rest, 0), REMOTE_COMMAND);
    EXPECT_EQ(remote_take(&r, &set, 0), REMOTE_CLEAR);
}

TEST(Remote, RefusesWhatMakesNoSense)
{
    remote_t r = {};
    hal_can_frame_t frame = command(1, 0, 1000);
    frame.length = 5;
    EXPECT_EQ(remote_take(&r, &frame, 0), REMOTE_NOTHING);
    frame = command(1, DRIVE_MODE_CURRENT + 1, 1000);
    EXPECT_EQ(remote_take(&r, &frame, 0), REMOTE_NOTHING);
    const hal_can_frame_t setpoint = {0x301, 7, {1}};
    EXPECT_EQ(remote_take(&r, &setpoint, 0), REMOTE_NOTHING);
    EXPECT_EQ(r.refused, 3U);
    EXPECT_FALSE(r.command.enable);
    frame = command(1, 0, 1000);
    frame.id = 0x202; // another node's
    EXPECT_EQ(remote_take(&r, &frame, 0), REMOTE_NOTHING);
    EXPECT_EQ(r.refused, 3U);
    EXPECT_FALSE(r.command.enable);
}

TEST(Remote, IsLostWhileEnabledOnly)
{
    remote_t r = {};
    EXPECT_FALSE(remote_lost(&r, 2000000));
    const uint32_t then = 0xFFFFFF00U; // the clock wraps
    const hal_can_frame_t frame = command(1, 0, 0);
    remote_take(&r, &frame, then);
    EXPECT_FALSE(remote_lost(&r, then + REMOTE_TIMEOUT_US));
    EXPECT_TRUE(remote_lost(&r, then + REMOTE_TIMEOUT_US + 1));
    // a set-point alone does not keep it alive
    const hal_can_frame_t setpoint = {0x301, 8, {}};
    remote_take(&r, &setpoint, then + 400000);
    EXPECT_TRUE(remote_lost(&r, then + REMOTE_TIMEOUT_US + 1));
}

TEST(Remote, TellsTheStateEveryTenMilliseconds)
{
    remote_t r = {};
    drive_status_t status = {};
    status.state = DRIVE_FAULT;
    status.fault = DRIVE_FAULT_STALL;
    status.limits = 0x0302;
    hal_can_frame_t frame;
    EXPECT_FALSE(remote_status(&r, &status, 9999, &frame));
    ASSERT_TRUE(remote_status(&r, &status, 10000, &frame));
    EXPECT_FALSE(remote_status(&r, &status, 10001, &frame));
    EXPECT_EQ(frame.id, 0x181);
    EXPECT_EQ(frame.length, 4);
    EXPECT_EQ(frame.data[0], DRIVE_FAULT);
    EXPECT_EQ(frame.data[1], DRIVE_FAULT_STALL);
    EXPECT_EQ(frame.data[2], 0x02);
    EXPECT_EQ(frame.data[3], 0x03);
}

} // namespace
