// `pmsim plant` takes machine files and scenarios alike.
#include "tools/pmsim/scenario_file.h"

namespace pmsim
{

PlantFile load_plant_file(const std::string &path, const Settings &settings)
{
    return read_plant_file(Value::from_file(path), settings);
}

// Variables of the first run, but for those that a setting fixes.
static Variables first_run(const Map &document, const Settings &settings)
{
    Variables fixed;
    for (const std::string &name : variable_names(document)) {
        for (const auto &[set, value] : settings) {
            if (set == name) {
                fixed[name] = value;
            }
        }
    }
    return expand_runs(document, fixed).front().variables;
}

static double start_angle(const Map &document, const Settings &settings)
{
    const auto seed = document.find("seed");
    const uint64_t seed_value = seed ? static_cast<uint64_t>(seed->integer(0, int64_t(1) << 53)) : 1;
    if (const auto set = setting_value(settings, "start.theta_e_deg")) {
        return read_angle(*set, seed_value);
    }
    if (const auto start = document.find("start")) {
        const Map keys(*start, {"theta_e_deg"});
        const auto angle = keys.find("theta_e_deg");
        return angle ? read_angle(*angle, seed_value) : 0.0;
    }
    return 0.0;
}

PlantFile read_plant_file(const Value &document, const Settings &settings)
{
    const bool is_machine = !Map(document).has("machine");
    std::vector<std::string> known = {"start.theta_e_deg"};
    PlantFile file{};
    if (is_machine) {
        check_settings(settings, known);
        file.setup = read_machine(document);
        apply_settings(file.setup, settings);
        check_time_constants(file.setup);
        file.theta_e_rad = start_angle(Map(document), settings); // a machine file has no start, but --set may
        return file;
    }
    const Map map = open_scenario(document);
    const std::vector<std::string> variables = variable_names(map);
    known.insert(known.end(), variables.begin(), variables.end());
    check_settings(settings, known);
    const Variables values = first_run(map, settings);
    const Map run = open_scenario(document.with(&values));
    MachineFiles files;
    file.setup = read_layers(run, settings, files);
    file.theta_e_rad = start_angle(run, settings);
    return file;
}

} // namespace pmsim
