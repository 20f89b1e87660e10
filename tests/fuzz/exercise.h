// What the targets share: a file that was accepted must make a plant that runs, or be refused by name.
#ifndef PM_FUZZ_EXERCISE_H
#define PM_FUZZ_EXERCISE_H

#include <cstddef>
#include <cstdint>
#include <string>

#include "tools/pmsim/machine_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

namespace fuzz
{

inline std::string text_of(const uint8_t *data, size_t size)
{
    return std::string(data, data + size);
}

// Makes the plant, runs a few PWM periods of it in steps of one, with the inverter and from ideal sources,
// and traps if a number is no longer finite. Throws InputError when plant_create() refuses. Stops early when
// the machine is slow to integrate.
void exercise(const pmsim::Setup &setup, double theta_e_rad);

} // namespace fuzz

#endif
