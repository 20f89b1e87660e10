#include "tools/pmsim/other_program.h"

#include <cerrno>
#include <cstring>

#include <unistd.h>

#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{

std::filesystem::path own_folder()
{
    return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

void start_program(const std::filesystem::path &program, const std::vector<std::string> &words)
{
    const std::string name = program.string();
    std::vector<char *> arguments = {const_cast<char *>(name.c_str())};
    for (const std::string &word : words) {
        arguments.push_back(const_cast<char *>(word.c_str()));
    }
    arguments.push_back(nullptr);
    execv(name.c_str(), arguments.data());
    throw InputError(name + ": " + std::strerror(errno));
}

} // namespace pmsim
