#include "tools/pmsim/machine_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "tools/pmsim/text.h"

namespace pmsim
{

static const double two_pi = 6.283185307179586;
static const double fastest_1_s = 1e9; // 1e5 steps of the integrator in a PWM period; machines have 1e7

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

Setup MachineFiles::load(const std::string &path)
{
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto known = known_.find(path);
    return known != known_.end() ? known->second
                                 : known_.emplace(path, load_machine_file(path)).first->second;
}

// A machine file's path is relative to the file that names it.
static Setup read_machine_of(const Map &document, MachineFiles &files)
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
    return files.load(path.string());
}

// Ratio, and nothing where the denominator is: 0 means that there is no such part.
static double rate_1_s(double a, double b)
{
    return b > 0.0 ? a / b : 0.0;
}

void check_time_constants(const Setup &setup)
{
    const plant_winding_t &w = setup.plant.winding;
    const plant_machine_t &m = setup.plant.machine;
    const plant_mech_t &mech = setup.plant.mech;
    const plant_dclink_t &link = setup.plant.dclink;
    const double L_H = setup.flux_map ? 0.0 : std::min(m.L_d0_H, m.L_q0_H);
    const double R_ohm = m.R_s_ohm + setup.plant.inverter.r_on_ohm;
    const double inv_J = rate_1_s(1.0, mech.J_kgm2) + rate_1_s(1.0, mech.J_load_kgm2);
    const std::pair<const char *, double> rates_1_s[] = {
        {"winding.L_eddy_d_H with R_eddy_ohm", rate_1_s(w.R_eddy_ohm, w.L_eddy_d_H)},
        {"winding.L_eddy_q_H with R_eddy_ohm", rate_1_s(w.R_eddy_ohm, w.L_eddy_q_H)},
        {"winding.L_eddy_d_H with R_s_ohm and r_on_ohm", rate_1_s(R_ohm, w.L_eddy_d_H)},
        {"winding.L_eddy_q_H with R_s_ohm and r_on_ohm", rate_1_s(R_ohm, w.L_eddy_q_H)},
        {"winding.L_0_H with R_s_ohm and r_on_ohm", rate_1_s(R_ohm, w.L_0_H)},
        {"electrical.R_s_ohm with r_on_ohm, L_d0_H and L_q0_H", rate_1_s(R_ohm, L_H)},
        {"electrical.c_A_Wb5 with psi_m_Wb and R_s_ohm", R_ohm * 5.0 * m.c_A_Wb5 * std::pow(m.psi_m_Wb, 4)},
        {"inverter.c_leg_F with L_d0_H and L_q0_H",
         std::sqrt(rate_1_s(1.0, L_H * setup.plant.inverter.c_leg_F))},
        {"dclink.c_F with r_source_ohm", rate_1_s(1.0, link.r_source_ohm * link.c_F)},
        {"dclink.c_F with r_chopper_ohm", rate_1_s(1.0, link.r_chopper_ohm * link.c_F)},
        {"mechanics.J_kgm2 with B_Nms", rate_1_s(mech.B_Nms, mech.J_kgm2)},
        {"mechanics.load_Nms with the inertia", mech.load_Nms * inv_J},
        {"mechanics.d_shaft_Nms with J_kgm2 and J_load_kgm2", mech.d_shaft_Nms * inv_J},
        {"mechanics.k_shaft_Nm with J_kgm2 and J_load_kgm2", std::sqrt(mech.k_shaft_Nm * inv_J)},
    };
    for (const auto &[what, rate] : rates_1_s) {
        if (rate > fastest_1_s) {
            refuse_plant(setup, std::string(what) + ": a time constant of " + format(1.0 / rate, 2) +
                                    " s, which would take too long to integrate");
        }
    }
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

Setup read_layers(const Map &document, const Settings &settings, MachineFiles &files)
{
    const auto other = setting_value(settings, "machine"); // as a path from where the program runs
    Setup setup = other ? files.load(other->text()) : read_machine_of(document, files);
    read_sections(setup, document, false);
    apply_settings(setup, settings);
    check_time_constants(setup);
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

std::optional<std::string> nearest_key(const std::string &name)
{
    for (const char *section :
         {"electrical", "mechanics", "winding", "rated", "inverter", "sensor", "dclink", "solver"}) {
        if (const auto key = nearest(name, section_keys(section))) {
            return std::string(section) + "." + *key;
        }
    }
    return std::nullopt;
}

void check_settings(const Settings &settings, std::vector<std::string> known)
{
    known.emplace_back("machine");
    const std::string own = join(known, ", ");
    const std::vector<std::string> &parameters = parameter_names();
    known.insert(known.end(), parameters.begin(), parameters.end());
    for (const std::string &section : setup_sections()) {
        for (const std::string &key : section_keys(section)) {
            known.push_back(section);
            known.back().append(".").append(key);
        }
    }
    for (const auto &setting : settings) {
        if (std::find(known.begin(), known.end(), setting.first) == known.end()) {
            auto near = nearest(setting.first, known);
            near = near ? near : nearest_key(setting.first);
            throw InputError(
                "--set " + setting.first + ": no such variable, drive parameter or section.key" +
                (near ? did_you_mean(near)
                      : "; known: " + own + ", what `pmsim params` lists, and keys by their section"));
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
