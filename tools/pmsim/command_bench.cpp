#include <chrono>
#include <cstdio>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/loop.h"
#include "tools/pmsim/machine_file.h"
#include "tools/pmsim/notes.h"
#include "tools/pmsim/open_loop_feed.h"
#include "tools/pmsim/record_file.h"
#include "tools/pmsim/settings_option.h"

namespace pmsim
{
namespace
{

struct Options {
    std::string scenario = "tests/scenario/bench.yaml";
    std::vector<std::string> settings;
    int repeat = 3;
};

// Seconds of the fastest of several goes: what the work costs when nothing disturbs.
template <class Work> double fastest_s(int repeat, Work work)
{
    double best_s = 1e300;
    for (int i = 0; i < repeat; ++i) {
        const auto start = std::chrono::steady_clock::now();
        work();
        best_s =
            std::min(best_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    return best_s;
}

void print_ratio(const char *what, double simulated_s, double wall_s, size_t periods)
{
    std::printf("%-22s %8.1f simulated s per wall s %8.3f us per period\n", what, simulated_s / wall_s,
                1e6 * wall_s / double(periods));
}

void bench(const Options &options)
{
    const ScenarioFile file(options.scenario, parse_settings(options.settings));
    const Scenario scenario = file.scenario(file.runs().front());
    print_notes(scenario.setup);
    const Recording recording = record_scenario(scenario, UINT64_MAX);
    const std::vector<record_period_t> &periods = recording.periods;
    const double f_Hz = scenario.setup.plant.inverter.f_pwm_Hz;
    const double simulated_s = double(periods.size()) / f_Hz;

    const double whole_s = fastest_s(options.repeat, [&] {
        Loop loop(scenario);
        for (size_t k = 0; k < periods.size(); ++k) {
            loop.step();
        }
    });
    const double plant_s = fastest_s(options.repeat, [&] {
        Loop loop(scenario);
        for (const record_period_t &period : periods) {
            loop.step_plant(period);
        }
    });
    size_t different = 0;
    const double drive_s = fastest_s(options.repeat, [&] {
        Loop loop(scenario);
        different = 0;
        for (const record_period_t &period : periods) {
            different += loop.step_drive(period) ? 0 : 1;
        }
    });
    std::printf("%s: %.3g s at %.0f Hz, one core, best of %d\n", file.title().c_str(), simulated_s, f_Hz,
                options.repeat);
    print_ratio("drive and plant", simulated_s, whole_s, periods.size());
    print_ratio("plant alone", simulated_s, plant_s, periods.size());
    print_ratio("drive alone", simulated_s, drive_s, periods.size());
    std::printf("replay: %zu of %zu periods differ\n", different, periods.size());
}

// Six legs without the firmware, fed open loop.
void bench_six_legs(int repeat)
{
    const int periods = 20000;
    std::printf(
        "Six legs at 20 kHz, open loop at rated current and half speed: 1 s at %d Hz, one core, best of %d\n",
        periods, repeat);
    for (const char *machine : {"dtp_400", "ow_400"}) {
        Setup setup = load_machine_file(std::string("sim_plant/machines/") + machine + ".yaml");
        setup.plant.inverter.f_pwm_Hz = periods;
        setup.plant.inverter.timer_counts = 4250; // of 170 MHz
        const double wall_s = fastest_s(repeat, [&] {
            OpenLoopFeed feed(setup);
            for (int k = 0; k < periods; ++k) {
                feed.step();
            }
        });
        print_ratio(("plant alone, " + setup.name).c_str(), 1.0, wall_s, periods);
    }
}

} // namespace

void add_bench_command(Command &app)
{
    Command *command = app.add_subcommand("bench", "Measure simulated seconds per wall second");
    auto options = std::make_shared<Options>();
    const Option *scenario =
        command->add_option("scenario", options->scenario, "scenario file; of a sweep, its first run")
            ->show_default();
    command->add_option("--set", options->settings, settings_help())->one_each();
    command->add_option("--repeat", options->repeat, "goes, of which the fastest counts")
        ->positive()
        ->show_default();
    command->footer(
        "Plant and drive alone replay the recorded run, so that each does the same work as in it. Without\n"
        "scenario and settings the machines with six legs follow, plant alone.\n\n"
        "Examples:\n"
        "  pmsim bench\n"
        "  pmsim bench tests/scenario/demo.yaml --set inverter.f_pwm_Hz=20000");
    command->callback([options, scenario] {
        bench(*options);
        if (scenario->empty() && options->settings.empty()) {
            bench_six_legs(options->repeat);
        }
    });
}

} // namespace pmsim
