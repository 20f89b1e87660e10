// `profile:` of a scenario: events and what they change.
#include "tools/pmsim/names.h"
#include "tools/pmsim/scenario_file.h"

namespace pmsim
{
namespace
{

const double two_pi = 6.283185307179586;

struct ChannelKey {
    const char *key;
    Channel channel;
    double min, max;
    double (*unit)(const Setup &); // what a relative value is relative to; null: SI
};

const ChannelKey channel_keys[] = {
    {"speed_rad_s", Channel::speed_rad_s, -1e6, 1e6, nullptr},
    {"speed_rel", Channel::speed_rad_s, -10, 10, [](const Setup &s) { return s.rated.speed_rated_rad_s; }},
    {"torque_Nm", Channel::torque_Nm, -1e5, 1e5, nullptr},
    {"torque_rel", Channel::torque_Nm, -10, 10, [](const Setup &s) { return s.rated.torque_rated_Nm; }},
    {"current_A", Channel::current_A, -1e5, 1e5, nullptr},
    {"current_rel", Channel::current_A, -10, 10, [](const Setup &s) { return s.rated.i_rated_A; }},
    {"load_Nm", Channel::load_Nm, -1e5, 1e5, nullptr},
    {"load_rel", Channel::load_Nm, -10, 10, [](const Setup &s) { return s.rated.torque_rated_Nm; }},
    {"load_fan_Nm", Channel::load_fan_Nm, 0, 1e5, nullptr},
    {"load_fan_rel", Channel::load_fan_Nm, 0, 10, [](const Setup &s) { return s.rated.torque_rated_Nm; }},
    {"v_source_V", Channel::v_source_V, 0, 2000, nullptr},
    {"v_source_rel", Channel::v_source_V, 0, 10, [](const Setup &s) { return s.rated.v_dc_V; }},
    {"temperature_degC", Channel::temperature_degC, -100, 1000, nullptr},
    {"imposed_speed_rad_s", Channel::imposed_speed_rad_s, -1e6, 1e6, nullptr},
    {"imposed_speed_rel", Channel::imposed_speed_rad_s, -10, 10,
     [](const Setup &s) { return s.rated.speed_rated_rad_s; }},
    {"R_s_ohm", Channel::R_s_ohm, 1e-4, 1e3, nullptr},
    {"R_s_rel", Channel::R_s_ohm, 0.01, 100, [](const Setup &s) { return s.plant.machine.R_s_ohm; }},
    {"psi_m_Wb", Channel::psi_m_Wb, 1e-5, 10, nullptr},
    {"psi_m_rel", Channel::psi_m_Wb, 0.01, 100, [](const Setup &s) { return s.plant.machine.psi_m_Wb; }},
    {"L_d0_H", Channel::L_d0_H, 1e-7, 10, nullptr},
    {"L_q0_H", Channel::L_q0_H, 1e-7, 10, nullptr},
    {"c_A_Wb5", Channel::c_A_Wb5, 0, 1e18, nullptr},
};

std::vector<std::string> event_keys()
{
    std::vector<std::string> keys = {"t_s",
                                     "when",
                                     "ramp_s",
                                     "enable",
                                     "mode",
                                     "locked",
                                     "hw_fault",
                                     "sensor_offset_A",
                                     "rotor_slip_deg",
                                     "free_speed",
                                     "clear_fault",
                                     "sensor_gain_error"};
    for (const ChannelKey &entry : channel_keys) {
        keys.emplace_back(entry.key);
    }
    return keys;
}

void read_channels(Event &event, const Map &map, const Setup &setup)
{
    for (const ChannelKey &entry : channel_keys) {
        const auto value = map.find(entry.key);
        if (!value) {
            continue;
        }
        std::optional<double> &target = event.targets[static_cast<size_t>(entry.channel)];
        if (target) {
            throw InputError(map.key_place(entry.key), "the same value is set twice in one event");
        }
        target = value->number(entry.min, entry.max) * (entry.unit != nullptr ? entry.unit(setup) : 1.0);
    }
}

std::optional<std::array<double, PLANT_LEGS>> read_legs(const Map &map, const char *key)
{
    const auto value = map.find(key);
    if (!value) {
        return std::nullopt;
    }
    const std::vector<Value> list = value->list();
    if (list.size() != PLANT_LEGS) {
        value->fail("expected one value per leg: [a, b, c]");
    }
    std::array<double, PLANT_LEGS> legs{};
    for (size_t leg = 0; leg < PLANT_LEGS; ++leg) {
        legs[leg] = list[leg].number(-1e5, 1e5);
    }
    return legs;
}

std::optional<bool> read_flag(const Map &map, const char *key)
{
    const auto value = map.find(key);
    return value ? std::optional<bool>(value->flag()) : std::nullopt;
}

int index_of(const std::vector<std::string> &names, const std::string &name)
{
    int index = 0;
    while (names[static_cast<size_t>(index)] != name) {
        ++index;
    }
    return index;
}

} // namespace

Event read_event(const Value &value, const Setup &setup)
{
    static const std::vector<std::string> known = event_keys();
    const Map map(value, known);
    Event event;
    event.t_s = map.at("t_s").number(0, 1e6);
    if (const auto when = map.find("when")) {
        event.state = index_of(state_names(), when->word(state_names()));
    }
    if (const auto ramp = map.find("ramp_s")) {
        event.ramp_s = ramp->number(0, 1e6);
    }
    if (const auto mode = map.find("mode")) {
        event.mode = index_of(mode_names(), mode->word(mode_names()));
    }
    read_channels(event, map, setup);
    event.enable = read_flag(map, "enable");
    event.locked = read_flag(map, "locked");
    event.hw_fault = read_flag(map, "hw_fault");
    event.free = read_flag(map, "free_speed").value_or(false);
    event.clear_fault = read_flag(map, "clear_fault").value_or(false);
    event.sensor_offset_A = read_legs(map, "sensor_offset_A");
    event.sensor_gain_error = read_legs(map, "sensor_gain_error");
    if (const auto slip = map.find("rotor_slip_deg")) {
        event.rotor_slip_rad = slip->number(-360, 360) * two_pi / 360.0;
    }
    return event;
}

} // namespace pmsim
