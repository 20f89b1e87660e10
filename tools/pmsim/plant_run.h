// The plant alone, driven by given phase voltages: `pmsim plant`.
//
// Input and output columns: docs/pmsim.md. A row's voltages and load hold until the next row; an imposed
// speed moves linearly between rows. Output: the state at each row's time, as CSV text.
// Tests: tests/unit/pmsim/plant_run_test.cpp, plant_command_test.py.
#ifndef PMSIM_PLANT_RUN_H
#define PMSIM_PLANT_RUN_H

#include <functional>
#include <string>

#include "tools/pmsim/csv.h"
#include "tools/pmsim/machine_file.h"

namespace pmsim
{

Csv load_plant_input(const std::string &path, const Setup &setup);
Csv read_plant_input(const std::string &text, const std::string &name, const Setup &setup);

struct PlantOutput {
    std::string csv;
    std::string note; // for the user; "" when there is nothing to say
};

// `progress`, if given, hears of the fraction done after each row.
PlantOutput run_plant(const PlantFile &file, const Csv &input,
                      const std::function<void(double)> &progress = nullptr);

} // namespace pmsim

#endif
