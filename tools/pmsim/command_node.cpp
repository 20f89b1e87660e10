#include <memory>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/node_command.h"
#include "tools/pmsim/settings_option.h"

namespace pmsim
{

void add_node_command(Command &app, int &exit_code)
{
    Command *command =
        app.add_subcommand("node", "A drive and its motor as a live node on a CAN bus, in real time");
    auto options = std::make_shared<NodeOptions>();
    command->add_option("scenario", options->scenario, "scenario file (YAML): machine, load, temperatures")
        ->required();
    command->add_option("--set", options->settings, settings_help())->one_each();
    add_node_options(*command, *options);
    command->get_option("--can")->required();
    command->add_flag("--quiet", options->quiet, "no live line");
    command->footer(
        "The load and the temperatures of the scenario's profile are played; commands come over the bus.\n\n"
        "Examples:\n"
        "  pmsim node tests/scenario/node.yaml --can vcan0\n"
        "  pmsim node tests/scenario/node.yaml --can socketcand:localhost:29536 --set speed_bandwidth=6");
    command->callback([options, &exit_code] { exit_code = run_node(*options); });
}

} // namespace pmsim
