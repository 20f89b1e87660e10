#include <cstdio>
#include <fstream>
#include <memory>

#include "firmware/params/parameters.h"
#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/drive_parameters.h"
#include "tools/pmsim/input_files.h"
#include "tools/pmsim/machine_file.h"
#include "tools/pmsim/metrics.h"
#include "tools/pmsim/settings_option.h"
#include "tools/pmsim/text.h"

extern "C" {
#include "tools/pmsim/parameter_page.h"
}

namespace pmsim
{

// Between the limits the defaults, or the values of a machine; below a choice what its numbers mean.
static void print_parameters(const char *title, const drive_params_t &params)
{
    std::printf("%-24s %-7s %12s %12s %12s  %s\n", "name", "unit", "min", title, "max", "help");
    for (int i = 0; i < DRIVE_PARAM_COUNT; ++i) {
        const auto id = static_cast<drive_param_id_t>(i);
        const drive_param_info_t &info = drive_param_table[id];
        std::printf("%-24s %-7s %12s %12s %12s  %s\n", info.name, drive_param_text[id].unit,
                    format(parameter_si(id, info.min)).c_str(), format(parameter_si(params, id)).c_str(),
                    format(parameter_si(id, info.max)).c_str(), drive_param_text[id].help);
        for (const ParameterChoice &choice : parameter_choices(id)) {
            std::printf("%5d  %s\n", choice.value, choice.meaning);
        }
    }
}

namespace
{

struct PageOptions {
    std::string machine, page;
    std::vector<std::string> settings;
};

// The page goes to any port; the board that the images are for is the one whose limits are known.
void warn_of_board(const Setup &setup)
{
    const char *refused = nullptr;
    const char *reason = nullptr;
    if (!parameter_page_suits_board(setup.params.get(), &refused, &reason)) {
        std::fprintf(stderr, "warning: a B-G431B-ESC1 refuses parameter %s: %s\n", refused, reason);
    }
    if (setup.params->t_settle == 0) {
        std::fprintf(
            stderr,
            "warning: t_settle is 0, for shunts in the lines; those of a B-G431B-ESC1 are below the lower "
            "switches: give the machine file sensor: {i_full_scale_A: 60.16, v_full_scale_V: 34.28, "
            "shunt: low_side, settle_s: 1.3e-6}\n");
    }
}

Setup read_setup(const PageOptions &options)
{
    Setup setup = load_plant_file(options.machine, parse_settings(options.settings)).setup;
    require_drive(setup);
    return setup;
}

// The page of the parameter store that a board finds at its next start.
void write_page(const PageOptions &options)
{
    const Setup setup = read_setup(options);
    uint32_t words[STORE_WORDS];
    const char *refused = nullptr;
    const char *reason = nullptr;
    const uint32_t used = parameter_page(setup.params.get(), words, &refused, &reason);
    if (used == 0) {
        throw InputError(options.machine + ": drive refuses parameter " + refused + ": " + reason);
    }
    refuse_input_as_output(options.page);
    std::ofstream file(options.page, std::ios::binary);
    file.write(reinterpret_cast<const char *>(words), std::streamsize(used * sizeof words[0]));
    if (!file.flush()) {
        throw InputError(options.page + ": cannot be written");
    }
    std::printf("%s: %u bytes, %s\n", options.page.c_str(), unsigned(used * sizeof words[0]),
                setup.name.c_str());
    warn_of_board(setup);
}

} // namespace

static void print_metrics()
{
    for (const MetricInfo &info : metric_infos()) {
        std::printf("%-30s %-5s %s\n", info.name.c_str(), info.unit.c_str(), info.help.c_str());
    }
}

void add_params_command(Command &app)
{
    Command *command = app.add_subcommand(
        "params",
        "Print the drive's parameters: name, unit, range, default or a machine's "
        "value, help, what the numbers of a choice mean; or make the page of them that a board is given");
    auto options = std::make_shared<PageOptions>();
    Option *machine =
        command->add_option("--machine", options->machine, "machine file whose parameters to take");
    command->add_option("--set", options->settings, settings_help())->one_each()->needs(machine);
    command->add_option("--page", options->page, "write them as a page of the board's parameter store")
        ->needs(machine);
    command->footer("These names go into `drive:` of machine and scenario files and after --set, in SI.\n\n"
                    "Example:\n"
                    "  pmsim params --machine tuned.yaml --page my_motor.bin && tools/flash --parameters "
                    "my_motor.bin");
    command->callback([options] {
        if (!options->page.empty()) {
            write_page(*options);
        } else if (!options->machine.empty()) {
            print_parameters("value", *read_setup(*options).params);
        } else {
            print_parameters("default", *Parameters());
        }
    });
}

void add_metrics_command(Command &app)
{
    app.add_subcommand("metrics", "Print what a scenario's `expect:` can ask for")->callback(print_metrics);
}

} // namespace pmsim
