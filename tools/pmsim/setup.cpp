#include "tools/pmsim/setup.h"

#include <algorithm>
#include <cmath>

#include "firmware/drive/bridges.h"
#include "firmware/params/parameters.h"
#include "tools/pmsim/setup_fields.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

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

const Field *find_field(const std::string &section, const std::string &key)
{
    for (const Field &field : setup_fields()) {
        if (section == field.section && key == field.key) {
            return &field;
        }
    }
    return nullptr;
}

bool replaced_by_map(const std::string &section, const std::string &key)
{
    return section == "electrical" &&
           (key == "L_d0_H" || key == "L_q0_H" || key == "c_A_Wb5" || key == "psi_m_Wb");
}

const char complete_first[] = "; complete it first: pmsim tune FILE -o tuned.yaml";

// Of what the firmware needs, and `pmsim tune` gives.
void require_for_drive(const Map &section, const std::string &key)
{
    if (!section.has(key)) {
        section.value().fail("key \"" + key + "\" is missing" + complete_first);
    }
}

// `rated` and `drive` may be left out, but not half of them.
void require_all(const Setup &setup, const Map &map)
{
    for (const Field &field : setup_fields()) {
        if (field.need == Need::always || (field.need == Need::core && !setup.flux_map)) {
            Map(map.at(field.section)).at(field.key);
        } else if (field.need == Need::drive && map.has(field.section)) {
            require_for_drive(Map(map.at(field.section)), field.key);
        }
    }
    if (const auto drive = map.find("drive")) {
        const Map keys(*drive);
        for (const drive_param_id_t id : required_parameters) {
            require_for_drive(keys, drive_param_table[id].name);
        }
    }
}

void read_flux_map_section(Setup &setup, const Value &value)
{
    setup.flux_map = std::make_shared<const FluxMap>(read_flux_map(value));
    setup.plant.map = setup.flux_map->table.get();
    setup.plant.machine.psi_m_Wb = setup.flux_map->psi_m_Wb;
    setup.given["flux_map"] = value.place();
}

// In the order of the table, since a list's length depends on what stands before it.
void read_section(Setup &setup, const std::string &section, const Value &value)
{
    const std::vector<std::string> known = section_keys(section);
    const Map map(value, known);
    if (section == "winding" && map.has("emf") && map.has("trapezoid_flat_deg")) {
        throw InputError(map.key_place("trapezoid_flat_deg"),
                         "a trapezoid is a list of harmonics: it cannot stand beside emf");
    }
    for (const std::string &key : known) {
        if (const auto found = map.find(key)) {
            read_setting(setup, section, key, *found);
        }
    }
}

} // namespace

const std::vector<std::string> &setup_sections()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> list = {"flux_map"};
        for (const Field &field : setup_fields()) {
            if (list.back() != field.section) {
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
    for (const Field &field : setup_fields()) {
        if (section == field.section) {
            keys.emplace_back(field.key);
        }
    }
    return keys;
}

Setup default_setup()
{
    Setup setup{};
    setup.trapezoid_flat_deg = -1.0;
    setup.plant.winding.sets = 1;
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
        read_parameter(*setup.params, key, value);
        setup.given[section + "." + key] = value.place();
        return;
    }
    const Field *field = find_field(section, key);
    if (field == nullptr) {
        value.fail(unknown("key", key, section_keys(section)));
    }
    if (setup.flux_map && replaced_by_map(section, key)) {
        value.fail("the flux map stands for " + key + ": give one or the other");
    }
    read_field(setup, *field, value);
    setup.given[section + "." + key] = value.place();
    if (section == "rated" && key == "v_dc_V") {
        setup.plant.dclink.v_source_V = setup.rated.v_dc_V;
    }
    if (section == "winding" && key == "emf") {
        setup.trapezoid_flat_deg = -1.0;
    }
    expand_trapezoid(setup);
    derive_board_parameters(setup);
}

void derive_board_parameters(Setup &setup)
{
    const plant_inverter_t &inverter = setup.plant.inverter;
    const plant_sensor_t &sensor = setup.plant.sensor;
    const auto derive = [&setup](drive_param_id_t id, double si) {
        if (setup.given.count(std::string("drive.") + drive_param_table[id].name) == 0) {
            set_parameter_si(*setup.params, id, si);
        }
    };
    derive(DRIVE_PARAM_f_pwm, inverter.f_pwm_Hz);
    derive(DRIVE_PARAM_timer_counts, inverter.timer_counts);
    derive(DRIVE_PARAM_dead_time, inverter.dead_time_s);
    // A closed switch conducts both ways; the diodes have the current for two dead times of a period.
    const double gaps = 2 * inverter.dead_time_s * inverter.f_pwm_Hz;
    derive(DRIVE_PARAM_device_drop, inverter.v_switch_V * (1 - gaps) + inverter.v_diode_V * gaps);
    derive(DRIVE_PARAM_v_dc_nominal, setup.rated.v_dc_V);
    derive(DRIVE_PARAM_i_full_scale, sensor.i_full_scale_A);
    derive(DRIVE_PARAM_v_full_scale, sensor.v_full_scale_V);
    derive(DRIVE_PARAM_t_settle, sensor.shunt == PLANT_LOW_SIDE ? sensor.settle_s : 0.0);
    const plant_winding_t &winding = setup.plant.winding;
    derive(DRIVE_PARAM_winding, winding.connection == PLANT_OPEN ? WINDING_OPEN
                                : winding.sets == 2              ? WINDING_TWO_SETS
                                                                 : WINDING_STAR);
    derive(DRIVE_PARAM_neutral_channel, sensor.v_zero_between ? 1.0 : 0.0);
    if (sensor.v_zero_full_scale_V > 0.0) {
        derive(DRIVE_PARAM_neutral_full_scale, sensor.v_zero_full_scale_V);
        derive(DRIVE_PARAM_neutral_filter, sensor.v_zero_filter_s);
    } else if (sensor.v_leg_full_scale_V > 0.0) { // the difference of four channels
        derive(DRIVE_PARAM_neutral_full_scale, sensor.v_leg_full_scale_V);
        derive(DRIVE_PARAM_neutral_filter, sensor.filter_s);
    } else { // a channel that is not there: its preset, in the format of a small link, too
        const double preset_V = drive_param_table[DRIVE_PARAM_neutral_full_scale].def * 1e-3;
        derive(DRIVE_PARAM_neutral_full_scale, std::min(preset_V, sensor.v_full_scale_V));
    }
    // rounding adds to the noise; codes have 16 bits at most
    const double lsb_A = std::ldexp(2.0 * sensor.i_full_scale_A, -(sensor.bits > 0 ? sensor.bits : 16));
    derive(DRIVE_PARAM_i_noise, lsb_A * std::sqrt(sensor.noise_lsb * sensor.noise_lsb + 1.0 / 12.0));
}

void read_sections(Setup &setup, const Map &map, bool is_machine_file)
{
    for (const std::string &section : setup_sections()) { // drive is last: it overrides what is derived
        const auto value = map.find(section);
        if (value && section == "flux_map") {
            read_flux_map_section(setup, *value);
        } else if (value) {
            read_section(setup, section, *value);
        }
    }
    if (is_machine_file) {
        require_all(setup, map);
    }
}

void require_drive(const Setup &setup)
{
    const auto refuse = [&setup](const std::string &why) { throw InputError(setup.file + ": " + why); };
    if (setup.plant.sensor.shunt == PLANT_SINGLE_SHUNT) {
        refuse("the drive cannot measure with a single shunt yet");
    }
    const auto need = [&](const std::string &key) {
        if (setup.given.count(key) == 0) {
            refuse(key + " is missing: the drive cannot run this machine without it" + complete_first);
        }
    };
    for (const Field &field : setup_fields()) {
        if (field.need == Need::drive) {
            need(std::string(field.section) + "." + field.key);
        }
    }
    for (const drive_param_id_t id : required_parameters) {
        need(std::string("drive.") + drive_param_table[id].name);
    }
}

// The plant speaks of its own structures: "mech.J_kgm2 must be positive".
static std::string in_words_of_the_file(std::string reason)
{
    const std::pair<std::string, std::string> renamed[] = {
        {"machine.", "electrical."}, {"mech.", "mechanics."}, {"tolerance", "solver.tolerance"}};
    for (const auto &[from, to] : renamed) {
        if (reason.compare(0, from.size(), from) == 0) {
            return reason.replace(0, from.size(), to);
        }
    }
    const std::string radians = "emf_shift_rad";
    const size_t at = reason.find(radians);
    return at == std::string::npos ? reason : reason.replace(at, radians.size(), "emf_shift_deg");
}

void refuse_plant(const Setup &setup, const std::string &reason)
{
    const std::string text = in_words_of_the_file(reason);
    const std::string key = text.substr(0, text.find_first_of(" :")); // or a section, or a key's beginning
    const auto place = setup.given.lower_bound(key);
    if (place != setup.given.end() && place->first.rfind(key, 0) == 0) {
        throw InputError(place->second, text);
    }
    throw InputError((setup.file.empty() ? setup.name : setup.file) + ": " + text);
}

} // namespace pmsim
