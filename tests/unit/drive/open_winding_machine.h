// OW-400 as sim_plant/machines/ow_400.yaml has it, its drive and the bases of that.
#pragma once

#include <gtest/gtest.h>

#include "tests/unit/drive/direct.h"
#include "tools/pmsim/machine_file.h"

namespace ow
{

// 60 V, 10 A, 72 rad/s at five pole pairs, 10 kHz; 36 V of the link.
constexpr double kV = 60, kA = 10, kOmega = 360, kT_s = 1e-4, kLink = 36 / kV;
constexpr double kPsi_3_Wb = 3e-3;

inline pmsim::Setup setup()
{
    pmsim::Setup setup = pmsim::load_machine_file("sim_plant/machines/ow_400.yaml");
    pmsim::derive_board_parameters(setup);
    setup.params->t_align = 300; // nothing has to come to rest here
    return setup;
}

inline drive_params_t params()
{
    static const drive_params_t p = *setup().params;
    return p;
}

inline drive_config_t configured(const drive_params_t &p)
{
    drive_config_t config = {};
    const drive_result_t result = drive_configure(&config, &p, PM_CHANNELS);
    EXPECT_TRUE(result.ok) << result.reason << ' ' << result.param;
    return config;
}

} // namespace ow
