// The application on the simulated board: what stands between the user and a bridge that is on.
#include "firmware/app/app_parts.h"
#include "tests/unit/app/bench.h"

#include <cmath>

using app_test::Bench;
using app_test::defaults;

namespace
{

TEST(App, RunsTheMotorOnCommandsOverCan)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    EXPECT_NE(x.console().find("parameters: stored"), std::string::npos);
    x.run_enabled_ms(1000);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
    plant_truth_t t;
    plant_truth(x.plant(), &t);
    EXPECT_NEAR(t.omega_mech_rad_s, 30, 1);
    x.send(false);
    x.run_ms(1000);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_OFF);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
}

TEST(App, WithoutStoredParametersNothingIsArmed)
{
    Bench x;
    x.boot(nullptr);
    EXPECT_NE(x.console().find("none stored"), std::string::npos);
    x.run_enabled_ms(300);
    EXPECT_FALSE(x.loop.hal.armed);
    x.send(false, true);
    x.run_ms(10);
    x.run_enabled_ms(300); // no way around it
    EXPECT_FALSE(x.loop.hal.armed);
}

TEST(App, RefusesParametersThatTheDriveRefuses)
{
    Bench x;
    drive_params_t params = defaults();
    params.R_s = -1;
    x.boot(&params);
    EXPECT_NE(x.console().find("refused: R_s"), std::string::npos);
    x.run_enabled_ms(200);
    EXPECT_FALSE(x.loop.hal.armed);
}

TEST(App, RefusesACarrierThatTheTimerDoesNotMake)
{
    Bench x;
    drive_params_t params = defaults();
    params.timer_counts = 8000; // at 10 kHz of a 170 MHz timer it is 8500
    x.boot(&params);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_PARAMETERS);
    x.run_enabled_ms(200);
    EXPECT_FALSE(x.loop.hal.armed);
}

TEST(App, EveryLineOfTheConsoleEnds)
{
    Bench x;
    const drive_params_t p = defaults();
    x.boot(&p);
    x.run_ms(20);
    const std::string started = x.console();
    ASSERT_GT(started.size(), 2U);
    EXPECT_EQ(started.substr(started.size() - 2), "\r\n");
    size_t ends = 0;
    for (size_t at = started.find("\r\n"); at != std::string::npos; at = started.find("\r\n", at + 2)) {
        ++ends;
    }
    EXPECT_GE(ends, 2U);
    EXPECT_EQ(std::count(started.begin(), started.end(), '\n'), static_cast<long>(ends));
    drive_trip(&x.loop.app.drive, DRIVE_FAULT_STALL);
    x.run_ms(20);
    const std::string line = std::string("fault: ") + drive_fault_text(DRIVE_FAULT_STALL) + "\r\n";
    EXPECT_NE(x.console().find(line), std::string::npos);
}

TEST(App, StoresToThePageThatIsOlder)
{
    Bench x;
    drive_params_t params = defaults();
    for (int32_t round = 0; round < 5; ++round) {
        params.i_max = 1000 + round;
        ASSERT_TRUE(app_save(&x.loop.hal, &params));
        drive_params_t back;
        uint32_t unknown;
        ASSERT_TRUE(app_load(&x.loop.hal, &back, &unknown));
        EXPECT_EQ(std::memcmp(&back, &params, sizeof params), 0);
        EXPECT_EQ(unknown, 0U);
    }
}

// Power lost at every byte of the writing: the parameters before still hold.
TEST(App, PowerLostInMidWriteKeepsTheOldParameters)
{
    const drive_params_t old = defaults();
    drive_params_t wanted = old;
    wanted.i_max = 1234;
    const uint32_t bytes = 4 * (4 + 2 * Bench::stored_parameters() + 2);
    for (uint32_t cut = 0; cut < bytes; ++cut) {
        Bench x;
        ASSERT_TRUE(app_save(&x.loop.hal, &old));
        x.loop.hal.store_bytes_left = cut;
        EXPECT_FALSE(app_save(&x.loop.hal, &wanted)) << cut;
        drive_params_t back;
        uint32_t unknown;
        ASSERT_TRUE(app_load(&x.loop.hal, &back, &unknown)) << cut;
        EXPECT_EQ(back.i_max, old.i_max) << cut;
    }
}

// What the converters see is the board's to say, whatever was stored; without parameters its presets fit it.
TEST(App, ScalesAreThoseOfTheBoard)
{
    Bench x;
    x.loop.hal.board.i_full_scale_mA = 60150;
    x.loop.hal.board.v_full_scale_mV = 45000;
    x.boot(nullptr);
    EXPECT_EQ(x.loop.app.params.i_full_scale, 60150);
    EXPECT_EQ(x.loop.app.params.v_full_scale, 45000);
    EXPECT_EQ(x.loop.app.params.v_dc_nominal, 30000);
    EXPECT_EQ(x.loop.app.params.v_dc_max, 40000);
    EXPECT_FALSE(x.loop.app.refused) << drive_param_table[x.loop.app.refused_param].name;
    drive_params_t stored = x.loop.app.params;
    stored.i_full_scale = 1000;
    stored.v_dc_nominal = 24000;
    x.boot(&stored);
    EXPECT_EQ(x.loop.app.params.i_full_scale, 60150);
    EXPECT_EQ(x.loop.app.params.v_dc_nominal, 24000);
    (void)app_configure(&x.loop.app, &x.loop.hal, &stored, true); // told 1 A, by whom it be
    EXPECT_EQ(x.loop.app.params.i_full_scale, 60150);
}

// Each of them, in the place that is its own; what a board does not know leaves the preset.
TEST(App, WhatTheBoardSaysIsInItsParameters)
{
    Bench x;
    x.loop.hal.board = {60150, 45000, 3000, 9143, 10389, 40000, 32000, 25000, 7000, 310, 4100, 39000};
    drive_params_t p;
    drive_params_default(&p);
    const int32_t R_s = p.R_s;
    app_take_board(&x.loop.hal, &p);
    EXPECT_EQ(p.i_full_scale, 60150);
    EXPECT_EQ(p.v_full_scale, 45000);
    EXPECT_EQ(p.shunt, 3000);
    EXPECT_EQ(p.current_gain, 9143);
    EXPECT_EQ(p.voltage_divider, 10389);
    EXPECT_EQ(p.i_limit, 40000);
    EXPECT_EQ(p.v_limit, 32000);
    EXPECT_EQ(p.i_bridge, 25000);
    EXPECT_EQ(p.t_bridge, 7000);
    EXPECT_EQ(p.dead_time_least, 310);
    EXPECT_EQ(p.f_pwm_least, 4100);
    EXPECT_EQ(p.f_pwm_most, 39000);
    EXPECT_EQ(p.R_s, R_s);
    x.loop.hal.board = {};
    drive_params_default(&p);
    drive_params_t q = p;
    app_take_board(&x.loop.hal, &q);
    EXPECT_EQ(std::memcmp(&p, &q, sizeof p), 0);
}

TEST(App, NamesOfAnotherVersionAreLeftOut)
{
    Bench x;
    const od_entry_t *i_max = Bench::entry_of(DRIVE_PARAM_i_max);
    const store_pair_t pairs[] = {{i_max->index * 256U + i_max->sub, 2500}, {0x2FFF01, 5}, {0x01203001, 7}};
    uint32_t *page = x.loop.hal.store[0];
    store_writer_t writer;
    store_begin(&writer, 1, od_schema + 1, 3, page);
    for (const store_pair_t &pair : pairs) {
        page += 2;
        store_put(&writer, pair, page + 2);
    }
    store_end(&writer, page + 4);
    drive_params_t back;
    uint32_t unknown;
    EXPECT_FALSE(app_load(&x.loop.hal, &back, &unknown)); // the machine is not among them
    EXPECT_EQ(unknown, 2U);
    EXPECT_EQ(back.i_max, 2500);
    EXPECT_EQ(back.R_s, defaults().R_s);
    x.boot(nullptr);
    EXPECT_NE(x.console().find("of another version, left out: 0x00000002"), std::string::npos) << x.console();
    Bench usual;
    const drive_params_t params = defaults();
    usual.boot(&params);
    EXPECT_EQ(usual.console().find("left out"), std::string::npos);
}

TEST(App, CommandsThatCeaseAreAFault)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    ASSERT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
    x.run_ms(505);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_REMOTE_LOST);
    EXPECT_FALSE(x.loop.hal.armed);
    x.run_enabled_ms(300); // does not start by itself
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.get(0x603F), 0x8250U);
    x.send(false, true);
    x.run_ms(5);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
}

TEST(App, BusOffIsAFault)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    x.loop.hal.can_state = HAL_CAN_BUS_OFF;
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_REMOTE_LOST);
    EXPECT_FALSE(x.loop.hal.armed);
}

// One that ends before control has seen it, between two rounds of the main loop
TEST(App, ABreakIsNotArmedAgainBeforeControlHasReportedIt)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    ASSERT_TRUE(x.loop.hal.armed);
    sim_break(&x.loop.hal);
    x.loop.hal.time_us += 1000; // a round is due
    app_turn(&x.loop.app);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_HARDWARE);
    x.run_enabled_ms(100);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_HARDWARE);
}

// However the outputs were lost, also without a flag of the port
TEST(App, LostOutputsAreAFaultAndNotArmedAgain)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    hal_bridge_off(&x.loop.hal);
    x.run_ms(2);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_HARDWARE);
    x.send(false, false);
    x.run_ms(1);
    x.send(false, true);
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.run_enabled_ms(600);
    EXPECT_TRUE(x.loop.hal.armed);
}

// Fault, its reset and the next start between two rounds of the main loop
TEST(App, AResetAndAStartInOneRoundArm)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    sim_break(&x.loop.hal);
    plant_sample(x.loop.hal.plant, &x.loop.hal.adc);
    app_control(&x.loop.app);
    app_control(&x.loop.app); // which sees no break any more
    x.control(0x00);
    x.control(0x80);
    x.send(true);
    EXPECT_TRUE(app_bus_take(&x.loop.app));
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    app_slow(&x.loop.app);
    x.run_enabled_ms(600);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    EXPECT_TRUE(x.loop.hal.armed);
}

TEST(App, BreakInputAndItsClearing)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    x.loop.hal.hw_fault = true;
    x.run_ms(1);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_HARDWARE);
    EXPECT_FALSE(x.loop.hal.armed);
    x.send(false, true);
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_HARDWARE); // the cause is still there
    x.loop.hal.hw_fault = false;
    x.send(false, false);
    x.run_ms(1);
    x.send(false, true);
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
}

plant_break_t comparators(double level_A)
{
    plant_break_t levels{};
    for (int leg = 0; leg < 3; ++leg) {
        levels.above_A[leg] = level_A;
        levels.below_A[leg] = level_A;
    }
    return levels;
}

// Between two runs of the firmware: what it learns afterwards has happened already.
TEST(App, OverCurrentComparatorsSwitchTheBridgeOffBeforeTheFirmwareReacts)
{
    const double level_A = 3.0; // the firmware's own limit is 9 A
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    const plant_break_t levels = comparators(level_A);
    plant_set_break(x.plant(), &levels);
    plant_set_load(x.plant(), 4.0); // rated: more current than that
    double largest_A = 0.0, step_A = 0.0;
    plant_truth_t t, before{};
    for (int period = 0; period < 3000 && x.fault() == DRIVE_FAULT_NONE; ++period) {
        plant_truth(x.plant(), &t);
        sim_loop_step(&x.loop);
        before = t;
        plant_truth(x.plant(), &t);
        for (int leg = 0; leg < 3; ++leg) {
            largest_A = std::max(largest_A, std::fabs(t.i_A[leg]));
            step_A = std::max(step_A, std::fabs(t.i_A[leg] - before.i_A[leg]));
        }
    }
    EXPECT_EQ(x.fault(), DRIVE_FAULT_HARDWARE);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_LE(largest_A, level_A * (1.0 + 1e-3)); // not a period's change further
    EXPECT_GT(largest_A, level_A - step_A);
    x.run_ms(20);
    plant_truth(x.plant(), &t);
    EXPECT_EQ(t.i_A[0], 0.0);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_HARDWARE);
    plant_set_load(x.plant(), 0.0);
    x.send(false, true);
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
}

TEST(App, ComparatorsThatNothingReachesChangeNothing)
{
    Bench with, without;
    const drive_params_t params = defaults();
    const plant_break_t levels = comparators(9.9);
    for (Bench *x : {&with, &without}) {
        x->boot(&params);
        plant_set_break(x->plant(), x == &with ? &levels : nullptr);
        x->run_enabled_ms(600);
        EXPECT_EQ(x->fault(), DRIVE_FAULT_NONE);
    }
    plant_truth_t a, b;
    plant_truth(with.plant(), &a);
    plant_truth(without.plant(), &b);
    EXPECT_NEAR(a.omega_mech_rad_s, b.omega_mech_rad_s, 1e-3);
}

// A rig that commands the drive itself is not overruled by a bus on which nobody speaks.
TEST(App, WithoutAMasterTheDriveIsLeftAlone)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    drive_command_t command = {};
    command.enable = true;
    command.mode = DRIVE_MODE_SPEED;
    command.speed_mrad_s = 30000;
    drive_command(&x.loop.app.drive, &command);
    x.run_ms(700);
    EXPECT_EQ(std::memcmp(&x.loop.app.drive.command, &command, sizeof command), 0);
    EXPECT_EQ(x.loop.app.drive.state, DRIVE_RUNNING);
}

TEST(App, MissingTemperatureSensorIsAFault)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    x.loop.hal.temperature_missing = true;
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_TEMPERATURE_SENSOR);
    EXPECT_FALSE(x.loop.hal.armed);
}

TEST(App, AReferenceThatIsOffIsAFault)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    x.loop.hal.reference_off = true;
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_SENSOR_REFERENCE);
    EXPECT_FALSE(x.loop.hal.armed);
}

TEST(App, SlowThatHasNotEndedIsAnOverrun)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    x.loop.app.slow_busy = true;
    x.loop.app.slow_at = x.loop.app.drive.period; // as the period has left it that pended the slow interrupt
    app_control(&x.loop.app);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OVERRUN);
}

// What is pended is busy until its end.
TEST(App, SlowThatHasNotBegunIsAnOverrun)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    for (uint32_t k = 0; k < 2 * x.loop.app.slow_divider + 2; ++k) {
        app_control(&x.loop.app);
    }
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OVERRUN);
}

// On a processor whose flash is busy, control comes again before the slow interrupt has got anywhere.
TEST(App, SlowRestsWhileFlashIsWritten)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(10);
    x.loop.hal.while_storing = app_control;
    x.loop.hal.temperature_dC = 612;
    EXPECT_EQ(x.set(0x1010, 1, 0x65766173), 0U);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.run_ms(2);
    EXPECT_EQ(x.loop.app.slow.temperature_dC, 612);
    EXPECT_LE(x.loop.app.slow_at - x.loop.app.drive.period, x.loop.app.slow_divider);
}

// The monitor is no later than before when the erase begins, and comes first when it ends.
TEST(App, ControlThatWaitsForFlashHasNotCeased)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(10);
    x.loop.hal.while_storing = app_monitor;
    app_monitor(&x.loop.app);
    EXPECT_EQ(x.set(0x1010, 1, 0x65766173), 0U);
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    app_monitor(&x.loop.app);
    app_monitor(&x.loop.app); // from then on it must come again
    app_turn(&x.loop.app);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OVERRUN);
}

// The converters hang, so control does not come: the monitor opens the bridge and lets the dog bite.
TEST(App, MonitorOpensTheBridgeWhenControlCeases)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_enabled_ms(600);
    ASSERT_TRUE(x.loop.hal.armed);
    app_monitor(&x.loop.app);
    const uint32_t fed = x.loop.hal.watchdog_fed;
    app_monitor(&x.loop.app);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.loop.hal.watchdog_fed, fed);
    app_turn(&x.loop.app);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OVERRUN);
}

// The main loop has a round each 250 us, and at once when there is something to do.
TEST(App, RoundsAreSpaced)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    app_t &app = x.loop.app;
    hal_t &hal = x.loop.hal;
    const auto has_round = [&](uint32_t after_us) {
        hal.time_us += after_us;
        app_turn(&app);
        return app.round_us == hal.time_us;
    };
    ASSERT_TRUE(has_round(1000));
    EXPECT_FALSE(has_round(249)); // nothing to do
    EXPECT_TRUE(has_round(1));
    x.give(0x201, {0x07, 0, 3, 0, 0, 0, 0});
    EXPECT_TRUE(has_round(1)); // a frame
    EXPECT_FALSE(has_round(1));
    app.seen_state = DRIVE_RUNNING;
    EXPECT_TRUE(has_round(1)); // another state than was seen
    EXPECT_FALSE(has_round(1));
    app.shown_fault = DRIVE_FAULT_STALL;
    EXPECT_TRUE(has_round(1)); // another fault than was told
    EXPECT_FALSE(has_round(1));
    EXPECT_TRUE(has_round(250));
}

// The profile, the bridge or the drive: each of them is enough.
TEST(App, IsOnWhileAnyOfItIs)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(5);
    app_t &app = x.loop.app;
    EXPECT_FALSE(app_is_on(&app));
    x.loop.hal.armed = true;
    EXPECT_TRUE(app_is_on(&app));
    x.loop.hal.armed = false;
    for (const drive_state_t state : {DRIVE_CALIBRATING, DRIVE_FINDING, DRIVE_RUNNING, DRIVE_STOPPING}) {
        app.drive.state = state;
        EXPECT_TRUE(app_is_on(&app)) << state;
    }
    for (const drive_state_t state : {DRIVE_OFF, DRIVE_FAULT}) {
        app.drive.state = state;
        EXPECT_FALSE(app_is_on(&app)) << state;
    }
    app.cia402.state = CIA402_OPERATION_ENABLED;
    EXPECT_TRUE(app_is_on(&app));
}

TEST(App, WatchdogIsNotFedWhenTheMainLoopHangs)
{
    Bench x;
    const drive_params_t params = defaults();
    x.boot(&params);
    x.run_ms(10);
    for (int ms = 0; ms < 99; ++ms) {
        x.loop.app.drive.period++;
        app_monitor(&x.loop.app);
    }
    const uint32_t fed = x.loop.hal.watchdog_fed;
    x.loop.app.drive.period++;
    app_monitor(&x.loop.app);
    EXPECT_EQ(x.loop.hal.watchdog_fed, fed);
    app_turn(&x.loop.app);
    x.loop.app.drive.period++;
    app_monitor(&x.loop.app);
    EXPECT_EQ(x.loop.hal.watchdog_fed, fed + 1);
}

} // namespace
