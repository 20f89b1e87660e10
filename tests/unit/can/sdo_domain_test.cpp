// Downloads into a domain, over a dictionary of its own: the drive's has none that is written.
#include "tests/unit/can/bench.h"

using can::Bench;
using can::Bytes;

// instead of the generated table
extern "C" {
enum { RW = OD_READ | OD_WRITE };
extern const od_values_t od_values[] = {{0, 0, 0}};
extern const int32_t od_presets[] = {0, 5};
extern const od_entry_t od_table[] = {
    {0x1F50, 1, OD_WRITE | OD_ONLY_OFF, OD_DOMAIN, OD_LIVE, OD_GROUP_NONE, 0, 0, 0},
    {0x2000, 0, RW, OD_DOMAIN, OD_LIVE, OD_GROUP_NONE, 1, 0, 0},
    {0x2080, 1, RW, OD_U8, OD_NODE, OD_GROUP_COMMUNICATION, OD_NODE_CAN_NODE_ID, 1, 0},
    {0x2081, 0, OD_WRITE, OD_U8, OD_LIVE, OD_GROUP_NONE, 2, 0, 0},
};
extern const uint16_t od_count = 4;
extern const uint32_t od_schema = 0;
extern const od_bytes_t od_bytes[] = {{nullptr, 0}};
}

namespace
{

Bytes pattern(size_t count)
{
    Bytes bytes;
    for (size_t n = 0; n < count; ++n) {
        bytes.push_back(uint8_t(n * 37 + n / 256));
    }
    return bytes;
}

uint32_t segmented(Bench &x, const Bytes &data, bool sized, uint32_t told)
{
    x.ask(Bench::request(sized ? 0x21 : 0x20, 0x1F50, 1, told));
    size_t position = 0;
    for (uint8_t toggle = 0; x.code == 0 && position < data.size(); toggle ^= 0x10) {
        Bytes segment(8, 0);
        const size_t count = std::min<size_t>(7, data.size() - position);
        std::copy_n(data.begin() + long(position), count, segment.begin() + 1);
        position += count;
        segment[0] = uint8_t(toggle | (7 - count) << 1 | (position == data.size() ? 1 : 0));
        const Bytes reply = x.ask(segment);
        if (x.code == 0) {
            EXPECT_EQ(reply[0], 0x20 | toggle);
        }
    }
    return x.code;
}

// `lost` is the number of the segment that does not arrive, counted over all that are sent
uint32_t block(Bench &x, const Bytes &data, uint32_t told, int lost, uint16_t crc_change = 0)
{
    x.ask(Bench::request(told != 0 ? 0xC6 : 0xC4, 0x1F50, 1, told));
    if (x.code != 0) {
        return x.code;
    }
    size_t position = 0;
    int number = 0;
    while (position < data.size()) {
        const size_t start = position;
        for (int sequence = 1; sequence <= 127 && position < data.size(); ++sequence) {
            Bytes segment(8, 0xEE);
            const size_t count = std::min<size_t>(7, data.size() - position);
            std::copy_n(data.begin() + long(position), count, segment.begin() + 1);
            position += count;
            const bool last = position == data.size();
            segment[0] = uint8_t(sequence | (last ? 0x80 : 0));
            const bool ends = last || sequence == 127; // a lost end is for the time-out
            if (number++ != lost || ends) {
                x.give(uint16_t(0x600 + x.node.id), segment);
            }
        }
        const auto replies = x.take(uint16_t(0x580 + x.node.id));
        if (replies.size() != 1 || replies[0].data[0] != 0xA2) {
            return replies.empty() ? 1 : can::le(&replies[0].data[4], 4);
        }
        position = std::min(data.size(), start + 7U * replies[0].data[1]);
    }
    const auto crc = uint16_t(can::crc16(data) ^ crc_change);
    x.ask({uint8_t(0xC1 | ((7 - data.size() % 7) % 7) << 2), uint8_t(crc & 0xFF), uint8_t(crc >> 8), 0, 0, 0,
           0, 0});
    return x.code;
}

TEST(SdoDomain, SegmentedDownload)
{
    for (const size_t size : std::vector<size_t>{1, 6, 7, 8, 14, 500}) {
        Bench x(5);
        const Bytes data = pattern(size);
        EXPECT_EQ(segmented(x, data, true, uint32_t(size)), 0U);
        EXPECT_EQ(x.received, data);
        EXPECT_EQ(x.finished, 1);
        x.received.clear();
        EXPECT_EQ(segmented(x, data, false, 0), 0U);
        EXPECT_EQ(x.received, data);
        x.received.clear();
        EXPECT_EQ(segmented(x, data, true, uint32_t(size + 1)), 0x06070013U);
        x.received.clear();
        if (size > 7) {
            EXPECT_EQ(segmented(x, data, true, uint32_t(size - 1)), 0x06070012U);
        }
    }
}

TEST(SdoDomain, ExpeditedDownload)
{
    Bench x(5);
    EXPECT_EQ(x.download(0x1F50, 1, {1, 2, 3}), 0U);
    EXPECT_EQ(x.received, (Bytes{1, 2, 3}));
    EXPECT_EQ(x.finished, 1);
}

TEST(SdoDomain, BlockDownloadOfEveryLength)
{
    for (const size_t size : std::vector<size_t>{1, 6, 7, 8, 14, 15, 888, 889, 890, 896, 5000}) {
        Bench x(5);
        const Bytes data = pattern(size);
        EXPECT_EQ(block(x, data, uint32_t(size), -1), 0U) << size;
        EXPECT_EQ(x.received, data) << size;
        EXPECT_EQ(x.finished, 1);
        x.received.clear();
        EXPECT_EQ(block(x, data, 0, -1), 0U) << size;
        EXPECT_EQ(x.received, data) << size;
    }
}

TEST(SdoDomain, BlockDownloadTakesLostSegmentsAgain)
{
    const Bytes data = pattern(1800); // 258 segments
    for (int lost = 0; lost < 258; lost += 7) {
        Bench x(5);
        EXPECT_EQ(block(x, data, 1800, lost), 0U) << lost;
        EXPECT_EQ(x.received, data) << lost;
    }
}

TEST(SdoDomain, BlockDownloadChecksCrcAndSize)
{
    Bench x(5);
    const Bytes data = pattern(100);
    EXPECT_EQ(block(x, data, 100, -1, 1), 0x05040004U);
    EXPECT_EQ(x.finished, 0);
    x.received.clear();
    EXPECT_EQ(block(x, data, 90, -1), 0x06070012U);
    x.received.clear();
    EXPECT_EQ(block(x, data, 101, -1), 0x06070013U);
    EXPECT_EQ(x.finished, 0);
}

TEST(SdoDomain, WhatTheSinkRefusesEndsTheTransfer)
{
    Bench x(5);
    x.on_write = [] { return SDO_HARDWARE; };
    EXPECT_EQ(block(x, pattern(100), 100, -1), SDO_HARDWARE);
    x.received.clear();
    EXPECT_EQ(segmented(x, pattern(100), true, 100), SDO_HARDWARE);
}

TEST(SdoDomain, OnlyWhileOff)
{
    Bench x(5);
    x.on = true;
    EXPECT_EQ(block(x, pattern(10), 10, -1), SDO_STATE);
    EXPECT_EQ(segmented(x, pattern(10), true, 10), SDO_STATE);
}

TEST(SdoDomain, WriteOnlyIsNotRead)
{
    Bench x(5);
    x.upload(0x2081);
    EXPECT_EQ(x.code, 0x06010001U);
    x.ask(Bench::request(0xA4, 0x1F50, 1, 127));
    EXPECT_EQ(x.code, 0x06010001U);
}

} // namespace
