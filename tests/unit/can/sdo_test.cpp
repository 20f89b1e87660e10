// SDO server: transfers as CiA 301 draws them, and every abort code by what causes it.
#include "tests/unit/can/bench.h"

using can::Bench;
using can::Bytes;
using can::entry;

namespace
{

enum : uint32_t {
    TOGGLE = 0x05030000,
    TIMEOUT = 0x05040000,
    COMMAND = 0x05040001,
    BLOCK_SIZE = 0x05040002,
    SEQUENCE = 0x05040003,
    CRC = 0x05040004,
    UNSUPPORTED = 0x06010000,
    READ_ONLY = 0x06010002,
    NO_OBJECT = 0x06020000,
    INCOMPATIBLE = 0x06040043,
    HARDWARE = 0x06060000,
    TOO_LONG = 0x06070012,
    TOO_SHORT = 0x06070013,
    NO_SUB = 0x06090011,
    TOO_HIGH = 0x06090031,
    TOO_LOW = 0x06090032,
    SIGNATURE = 0x08000020,
    STATE = 0x08000022,
    NO_DATA = 0x08000024,
};

TEST(Sdo, ExpeditedUpload)
{
    Bench x;
    EXPECT_EQ(x.ask(Bench::request(0x40, 0x1000, 0)), Bench::request(0x43, 0x1000, 0, 0x00020192));
    EXPECT_EQ(x.ask(Bench::request(0x40, 0x1017, 0)), Bench::request(0x4B, 0x1017, 0, 500));
    EXPECT_EQ(x.ask(Bench::request(0x40, 0x1001, 0)), Bench::request(0x4F, 0x1001, 0, 0));
    EXPECT_EQ(x.value(0x1018, 4), 0x12345678U);
}

TEST(Sdo, SegmentedUpload)
{
    Bench x;
    const Bytes name = x.upload(0x1008);
    EXPECT_EQ(std::string(name.begin(), name.end()), "pmdrive");
    x.domain.resize(1000);
    for (size_t n = 0; n < x.domain.size(); ++n) {
        x.domain[n] = uint8_t(n * 7);
        if (n > 4 && n < 30) {
            x.domain.resize(n);
            EXPECT_EQ(x.upload(entry(0x1009)->index), x.domain) << n;
            x.domain.resize(1000);
        }
    }
    EXPECT_EQ(x.upload(0x1009), x.domain);
}

TEST(Sdo, ShortDomainsComeExpedited)
{
    Bench x;
    x.domain = {1, 2, 3};
    EXPECT_EQ(x.upload(0x1009), x.domain);
}

TEST(Sdo, ExpeditedDownload)
{
    Bench x;
    EXPECT_EQ(x.download(0x1017, 0, {0x34, 0x12}), 0U);
    EXPECT_EQ(x.value(0x1017), 0x1234U);
    // size not told: that of the object
    EXPECT_EQ(x.ask(Bench::request(0x22, 0x1017, 0, 0xFFFF0064)), Bench::request(0x60, 0x1017, 0));
    EXPECT_EQ(x.value(0x1017), 100U);
}

TEST(Sdo, SignedNumbersKeepTheirSign)
{
    Bench x;
    EXPECT_EQ(x.download(0x6060, 0, {0xFF}), 0U);
    ASSERT_EQ(x.taken.size(), 1U);
    EXPECT_EQ(x.taken[0].second, -1);
    EXPECT_EQ(x.download(0x6071, 0, {0x18, 0xFC}), 0U);
    EXPECT_EQ(x.taken[1].second, -1000);
    EXPECT_EQ(x.download(0x60FF, 0, can::bytes_of(uint32_t(-123456), 4)), 0U);
    EXPECT_EQ(x.taken[2].second, -123456);
    EXPECT_EQ(x.upload(0x60FF), can::bytes_of(uint32_t(-123456), 4));
}

TEST(Sdo, SegmentedDownloadOfANumber)
{
    Bench x;
    EXPECT_EQ(x.ask(Bench::request(0x21, 0x60FF, 0, 4)), Bench::request(0x60, 0x60FF, 0));
    EXPECT_EQ(x.ask({0x00 | 5 << 1, 0x10, 0x27, 0, 0, 0, 0, 0})[0], 0x20); // two bytes
    EXPECT_EQ(x.ask({0x10 | 5 << 1 | 1, 0, 0, 0, 0, 0, 0, 0})[0], 0x30);
    EXPECT_EQ(x.code, 0U);
    EXPECT_EQ(x.value(0x60FF), 10000U);
    // in one, size not told
    x.ask(Bench::request(0x20, 0x60FF, 0, 0));
    x.ask({0x00 | 3 << 1 | 1, 1, 2, 3, 0, 0, 0, 0});
    EXPECT_EQ(x.code, 0U);
    EXPECT_EQ(x.value(0x60FF), 0x00030201U);
}

TEST(Sdo, SizeMustBeThatOfTheObject)
{
    Bench x;
    EXPECT_EQ(x.download(0x1017, 0, {1, 2, 3}), TOO_LONG);
    EXPECT_EQ(x.download(0x1017, 0, {1}), TOO_SHORT);
    x.ask(Bench::request(0x21, 0x60FF, 0, 5));
    EXPECT_EQ(x.code, TOO_LONG);
    x.ask(Bench::request(0x21, 0x60FF, 0, 3));
    EXPECT_EQ(x.code, TOO_SHORT);
    x.ask(Bench::request(0x20, 0x60FF, 0));
    x.ask({0x00 | 2 << 1 | 1, 1, 2, 3, 4, 5, 0, 0});
    EXPECT_EQ(x.code, TOO_LONG);
    x.ask(Bench::request(0x20, 0x60FF, 0));
    x.ask({0x00 | 4 << 1 | 1, 1, 2, 3, 0, 0, 0, 0});
    EXPECT_EQ(x.code, TOO_SHORT);
    EXPECT_TRUE(x.taken.empty());
}

TEST(Sdo, WhatIsNotThere)
{
    Bench x;
    EXPECT_TRUE(x.upload(0x5FFF).empty());
    EXPECT_EQ(x.code, NO_OBJECT);
    EXPECT_TRUE(x.upload(0x1018, 9).empty());
    EXPECT_EQ(x.code, NO_SUB);
    EXPECT_TRUE(x.upload(0x1400, 3).empty());
    EXPECT_EQ(x.code, NO_SUB);
    EXPECT_EQ(x.download(0x0000, 0, {1}), NO_OBJECT);
    EXPECT_EQ(x.download(0xFFFF, 255, {1}), NO_OBJECT);
    EXPECT_EQ(x.download(0x1000, 1, {1}), NO_SUB);
    // the abort names what was asked for
    EXPECT_EQ(x.ask(Bench::request(0x40, 0x5FFF, 7)), Bench::request(0x80, 0x5FFF, 7, NO_OBJECT));
}

TEST(Sdo, AccessIsChecked)
{
    Bench x;
    EXPECT_EQ(x.download(0x1000, 0, {1, 2, 3, 4}), READ_ONLY);
    EXPECT_EQ(x.download(0x6041, 0, {1, 2}), READ_ONLY);
    x.ask(Bench::request(0x21, 0x1008, 0, 4));
    EXPECT_EQ(x.code, READ_ONLY);
    x.ask(Bench::request(0xC6, 0x1008, 0, 4));
    EXPECT_EQ(x.code, READ_ONLY);
}

TEST(Sdo, WhatTheApplicationRefusesIsRefused)
{
    Bench x;
    x.put_code = SDO_INCOMPATIBLE;
    EXPECT_EQ(x.download(0x60FF, 0, {1, 2, 3, 0}), INCOMPATIBLE);
    x.put_code = SDO_HARDWARE;
    EXPECT_EQ(x.download(0x60FF, 0, {1, 2, 3, 0}), HARDWARE);
}

TEST(Sdo, StructuralWritesOnlyWhileOff)
{
    Bench x;
    x.on = true;
    EXPECT_EQ(x.set(0x1010, 1, 0x65766173), STATE);
    x.on = false;
    EXPECT_EQ(x.set(0x1010, 1, 0x65766173), 0U);
    EXPECT_EQ(x.groups_stored, std::vector<uint32_t>{NODE_GROUP_ALL});
}

TEST(Sdo, StoreAndRestoreRequireTheSignatureAndSelectTheGroup)
{
    Bench x;
    EXPECT_EQ(x.value(0x1010, 0), 4U);
    EXPECT_EQ(x.set(0x1010, 1, 0x12345678), SIGNATURE);
    EXPECT_EQ(x.set(0x1010, 1, 0x64616F6C), SIGNATURE); // "load"
    EXPECT_EQ(x.set(0x1011, 1, 0x65766173), SIGNATURE);
    for (uint8_t sub = 1; sub <= 4; ++sub) {
        EXPECT_EQ(x.value(0x1010, sub), 1U);
        EXPECT_EQ(x.set(0x1010, sub, 0x65766173), 0U);
        EXPECT_EQ(x.set(0x1011, sub, 0x64616F6C), 0U);
    }
    const std::vector<uint32_t> groups = {NODE_GROUP_ALL, OD_GROUP_COMMUNICATION, OD_GROUP_APPLICATION,
                                          OD_GROUP_MACHINE};
    EXPECT_EQ(x.groups_stored, groups);
    EXPECT_EQ(x.groups_restored, groups);
    x.store_works = false;
    EXPECT_EQ(x.set(0x1010, 1, 0x65766173), HARDWARE);
    EXPECT_EQ(x.set(0x1011, 1, 0x64616F6C), HARDWARE);
}

TEST(Sdo, ToggleMustAlternate)
{
    Bench x;
    x.ask(Bench::request(0x40, 0x1008, 0));
    x.ask({0x70, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(x.code, TOGGLE);
    x.ask(Bench::request(0x21, 0x60FF, 0, 4));
    x.ask({0x10 | 5 << 1, 1, 2, 0, 0, 0, 0, 0});
    EXPECT_EQ(x.code, TOGGLE);
    x.domain.resize(20);
    x.ask(Bench::request(0x40, 0x1009, 0));
    x.ask({0x60, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(x.ask({0x60, 0, 0, 0, 0, 0, 0, 0}), Bench::request(0x80, 0x1009, 0, TOGGLE));
}

TEST(Sdo, CommandsOutOfPlaceAreRefused)
{
    for (const int command : {0x00, 0x10, 0x60, 0x70, 0xE0, 0xFF, 0xA1, 0xA2, 0xA3, 0xC1}) {
        Bench x;
        x.ask({uint8_t(command), 0, 0, 0, 1, 0, 0, 0});
        EXPECT_EQ(x.code, COMMAND) << int(command);
    }
}

TEST(Sdo, AnAbortEndsTheTransferWithoutReply)
{
    Bench x;
    x.ask(Bench::request(0x40, 0x1008, 0));
    x.give(0x601, Bench::request(0x80, 0x1008, 0, 0x08000000));
    EXPECT_TRUE(x.take(0x581).empty());
    x.ask({0x60, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(x.code, COMMAND);
}

TEST(Sdo, ANewTransferReplacesTheOldOne)
{
    Bench x;
    x.ask(Bench::request(0x40, 0x1008, 0));
    EXPECT_EQ(x.value(0x1017), 500U);
    const Bytes name = x.upload(0x1008);
    EXPECT_EQ(std::string(name.begin(), name.end()), "pmdrive");
}

TEST(Sdo, TimesOut)
{
    Bench x;
    const std::vector<Bytes> beginnings = {
        Bench::request(0x40, 0x1008, 0), Bench::request(0x21, 0x60FF, 0, 4),
        Bench::request(0xC6, 0x60FF, 0, 4), Bench::request(0xA4, 0x1008, 0, 5)};
    for (const Bytes &begin : beginnings) {
        x.ask(begin);
        ASSERT_EQ(x.code, 0U);
        x.run_us(999900);
        EXPECT_TRUE(x.take(0x581).empty());
        x.run_us(200);
        const auto replies = x.take(0x581);
        ASSERT_EQ(replies.size(), 1U);
        EXPECT_EQ(replies[0].data[0], 0x80);
        EXPECT_EQ(std::memcmp(&replies[0].data[1], &begin[1], 3), 0);
        EXPECT_EQ(can::le(&replies[0].data[4], 4), TIMEOUT);
    }
}

TEST(Sdo, FramesOfAnotherLengthAreIgnored)
{
    Bench x;
    x.give(0x601, {0x40, 0, 0x10, 0});
    EXPECT_TRUE(x.take(0x581).empty());
}

TEST(Sdo, NotInStopped)
{
    Bench x;
    x.nmt(2);
    x.give(0x601, Bench::request(0x40, 0x1000, 0));
    EXPECT_TRUE(x.take(0x581).empty());
}

// --- block upload

struct BlockUpload {
    Bytes data;
    int blocks = 0;
    uint16_t crc = 0;
};

// `lose` says which segments (numbered from 0 over the whole transfer) do not arrive.
BlockUpload block_upload(Bench &x, uint16_t index, uint8_t block, const std::function<bool(int)> &lose,
                         uint8_t next_block = 0)
{
    BlockUpload result;
    const Bytes begin = x.ask(Bench::request(0xA4, index, 0, block));
    if (x.code != 0) {
        return result;
    }
    EXPECT_EQ(begin[0], 0xC6);
    const uint32_t total = can::le(&begin[4], 4);
    x.give(0x601, {0xA3, 0, 0, 0, 0, 0, 0, 0});
    int number = 0;
    Bytes last;
    for (int round = 0; round < 5000; ++round) {
        x.run_ms(20);
        const auto segments = x.take(0x581);
        EXPECT_LE(segments.size(), block);
        uint8_t good = 0;
        bool complete = false;
        for (const node_frame_t &segment : segments) {
            const uint8_t sequence = segment.data[0] & 0x7F;
            if (!lose(number++) && sequence == good + 1) {
                good = sequence;
                last.assign(segment.data + 1, segment.data + 8);
                result.data.insert(result.data.end(), last.begin(), last.end());
                complete = (segment.data[0] & 0x80) != 0;
            }
        }
        ++result.blocks;
        block = next_block != 0 ? next_block : block;
        x.give(0x601, {0xA2, good, block, 0, 0, 0, 0, 0});
        if (complete) {
            break;
        }
    }
    const auto end = x.take(0x581);
    EXPECT_EQ(end.size(), 1U);
    if (end.size() == 1) {
        EXPECT_EQ(end[0].data[0] & 0xE3, 0xC1);
        result.data.resize(result.data.size() - (end[0].data[0] >> 2 & 7));
        result.crc = uint16_t(can::le(&end[0].data[1], 2));
        EXPECT_EQ(result.data.size(), total);
        EXPECT_EQ(result.crc, can::crc16(result.data));
    }
    x.give(0x601, {0xA1, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_TRUE(x.take(0x581).empty());
    return result;
}

Bytes some_bytes(size_t count)
{
    Bytes bytes(count);
    uint32_t state = 1;
    for (uint8_t &byte : bytes) {
        state = state * 1664525U + 1013904223U;
        byte = uint8_t(state >> 24);
    }
    return bytes;
}

TEST(SdoBlock, CrcIsTheCommonOne)
{
    const std::string text = "123456789";
    EXPECT_EQ(can::crc16(Bytes(text.begin(), text.end())), 0x31C3);
}

TEST(SdoBlock, UploadsEveryLength)
{
    Bench x;
    for (const size_t size : std::vector<size_t>{1, 2, 6, 7, 8, 13, 14, 15, 100, 888, 889, 890, 896, 8000}) {
        for (const size_t block : std::vector<size_t>{1, 2, 4, 127}) {
            x.domain = some_bytes(size);
            const BlockUpload got = block_upload(x, 0x1009, uint8_t(block), [](int) { return false; });
            EXPECT_EQ(got.data, x.domain) << size << " " << block;
            EXPECT_EQ(got.blocks, int((size + 7 * block - 1) / (7 * block)));
        }
    }
}

TEST(SdoBlock, UploadsNumbersToo)
{
    Bench x;
    EXPECT_EQ(block_upload(x, 0x1000, 127, [](int) { return false; }).data, can::bytes_of(0x00020192, 4));
}

TEST(SdoBlock, RepeatsWhatTheClientHasMissed)
{
    for (int lost = 0; lost < 30; ++lost) {
        Bench x;
        x.domain = some_bytes(200); // 29 segments
        EXPECT_EQ(block_upload(x, 0x1009, 10, [&](int n) { return n == lost; }).data, x.domain) << lost;
    }
    Bench x;
    x.domain = some_bytes(3000);
    EXPECT_EQ(block_upload(x, 0x1009, 127, [](int n) { return n % 3 == 1; }).data, x.domain);
}

TEST(SdoBlock, ClientMayChangeTheBlockSize)
{
    Bench x;
    x.domain = some_bytes(500);
    EXPECT_EQ(block_upload(
                  x, 0x1009, 20, [](int) { return false; }, 5)
                  .data,
              x.domain);
}

TEST(SdoBlock, UploadWaitsForRoomAndKeepsTheOrder)
{
    Bench x;
    x.domain = some_bytes(889);
    x.ask(Bench::request(0xA4, 0x1009, 0, 127));
    x.give(0x601, {0xA3, 0, 0, 0, 0, 0, 0, 0});
    std::vector<node_frame_t> all;
    for (int round = 0; round < 2000; ++round) {
        x.bus_full = round % 3 != 0;
        x.run_us(100);
        for (const node_frame_t &frame : x.take(0x581)) {
            all.push_back(frame);
        }
    }
    ASSERT_EQ(all.size(), 127U);
    for (uint32_t n = 0; n < 127; ++n) {
        EXPECT_EQ(all[n].data[0] & 0x7F, n + 1);
    }
    EXPECT_EQ(x.node.dropped, 0U);
}

TEST(SdoBlock, UploadErrors)
{
    Bench x;
    x.domain = some_bytes(100);
    for (const uint32_t block : {0U, 128U, 255U}) {
        x.ask(Bench::request(0xA4, 0x1009, 0, block));
        EXPECT_EQ(x.code, BLOCK_SIZE);
    }
    x.ask(Bench::request(0xA4, 0x5FFF, 0, 10));
    EXPECT_EQ(x.code, NO_OBJECT);
    x.ask(Bench::request(0xA4, 0x1009, 0, 5));
    x.give(0x601, {0xA3, 0, 0, 0, 0, 0, 0, 0});
    x.run_ms(1);
    x.take(0x581);
    EXPECT_EQ(x.ask({0xA2, 6, 5, 0, 0, 0, 0, 0}), Bench::request(0x80, 0x1009, 0, SEQUENCE));
    x.ask(Bench::request(0xA4, 0x1009, 0, 5));
    x.give(0x601, {0xA3, 0, 0, 0, 0, 0, 0, 0});
    x.run_ms(1);
    x.take(0x581);
    x.ask({0xA2, 5, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(x.code, BLOCK_SIZE);
    x.domain.clear();
    x.ask(Bench::request(0xA4, 0x1009, 0, 5));
    EXPECT_EQ(x.code, NO_DATA);
    x.ask(Bench::request(0x40, 0x1009, 0));
    EXPECT_EQ(x.code, NO_DATA);
}

TEST(SdoBlock, UploadTimesOutWhileItWaits)
{
    Bench x;
    x.domain = some_bytes(100);
    x.ask(Bench::request(0xA4, 0x1009, 0, 5));
    x.give(0x601, {0xA3, 0, 0, 0, 0, 0, 0, 0});
    x.run_ms(990);
    EXPECT_EQ(x.take(0x581).size(), 5U);
    x.run_ms(20);
    const auto replies = x.take(0x581);
    ASSERT_EQ(replies.size(), 1U);
    EXPECT_EQ(can::le(&replies[0].data[4], 4), TIMEOUT);
}

// The client's second begins with the last segment, which a busy bus may hold up for longer than that.
TEST(SdoBlock, ABusThatIsBusyForLongLeavesTheClientItsTime)
{
    Bench x;
    x.domain = some_bytes(889);
    x.ask(Bench::request(0xA4, 0x1009, 0, 127));
    x.bus_full = true;
    x.give(0x601, {0xA3, 0, 0, 0, 0, 0, 0, 0});
    x.run_ms(1500);
    x.bus_full = false;
    x.run_ms(900);
    for (const node_frame_t &frame : x.take(0x581)) {
        EXPECT_NE(frame.data[0], 0x80);
    }
    x.run_ms(200);
    const auto replies = x.take(0x581);
    ASSERT_EQ(replies.size(), 1U);
    EXPECT_EQ(can::le(&replies[0].data[4], 4), TIMEOUT);
}

// --- block download

uint32_t block_download(Bench &x, uint16_t index, const Bytes &data, bool sized, bool good_crc = true,
                        int lost = -1)
{
    const Bytes begin =
        x.ask(Bench::request(uint8_t(0xC4 | (sized ? 2 : 0)), index, 0, sized ? uint32_t(data.size()) : 0));
    if (x.code != 0) {
        return x.code;
    }
    EXPECT_EQ(begin[0], 0xA4);
    uint8_t block = begin[4];
    EXPECT_EQ(block, 127); // all that it can take
    size_t position = 0;
    int number = 0;
    while (position < data.size()) {
        const size_t start = position;
        for (uint8_t sequence = 1; sequence <= block && position < data.size(); ++sequence) {
            Bytes segment(8, 0);
            const size_t count = std::min<size_t>(7, data.size() - position);
            std::copy_n(data.begin() + long(position), count, segment.begin() + 1);
            position += count;
            segment[0] = uint8_t(sequence | (position == data.size() ? 0x80 : 0));
            if (number++ != lost) {
                x.give(0x601, segment);
            }
        }
        if (x.sent.empty()) { // the last was lost, so the node waits: the client begins anew
            EXPECT_NE(lost, -1);
            return 0xFFFFFFFF;
        }
        const auto replies = x.take(0x581);
        EXPECT_EQ(replies.size(), 1U);
        if (replies[0].data[0] == 0x80) {
            return can::le(&replies[0].data[4], 4);
        }
        EXPECT_EQ(replies[0].data[0], 0xA2);
        position = std::min(data.size(), start + 7U * replies[0].data[1]);
        block = replies[0].data[2];
    }
    const uint8_t unused = uint8_t((7 - data.size() % 7) % 7);
    const uint16_t crc = uint16_t(can::crc16(data) ^ (good_crc ? 0 : 1));
    const Bytes end =
        x.ask({uint8_t(0xC1 | unused << 2), uint8_t(crc & 0xFF), uint8_t(crc >> 8), 0, 0, 0, 0, 0});
    if (x.code == 0) {
        EXPECT_EQ(end[0], 0xA1);
    }
    return x.code;
}

TEST(SdoBlock, DownloadsNumbers)
{
    Bench x;
    for (const bool sized : {true, false}) {
        EXPECT_EQ(block_download(x, 0x60FF, {0x40, 0x42, 0x0F, 0}, sized), 0U);
        EXPECT_EQ(x.value(0x60FF), 1000000U);
        EXPECT_EQ(block_download(x, 0x1017, {0x2A, 0}, sized), 0U);
        EXPECT_EQ(x.value(0x1017), 42U);
        EXPECT_EQ(block_download(x, 0x1017, {1}, sized), TOO_SHORT);
        EXPECT_EQ(block_download(x, 0x1017, {1, 2, 3}, sized), TOO_LONG);
        EXPECT_EQ(block_download(x, 0x1017, some_bytes(20), sized), TOO_LONG);
        EXPECT_EQ(x.value(0x1017), 42U);
    }
}

TEST(SdoBlock, DownloadChecksTheCrcAndTheObject)
{
    Bench x;
    EXPECT_EQ(block_download(x, 0x60FF, {1, 2, 3, 4}, true, false), CRC);
    EXPECT_TRUE(x.taken.empty());
    EXPECT_EQ(block_download(x, 0x5FFF, {1}, true), NO_OBJECT);
    EXPECT_EQ(block_download(x, 0x1000, {1, 2, 3, 4}, true), READ_ONLY);
    EXPECT_EQ(block_download(x, 0x2080, {1}, true), READ_ONLY); // sub-index 0: how many there are
}

TEST(SdoBlock, DownloadSequenceIsChecked)
{
    Bench x;
    x.ask(Bench::request(0xC6, 0x60FF, 0, 4));
    x.ask({0, 1, 2, 3, 4, 0, 0, 0});
    EXPECT_EQ(x.code, SEQUENCE);
    // the end of a block of which nothing came in order
    x.ask(Bench::request(0xC6, 0x60FF, 0, 4));
    const Bytes reply = x.ask({127, 1, 2, 3, 4, 0, 0, 0});
    EXPECT_EQ(reply[0], 0xA2);
    EXPECT_EQ(reply[1], 0);
}

TEST(SdoBlock, DownloadAbortedByTheClient)
{
    Bench x;
    x.ask(Bench::request(0xC6, 0x60FF, 0, 4));
    x.give(0x601, Bench::request(0x80, 0x60FF, 0, 0x08000000));
    EXPECT_TRUE(x.take(0x581).empty());
    EXPECT_EQ(x.value(0x1017), 500U);
}

} // namespace
