// NMT, heartbeat, EMCY, LSS: the node as a member of the bus.
#include "tests/unit/can/bench.h"

using can::Bench;
using can::Bytes;

namespace
{

Bytes data_of(const node_frame_t &frame)
{
    return {frame.data, frame.data + frame.length};
}

TEST(Nmt, BootsUpIntoPreOperational)
{
    Bench x(7);
    const auto frames = x.take(0x707);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(data_of(frames[0]), Bytes{0});
    EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
    EXPECT_EQ(node_id(&x.node), 7);
}

TEST(Nmt, FollowsCommandsForItselfAndForAll)
{
    Bench x(7);
    x.nmt(1);
    EXPECT_EQ(node_nmt(&x.node), NODE_OPERATIONAL);
    x.nmt(2, 0);
    EXPECT_EQ(node_nmt(&x.node), NODE_STOPPED);
    x.nmt(128, 0);
    EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
    x.nmt(1, 8); // another's
    x.nmt(3);    // none
    x.give(0, {1});
    x.give(0, {1, 7, 0});
    EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
    EXPECT_TRUE(x.alarms.empty());
}

TEST(Nmt, ResetOfCommunicationTakesWhatIsStored)
{
    Bench x(7);
    x.set(0x1017, 0, 1234);
    x.set(0x1005, 0, 0x90);
    x.nmt(130);
    EXPECT_EQ(x.take(0x707).size(), 2U);
    EXPECT_EQ(x.value(0x1017), 500U);
    x.set(0x1017, 0, 1234);
    x.set(0x1010, 1, 0x65766173);
    x.set(0x1017, 0, 99);
    x.nmt(130);
    EXPECT_EQ(x.value(0x1017), 1234U);
    EXPECT_EQ(x.value(0x1005), 0x80U);
    EXPECT_EQ(x.value(0x1018, 4), 0x12345678U);
    EXPECT_EQ(x.resets, 0);
}

// What waited to be told belongs to the communication that ended.
TEST(Nmt, ResetOfCommunicationForgetsEmergenciesThatWait)
{
    Bench x(7);
    x.nmt(2);
    node_error(&x.node, NODE_ERROR_APPLICATION, 0x2310, 0);
    x.nmt(130);
    x.run_ms(100);
    EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
    EXPECT_TRUE(x.take(0x87).empty());
}

TEST(Nmt, ResetOfTheNodeIsTheApplications)
{
    Bench x;
    x.sent.clear();
    x.nmt(129);
    EXPECT_EQ(x.resets, 1);
    x.run_ms(2000);
    x.nmt(1);
    EXPECT_TRUE(x.sent.empty()); // until it begins anew
    EXPECT_EQ(node_nmt(&x.node), NODE_INITIALISING);
    x.boot();
    EXPECT_EQ(x.take(0x701).size(), 1U);
    EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
}

TEST(Nmt, LosingTheMasterWhileOnIsAnAlarm)
{
    for (const int command : {2, 128, 129, 130}) {
        Bench x;
        x.operational();
        x.nmt(uint8_t(command));
        EXPECT_TRUE(x.alarms.empty()) << command; // off: nothing happens
        if (command == 129) {
            x.boot();
        }
        x.operational();
        x.on = true;
        x.sent.clear();
        x.nmt(uint8_t(command));
        EXPECT_EQ(x.alarms, std::vector<uint16_t>{0x8100}) << command;
        const auto emcy = x.take(0x81);
        ASSERT_EQ(emcy.size(), 1U) << command;
        EXPECT_EQ(data_of(emcy[0]), (Bytes{0x00, 0x81, 0x11, 0, 0, 0, 0, 0}));
    }
    Bench x; // commanded by SDO in PRE-OPERATIONAL: going there again takes nothing away
    x.on = true;
    x.nmt(128);
    EXPECT_TRUE(x.alarms.empty());
    x.nmt(2);
    EXPECT_EQ(x.alarms.size(), 1U);
}

// Counted from the boot-up, whatever the clock shows then.
TEST(Heartbeat, TheFirstComesAPeriodAfterTheBootUp)
{
    for (const uint32_t start_us : {0U, 5000000U, 0xFFFF0000U}) {
        Bench x(3, start_us);
        x.sent.clear();
        x.run_ms(499);
        EXPECT_TRUE(x.take(0x703).empty()) << start_us;
        x.run_ms(2);
        EXPECT_EQ(x.take(0x703).size(), 1U) << start_us;
    }
}

TEST(Heartbeat, IsProduced)
{
    Bench x(3);
    x.sent.clear();
    x.run_ms(5000);
    EXPECT_EQ(x.take(0x703).size(), 10U);
    x.nmt(1);
    x.run_ms(500);
    EXPECT_EQ(data_of(x.take(0x703)[0]), Bytes{5});
    x.nmt(2);
    x.run_ms(500);
    EXPECT_EQ(data_of(x.take(0x703)[0]), Bytes{4});
    x.nmt(128);
    x.set(0x1017, 0, 10);
    x.run_ms(100);
    EXPECT_NEAR(double(x.take(0x703).size()), 10, 1);
    x.set(0x1017, 0, 0);
    x.run_ms(2000);
    EXPECT_TRUE(x.take(0x703).empty());
}

TEST(Heartbeat, IsWatchedFromTheFirstOn)
{
    Bench x;
    ASSERT_EQ(x.set(0x1016, 1, 0x002A0064), 0U); // node 42, 100 ms
    x.run_ms(1000);
    EXPECT_TRUE(x.alarms.empty());
    for (int n = 0; n < 20; ++n) {
        x.give(0x72A, {5});
        x.run_ms(99);
    }
    EXPECT_TRUE(x.alarms.empty());
    x.give(0x72B, {5}); // another's does not count
    x.operational();
    x.run_ms(2);
    EXPECT_EQ(x.alarms, std::vector<uint16_t>{0x8130});
    EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
    x.run_ms(1000);
    EXPECT_EQ(x.alarms.size(), 1U);
    auto emcy = x.take(0x81);
    ASSERT_EQ(emcy.size(), 1U);
    EXPECT_EQ(data_of(emcy[0]), (Bytes{0x30, 0x81, 0x11, 0, 0, 0, 0, 0}));
    EXPECT_EQ(x.value(0x1001), 0x11U);
    x.give(0x72A, {0}); // it is back
    x.run_ms(50);
    emcy = x.take(0x81);
    ASSERT_EQ(emcy.size(), 1U);
    EXPECT_EQ(data_of(emcy[0]), (Bytes{0, 0, 0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(x.value(0x1001), 0U);
    x.run_ms(200);
    EXPECT_EQ(x.alarms.size(), 2U);
}

TEST(Heartbeat, LossFollowsObject1029)
{
    const node_nmt_t expected[] = {NODE_PRE_OPERATIONAL, NODE_OPERATIONAL, NODE_STOPPED};
    for (uint32_t behaviour = 0; behaviour < 3; ++behaviour) {
        Bench x;
        x.set(0x1016, 1, 0x002A0064);
        x.set(0x1029, 1, behaviour);
        x.operational();
        x.give(0x72A, {5});
        x.run_ms(101);
        EXPECT_EQ(node_nmt(&x.node), expected[behaviour]);
    }
}

TEST(Heartbeat, TwoConsumersAndWhatTheyRefuse)
{
    Bench x;
    EXPECT_EQ(x.set(0x1016, 1, 0x002A0064), 0U);
    EXPECT_EQ(x.set(0x1016, 2, 0x002A00C8), 0x06040043U); // the same node twice
    EXPECT_EQ(x.set(0x1016, 2, 0x002B00C8), 0U);
    EXPECT_EQ(x.set(0x1016, 2, 0x002A0000), 0U); // not watched
    EXPECT_NE(x.set(0x1016, 2, 0x00800064), 0U); // no such node
    EXPECT_NE(x.set(0x1016, 2, 0x01010064), 0U);
    EXPECT_EQ(x.set(0x1016, 2, 0x002B00C8), 0U);
    x.give(0x72A, {5});
    x.give(0x72B, {5});
    x.run_ms(150);
    EXPECT_EQ(x.alarms.size(), 1U);
    x.give(0x72B, {5}); // the other is still lost
    EXPECT_EQ(x.value(0x1001), 0x11U);
    x.give(0x72A, {5});
    EXPECT_EQ(x.value(0x1001), 0U);
}

TEST(Heartbeat, OfItsOwnIdIsACollision)
{
    Bench x(9);
    x.on = true;
    x.give(0x709, {5});
    x.give(0x709, {5});
    x.run_ms(150);
    EXPECT_EQ(x.take(0x89).size(), 1U);
    EXPECT_TRUE(x.alarms.empty());
}

// Heartbeat or boot-up, and an answer of an SDO server
TEST(Namesake, KeepsTheNodeOutOfOperational)
{
    const std::vector<std::pair<uint16_t, Bytes>> signs = {
        {0x709, {5}}, {0x709, {0}}, {0x589, {0x4B, 0x41, 0x60, 0, 0, 0, 0, 0}}};
    for (const auto &[id, data] : signs) {
        Bench x(9);
        x.give(id, data);
        x.run_ms(1);
        EXPECT_EQ(x.value(0x1003, 1), 0x8150U) << id;
        EXPECT_EQ(x.value(0x1001), 0x11U);
        x.nmt(1);
        EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
        x.nmt(130);
        EXPECT_EQ(x.value(0x1001), 0U);
        x.nmt(1);
        EXPECT_EQ(node_nmt(&x.node), NODE_OPERATIONAL);
        x.give(id, data); // it is still there
        EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
    }
}

TEST(Namesake, DoesNotStopWhatRuns)
{
    Bench x(9);
    x.operational();
    x.on = true;
    x.give(0x709, {5});
    EXPECT_EQ(node_nmt(&x.node), NODE_OPERATIONAL);
    EXPECT_TRUE(x.alarms.empty());
    x.on = false;
    x.give(0x709, {5});
    EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
}

TEST(Namesake, IgnoresFramesOfOtherNodesAndRequests)
{
    Bench x(9);
    x.give(0x708, {5});
    x.give(0x588, Bytes(8, 0));
    x.give(0x709, {5, 0}); // no heartbeat
    x.give(0x589, {0x60});
    x.give(0x609, {0x40, 0, 0x10, 0, 0, 0, 0, 0}); // a request to this node
    EXPECT_EQ(x.take(0x589).size(), 1U);
    EXPECT_EQ(x.value(0x1001), 0U);
}

TEST(Emcy, ReportsErrorsAndTheirEnd)
{
    Bench x;
    x.set(0x1015, 0, 0);
    node_error(&x.node, NODE_ERROR_APPLICATION, 0x2310, 0x11223344);
    node_error(&x.node, NODE_ERROR_APPLICATION, 0x2310, 0x11223344);
    node_error(&x.node, NODE_ERROR_OVERRUN, 0x8110, 0);
    x.run_ms(1);
    const auto frames = x.take(0x81);
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(data_of(frames[0]), (Bytes{0x10, 0x23, 0x03, 0x44, 0x33, 0x22, 0x11, 0}));
    EXPECT_EQ(data_of(frames[1]), (Bytes{0x10, 0x81, 0x13, 0, 0, 0, 0, 0}));
    EXPECT_EQ(x.value(0x1001), 0x13U);
    node_error(&x.node, NODE_ERROR_APPLICATION, 0, 0);
    x.run_ms(1);
    EXPECT_EQ(data_of(x.take(0x81)[0]), (Bytes{0, 0, 0x11, 0, 0, 0, 0, 0}));
    EXPECT_EQ(x.value(0x1003, 0), 2U);
    EXPECT_EQ(x.value(0x1003, 1), 0x8110U);
    EXPECT_EQ(x.value(0x1003, 2), 0x33442310U);
}

// More at once than wait: some are lost, but not what is there in the end.
TEST(Emcy, TheLastWordIsTrue)
{
    for (const uint16_t last : {uint16_t(0), uint16_t(0x8120)}) {
        Bench x;
        for (int n = 0; n < 20; ++n) {
            node_error(&x.node, NODE_ERROR_BUS, 0x8120, 0);
            node_error(&x.node, NODE_ERROR_BUS, 0, 0);
        }
        node_error(&x.node, NODE_ERROR_APPLICATION, 0x2310, 0);
        node_error(&x.node, NODE_ERROR_BUS, last, 0);
        x.run_ms(200);
        std::map<uint32_t, int> told; // by code, and the last of the bus's
        uint32_t of_bus = 0, error_register = 0;
        for (const node_frame_t &frame : x.take(0x81)) {
            const uint32_t code = can::le(frame.data, 2);
            told[code]++;
            of_bus = code == 0x2310 ? of_bus : code;
            error_register = frame.data[2];
        }
        EXPECT_EQ(told[0x2310], 1);
        EXPECT_EQ(of_bus, last);
        EXPECT_EQ(error_register, x.value(0x1001));
    }
}

TEST(Emcy, ErrorRegisterShowsTheClass)
{
    const std::vector<std::pair<int, uint32_t>> all = {
        {0x1000, 0x01}, {0x2320, 0x03}, {0x3210, 0x05}, {0x4310, 0x09}, {0x5210, 0x81},
        {0x7121, 0x81}, {0x8130, 0x11}, {0x8210, 0x11}, {0x8481, 0x81}, {0xFF01, 0x81}};
    for (const auto &pair : all) {
        Bench x;
        node_error(&x.node, NODE_ERROR_APPLICATION, uint16_t(pair.first), 0);
        EXPECT_EQ(x.value(0x1001), pair.second) << std::hex << pair.first;
    }
}

TEST(Emcy, HistoryKeepsTheNewestEightAndCanBeCleared)
{
    Bench x;
    for (uint32_t n = 1; n <= 11; ++n) {
        node_error(&x.node, NODE_ERROR_APPLICATION, uint16_t(0x1000 + n), n);
    }
    EXPECT_EQ(x.value(0x1003, 0), 8U);
    for (uint32_t sub = 1; sub <= 8; ++sub) {
        const uint32_t n = 12 - sub;
        EXPECT_EQ(x.value(0x1003, uint8_t(sub)), 0x1000 + n + (n << 16));
    }
    x.nmt(130);
    EXPECT_EQ(x.value(0x1003, 0), 8U);
    EXPECT_EQ(x.set(0x1003, 0, 1), 0x06090030U);
    EXPECT_EQ(x.set(0x1003, 0, 0), 0U);
    EXPECT_EQ(x.value(0x1003, 0), 0U);
}

// A frame that waits for the bus makes the node busy.
TEST(Bus, BusyWhileAFrameWaits)
{
    Bench x;
    x.run_ms(1);
    EXPECT_FALSE(node_busy(&x.node));
    x.node.ring_count = 1;
    EXPECT_TRUE(node_busy(&x.node));
}

TEST(Emcy, InhibitTimeSpacesMessages)
{
    Bench x;
    x.set(0x1015, 0, 100); // 10 ms
    x.run_ms(20);
    for (uint32_t n = 1; n <= 3; ++n) {
        node_error(&x.node, NODE_ERROR_APPLICATION, uint16_t(0x1000 + n), 0);
    }
    x.run_ms(1);
    EXPECT_EQ(x.take(0x81).size(), 1U);
    x.run_ms(8);
    EXPECT_TRUE(x.take(0x81).empty());
    x.run_ms(2);
    EXPECT_EQ(x.take(0x81).size(), 1U);
    x.run_ms(10);
    EXPECT_EQ(x.take(0x81).size(), 1U);
}

TEST(Emcy, WaitsWhileStoppedAndCanBeSwitchedOff)
{
    Bench x;
    x.nmt(2);
    node_error(&x.node, NODE_ERROR_APPLICATION, 0x2310, 0);
    x.run_ms(100);
    EXPECT_TRUE(x.take(0x81).empty());
    x.nmt(128);
    x.run_ms(1);
    EXPECT_EQ(x.take(0x81).size(), 1U);
    EXPECT_EQ(x.set(0x1014, 0, 0x80000081), 0U);
    node_error(&x.node, NODE_ERROR_APPLICATION, 0x3210, 0);
    x.run_ms(100);
    EXPECT_TRUE(x.take(0x81).empty());
    EXPECT_EQ(x.set(0x1014, 0, 0x000000A0), 0U);
    node_error(&x.node, NODE_ERROR_APPLICATION, 0x4310, 0);
    x.run_ms(100);
    EXPECT_EQ(x.take(0xA0).size(), 1U);
    EXPECT_EQ(x.set(0x1014, 0, 0x000000A1), 0x06090030U); // not while it is in use
}

TEST(Bus, BusOffIsAnAlarmAndIsReportedAfterwards)
{
    Bench x;
    x.operational();
    x.run_ms(20);
    x.sent.clear();
    node_bus(&x.node, NODE_BUS_PASSIVE);
    x.run_ms(20);
    EXPECT_EQ(data_of(x.take(0x81)[0]), (Bytes{0x20, 0x81, 0x11, 0, 0, 0, 0, 0}));
    x.bus_full = true;
    node_bus(&x.node, NODE_BUS_OFF);
    node_bus(&x.node, NODE_BUS_OFF);
    EXPECT_EQ(x.alarms, std::vector<uint16_t>{0x8140});
    EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
    x.run_ms(10000); // far more than the ring holds
    x.bus_full = false;
    node_bus(&x.node, NODE_BUS_ACTIVE);
    x.run_ms(50);
    const auto emcy = x.take(0x81);
    ASSERT_EQ(emcy.size(), 2U);
    EXPECT_EQ(data_of(emcy[0]), (Bytes{0x40, 0x81, 0x11, 0, 0, 0, 0, 0}));
    EXPECT_EQ(data_of(emcy[1]), (Bytes{0, 0, 0, 0, 0, 0, 0, 0}));
}

TEST(Bus, LoadOfOthersLeavesTheNodeAlone)
{
    Bench x;
    x.operational();
    const node_t before = x.node;
    for (uint32_t n = 0; n < 100000; ++n) {
        const auto id = uint16_t(0x100 + n % 0x400);
        if (id == 0x201) {
            continue;
        }
        x.give(id, Bytes(n % 9, uint8_t(n)));
    }
    EXPECT_EQ(std::memcmp(&before.word, &x.node.word, sizeof before.word), 0);
    EXPECT_TRUE(x.sent.empty());
    EXPECT_TRUE(x.taken.empty());
    EXPECT_EQ(node_nmt(&x.node), NODE_OPERATIONAL);
}

// Frames of no sense to every service, in any order; afterwards it is a node like any other.
TEST(Bus, GarbageDoesNoHarm)
{
    Bench x(5);
    uint32_t state = 1;
    const auto random = [&] {
        state = state * 1664525U + 1013904223U;
        return state >> 8;
    };
    const uint16_t indices[] = {0x1003, 0x1005, 0x1008, 0x1010, 0x1014, 0x1016, 0x1017,
                                0x1021, 0x1400, 0x1600, 0x1800, 0x1A00, 0x1A03, 0x2100,
                                0x3100, 0x3103, 0x6040, 0x6060, 0x60FF};
    const uint16_t ids[] = {0x605, 0x605, 0x605, 0x605, 0x205, 0x305, 0x080, 0x77F, 0x705};
    for (int n = 0; n < 1000000; ++n) {
        node_frame_t frame = {uint16_t(n % 50 == 0 ? random() % 0x800 : ids[random() % 9]), 8, {}};
        frame.length = uint8_t(random() % 5 == 0 ? random() % 16 : 8);
        for (uint8_t &byte : frame.data) {
            byte = uint8_t(random());
        }
        if (random() % 3 != 0) { // something that exists
            const uint16_t index = indices[random() % 19];
            frame.data[1] = uint8_t(index & 0xFF);
            frame.data[2] = uint8_t(index >> 8);
            frame.data[3] = uint8_t(random() % 9);
        }
        if (frame.id == 0x7E5 || (frame.id == 0 && frame.data[0] > 2)) {
            continue; // these would take it away rightly
        }
        const uint32_t size = random() % 50;
        if (x.node.sdo.state == SDO_IDLE) { // no domain shrinks while it is read
            x.domain.resize(size);
        }
        node_receive(&x.node, &frame, x.now);
        if (n % 20 == 0) {
            x.run_ms(1);
            x.sent.clear();
            x.taken.clear();
            x.received.clear();
        }
    }
    x.on = false;
    x.stored = {{{0x2080, 1}, 5}};
    x.sent.clear();
    x.nmt(130, 0);
    EXPECT_EQ(x.value(0x1000), 0x00020192U);
    EXPECT_EQ(x.value(0x1017), 500U);
}

// --- LSS

class Lss : public Bench
{
  public:
    explicit Lss(uint8_t id = 1) : Bench(id)
    {
        sent.clear();
    }

    // The reply, empty: none
    Bytes tell(Bytes request)
    {
        request.resize(8, 0);
        give(0x7E5, request);
        const auto replies = take(0x7E4);
        EXPECT_LE(replies.size(), 1U);
        return replies.empty() ? Bytes() : data_of(replies[0]);
    }

    Bytes select(uint32_t vendor, uint32_t product, uint32_t revision, uint32_t serial)
    {
        const uint32_t all[] = {vendor, product, revision, serial};
        Bytes reply;
        for (uint32_t n = 0; n < 4; ++n) {
            Bytes request = can::bytes_of(all[n], 4);
            request.insert(request.begin(), uint8_t(0x40 + n));
            EXPECT_TRUE(reply.empty());
            reply = tell(request);
        }
        return reply;
    }

    uint32_t identity(uint8_t n)
    {
        return can::entry(0x1018, n)->kind == OD_NODE ? 0x12345678
                                                      : uint32_t(od_values_of(can::entry(0x1018, n)).preset);
    }
};

const Bytes none;

TEST(LssSlave, SwitchesByIdentity)
{
    Lss x;
    EXPECT_EQ(x.tell({0x5E}), none); // waiting
    EXPECT_EQ(x.select(x.identity(1), x.identity(2), x.identity(3), 0x12345679), none);
    EXPECT_EQ(x.select(x.identity(1), x.identity(2) + 1, x.identity(3), 0x12345678), none);
    EXPECT_EQ(x.tell({0x5E}), none);
    EXPECT_EQ(x.select(x.identity(1), x.identity(2), x.identity(3), 0x12345678),
              (Bytes{0x44, 0, 0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(x.tell({0x5E}), (Bytes{0x5E, 1, 0, 0, 0, 0, 0, 0}));
    x.tell({0x04, 0});
    EXPECT_EQ(x.tell({0x5E}), none);
}

TEST(LssSlave, AnswersWithItsIdentity)
{
    Lss x;
    x.tell({0x04, 1});
    for (uint8_t n = 0; n < 4; ++n) {
        Bytes expected = can::bytes_of(x.identity(uint8_t(n + 1)), 4);
        expected.insert(expected.begin(), uint8_t(0x5A + n));
        expected.resize(8, 0);
        EXPECT_EQ(x.tell({uint8_t(0x5A + n)}), expected);
    }
}

TEST(LssSlave, SetsTheNodeIdForTheNextReset)
{
    Lss x;
    x.tell({0x04, 1});
    EXPECT_EQ(x.tell({0x11, 0})[1], 1);
    EXPECT_EQ(x.tell({0x11, 128})[1], 1);
    EXPECT_EQ(x.tell({0x11, 42})[1], 0);
    x.tell({0x04, 0});
    EXPECT_EQ(node_id(&x.node), 1);
    x.nmt(130);
    EXPECT_EQ(node_id(&x.node), 42);
    EXPECT_EQ(x.take(0x72A).size(), 1U);
    EXPECT_EQ(x.value(0x1400, 1), 0x22AU);
    EXPECT_EQ(x.value(0x1014, 0), 0xAAU);
    EXPECT_EQ(x.value(0x1200, 1), 0x62AU);
    EXPECT_TRUE(x.groups_stored.empty());
}

TEST(LssSlave, SetsTheBitRateAndStores)
{
    Lss x;
    x.tell({0x04, 1});
    EXPECT_EQ(x.tell({0x13, 0, 1})[1], 1); // 800 kbit/s
    EXPECT_EQ(x.tell({0x13, 0, 9})[1], 1);
    EXPECT_EQ(x.tell({0x13, 1, 0})[1], 1); // another table
    const uint32_t rates[] = {1000, 0, 500, 250, 125};
    for (uint8_t row : {uint8_t(0), uint8_t(2), uint8_t(3), uint8_t(4)}) {
        EXPECT_EQ(x.tell({0x13, 0, row})[1], 0);
        EXPECT_EQ(x.value(0x2080, 2), rates[row]);
    }
    EXPECT_EQ(x.tell({0x17})[1], 0);
    EXPECT_EQ(x.groups_stored, std::vector<uint32_t>{NODE_GROUP_LSS});
    x.store_works = false;
    EXPECT_EQ(x.tell({0x17})[1], 2);
}

TEST(LssSlave, ChangesNothingWhileOn)
{
    Lss x;
    x.tell({0x04, 1});
    x.on = true;
    EXPECT_EQ(x.tell({0x11, 42})[1], 255);
    EXPECT_EQ(x.tell({0x13, 0, 0})[1], 255);
    EXPECT_EQ(x.tell({0x17})[1], 255);
    EXPECT_TRUE(x.groups_stored.empty());
}

TEST(LssSlave, WithoutANodeIdItIsSilentUntilItHasOne)
{
    Lss x(255);
    EXPECT_EQ(node_nmt(&x.node), NODE_INITIALISING);
    x.run_ms(2000);
    x.give(0, {1, 0});
    x.give(0x6FF, Bench::request(0x40, 0x1000, 0));
    x.give(0x67F, Bench::request(0x40, 0x1000, 0));
    x.run_ms(2000);
    EXPECT_TRUE(x.sent.empty());
    EXPECT_EQ(x.tell({0x4C}), (Bytes{0x50, 0, 0, 0, 0, 0, 0, 0}));
    x.tell({0x04, 1});
    EXPECT_EQ(x.tell({0x11, 77})[1], 0);
    x.give(0x7E5, {0x04, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(x.take(0x74D).size(), 1U); // boot-up
    EXPECT_EQ(node_nmt(&x.node), NODE_PRE_OPERATIONAL);
    EXPECT_EQ(x.tell({0x4C}), none);
}

// As a master does it: 128 questions at most
TEST(LssSlave, FastScanFindsTheIdentity)
{
    Lss x(255);
    const auto ask = [&](uint32_t id, uint8_t bit, uint8_t sub, uint8_t next) {
        Bytes request = can::bytes_of(id, 4);
        request.insert(request.begin(), 0x51);
        request.insert(request.end(), {bit, sub, next});
        const Bytes reply = x.tell(request);
        return !reply.empty() && reply[0] == 0x4F;
    };
    ASSERT_TRUE(ask(0, 0x80, 0, 0));
    for (uint8_t sub = 0; sub < 4; ++sub) {
        uint32_t id = 0;
        for (int bit = 31; bit >= 0; --bit) {
            if (!ask(id, uint8_t(bit), sub, sub)) {
                id |= 1U << bit;
            }
        }
        EXPECT_EQ(id, x.identity(uint8_t(sub + 1)));
        EXPECT_TRUE(ask(id, 0, sub, uint8_t((sub + 1) % 4)));
    }
    EXPECT_EQ(x.tell({0x11, 5})[1], 0); // it is in configuration now
    Lss y(3);
    y.tell({0x51, 0, 0, 0, 0, 0x80, 0, 0});
    EXPECT_TRUE(y.take(0x7E4).empty()); // it has an id
}

} // namespace
