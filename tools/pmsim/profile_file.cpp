// `profile:` of a scenario: events and what they change.
#include "tools/pmsim/names.h"
#include "tools/pmsim/scenario_file.h"
#include "tools/pmsim/text.h"

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
    {"duty_rel", Channel::duty, -1, 1, [](const Setup &) { return 1.0; }}, // of v_dc
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
    {"winding_degC", Channel::winding_degC, -100, 1000, nullptr},
    {"magnet_degC", Channel::magnet_degC, -100, 1000, nullptr},
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
                                     "estimate_turn_deg",
                                     "free_speed",
                                     "clear_fault",
                                     "sensor_gain_error",
                                     "v_zero_gain_error",
                                     "leg_fault",
                                     "short",
                                     "supply"};
    for (const ChannelKey &entry : channel_keys) {
        keys.emplace_back(entry.key);
    }
    return keys;
}

bool in_energy_form(Channel channel)
{
    return channel == Channel::psi_m_Wb || channel == Channel::L_d0_H || channel == Channel::L_q0_H ||
           channel == Channel::c_A_Wb5;
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
        if (setup.flux_map && in_energy_form(entry.channel)) {
            throw InputError(map.key_place(entry.key),
                             "the machine has a flux map, which this does not change");
        }
        target = value->number(entry.min, entry.max) *
                 (entry.unit != nullptr ? entry.unit(setup) : setup.similarity.of_key(entry.key));
    }
}

std::optional<std::array<double, PLANT_LEGS>> read_legs_of(const Map &map, const char *key,
                                                           const Setup &setup)
{
    const auto value = map.find(key);
    if (!value) {
        return std::nullopt;
    }
    std::array<double, PLANT_LEGS> legs{};
    read_legs(*value, leg_count(setup.plant), -1e5, 1e5, legs.data());
    for (double &leg : legs) {
        leg *= setup.similarity.of_key(key);
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

const std::vector<std::string> leg_fault_names = {"none",        "upper_open",  "lower_open",
                                                  "upper_short", "lower_short", "wire_open"};

int read_leg(const Value &value, const Setup &setup)
{
    const auto legs = leg_names().begin();
    return index_of(leg_names(), value.word({legs, legs + leg_count(setup.plant)}));
}

LegFault read_leg_fault(const Value &value, const Setup &setup)
{
    const Map map(value, {"leg", "kind"});
    const int leg = read_leg(map.at("leg"), setup);
    const std::string kind = map.at("kind").word(leg_fault_names);
    return {leg, static_cast<plant_leg_fault_t>(index_of(leg_fault_names, kind))};
}

ShortCircuit read_short(const Value &value, const Setup &setup)
{
    if (value.is_scalar()) {
        value.word({"none"});
        return {0, -1, -1.0};
    }
    const Map map(value, {"from", "to", "R_ohm"});
    ShortCircuit tie{read_leg(map.at("from"), setup), -1,
                     map.at("R_ohm").number(0, 1e6) * setup.similarity.of_key("R_ohm")};
    const Value to = map.at("to");
    if (to.text() != "rail") {
        tie.leg_b = read_leg(to, setup);
        if (tie.leg_b == tie.leg_a) {
            to.fail("a terminal cannot be shorted to itself");
        }
    }
    return tie;
}

// A temperature that would leave no resistance or no magnets.
void check_temperature(const Map &map, const char *key, double alpha_1_K)
{
    const double room_degC = 25.0, least = 0.01;
    if (const auto value = map.find(key)) {
        if (!(1.0 + alpha_1_K * (value->number(-100, 1000) - room_degC) >= least)) {
            value->fail("at this temperature the coefficient " + format(alpha_1_K) + "/K leaves nothing");
        }
    }
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
    event.sensor_offset_A = read_legs_of(map, "sensor_offset_A", setup);
    event.sensor_gain_error = read_legs_of(map, "sensor_gain_error", setup);
    if (const auto error = map.find("v_zero_gain_error")) {
        event.v_zero_gain_error = error->number(-1, 1);
    }
    if (const auto slip = map.find("rotor_slip_deg")) {
        event.rotor_slip_rad = slip->number(-360, 360) * two_pi / 360.0;
    }
    if (const auto turn = map.find("estimate_turn_deg")) {
        event.estimate_turn_rad = turn->number(-360, 360) * two_pi / 360.0;
    }
    if (const auto fault = map.find("leg_fault")) {
        event.leg_fault = read_leg_fault(*fault, setup);
    }
    if (const auto tie = map.find("short")) {
        event.short_circuit = read_short(*tie, setup);
    }
    event.supply = read_flag(map, "supply");
    check_temperature(map, "winding_degC", setup.plant.winding.alpha_R_1_K);
    check_temperature(map, "magnet_degC", setup.plant.winding.alpha_psi_1_K);
    return event;
}

} // namespace pmsim
