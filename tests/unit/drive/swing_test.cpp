// A light rotor on an imposed vector, whose yielding damps its swings (firmware/drive/open_loop.c), on the plant of a motor with 21 pole
// pairs. Twin of tests/scenario/open_loop_swing.yaml: the low-pass that much saliency needs, which no parameter gives this motor.
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/drive/drive_parts.h"
#include "hal/sim/sim_loop.h"
#include "tools/pmsim/machine_file.h"

namespace
{

constexpr double kAlign_s = 0.6;
// Electrical speed in the last 0.1 s of the align, of the largest in a swing of a quarter turn.
constexpr double kStill = 0.02, kSwings = 0.3;

double swing_left(double J_kgm2, int k_yield)
{
    pmsim::Setup setup = pmsim::load_machine_file("sim_plant/machines/tmotor_u8ii_kv100.yaml");
    setup.plant.mech.J_kgm2 = J_kgm2;
    setup.plant.mech.T_coulomb_Nm = 0.002;
    pmsim::derive_board_parameters(setup);
    drive_params_t p = *setup.params;
    p.start_method = 2;
    p.t_align = static_cast<int32_t>(kAlign_s * 1e3);
    p.J = static_cast<int32_t>(std::lround(J_kgm2 * 1e9));
    const char *error = nullptr;
    const std::unique_ptr<plant_t, void (*)(plant_t *)> plant(plant_create(&setup.plant, 1.0, &error),
                                                              &plant_destroy);
    EXPECT_NE(plant, nullptr) << error;
    sim_loop_t loop = {};
    const drive_result_t result = sim_loop_init(&loop, plant.get(), &p);
    EXPECT_TRUE(result.ok) << result.reason << ' ' << result.param;
    drive_t &drive = loop.app.drive;
    const double pole_pairs = setup.plant.machine.pole_pairs, psi = setup.plant.machine.psi_m_Wb;
    const double i = drive.config.open_loop.i / double(PM_ONE) * setup.plant.sensor.i_full_scale_A;
    const double swing = std::sqrt(1.5 * pole_pairs * pole_pairs * psi * i / J_kgm2) * std::sqrt(2.0);
    if (k_yield != 0) {
        drive.config.open_loop.k_yield = static_cast<uint16_t>(k_yield);
    }
    drive_command_t c = {};
    c.enable = true;
    c.mode = DRIVE_MODE_SPEED;
    drive_command(&drive, &c);
    std::vector<double> speed; // of the rotor, electrical, until the ramp begins
    while (drive.state != DRIVE_RUNNING && speed.size() < 60000) {
        sim_loop_step(&loop);
        plant_truth_t t;
        plant_truth(plant.get(), &t);
        speed.push_back(std::abs(t.omega_mech_rad_s) * pole_pairs);
    }
    EXPECT_EQ(drive.state, DRIVE_RUNNING);
    const auto last = speed.end() - std::lround(0.1 * setup.plant.inverter.f_pwm_Hz);
    return *std::max_element(last, speed.end()) / swing;
}

TEST(Swing, AVectorThatYieldsAtOnceTakesIt)
{
    for (const double J_kgm2 : {4.8e-5, 2.9e-5}) { // 70 and 90 Hz
        EXPECT_LT(swing_left(J_kgm2, 0), kStill) << J_kgm2;
    }
}

TEST(Swing, TwinWithALowPassOfTwoMillisecondsDrivesIt)
{
    for (const double J_kgm2 : {4.8e-5, 2.9e-5}) {
        EXPECT_GT(swing_left(J_kgm2, 13107), kSwings) << J_kgm2;
    }
}

} // namespace
