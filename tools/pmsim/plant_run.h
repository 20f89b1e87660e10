// The plant alone, driven by given phase voltages: `pmsim plant`.
//
// Input and output columns: docs/pmsim.md. A row's voltages and load hold until the next row; an imposed
// speed moves linearly between rows. Terminals that float are off the sources. Output: the state at each
// row's time, as CSV text.
// Tests: tests/unit/pmsim/plant_run_test.cpp, plant_command_test.py.
#ifndef PMSIM_PLANT_RUN_H
#define PMSIM_PLANT_RUN_H

#include <functional>
#include <string>

#include "tools/pmsim/csv.h"
#include "tools/pmsim/machine_file.h"

namespace pmsim
{

// Terminals by their names a b c x y z, bit k for leg k; throws InputError for one that the machine does not
// have.
unsigned floating_legs(const std::vector<std::string> &names, const Setup &setup);

// Terminals that float need no voltage.
Csv load_plant_input(const std::string &path, const Setup &setup, unsigned floating = 0);
Csv read_plant_input(const std::string &text, const std::string &name, const Setup &setup,
                     unsigned floating = 0);

struct PlantOutput {
    std::string csv;
    std::string note; // for the user; "" when there is nothing to say
};

// `progress`, if given, hears of the fraction done after each row.
PlantOutput run_plant(const PlantFile &file, const Csv &input,
                      const std::function<void(double)> &progress = nullptr, unsigned floating = 0);

} // namespace pmsim

#endif
