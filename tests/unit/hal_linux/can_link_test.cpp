// Links that need no kernel support: the peer is this test, on the other end of a terminal or a connection.
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

extern "C" {
#include "hal/linux/can_link.h"
}

namespace
{

using Link = std::unique_ptr<can_link_t, void (*)(can_link_t *)>;

Link open_link(const char *name)
{
    char error[200] = "";
    Link link(can_link_open(name, error, sizeof error), &can_link_close);
    EXPECT_TRUE(link) << error;
    return link;
}

// Until it comes, at most a second
bool receive(can_link_t *link, hal_can_frame_t *frame)
{
    for (int n = 0; n < 1000; ++n) {
        if (can_link_receive(link, frame)) {
            return true;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

class Peer
{
  public:
    explicit Peer(int fd) : fd_(fd)
    {
    }
    ~Peer()
    {
        close(fd_);
    }
    Peer(const Peer &) = delete;
    Peer &operator=(const Peer &) = delete;

    void say(const std::string &text) const
    {
        ASSERT_EQ(write(fd_, text.data(), text.size()), ssize_t(text.size()));
    }

    std::string hear(char last) const
    {
        std::string text;
        pollfd ready = {fd_, POLLIN, 0};
        char c;
        while (poll(&ready, 1, 1000) > 0 && read(fd_, &c, 1) == 1) {
            text += c;
            if (c == last) {
                break;
            }
        }
        return text;
    }

  private:
    int fd_;
};

const hal_can_frame_t kFrame = {0x181, 4, {1, 0x2B, 0xFF, 0}};

TEST(SerialLine, FramesGoBothWays)
{
    const Link link = open_link("slcan:");
    const Peer peer(open(can_link_where(link.get()), O_RDWR | O_NOCTTY));
    hal_can_frame_t frame;
    EXPECT_FALSE(can_link_send(link.get(), &kFrame)); // the channel is closed
    peer.say("S8\rO\rt2013AABB0C\r");
    ASSERT_TRUE(receive(link.get(), &frame));
    EXPECT_EQ(frame.id, 0x201);
    ASSERT_EQ(frame.length, 3);
    EXPECT_EQ(frame.data[0], 0xAA);
    EXPECT_EQ(frame.data[2], 0x0C);
    ASSERT_TRUE(can_link_send(link.get(), &kFrame));
    EXPECT_EQ(peer.hear('\r'), "t1814012BFF00\r");
    peer.say("C\rt2010\r");
    EXPECT_FALSE(can_link_receive(link.get(), &frame));
}

TEST(SerialLine, RubbishIsSkipped)
{
    const Link link = open_link("slcan:");
    const Peer peer(open(can_link_where(link.get()), O_RDWR | O_NOCTTY));
    peer.say("O\rt9FF0\rt20\rt2019\rt2012AA\rt2012AAXX\r" + std::string(1000, 'x') +
             "\rT000002010\r\rt7FF0\r");
    hal_can_frame_t frame;
    ASSERT_TRUE(receive(link.get(), &frame));
    EXPECT_EQ(frame.id, 0x7FF);
    EXPECT_EQ(frame.length, 0);
    EXPECT_FALSE(can_link_receive(link.get(), &frame));
}

TEST(SerialLine, NoSuchTerminal)
{
    char error[200] = "";
    EXPECT_EQ(can_link_open("slcan:/dev/no_such_terminal", error, sizeof error), nullptr);
    EXPECT_NE(std::string(error).find("/dev/no_such_terminal"), std::string::npos);
}

int connect_to(const std::string &where)
{
    const auto port = static_cast<uint16_t>(std::stoi(where.substr(where.rfind(':') + 1)));
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr *>(&address), sizeof address), 0);
    return fd;
}

// Greets, opens, goes to raw mode; with patience, until the answer to that has surely been read.
void begin(can_link_t *link, const Peer &peer, bool patient = true)
{
    hal_can_frame_t frame;
    can_link_receive(link, &frame); // takes the connection
    EXPECT_EQ(peer.hear('>'), "< hi >");
    peer.say("< open can0 >");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    can_link_receive(link, &frame);
    EXPECT_EQ(peer.hear('>'), "< ok >");
    peer.say("< rawmode >");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    can_link_receive(link, &frame);
    EXPECT_FALSE(can_link_send(link, &kFrame)); // the answer stands alone
    EXPECT_EQ(peer.hear('>'), "< ok >");
    if (patient) {
        std::this_thread::sleep_for(std::chrono::milliseconds(40));
    }
}

TEST(Socketcand, FramesGoBothWays)
{
    const Link link = open_link("socketcand:localhost:0");
    hal_can_frame_t frame;
    EXPECT_FALSE(can_link_send(link.get(), &kFrame)); // nobody there
    const Peer peer(connect_to(can_link_where(link.get())));
    begin(link.get(), peer);
    peer.say("< send 201 3 AA BB C >");
    ASSERT_TRUE(receive(link.get(), &frame));
    EXPECT_EQ(frame.id, 0x201);
    ASSERT_EQ(frame.length, 3);
    EXPECT_EQ(frame.data[2], 0x0C);
    ASSERT_TRUE(can_link_send(link.get(), &kFrame));
    const std::string heard = peer.hear('>');
    EXPECT_EQ(heard.rfind("< frame 181 ", 0), 0U) << heard;
    EXPECT_NE(heard.find(" 012BFF00 >"), std::string::npos) << heard;
}

// Its first request is not left without an answer.
TEST(Socketcand, AClientThatSendsIsHeardAtOnce)
{
    const Link link = open_link("socketcand:localhost:0");
    hal_can_frame_t frame;
    const Peer peer(connect_to(can_link_where(link.get())));
    begin(link.get(), peer, false);
    peer.say("< send 601 1 40 >");
    ASSERT_TRUE(receive(link.get(), &frame));
    EXPECT_TRUE(can_link_send(link.get(), &kFrame));
}

TEST(Socketcand, RubbishIsSkippedAndTheNextClientServed)
{
    const Link link = open_link("socketcand:localhost:0");
    hal_can_frame_t frame;
    {
        const Peer peer(connect_to(can_link_where(link.get())));
        begin(link.get(), peer);
        peer.say("< send 801 0 >< send 201 9 >< send 201 1 100 >< send 00000201 0 >< nonsense >" +
                 std::string(1000, 'x') + ">< send 202 0 >");
        ASSERT_TRUE(receive(link.get(), &frame));
        EXPECT_EQ(frame.id, 0x202);
    }
    EXPECT_FALSE(can_link_receive(link.get(), &frame));
    const Peer next(connect_to(can_link_where(link.get())));
    begin(link.get(), next);
    next.say("< send 203 0 >");
    ASSERT_TRUE(receive(link.get(), &frame));
    EXPECT_EQ(frame.id, 0x203);
}

TEST(Socketcand, NeedsHostAndPort)
{
    for (const char *name :
         {"socketcand:", "socketcand:localhost", "socketcand:localhost:notaport",
          "socketcand:localhost:", "socketcand:localhost:65536", "socketcand:localhost:99999"}) {
        char error[200] = "";
        EXPECT_EQ(can_link_open(name, error, sizeof error), nullptr) << name;
        EXPECT_NE(std::string(error), "") << name;
    }
}

TEST(SocketCan, AnInterfaceThatIsNotThere)
{
    char error[200] = "";
    EXPECT_EQ(can_link_open("nocan7", error, sizeof error), nullptr);
    EXPECT_NE(std::string(error).find("nocan7"), std::string::npos);
}

} // namespace
