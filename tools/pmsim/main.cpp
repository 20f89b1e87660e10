// pmsim: the drive's firmware on a simulated motor. `pmsim --help` explains.
#include <exception>
#include <iostream>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/yaml_reader.h"

int main(int argc, char **argv)
{
    pmsim::CommandLine app("pmsim: the drive's firmware, bit for bit, on a simulated motor and inverter.");
    app.require_subcommand();
    app.footer("`pmsim COMMAND --help` explains a command. File formats: docs/pmsim.md");
    int exit_code = 0;
    pmsim::add_run_command(app, exit_code);
    pmsim::add_board_command(app);
    pmsim::add_plant_command(app);
    pmsim::add_node_command(app, exit_code);
    pmsim::add_params_command(app);
    pmsim::add_tune_command(app);
    pmsim::add_metrics_command(app);
    pmsim::add_keys_command(app);
    pmsim::add_methods_command(app);
    pmsim::add_bench_command(app);
    pmsim::add_record_command(app);
    try {
        if (const std::optional<int> code = app.parse(argc, argv)) {
            return pmsim::finish(*code);
        }
    } catch (const std::exception &error) {
        std::cerr << "pmsim: " << error.what() << '\n';
        return 2;
    }
    return pmsim::finish(exit_code);
}
