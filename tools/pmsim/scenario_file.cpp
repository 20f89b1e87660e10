#include "tools/pmsim/scenario_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "tools/pmsim/machine_file.h"
#include "tools/pmsim/metrics.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const double two_pi = 6.283185307179586;
const double max_periods = 1e9;

std::vector<std::string> scenario_keys()
{
    std::vector<std::string> keys = setup_sections();
    for (const char *key :
         {"title", "machine", "seed", "start", "duration_s", "profile", "expect", "sweep", "cases"}) {
        keys.emplace_back(key);
    }
    return keys;
}

Map open_document(const Value &document)
{
    static const std::vector<std::string> known = scenario_keys();
    return Map(document, known);
}

// A machine file's path is relative to the file that names it.
Setup read_machine_of(const Map &document)
{
    const Value machine = document.at("machine");
    if (machine.is_map()) {
        return read_machine(machine);
    }
    namespace fs = std::filesystem;
    const fs::path path = fs::path(machine.file()).parent_path() / machine.text();
    if (!fs::is_regular_file(path)) {
        machine.fail("there is no machine file " + path.lexically_normal().string());
    }
    return load_machine_file(path.lexically_normal().string());
}

// Uniform in 0 ... 1 (splitmix64), so that a seed gives the same rotor angle everywhere.
double random_fraction(uint64_t seed)
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

void read_window(Scenario &scenario, Expectation &expectation, const Value &item)
{
    expectation.t1_s = std::min(expectation.t1_s, scenario.duration_s);
    if (expectation.t0_s >= expectation.t1_s) {
        item.fail("the window lies after the end of the run (duration_s " + format(scenario.duration_s) +
                  ")");
    }
}

} // namespace

ScenarioFile::ScenarioFile(const std::string &path, Settings settings)
    : ScenarioFile(Value::from_file(path), std::move(settings))
{
}

ScenarioFile::ScenarioFile(const Value &document, Settings settings)
    : document_(document), settings_(std::move(settings))
{
    const Map map = open_document(document_);
    Variables fixed;
    const std::vector<std::string> variables = variable_names(map);
    for (const auto &[name, value] : settings_) {
        if (std::find(variables.begin(), variables.end(), name) != variables.end()) {
            fixed[name] = value;
        }
    }
    runs_ = expand_runs(map, fixed);
    check_settings();
}

// --set: a variable, section.key, or the bare name of a drive parameter.
void ScenarioFile::check_settings() const
{
    const std::vector<std::string> variables = variable_names(open_document(document_));
    std::vector<std::string> known = parameter_names();
    known.insert(known.end(), variables.begin(), variables.end());
    for (const char *key : {"seed", "duration_s", "start.theta_e_deg", "machine"}) {
        known.emplace_back(key);
    }
    for (const std::string &section : setup_sections()) {
        for (const std::string &key : section_keys(section)) {
            known.push_back(section);
            known.back().append(".").append(key);
        }
    }
    for (const auto &setting : settings_) {
        if (std::find(known.begin(), known.end(), setting.first) == known.end()) {
            const auto near = nearest(setting.first, known);
            throw InputError("--set " + setting.first + ": no such variable, drive parameter or section.key" +
                             did_you_mean(near));
        }
    }
}

std::string ScenarioFile::title() const
{
    return open_document(document_).at("title").text();
}

const std::vector<Run> &ScenarioFile::runs() const
{
    return runs_;
}

static std::optional<Value> setting_value(const Settings &settings, const std::string &name)
{
    for (auto it = settings.rbegin(); it != settings.rend(); ++it) {
        if (it->first == name) {
            return Value::from_text(it->second, "--set " + name);
        }
    }
    return std::nullopt;
}

static void apply_settings(Setup &setup, const Settings &settings)
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

Scenario ScenarioFile::scenario(const Run &run) const
{
    const Map map = open_document(document_.with(&run.variables));
    const auto value_of = [&](const std::string &key) {
        const auto set = setting_value(settings_, key);
        return set ? set : map.find(key);
    };
    Scenario scenario;
    scenario.title = map.at("title").text();
    scenario.setup = read_machine_of(map);
    read_sections(scenario.setup, map, false);
    apply_settings(scenario.setup, settings_);
    if (const auto seed = value_of("seed")) {
        scenario.seed = static_cast<uint64_t>(seed->integer(0, int64_t(1) << 53));
    }
    scenario.setup.plant.sensor.seed = scenario.seed;
    const Map start(map.at("start"), {"theta_e_deg"});
    const auto angle = setting_value(settings_, "start.theta_e_deg");
    scenario.theta_e_rad = read_angle(angle ? *angle : start.at("theta_e_deg"), scenario.seed);
    map.at("duration_s");
    scenario.duration_s =
        value_of("duration_s")->number(1e-3, max_periods / scenario.setup.plant.inverter.f_pwm_Hz);
    for (const Value &item : map.at("profile").list()) {
        scenario.profile.push_back(read_event(item, scenario.setup));
    }
    if (const auto expect = map.find("expect")) {
        for (const Value &item : expect->list()) {
            scenario.expect.push_back(read_expectation(item));
            read_window(scenario, scenario.expect.back(), item);
        }
    }
    return scenario;
}

} // namespace pmsim
