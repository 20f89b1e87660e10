// pmsim: the drive's firmware on a simulated motor. `pmsim --help` explains.
#include <exception>
#include <iostream>

#include <CLI/CLI.hpp>

#include "tools/pmsim/commands.h"
#include "tools/pmsim/yaml_reader.h"

int main(int argc, char **argv)
{
    CLI::App app("pmsim: the drive's firmware, bit for bit, on a simulated motor and inverter.");
    app.require_subcommand(1);
    app.footer("`pmsim COMMAND --help` explains a command. File formats: docs/pmsim.md");
    int exit_code = 0;
    pmsim::add_run_command(app, exit_code);
    pmsim::add_board_command(app);
    pmsim::add_plant_command(app);
    pmsim::add_node_command(app, exit_code);
    pmsim::add_params_command(app);
    pmsim::add_metrics_command(app);
    pmsim::add_methods_command(app);
    pmsim::add_bench_command(app);
    pmsim::add_record_command(app);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError &error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const std::exception &error) {
        std::cerr << "pmsim: " << error.what() << '\n';
        return 2;
    }
    return exit_code;
}
