// What can go wrong on the bus while the motor runs: each either opens the bridge within its time or changes
// nothing.
#include <functional>

#include "tests/support/bus_bits.h"
#include "tests/unit/app/bench.h"
#include "tools/pmsim_board/bus_noise.h"

using app_test::Running;

namespace
{

constexpr int heartbeat_ms = 100; // 1016h
constexpr int rpdo_ms = 500;      // 1400h:5, as delivered
constexpr int command_ms = 100, beat_ms = 50;
constexpr int at_once_ms = 2; // a round of the main loop, and the next look
constexpr int watched_ms = 1000;
constexpr double speed_rad_s = 30;
constexpr uint32_t lost = 0x8130, timed_out = 0x8250, bus_off = 0x8140, nmt = 0x8100;
constexpr uint32_t namesake = 0x8150, overrun = 0x8110, passive = 0x8120, length = 0x8210;

struct Row {
    const char *name;
    bool commands, beats;                           // the master's, that still come
    std::function<void(Running &, int ms)> happens; // every millisecond
    uint32_t code;                                  // 603Fh, or 0: it runs on
    int soonest_ms, latest_ms;
    uint32_t told; // in an emergency message
};

void nothing(Running &, int)
{
}

// Once, in the first millisecond
std::function<void(Running &, int)> once(const std::function<void(Running &)> &what)
{
    return [what](Running &x, int ms) {
        if (ms == 0) {
            what(x);
        }
    };
}

// 1 Mbit/s, all of it
std::function<void(Running &, int)> babble(uint16_t id, int bytes)
{
    return [id, bytes](Running &x, int) {
        for (int n = 0; n <= 1000 / bus_bits::least(bytes); ++n) {
            x.give(id, std::vector<uint8_t>(size_t(bytes), uint8_t(n)));
            app_turn(&x.loop.app); // a processor's goes round for each
        }
    };
}

void garbage(Running &x, int ms)
{
    bus_noise_t noise = {BUS_GARBAGE, uint32_t(ms)};
    for (int bits = 0; bits < 1000;) {
        const hal_can_frame_t f = bus_noise_next(&noise);
        x.give(f.id, std::vector<uint8_t>(f.data, f.data + f.length));
        app_turn(&x.loop.app);
        bits += bus_bits::least(f.length);
    }
}

std::function<void(Running &, int)> nmt_command(int command)
{
    return once([command](Running &x) { x.give(0, {uint8_t(command), 1}); });
}

std::function<void(Running &, int)> every_ms(uint16_t id, const std::vector<uint8_t> &data)
{
    return [id, data](Running &x, int) { x.give(id, data); };
}

const Row rows[] = {
    {"heartbeat lost", true, false, nothing, lost, heartbeat_ms - 1, heartbeat_ms + at_once_ms, lost},
    {"commands cease", false, true, nothing, timed_out, rpdo_ms - 1, rpdo_ms + at_once_ms, timed_out},
    {"cable cut", false, false, nothing, lost, heartbeat_ms - 1, heartbeat_ms + at_once_ms, lost},
    {"bus-off", true, true, once([](Running &x) { x.loop.hal.can_state = HAL_CAN_BUS_OFF; }), bus_off, 0,
     at_once_ms, 0}, // nothing can be told
    {"error passive", true, true, once([](Running &x) { x.loop.hal.can_state = HAL_CAN_PASSIVE; }), 0, 0, 0,
     passive},
    {"NMT stop", true, true, nmt_command(2), nmt, 0, at_once_ms, nmt},
    {"NMT pre-operational", true, true, nmt_command(128), nmt, 0, at_once_ms, nmt},
    {"NMT reset", true, true, nmt_command(129), nmt, 0, at_once_ms, nmt},
    {"NMT reset of communication", true, true, nmt_command(130), nmt, 0, at_once_ms, nmt},
    {"babbler that lets commands pass, long frames", true, true, babble(0x7F0, 8), 0, 0, 0, 0},
    {"babbler that lets commands pass, short frames", true, true, babble(0x7F0, 0), 0, 0, 0, 0},
    {"babbler before which nothing passes", false, false, babble(0x001, 8), lost, heartbeat_ms - 1,
     heartbeat_ms + at_once_ms, 0},
    {"the same, without a heartbeat that is watched", false, true, babble(0x001, 0), timed_out, rpdo_ms - 1,
     rpdo_ms + at_once_ms, 0},
    {"garbage, the bus full", true, true, garbage, 0, 0, 0, length},
    {"heartbeat of a namesake", true, true, every_ms(0x701, {5}), 0, 0, 0, namesake},
    {"boot-up of a namesake", true, true, every_ms(0x701, {0}), 0, 0, 0, namesake},
    {"SDO answers of a namesake", true, true, every_ms(0x581, {0x60, 0, 0x10, 0, 0, 0, 0, 0}), 0, 0, 0,
     namesake},
    {"frames lost", true, true, once([](Running &x) { x.loop.hal.can_lost++; }), 0, 0, 0, overrun},
};

class Reaction : public testing::TestWithParam<Row>
{
};

void master(Running *x, const Row &row, int ms)
{
    if (row.commands && ms % command_ms == 0) {
        x->control(0x0F, 3, int32_t(1e3 * speed_rad_s));
    }
    if (row.beats && ms % beat_ms == 0) {
        x->give(0x77F, {5});
    }
}

bool is_told(Running *x, uint32_t code)
{
    bool found = false;
    for (const hal_can_frame_t &frame : x->take(0x81)) {
        found = found || (frame.data[0] | uint32_t(frame.data[1]) << 8) == code;
    }
    return found;
}

TEST_P(Reaction, OffWithinItsTimeOrUnaffected)
{
    const Row &row = GetParam();
    Running x;
    ASSERT_EQ(x.set(0x1016, 1, 0x007F0000U + uint32_t(heartbeat_ms)), 0U);
    x.control(0x0F, 3, int32_t(1e3 * speed_rad_s)); // the last that surely come
    x.give(0x77F, {5});
    x.run_ms(1);
    x.take(0);
    bool told = false;
    int off_ms = -1;
    for (int ms = 0; ms < watched_ms && off_ms < 0; ++ms) {
        master(&x, row, ms);
        row.happens(x, ms);
        x.run_ms(1);
        told = is_told(&x, row.told) || told;
        off_ms = x.loop.hal.armed ? -1 : ms + 1;
    }
    x.run_ms(20); // emergency messages keep their distance
    told = is_told(&x, row.told) || told;
    EXPECT_TRUE(told || row.told == 0) << std::hex << row.told;
    if (row.code == 0) {
        plant_truth_t t;
        plant_truth(x.plant(), &t);
        EXPECT_EQ(off_ms, -1);
        EXPECT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
        EXPECT_NEAR(t.omega_mech_rad_s, speed_rad_s, 1);
        return;
    }
    EXPECT_GE(off_ms, row.soonest_ms);
    EXPECT_LE(off_ms, row.latest_ms);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_REMOTE_LOST);

    if (x.loop.hal.reset) {
        return; // it begins anew
    }
    // All is well again, and the master commands as before: nothing starts by itself.
    x.loop.hal.can_state = HAL_CAN_ACTIVE;
    x.give(0, {1, 1});
    x.run_ms(2);
    EXPECT_EQ(x.get(0x603F), row.code);
    EXPECT_EQ(x.statusword() & 0x4F, 0x08);
    x.control(0x06);
    x.control(0x07);
    x.control(0x0F);
    x.run_ms(100);
    EXPECT_FALSE(x.loop.hal.armed);
}

INSTANTIATE_TEST_SUITE_P(Bus, Reaction, testing::ValuesIn(rows), [](const auto &row) {
    std::string name = row.param.name;
    std::replace_if(
        name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; },
        '_');
    return name;
});

} // namespace
