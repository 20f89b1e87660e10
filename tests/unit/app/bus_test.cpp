// The drive as a CANopen device: parameters, store, profile, trace, on the simulated board.
#include <map>

#include "tests/unit/app/bench.h"

using app_test::Bench;
using app_test::defaults;
using app_test::Running;

namespace
{

const uint32_t save = 0x65766173, load = 0x64616F6C;
enum : uint32_t {
    READ_ONLY = 0x06010002,
    INCOMPATIBLE = 0x06040043,
    HARDWARE = 0x06060000,
    TOO_HIGH = 0x06090031,
    STATE = 0x08000022
};

TEST(BusParameters, AreReadAndWritten)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    for (int id = 0; id < DRIVE_PARAM_COUNT; ++id) {
        EXPECT_EQ(x.parameter(drive_param_id_t(id)), drive_param_get(&params, drive_param_id_t(id)));
    }
    EXPECT_EQ(x.set(DRIVE_PARAM_i_max, 4321), 0U);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_i_max), 4321);
    x.run_ms(2);
    drive_params_t wanted = params;
    wanted.i_max = 4321;
    drive_config_t config = {};
    ASSERT_TRUE(drive_configure(&config, &wanted, PM_CHANNELS).ok);
    EXPECT_EQ(x.loop.app.drive.config.i_max, config.i_max);
}

// Each parameter at both limits: taken, or refused because another one forbids it; beyond: by its range.
TEST(BusParameters, AtAndBeyondTheirLimits)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    int taken = 0;
    for (int n = 0; n < DRIVE_PARAM_COUNT; ++n) {
        const auto id = drive_param_id_t(n);
        const drive_param_info_t &info = drive_param_table[n];
        if (!Bench::is_stored(id)) { // what the board says
            EXPECT_EQ(x.set(id, info.min), READ_ONLY) << info.name;
            EXPECT_EQ(x.parameter(id), drive_param_get(&params, id)) << info.name;
            continue;
        }
        for (const int32_t value : {info.min, info.max}) {
            drive_params_t wanted = params;
            drive_param_set(&wanted, id, value);
            drive_config_t config = {};
            const bool good = drive_configure(&config, &wanted, hal_channels(&x.loop.hal)).ok;
            EXPECT_EQ(x.set(id, value), good ? 0U : INCOMPATIBLE) << info.name << " " << value;
            EXPECT_EQ(x.parameter(id), good ? value : drive_param_get(&params, id)) << info.name;
            taken += good ? 1 : 0;
            if (good) {
                EXPECT_EQ(x.set(id, drive_param_get(&params, id)), 0U) << info.name;
            }
        }
        EXPECT_EQ(x.set(id, info.max + 1), TOO_HIGH) << info.name;
        const od_entry_t *entry = Bench::entry_of(id);
        const bool no_room = info.min == 0 && entry->type >= OD_U8; // below zero is far above
        EXPECT_EQ(x.set(id, info.min - 1), no_room ? TOO_HIGH : TOO_HIGH + 1) << info.name;
    }
    EXPECT_GT(taken, 40);
}

TEST(BusParameters, WhileRunningTheyArriveWhole)
{
    Running x;
    EXPECT_EQ(x.set(DRIVE_PARAM_speed_bandwidth, 5000), 0U);
    EXPECT_EQ(x.set(DRIVE_PARAM_current_bandwidth, 400000), 0U);
    for (int ms = 0; ms < 400; ms += 100) {
        x.control(0x0F);
        x.run_ms(100);
    }
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
    plant_truth_t t;
    plant_truth(x.plant(), &t);
    EXPECT_NEAR(t.omega_mech_rad_s, 30, 1);
    drive_config_t config = {};
    ASSERT_TRUE(drive_configure(&config, &x.loop.app.params, PM_CHANNELS).ok);
    EXPECT_EQ(std::memcmp(&config, &x.loop.app.drive.config, sizeof config), 0);
}

// Both in one would be too long for a period of 40 kHz; sets that follow each other must not keep drive_slow() off.
TEST(BusParameters, ASetAndDriveSlowHavePeriodsOfTheirOwn)
{
    Running x;
    app_t *app = &x.loop.app;
    for (int32_t n = 0; n < 5; ++n) {
        EXPECT_EQ(x.set(DRIVE_PARAM_speed_bandwidth, 5000 + n), 0U);
        app->next_ready = true; // also the period after
        for (int period = 0; period < 20 && !app->swapping; ++period) {
            app->drive.status.i_ref.q = 12345; // which drive_slow() replaces
            sim_loop_step(&x.loop);
        }
        ASSERT_TRUE(app->swapping);
        EXPECT_EQ(app->drive.status.i_ref.q, 12345);
        app->next_ready = true;
        sim_loop_step(&x.loop);
        EXPECT_FALSE(app->swapping);
        EXPECT_NE(app->drive.status.i_ref.q, 12345);
        EXPECT_EQ(app->drive.fault, DRIVE_FAULT_NONE);
        x.control(0x0F);
        x.run_ms(3);
    }
}

// Whatever the dictionary allows while running: nothing changes the frame in which the drive's state is.
TEST(BusParameters, NothingStructuralChangesWhileRunning)
{
    Running x;
    int refused = 0;
    for (int n = 0; n < DRIVE_PARAM_COUNT; ++n) {
        const auto id = drive_param_id_t(n);
        const drive_config_t before = x.loop.app.drive.config;
        const int32_t old = x.parameter(id);
        const uint32_t code = x.set(id, old == drive_param_table[n].max ? old - 1 : old + 1);
        x.control(0x0F);
        x.run_ms(2);
        EXPECT_TRUE(drive_same_frame(&before, &x.loop.app.drive.config)) << drive_param_table[n].name;
        refused += code == STATE ? 1 : 0;
        if (code != 0) {
            EXPECT_EQ(x.parameter(id), old);
        }
        x.control(0x0F);
    }
    EXPECT_GT(refused, 5);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
    EXPECT_EQ(x.set(0x1010, 1, save), STATE);
    EXPECT_EQ(x.set(0x1011, 1, load), STATE);
}

TEST(BusParameters, BatchIsCheckedTogetherAndUndoneTogether)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    EXPECT_EQ(x.set(DRIVE_PARAM_i_max, 9500), INCOMPATIBLE); // above i_trip
    EXPECT_EQ(x.set(0x2010, 1, 1), 0U);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_BATCH));
    EXPECT_EQ(x.set(DRIVE_PARAM_i_max, 9500), 0U);
    EXPECT_EQ(x.set(DRIVE_PARAM_i_trip, 9800), 0U);
    x.control(0x06);
    x.run_ms(2);
    EXPECT_EQ(x.statusword() & 0x6F, 0x40); // not while a batch is open
    EXPECT_EQ(x.set(0x2010, 1, 0), 0U);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_i_max), 9500);
    EXPECT_EQ(x.set(0x2010, 1, 1), 0U);
    EXPECT_EQ(x.set(DRIVE_PARAM_i_max, 5000), 0U);
    EXPECT_EQ(x.set(DRIVE_PARAM_v_dc_min, 390000), 0U);
    EXPECT_EQ(x.set(0x2010, 1, 0), INCOMPATIBLE);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_i_max), 9500);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_v_dc_min), params.v_dc_min);
    const od_entry_t *named = Bench::entry_of(DRIVE_PARAM_v_dc_derate);
    EXPECT_EQ(x.get(0x2010, 2), named->index * 256U + named->sub);
}

TEST(BusParameters, WhatTheHardwareRunsWithWaitsForARestart)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
    EXPECT_EQ(x.set(DRIVE_PARAM_dead_time, 1500), 0U);
    x.run_ms(2);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_RESTART));
    x.run_enabled_ms(200);
    EXPECT_FALSE(x.loop.hal.armed);
    x.send(false);
    x.run_ms(2);
    EXPECT_EQ(x.set(0x1010, 1, save), 0U);
    x.give(0, {129, 1}); // reset of the node
    x.run_ms(1);
    EXPECT_TRUE(x.loop.hal.reset);
    sim_loop_boot(&x.loop);
    x.run_ms(5);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_dead_time), 1500);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
}

TEST(BusStore, ASaveMakesAnEmptyDriveReady)
{
    Bench x;
    x.boot(nullptr);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_NOT_STORED));
    EXPECT_EQ(x.set(0x1010, 1, save), 0U);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
    EXPECT_EQ(x.statusword() & 0x4F, 0x40);
    x.run_enabled_ms(700);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
}

TEST(BusStore, ARefusedSetCanBeMended)
{
    Bench x;
    drive_params_t params = defaults();
    params.R_s = -1;
    params.i_max = 50;
    x.boot(&params);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_REFUSED));
    EXPECT_EQ(x.set(DRIVE_PARAM_i_max, 5000), 0U); // still bad
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_REFUSED));
    EXPECT_EQ(x.set(DRIVE_PARAM_R_s, defaults().R_s), 0U);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
    x.send(false, true);
    x.run_ms(5);
    x.run_enabled_ms(700);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
}

// Groups: 2 communication, 3 application, 4 machine
TEST(BusStore, GroupsAreStoredAndForgottenByThemselves)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    const uint8_t group_of_i_max = Bench::entry_of(DRIVE_PARAM_i_max)->group;
    const uint8_t group_of_R_s = Bench::entry_of(DRIVE_PARAM_R_s)->group;
    const auto boot_again = [&] {
        sim_loop_boot(&x.loop);
        x.run_ms(5);
    };
    EXPECT_EQ(x.set(0x1017, 0, 777), 0U);
    EXPECT_EQ(x.set(DRIVE_PARAM_i_max, 4444), 0U);
    EXPECT_EQ(x.set(DRIVE_PARAM_R_s, 5000000), 0U);
    EXPECT_EQ(x.set(0x605B, 0, 1), 0U);
    EXPECT_EQ(x.set(0x1010, 2, save), 0U);
    boot_again();
    EXPECT_EQ(x.get(0x1017) & 0xFFFF, 777U);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_i_max), params.i_max);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_R_s), params.R_s);
    EXPECT_EQ(x.set(DRIVE_PARAM_i_max, 4444), 0U);
    EXPECT_EQ(x.set(DRIVE_PARAM_R_s, 5000000), 0U);
    EXPECT_EQ(x.set(0x605B, 0, 1), 0U);
    EXPECT_EQ(x.set(0x1010, uint8_t(group_of_R_s + 1), save), 0U);
    boot_again();
    EXPECT_EQ(x.get(0x1017) & 0xFFFF, 777U);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_R_s), 5000000);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_i_max), group_of_i_max == group_of_R_s ? 4444 : params.i_max);
    EXPECT_EQ(x.set(0x605B, 0, 1), 0U);
    EXPECT_EQ(x.set(0x1010, 1, save), 0U);
    EXPECT_EQ(x.set(0x1011, 2, load), 0U);
    EXPECT_EQ(x.get(0x1017) & 0xFFFF, 777U); // until the next start
    boot_again();
    EXPECT_EQ(x.get(0x1017) & 0xFFFF, 500U);
    EXPECT_EQ(x.parameter(DRIVE_PARAM_R_s), 5000000);
    EXPECT_EQ(x.get(0x605B) & 0xFFFF, 1U);
    EXPECT_EQ(x.set(0x1011, 1, load), 0U);
    boot_again();
    EXPECT_EQ(x.parameter(DRIVE_PARAM_R_s), params.R_s);
    EXPECT_EQ(x.get(0x605B) & 0xFFFF, 0U);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_NOT_STORED));
}

// All that the newer valid page holds
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

// Power lost at every byte of a save of everything: afterwards the old set or the new one, none lost, none
// mixed.
TEST(BusStore, PowerLostAtEveryByteLeavesAWholeSet)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    ASSERT_EQ(x.set(DRIVE_PARAM_i_max, 4000), 0U);
    ASSERT_EQ(x.set(0x1017, 0, 400), 0U);
    ASSERT_EQ(x.set(0x1010, 1, save), 0U);
    const auto older = stored(x.loop.hal);
    ASSERT_EQ(x.set(DRIVE_PARAM_i_max, 4100), 0U); // one at the beginning, one at the end of the page
    ASSERT_EQ(x.set(0x1017, 0, 410), 0U);
    auto newer = older;
    newer[Bench::entry_of(DRIVE_PARAM_i_max)->index * 256U + Bench::entry_of(DRIVE_PARAM_i_max)->sub] = 4100;
    newer[0x101700] = 410;
    const sim_loop_t before = x.loop;
    uint32_t cut = 0;
    uint32_t lost = 0;
    for (bool whole = false; !whole && cut < HAL_STORE_PAGE_SIZE; ++cut) {
        std::memcpy(x.loop.hal.store, before.hal.store, sizeof before.hal.store);
        x.loop.hal.store_bytes_left = cut;
        x.loop.app.saves = 0;
        whole = x.set(0x1010, 1, save) == 0;
        lost += whole ? 0 : 1;
        const bool seal_cut = cut > 4 * (8 + 2 * newer.size()); // of a page that is whole
        ASSERT_EQ(stored(x.loop.hal), whole || seal_cut ? newer : older) << cut;
        drive_params_t back;
        uint32_t unknown;
        ASSERT_TRUE(app_load(&x.loop.hal, &back, &unknown)) << cut;
        ASSERT_EQ(unknown, 0U);
        ASSERT_EQ(back.i_max, whole || seal_cut ? 4100 : 4000) << cut;
    }
    EXPECT_EQ(lost, 4 * (10 + 2 * newer.size())); // seal of the old page, header, end and seal, and the pairs
}

TEST(BusStore, AFlashErrorIsReported)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    x.loop.hal.store_bytes_left = 10;
    EXPECT_EQ(x.set(0x1010, 1, save), HARDWARE);
}

TEST(BusReaction, FaultsOfTheDriveAreReported)
{
    Running x;
    x.take(0);
    x.loop.hal.temperature_missing = true;
    x.run_ms(30);
    const auto emcy = x.take(0x81);
    ASSERT_EQ(emcy.size(), 1U);
    EXPECT_EQ(emcy[0].data[0] | emcy[0].data[1] << 8, 0x4320);
    EXPECT_EQ(emcy[0].data[2], 0x09);
    EXPECT_EQ(emcy[0].data[3], DRIVE_FAULT_TEMPERATURE_SENSOR);
    EXPECT_EQ(x.get(0x603F), 0x4320U);
    EXPECT_EQ(x.get(0x1003, 1) & 0xFFFF, 0x4320U);
    EXPECT_EQ(x.get(0x2A00, 1) & 0xFF, uint32_t(DRIVE_FAULT_TEMPERATURE_SENSOR));
    x.loop.hal.temperature_missing = false;
    x.send(false, true);
    x.run_ms(30);
    EXPECT_EQ(x.get(0x1001) & 0xFF, 0U);
}

TEST(BusProfile, StopsAsAsked)
{
    Running x;
    plant_truth_t t;
    x.control(0x00); // disable voltage
    x.run_ms(3);
    EXPECT_FALSE(x.loop.hal.armed);
    plant_truth(x.plant(), &t);
    EXPECT_GT(t.omega_mech_rad_s, 25); // it runs out
    Running y;
    y.control(0x02); // quick stop
    y.run_ms(100);
    EXPECT_TRUE(y.loop.hal.armed);
    EXPECT_EQ(y.statusword() & 0x6F, 0x07);
    y.run_ms(400);
    EXPECT_FALSE(y.loop.hal.armed);
    EXPECT_EQ(y.statusword() & 0x4F, 0x40);
    EXPECT_EQ(y.fault(), DRIVE_FAULT_NONE);
}

TEST(BusProfile, ShowsWhatThePlantDoes)
{
    Running x;
    const auto speed = int32_t(x.get(0x606C));
    EXPECT_NEAR(speed, 30000, 1000);
    EXPECT_EQ(x.statusword() & 0x4637, 0x4637); // enabled, voltage, remote, reached, following
    EXPECT_NEAR(double(x.get(0x6079)), 300000, 5000);
    EXPECT_EQ(x.get(0x6061) & 0xFF, 3U);
    EXPECT_EQ(x.get(0x6075), uint32_t(defaults().i_rated));
    EXPECT_NEAR(double(x.get(0x6076)), 1.5 * 3 * 0.236 * 4000, 10);
}

TEST(BusProfile, TorqueModeGivesThePermilleOfTheRatedTorque)
{
    Bench x;
    drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    ASSERT_EQ(x.set(0x6071, 0, 100), 0U);
    x.give(0, {1, 0});
    for (const uint16_t word : {uint16_t(0x06), uint16_t(0x07), uint16_t(0x0F)}) {
        x.control(word, 4, 0);
    }
    x.run_ms(10);
    EXPECT_EQ(x.loop.app.drive.command.mode, DRIVE_MODE_TORQUE);
    EXPECT_NEAR(x.loop.app.drive.command.torque_uNm, 0.1e6 * 1.5 * 3 * 0.236 * 4, 100);
}

// By process data of its own, and by SDO; what it makes of the link: tests/unit/drive/block_duty_test.cpp.
TEST(BusProfile, DutyModeGivesTheShareOfTheLink)
{
    Bench x;
    drive_params_t params = defaults();
    params.commutation = 1;
    plant_sensor(x.plant())->v_leg_full_scale_V = 450;
    x.boot(&params);
    x.run_ms(5);
    ASSERT_EQ(x.set(0x1602, 0, 0), 0U);
    ASSERT_EQ(x.set(0x1602, 1, 0x60400010), 0U);
    ASSERT_EQ(x.set(0x1602, 2, 0x28000210), 0U);
    ASSERT_EQ(x.set(0x1602, 0, 2), 0U);
    ASSERT_EQ(x.set(0x1402, 1, 0x401), 0U);
    x.give(0, {1, 0});
    for (const uint16_t word : {uint16_t(0x06), uint16_t(0x07), uint16_t(0x0F)}) {
        x.control(word, -3, 0);
    }
    x.run_ms(10);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
    EXPECT_EQ(x.get(0x6061) & 0xFF, 0xFDU);
    EXPECT_EQ(x.loop.app.drive.command.mode, DRIVE_MODE_DUTY);
    EXPECT_TRUE(x.loop.app.drive.command.enable);
    x.give(0x401, {0x0F, 0x00, 0x0C, 0xFE}); // -500
    x.run_ms(5);
    EXPECT_EQ(x.loop.app.drive.command.duty_ppm, -50000);
    EXPECT_NEAR(x.loop.app.drive.duty_target / double(PM_ONE), -0.05, 1e-7);
    ASSERT_EQ(x.set(0x2800, 2, 10000), 0U);
    EXPECT_EQ(x.set(0x2800, 2, 10001), TOO_HIGH);
    x.run_ms(5);
    EXPECT_EQ(x.loop.app.drive.command.duty_ppm, 1000000);
    x.control(0x10F, -3, 0); // halt
    x.run_ms(5);
    EXPECT_EQ(x.loop.app.drive.command.duty_ppm, 0);
    EXPECT_EQ(x.loop.app.drive.fault, DRIVE_FAULT_NONE);
}

TEST(BusProfile, DutyModeOfFieldOrientationSaysWhyItDoesNotStart)
{
    Bench x;
    drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
    x.give(0, {1, 0});
    for (const uint16_t word : {uint16_t(0x06), uint16_t(0x07), uint16_t(0x0F)}) {
        x.control(word, -3, 0);
    }
    x.run_ms(10);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_MODE));
    EXPECT_EQ(x.statusword() & 0x6F, 0x40); // switch on disabled
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_OFF);
    x.send(true);
    x.run_ms(10);
    EXPECT_EQ(x.get(0x2010, 3) & 0xFF, uint32_t(APP_READY));
    EXPECT_EQ(x.statusword() & 0x6F, 0x27);
}

// Four signals, every period, by block upload
TEST(BusTrace, RecordsTheStart)
{
    Running x;
    const uint32_t objects[] = {0x29000600, 0x29000700, 0x29000A00, 0x606C0000};
    for (uint8_t n = 0; n < 4; ++n) {
        ASSERT_EQ(x.set(0x3101, uint8_t(n + 1), objects[n]), 0U) << int(n);
    }
    EXPECT_EQ(x.set(0x3101, 5, 0x60410000), 0x06040041U);
    ASSERT_EQ(x.set(0x3100, 1, 1), 0U);
    std::vector<std::vector<int32_t>> truth;
    const uint32_t first = x.loop.app.drive.period;
    while (x.loop.app.trace.state != TRACE_COMPLETE && truth.size() < 3000) {
        sim_loop_step(&x.loop);
        const drive_t &d = x.loop.app.drive;
        truth.push_back(
            {d.i_abc.b >> 14, d.i_abc.c >> 14, int32_t(d.status.theta) >> 16, d.position.pll.omega >> 14});
        if (truth.size() % 1000 == 0) {
            x.control(0x0F);
        }
    }
    EXPECT_GT(x.loop.app.drive.period, first);
    const size_t samples = APP_TRACE_NUMBERS / 4;
    ASSERT_GE(truth.size(), samples - 24); // the first were taken while the answer was waited for
    ASSERT_EQ(x.get(0x3100, 2) & 0xFF, uint32_t(TRACE_COMPLETE));
    ASSERT_EQ(x.get(0x3100, 8), samples);
    // scale: two times the base
    EXPECT_EQ(int32_t(x.get(0x3102, 1)), 2 * defaults().i_full_scale);
    EXPECT_NEAR(double(x.get(0x3102, 4)), 2.0 * defaults().speed_trip, 2);

    x.take(0);
    x.give(0x601, {0xA4, 0x03, 0x31, 0, 127, 0, 0, 0});
    x.run_ms(1);
    ASSERT_EQ(x.take(0x581).size(), 1U);
    x.give(0x601, {0xA3, 0, 0, 0, 0, 0, 0, 0});
    std::vector<uint8_t> bytes;
    uint32_t steps = 0;
    for (bool end = false; !end && steps < 10000; ++steps) {
        app_turn(&x.loop.app);
        for (const hal_can_frame_t &frame : x.take(0x581)) {
            const int sequence = frame.data[0] & 0x7F;
            end = (frame.data[0] & 0x80) != 0;
            bytes.insert(bytes.end(), frame.data + 1, frame.data + 8);
            if (sequence == 127 || end) {
                x.give(0x601, {0xA2, uint8_t(sequence), 127, 0, 0, 0, 0, 0});
            }
        }
    }
    ASSERT_GE(bytes.size(), 2 * APP_TRACE_NUMBERS);
    size_t wrong = 0;
    for (size_t n = 4 * (samples - std::min(samples, truth.size())); n < APP_TRACE_NUMBERS; ++n) {
        const auto value = int16_t(bytes[2 * n] | bytes[2 * n + 1] << 8);
        const size_t sample = truth.size() - samples + n / 4;
        wrong += value != truth[sample][n % 4] ? 1 : 0;
    }
    EXPECT_EQ(wrong, 0U);
}

} // namespace
