// What a run tells: one line per expectation, summary.txt, runs.csv and JSON.
#ifndef PMSIM_REPORT_H
#define PMSIM_REPORT_H

#include <string>
#include <vector>

#include "tools/pmsim/runner.h"

namespace pmsim
{

// One expectation over all runs. With several seeds each has its own worst run: `worst` is that of the worst seed,
// `median` and `best` those of the middle one and of the best.
struct Verdict {
    Expectation expectation; // with the bound of the worst run
    Outcome worst, median, best;
    size_t worst_run = 0, passed = 0, runs = 0, seeds = 0;
};

std::vector<Verdict> verdicts(const ScenarioFile &file, const SweepResult &result);
bool all_pass(const std::vector<Verdict> &list);
size_t
worst_run(const std::vector<Verdict> &list); // the run to look at: worst of the first failed, or of all

std::string verdict_lines(const ScenarioFile &file, const std::vector<Verdict> &list);
std::string verdict_json(const ScenarioFile &file, const std::vector<Verdict> &list, double simulated_s,
                         double wall_s);
std::string runs_csv(const ScenarioFile &file, const SweepResult &result);

} // namespace pmsim

#endif
