#include <cstdio>

#include <CLI/CLI.hpp>

#include "tools/pmsim/commands.h"
#include "tools/pmsim/drive_parameters.h"
#include "tools/pmsim/metrics.h"
#include "tools/pmsim/text.h"

namespace pmsim
{

static void print_parameters()
{
    std::printf("%-24s %-7s %12s %12s %12s  %s\n", "name", "unit", "min", "default", "max", "help");
    for (int i = 0; i < DRIVE_PARAM_COUNT; ++i) {
        const auto id = static_cast<drive_param_id_t>(i);
        const drive_param_info_t &info = drive_param_table[id];
        std::printf("%-24s %-7s %12s %12s %12s  %s\n", info.name, info.unit,
                    format(parameter_si(id, info.min)).c_str(), format(parameter_si(id, info.def)).c_str(),
                    format(parameter_si(id, info.max)).c_str(), info.help);
    }
}

static void print_metrics()
{
    for (const MetricInfo &info : metric_infos()) {
        std::printf("%-30s %-5s %s\n", info.name.c_str(), info.unit.c_str(), info.help.c_str());
    }
}

void add_params_command(CLI::App &app)
{
    app.add_subcommand("params", "Print the drive's parameters: name, unit, range, default, help")
        ->footer("These names go into `drive:` of machine and scenario files and after --set, in SI.")
        ->callback(print_parameters);
}

void add_metrics_command(CLI::App &app)
{
    app.add_subcommand("metrics", "Print what a scenario's `expect:` can ask for")->callback(print_metrics);
}

} // namespace pmsim
