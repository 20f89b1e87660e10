// Pages of values: what is written comes back, and nothing that is damaged or unfinished does.
#include <array>
#include <cstring>
#include <random>
#include <vector>

#include <gtest/gtest.h>

extern "C" {
#include "firmware/params/store.h"
}

namespace
{

using Page = std::array<uint32_t, STORE_WORDS>;

const uint32_t schema = 0xC0FFEE;

Page erased()
{
    Page page;
    page.fill(UINT32_MAX);
    return page;
}

std::vector<store_pair_t> some_pairs(uint32_t count, uint32_t seed = 1)
{
    std::mt19937 random(seed);
    std::vector<store_pair_t> pairs(count);
    for (store_pair_t &pair : pairs) {
        pair = {static_cast<uint32_t>(random()), static_cast<int32_t>(random())};
    }
    return pairs;
}

// Without the seal
uint32_t words_of(uint32_t count)
{
    return STORE_HEADER + 2 * count + 2;
}

Page page_of(uint32_t sequence, uint32_t count, uint32_t seed = 1)
{
    Page page = erased();
    store_writer_t writer;
    store_begin(&writer, sequence, schema, count, page.data());
    uint32_t at = STORE_HEADER;
    for (const store_pair_t &pair : some_pairs(count, seed)) {
        store_put(&writer, pair, &page[at]);
        at += 2;
    }
    store_end(&writer, &page[at]);
    store_seal(&page[at + 2]);
    return page;
}

Page unsealed(Page page, uint32_t count)
{
    const uint32_t end = words_of(count);
    page[end] = page[end + 1] = UINT32_MAX;
    return page;
}

// CRC-32 of IEEE 802.3, byte by byte, from its definition
uint32_t crc32(const uint32_t *words, size_t count)
{
    std::vector<uint8_t> bytes(4 * count);
    std::memcpy(bytes.data(), words, bytes.size());
    uint32_t crc = 0xFFFFFFFFU;
    for (const uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
        }
    }
    return ~crc;
}

TEST(Store, GivesBackWhatWasPut)
{
    for (const uint32_t count : {0U, 1U, 60U, STORE_PAIRS_MAX}) {
        const Page page = page_of(7, count);
        const auto pairs = some_pairs(count);
        ASSERT_EQ(store_check(page.data()), int32_t(count));
        EXPECT_EQ(store_sequence(page.data()), 7U);
        EXPECT_EQ(store_schema(page.data()), schema);
        for (uint32_t n = 0; n < count; ++n) {
            EXPECT_EQ(store_pair(page.data(), n).id, pairs[n].id);
            EXPECT_EQ(store_pair(page.data(), n).value, pairs[n].value);
            int32_t value = 0;
            EXPECT_TRUE(store_find(page.data(), pairs[n].id, &value));
            EXPECT_EQ(value, pairs[n].value);
        }
        int32_t value = 12;
        EXPECT_FALSE(store_find(page.data(), 0, &value));
        EXPECT_EQ(value, 12);
    }
}

TEST(Store, ErasedPageIsVoid)
{
    EXPECT_EQ(store_check(erased().data()), -1);
    EXPECT_EQ(store_check(Page{}.data()), -1);
}

TEST(Store, MorePairsThanAPageHoldsAreVoid)
{
    Page page = page_of(1, STORE_PAIRS_MAX);
    for (const uint32_t count : {STORE_PAIRS_MAX + 1, 0x7FFFFFFFU, 0xFFFFFFFFU}) {
        page[3] = count;
        EXPECT_EQ(store_check(page.data()), -1);
    }
}

TEST(Store, CrcIsTheCommonOne)
{
    const Page page = page_of(3, 5);
    EXPECT_EQ(page[14], crc32(page.data(), 14));
    EXPECT_EQ(page[15], ~page[14]);
}

TEST(Store, EveryFlippedBitIsFound)
{
    const uint32_t count = 20;
    const Page page = page_of(9, count);
    for (uint32_t word = 0; word < words_of(count); ++word) {
        for (int bit = 0; bit < 32; ++bit) {
            Page damaged = page;
            damaged[word] ^= 1U << bit;
            EXPECT_EQ(store_check(damaged.data()), -1) << word << " " << bit;
        }
    }
}

// Of `from`, the first bytes; behind them `to`. A byte in between has some of its bits.
Page cut(const Page &from, const Page &to, size_t bytes, uint8_t mixed)
{
    Page page = to;
    std::memcpy(page.data(), from.data(), bytes);
    uint8_t byte;
    uint8_t other;
    std::memcpy(&byte, reinterpret_cast<const uint8_t *>(from.data()) + bytes, 1);
    std::memcpy(&other, reinterpret_cast<const uint8_t *>(to.data()) + bytes, 1);
    byte = uint8_t((byte & mixed) | (other & ~mixed));
    std::memcpy(reinterpret_cast<uint8_t *>(page.data()) + bytes, &byte, 1);
    return page;
}

// Power is lost after any number of bytes, and within one: the page is void, or it is whole, and the other
// one holds until then.
TEST(Store, EveryUnfinishedPageIsVoid)
{
    const uint32_t count = 170;
    const Page before = page_of(8, count, 2);
    const Page whole = page_of(9, count);
    for (size_t written = 0; written < 4 * words_of(count); ++written) {
        for (const uint8_t mixed : {uint8_t(0), uint8_t(0x0F), uint8_t(0x5A), uint8_t(0xFF)}) {
            const Page page = cut(whole, erased(), written, mixed);
            if (unsealed(page, count) == unsealed(whole, count)) { // what was left is the same erased
                continue;
            }
            ASSERT_EQ(store_check(page.data()), -1) << written;
            EXPECT_EQ(store_newest(before.data(), page.data()), 0);
            EXPECT_EQ(store_newest(page.data(), before.data()), 1);
        }
    }
}

// The same while the older page is erased, from either end.
TEST(Store, APageThatIsErasedInPartIsVoid)
{
    const uint32_t count = 170;
    const Page old = page_of(7, count, 3);
    for (size_t done = 1; done < 4 * words_of(count); ++done) {
        EXPECT_EQ(store_check(cut(erased(), old, done, 0).data()), -1) << done;
        const Page back = cut(old, erased(), done, 0);
        EXPECT_TRUE(back == old || store_check(back.data()) == -1) << done;
    }
}

TEST(Store, NewerSequenceWinsAlsoWhereItWraps)
{
    for (const uint32_t old : {0U, 1U, 0x7FFFFFFFU, 0xFFFFFFFFU}) {
        EXPECT_EQ(store_newest(page_of(old, 2).data(), page_of(old + 1, 2).data()), 1);
        EXPECT_EQ(store_newest(page_of(old + 1, 2).data(), page_of(old, 2).data()), 0);
    }
    EXPECT_EQ(store_newest(erased().data(), erased().data()), -1);
}

// Whose check sum may be one that is cut and seems whole
TEST(Store, WithoutASealAPageGivesWayToASealedOne)
{
    const Page older = page_of(8, 20);
    const Page newer = page_of(9, 20);
    EXPECT_EQ(store_seals(newer.data()), 1U);
    EXPECT_EQ(store_seals(unsealed(newer, 20).data()), 0U);
    EXPECT_EQ(store_newest(older.data(), unsealed(newer, 20).data()), 0);
    EXPECT_EQ(store_newest(unsealed(newer, 20).data(), older.data()), 1);
    EXPECT_EQ(store_newest(unsealed(older, 20).data(), unsealed(newer, 20).data()), 0);
    EXPECT_EQ(store_newest(unsealed(newer, 20).data(), unsealed(older, 20).data()), 1);
    EXPECT_EQ(store_newest(unsealed(newer, 20).data(), erased().data()), 0);
    EXPECT_EQ(store_newest(erased().data(), unsealed(newer, 20).data()), 1);
}

// One that is cut itself shows that the check sum was finished.
TEST(Store, AnyBitOfASealIsOne)
{
    const Page older = page_of(8, 20);
    Page newer = unsealed(page_of(9, 20), 20);
    ASSERT_EQ(store_newest(older.data(), newer.data()), 0);
    for (uint32_t word = words_of(20); word < words_of(20) + 2 * STORE_SEALS; ++word) {
        for (int bit = 0; bit < 32; ++bit) {
            newer[word] ^= 1U << bit;
            EXPECT_EQ(store_newest(older.data(), newer.data()), 1);
            newer[word] ^= 1U << bit;
        }
    }
}

// There is room for all behind the fullest page.
TEST(Store, SealsAreCountedToTheLast)
{
    for (const uint32_t count : {0U, 20U, STORE_PAIRS_MAX}) {
        Page page = unsealed(page_of(9, count), count);
        for (uint32_t n = 0; n < STORE_SEALS; ++n) {
            ASSERT_LE(words_of(count) + 2 * n + 2, STORE_WORDS);
            store_seal(&page[words_of(count) + 2 * n]);
            ASSERT_EQ(store_seals(page.data()), n + 1);
            if (n > 0) { // an older one that can no longer be seen counts all the same
                Page torn = page;
                torn[words_of(count)] = torn[words_of(count) + 1] = UINT32_MAX;
                ASSERT_EQ(store_seals(torn.data()), n + 1);
            }
        }
    }
}

} // namespace
