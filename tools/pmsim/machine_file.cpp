#include "tools/pmsim/machine_file.h"

#include <algorithm>
#include <filesystem>

#include "tools/pmsim/text.h"

namespace pmsim
{

static const double two_pi = 6.283185307179586;

Setup read_machine(const Value &value)
{
    std::vector<std::string> known = setup_sections();
    known.emplace_back("name");
    const Map map(value, known);
    Setup setup = default_setup();
    setup.file = value.file();
    setup.name = map.at("name").text();
    read_sections(setup, map, true);
    return setup;
}

Setup load_machine_file(const std::string &path)
{
    return read_machine(Value::from_file(path));
}

// A machine file's path is relative to the file that names it.
static Setup read_machine_of(const Map &document)
{
    const Value machine = document.at("machine");
    if (machine.is_map()) {
        return read_machine(machine);
    }
    namespace fs = std::filesystem;
    const fs::path path = (fs::path(machine.file()).parent_path() / machine.text()).lexically_normal();
    if (!fs::is_regular_file(path)) {
        machine.fail("there is no machine file " + path.string());
    }
    return load_machine_file(path.string());
}

void apply_settings(Setup &setup, const Settings &settings)
{
    const std::vector<std::string> &sections = setup_sections();
    for (const auto &[name, text] : settings) {
        const size_t dot = name.find('.');
        const std::string section = dot == std::string::npos ? "drive" : name.substr(0, dot);
        const std::string key = dot == std::string::npos ? name : name.substr(dot + 1);
        const bool is_section = std::find(sections.begin(), sections.end(), section) != sections.end();
        if (is_section && (section != "drive" || find_parameter(key))) {
            read_setting(setup, section, key, Value::from_text(text, "--set " + name));
        }
    }
}

Setup read_layers(const Map &document, const Settings &settings)
{
    Setup setup = read_machine_of(document);
    read_sections(setup, document, false);
    apply_settings(setup, settings);
    return setup;
}

std::optional<Value> setting_value(const Settings &settings, const std::string &name)
{
    for (auto it = settings.rbegin(); it != settings.rend(); ++it) {
        if (it->first == name) {
            return Value::from_text(it->second, "--set " + name);
        }
    }
    return std::nullopt;
}

void check_settings(const Settings &settings, std::vector<std::string> known)
{
    const std::vector<std::string> parameters = parameter_names();
    known.insert(known.end(), parameters.begin(), parameters.end());
    for (const std::string &section : setup_sections()) {
        for (const std::string &key : section_keys(section)) {
            known.push_back(section);
            known.back().append(".").append(key);
        }
    }
    for (const auto &setting : settings) {
        if (std::find(known.begin(), known.end(), setting.first) == known.end()) {
            const auto near = nearest(setting.first, known);
            throw InputError("--set " + setting.first + ": no such variable, drive parameter or section.key" +
                             did_you_mean(near));
        }
    }
}

// Uniform in 0 ... 1 (splitmix64), so that a seed gives the same rotor angle everywhere.
static double random_fraction(uint64_t seed)
{
    uint64_t z = seed + 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

double read_angle(const Value &value, uint64_t seed)
{
    if (value.is_scalar() && value.text() == "random") {
        return two_pi * random_fraction(seed);
    }
    return value.number(-360, 360) * two_pi / 360.0;
}

} // namespace pmsim
