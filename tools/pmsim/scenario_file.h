// Scenario files: one file, one or many runs. Format: docs/pmsim.md.
// Tests: tests/unit/pmsim/scenario_file_test.cpp.
#ifndef PMSIM_SCENARIO_FILE_H
#define PMSIM_SCENARIO_FILE_H

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/pmsim/machine_file.h"
#include "tools/pmsim/scenario.h"

namespace pmsim
{

struct Run {
    std::string name; // "angle=30 direction=-1"; empty when the file has a single run
    Variables variables;
    std::optional<uint64_t> seed; // before the scenario's own
};

class ScenarioFile
{
  public:
    explicit ScenarioFile(const std::string &path, Settings settings = {});
    ScenarioFile(const Value &document, Settings settings);

    std::string title() const;
    const std::vector<Run> &runs() const;
    void
    repeat(int seeds); // each run with so many seeds, from the scenario's own on: one more variable, `seed`
    void keep(const std::vector<std::string> &names); // the runs of these names alone
    Scenario scenario(const Run &run) const;          // reads the whole document with the run's variables

  private:
    Value document_;
    Settings settings_;
    std::shared_ptr<MachineFiles> machines_ = std::make_shared<MachineFiles>();
    std::vector<Run> runs_;
};

Map open_scenario(const Value &document); // refuses unknown keys

// All combinations of `cases` and `sweep`; a variable in `fixed` keeps that one value.
std::vector<Run> expand_runs(const Map &document, const Variables &fixed);
std::vector<std::string> variable_names(const Map &document);
void refuse_unused_variables(const Map &document);

Event read_event(const Value &value, const Setup &setup);
Expectation read_expectation(const Value &value);

} // namespace pmsim

#endif
