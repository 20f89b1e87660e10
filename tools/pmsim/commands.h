// The commands of pmsim. Each declares its options on its subcommand and sets the exit code when it runs:
// 0 done, 1 an expectation failed, 2 bad input.
#ifndef PMSIM_COMMANDS_H
#define PMSIM_COMMANDS_H

namespace pmsim
{

class Command;

void add_run_command(Command &app, int &exit_code);
void add_board_command(Command &app);
void add_plant_command(Command &app);
void add_node_command(Command &app, int &exit_code);
void add_params_command(Command &app);
void add_tune_command(Command &app);
void add_metrics_command(Command &app);
void add_keys_command(Command &app);
void add_methods_command(Command &app);
void add_bench_command(Command &app);
void add_record_command(Command &app);

} // namespace pmsim

#endif
