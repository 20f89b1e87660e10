// Starts pmsim-board, which is a program of its own: it is linked with libunicorn, whose licence is GPL-2.
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <unistd.h>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{
namespace
{

// Beside pmsim where it is installed, in its own folder where it is built.
std::filesystem::path find_program()
{
    const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    for (const auto &path : {here / "pmsim-board", here.parent_path() / "pmsim_board" / "pmsim-board"}) {
        if (std::filesystem::exists(path)) {
            return path;
        }
    }
    throw InputError(
        "pmsim-board is not beside pmsim: it is built where libunicorn is installed (tools/setup)");
}

void start(const std::vector<std::string> &words)
{
    const std::string program = find_program().string();
    std::vector<char *> arguments = {const_cast<char *>(program.c_str())};
    for (const std::string &word : words) {
        arguments.push_back(const_cast<char *>(word.c_str()));
    }
    arguments.push_back(nullptr);
    execv(program.c_str(), arguments.data());
    throw InputError(program + ": " + std::strerror(errno));
}

} // namespace

void add_board_command(Command &app)
{
    Command *command = app.add_subcommand(
        "board", "Run a scenario on the emulated board: the flashed image closed on the plant");
    command->pass_words(start); // pmsim-board has its own help
}

} // namespace pmsim
