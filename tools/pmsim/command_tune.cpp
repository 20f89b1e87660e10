// Starts tools/tune.py, which shares its rules with `pmdrive tune`.
#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/other_program.h"
#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{
namespace
{

// Of the source tree in which pmsim was built.
std::filesystem::path find_script()
{
    const std::filesystem::path here = own_folder();
    for (std::filesystem::path folder = here; folder != folder.parent_path(); folder = folder.parent_path()) {
        const std::filesystem::path script = folder / "tools" / "tune.py";
        if (std::filesystem::exists(script)) {
            return script;
        }
    }
    throw InputError("tools/tune.py is in no folder above " + here.string());
}

} // namespace

void add_tune_command(Command &app)
{
    Command *command = app.add_subcommand(
        "tune", "Complete a machine file from ten values of the motor, each choice with its reason");
    // tools/tune.py has its own help
    command->pass_words([](const std::vector<std::string> &words) { start_program(find_script(), words); });
}

} // namespace pmsim
