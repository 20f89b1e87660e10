// The trace: what the interrupt saw is what is uploaded, around the trigger.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

extern "C" {
#include "firmware/can/dictionary_slots.h"
#include "firmware/can/trace.h"
}

namespace
{

const uint32_t RING = 96;
const int32_t kRaw = 1 << TRACE_SHIFT;

class Scope
{
  public:
    Scope()
    {
        trace_init(&t, ring, RING, this);
    }

    uint32_t put(int slot, int32_t value)
    {
        uint32_t code = 1;
        EXPECT_TRUE(trace_put(&t, uint16_t(slot), value, &code));
        return code;
    }

    int32_t get(int slot)
    {
        int32_t value = 0;
        EXPECT_TRUE(trace_get(&t, uint16_t(slot), &value));
        return value;
    }

    // Signals 1 ... n are the sources 1 ... n
    void choose(int n)
    {
        for (int k = 0; k < 8; ++k) {
            EXPECT_EQ(put(OD_LIVE_TRACE_SIGNAL_1 + k, k < n ? int32_t(0x29000000 | (k + 1) << 8) : 0), 0U);
        }
    }

    // One control period; source 1 is raw x, the others follow from it
    void step(int32_t x)
    {
        for (int k = 0; k < 8; ++k) {
            source[k] = (x + 100 * k) * kRaw;
        }
        trace_sample(&t);
    }

    std::vector<int16_t> data()
    {
        const uint32_t size = trace_size(&t);
        std::vector<uint8_t> bytes(size);
        for (uint32_t at = 0; at < size; at += 7) { // as a block transfer asks for it
            trace_read(&t, at, &bytes[at], std::min<uint32_t>(7, size - at));
        }
        std::vector<int16_t> numbers;
        for (uint32_t n = 0; n < size; n += 2) {
            numbers.push_back(int16_t(bytes[n] | bytes[n + 1] << 8));
        }
        return numbers;
    }

    trace_t t;
    int16_t ring[RING + 1] = {};
    int32_t source[8] = {};
    int32_t scale = 32768;
    int angle = 0; // number of the source that is one

    static bool find(void *context, uint16_t index, uint8_t sub, trace_signal_t *signal)
    {
        Scope &s = *static_cast<Scope *>(context);
        if (index != 0x2900 || sub < 1 || sub > 8) {
            return false;
        }
        *signal = {&s.source[sub - 1], s.scale, sub == s.angle};
        return true;
    }
};

} // namespace

extern "C" bool trace_host_find(void *context, uint16_t index, uint8_t sub, trace_signal_t *signal)
{
    return Scope::find(context, index, sub, signal);
}

namespace
{

TEST(Trace, RecordsAtOnceAndCompletely)
{
    for (int signals = 1; signals <= 8; ++signals) {
        Scope x;
        x.ring[RING] = 0x1234;
        x.choose(signals);
        ASSERT_EQ(x.put(OD_LIVE_TRACE_PRETRIGGER, 0), 0U);
        ASSERT_EQ(x.put(OD_LIVE_TRACE_COMMAND, 1), 0U);
        const int length = int(RING) / signals;
        EXPECT_EQ(x.get(OD_LIVE_TRACE_LENGTH), length);
        for (int n = 0; n < length; ++n) {
            EXPECT_EQ(trace_size(&x.t), 0U);
            x.step(n);
        }
        EXPECT_EQ(x.get(OD_LIVE_TRACE_STATE), TRACE_COMPLETE);
        x.step(9999); // no more
        const auto data = x.data();
        ASSERT_EQ(data.size(), size_t(length * signals));
        for (int n = 0; n < length; ++n) {
            for (int k = 0; k < signals; ++k) {
                EXPECT_EQ(data[size_t(n * signals + k)], n + 100 * k);
            }
        }
        EXPECT_EQ(x.ring[RING], 0x1234);
    }
}

TEST(Trace, TriggersOnLevelAndEdge)
{
    // a triangle between -200 and 200
    const auto wave = [](int n) {
        const int phase = n % 80;
        return phase < 40 ? -200 + 10 * phase : 200 - 10 * (phase - 40);
    };
    for (const int edge : {TRACE_RISING, TRACE_FALLING, TRACE_BOTH}) {
        for (const int permille : {0, 100, 500, 990, 1000}) {
            Scope x;
            x.choose(2);
            x.put(OD_LIVE_TRACE_EDGE, edge);
            x.put(OD_LIVE_TRACE_LEVEL, 55);
            x.put(OD_LIVE_TRACE_TRIGGER, 1);
            x.put(OD_LIVE_TRACE_PRETRIGGER, permille);
            x.put(OD_LIVE_TRACE_COMMAND, 1);
            int n = 0;
            while (x.get(OD_LIVE_TRACE_STATE) != TRACE_COMPLETE && n < 1000) {
                x.step(wave(n++));
            }
            const auto data = x.data();
            ASSERT_EQ(data.size(), RING);
            const int at = x.get(OD_LIVE_TRACE_AT);
            EXPECT_EQ(at, std::min(46, std::max(1, 48 * permille / 1000)));
            const int before = data[size_t(2 * (at - 1))], now = data[size_t(2 * at)];
            const bool rises = before < 55 && now >= 55, falls = before >= 55 && now < 55;
            EXPECT_TRUE(edge == TRACE_RISING    ? rises
                        : edge == TRACE_FALLING ? falls
                                                : rises || falls)
                << edge << " " << permille << " " << before << " " << now;
            for (int k = 0; k < 48; ++k) { // without a gap, and the signals together
                EXPECT_EQ(data[size_t(2 * k)], wave(n - 48 + k));
                EXPECT_EQ(data[size_t(2 * k + 1)], wave(n - 48 + k) + 100);
            }
        }
    }
}

TEST(Trace, SettingsReadBack)
{
    Scope x;
    x.choose(1);
    const struct {
        uint16_t slot;
        int32_t value;
    } settings[] = {{OD_LIVE_TRACE_DIVIDER, 7},
                    {OD_LIVE_TRACE_PRETRIGGER, 250},
                    {OD_LIVE_TRACE_TRIGGER, 1},
                    {OD_LIVE_TRACE_EDGE, 2},
                    {OD_LIVE_TRACE_LEVEL, -55}};
    for (const auto &at : settings) {
        EXPECT_EQ(x.put(at.slot, at.value), 0U) << at.slot;
    }
    for (const auto &at : settings) {
        int32_t value = 12345;
        EXPECT_TRUE(trace_get(&x.t, at.slot, &value)) << at.slot;
        EXPECT_EQ(value, at.value) << at.slot;
    }
    for (const uint16_t slot : {OD_LIVE_TRACE_COMMAND, OD_LIVE_TRACE_STATE, OD_LIVE_TRACE_AT}) {
        int32_t value = 12345;
        EXPECT_TRUE(trace_get(&x.t, slot, &value)) << slot;
        EXPECT_EQ(value, 0) << slot;
    }
    int32_t value = 0;
    EXPECT_FALSE(trace_get(&x.t, OD_LIVE_I_Q, &value));
}

TEST(Trace, WaitsForTheTriggerOrItsCommand)
{
    Scope x;
    x.choose(1);
    x.put(OD_LIVE_TRACE_TRIGGER, 1);
    x.put(OD_LIVE_TRACE_LEVEL, 1000);
    x.put(OD_LIVE_TRACE_COMMAND, 1);
    for (int n = 0; n < 1000; ++n) {
        x.step(n % 7);
    }
    EXPECT_EQ(x.get(OD_LIVE_TRACE_STATE), TRACE_WAITING);
    EXPECT_EQ(x.put(OD_LIVE_TRACE_COMMAND, 2), 0U);
    for (int n = 0; n < 96; ++n) {
        x.step(50 + n);
    }
    EXPECT_EQ(x.get(OD_LIVE_TRACE_STATE), TRACE_COMPLETE);
    EXPECT_EQ(x.data()[size_t(x.get(OD_LIVE_TRACE_AT))], 50);
    EXPECT_EQ(x.put(OD_LIVE_TRACE_COMMAND, 2), 0x08000022U);
}

TEST(Trace, DividerTakesEverySoManieth)
{
    Scope x;
    x.choose(1);
    x.put(OD_LIVE_TRACE_DIVIDER, 5);
    x.put(OD_LIVE_TRACE_COMMAND, 1);
    for (int n = 0; n < 5 * 96; ++n) {
        x.step(n);
    }
    const auto data = x.data();
    ASSERT_EQ(data.size(), 96U);
    for (int n = 0; n < 96; ++n) {
        EXPECT_EQ(data[size_t(n)], 5 * n);
    }
}

TEST(Trace, ShiftsAndLimits)
{
    Scope x;
    x.choose(1);
    x.put(OD_LIVE_TRACE_COMMAND, 1);
    const int32_t values[] = {INT32_MAX,     INT32_MIN,     32767 * kRaw, 32768 * kRaw,
                              -32768 * kRaw, -32769 * kRaw, -1,           kRaw - 1};
    const int16_t raw[] = {32767, -32768, 32767, 32767, -32768, -32768, -1, 0};
    for (int n = 0; n < 96; ++n) {
        x.source[0] = values[n % 8];
        trace_sample(&x.t);
    }
    for (size_t n = 0; n < 8; ++n) {
        EXPECT_EQ(x.data()[n], raw[n]);
    }
}

TEST(Trace, OneSignalMayBeAnAngle)
{
    for (int place = 1; place <= 8; ++place) {
        Scope x;
        x.angle = place;
        x.choose(8);
        x.put(OD_LIVE_TRACE_COMMAND, 1);
        for (int n = 0; n < 12; ++n) {
            for (int k = 0; k < 8; ++k) {
                x.source[k] = k + 1 == place ? int32_t(uint32_t(n) * 0x30000000U) : k * kRaw;
            }
            trace_sample(&x.t);
        }
        ASSERT_EQ(x.data().size(), RING);
        for (size_t n = 0; n < RING; ++n) {
            const int k = int(n % 8);
            EXPECT_EQ(x.data()[n], k + 1 == place ? int16_t(uint16_t(n / 8 * 0x3000U)) : k);
        }
        x.put(OD_LIVE_TRACE_SIGNAL_1 + place % 8, 0x29000000 | place << 8); // a second time
        EXPECT_EQ(x.put(OD_LIVE_TRACE_COMMAND, 1), 0x06040043U);
    }
}

TEST(Trace, LevelIsInTheUnitOfTheSignal)
{
    Scope x;
    x.scale = 20000; // 20000 mA at raw 32768
    x.choose(1);
    EXPECT_EQ(x.get(OD_LIVE_TRACE_SCALE_1), 20000);
    EXPECT_EQ(x.get(OD_LIVE_TRACE_SCALE_8), 0);
    const std::pair<int32_t, int32_t> levels[] = {
        {10000, 16384},   {-10000, -16384}, {30000, 32768},   {-30000, -32769},   {19999, 32766},
        {-19999, -32766}, {20000, 32768},   {-20000, -32768}, {20001, 32768},     {0, 0},
        {1, 1},           {-1, -1},         {-20001, -32769}, {INT32_MAX, 32768}, {INT32_MIN, -32769}};
    for (const auto &pair : levels) {
        x.put(OD_LIVE_TRACE_LEVEL, pair.first);
        x.put(OD_LIVE_TRACE_TRIGGER, 1);
        x.put(OD_LIVE_TRACE_COMMAND, 1);
        EXPECT_EQ(x.t.level, pair.second);
        x.put(OD_LIVE_TRACE_COMMAND, 0);
    }
}

TEST(Trace, SignalsMayHaveGapsAndTheTriggerIsThatOfItsNumber)
{
    Scope x;
    x.put(OD_LIVE_TRACE_SIGNAL_1 + 2, 0x29000300);
    x.put(OD_LIVE_TRACE_SIGNAL_1 + 5, 0x29000600);
    x.put(OD_LIVE_TRACE_TRIGGER, 6);
    x.put(OD_LIVE_TRACE_LEVEL, 520); // source 6 is x + 500
    EXPECT_EQ(x.put(OD_LIVE_TRACE_COMMAND, 1), 0U);
    EXPECT_EQ(x.get(OD_LIVE_TRACE_LENGTH), 48);
    for (int n = 0; n < 200; ++n) {
        x.step(n);
    }
    ASSERT_EQ(x.get(OD_LIVE_TRACE_STATE), TRACE_COMPLETE);
    const auto at = size_t(x.get(OD_LIVE_TRACE_AT));
    EXPECT_EQ(x.data()[2 * at], 220);
    EXPECT_EQ(x.data()[2 * at + 1], 520);
}

TEST(Trace, RefusesWhatCannotBe)
{
    Scope x;
    EXPECT_EQ(x.put(OD_LIVE_TRACE_COMMAND, 1), 0x06040043U); // no signal
    EXPECT_EQ(x.put(OD_LIVE_TRACE_SIGNAL_1, 0x29000900), 0x06040041U);
    x.choose(1);
    x.put(OD_LIVE_TRACE_TRIGGER, 2);
    EXPECT_EQ(x.put(OD_LIVE_TRACE_COMMAND, 1), 0x06040043U); // triggers on none
    EXPECT_EQ(x.get(OD_LIVE_TRACE_STATE), TRACE_OFF);
    x.put(OD_LIVE_TRACE_TRIGGER, 0);
    EXPECT_EQ(x.put(OD_LIVE_TRACE_COMMAND, 1), 0U);
    for (const int slot : {OD_LIVE_TRACE_DIVIDER, OD_LIVE_TRACE_PRETRIGGER, OD_LIVE_TRACE_TRIGGER,
                           OD_LIVE_TRACE_EDGE, OD_LIVE_TRACE_LEVEL, OD_LIVE_TRACE_SIGNAL_1}) {
        EXPECT_EQ(x.put(slot, 0), 0x08000022U);
    }
    EXPECT_EQ(x.put(OD_LIVE_TRACE_COMMAND, 0), 0U);
    EXPECT_EQ(x.put(OD_LIVE_TRACE_DIVIDER, 3), 0U);
    EXPECT_EQ(trace_size(&x.t), 0U);
}

TEST(Trace, TakesItsSettingsAlone)
{
    Scope x;
    uint32_t code;
    for (const int slot :
         {OD_LIVE_TRACE_STATE, OD_LIVE_TRACE_AT, OD_LIVE_TRACE_SCALE_1, OD_LIVE_TRACE_SCALE_8}) {
        EXPECT_FALSE(trace_put(&x.t, uint16_t(slot), 1, &code)) << slot;
    }
}

TEST(Trace, NewSettingsEndTheOldData)
{
    Scope x;
    x.choose(1);
    x.put(OD_LIVE_TRACE_COMMAND, 1);
    for (int n = 0; n < 96; ++n) {
        x.step(n);
    }
    EXPECT_GT(trace_size(&x.t), 0U);
    x.put(OD_LIVE_TRACE_LEVEL, 4);
    EXPECT_EQ(trace_size(&x.t), 0U);
}

} // namespace
