// SocketCAN for real: the peer is a raw socket of this test on the same virtual bus. A virtual bus never goes
// bus-off by itself; the error frames by which a controller's driver tells are put on it by the peer.
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

extern "C" {
#include "hal/linux/can_link.h"
}

namespace
{

class Peer
{
  public:
    explicit Peer(const char *bus) : fd_(socket(PF_CAN, SOCK_RAW, CAN_RAW))
    {
        sockaddr_can address = {};
        address.can_family = AF_CAN;
        address.can_ifindex = static_cast<int>(if_nametoindex(bus));
        EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr *>(&address), sizeof address), 0);
    }
    ~Peer()
    {
        close(fd_);
    }
    Peer(const Peer &) = delete;
    Peer &operator=(const Peer &) = delete;

    void say(const can_frame &frame) const
    {
        while (write(fd_, &frame, sizeof frame) != ssize_t(sizeof frame)) {
            ASSERT_TRUE(errno == ENOBUFS || errno == EINTR) << std::strerror(errno);
        }
    }

    bool hear(can_frame *frame, int timeout_ms = 2000) const
    {
        pollfd ready = {fd_, POLLIN, 0};
        return poll(&ready, 1, timeout_ms) == 1 && read(fd_, frame, sizeof *frame) == ssize_t(sizeof *frame);
    }

  private:
    int fd_;
};

can_frame frame_of(canid_t id, int length = 8, uint32_t number = 0)
{
    can_frame frame = {};
    frame.can_id = id;
    frame.can_dlc = static_cast<uint8_t>(length);
    std::memcpy(frame.data, &number, sizeof number);
    return frame;
}

can_frame error_of(canid_t kind, int controller = 0)
{
    can_frame frame = frame_of(CAN_ERR_FLAG | kind);
    frame.data[1] = static_cast<uint8_t>(controller);
    return frame;
}

// Its bus is its own, so that it can be taken away.
class CanLink : public testing::Test
{
  protected:
    static constexpr const char *bus_ = "vcan7";

    static void ip(const std::string &what)
    {
        ASSERT_EQ(std::system(("ip link " + what).c_str()), 0) << what;
    }
    void SetUp() override
    {
        ip("add vcan7 type vcan");
        ip("set vcan7 up");
        peer_ = std::make_unique<Peer>(bus_);
        char error[200] = "";
        link_.reset(can_link_open(bus_, error, sizeof error));
        ASSERT_TRUE(link_) << error;
    }
    void TearDown() override
    {
        if (if_nametoindex(bus_) != 0) {
            ip("del vcan7");
        }
    }

    bool receive(hal_can_frame_t *frame) const // at most two seconds
    {
        for (int n = 0; n < 2000; ++n) {
            if (can_link_receive(link_.get(), frame)) {
                return true;
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        return false;
    }
    hal_can_state_t state_after(const can_frame &error) const
    {
        peer_->say(error);
        hal_can_frame_t frame;
        EXPECT_FALSE(can_link_receive(link_.get(), &frame));
        return can_link_state(link_.get());
    }

    std::unique_ptr<Peer> peer_;
    std::unique_ptr<can_link_t, void (*)(can_link_t *)> link_{nullptr, &can_link_close};
};

TEST_F(CanLink, FramesOfEveryLengthGoBothWays)
{
    EXPECT_STREQ(can_link_where(link_.get()), bus_);
    for (int length = 0; length <= 8; ++length) {
        peer_->say(frame_of(0x201, length, 0x5A12U));
        hal_can_frame_t got;
        ASSERT_TRUE(receive(&got));
        EXPECT_EQ(got.id, 0x201);
        ASSERT_EQ(got.length, length);
        EXPECT_EQ(got.data[0], 0x12);

        const hal_can_frame_t put = {0x7FF, static_cast<uint8_t>(length), {1, 2, 3, 4, 5, 6, 7, 0xFF}};
        ASSERT_TRUE(can_link_send(link_.get(), &put));
        can_frame heard;
        ASSERT_TRUE(peer_->hear(&heard));
        EXPECT_EQ(heard.can_id, 0x7FFU);
        ASSERT_EQ(heard.can_dlc, length);
        EXPECT_EQ(std::memcmp(heard.data, put.data, size_t(length)), 0);
    }
    hal_can_frame_t own;
    EXPECT_FALSE(can_link_receive(link_.get(), &own)); // not what it has sent itself
}

TEST_F(CanLink, OtherKindsOfFramesAreSkipped)
{
    peer_->say(frame_of(CAN_EFF_FLAG | 0x201));
    peer_->say(frame_of(CAN_RTR_FLAG | 0x201, 0));
    peer_->say(frame_of(0x202, 1));
    hal_can_frame_t frame;
    ASSERT_TRUE(receive(&frame));
    EXPECT_EQ(frame.id, 0x202);
    EXPECT_FALSE(can_link_receive(link_.get(), &frame));
}

// A peer that sends as fast as it can, a reader that looks once in a millisecond as the node does: what is
// lost is lost at the end of the queue, nothing is changed or out of order, and afterwards all is as before.
TEST_F(CanLink, AFlood)
{
    constexpr uint32_t count = 30000;
    std::thread sender([this] {
        for (uint32_t n = 1; n <= count; ++n) {
            peer_->say(frame_of(0x123, 8, n));
        }
    });
    hal_can_frame_t frame;
    uint32_t taken = 0, last = 0;
    const auto take = [&](int most) {
        while (most-- > 0 && can_link_receive(link_.get(), &frame)) {
            uint32_t number;
            std::memcpy(&number, frame.data, sizeof number);
            EXPECT_EQ(frame.id, 0x123);
            EXPECT_GT(number, last);
            last = number;
            ++taken;
        }
    };
    for (int n = 0; n < 300; ++n) {
        take(16);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    sender.join();
    take(count);
    EXPECT_GT(taken, 500U);
    peer_->say(frame_of(0x201, 0));
    ASSERT_TRUE(receive(&frame));
    EXPECT_EQ(frame.id, 0x201);
    EXPECT_EQ(can_link_state(link_.get()), HAL_CAN_ACTIVE);
    RecordProperty("taken", static_cast<int>(taken));
}

TEST_F(CanLink, StateOfTheController)
{
    EXPECT_EQ(can_link_state(link_.get()), HAL_CAN_ACTIVE);
    EXPECT_EQ(state_after(error_of(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING)), HAL_CAN_ACTIVE);
    EXPECT_EQ(state_after(error_of(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE)), HAL_CAN_PASSIVE);
    EXPECT_EQ(state_after(error_of(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW)), HAL_CAN_PASSIVE);
    EXPECT_EQ(state_after(error_of(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING)), HAL_CAN_ACTIVE);
    EXPECT_EQ(state_after(error_of(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE)), HAL_CAN_PASSIVE);
    EXPECT_EQ(state_after(error_of(CAN_ERR_BUSOFF)), HAL_CAN_BUS_OFF);
    EXPECT_EQ(state_after(error_of(CAN_ERR_RESTARTED)), HAL_CAN_ACTIVE);
    EXPECT_EQ(state_after(error_of(CAN_ERR_BUSOFF)), HAL_CAN_BUS_OFF);
    EXPECT_EQ(state_after(error_of(CAN_ERR_PROT)), HAL_CAN_BUS_OFF); // not asked for
}

TEST_F(CanLink, TrafficEndsBusOff)
{
    EXPECT_EQ(state_after(error_of(CAN_ERR_BUSOFF)), HAL_CAN_BUS_OFF);
    peer_->say(frame_of(0x201, 0));
    hal_can_frame_t frame;
    ASSERT_TRUE(receive(&frame));
    EXPECT_EQ(can_link_state(link_.get()), HAL_CAN_ACTIVE);
}

TEST_F(CanLink, AnInterfaceThatIsDownIsSilent)
{
    const hal_can_frame_t put = {0x181, 0, {}};
    hal_can_frame_t frame;
    ip("set vcan7 down");
    EXPECT_FALSE(can_link_send(link_.get(), &put));
    EXPECT_FALSE(can_link_receive(link_.get(), &frame));
    EXPECT_EQ(can_link_state(link_.get()), HAL_CAN_ACTIVE);
    ip("set vcan7 up");
    const Peer peer(bus_);
    EXPECT_TRUE(can_link_send(link_.get(), &put));
    peer.say(frame_of(0x201, 0));
    ASSERT_TRUE(receive(&frame));
    EXPECT_EQ(frame.id, 0x201);
}

TEST_F(CanLink, ARemovedInterfaceIsBusOff)
{
    ip("del vcan7");
    const hal_can_frame_t put = {0x181, 0, {}};
    hal_can_frame_t frame;
    EXPECT_FALSE(can_link_receive(link_.get(), &frame));
    EXPECT_FALSE(can_link_send(link_.get(), &put));
    EXPECT_EQ(can_link_state(link_.get()), HAL_CAN_BUS_OFF);
}

TEST_F(CanLink, AnInterfaceOfAnotherKindIsRefused)
{
    char error[200] = "";
    EXPECT_EQ(can_link_open("lo", error, sizeof error), nullptr);
    EXPECT_NE(std::string(error).find("lo: "), std::string::npos) << error;
}

TEST_F(CanLink, AnInterfaceThatIsDownCanBeOpened)
{
    ip("set vcan7 down");
    char error[200] = "";
    link_.reset(can_link_open(bus_, error, sizeof error));
    ASSERT_TRUE(link_) << error;
    ip("set vcan7 up");
    const Peer peer(bus_);
    peer.say(frame_of(0x201, 0));
    hal_can_frame_t frame;
    EXPECT_TRUE(receive(&frame));
}

} // namespace
