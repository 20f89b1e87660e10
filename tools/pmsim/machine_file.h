// Machine files, sim_plant/machines/*.yaml (row 152), and what is laid over them: the sections of a scenario,
// then the settings of the command line. Format: docs/pmsim.md. Tests:
// tests/unit/pmsim/machine_file_test.cpp, plant_run_test.cpp.
#ifndef PMSIM_MACHINE_FILE_H
#define PMSIM_MACHINE_FILE_H

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/pmsim/setup.h"

namespace pmsim
{

using Settings = std::vector<std::pair<std::string, std::string>>; // --set name=value

Setup read_machine(const Value &value); // the content of a machine file
Setup load_machine_file(const std::string &path);

// Reads each file once: a sweep asks for the same one in every run.
class MachineFiles
{
  public:
    Setup load(const std::string &path);

  private:
    std::mutex mutex_;
    std::map<std::string, Setup> known_;
};

// `machine:` of a document, its other sections and the settings.
Setup read_layers(const Map &document, const Settings &settings, MachineFiles &files);

// Refuses values, each within its limits, that together make the plant too stiff to be waited for.
void check_time_constants(const Setup &setup);

void apply_settings(Setup &setup, const Settings &settings);

// The last one of this name.
std::optional<Value> setting_value(const Settings &settings, const std::string &name);

// Refuses a name that is none of `known`, no drive parameter and no section.key.
void check_settings(const Settings &settings, std::vector<std::string> known);

// "section.key" of the key that is called so, but for its unit, or nearly so; nothing where there is none.
std::optional<std::string> nearest_key(const std::string &name);

// A number in degrees, or the word random.
double read_angle(const Value &value, uint64_t seed);

// What `pmsim plant` takes: a machine file, or any document with `machine:`, of a sweep the first run.
struct PlantFile {
    Setup setup;
    double theta_e_rad;
};
PlantFile load_plant_file(const std::string &path, const Settings &settings = {});
PlantFile read_plant_file(const Value &document, const Settings &settings = {});

} // namespace pmsim

#endif
