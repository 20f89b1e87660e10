// Machine files: sim_plant/machines/*.yaml. Format: docs/pmsim.md.
#ifndef PMSIM_MACHINE_FILE_H
#define PMSIM_MACHINE_FILE_H

#include <string>

#include "tools/pmsim/setup.h"

namespace pmsim
{

Setup read_machine(const Value &value); // the content of a machine file
Setup load_machine_file(const std::string &path);

} // namespace pmsim

#endif
