// Process data: mapping, transmission types, timers.
#include "tests/unit/can/bench.h"

using can::Bench;
using can::Bytes;
using can::entry;

namespace
{

enum : uint32_t {
    UNSUPPORTED = 0x06010000,
    NOT_MAPPABLE = 0x06040041,
    LENGTH = 0x06040042,
    INVALID = 0x06090030
};

Bytes data_of(const node_frame_t &frame)
{
    return {frame.data, frame.data + frame.length};
}

// As a master does it: off, mapping, on. Transmission and timers keep what they are.
uint32_t map(Bench &x, uint16_t pdo, const std::vector<uint32_t> &objects)
{
    const auto mapping = uint16_t(pdo + 0x200);
    const uint32_t cob = x.value(pdo, 1) & 0x7FF;
    EXPECT_EQ(x.set(pdo, 1, cob | 0x80000000), 0U);
    EXPECT_EQ(x.set(mapping, 0, 0), 0U);
    for (size_t n = 0; n < objects.size(); ++n) {
        const uint32_t code = x.set(mapping, uint8_t(n + 1), objects[n]);
        if (code != 0) {
            return code;
        }
    }
    const uint32_t code = x.set(mapping, 0, uint32_t(objects.size()));
    return code != 0 ? code : x.set(pdo, 1, cob);
}

void configure(Bench &x, uint16_t pdo, uint32_t type, uint32_t inhibit_100us, uint32_t event_ms)
{
    const uint32_t cob = x.value(pdo, 1) & 0x7FF;
    EXPECT_EQ(x.set(pdo, 1, cob | 0x80000000), 0U);
    EXPECT_EQ(x.set(pdo, 2, type), 0U);
    if (pdo >= 0x1800) {
        EXPECT_EQ(x.set(pdo, 3, inhibit_100us), 0U);
    }
    EXPECT_EQ(x.set(pdo, 5, event_ms), 0U);
    EXPECT_EQ(x.set(pdo, 1, cob), 0U);
}

TEST(Rpdo, DefaultIsControlwordModeAndVelocity)
{
    Bench x(5);
    x.operational();
    x.give(0x205, {0x0F, 0x01, 0xFC, 0x30, 0x75, 0xFF, 0xFF});
    ASSERT_EQ(x.taken.size(), 2U); // mode -4 is out of range, the others are taken
    EXPECT_EQ(x.taken[0].first, entry(0x6040));
    EXPECT_EQ(x.taken[0].second, 0x010F);
    EXPECT_EQ(x.taken[1].first, entry(0x60FF));
    EXPECT_EQ(x.taken[1].second, int32_t(0xFFFF7530));
}

TEST(Rpdo, OnlyWhileOperational)
{
    Bench x(5);
    const Bytes frame = {6, 0, 3, 0, 0, 0, 0};
    x.give(0x205, frame);
    EXPECT_TRUE(x.taken.empty());
    x.operational();
    x.give(0x205, frame);
    EXPECT_EQ(x.taken.size(), 3U);
    x.nmt(2);
    x.give(0x205, frame);
    EXPECT_EQ(x.taken.size(), 3U);
}

TEST(Rpdo, TooShortIsIgnoredAndTooLongIsAccepted)
{
    Bench x;
    x.operational();
    x.give(0x201, {6, 0, 3, 0, 0, 0});
    EXPECT_TRUE(x.taken.empty());
    x.run_ms(20);
    auto emcy = x.take(0x81);
    ASSERT_EQ(emcy.size(), 1U);
    EXPECT_EQ(data_of(emcy[0]), (Bytes{0x10, 0x82, 0x11, 1, 0, 0, 0, 0}));
    x.give(0x201, {6, 0, 3, 0, 0, 0, 0, 9});
    EXPECT_EQ(x.taken.size(), 3U);
    x.run_ms(20);
    EXPECT_EQ(data_of(x.take(0x81)[0])[0], 0x20);
    x.give(0x201, {6, 0, 3, 0, 0, 0, 0});
    x.run_ms(20);
    EXPECT_EQ(data_of(x.take(0x81)[0]), (Bytes{0, 0, 0, 1, 0, 0, 0, 0}));
    EXPECT_TRUE(x.alarms.empty());
}

TEST(Rpdo, SynchronousWaitsForSync)
{
    for (const uint32_t type : {0U, 1U, 240U}) {
        Bench x;
        configure(x, 0x1400, type, 0, 0);
        x.operational();
        x.give(0x201, {6, 0, 3, 0, 0, 0, 0});
        x.give(0x201, {7, 0, 3, 1, 0, 0, 0});
        EXPECT_TRUE(x.taken.empty());
        x.give(0x80, {});
        ASSERT_EQ(x.taken.size(), 3U);
        EXPECT_EQ(x.taken[0].second, 7);
        x.give(0x80, {});
        EXPECT_EQ(x.taken.size(), 3U);
    }
}

TEST(Rpdo, TimeOutIsAnAlarmWhileOn)
{
    Bench x;
    x.operational();
    const Bytes frame = {15, 0, 3, 0, 0, 0, 0};
    x.on = true;
    x.run_ms(2000);
    EXPECT_TRUE(x.alarms.empty()); // none has come yet
    for (int n = 0; n < 5; ++n) {
        x.give(0x201, frame);
        x.run_ms(499);
    }
    EXPECT_TRUE(x.alarms.empty());
    x.run_ms(2);
    EXPECT_EQ(x.alarms, std::vector<uint16_t>{0x8250});
    x.run_ms(2000);
    EXPECT_EQ(x.alarms.size(), 1U);
    EXPECT_EQ(data_of(x.take(0x81)[0])[0], 0x50);
    x.give(0x201, frame);
    x.run_ms(20);
    EXPECT_EQ(data_of(x.take(0x81)[0])[0], 0); // it is back
    x.on = false;
    x.run_ms(600);
    EXPECT_EQ(x.alarms.size(), 1U);
}

TEST(Rpdo, MappingIsTheUsers)
{
    Bench x;
    ASSERT_EQ(map(x, 0x1403, {0x60710010, 0x60FF0020, 0x60600008}), 0U);
    x.operational();
    x.give(uint16_t(x.value(0x1403, 1)), {1, 0, 2, 0, 0, 0, 3});
    ASSERT_EQ(x.taken.size(), 3U);
    EXPECT_EQ(x.taken[0].first, entry(0x6071));
    EXPECT_EQ(x.taken[1].second, 2);
    EXPECT_EQ(x.taken[2].second, 3);
}

TEST(Mapping, RefusesWhatCannotBe)
{
    Bench x;
    EXPECT_EQ(map(x, 0x1403, {0x60FF0010}), NOT_MAPPABLE); // another size
    EXPECT_EQ(map(x, 0x1402, {0x60410010}), NOT_MAPPABLE); // read only
    EXPECT_EQ(map(x, 0x1803, {0x60400010}), NOT_MAPPABLE);
    EXPECT_EQ(map(x, 0x1802, {0x10080020}), NOT_MAPPABLE); // a string
    EXPECT_EQ(map(x, 0x1801, {0x5FFF0020}), 0x06020000U);
    EXPECT_EQ(map(x, 0x1401, {0x60FF0120}), 0x06090011U);
}

TEST(Mapping, RefusesMoreThanEightBytes)
{
    Bench x;
    EXPECT_EQ(map(x, 0x1803, {0x606C0020, 0x606C0020}), 0U);
    EXPECT_EQ(map(x, 0x1803, {0x606C0020, 0x606C0020, 0x60610008}), LENGTH);
    EXPECT_EQ(map(x, 0x1803, std::vector<uint32_t>(8, 0x60610008)), 0U);
    EXPECT_EQ(x.set(0x1803, 1, 0x80000481), 0U);
    EXPECT_EQ(x.set(0x1A03, 0, 0), 0U);
    EXPECT_NE(x.set(0x1A03, 0, 9), 0U);
}

TEST(Mapping, ChangesOnlyWhileOff)
{
    Bench x;
    EXPECT_EQ(x.set(0x1600, 0, 0), UNSUPPORTED);
    EXPECT_EQ(x.set(0x1600, 1, 0x60400010), UNSUPPORTED);
    EXPECT_EQ(x.set(0x1400, 1, 0x80000201), 0U);
    EXPECT_EQ(x.set(0x1600, 1, 0x60400010), UNSUPPORTED); // while it counts
    EXPECT_EQ(x.set(0x1600, 0, 0), 0U);
    EXPECT_EQ(x.set(0x1600, 1, 0x60FF0020), 0U);
    EXPECT_EQ(x.set(0x1600, 0, 3), LENGTH); // 4 + 1 + 4 bytes
}

TEST(Communication, RefusesIdentifiersInUse)
{
    Bench x;
    for (const uint32_t id : {0x0U, 0x1U, 0x7FU, 0x101U, 0x180U, 0x581U, 0x5FFU, 0x601U, 0x67FU, 0x6E0U,
                              0x6FFU, 0x701U, 0x77FU, 0x7FFU, 0x20000202U, 0x800U, 0x1302U}) {
        EXPECT_EQ(x.set(0x1403, 1, id), INVALID) << std::hex << id;
        EXPECT_EQ(x.set(0x1803, 1, id), INVALID) << std::hex << id;
        EXPECT_EQ(x.set(0x1005, 0, id), INVALID) << std::hex << id;
    }
    EXPECT_EQ(x.set(0x1005, 0, 0x40000080), INVALID); // it does not generate SYNC
    EXPECT_EQ(x.set(0x1400, 1, 0x202), INVALID);      // not while it is in use
    EXPECT_EQ(x.set(0x1400, 1, 0x201), 0U);
    EXPECT_EQ(x.set(0x1800, 1, 0x40000181), 0U);
    EXPECT_EQ(x.set(0x1800, 3, 20), 0x08000022U);
    for (const uint32_t type : {241U, 252U, 253U}) {
        EXPECT_EQ(x.set(0x1400, 2, type), INVALID);
        EXPECT_EQ(x.set(0x1800, 2, type), INVALID);
    }
    EXPECT_EQ(x.set(0x2080, 2, 300), INVALID);
}

// Without objects it does not exist, whatever its COB-ID says. CiA 301, 7.5.2.36 and 38
TEST(Mapping, APdoOfNothingIsNeitherSentNorAccepted)
{
    Bench x;
    ASSERT_EQ(map(x, 0x1800, {}), 0U);
    ASSERT_EQ(map(x, 0x1801, {}), 0U);
    configure(x, 0x1800, 255, 0, 10);
    configure(x, 0x1801, 1, 0, 0);
    ASSERT_EQ(map(x, 0x1400, {}), 0U);
    x.operational();
    x.on = true;
    x.give(0x201, {});
    x.give(0x201, {15, 0});
    x.give(0x80, {});
    x.run_ms(1000);
    EXPECT_TRUE(x.take(0x181).empty());
    EXPECT_TRUE(x.take(0x281).empty());
    EXPECT_TRUE(x.take(0x81).empty()) << "no complaint about its length or its time";
    EXPECT_TRUE(x.alarms.empty());
    EXPECT_EQ(x.value(0x1800, 1), 0x40000181U); // it is there again when something is mapped
    ASSERT_EQ(map(x, 0x1800, {0x60410010}), 0U);
    x.run_ms(50);
    EXPECT_FALSE(x.take(0x181).empty());
}

// Remote frames do not come through any port, so none is promised.
TEST(Tpdo, ShowsThatItTakesNoRemoteRequests)
{
    for (uint16_t n = 0; n < 4; ++n) {
        Bench x;
        const auto index = uint16_t(0x1800 + n);
        EXPECT_NE(x.value(index, 1) & 0x40000000U, 0U);
        const uint32_t id = x.value(index, 1) & 0x7FFU;
        for (const uint32_t flags : {0x80000000U, 0U, 0x40000000U}) {
            EXPECT_EQ(x.set(index, 1, flags | id), 0U);
            EXPECT_EQ(x.value(index, 1), flags | id | 0x40000000U) << std::hex << flags;
        }
        x.stored[{index, 1}] = int32_t(id - x.node.id); // by a version that took what was written
        x.boot();
        EXPECT_EQ(x.value(index, 1), id | 0x40000000U);
    }
}

TEST(Tpdo, EventTimer)
{
    Bench x;
    ASSERT_EQ(map(x, 0x1800, {0x60410010, 0x606C0020}), 0U);
    configure(x, 0x1800, 255, 0, 20);
    x.live[entry(0x6041)->slot] = 0x0637;
    x.live[entry(0x606C)->slot] = -5;
    x.operational();
    x.run_ms(1000);
    const auto frames = x.take(0x181);
    EXPECT_NEAR(double(frames.size()), 50, 1);
    EXPECT_EQ(data_of(frames[0]), (Bytes{0x37, 0x06, 0xFB, 0xFF, 0xFF, 0xFF}));
    x.nmt(128);
    x.run_ms(100);
    EXPECT_TRUE(x.take(0x181).empty());
}

TEST(Tpdo, ChangeIsSentAtOnceButNotWithinTheInhibitTime)
{
    Bench x;
    configure(x, 0x1800, 254, 100, 0);
    x.operational();
    x.run_ms(100);
    EXPECT_EQ(x.take(0x181).size(), 1U); // the first
    x.live[entry(0x6041)->slot] = 1;
    x.run_us(1100);
    EXPECT_EQ(x.take(0x181).size(), 1U);
    x.live[entry(0x6041)->slot] = 2;
    x.run_ms(8);
    EXPECT_TRUE(x.take(0x181).empty());
    x.run_ms(3);
    const auto frames = x.take(0x181);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(frames[0].data[0], 2);
    x.run_ms(100);
    EXPECT_TRUE(x.take(0x181).empty());
}

// An object that the mapping holds beyond its count is neither sent nor watched.
TEST(Tpdo, WhatIsBeyondTheCountDoesNotMatter)
{
    Bench x;
    configure(x, 0x1800, 254, 0, 0);
    const uint32_t cob = x.value(0x1800, 1);
    ASSERT_EQ(x.set(0x1800, 1, cob | 0x80000000U), 0U);
    ASSERT_EQ(x.set(0x1A00, 0, 0), 0U);
    ASSERT_EQ(x.set(0x1A00, 1, 0x60410010), 0U);
    ASSERT_EQ(x.set(0x1A00, 2, 0x60780010), 0U);
    ASSERT_EQ(x.set(0x1A00, 0, 1), 0U);
    ASSERT_EQ(x.set(0x1800, 1, cob), 0U);
    x.operational();
    x.run_ms(100);
    auto frames = x.take(0x181);
    ASSERT_EQ(frames.size(), 1U); // the first
    EXPECT_EQ(frames[0].length, 2);
    x.live[entry(0x6078)->slot] = 5;
    x.run_ms(100);
    EXPECT_TRUE(x.take(0x181).empty());
    x.live[entry(0x6041)->slot] = 6;
    x.run_ms(10);
    frames = x.take(0x181);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(frames[0].data[0], 6);
    EXPECT_EQ(frames[0].data[2], 0);
}

TEST(Tpdo, EverySoManySyncs)
{
    for (const uint32_t type : {1U, 3U, 240U}) {
        Bench x;
        configure(x, 0x1800, type, 0, 0);
        x.operational();
        for (uint32_t n = 0; n < 2 * type; ++n) {
            x.give(0x80, {});
            x.run_ms(1);
        }
        EXPECT_EQ(x.take(0x181).size(), 2U) << type;
    }
}

TEST(Tpdo, AcyclicOnSyncOnlyAfterAnEvent)
{
    Bench x;
    configure(x, 0x1800, 0, 0, 0);
    x.operational();
    x.give(0x80, {});
    EXPECT_EQ(x.take(0x181).size(), 1U);
    for (int n = 0; n < 5; ++n) {
        x.run_ms(5);
        x.give(0x80, {});
    }
    EXPECT_TRUE(x.take(0x181).empty());
    x.live[entry(0x606C)->slot] = 77;
    x.run_ms(5);
    EXPECT_TRUE(x.take(0x181).empty());
    x.give(0x80, {});
    EXPECT_EQ(x.take(0x181).size(), 1U);
}

TEST(Tpdo, SyncHasTheIdentifierOf1005)
{
    Bench x;
    configure(x, 0x1800, 1, 0, 0);
    EXPECT_EQ(x.set(0x1005, 0, 0x90), 0U);
    x.operational();
    x.give(0x80, {});
    EXPECT_TRUE(x.take(0x181).empty());
    x.give(0x90, {1});
    EXPECT_EQ(x.take(0x181).size(), 1U);
}

TEST(Tpdo, AFullBusDropsAndCounts)
{
    Bench x;
    configure(x, 0x1800, 255, 0, 1);
    x.operational();
    x.bus_full = true;
    x.run_ms(100);
    EXPECT_GT(x.node.dropped, 80U);
    x.bus_full = false;
    x.run_ms(1);
    EXPECT_GE(x.take(0x181).size(), 7U);
}

TEST(Tpdo, StoredMappingsComeBack)
{
    Bench x;
    ASSERT_EQ(map(x, 0x1801, {0x603F0010}), 0U);
    configure(x, 0x1801, 255, 0, 10);
    ASSERT_EQ(x.set(0x1010, 2, 0x65766173), 0U);
    x.boot();
    x.operational();
    x.run_ms(5);
    EXPECT_EQ(x.take(0x281).size(), 1U);
    // another node id: identifiers follow
    x.stored[{0x2080, 1}] = 9;
    x.boot();
    x.operational();
    x.run_ms(5);
    EXPECT_EQ(x.take(0x289).size(), 1U);
}

TEST(Mapping, IsShownAsItWasWritten)
{
    Bench x;
    x.nmt(1);
    const std::vector<uint32_t> objects = {0x60410010, 0x60610008};
    ASSERT_EQ(map(x, 0x1800, objects), 0U);
    EXPECT_EQ(x.value(0x1A00, 0), 2U);
    EXPECT_EQ(x.value(0x1A00, 1), objects[0]);
    EXPECT_EQ(x.value(0x1A00, 2), objects[1]);
    EXPECT_EQ(node_stored(&x.node, entry(0x1A00, 2)), int32_t(objects[1]));
    EXPECT_EQ(x.set(0x1800, 1, x.value(0x1800, 1) | 0x80000000), 0U);
    EXPECT_EQ(x.set(0x1A00, 0, 0), 0U);
    EXPECT_EQ(x.set(0x1A00, 2, 0), 0U);
    EXPECT_EQ(x.value(0x1A00, 2), 0U);
    EXPECT_EQ(x.value(0x1A00, 1), objects[0]);
}

// A stored mapping of another version that no longer holds switches its object off and does no harm.
TEST(Tpdo, AStoredMappingThatIsWrongIsOff)
{
    Bench x;
    x.stored[{0x1A00, 1}] = 0x5FFF0020;
    x.stored[{0x1600, 0}] = 200;
    x.boot();
    x.operational();
    x.run_ms(500);
    EXPECT_TRUE(x.take(0x181).empty());
    x.give(0x201, {15, 0, 3, 0, 0, 0, 0});
    EXPECT_TRUE(x.taken.empty());
}

} // namespace
