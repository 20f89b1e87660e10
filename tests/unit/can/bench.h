// A node on a bus of one master, in virtual time, and an SDO client that keeps to CiA 301 by itself.
#ifndef TESTS_UNIT_CAN_BENCH_H
#define TESTS_UNIT_CAN_BENCH_H

#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

extern "C" {
#include "firmware/can/node.h"
#include "firmware/can/node_state.h"
}

namespace can
{

using Bytes = std::vector<uint8_t>;

inline uint32_t le(const uint8_t *bytes, int count)
{
    uint32_t value = 0;
    for (int n = 0; n < count; ++n) {
        value |= uint32_t(bytes[n]) << (8 * n);
    }
    return value;
}

inline Bytes bytes_of(uint32_t value, int count)
{
    Bytes bytes;
    for (int n = 0; n < count; ++n) {
        bytes.push_back(uint8_t(value >> (8 * n)));
    }
    return bytes;
}

// CRC of XMODEM, bit by bit from its polynomial
inline uint16_t crc16(const Bytes &bytes)
{
    uint32_t crc = 0;
    for (const uint8_t byte : bytes) {
        crc ^= uint32_t(byte) << 8;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc & 0x8000U) != 0 ? (crc << 1) ^ 0x1021U : crc << 1;
        }
    }
    return uint16_t(crc);
}

inline const od_entry_t *entry(uint16_t index, uint8_t sub = 0)
{
    bool has;
    const od_entry_t *found = od_find(index, sub, &has);
    if (found == nullptr) {
        ADD_FAILURE() << "no entry " << std::hex << index << ":" << int(sub);
        abort();
    }
    return found;
}

class Bench
{
  public:
    explicit Bench(uint8_t node_id = 1, uint32_t start_us = 0xFFFF0000U) : now(start_us)
    {
        stored[{0x2080, 1}] = node_id;
        boot();
    }

    void boot()
    {
        node_init(&node, this, 0x12345678, now);
    }

    // --- bus

    void give(uint16_t id, const Bytes &data)
    {
        node_frame_t frame = {id, uint8_t(data.size()), {}};
        std::copy(data.begin(), data.end(), frame.data);
        node_receive(&node, &frame, now);
    }

    void run_us(uint32_t us, uint32_t step = 100)
    {
        for (uint32_t done = 0; done < us; done += step) {
            now += step;
            node_run(&node, now);
        }
    }

    void run_ms(uint32_t ms)
    {
        run_us(1000 * ms);
    }

    // Frames of one identifier that were sent, which are then gone.
    std::vector<node_frame_t> take(uint16_t id)
    {
        std::vector<node_frame_t> found;
        std::deque<node_frame_t> rest;
        for (const node_frame_t &frame : sent) {
            if (frame.id == id) {
                found.push_back(frame);
            } else {
                rest.push_back(frame);
            }
        }
        sent = rest;
        return found;
    }

    void nmt(uint8_t command, int id = -1)
    {
        give(0, {command, uint8_t(id < 0 ? node.id : id)});
    }

    void operational()
    {
        nmt(1);
        sent.clear();
    }

    // --- SDO client; the abort code of the last transfer, 0: none

    uint32_t code = 0;

    Bytes ask(const Bytes &request)
    {
        give(uint16_t(0x600 + node.id), request);
        const auto replies = take(uint16_t(0x580 + node.id));
        if (replies.size() != 1) {
            ADD_FAILURE() << replies.size() << " replies";
            return Bytes(8, 0);
        }
        const Bytes reply(replies[0].data, replies[0].data + 8);
        code = reply[0] == 0x80 ? le(&reply[4], 4) : 0;
        return reply;
    }

    static Bytes request(uint8_t command, uint16_t index, uint8_t sub, uint32_t value = 0)
    {
        Bytes r = {command, uint8_t(index & 0xFF), uint8_t(index >> 8), sub};
        const Bytes rest = bytes_of(value, 4);
        r.insert(r.end(), rest.begin(), rest.end());
        return r;
    }

    Bytes upload(uint16_t index, uint8_t sub = 0)
    {
        Bytes reply = ask(request(0x40, index, sub));
        if (code != 0) {
            return {};
        }
        EXPECT_EQ(reply[0] >> 5, 2);
        if ((reply[0] & 2) != 0) {
            return Bytes(reply.begin() + 4, reply.begin() + 4 + (4 - (reply[0] >> 2 & 3)));
        }
        const uint32_t total = le(&reply[4], 4);
        Bytes data;
        for (uint8_t toggle = 0;; toggle ^= 0x10) {
            reply = ask({uint8_t(0x60 | toggle), 0, 0, 0, 0, 0, 0, 0});
            if (code != 0) {
                return {};
            }
            EXPECT_EQ(reply[0] & 0xF0, toggle);
            data.insert(data.end(), reply.begin() + 1, reply.end() - (reply[0] >> 1 & 7));
            if ((reply[0] & 1) != 0 || data.size() > 100000) {
                break;
            }
        }
        EXPECT_EQ(data.size(), total);
        return data;
    }

    uint32_t value(uint16_t index, uint8_t sub = 0)
    {
        const Bytes data = upload(index, sub);
        EXPECT_EQ(code, 0U) << std::hex << index << ":" << int(sub) << " " << code;
        return data.empty() ? 0 : le(data.data(), int(data.size()));
    }

    uint32_t download(uint16_t index, uint8_t sub, const Bytes &data)
    {
        uint32_t word = 0;
        for (size_t n = 0; n < data.size(); ++n) {
            word |= uint32_t(data[n]) << (8 * n);
        }
        const Bytes reply = ask(request(uint8_t(0x23 | (4 - data.size()) << 2), index, sub, word));
        if (code == 0) {
            EXPECT_EQ(reply, request(0x60, index, sub));
        }
        return code;
    }

    void open()
    {
        EXPECT_EQ(download(0x2010, 5, bytes_of(0x6E65706F, 4)), 0U);
    }

    // With the size that the dictionary gives; what is locked is opened first
    uint32_t set(uint16_t index, uint8_t sub, uint32_t word)
    {
        if (entry(index, sub)->locked != 0 && node.word[OD_NODE_PARAMETERS_OPEN] == 0) {
            open();
        }
        return download(index, sub, bytes_of(word, od_size(entry(index, sub))));
    }

    // --- the host's side

    node_t node;
    uint32_t now;
    std::deque<node_frame_t> sent;
    bool on = false, bus_full = false, store_works = true;
    uint32_t put_code = 0;
    std::map<uint16_t, int32_t> live, parameter;               // by slot
    std::map<std::pair<uint16_t, uint8_t>, int32_t> stored;    // by index and sub-index
    std::vector<std::pair<const od_entry_t *, int32_t>> taken; // by put()
    std::vector<uint32_t> groups_stored, groups_restored;
    std::vector<uint16_t> alarms;
    int resets = 0;
    Bytes domain, received;
    int finished = 0;
    std::function<uint32_t()> on_write = [] { return 0U; };

    // --- what the node asks of its application

    static Bench &self(void *context)
    {
        return *static_cast<Bench *>(context);
    }

    static bool send(void *context, const node_frame_t *frame)
    {
        if (self(context).bus_full) {
            return false;
        }
        EXPECT_LE(frame->length, 8);
        self(context).sent.push_back(*frame);
        return true;
    }

    static bool on_(void *context)
    {
        return self(context).on;
    }

    std::map<uint16_t, int32_t> &values(const od_entry_t *e)
    {
        return e->kind == OD_PARAMETER ? parameter : live;
    }

    static int32_t get(void *context, const od_entry_t *e)
    {
        auto &all = self(context).values(e);
        const auto found = all.find(e->slot);
        return found == all.end() ? od_values_of(e).preset : found->second;
    }

    static uint32_t put(void *context, const od_entry_t *e, int32_t value)
    {
        Bench &b = self(context);
        b.taken.emplace_back(e, value);
        if (b.put_code == 0) {
            b.values(e)[e->slot] = value;
        }
        return b.put_code;
    }

    static uint32_t size(void *context, const od_entry_t *)
    {
        return uint32_t(self(context).domain.size());
    }

    static void read(void *context, const od_entry_t *, uint32_t offset, uint8_t *bytes, uint32_t count)
    {
        const Bytes &domain = self(context).domain;
        ASSERT_LE(offset + count, domain.size());
        std::copy_n(domain.begin() + offset, count, bytes);
    }

    static uint32_t write(void *context, const od_entry_t *, uint32_t offset, const uint8_t *bytes,
                          uint32_t count, bool last)
    {
        Bench &b = self(context);
        EXPECT_EQ(offset, b.received.size());
        b.received.insert(b.received.end(), bytes, bytes + count);
        b.finished += last ? 1 : 0;
        return b.on_write();
    }

    static uint32_t store(void *context, uint32_t group)
    {
        Bench &b = self(context);
        b.groups_stored.push_back(group);
        if (b.store_works) {
            for (uint32_t row = 0; row < od_count; ++row) {
                const od_entry_t *e = &od_table[row];
                if (e->kind == OD_NODE && (e->flags & OD_STORED) != 0) {
                    b.stored[{e->index, e->sub}] = node_stored(&b.node, e);
                }
            }
        }
        return b.store_works ? 0 : SDO_HARDWARE;
    }

    static uint32_t restore(void *context, uint32_t group)
    {
        self(context).groups_restored.push_back(group);
        return self(context).store_works ? 0 : SDO_HARDWARE;
    }

    static void recall(void *context)
    {
        Bench &b = self(context);
        for (const auto &pair : b.stored) {
            node_recall(&b.node, entry(pair.first.first, pair.first.second), pair.second);
        }
    }

    static void alarm(void *context, uint16_t code)
    {
        self(context).alarms.push_back(code);
    }

    static void reset(void *context)
    {
        self(context).resets++;
    }
};

} // namespace can

// The node calls these; one test program is one file.
extern "C" {
bool node_host_send(void *context, const node_frame_t *frame)
{
    return can::Bench::send(context, frame);
}

bool node_host_on(void *context)
{
    return can::Bench::on_(context);
}

int32_t node_host_get(void *context, const od_entry_t *entry)
{
    return can::Bench::get(context, entry);
}

uint32_t node_host_put(void *context, const od_entry_t *entry, int32_t value)
{
    return can::Bench::put(context, entry, value);
}

uint32_t node_host_size(void *context, const od_entry_t *entry)
{
    return can::Bench::size(context, entry);
}

void node_host_read(void *context, const od_entry_t *entry, uint32_t offset, uint8_t bytes[], uint32_t count)
{
    can::Bench::read(context, entry, offset, bytes, count);
}

uint32_t node_host_write(void *context, const od_entry_t *entry, uint32_t offset, const uint8_t bytes[],
                         uint32_t count, bool last)
{
    return can::Bench::write(context, entry, offset, bytes, count, last);
}

uint32_t node_host_store(void *context, uint32_t group)
{
    return can::Bench::store(context, group);
}

uint32_t node_host_restore(void *context, uint32_t group)
{
    return can::Bench::restore(context, group);
}

void node_host_recall(void *context)
{
    can::Bench::recall(context);
}

void node_host_alarm(void *context, uint16_t code)
{
    can::Bench::alarm(context, code);
}

void node_host_reset(void *context)
{
    can::Bench::reset(context);
}
}

#endif
