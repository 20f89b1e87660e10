// The keys of a machine file, as tools/machine_keys.txt has them for tools/tune.py, which runs without pmsim too.
#include <cstdio>
#include <type_traits>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/setup_fields.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

struct Kind { // of a member
    const char *operator()(double *) const
    {
        return "number";
    }
    const char *operator()(int *) const
    {
        return "whole";
    }
    const char *operator()(uint32_t *) const
    {
        return "whole";
    }
    const char *operator()(bool *) const
    {
        return "flag";
    }
    const char *operator()(List) const
    {
        return "list";
    }
    const char *operator()(Harmonics) const
    {
        return "list";
    }
    template <class Choice> const char *operator()(Choice *) const
    {
        static_assert(std::is_enum_v<Choice>);
        return "word";
    }
};

void print_keys()
{
    Setup setup = default_setup();
    std::printf("# pmsim keys > tools/machine_keys.txt\n");
    for (const Field &field : setup_fields()) {
        const std::string kind = std::visit(Kind{}, field.target(setup));
        const bool is_number = kind == "number" || kind == "whole";
        const std::string limits = is_number ? " " + format(field.min, 9) + " " + format(field.max, 9) : "";
        std::printf("%s.%s %s%s\n", field.section, field.key, kind.c_str(), limits.c_str());
    }
}

} // namespace

void add_keys_command(Command &app)
{
    app.add_subcommand(
           "keys", "Print the keys of a machine file but those of `drive` (`pmsim params`) and `flux_map`")
        ->callback(print_keys);
}

} // namespace pmsim
