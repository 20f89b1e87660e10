// Plants that tests of several modules share: machines of METHODS.md 14 on the inverter of 0.3, with its dead
// time, drops, link and converter.
#ifndef TESTS_SUPPORT_PLANTS_H
#define TESTS_SUPPORT_PLANTS_H

#include "sim_plant/plant.h"

namespace plants
{

inline plant_config_t ipm_1000()
{
    plant_config_t c = {};
    c.machine = {6.0, 46.3e-3, 76.9e-3, 105.0, 0.236, 3};
    c.mech.J_kgm2 = 0.01;
    c.mech.B_Nms = 1e-3;
    c.inverter.f_pwm_Hz = 10e3;
    c.inverter.dead_time_s = 2e-6;
    c.inverter.v_switch_V = 1.0;
    c.inverter.v_diode_V = 1.0;
    c.inverter.timer_counts = 8500;
    c.dclink.v_source_V = 300.0;
    c.dclink.r_source_ohm = 0.2;
    c.dclink.c_F = 470e-6;
    c.sensor.bits = 12;
    c.sensor.i_full_scale_A = 10;
    c.sensor.v_full_scale_V = 450;
    c.sensor.noise_lsb = 0.5;
    c.sensor.seed = 1;
    return c;
}

inline plant_config_t spm_400()
{
    plant_config_t c = ipm_1000();
    c.machine = {0.373, 3.385e-3, 3.385e-3, 2.09e5, 77.6e-3, 5};
    c.inverter.dead_time_s = 1e-6;
    c.inverter.v_switch_V = 0.0;
    c.inverter.v_diode_V = 0.0;
    c.inverter.r_on_ohm = 0.01;
    c.dclink.v_source_V = 36.0;
    c.dclink.r_source_ohm = 0.05;
    c.dclink.c_F = 2.2e-3;
    c.sensor.v_full_scale_V = 60;
    return c;
}

} // namespace plants

#endif
