// What is kept survives: power cuts with cells of no certain contents, older images, masters that save for ever.
#include <map>
#include <set>

#include "firmware/app/app_parts.h"
#include "tests/unit/app/bench.h"

using app_test::Bench;
using app_test::defaults;

namespace
{

const uint32_t save = 0x65766173, load = 0x64616F6C;
enum : uint32_t { MEMORY = 0x05040005, STATE = 0x08000022 };
const uint8_t all = 1, communication = 2;

std::map<uint32_t, int32_t> stored(const hal_t &hal)
{
    std::map<uint32_t, int32_t> pairs;
    const int32_t page = store_newest(hal.store[0], hal.store[1]);
    const int32_t count = page < 0 ? 0 : store_check(hal.store[page]);
    for (int32_t n = 0; n < count; ++n) {
        const store_pair_t pair = store_pair(hal.store[page], uint32_t(n));
        pairs[pair.id] = pair.value;
    }
    return pairs;
}

int32_t kept_i_max(const hal_t &hal)
{
    drive_params_t back;
    uint32_t unknown;
    return app_load(&hal, &back, &unknown) ? back.i_max : -1;
}

bool save_i_max(hal_t *hal, int32_t value)
{
    drive_params_t params = defaults();
    params.i_max = value;
    return app_save(hal, &params);
}

const uint32_t words_of_page =
    2 + 4 + 2 * Bench::stored_parameters() + 2; // behind another seal of the old one

// The last word reads as written once, and as erased after the next power cut, which comes while the other page is
// erased: that one was good and must not have been given up.
TEST(StoreCut, AnEndThatReadsAsWrittenOnceDoesNotCostTheOtherPage)
{
    hal_t x = {};
    sim_hal_init(&x, nullptr);
    ASSERT_TRUE(save_i_max(&x, 4000));
    const uint32_t torn = 4 * words_of_page - 4; // within the double word of the check sum
    x.store_bytes_left = torn;
    EXPECT_FALSE(save_i_max(&x, 4100));
    sim_cut_t cut = x.store_cut[1];
    ASSERT_EQ(cut.bytes, 8U);
    std::memcpy(reinterpret_cast<uint8_t *>(x.store[1]) + cut.from, cut.wanted,
                cut.bytes); // it reads as if whole
    EXPECT_NE(kept_i_max(x), -1);
    x.store_bytes_left = 0; // the next save is cut at once
    EXPECT_FALSE(save_i_max(&x, 4200));
    std::memcpy(reinterpret_cast<uint8_t *>(x.store[1]) + cut.from, cut.was, cut.bytes);
    EXPECT_NE(kept_i_max(x), -1);
}

// Five saves, each cut anywhere or not, and after each cut other contents of the cells in doubt.
TEST(StoreCut, AnySequenceOfCutsLeavesASetThatWasSaved)
{
    uint32_t seed = 1;
    const auto draw = [&](uint32_t below) {
        seed = seed * 1664525U + 1013904223U;
        return (seed >> 8) % below;
    };
    const uint32_t most = 4 * words_of_page + 40;
    int cuts = 0;
    for (int round = 0; round < 4000; ++round) {
        hal_t x = {};
        sim_hal_init(&x, nullptr);
        ASSERT_TRUE(save_i_max(&x, 4000));
        std::set<int32_t> may = {4000};
        for (int32_t value = 4001; value < 4006; ++value) {
            const uint32_t way = draw(4);
            // anywhere, at the end, at the beginning, or not at all
            const uint32_t bytes = way == 0   ? draw(most)
                                   : way == 1 ? 4 * words_of_page - 12 + draw(24)
                                   : way == 2 ? 0
                                              : UINT32_MAX;
            x.store_bytes_left = bytes;
            const bool done = save_i_max(&x, value);
            if (done) {
                may = {value};
            } else {
                may.insert(value);
                ++cuts;
            }
            for (int power_ups = 0; power_ups < 2; ++power_ups) {
                sim_store_settle(&x, draw(1U << 24));
                ASSERT_TRUE(may.count(kept_i_max(x)) == 1) << round << " " << value << " " << kept_i_max(x);
            }
        }
    }
    EXPECT_GT(cuts, 4000);
}

// Flash that has been written is worn by each erase: what is there already is not written again.
TEST(StoreWear, ASaveOfTheSameWritesNothing)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    ASSERT_EQ(x.set(0x1010, all, save), 0U);
    hal_t before = x.loop.hal;
    for (int n = 0; n < 50; ++n) {
        EXPECT_EQ(x.set(0x1010, uint8_t(1 + n % 4), save), 0U);
    }
    EXPECT_EQ(std::memcmp(before.store, x.loop.hal.store, sizeof before.store), 0);
    ASSERT_EQ(x.set(0x1017, 0, 333), 0U);
    EXPECT_EQ(x.set(0x1010, communication, save), 0U);
    EXPECT_NE(std::memcmp(before.store, x.loop.hal.store, sizeof before.store), 0);
}

// A master that saves something else again and again: flash withstands 10,000 erases of each page.
TEST(StoreWear, SavesOfAMasterGoneWildAreFew)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    uint32_t value = 1000;
    const auto saves_in = [&](int tries, int ms) {
        int done = 0;
        for (int n = 0; n < tries; ++n) {
            EXPECT_EQ(x.set(0x1017, 0, ++value), 0U);
            const uint32_t code = x.set(0x1010, communication, save);
            EXPECT_TRUE(code == 0 || code == STATE) << code;
            done += code == 0 ? 1 : 0;
            x.run_ms(ms);
        }
        return done;
    };
    EXPECT_EQ(saves_in(40, 1), 4);    // at once
    EXPECT_EQ(saves_in(20, 1450), 0); // one more every 30 s
    EXPECT_EQ(saves_in(20, 50), 1);
    EXPECT_EQ(saves_in(10, 2600), 0); // none before 60 s
    EXPECT_EQ(saves_in(10, 500), 1);
}

// By index and sub-index, before there is a dictionary of what is stored.
TEST(StoreLss, AStoredValueIsThatOfItsSubIndex)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    ASSERT_EQ(x.set(0x1800, 5, 77), 0U);
    ASSERT_EQ(x.set(0x1801, 5, 78), 0U);
    ASSERT_EQ(x.set(0x1010, communication, save), 0U);
    for (int pdo = 0; pdo < 2; ++pdo) {
        int32_t value = 0;
        EXPECT_TRUE(app_stored_value(&x.loop.hal, uint16_t(0x1800 + pdo), 5, &value));
        EXPECT_EQ(value, 77 + pdo);
    }
}

// CiA 305, "store configuration": node id and bit rate, and nothing else of their group.
TEST(StoreLss, KeepsNodeIdAndBitRateAlone)
{
    Bench x;
    x.boot(nullptr);
    x.run_ms(5);
    ASSERT_EQ(x.set(0x1017, 0, 333), 0U);
    ASSERT_EQ(node_host_store(&x.loop.app, NODE_GROUP_LSS), 0U);
    std::set<uint32_t> expected, kept;
    for (uint32_t row = 0; row < od_count; ++row) {
        const od_entry_t &entry = od_table[row];
        if (entry.kind == OD_NODE &&
            (entry.slot == OD_NODE_CAN_NODE_ID || entry.slot == OD_NODE_CAN_BIT_RATE)) {
            expected.insert(entry.index * 256U + entry.sub);
        }
    }
    for (const auto &pair : stored(x.loop.hal)) {
        kept.insert(pair.first);
    }
    EXPECT_EQ(expected.size(), 2U);
    EXPECT_EQ(kept, expected);
}

// Pairs that this image does not know are those of another one, which finds them again.
class Foreign : public Bench
{
  public:
    const std::map<uint32_t, int32_t> pairs = {{0x2FFF01, 5}, {0xFFFFFFFE, -3}};

    Foreign()
    {
        const drive_params_t params = defaults();
        uint32_t page[STORE_WORDS];
        app_page(&params, 1, page);
        const int32_t count = store_check(page);
        uint32_t *to = loop.hal.store[0];
        store_writer_t writer;
        store_begin(&writer, 1, od_schema + 1, uint32_t(count + int32_t(pairs.size())), to);
        to += STORE_HEADER;
        for (const auto &pair : pairs) {
            store_put(&writer, {pair.first, pair.second}, to);
            to += 2;
        }
        for (int32_t n = 0; n < count; ++n, to += 2) {
            store_put(&writer, store_pair(page, uint32_t(n)), to);
        }
        store_end(&writer, to);
        sim_loop_boot(&loop);
        run_ms(5);
    }
};

TEST(StoreForeign, UnknownPairsSurviveASaveOfAnyGroup)
{
    for (const auto group : {uint8_t(1), uint8_t(2), uint8_t(3), uint8_t(4)}) {
        Foreign x;
        EXPECT_EQ(x.get(0x2010, 4) & 0xFFFF, x.pairs.size());
        ASSERT_EQ(x.set(0x1017, 0, 333), 0U);
        ASSERT_EQ(x.set(0x1010, group, save), 0U);
        auto now = stored(x.loop.hal);
        for (const auto &pair : x.pairs) {
            EXPECT_EQ(now.count(pair.first), 1U) << int(group);
            EXPECT_EQ(now[pair.first], pair.second) << int(group);
        }
        sim_loop_boot(&x.loop);
        x.run_ms(5);
        EXPECT_EQ(x.get(0x2010, 4) & 0xFFFF, x.pairs.size());
        EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
        ASSERT_EQ(x.set(0x1011, communication, load), 0U);
        EXPECT_EQ(stored(x.loop.hal).count(0x2FFF01), 1U);
        ASSERT_EQ(x.set(0x1011, all, load), 0U); // all is all
        EXPECT_TRUE(stored(x.loop.hal).empty());
    }
}

// What the node has at its presets takes no place: the page holds all parameters of all methods and still what others know.
TEST(StoreForeign, PresetsOfTheNodeAreNotKept)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    ASSERT_EQ(x.set(0x1010, all, save), 0U);
    EXPECT_EQ(stored(x.loop.hal).count(0x101700), 0U);
    ASSERT_EQ(x.set(0x1017, 0, 333), 0U);
    ASSERT_EQ(x.set(0x1010, all, save), 0U);
    EXPECT_EQ(stored(x.loop.hal).at(0x101700), 333);
    ASSERT_EQ(x.set(0x1017, 0, 500), 0U); // the preset
    ASSERT_EQ(x.set(0x1010, all, save), 0U);
    EXPECT_EQ(stored(x.loop.hal).count(0x101700), 0U);
    sim_loop_boot(&x.loop);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x1017, 0) & 0xFFFF, 500U);
}

// More than a page holds is refused, and what is there stays.
TEST(StoreForeign, AFullPageRefusesASave)
{
    Bench x;
    uint32_t *to = x.loop.hal.store[0];
    store_writer_t writer;
    store_begin(&writer, 1, od_schema + 1, STORE_PAIRS_MAX, to);
    to += STORE_HEADER;
    for (uint32_t n = 0; n < STORE_PAIRS_MAX; ++n, to += 2) {
        store_put(&writer, {0x2FFF00 + n, int32_t(n)}, to);
    }
    store_end(&writer, to);
    sim_loop_boot(&x.loop);
    x.run_ms(5);
    const auto before = stored(x.loop.hal);
    EXPECT_EQ(x.set(0x1010, all, save), MEMORY);
    EXPECT_EQ(stored(x.loop.hal), before);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_NOT_STORED));
    EXPECT_EQ(x.set(0x1011, all, load), 0U);
    EXPECT_EQ(x.set(0x1010, all, save), 0U);
}

} // namespace
