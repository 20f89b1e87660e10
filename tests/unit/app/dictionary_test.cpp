// Every row of the dictionary on the real application: read; written at both limits and beyond; refused when
// it cannot be written, or not while the motor runs.
#include <algorithm>
#include <cstdio>

#include "tests/unit/app/bench.h"

using app_test::Bench;
using app_test::defaults;
using app_test::Running;

namespace
{

enum : uint32_t {
    DONE = 0,
    NOT_SUPPORTED = 0x06010000,
    READ_ONLY = 0x06010002,
    NO_OBJECT = 0x06020000,
    NOT_MAPPABLE = 0x06040041,
    INCOMPATIBLE = 0x06040043,
    NOT_VALID = 0x06090030,
    TOO_HIGH = 0x06090031,
    TOO_LOW = 0x06090032,
    SIGNATURE = 0x08000020,
    STATE = 0x08000022
};

bool is_number(const od_entry_t &entry)
{
    return od_size(&entry) != 0;
}

bool is_writable(const od_entry_t &entry)
{
    return (entry.flags & OD_WRITE) != 0;
}

bool is_signed(const od_entry_t &entry)
{
    return entry.type == OD_I8 || entry.type == OD_I16 || entry.type == OD_I32;
}

int64_t lowest(const od_entry_t &entry)
{
    return is_signed(entry) ? -(int64_t(1) << (8 * od_size(&entry) - 1)) : 0;
}

int64_t highest(const od_entry_t &entry)
{
    return (int64_t(1) << (8 * od_size(&entry) - (is_signed(entry) ? 1 : 0))) - 1;
}

int64_t least(const od_entry_t &entry)
{
    return (entry.flags & OD_RANGE) == 0 ? lowest(entry)
           : is_signed(entry)            ? int64_t(od_values_of(&entry).least)
                                         : int64_t(uint32_t(od_values_of(&entry).least));
}

int64_t most(const od_entry_t &entry)
{
    return (entry.flags & OD_RANGE) == 0 ? highest(entry)
           : is_signed(entry)            ? int64_t(od_values_of(&entry).most)
                                         : int64_t(uint32_t(od_values_of(&entry).most));
}

std::string name(const od_entry_t &entry)
{
    char text[16];
    std::snprintf(text, sizeof text, "%04X:%02X", entry.index, entry.sub);
    return text;
}

// Value as it is read, of the type's width
int64_t read(Bench *x, const od_entry_t &entry)
{
    const uint32_t word = x->get(entry.index, entry.sub);
    const int bits = 8 * od_size(&entry);
    const uint32_t kept = bits == 32 ? word : word & ((1U << bits) - 1U);
    const bool negative = is_signed(entry) && (kept >> (bits - 1)) != 0;
    return negative ? int64_t(kept) - (int64_t(1) << bits) : int64_t(kept);
}

uint32_t write(Bench *x, const od_entry_t &entry, int64_t value)
{
    return x->set(entry.index, entry.sub, uint32_t(value));
}

// A parameter's limits may go against other parameters: then that is what the drive itself says of the set.
uint32_t drive_says(const od_entry_t &entry, int64_t value)
{
    drive_params_t wanted = defaults();
    drive_config_t config = {};
    drive_param_set(&wanted, drive_param_id_t(entry.slot), int32_t(value));
    const Bench board;
    return drive_configure(&config, &wanted, hal_channels(&board.loop.hal)).ok ? uint32_t(DONE)
                                                                               : uint32_t(INCOMPATIBLE);
}

bool is_pdo(const od_entry_t &entry)
{
    return (entry.index & ~3) == 0x1400 || (entry.index & ~3) == 0x1800;
}

bool is_map(const od_entry_t &entry)
{
    return (entry.index & ~3) == 0x1600 || (entry.index & ~3) == 0x1A00;
}

bool is_signature(const od_entry_t &entry)
{
    return entry.index == 0x1010 || entry.index == 0x1011;
}

bool is_lock(const od_entry_t &entry)
{
    return entry.index == 0x2010 && entry.sub == 5;
}

// Writing it moves the motor: its limits are the business of its own tests.
bool is_routine(const od_entry_t &entry)
{
    return entry.index == 0x3000 && entry.sub == 1;
}

// What an end of the range gives where not every value in it makes sense
uint32_t expected(const od_entry_t &entry, int64_t value)
{
    const bool low = value == least(entry);
    if (entry.kind == OD_PARAMETER) {
        return drive_says(entry, value);
    }
    if (is_signature(entry)) {
        return SIGNATURE;
    }
    if (is_map(entry)) { // none, and eight of nothing; nothing, and an object that there is not
        return low ? DONE : NO_OBJECT;
    }
    if (entry.index == 0x1005 || entry.index == 0x1014 || (is_pdo(entry) && entry.sub == 1)) {
        return NOT_VALID; // identifier 0 is NMT's, and others than 11 bits are not there
    }
    if (entry.index == 0x1003) {
        return low ? DONE : NOT_VALID; // 0 clears the history, else nothing can be written
    }
    if (entry.index == 0x1016 && entry.sub == 2) {
        return low ? DONE : INCOMPATIBLE; // node 127, which sub-index 1 watches as delivered
    }
    if (entry.index == 0x3100 && entry.sub == 1) {
        return low ? DONE : STATE; // no signals yet that could be recorded at once
    }
    if (is_lock(entry)) {
        return low ? DONE : SIGNATURE;
    }
    if (entry.index == 0x3101) {
        return low ? DONE : NOT_MAPPABLE;
    }
    return DONE;
}

// A process data object that is in use is not changed.
void free_pdo(Bench *x, const od_entry_t &entry)
{
    if (is_map(entry) || (is_pdo(entry) && entry.sub > 1)) {
        const auto index = uint16_t(is_map(entry) ? entry.index - 0x200 : entry.index);
        ASSERT_EQ(x->set(index, 1, x->get(index, 1) | 0x80000000U), DONE);
        ASSERT_EQ(x->set(uint16_t(index + 0x200), 0, 0), DONE);
    }
}

class Fresh : public Bench
{
  public:
    explicit Fresh(const od_entry_t &entry)
    {
        const drive_params_t params = defaults();
        boot(&params);
        run_ms(2);
        free_pdo(this, entry);
    }
};

template <typename Function> int for_rows(Function function)
{
    int tried = 0;
    for (uint32_t row = 0; row < od_count; ++row) {
        SCOPED_TRACE(name(od_table[row]));
        tried += function(od_table[row]) ? 1 : 0;
    }
    return tried;
}

int count(bool (*chosen)(const od_entry_t &))
{
    return int(std::count_if(od_table, od_table + od_count, chosen));
}

TEST(Dictionary, NumbersAreRead)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(2);
    const int tried = for_rows([&x](const od_entry_t &entry) {
        if (is_number(entry)) {
            read(&x, entry);
        }
        return is_number(entry);
    });
    EXPECT_EQ(tried, count(is_number));
}

TEST(Dictionary, BothLimitsAreAccepted)
{
    const int tried = for_rows([](const od_entry_t &entry) {
        if (!is_writable(entry) || is_routine(entry)) {
            return false;
        }
        for (const int64_t value : {least(entry), most(entry)}) {
            Fresh x(entry);
            const int64_t before = read(&x, entry);
            EXPECT_EQ(write(&x, entry, value), expected(entry, value)) << value;
            EXPECT_EQ(read(&x, entry), expected(entry, value) == DONE ? value : before) << value;
        }
        return true;
    });
    EXPECT_EQ(tried + 1, count(is_writable));
}

TEST(Dictionary, BeyondThemNothingIs)
{
    int beyond = 0;
    for_rows([&beyond](const od_entry_t &entry) {
        if (!is_writable(entry)) {
            return false;
        }
        Fresh x(entry);
        const int64_t before = read(&x, entry);
        for (const int64_t value : {most(entry) + 1, highest(entry)}) {
            if (value > most(entry) && value <= highest(entry)) {
                EXPECT_EQ(write(&x, entry, value), TOO_HIGH) << value;
                beyond++;
            }
        }
        for (const int64_t value : {least(entry) - 1, lowest(entry)}) {
            if (value < least(entry) && value >= lowest(entry)) {
                EXPECT_EQ(write(&x, entry, value), TOO_LOW) << value;
                beyond++;
            }
        }
        EXPECT_EQ(read(&x, entry), before);
        return true;
    });
    EXPECT_GT(beyond, 2 * DRIVE_PARAM_COUNT);
}

TEST(Dictionary, WhatCanOnlyBeReadIsNotWritten)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(2);
    const int tried = for_rows([&x](const od_entry_t &entry) {
        if (is_writable(entry)) {
            return false;
        }
        const uint32_t code = is_number(entry) ? write(&x, entry, 0)
                                               : x.sdo({0x23, uint8_t(entry.index & 0xFF),
                                                        uint8_t(entry.index >> 8), entry.sub, 0, 0, 0, 0});
        EXPECT_EQ(code, READ_ONLY);
        return true;
    });
    EXPECT_EQ(tried + count(is_writable), od_count);
}

// What it gives to write the present value while the motor runs
uint32_t expected_running(const od_entry_t &entry, const Bench &x)
{
    const uint16_t comm = is_map(entry) ? uint16_t(entry.index - 0x200) : entry.index;
    if ((entry.flags & OD_ONLY_OFF) != 0) {
        return STATE;
    }
    if (is_lock(entry)) { // it is open, and 1 is not the signature
        return SIGNATURE;
    }
    if (is_map(entry)) { // in use, or its number of objects is not zero
        bool has;
        const bool in_use = (x.loop.app.node.word[od_find(comm, 1, &has)->slot] & 0x80000000U) == 0;
        const bool mapped = x.loop.app.node.word[od_find(entry.index, 0, &has)->slot] != 0;
        return in_use || (mapped && entry.sub > 0) ? NOT_SUPPORTED : DONE;
    }
    if (is_pdo(entry) && entry.sub == 3) {
        bool has;
        return (x.loop.app.node.word[od_find(comm, 1, &has)->slot] & 0x80000000U) == 0 ? STATE : DONE;
    }
    return DONE;
}

TEST(Dictionary, WhileTheMotorRuns)
{
    Running x;
    int refused = 0;
    const int tried = for_rows([&](const od_entry_t &entry) {
        if (!is_writable(entry)) {
            return false;
        }
        x.control(0x0F);
        const uint32_t wanted = expected_running(entry, x);
        EXPECT_EQ(write(&x, entry, read(&x, entry)), wanted);
        refused += wanted == STATE ? 1 : 0;
        return true;
    });
    EXPECT_EQ(tried, count(is_writable));
    EXPECT_GT(refused, 15);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
    EXPECT_TRUE(x.loop.hal.armed);
}

} // namespace
