#include "tools/pmsim/setup.h"

#include <cmath>
#include <variant>

#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

using Triple = double (*)[PLANT_LEGS];
using Target = std::variant<double *, int *, uint32_t *, bool *, Triple>;

struct Field {
    const char *section, *key;
    double min, max;
    bool required; // in a machine file
    Target (*target)(Setup &);
};

#define PM_FIELD(section, key, min, max, required, member)                                                   \
    {                                                                                                        \
        section, key, min, max, required, [](Setup &s) -> Target { return &s.member; }                       \
    }

// Limits reject slips of the decimal point, not unusual machines.
const Field fields[] = {
    PM_FIELD("electrical", "R_s_ohm", 1e-4, 1e3, true, plant.machine.R_s_ohm),
    PM_FIELD("electrical", "L_d0_H", 1e-7, 10, true, plant.machine.L_d0_H),
    PM_FIELD("electrical", "L_q0_H", 1e-7, 10, true, plant.machine.L_q0_H),
    PM_FIELD("electrical", "c_A_Wb5", 0, 1e18, true, plant.machine.c_A_Wb5),
    PM_FIELD("electrical", "psi_m_Wb", 1e-5, 10, true, plant.machine.psi_m_Wb),
    PM_FIELD("electrical", "pole_pairs", 1, 50, true, plant.machine.pole_pairs),

    PM_FIELD("mechanics", "J_kgm2", 1e-9, 1e3, true, plant.mech.J_kgm2),
    PM_FIELD("mechanics", "B_Nms", 0, 1e3, true, plant.mech.B_Nms),
    PM_FIELD("mechanics", "T_coulomb_Nm", 0, 1e4, true, plant.mech.T_coulomb_Nm),
    PM_FIELD("mechanics", "locked", 0, 1, false, plant.mech.locked),

    PM_FIELD("rated", "i_rated_A", 1e-3, 1e4, true, rated.i_rated_A),
    PM_FIELD("rated", "speed_rated_rad_s", 0.1, 1e5, true, rated.speed_rated_rad_s),
    PM_FIELD("rated", "torque_rated_Nm", 1e-5, 1e5, true, rated.torque_rated_Nm),
    PM_FIELD("rated", "v_dc_V", 1, 2000, true, rated.v_dc_V),

    PM_FIELD("inverter", "f_pwm_Hz", 1000, 200e3, false, plant.inverter.f_pwm_Hz),
    PM_FIELD("inverter", "dead_time_s", 0, 20e-6, false, plant.inverter.dead_time_s),
    PM_FIELD("inverter", "v_switch_V", 0, 10, false, plant.inverter.v_switch_V),
    PM_FIELD("inverter", "v_diode_V", 0, 10, false, plant.inverter.v_diode_V),
    PM_FIELD("inverter", "r_on_ohm", 0, 100, false, plant.inverter.r_on_ohm),
    PM_FIELD("inverter", "timer_counts", 100, 65535, false, plant.inverter.timer_counts),
    PM_FIELD("inverter", "i_break_A", 0, 1e5, false, i_break_A),

    PM_FIELD("sensor", "bits", 0, 16, false, plant.sensor.bits),
    PM_FIELD("sensor", "i_full_scale_A", 1e-2, 1e5, false, plant.sensor.i_full_scale_A),
    PM_FIELD("sensor", "v_full_scale_V", 1, 1e4, false, plant.sensor.v_full_scale_V),
    PM_FIELD("sensor", "noise_lsb", 0, 100, false, plant.sensor.noise_lsb),
    PM_FIELD("sensor", "gain_error", -1, 1, false, plant.sensor.gain_error),
    PM_FIELD("sensor", "offset_A", -1e5, 1e5, false, plant.sensor.offset_A),
    PM_FIELD("sensor", "delay_s", -1e-3, 1e-3, false, plant.sensor.delay_s),

    PM_FIELD("dclink", "v_source_V", 0, 2000, false, plant.dclink.v_source_V),
    PM_FIELD("dclink", "r_source_ohm", 0, 1e3, false, plant.dclink.r_source_ohm),
    PM_FIELD("dclink", "c_F", 0, 10, false, plant.dclink.c_F),
    PM_FIELD("dclink", "source_blocks", 0, 1, false, plant.dclink.source_blocks),

    PM_FIELD("solver", "tolerance", 0, 1e-2, false, plant.tolerance),
};

#undef PM_FIELD

// The defaults of parameters.def are one machine's: another must say its own.
const drive_param_id_t required_parameters[] = {
    DRIVE_PARAM_pole_pairs,  DRIVE_PARAM_R_s,          DRIVE_PARAM_L_d,         DRIVE_PARAM_L_q,
    DRIVE_PARAM_psi_m,       DRIVE_PARAM_i_rated,      DRIVE_PARAM_L_q_rated,   DRIVE_PARAM_L_dh_rated,
    DRIVE_PARAM_cross_half,  DRIVE_PARAM_L_qh_rated,   DRIVE_PARAM_L_dqh_rated, DRIVE_PARAM_J,
    DRIVE_PARAM_i_max,       DRIVE_PARAM_speed_max,    DRIVE_PARAM_v_injection, DRIVE_PARAM_i_pulse,
    DRIVE_PARAM_i_trip,      DRIVE_PARAM_v_dc_max,     DRIVE_PARAM_v_dc_min,    DRIVE_PARAM_v_dc_derate,
    DRIVE_PARAM_speed_trip,  DRIVE_PARAM_acceleration, DRIVE_PARAM_speed_low,   DRIVE_PARAM_speed_high,
    DRIVE_PARAM_i_open_loop,
};

void assign(const Target &target, const Field &field, const Value &value)
{
    if (auto *const *number = std::get_if<double *>(&target)) {
        **number = value.number(field.min, field.max);
    } else if (auto *const *whole = std::get_if<int *>(&target)) {
        **whole = static_cast<int>(value.integer(int64_t(field.min), int64_t(field.max)));
    } else if (auto *const *count = std::get_if<uint32_t *>(&target)) {
        **count = static_cast<uint32_t>(value.integer(int64_t(field.min), int64_t(field.max)));
    } else if (auto *const *flag = std::get_if<bool *>(&target)) {
        **flag = value.flag();
    } else {
        const std::vector<Value> legs = value.list();
        if (legs.size() != PLANT_LEGS) {
            value.fail("expected one value per leg: [a, b, c]");
        }
        for (size_t leg = 0; leg < PLANT_LEGS; ++leg) {
            (*std::get<Triple>(target))[leg] = legs[leg].number(field.min, field.max);
        }
    }
}

const Field *find_field(const std::string &section, const std::string &key)
{
    for (const Field &field : fields) {
        if (section == field.section && key == field.key) {
            return &field;
        }
    }
    return nullptr;
}

void require_all(const Map &map)
{
    for (const Field &field : fields) {
        if (field.required) {
            Map(map.at(field.section)).at(field.key);
        }
    }
    const Map drive(map.at("drive"));
    for (const drive_param_id_t id : required_parameters) {
        drive.at(drive_param_table[id].name);
    }
}

// What the board fixes, unless `drive:` says otherwise on purpose.
void derive_board_parameters(Setup &setup)
{
    const plant_inverter_t &inverter = setup.plant.inverter;
    const plant_sensor_t &sensor = setup.plant.sensor;
    const auto derive = [&setup](drive_param_id_t id, double si) {
        if (setup.given.count(id) == 0) {
            set_parameter_si(setup.params, id, si);
        }
    };
    derive(DRIVE_PARAM_f_pwm, inverter.f_pwm_Hz);
    derive(DRIVE_PARAM_timer_counts, inverter.timer_counts);
    derive(DRIVE_PARAM_dead_time, inverter.dead_time_s);
    derive(DRIVE_PARAM_device_drop, 0.5 * (inverter.v_switch_V + inverter.v_diode_V));
    derive(DRIVE_PARAM_v_dc_nominal, setup.rated.v_dc_V);
    derive(DRIVE_PARAM_i_full_scale, sensor.i_full_scale_A);
    derive(DRIVE_PARAM_v_full_scale, sensor.v_full_scale_V);
    // rounding adds to the noise; codes have 16 bits at most
    const double lsb_A = std::ldexp(2.0 * sensor.i_full_scale_A, -(sensor.bits > 0 ? sensor.bits : 16));
    derive(DRIVE_PARAM_i_noise, lsb_A * std::sqrt(sensor.noise_lsb * sensor.noise_lsb + 1.0 / 12.0));
}

} // namespace

const std::vector<std::string> &setup_sections()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> list;
        for (const Field &field : fields) {
            if (list.empty() || list.back() != field.section) {
                list.emplace_back(field.section);
            }
        }
        list.emplace_back("drive");
        return list;
    }();
    return names;
}

std::vector<std::string> section_keys(const std::string &section)
{
    if (section == "drive") {
        return parameter_names();
    }
    std::vector<std::string> keys;
    for (const Field &field : fields) {
        if (section == field.section) {
            keys.emplace_back(field.key);
        }
    }
    return keys;
}

Setup default_setup()
{
    Setup setup{};
    drive_params_default(&setup.params);
    setup.plant.inverter.f_pwm_Hz = 10e3;
    setup.plant.inverter.dead_time_s = 2e-6;
    setup.plant.inverter.v_switch_V = 1.0;
    setup.plant.inverter.v_diode_V = 1.0;
    setup.plant.inverter.timer_counts = 8500;
    setup.plant.sensor.bits = 12;
    setup.plant.sensor.i_full_scale_A = 10.0;
    setup.plant.sensor.v_full_scale_V = 450.0;
    setup.plant.sensor.noise_lsb = 0.5;
    setup.plant.dclink.r_source_ohm = 0.2;
    setup.plant.dclink.c_F = 470e-6;
    return setup;
}

void read_setting(Setup &setup, const std::string &section, const std::string &key, const Value &value)
{
    if (section == "drive") {
        read_parameter(setup.params, key, value);
        setup.given.insert(*find_parameter(key));
        return;
    }
    const Field *field = find_field(section, key);
    if (field == nullptr) {
        value.fail(unknown("key", key, section_keys(section)));
    }
    assign(field->target(setup), *field, value);
    if (section == "rated" && key == "v_dc_V") {
        setup.plant.dclink.v_source_V = setup.rated.v_dc_V;
    }
    derive_board_parameters(setup);
}

void read_sections(Setup &setup, const Map &map, bool is_machine_file)
{
    for (const std::string &section : setup_sections()) { // drive is last: it overrides what is derived
        const auto value = map.find(section);
        if (value) {
            const Map keys(*value, section_keys(section));
            for (const std::string &key : keys.keys()) {
                read_setting(setup, section, key, keys.at(key));
            }
        }
    }
    if (is_machine_file) {
        require_all(map);
    }
}

} // namespace pmsim
