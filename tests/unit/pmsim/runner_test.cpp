#include "tools/pmsim/runner.h"

#include <atomic>
#include <cmath>
#include <fstream>
#include <numeric>
#include <sstream>
#include <vector>

#include <gmock/gmock.h>

#include "firmware/params/parameters.h"
#include "tests/support/temporary_file.h"
#include "tests/unit/pmsim/support.h"
#include "tools/pmsim/loop.h"
#include "tools/pmsim/record_file.h"
#include "tools/pmsim/report.h"
#include "tools/pmsim/trace.h"

namespace pmsim
{
namespace
{

using testing::HasSubstr;
using testing::StartsWith;

ScenarioFile file_of(const std::string &text)
{
    return ScenarioFile(Value::from_text(text, "s.yaml"), {});
}

Scenario load(const std::string &text)
{
    const ScenarioFile file = file_of(text);
    return file.scenario(file.runs().front());
}

std::string content(const std::string &path)
{
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

std::string trace_of(const std::string &text, const std::string &name)
{
    const tests::TemporaryFile file(name);
    const Scenario scenario = load(text);
    TraceWriter trace(file.path(), scenario, 7);
    run_scenario(scenario, [&trace](const Sample &sample) { trace.add(sample); });
    trace.close();
    return content(file.path());
}

TEST(Runner, EachSeedHasItsWorstRunAndTheyAreRanked)
{
    ScenarioFile file = file_of(replaced(small_scenario(), ": 30", ": $angle") + "sweep: {angle: [0, 1]}\n");
    file.repeat(3);
    ASSERT_EQ(file.runs().size(), 6U);
    EXPECT_EQ(file.runs()[1].name, "angle=0 seed=2");
    EXPECT_EQ(file.scenario(file.runs()[1]).seed, 2U);
    Expectation expectation;
    expectation.max = 10;
    SweepResult result;
    for (const double value : {1.0, 2.0, 9.0, 3.0, 5.0, 4.0}) {
        const size_t count = file.scenario(file.runs().front()).expect.size();
        result.runs.push_back({std::vector<Outcome>(count, judge(expectation, {value, ""})), 0.0});
    }
    const Verdict seen = verdicts(file, result).front();
    EXPECT_EQ(seen.seeds, 3U);
    EXPECT_EQ(seen.worst.value.number, 9);  // of seed 3
    EXPECT_EQ(seen.median.value.number, 5); // of seed 2
    EXPECT_EQ(seen.best.value.number, 3);   // of seed 1
    EXPECT_EQ(seen.worst_run, 2U);
}

TEST(Runner, RunsAreKeptByTheirNames)
{
    ScenarioFile file = file_of(replaced(small_scenario(), ": 30", ": $angle") + "sweep: {angle: [0, 1]}\n");
    file.repeat(2);
    file.keep({"angle=1 seed=2", "angle=0 seed=1", "angle=1 seed=2"});
    ASSERT_EQ(file.runs().size(), 2U);
    EXPECT_EQ(file.runs()[0].name, "angle=0 seed=1");
    EXPECT_EQ(file.scenario(file.runs()[1]).seed, 2U);
    EXPECT_EQ(error_of([&file] { file.keep({"angle=0"}); }),
              "no run is called 'angle=0'; the first of 2 is 'angle=0 seed=1'");
    EXPECT_EQ(file.runs().size(), 2U);
}

TEST(Runner, SameSeedSameTraceOtherSeedOtherTrace)
{
    const std::string one = trace_of(small_scenario() + "seed: 3\n", "pmsim_a.csv");
    EXPECT_EQ(one, trace_of(small_scenario() + "seed: 3\n", "pmsim_b.csv"));
    EXPECT_NE(one, trace_of(small_scenario() + "seed: 4\n", "pmsim_c.csv"));
}

TEST(Runner, TraceHasARowEveryNthPeriodAndAllItsColumns)
{
    std::istringstream lines(trace_of(small_scenario(), "pmsim_d.csv"));
    std::string header, line;
    std::getline(lines, header);
    EXPECT_THAT(header, StartsWith("t_s,theta_e_rad,theta_hat_rad,angle_error_deg,"));
    EXPECT_THAT(header, HasSubstr(",weight,quality,limits,loads_Nm,open_loop,driven,state,fault"));
    int rows = 0;
    while (std::getline(lines, line)) {
        ++rows;
        EXPECT_EQ(std::count(line.begin(), line.end(), ','), std::count(header.begin(), header.end(), ','));
    }
    EXPECT_EQ(rows, (3000 + 6) / 7);
}

TEST(Runner, ThreadsDoNotChangeAnything)
{
    const std::string text = replaced(small_scenario(), "theta_e_deg: 30", "theta_e_deg: $angle") +
                             "  - {metric: current_peak_A, max: 100, book: x}\n"
                             "sweep: {angle: [0, 50, 100, 150, 200]}\n";
    const ScenarioFile file = file_of(text);
    EXPECT_EQ(runs_csv(file, run_all(file, 1, false)), runs_csv(file, run_all(file, 3, false)));
}

TEST(Runner, ABadRunStopsTheSweepWithItsError)
{
    const ScenarioFile file =
        file_of(replaced(small_scenario(), "speed_rel: 0.1", "speed_rel: $v") + "sweep: {v: [0.1, fast]}\n");
    EXPECT_THAT(error_of([&] { run_all(file, 2, false); }), HasSubstr("s.yaml:6:38: expected a number"));
}

TEST(Runner, ADriveThatRefusesItsParametersIsAnErrorThatNamesThem)
{
    EXPECT_THAT(
        error_of([] { run_scenario(load(small_scenario() + "drive: {speed_low: 30, speed_high: 20}\n")); }),
        HasSubstr("IPM-1000: drive refuses parameter speed_high"));
}

// Twin: the metrics see what the plant does, not what the drive believes.
TEST(Runner, AHeldRotorDoesNotMoveAndAFreeOneDoes)
{
    const std::string free = replaced(small_scenario(), "duration_s: 0.3", "duration_s: 0.6") +
                             "  - {metric: travel_max_deg_mech, min: 10, book: x}\n";
    EXPECT_TRUE(run_scenario(load(free)).outcomes[1].pass);
    const RunResult held = run_scenario(load(free + "mechanics: {locked: true}\n"));
    EXPECT_FALSE(held.outcomes[1].pass);
    EXPECT_EQ(held.outcomes[1].value.number, 0.0);
}

// A dynamometer imposes speed and position is known exactly: a check of the profile against arithmetic.
TEST(Runner, ImposedSpeedRampsAsTheProfileSays)
{
    const Scenario scenario = load("title: dynamometer\n"
                                   "machine: sim_plant/machines/ipm_1000.yaml\n"
                                   "start: {theta_e_deg: 0}\n"
                                   "duration_s: 0.2\n"
                                   "profile:\n"
                                   "  - {t_s: 0.05, imposed_speed_rad_s: 40, ramp_s: 0.1}\n");
    double at_middle = 0.0, at_end = 0.0;
    run_scenario(scenario, [&](const Sample &s) {
        at_middle = s.rig.truth.t_s <= 0.1 ? s.rig.truth.omega_mech_rad_s : at_middle;
        at_end = s.rig.truth.omega_mech_rad_s;
    });
    EXPECT_NEAR(at_middle, 20.0, 0.1); // one period of the ramp is 0.04 rad/s
    EXPECT_NEAR(at_end, 40.0, 1e-6);
}

// A window [from, to) holds the periods whose sample lies in it: 800 to 1199 of those that the observer is handed, and one
// that ends with the run, or after it, the last.
TEST(Runner, WindowIsThatOfTheExpectation)
{
    const std::string text = "title: dynamometer\n"
                             "machine: sim_plant/machines/ipm_1000.yaml\n"
                             "start: {theta_e_deg: 0}\n"
                             "duration_s: 0.2\n"
                             "profile:\n"
                             "  - {t_s: 0.05, imposed_speed_rad_s: 40, ramp_s: 0.1}\n"
                             "expect:\n"
                             "  - {metric: speed_min_rel, window_s: [0.08, 0.12], max: 9, book: x}\n"
                             "  - {metric: speed_max_rel, window_s: [0.08, 0.12], max: 9, book: x}\n"
                             "  - {metric: speed_mean_rad_s, window_s: [0.08, 0.12], max: 9, book: x}\n"
                             "  - {metric: speed_mean_rad_s, window_s: [0.1, 0.2], max: 9, book: x}\n"
                             "  - {metric: speed_mean_rad_s, max: 9, book: x}\n";
    const Scenario scenario = load(text);
    std::vector<double> speed;
    const RunResult result =
        run_scenario(scenario, [&](const Sample &s) { speed.push_back(s.rig.truth.omega_mech_rad_s); });
    ASSERT_EQ(speed.size(), 2000U);
    const auto mean = [&](int from, int to) {
        return std::accumulate(speed.begin() + from, speed.begin() + to, 0.0) / (to - from);
    };
    const double rated = scenario.setup.rated.speed_rated_rad_s;
    EXPECT_DOUBLE_EQ(result.outcomes[0].value.number, speed[800] / rated);
    EXPECT_DOUBLE_EQ(result.outcomes[1].value.number, speed[1199] / rated);
    EXPECT_NEAR(result.outcomes[2].value.number, mean(800, 1200), 1e-9);
    EXPECT_NEAR(result.outcomes[3].value.number, mean(1000, 2000), 1e-9);
    EXPECT_NEAR(result.outcomes[4].value.number, mean(0, 2000), 1e-9);
    EXPECT_LT(speed[800], speed[801]);
    EXPECT_DOUBLE_EQ(result.simulated_s, 0.2);
}

// The rest of a run that is lost is not simulated; a window that it would have been has no sample, which fails.
TEST(Runner, EndsAfterTheFirstFaultWhereTheScenarioSaysSo)
{
    const std::string text = "title: fault\n"
                             "machine: sim_plant/machines/ipm_1000.yaml\n"
                             "start: {theta_e_deg: 0}\n"
                             "duration_s: 0.3\n"
                             "after_fault_s: 0.02\n"
                             "profile:\n"
                             "  - {t_s: 0, mode: speed, enable: true}\n"
                             "  - {t_s: $t, hw_fault: true}\n"
                             "sweep: {t: [0.1]}\n"
                             "expect:\n"
                             "  - {metric: fault_delay_s, max: 1, book: x}\n"
                             "  - {metric: speed_mean_rel, window_s: [0.2, 0.3], max: 1, book: x}\n";
    const RunResult result = run_scenario(load(text));
    EXPECT_NEAR(result.outcomes[0].value.number, 0.1, 2e-4);
    EXPECT_NEAR(result.simulated_s, 0.12, 4e-4);
    EXPECT_FALSE(result.outcomes[1].pass);
    const RunResult whole = run_scenario(load(replaced(text, "after_fault_s: 0.02\n", "")));
    EXPECT_NEAR(whole.simulated_s, 0.3, 1e-9);
    EXPECT_TRUE(whole.outcomes[1].pass);
    const RunResult healthy = run_scenario(load(replaced(text, "[0.1]", "[5]")));
    EXPECT_NEAR(healthy.simulated_s, 0.3, 1e-9);
    EXPECT_THAT(error_of([&] { load(replaced(text, "after_fault_s: 0.02", "after_fault_s: -1")); }),
                HasSubstr("s.yaml:5"));
}

// In thousands of periods, each of 100 us.
TEST(Runner, ProgressIsSimulatedTime)
{
    std::atomic<uint64_t> progress{0};
    std::vector<uint64_t> seen;
    run_scenario(
        load(small_scenario()), [&](const Sample &) { seen.push_back(progress); }, &progress);
    EXPECT_EQ(progress, 300000U);
    EXPECT_EQ(seen[999], 0U); // counted when the period is over
    EXPECT_EQ(seen[1000], 100000U);
    EXPECT_EQ(seen[1999], 100000U);
    EXPECT_EQ(seen[2999], 200000U);
}

TEST(Runner, EventsWaitForAState)
{
    const Scenario scenario = load(small_scenario() + "  - {metric: fault, equals: NONE, book: x}\n");
    Scenario waiting = scenario;
    Event event;
    event.state = RIG_RUNNING;
    event.t_s = 0.01;
    event.targets[static_cast<size_t>(Channel::load_Nm)] = 0.25;
    waiting.profile.push_back(event);
    double running_since_s = -1.0, load_since_s = -1.0;
    run_scenario(waiting, [&](const Sample &s) {
        if (running_since_s < 0.0 && s.rig.state == RIG_RUNNING) {
            running_since_s = s.rig.truth.t_s;
        }
        if (load_since_s < 0.0 && s.load_Nm > 0.0) {
            load_since_s = s.rig.truth.t_s;
        }
    });
    ASSERT_GT(running_since_s, 0.0);
    EXPECT_NEAR(load_since_s - running_since_s, 0.01, 2.1e-4); // seen one period later
}

TEST(Record, ReplayGivesTheSameBits)
{
    const Scenario scenario = load(small_scenario());
    const Recording recording = record_scenario(scenario, 2500);
    ASSERT_EQ(recording.periods.size(), 2500U);
    Loop loop(scenario);
    size_t different = 0;
    for (const record_period_t &period : recording.periods) {
        different += loop.step_drive(period) ? 0 : 1;
    }
    EXPECT_EQ(different, 0U);
}

TEST(Record, FileHasTheSizeAndHeaderOfTheFormat)
{
    const tests::TemporaryFile file("recording");
    write_recording(record_scenario(load(small_scenario()), 100), file.path());
    const std::string bytes = content(file.path());
    EXPECT_EQ(bytes.size(),
              sizeof(record_header_t) + 4U * DRIVE_PARAM_COUNT + 100U * sizeof(record_period_t));
    EXPECT_EQ(bytes.substr(0, 8), RECORD_MAGIC);
    EXPECT_EQ(bytes[12], 100); // periods, little-endian
}

TEST(Report, WorstRunIsNamed)
{
    const ScenarioFile file = file_of(replaced(small_scenario(), "theta_e_deg: 30", "theta_e_deg: $angle") +
                                      "  - {metric: current_peak_A, max: 100, book: \"9.2\"}\n"
                                      "sweep: {angle: [0, 50]}\n");
    SweepResult result;
    for (const double current : {3.0, 120.0}) {
        RunResult run;
        run.outcomes.push_back({{0.0, "NONE"}, true, 1.0});
        run.outcomes.push_back({{current, ""}, current < 100.0, (100.0 - current) / 100.0});
        result.runs.push_back(run);
    }
    const std::vector<Verdict> list = verdicts(file, result);
    EXPECT_FALSE(all_pass(list));
    EXPECT_EQ(worst_run(list), 1U);
    const std::string lines = verdict_lines(file, list);
    EXPECT_THAT(lines, HasSubstr("PASS  fault"));
    EXPECT_THAT(lines,
                HasSubstr("FAIL  current_peak_A        120  <= 100 A  (9.2)  1 of 2, worst: angle=50"));
    EXPECT_THAT(verdict_json(file, list, 0.6, 0.1), HasSubstr("\"name\": \"current_peak_A\""));
}

} // namespace
} // namespace pmsim
