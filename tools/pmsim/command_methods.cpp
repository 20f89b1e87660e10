#include <cstdio>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/methods.h"

namespace pmsim
{

struct Asked {
    bool implemented_only = false, classes_only = false;
    int of = -1; // classes: all
};

static void print_method(const Method &method)
{
    const char *shown = method.parameter == "none" ? "(in no image yet)" : method.parameter.c_str();
    const char *parameter = method.parameter.empty() && method.implemented ? "(always)" : shown;
    std::printf("%-4d %-9s %-48s %-12s %-22s %s\n", method.row, method.section.c_str(), method.name.c_str(),
                method.implemented ? "implemented" : "not yet", parameter, method.scenario.c_str());
}

static void print_methods(const Asked &asked)
{
    const auto mask = static_cast<unsigned>(asked.of);
    size_t all = 0, count = 0, libraries = 0;
    std::printf("%-4s %-9s %-48s %-12s %-22s %s\n", "row", "section", "method", "state", "parameter",
                "shown by");
    for (const Method &method : methods()) {
        if ((method.classes & mask) == 0) {
            continue;
        }
        all += 1;
        count += method.implemented ? 1 : 0;
        libraries += method.parameter == "none" ? 1 : 0;
        if (method.implemented || !asked.implemented_only) {
            print_method(method);
        }
    }
    std::printf("%zu of %zu implemented, %zu of them in no image yet\n", count, all, libraries);
}

static void print_classes()
{
    std::printf("%-14s %7s %6s  %s\n", "class", "methods", "here", "what it is");
    for (const MethodClass &one : method_classes()) {
        size_t all = 0, here = 0;
        for (const Method &method : methods()) {
            const bool is_of = (method.classes & one.mask) != 0;
            all += is_of ? 1 : 0;
            here += is_of && method.implemented ? 1 : 0;
        }
        std::printf("%-14s %7zu %6zu  %s\n", one.word.c_str(), all, here, one.help.c_str());
    }
}

void add_methods_command(Command &app)
{
    Command *command =
        app.add_subcommand("methods", "Print every method of the book: is it here, what selects it");
    auto asked = std::make_shared<Asked>();
    std::map<std::string, int> words;
    for (const MethodClass &one : method_classes()) {
        words[one.word] = static_cast<int>(one.mask);
    }
    command->add_flag("--implemented", asked->implemented_only, "leave out what is not yet here");
    command->add_option("--class", asked->of, "those of one class alone")->words(words);
    command->add_flag("--classes", asked->classes_only,
                      "the classes instead: what each is, how many methods");
    command->footer("A method is shown by tests/scenario/NAME.yaml, a model of the plant by "
                    "tests/unit/FOLDER/NAME_test.cpp; its "
                    "parameter is explained by `pmsim params`.");
    command->callback([asked] {
        if (asked->classes_only) {
            print_classes();
        } else {
            print_methods(*asked);
        }
    });
}

} // namespace pmsim
