// The files that this process has read, so that none of them is written over.
//
// Whoever reads a file names it with note_input(); whoever is about to write one asks first. Paths are
// compared as files: relative paths, symbolic and hard links are seen through. Any thread may call. Tests:
// command_test.py, plant_command_test.py.
#ifndef PMSIM_INPUT_FILES_H
#define PMSIM_INPUT_FILES_H

#include <string>

namespace pmsim
{

void note_input(const std::string &path);

// Throws InputError, which names both, when writing `path` would write over an input.
void refuse_input_as_output(const std::string &path);

} // namespace pmsim

#endif
