#include <cstdio>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/methods.h"

namespace pmsim
{

static void print_methods(bool implemented_only)
{
    size_t count = 0, libraries = 0;
    std::printf("%-4s %-9s %-48s %-12s %-22s %s\n", "row", "section", "method", "state", "parameter",
                "shown by");
    for (const Method &method : methods()) {
        count += method.implemented ? 1 : 0;
        if (method.implemented || !implemented_only) {
            const bool library = method.parameter == "none";
            libraries += library ? 1 : 0;
            const char *shown = library ? "(in no image yet)" : method.parameter.c_str();
            const char *parameter = method.parameter.empty() && method.implemented ? "(always)" : shown;
            std::printf("%-4d %-9s %-48s %-12s %-22s %s\n", method.row, method.section.c_str(),
                        method.name.c_str(), method.implemented ? "implemented" : "not yet", parameter,
                        method.scenario.c_str());
        }
    }
    std::printf("%zu of %zu implemented, %zu of them in no image yet\n", count, methods().size(), libraries);
}

void add_methods_command(Command &app)
{
    Command *command =
        app.add_subcommand("methods", "Print every method of the book: is it here, what selects it");
    auto implemented_only = std::make_shared<bool>(false);
    command->add_flag("--implemented", *implemented_only, "leave out what is not yet here");
    command->footer("A method is shown by tests/scenario/NAME.yaml, a model of the plant by "
                    "tests/unit/FOLDER/NAME_test.cpp; its "
                    "parameter is explained by `pmsim params`.");
    command->callback([implemented_only] { print_methods(*implemented_only); });
}

} // namespace pmsim
