#include "tools/pmsim/setup_fields.h"

namespace pmsim
{
namespace
{

#define PM_FIELD(section, key, min, max, need, member)                                                       \
    {                                                                                                        \
        section, key, min, max, Need::need, [](Setup &s) -> Target { return &s.member; }                     \
    }
#define PM_LIST(section, key, min, max, per, member)                                                         \
    {                                                                                                        \
        section, key, min, max, Need::optional, [](Setup &s) -> Target { return List{s.member, Per::per}; }  \
    }
#define PM_HARMONICS(section, key, amplitude, min_order, max, member)                                        \
    {                                                                                                        \
        section, key, -(max), max, Need::optional, [](Setup &s) -> Target {                                  \
            return Harmonics{s.member, int(sizeof s.member / sizeof s.member[0]), min_order, amplitude};     \
        }                                                                                                    \
    }

} // namespace

// Limits reject slips of the decimal point, not unusual machines. What a list is long for is read first.
const std::vector<Field> &setup_fields()
{
    static const std::vector<Field> fields = {
        PM_FIELD("winding", "sets", 1, PLANT_SETS, optional, plant.winding.sets),
        PM_FIELD("winding", "connection", 0, 0, optional, plant.winding.connection),
        PM_FIELD("winding", "M_d_H", -10, 10, optional, plant.winding.M_d_H),
        PM_FIELD("winding", "M_q_H", -10, 10, optional, plant.winding.M_q_H),
        PM_FIELD("winding", "L_0_H", 0, 10, optional, plant.winding.L_0_H),
        PM_FIELD("winding", "dL_0_H", -10, 10, optional, plant.winding.dL_0_H),
        PM_FIELD("winding", "L_c0_H", -10, 10, optional, plant.winding.L_c0_H),
        PM_FIELD("winding", "dL_0_d_1_A", -1e3, 1e3, optional, plant.winding.dL_0_d_1_A),
        PM_FIELD("winding", "dL_0_q_1_A2", -1e6, 1e6, optional, plant.winding.dL_0_q_1_A2),
        PM_FIELD("winding", "L_c0_q_H_A", -10, 10, optional, plant.winding.L_c0_q_H_A),
        PM_HARMONICS("winding", "emf", "psi_Wb", 2, 10.0, plant.winding.emf),
        PM_FIELD("winding", "trapezoid_flat_deg", 0, 180, optional, trapezoid_flat_deg),
        PM_HARMONICS("winding", "saliency", "L_H", orders_of_saliency, 10.0, plant.winding.saliency),
        PM_HARMONICS("winding", "zero_saliency", "L_H", orders_of_saliency, 10.0,
                     plant.winding.zero_saliency),
        PM_HARMONICS("winding", "cogging", "T_Nm", 1, 1e4, plant.winding.cogging),
        PM_LIST("winding", "dR_ohm", -1e3, 1e3, phase, plant.winding.dR_ohm),
        PM_LIST("winding", "dL_H", -10, 10, phase, plant.winding.dL_H),
        PM_LIST("winding", "dM_H", -10, 10, pair, plant.winding.dM_H[0]),
        PM_LIST("winding", "emf_gain", -1, 1, phase, plant.winding.emf_gain),
        PM_LIST("winding", "emf_shift_deg", -180, 180, phase, plant.winding.emf_shift_rad),
        PM_FIELD("winding", "L_eddy_d_H", 0, 10, optional, plant.winding.L_eddy_d_H),
        PM_FIELD("winding", "L_eddy_q_H", 0, 10, optional, plant.winding.L_eddy_q_H),
        PM_FIELD("winding", "R_eddy_ohm", 0, 1e6, optional, plant.winding.R_eddy_ohm),
        PM_FIELD("winding", "r_winding_ohm", 0, 1e9, optional, plant.winding.r_winding_ohm),
        PM_FIELD("winding", "alpha_R_1_K", 0, 0.02, optional, plant.winding.alpha_R_1_K),
        PM_FIELD("winding", "alpha_psi_1_K", -0.02, 0.02, optional, plant.winding.alpha_psi_1_K),

        PM_FIELD("electrical", "R_s_ohm", 1e-4, 1e3, always, plant.machine.R_s_ohm),
        PM_FIELD("electrical", "L_d0_H", 1e-7, 10, core, plant.machine.L_d0_H),
        PM_FIELD("electrical", "L_q0_H", 1e-7, 10, core, plant.machine.L_q0_H),
        PM_FIELD("electrical", "c_A_Wb5", 0, 1e18, optional, plant.machine.c_A_Wb5),
        PM_FIELD("electrical", "psi_m_Wb", 1e-5, 10, core, plant.machine.psi_m_Wb),
        PM_FIELD("electrical", "pole_pairs", 1, 50, always, plant.machine.pole_pairs),

        PM_FIELD("mechanics", "J_kgm2", 1e-9, 1e3, always, plant.mech.J_kgm2),
        PM_FIELD("mechanics", "B_Nms", 0, 1e3, optional, plant.mech.B_Nms),
        PM_FIELD("mechanics", "T_coulomb_Nm", 0, 1e4, optional, plant.mech.T_coulomb_Nm),
        PM_FIELD("mechanics", "locked", 0, 1, optional, plant.mech.locked),
        PM_FIELD("mechanics", "J_load_kgm2", 0, 1e3, optional, plant.mech.J_load_kgm2),
        PM_FIELD("mechanics", "k_shaft_Nm", 0, 1e9, optional, plant.mech.k_shaft_Nm),
        PM_FIELD("mechanics", "d_shaft_Nms", 0, 1e6, optional, plant.mech.d_shaft_Nms),
        PM_FIELD("mechanics", "load_Nms", 0, 1e3, optional, plant.mech.load_Nms),
        PM_FIELD("mechanics", "load_Nms2", 0, 1e3, optional, plant.mech.load_Nms2),
        PM_HARMONICS("mechanics", "load_angle", "T_Nm", 1, 1e5, plant.mech.load_angle),

        PM_FIELD("rated", "i_rated_A", 1e-3, 1e4, drive, rated.i_rated_A),
        PM_FIELD("rated", "speed_rated_rad_s", 0.1, 1e5, drive, rated.speed_rated_rad_s),
        PM_FIELD("rated", "torque_rated_Nm", 1e-5, 1e5, drive, rated.torque_rated_Nm),
        PM_FIELD("rated", "v_dc_V", 1, 2000, drive, rated.v_dc_V),

        PM_FIELD("inverter", "f_pwm_Hz", 1000, 200e3, optional, plant.inverter.f_pwm_Hz),
        PM_FIELD("inverter", "dead_time_s", 0, 20e-6, optional, plant.inverter.dead_time_s),
        PM_FIELD("inverter", "v_switch_V", 0, 10, optional, plant.inverter.v_switch_V),
        PM_FIELD("inverter", "v_diode_V", 0, 10, optional, plant.inverter.v_diode_V),
        PM_FIELD("inverter", "r_on_ohm", 0, 100, optional, plant.inverter.r_on_ohm),
        PM_FIELD("inverter", "timer_counts", 100, 65535, optional, plant.inverter.timer_counts),
        PM_FIELD("inverter", "i_break_A", 0, 1e5, optional, i_break_A),
        PM_FIELD("inverter", "turn_on_s", 0, 20e-6, optional, plant.inverter.turn_on_s),
        PM_FIELD("inverter", "turn_off_s", 0, 20e-6, optional, plant.inverter.turn_off_s),
        PM_FIELD("inverter", "bootstrap_charge_s", 0, 1, optional, plant.inverter.bootstrap_charge_s),
        PM_FIELD("inverter", "bootstrap_hold_s", 0, 1e3, optional, plant.inverter.bootstrap_hold_s),
        PM_FIELD("inverter", "bootstrap_lockout", 0, 1, optional, plant.inverter.bootstrap_lockout),
        PM_FIELD("inverter", "c_leg_F", 0, 1e-6, optional, plant.inverter.c_leg_F),

        PM_FIELD("sensor", "bits", 0, 16, optional, plant.sensor.bits),
        PM_FIELD("sensor", "i_full_scale_A", 1e-2, 1e5, optional, plant.sensor.i_full_scale_A),
        PM_FIELD("sensor", "v_full_scale_V", 1, 1e4, optional, plant.sensor.v_full_scale_V),
        PM_FIELD("sensor", "noise_lsb", 0, 100, optional, plant.sensor.noise_lsb),
        PM_LIST("sensor", "gain_error", -1, 1, leg, plant.sensor.gain_error),
        PM_LIST("sensor", "offset_A", -1e5, 1e5, leg, plant.sensor.offset_A),
        PM_FIELD("sensor", "delay_s", -1e-3, 1e-3, optional, plant.sensor.delay_s),
        PM_FIELD("sensor", "shunt", 0, 0, optional, plant.sensor.shunt),
        PM_FIELD("sensor", "settle_s", 0, 100e-6, optional, plant.sensor.settle_s),
        PM_FIELD("sensor", "v_leg_full_scale_V", 0, 1e4, optional, plant.sensor.v_leg_full_scale_V),
        PM_LIST("sensor", "divider_error", -0.5, 0.5, leg, plant.sensor.divider_error),
        PM_LIST("sensor", "neutral_divider_error", -0.5, 0.5, set, plant.sensor.divider_error + PLANT_LEGS),
        PM_FIELD("sensor", "filter_s", 0, 10e-3, optional, plant.sensor.filter_s),
        PM_FIELD("sensor", "hysteresis_V", 0, 1e3, optional, plant.sensor.hysteresis_V),
        PM_FIELD("sensor", "capture_s", 0, 1e-3, optional, plant.sensor.capture_s),
        PM_FIELD("sensor", "comparator_reference", 0, 0, optional, plant.sensor.comparator_reference),
        PM_LIST("sensor", "comparator_offset_V", -1e3, 1e3, leg, plant.sensor.comparator_offset_V),
        PM_FIELD("sensor", "comparator_blanking_s", 0, 100e-6, optional, plant.sensor.comparator_blanking_s),
        PM_FIELD("sensor", "v_dc_offset_V", -1e3, 1e3, optional, plant.sensor.v_dc_offset_V),
        PM_LIST("sensor", "v_leg_offset_V", -1e3, 1e3, leg, plant.sensor.v_offset_V),
        PM_LIST("sensor", "v_neutral_offset_V", -1e3, 1e3, set, plant.sensor.v_offset_V + PLANT_LEGS),
        PM_FIELD("sensor", "i_filter_s", 0, 10e-3, optional, plant.sensor.i_filter_s),
        PM_FIELD("sensor", "v_zero_full_scale_V", 0, 1e4, optional, plant.sensor.v_zero_full_scale_V),
        PM_FIELD("sensor", "v_zero_between", 0, 1, optional, plant.sensor.v_zero_between),
        PM_FIELD("sensor", "v_zero_gain_error", -0.5, 0.5, optional, plant.sensor.v_zero_gain_error),
        PM_FIELD("sensor", "v_zero_offset_V", -1e3, 1e3, optional, plant.sensor.v_zero_offset_V),
        PM_FIELD("sensor", "v_zero_network_ohm", 0, 1e9, optional, plant.sensor.v_zero_network_ohm),
        PM_FIELD("sensor", "v_zero_load_ohm", 0, 1e9, optional, plant.sensor.v_zero_load_ohm),
        PM_LIST("sensor", "v_zero_network_error", -0.5, 0.5, leg, plant.sensor.v_zero_network_error),
        PM_FIELD("sensor", "v_zero_filter_s", 0, 10e-3, optional, plant.sensor.v_zero_filter_s),
        PM_FIELD("sensor", "v_zero_noise_lsb", 0, 100, optional, plant.sensor.v_zero_noise_lsb),
        PM_FIELD("sensor", "v_zero_bits", 0, 16, optional, plant.sensor.v_zero_bits),
        PM_FIELD("sensor", "i_dc_full_scale_A", 0, 1e5, optional, plant.sensor.i_dc_full_scale_A),
        PM_FIELD("sensor", "i_dc_gain_error", -1, 1, optional, plant.sensor.i_dc_gain_error),
        PM_FIELD("sensor", "i_dc_offset_A", -1e5, 1e5, optional, plant.sensor.i_dc_offset_A),
        PM_FIELD("sensor", "i_dc_filter_s", 0, 10e-3, optional, plant.sensor.i_dc_filter_s),
        PM_FIELD("sensor", "t_full_scale_degC", 0, 1e3, optional, plant.sensor.t_full_scale_degC),

        PM_FIELD("dclink", "v_source_V", 0, 2000, optional, plant.dclink.v_source_V),
        PM_FIELD("dclink", "r_source_ohm", 0, 1e3, optional, plant.dclink.r_source_ohm),
        PM_FIELD("dclink", "c_F", 0, 10, optional, plant.dclink.c_F),
        PM_FIELD("dclink", "source_blocks", 0, 1, optional, plant.dclink.source_blocks),
        PM_FIELD("dclink", "ripple_V", 0, 2000, optional, plant.dclink.ripple_V),
        PM_FIELD("dclink", "ripple_Hz", 0, 1e5, optional, plant.dclink.ripple_Hz),
        PM_FIELD("dclink", "r_chopper_ohm", 0, 1e4, optional, plant.dclink.r_chopper_ohm),
        PM_FIELD("dclink", "v_chopper_on_V", 0, 1e4, optional, plant.dclink.v_chopper_on_V),
        PM_FIELD("dclink", "v_chopper_off_V", 0, 1e4, optional, plant.dclink.v_chopper_off_V),

        PM_FIELD("solver", "tolerance", 0, 1e-2, optional, plant.tolerance),
    };
    return fields;
}

} // namespace pmsim
