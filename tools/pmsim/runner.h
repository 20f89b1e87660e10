// Runs scenarios: one period after the other, many runs side by side.
//
// Deterministic: a run depends on the scenario alone, whatever the number of threads. Cost beside drive and
// plant: well under a microsecond per period, more when a trace is written.
#ifndef PMSIM_RUNNER_H
#define PMSIM_RUNNER_H

#include <atomic>
#include <functional>
#include <vector>

#include "tools/pmsim/metrics.h"
#include "tools/pmsim/scenario_file.h"

namespace pmsim
{

using Observer = std::function<void(const Sample &)>; // called every period

struct RunResult {
    std::vector<Outcome> outcomes; // in the order of expect:
    double simulated_s = 0.0;
};

// `progress`, if given, counts simulated microseconds.
RunResult run_scenario(const Scenario &scenario, const Observer &observer = nullptr,
                       std::atomic<uint64_t> *progress = nullptr);

struct SweepResult {
    std::vector<RunResult> runs; // in the order of ScenarioFile::runs()
};

SweepResult run_all(const ScenarioFile &file, int jobs, bool show_progress);

} // namespace pmsim

#endif
