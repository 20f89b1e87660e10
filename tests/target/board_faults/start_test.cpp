// A start whose upper switches are supplied by bootstrap capacitors, which are empty.
#include "bench.h"

namespace
{

using bench::Bench;

constexpr double target_rad_s = 20.0;

plant_config_t with_bootstrap()
{
    plant_config_t config = bench::plant_config();
    config.mech.locked = false;
    config.inverter.bootstrap_charge_s = 125e-6; // 1 uF at the 125 ohm of an L6387E
    config.inverter.bootstrap_hold_s = 50e-3;
    config.inverter.bootstrap_lockout = 0.7;
    return config;
}

struct Start {
    drive_fault_t fault = DRIVE_FAULT_NONE;
    double omega_rad_s = 0.0;
};

// With the charge or, by what it is configured to, without.
Start started(bool charge)
{
    Bench b(with_bootstrap());
    b.store(0, bench::params(), 1);
    b.boot();
    b.run_ms(5);
    auto *config =
        &static_cast<image_memory_t *>(board_variable(b.board, "app_instance", sizeof(image_memory_t)))
             ->drive.config;
    EXPECT_EQ(config->charge_periods, 20);
    config->charge_periods = charge ? config->charge_periods : 0;
    for (int n = 0; n < 4; n++) {
        b.command(true, DRIVE_MODE_SPEED, static_cast<int32_t>(1000 * target_rad_s));
        b.run_ms(200);
    }
    return {b.watched()->drive.fault, b.truth().omega_mech_rad_s};
}

TEST(BoardStart, TheUpperSwitchesAreChargedBeforeTheFirstPulse)
{
    const Start s = started(true);
    EXPECT_EQ(s.fault, DRIVE_FAULT_NONE);
    EXPECT_NEAR(s.omega_rad_s, target_rad_s, 0.05 * target_rad_s);
}

// No upper switch closes, so no current flows.
TEST(BoardStart, WithoutTheChargeTheMotorDoesNotStart)
{
    const Start s = started(false);
    EXPECT_EQ(s.fault, DRIVE_FAULT_OPEN_PHASE);
    EXPECT_NEAR(s.omega_rad_s, 0.0, 0.1);
}

// The bridge has been off for longer than the capacitors last.
TEST(BoardStart, EachStartChargesAnew)
{
    Bench b(with_bootstrap());
    b.store(0, bench::params(), 1);
    b.boot();
    b.run_ms(5);
    for (int start = 0; start < 3; start++) {
        for (int n = 0; n < 4; n++) {
            b.command(true, DRIVE_MODE_SPEED, static_cast<int32_t>(1000 * target_rad_s));
            b.run_ms(200);
        }
        EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_NONE) << start;
        EXPECT_NEAR(b.truth().omega_mech_rad_s, target_rad_s, 0.05 * target_rad_s) << start;
        b.command(false, DRIVE_MODE_SPEED);
        b.run_ms(400);
        EXPECT_FALSE(b.bridge_on());
    }
}

} // namespace
