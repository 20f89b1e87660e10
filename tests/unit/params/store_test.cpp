// Pages of parameters: what is written comes back, and nothing that is damaged does.
#include <array>
#include <cstring>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

extern "C" {
#include "firmware/drive/parameters.h"
#include "firmware/params/store.h"
}

namespace
{

using Page = std::array<uint32_t, STORE_WORDS>;

Page erased()
{
    Page page;
    page.fill(UINT32_MAX);
    return page;
}

std::vector<store_pair_t> some_pairs(uint32_t count)
{
    std::mt19937 random(1);
    std::vector<store_pair_t> pairs(count);
    for (store_pair_t &pair : pairs) {
        pair = {static_cast<uint32_t>(random()), static_cast<int32_t>(random())};
    }
    return pairs;
}

Page page_of(uint32_t sequence, uint32_t count)
{
    Page page = erased();
    const auto pairs = some_pairs(count);
    store_make(page.data(), sequence, pairs.data(), count);
    return page;
}

// CRC-32 of IEEE 802.3, byte by byte, from its definition
uint32_t crc32(const std::vector<uint8_t> &bytes)
{
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
        const auto pairs = some_pairs(count);
        Page page = erased();
        EXPECT_EQ(store_make(page.data(), 7, pairs.data(), count), 4 + 2 * count);
        ASSERT_EQ(store_check(page.data()), int32_t(count));
        EXPECT_EQ(store_sequence(page.data()), 7U);
        for (uint32_t n = 0; n < count; ++n) {
            EXPECT_EQ(store_pair(page.data(), n).id, pairs[n].id);
            EXPECT_EQ(store_pair(page.data(), n).value, pairs[n].value);
        }
    }
}

TEST(Store, RefusesMoreThanAPageHolds)
{
    const auto pairs = some_pairs(STORE_PAIRS_MAX + 1);
    Page page = erased();
    EXPECT_EQ(store_make(page.data(), 1, pairs.data(), STORE_PAIRS_MAX + 1), 0U);
    EXPECT_EQ(page, erased());
}

TEST(Store, ErasedPageIsVoid)
{
    EXPECT_EQ(store_check(erased().data()), -1);
    EXPECT_EQ(store_check(Page{}.data()), -1);
}

TEST(Store, CrcIsTheCommonOne)
{
    const Page page = page_of(3, 5);
    std::vector<uint8_t> bytes(12 * 4);
    std::memcpy(&bytes[0], &page[1], 8); // sequence, count
    std::memcpy(&bytes[8], &page[4], 40);
    EXPECT_EQ(page[3], crc32(bytes));
}

TEST(Store, EveryFlippedBitIsFound)
{
    const uint32_t count = 20;
    const Page page = page_of(9, count);
    for (uint32_t word = 0; word < 4 + 2 * count; ++word) {
        for (int bit = 0; bit < 32; ++bit) {
            Page damaged = page;
            damaged[word] ^= 1U << bit;
            EXPECT_EQ(store_check(damaged.data()), -1) << word << " " << bit;
        }
    }
}

// Power is lost after any number of words: the page is void, so the other one holds.
TEST(Store, EveryUnfinishedPageIsVoid)
{
    const uint32_t count = 20;
    const Page whole = page_of(9, count);
    for (uint32_t written = 0; written < 4 + 2 * count; ++written) {
        Page page = erased();
        std::copy_n(whole.begin(), written, page.begin());
        EXPECT_EQ(store_check(page.data()), -1) << written;
        EXPECT_EQ(store_newest(page_of(8, 3).data(), page.data()), 0);
        EXPECT_EQ(store_newest(page.data(), page_of(8, 3).data()), 1);
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

TEST(Store, IdentifiersDiffer)
{
    std::set<uint32_t> ids;
    for (const drive_param_info_t &info : drive_param_table) {
        EXPECT_TRUE(ids.insert(store_id(info.name)).second) << info.name;
    }
    EXPECT_EQ(store_id("a"), 0xE40C292CU); // of the authors' test suite
    EXPECT_EQ(store_id("foobar"), 0xBF9CF968U);
}

} // namespace
