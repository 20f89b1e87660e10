// Programs that pmsim starts in its place: their licence or language is another.
#ifndef PMSIM_OTHER_PROGRAM_H
#define PMSIM_OTHER_PROGRAM_H

#include <filesystem>
#include <string>
#include <vector>

namespace pmsim
{

std::filesystem::path own_folder(); // of the program that runs

// Does not come back; throws when the program cannot be started.
[[noreturn]] void start_program(const std::filesystem::path &program, const std::vector<std::string> &words);

} // namespace pmsim

#endif
