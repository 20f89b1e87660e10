// The generated table: in order, and every entry read and written at and beyond its limits through the node.
#include "tests/unit/can/bench.h"

using can::Bench;
using can::Bytes;

namespace
{

std::string name(const od_entry_t &e)
{
    char text[16];
    snprintf(text, sizeof text, "%04X:%02X", e.index, e.sub);
    return text;
}

std::vector<const od_entry_t *> numbers()
{
    std::vector<const od_entry_t *> found;
    for (uint32_t row = 0; row < od_count; ++row) {
        if (od_size(&od_table[row]) > 0) {
            found.push_back(&od_table[row]);
        }
    }
    return found;
}

bool is_signed(const od_entry_t &e)
{
    return e.type <= OD_I32;
}

int64_t limit(const od_entry_t &e, int32_t bits)
{
    return is_signed(e) ? int64_t(bits) : int64_t(uint32_t(bits));
}

// What the type alone allows
int64_t least_of_type(const od_entry_t &e)
{
    return is_signed(e) ? -(INT64_C(1) << (8 * od_size(&e) - 1)) : 0;
}

int64_t most_of_type(const od_entry_t &e)
{
    return (INT64_C(1) << (8 * od_size(&e) - (is_signed(e) ? 1 : 0))) - 1;
}

TEST(Dictionary, IsInOrderAndFindsEveryRow)
{
    ASSERT_GT(od_count, 100);
    for (uint32_t row = 0; row < od_count; ++row) {
        const od_entry_t &e = od_table[row];
        if (row > 0) {
            const od_entry_t &before = od_table[row - 1];
            EXPECT_LT(before.index * 256 + before.sub, e.index * 256 + e.sub) << name(e);
        }
        bool has = false;
        EXPECT_EQ(od_find(e.index, e.sub, &has), &e);
        EXPECT_TRUE(has);
    }
}

TEST(Dictionary, FindsNothingElse)
{
    uint32_t found = 0, indices = 0;
    uint16_t last = 0;
    for (uint32_t row = 0; row < od_count; ++row) {
        indices += od_table[row].index != last ? 1 : 0;
        last = od_table[row].index;
    }
    for (uint32_t index = 0; index < 0x10000; ++index) {
        bool has = false;
        found += od_find(uint16_t(index), 0, &has) != nullptr ? 1 : 0;
        indices -= has ? 1 : 0;
        bool other = false;
        EXPECT_EQ(od_find(uint16_t(index), 255, &other), nullptr);
        EXPECT_EQ(has, other);
    }
    EXPECT_EQ(indices, 0U);
    EXPECT_GT(found, 0U);
}

TEST(Dictionary, EveryEntryReadsAccordingToItsAccess)
{
    Bench x;
    for (const od_entry_t *e : numbers()) {
        const Bytes data = x.upload(e->index, e->sub);
        if ((e->flags & OD_READ) != 0) {
            EXPECT_EQ(x.code, 0U) << name(*e);
            EXPECT_EQ(data.size(), od_size(e)) << name(*e);
        } else {
            EXPECT_EQ(x.code, 0x06010001U) << name(*e);
        }
    }
}

TEST(Dictionary, WhatIsReadOnlyRefusesWrites)
{
    Bench x;
    for (const od_entry_t *e : numbers()) {
        if ((e->flags & OD_WRITE) == 0) {
            EXPECT_EQ(x.set(e->index, e->sub, 0), 0x06010002U) << name(*e);
        }
    }
}

// Values that the application keeps: at both limits, and one beyond where the type has room for it.
TEST(Dictionary, EveryValueIsAcceptedAtItsLimitsAndRefusedBeyond)
{
    uint32_t checked = 0, beyond = 0;
    for (const od_entry_t *e : numbers()) {
        const bool kept = e->kind == OD_PARAMETER || e->kind == OD_LIVE;
        if (!kept || (e->flags & OD_WRITE) == 0) {
            continue;
        }
        Bench x;
        const bool ranged = (e->flags & OD_RANGE) != 0;
        const int64_t least = ranged ? limit(*e, od_values_of(e).least) : least_of_type(*e);
        const int64_t most = ranged ? limit(*e, od_values_of(e).most) : most_of_type(*e);
        for (const int64_t value : {least, most}) {
            x.taken.clear();
            EXPECT_EQ(x.set(e->index, e->sub, uint32_t(value)), 0U) << name(*e) << " " << value;
            ASSERT_EQ(x.taken.size(), 1U) << name(*e);
            EXPECT_EQ(x.taken[0].second, int32_t(uint32_t(value))) << name(*e);
            EXPECT_EQ(x.value(e->index, e->sub),
                      uint32_t(value) & uint32_t(most_of_type(*e) - least_of_type(*e)))
                << name(*e);
            ++checked;
        }
        x.taken.clear();
        if (least > least_of_type(*e)) {
            EXPECT_EQ(x.set(e->index, e->sub, uint32_t(least - 1)), 0x06090032U) << name(*e);
            ++beyond;
        }
        if (most < most_of_type(*e)) {
            EXPECT_EQ(x.set(e->index, e->sub, uint32_t(most + 1)), 0x06090031U) << name(*e);
            ++beyond;
        }
        EXPECT_TRUE(x.taken.empty()) << name(*e);
    }
    EXPECT_GT(checked, 150U);
    EXPECT_GT(beyond, 120U);
}

TEST(Dictionary, WhatIsOnlyForOffIsRefusedWhileOn)
{
    uint32_t count = 0;
    for (const od_entry_t *e : numbers()) {
        if ((e->flags & OD_WRITE) != 0) {
            Bench x;
            x.on = true;
            const bool refused = x.set(e->index, e->sub, uint32_t(od_values_of(e).preset)) == 0x08000022U;
            const bool inhibit =
                e->index >= 0x1800 && e->index < 0x1804 && e->sub == 3; // not while it is in use
            EXPECT_EQ(refused, (e->flags & OD_ONLY_OFF) != 0 || (inhibit && e->index == 0x1800)) << name(*e);
            count += refused ? 1 : 0;
        }
    }
    EXPECT_GT(count, 20U);
}

TEST(Dictionary, WrongSizesAreRefused)
{
    Bench x;
    x.open();
    for (const od_entry_t *e : numbers()) {
        if ((e->flags & OD_WRITE) != 0) {
            for (size_t size = 1; size <= 4; ++size) {
                if (size != od_size(e)) {
                    EXPECT_EQ(x.download(e->index, e->sub, Bytes(size, 0)),
                              size > od_size(e) ? 0x06070012U : 0x06070013U)
                        << name(*e);
                }
            }
        }
    }
}

TEST(Dictionary, SubIndexZeroCountsItsRecord)
{
    for (uint32_t row = 0; row + 1 < od_count; ++row) {
        const od_entry_t &e = od_table[row];
        if (e.sub == 0 && e.kind == OD_CONSTANT && od_table[row + 1].index == e.index) {
            uint32_t last = row;
            while (last + 1 < od_count && od_table[last + 1].index == e.index) {
                ++last;
            }
            EXPECT_EQ(od_values_of(&e).preset, od_table[last].sub) << name(e);
        }
    }
}

} // namespace
