// What is on the bench: plant, rated values and the drive's parameters.
//
// Machine file and scenario share the same sections (electrical, mechanics, rated, inverter, sensor, dclink,
// solver, drive); the scenario is laid over the machine file, key by key. Keys carry their unit. Format:
// docs/pmsim.md. Tests: tests/unit/pmsim/machine_file_test.cpp.
#ifndef PMSIM_SETUP_H
#define PMSIM_SETUP_H

#include <set>
#include <string>
#include <vector>

#include "tools/pmsim/drive_parameters.h"
#include "tools/pmsim/yaml_reader.h"

extern "C" {
#include "sim_plant/plant.h"
}

namespace pmsim
{

struct Rated {
    double i_rated_A;
    double speed_rated_rad_s; // mechanical
    double torque_rated_Nm;
    double v_dc_V;
};

struct Setup {
    std::string name;
    plant_config_t plant;
    Rated rated;
    double i_break_A; // over-current comparator of the board; 0: none
    drive_params_t params;
    std::set<drive_param_id_t> given; // parameters that stand in a file: not derived from the board's data
};

const std::vector<std::string> &setup_sections(); // including "drive"
std::vector<std::string> section_keys(const std::string &section);

// METHODS.md 0.3: 10 kHz, 2 us dead time, 12 bits of +-10 A with 0.5 LSB noise, 300 V class drops.
Setup default_setup();

// Reads the sections that are present. In a machine file every value that describes the machine must be.
void read_sections(Setup &setup, const Map &map, bool is_machine_file);
void read_setting(Setup &setup, const std::string &section, const std::string &key, const Value &value);

} // namespace pmsim

#endif
