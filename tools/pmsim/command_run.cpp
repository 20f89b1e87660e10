#include <memory>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/run_command.h"

namespace pmsim
{

void add_run_command(Command &app, int &exit_code)
{
    Command *command = app.add_subcommand("run", "Run a scenario: the drive's firmware closed on the plant");
    auto options = std::make_shared<RunOptions>();
    add_run_options(*command, *options);
    command->footer(
        "Prints one line per expectation: PASS|FAIL name value bound unit (book section).\n"
        "Exit code: 0 all pass, 1 an expectation fails, 2 bad input.\n\n"
        "Examples:\n"
        "  pmsim run tests/scenario/demo.yaml --out out/demo\n"
        "  pmsim run tests/scenario/demo.yaml --set start.theta_e_deg=120 --set flux_bandwidth=30\n"
        "  pmsim run tests/scenario/ipm_start_grid.yaml --set angle=35 --set direction=-1\n"
        "File formats: docs/pmsim.md");
    command->callback([options, &exit_code] { exit_code = run_and_report(*options); });
}

} // namespace pmsim
