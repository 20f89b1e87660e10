#include <iostream>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/input_files.h"
#include "tools/pmsim/loop.h"
#include "tools/pmsim/notes.h"
#include "tools/pmsim/record_file.h"
#include "tools/pmsim/settings_option.h"

namespace pmsim
{
namespace
{

struct Options {
    std::string scenario, out;
    std::vector<std::string> settings;
    uint64_t periods = UINT64_MAX;
};

void record(const Options &options)
{
    const ScenarioFile file(options.scenario, parse_settings(options.settings));
    if (file.runs().size() != 1) {
        throw InputError(options.scenario + ": stands for " + std::to_string(file.runs().size()) +
                         " runs; choose one with --set");
    }
    const Scenario scenario = file.scenario(file.runs().front());
    refuse_input_as_output(options.out); // before the work, so that it is not lost
    print_notes(scenario.setup);
    const Recording recording = record_scenario(scenario, options.periods);
    write_recording(recording, options.out);
    std::cout << options.out << ": " << recording.periods.size() << " control periods\n";
}

} // namespace

void add_record_command(Command &app)
{
    Command *command =
        app.add_subcommand("record", "Record what goes into the drive and comes out, to replay it elsewhere");
    auto options = std::make_shared<Options>();
    command->add_option("scenario", options->scenario, "scenario file (YAML)")->required();
    command->add_option("--out", options->out, "file to write; format: tools/pmsim/record.h")->required();
    command->add_option("--periods", options->periods, "stop after this many control periods")->positive();
    command->add_option("--set", options->settings, settings_help())->one_each();
    command->footer(
        "The record holds converter codes, commands and timer counts of every control period, so a\n"
        "target that replays it must give the same bits.\n\n"
        "Example:\n"
        "  pmsim record tests/scenario/demo.yaml --periods 10000 --out out/demo.rec");
    command->callback([options] { record(*options); });
}

} // namespace pmsim
