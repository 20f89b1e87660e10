#include "tools/pmsim/scenario_file.h"

#include <algorithm>

#include "tools/pmsim/machine_variables.h"
#include "tools/pmsim/metrics.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const double max_periods = 1e9;
const char seed_key[] = "seed";

std::vector<std::string> scenario_keys()
{
    std::vector<std::string> keys = setup_sections();
    for (const char *key : {"title", "machine", "seed", "start", "duration_s", "after_fault_s", "profile",
                            "expect", "sweep", "cases"}) {
        keys.emplace_back(key);
    }
    return keys;
}

void read_window(Scenario &scenario, Expectation &expectation, const Value &item)
{
    expectation.t1_s = std::min(expectation.t1_s, scenario.duration_s);
    if (expectation.t0_s >= expectation.t1_s) {
        item.fail("the window lies after the end of the run (duration_s " + format(scenario.duration_s) +
                  ")");
    }
}

// A variable may put an event behind the end, so that it does not happen.
void check_time(const Scenario &scenario, const Value &item)
{
    const bool is_fixed = Map(item).at("t_s").node().Scalar().find('$') == std::string::npos;
    if (is_fixed && scenario.profile.back().t_s > scenario.duration_s) {
        item.fail("the event lies after the end of the run (duration_s " + format(scenario.duration_s) + ")");
    }
}

void make_similar(Expectation &expectation, const Similarity &similarity)
{
    const double factor = similarity.of_unit(find_metric(expectation.metric)->unit);
    for (std::optional<double> *bound : {&expectation.min, &expectation.max, &expectation.max_abs}) {
        if (*bound) {
            **bound *= factor;
        }
    }
}

bool can_be(const plant_config_t &config, const char *&reason)
{
    plant_t *plant = plant_create(&config, 0.0, &reason);
    plant_destroy(plant);
    return plant != nullptr;
}

// The worst machine that the events can make together: the plant must be able to be it.
void check_drift(const Scenario &scenario, const Value &profile)
{
    plant_config_t worst = scenario.setup.plant;
    plant_machine_t &m = worst.machine;
    const auto least = [&](Channel channel, double &value) {
        for (const Event &event : scenario.profile) {
            value = std::min(value, event.targets[static_cast<size_t>(channel)].value_or(value));
        }
    };
    least(Channel::R_s_ohm, m.R_s_ohm);
    least(Channel::L_d0_H, m.L_d0_H);
    least(Channel::L_q0_H, m.L_q0_H);
    const double c = m.c_A_Wb5, psi_m = m.psi_m_Wb;
    for (const Event &event : scenario.profile) { // more of both saturates more
        m.c_A_Wb5 = std::max(m.c_A_Wb5, event.targets[static_cast<size_t>(Channel::c_A_Wb5)].value_or(c));
        m.psi_m_Wb =
            std::max(m.psi_m_Wb, event.targets[static_cast<size_t>(Channel::psi_m_Wb)].value_or(psi_m));
    }
    const char *reason = nullptr;
    const char *ignored = nullptr; // a machine that cannot be from the start is refused when it is made
    if (!can_be(worst, reason) && can_be(scenario.setup.plant, ignored)) {
        profile.fail(std::string("the events together make a machine that cannot be: ") + reason);
    }
}

} // namespace

Map open_scenario(const Value &document)
{
    static const std::vector<std::string> known = scenario_keys();
    return Map(document, known);
}

ScenarioFile::ScenarioFile(const std::string &path, Settings settings)
    : ScenarioFile(Value::from_file(path), std::move(settings))
{
}

ScenarioFile::ScenarioFile(const Value &document, Settings settings)
    : document_(document), settings_(std::move(settings))
{
    const Map map = open_scenario(document_);
    Variables fixed;
    const std::vector<std::string> variables = variable_names(map);
    for (const auto &[name, value] : settings_) {
        if (std::find(variables.begin(), variables.end(), name) != variables.end()) {
            fixed[name] = value;
        }
    }
    runs_ = expand_runs(map, fixed);
    refuse_unused_variables(map);
    std::vector<std::string> known = variables;
    for (const char *key : {"seed", "duration_s", "start.theta_e_deg"}) {
        known.emplace_back(key);
    }
    check_settings(settings_, known);
}

static std::string with_name(std::string title, const std::string &machine)
{
    const std::string variable = "$machine";
    const size_t at = title.find(variable);
    return at == std::string::npos ? title : title.replace(at, variable.size(), machine);
}

std::string ScenarioFile::title() const
{
    const Map map = open_scenario(document_.with(&runs_.front().variables));
    const std::string title = map.at("title").text();
    return with_name(
        title, title.find('$') == std::string::npos ? "" : read_layers(map, settings_, *machines_).name);
}

const std::vector<Run> &ScenarioFile::runs() const
{
    return runs_;
}

void ScenarioFile::repeat(int seeds)
{
    std::vector<Run> repeated;
    for (const Run &run : runs_) {
        const uint64_t first = scenario(run).seed;
        for (int i = 0; i < seeds; ++i) {
            Run again = run;
            again.seed = first + static_cast<uint64_t>(i);
            again.variables[seed_key] = std::to_string(*again.seed);
            again.name.append(run.name.empty() ? "" : " ").append("seed=" + again.variables[seed_key]);
            repeated.push_back(std::move(again));
        }
    }
    runs_ = std::move(repeated);
}

void ScenarioFile::keep(const std::vector<std::string> &names)
{
    for (const std::string &name : names) {
        const auto is_called = [&name](const Run &run) { return run.name == name; };
        if (std::none_of(runs_.begin(), runs_.end(), is_called)) {
            throw InputError("no run is called '" + name + "'; the first of " + std::to_string(runs_.size()) +
                             " is '" + runs_.front().name + "'");
        }
    }
    const auto is_left_out = [&names](const Run &run) {
        return std::find(names.begin(), names.end(), run.name) == names.end();
    };
    runs_.erase(std::remove_if(runs_.begin(), runs_.end(), is_left_out), runs_.end());
}

Scenario ScenarioFile::scenario(const Run &run) const
{
    Variables variables = run.variables;
    const Setup machine = read_layers(open_scenario(document_.with(&variables)), settings_, *machines_);
    require_drive(machine);
    for (const auto &[name, value] : machine_variables(machine)) {
        variables.emplace(name, value);
    }
    const Map map = open_scenario(document_.with(&variables));
    const auto value_of = [&](const std::string &key) {
        const auto set = setting_value(settings_, key);
        return set ? set : map.find(key);
    };
    Scenario scenario;
    scenario.setup = machine;
    scenario.title = with_name(map.at("title").text(), machine.name);
    fit_board(scenario.setup);
    if (run.seed) {
        scenario.seed = *run.seed;
    } else if (const auto seed = value_of(seed_key)) {
        scenario.seed = static_cast<uint64_t>(seed->integer(0, int64_t(1) << 53));
    }
    scenario.setup.plant.sensor.seed = scenario.seed;
    const Map start(map.at("start"), {"theta_e_deg"});
    const auto angle = setting_value(settings_, "start.theta_e_deg");
    scenario.theta_e_rad = read_angle(angle ? *angle : start.at("theta_e_deg"), scenario.seed);
    map.at("duration_s");
    scenario.duration_s =
        value_of("duration_s")->number(1e-3, max_periods / scenario.setup.plant.inverter.f_pwm_Hz);
    if (const auto after = map.find("after_fault_s")) {
        scenario.after_fault_s = after->number(0.0, scenario.duration_s);
    }
    const bool is_cut = setting_value(settings_, "duration_s").has_value();
    for (const Value &item : map.at("profile").list()) {
        scenario.profile.push_back(read_event(item, scenario.setup));
        if (!is_cut) {
            check_time(scenario, item);
        }
    }
    check_drift(scenario, map.at("profile"));
    if (const auto expect = map.find("expect")) {
        for (const Value &item : expect->list()) {
            scenario.expect.push_back(read_expectation(item));
            read_window(scenario, scenario.expect.back(), item);
            make_similar(scenario.expect.back(), scenario.setup.similarity);
        }
    }
    return scenario;
}

} // namespace pmsim
