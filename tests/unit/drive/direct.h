// The drive by itself: converter codes in, no motor. What it sees is what a test says.
#pragma once

#include <cmath>
#include <cstdint>

#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"

namespace direct
{

constexpr pm_pll_t kAtRest = {0, 0};

inline uint16_t current_code(double i_pu)
{
    return static_cast<uint16_t>(std::lround(32768 * (1 + i_pu)));
}

inline uint16_t voltage_code(double v_V)
{
    return static_cast<uint16_t>(std::lround(v_V / 450 * 65536));
}

inline drive_params_t params(int32_t start_method = 0)
{
    drive_params_t p;
    drive_params_default(&p);
    p.start_method = start_method;
    return p;
}

// SPM-400 in place of the preset's IPM-1000, as sim_plant/machines/spm_400.yaml.
inline void make_spm(drive_params_t &p)
{
    p.pole_pairs = 5;
    p.R_s = 383000;
    p.L_d = 3000000;
    p.L_q = 3300000;
    p.psi_m = 77600000;
    p.L_q_rated = 3296600;
    p.L_dh_rated = 2994300;
    p.L_qh_rated = 3288000;
    p.L_dqh_rated = -51600;
    p.cross_half = -7770;
    p.leg_capacitance = 2000;
    p.dead_time = 1000;
    p.device_drop = 0;
    p.v_dc_nominal = 36000;
    p.v_full_scale = 60000;
    p.v_dc_max = 50000;
    p.v_dc_derate = 45000;
    p.v_dc_min = 20000;
    p.speed_max = 60000;
    p.speed_trip = 72000;
    p.speed_low = 4200;
    p.speed_high = 8400;
}

struct Drive {
    drive_t d = {};
    drive_in_t in = {};
    drive_out_t out = {};
    drive_slow_in_t slow = {250};
    drive_command_t command = {};

    explicit Drive(const drive_params_t &p = params())
    {
        drive_init(&d, &p, PM_CHANNELS);
        for (uint16_t &leg : in.i_leg) {
            leg = current_code(0);
        }
        in.v_dc = voltage_code(300);
    }

    void step()
    {
        out.trip = 7; // what the port finds is of this period
        drive_step(&d, &in, &out);
        EXPECT_LE(out.trip, 1U);
    }

    void run_ms(int ms)
    {
        for (int k = 0; k < ms; ++k) {
            for (int n = 0; n < 10; ++n) {
                step();
            }
            drive_slow(&d, &slow);
        }
    }

    void enable(bool on, drive_mode_t mode = DRIVE_MODE_SPEED)
    {
        command.enable = on;
        command.mode = mode;
        drive_command(&d, &command);
    }

    drive_state_t state() const
    {
        return drive_status(&d)->state;
    }

    drive_fault_t fault() const
    {
        return drive_status(&d)->fault;
    }

    bool driven() const
    {
        return out.legs != PM_LEGS_OFF;
    }

    // Current mode needs no motor: calibration and align, then it runs.
    void start_current_mode(int32_t current_mA = 1000)
    {
        command.current_mA = current_mA;
        enable(true, DRIVE_MODE_CURRENT);
        run_ms(110 + 310 + 10);
    }
};

} // namespace direct
