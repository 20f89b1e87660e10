// What is on the bench: plant, rated values and the drive's parameters.
//
// Machine file and scenario share the same sections (setup_sections()); the scenario is laid over the machine
// file, key by key. Keys carry their unit. A machine file must say what describes the machine; `rated` and
// `drive` are needed only to run the firmware on it (require_drive()). Format: docs/pmsim.md.
// Tests: tests/unit/pmsim/machine_file_test.cpp, winding_section_test.cpp.
#ifndef PMSIM_SETUP_H
#define PMSIM_SETUP_H

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/pmsim/drive_parameters.h"
#include "tools/pmsim/flux_map.h"
#include "tools/pmsim/similarity.h"
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
    std::string file; // of the machine
    plant_config_t plant;
    std::shared_ptr<const FluxMap> flux_map; // owner of plant.map; null: energy form
    double trapezoid_flat_deg;               // of the EMF; negative: none
    Rated rated;
    double i_break_A; // over-current comparator of the board; 0: none
    Parameters params;
    std::map<std::string, Place> given; // "section.key": where it stands, the last time
    Similarity similarity;              // to what the files say
};

const std::vector<std::string> &setup_sections(); // including "drive"
std::vector<std::string> section_keys(const std::string &section);

// METHODS.md 0.3: 10 kHz, 2 us dead time, 12 bits of +-10 A with 0.5 LSB noise, 300 V class drops.
Setup default_setup();

// Reads the sections that are present. In a machine file every value that describes the machine must be.
void read_sections(Setup &setup, const Map &map, bool is_machine_file);
void read_setting(Setup &setup, const std::string &section, const std::string &key, const Value &value);

// The parameters that follow from inverter and sensors, unless `drive:` says otherwise on purpose.
void derive_board_parameters(Setup &setup);

// Three phases: 3; two sets or an open winding: 6.
int leg_count(const plant_config_t &plant);
const std::vector<std::string> &leg_names(); // a b c x y z

// One value per leg, "[a, b, c]"; the rest of the six stay as they are.
void read_legs(const Value &value, int legs, double min, double max, double *first);

// Refuses a setup that the firmware cannot run: no rated values or parameters, a single shunt.
void require_drive(const Setup &setup);

// What plant_create() says of the setup, as an error of the file and key that say it.
[[noreturn]] void refuse_plant(const Setup &setup, const std::string &reason);

} // namespace pmsim

#endif
