#include "tools/pmsim/run_command.h"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>

#include <unistd.h>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/input_files.h"
#include "tools/pmsim/notes.h"
#include "tools/pmsim/report.h"
#include "tools/pmsim/settings_option.h"
#include "tools/pmsim/text.h"
#include "tools/pmsim/trace.h"

namespace pmsim
{
namespace
{

const char trace_name[] = "trace.csv", summary_name[] = "summary.txt", result_name[] = "result.json",
           runs_name[] = "runs.csv";

void write_file(const std::filesystem::path &path, const std::string &text)
{
    std::ofstream file(path, std::ios::binary);
    file << text;
    if (!file.flush()) {
        throw InputError(path.string() + ": cannot be written");
    }
}

// Of all files that a run leaves in its folder.
void check_out(const ScenarioFile &file, const std::filesystem::path &out)
{
    refuse_input_as_output((out / trace_name).string());
    refuse_input_as_output((out / summary_name).string());
    refuse_input_as_output((out / result_name).string());
    if (file.runs().size() > 1) {
        refuse_input_as_output((out / runs_name).string());
    }
}

// The run worth looking at is run once more with the trace on: the same, since runs are deterministic.
void write_trace(const ScenarioFile &file, const Run &run, const std::filesystem::path &path,
                 uint64_t decimate)
{
    const Scenario scenario = file.scenario(run);
    TraceWriter trace(path.string(), scenario, decimate);
    run_scenario(scenario, [&trace](const Sample &sample) { trace.add(sample); });
    trace.close();
}

std::string timing_line(const ScenarioFile &file, double simulated_s, double wall_s)
{
    return std::to_string(file.runs().size()) + (file.runs().size() == 1 ? " run, " : " runs, ") +
           format(simulated_s, 4) + " s simulated\n" +
           (wall_s > 0.0
                ? "in " + format(wall_s, 3) + " s, " + format(simulated_s / wall_s, 3) + " x real time\n"
                : "");
}

} // namespace

void add_run_options(Command &command, RunOptions &options)
{
    command.add_option("scenario", options.scenario, "scenario file (YAML)")->required();
    command.add_option("--set", options.settings, settings_help())->one_each();
    command.add_option(
        "--out", options.out,
        "folder for trace.csv, summary.txt, result.json and, with a sweep, runs.csv; the trace "
        "shows the worst run");
    command
        .add_option("--decimate", options.decimate,
                    "one trace row every N periods (default: at most 20000 rows)")
        ->positive();
    command.add_option("--jobs", options.jobs, "runs of a sweep at the same time")
        ->positive()
        ->show_default();
    command
        .add_option(
            "--seeds", options.seeds,
            "run everything with so many seeds, from the scenario's own on; a bound must hold for each")
        ->positive()
        ->show_default();
    command
        .add_option("--only", options.only,
                    "the run of this name alone, as `worst:` gives it, may be repeated; with --seeds where "
                    "it has a seed")
        ->one_each();
    command.add_flag("--quiet", options.quiet, "expectations only, no progress");
    command.add_flag("--json", options.json, "result as JSON on standard output");
}

int run_and_report(const RunOptions &options)
{
    ScenarioFile file(options.scenario, parse_settings(options.settings));
    if (options.seeds > 1) {
        file.repeat(options.seeds);
    }
    if (!options.only.empty()) {
        file.keep(options.only);
    }
    print_notes(file.scenario(file.runs().front()).setup);
    const std::filesystem::path out = options.out;
    if (!options.out.empty()) {
        check_out(file, out); // before the work, so that it is not lost
        std::filesystem::create_directories(out);
    }
    const auto start = std::chrono::steady_clock::now();
    const bool on_terminal = isatty(STDERR_FILENO) != 0 && !options.quiet;
    const SweepResult result = run_all(file, options.jobs, on_terminal);
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    double simulated_s = 0.0;
    for (const RunResult &one : result.runs) {
        simulated_s += one.simulated_s;
    }
    const std::vector<Verdict> list = verdicts(file, result);
    const std::string lines = verdict_lines(file, list);
    if (!options.out.empty()) {
        check_out(file, out); // each run of a sweep may have read a machine of its own
        const Run &shown = file.runs()[worst_run(list)];
        write_trace(file, shown, out / trace_name, options.decimate);
        const std::string traced = shown.name.empty() ? "" : "trace.csv: " + shown.name + "\n";
        write_file(out / summary_name,
                   file.title() + "\n" + lines + timing_line(file, simulated_s, 0.0) + traced);
        write_file(out / result_name, verdict_json(file, list, simulated_s, wall_s));
        if (file.runs().size() > 1) {
            write_file(out / runs_name, runs_csv(file, result));
        }
    }
    if (options.json) {
        std::cout << verdict_json(file, list, simulated_s, wall_s);
    } else if (!options.quiet) {
        std::cout << file.title() << '\n' << lines << timing_line(file, simulated_s, wall_s);
    } else {
        std::cout << lines;
    }
    return all_pass(list) ? 0 : 1;
}

} // namespace pmsim
