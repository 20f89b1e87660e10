// Starts pmsim-board, which is a program of its own: it is linked with libunicorn, whose licence is GPL-2.
#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/other_program.h"
#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{
namespace
{

// Beside pmsim where it is installed, in its own folder where it is built.
std::filesystem::path find_program()
{
    const std::filesystem::path here = own_folder();
    for (const auto &path : {here / "pmsim-board", here.parent_path() / "pmsim_board" / "pmsim-board"}) {
        if (std::filesystem::exists(path)) {
            return path;
        }
    }
    throw InputError(
        "pmsim-board is not beside pmsim: it is built where libunicorn is installed (tools/setup)");
}

} // namespace

void add_board_command(Command &app)
{
    Command *command = app.add_subcommand(
        "board", "Run a scenario on the emulated board: the flashed image closed on the plant");
    // pmsim-board has its own help
    command->pass_words([](const std::vector<std::string> &words) { start_program(find_program(), words); });
}

} // namespace pmsim
