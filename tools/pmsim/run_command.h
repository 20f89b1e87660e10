// What `pmsim run` and `pmsim board` have in common: options, runs, report.
#ifndef PMSIM_RUN_COMMAND_H
#define PMSIM_RUN_COMMAND_H

#include <cstdint>
#include <string>
#include <vector>

namespace pmsim
{

class Command;

struct RunOptions {
    std::string scenario, out;
    std::vector<std::string> settings, only;
    uint64_t decimate = 0;
    int jobs = 2, seeds = 1;
    bool quiet = false, json = false;
};

void add_run_options(Command &command, RunOptions &options);

// Runs, prints the expectations, writes files. Exit code: 0 all pass, 1 an expectation fails.
int run_and_report(const RunOptions &options);

} // namespace pmsim

#endif
