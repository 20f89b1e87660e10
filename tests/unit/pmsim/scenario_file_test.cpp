#include "tools/pmsim/scenario_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>

#include "firmware/params/parameters.h"
#include "tests/unit/pmsim/support.h"

namespace pmsim
{
namespace
{

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

Scenario load(const std::string &text, const Settings &settings = {})
{
    const ScenarioFile file(Value::from_text(text, "s.yaml"), settings);
    return file.scenario(file.runs().front());
}

std::string error_with(const std::string &from, const std::string &to)
{
    return error_of([&] { load(replaced(small_scenario(), from, to)); });
}

std::string event_error(const std::string &event)
{
    return error_with("{t_s: 0, mode: speed, speed_rel: 0.1, enable: true}", event);
}

std::string expectation_error(const std::string &expectation)
{
    return error_with("{metric: fault, equals: NONE, book: \"1.1\"}", expectation);
}

std::string machine_without_drive()
{
    std::ifstream whole("sim_plant/machines/bldc_fan.yaml");
    const std::string text((std::istreambuf_iterator<char>(whole)), std::istreambuf_iterator<char>());
    const std::string path = testing::TempDir() + "machine_without_drive.yaml";
    std::ofstream(path) << text.substr(0, text.find("\ndrive:")) << '\n';
    return path;
}

TEST(ScenarioFile, TheSmallOneLoads)
{
    const Scenario scenario = load(small_scenario());
    EXPECT_EQ(scenario.setup.name, "IPM-1000");
    EXPECT_NEAR(scenario.theta_e_rad, 0.5235987756, 1e-9);
    ASSERT_EQ(scenario.profile.size(), 1U);
    EXPECT_NEAR(*scenario.profile[0].targets[static_cast<size_t>(Channel::speed_rad_s)], 10.472, 1e-9);
    ASSERT_EQ(scenario.expect.size(), 1U);
    EXPECT_EQ(scenario.expect[0].t1_s, 0.3);
}

TEST(ScenarioFile, OverridesAreLaidOverTheMachine)
{
    const Scenario scenario = load(small_scenario() + "electrical: {c_A_Wb5: 0}\n"
                                                      "sensor: {offset_A: [0.1, 0, -0.1]}\n"
                                                      "drive: {flux_bandwidth: 25}\n");
    EXPECT_EQ(scenario.setup.plant.machine.c_A_Wb5, 0.0);
    EXPECT_EQ(scenario.setup.plant.machine.L_d0_H, 46.3e-3);
    EXPECT_EQ(scenario.setup.plant.sensor.offset_A[2], -0.1);
    EXPECT_EQ(scenario.setup.params->flux_bandwidth, 25000);
}

TEST(ScenarioFile, SeedDecidesTheRandomAngleAndTheNoise)
{
    const std::string text = replaced(small_scenario(), "theta_e_deg: 30", "theta_e_deg: random");
    const Scenario one = load(text + "seed: 5\n");
    const Scenario again = load(text + "seed: 5\n");
    const Scenario other = load(text, {{"seed", "6"}});
    EXPECT_EQ(one.theta_e_rad, again.theta_e_rad);
    EXPECT_NE(one.theta_e_rad, other.theta_e_rad);
    EXPECT_EQ(other.setup.plant.sensor.seed, 6U);
}

TEST(ScenarioFile, AnotherMachineTakesThePlaceOfTheFiles)
{
    EXPECT_EQ(load(small_scenario()).setup.name, "IPM-1000");
    const Scenario other = load(small_scenario(), {{"machine", "sim_plant/machines/spm_400.yaml"}});
    EXPECT_EQ(other.setup.name, "SPM-400");
    EXPECT_THROW(load(small_scenario(), {{"machine", "sim_plant/machines/none.yaml"}}), InputError);
}

TEST(ScenarioFile, ErrorsOfTheDocument)
{
    EXPECT_EQ(error_with("title: small\n", ""), "s.yaml:1:1: key \"title\" is missing");
    EXPECT_EQ(error_with("profile:", "profiles:"),
              "s.yaml:5:1: unknown key \"profiles\"; did you mean \"profile\"?");
    EXPECT_EQ(error_with("duration_s", "duration_ms"),
              "s.yaml:4:1: unknown key \"duration_ms\": wrong unit; did you mean \"duration_s\"?");
    EXPECT_THAT(error_with("duration_s: 0.3", "duration_s: -1"),
                StartsWith("s.yaml:4:13: -1 is out of range"));
    EXPECT_EQ(error_with("ipm_1000.yaml", "ipm.yaml"),
              "s.yaml:2:10: there is no machine file sim_plant/machines/ipm.yaml");
    EXPECT_EQ(error_with("theta_e_deg", "theta_e_rad"),
              "s.yaml:3:9: unknown key \"theta_e_rad\": wrong unit; did you mean \"theta_e_deg\"?");
    EXPECT_THAT(error_with("start:", "drive: {R_x: 1}\nstart:"),
                StartsWith("s.yaml:3:9: unknown key \"R_x\""));
    EXPECT_EQ(error_with("start:", "title: again\nstart:"),
              "s.yaml:3:1: key \"title\" stands here a second time; first at line 1");
}

TEST(ScenarioFile, ErrorsOfTheProfile)
{
    EXPECT_EQ(event_error("{speed_rel: 1}"), "s.yaml:6:5: key \"t_s\" is missing");
    EXPECT_EQ(event_error("{t_s: 0, speed_rpm: 1}"),
              "s.yaml:6:14: unknown key \"speed_rpm\": wrong unit; did you mean \"speed_rad_s\"?");
    EXPECT_THAT(event_error("{t_s: 0, mode: sped}"), StartsWith("s.yaml:6:20: \"sped\" is not known here"));
    EXPECT_THAT(event_error("{t_s: 0, when: runing}"),
                StartsWith("s.yaml:6:20: \"runing\" is not known here"));
    EXPECT_EQ(event_error("{t_s: 0, load_Nm: 1, load_rel: 1}"),
              "s.yaml:6:26: the same value is set twice in one event");
    EXPECT_EQ(event_error("{t_s: 0, sensor_offset_A: 1}"), "s.yaml:6:31: expected a list");
    EXPECT_THAT(event_error("{t_s: -1}"), StartsWith("s.yaml:6:11: -1 is out of range"));
    EXPECT_EQ(event_error("{t_s: 0, speed_rel: $v}"), "s.yaml:6:25: there is no variable \"$v\"");
    EXPECT_EQ(event_error("{t_s: 0, enable: 1}"), "s.yaml:6:22: expected true or false, found \"1\"");
}

TEST(ScenarioFile, FaultsOfThePlant)
{
    const auto event = [](const std::string &text) {
        return load(replaced(small_scenario(), "{t_s: 0, mode: speed, speed_rel: 0.1, enable: true}", text))
            .profile[0];
    };
    const Event broken = event("{t_s: 0, leg_fault: {leg: b, kind: lower_short}, supply: false}");
    EXPECT_EQ(broken.leg_fault->leg, 1);
    EXPECT_EQ(broken.leg_fault->kind, PLANT_LOWER_SHORT);
    EXPECT_EQ(broken.supply, false);
    const Event tied = event("{t_s: 0, short: {from: a, to: c, R_ohm: 0.1}}");
    EXPECT_EQ(tied.short_circuit->leg_a, 0);
    EXPECT_EQ(tied.short_circuit->leg_b, 2);
    EXPECT_EQ(tied.short_circuit->R_ohm, 0.1);
    EXPECT_EQ(event("{t_s: 0, short: {from: c, to: rail, R_ohm: 0}}").short_circuit->leg_b, -1);
    EXPECT_LT(event("{t_s: 0, short: none}").short_circuit->R_ohm, 0.0);
    const Event warm = event("{t_s: 0, winding_degC: 120, magnet_degC: 80, ramp_s: 1}");
    EXPECT_EQ(*warm.targets[static_cast<size_t>(Channel::winding_degC)], 120.0);
    EXPECT_EQ(*warm.targets[static_cast<size_t>(Channel::magnet_degC)], 80.0);
}

TEST(ScenarioFile, ErrorsOfFaults)
{
    EXPECT_EQ(event_error("{t_s: 0, leg_fault: {leg: x, kind: none}}"),
              "s.yaml:6:31: \"x\" is not known here; one of: a, b, c");
    EXPECT_THAT(event_error("{t_s: 0, leg_fault: {leg: a, kind: open}}"),
                StartsWith("s.yaml:6:40: \"open\" is not known here"));
    EXPECT_EQ(event_error("{t_s: 0, leg_fault: {leg: a}}"), "s.yaml:6:25: key \"kind\" is missing");
    EXPECT_EQ(event_error("{t_s: 0, short: {from: a, to: a, R_ohm: 1}}"),
              "s.yaml:6:35: a terminal cannot be shorted to itself");
    EXPECT_THAT(event_error("{t_s: 0, short: {from: a, to: b, R_ohm: -1}}"),
                StartsWith("s.yaml:6:45: -1 is out of range"));
    EXPECT_EQ(event_error("{t_s: 0, short: {from: a, to: b, R_mohm: 1}}"),
              "s.yaml:6:38: unknown key \"R_mohm\": wrong unit; did you mean \"R_ohm\"?");
    EXPECT_EQ(error_of([] {
                  load(replaced(small_scenario() + "winding: {alpha_R_1_K: 0.02}\n", "{t_s: 0, mode: speed",
                                "{t_s: 0, winding_degC: -50, mode: speed"));
              }),
              "s.yaml:6:28: at this temperature the coefficient 0.02/K leaves nothing");
}

// Events that only together make no machine: M of the second set must stay below L.
TEST(ScenarioFile, DriftThatMakesNoMachine)
{
    EXPECT_EQ(event_error("{t_s: 0, L_d0_H: 1.0e-3}"), "no error");
    const std::string text = replaced(small_scenario(), "start:", "winding: {dL_H: [-0.03, 0, 0]}\nstart:");
    EXPECT_EQ(error_of([&] { load(text); }), "no error");
    EXPECT_THAT(error_of([&] {
                    load(replaced(text, "{t_s: 0, mode: speed", "{t_s: 0, L_d0_H: 1.0e-3, mode: speed"));
                }),
                StartsWith("s.yaml:7:3: the events together make a machine that cannot be: winding: "));
}

TEST(ScenarioFile, MachinesThatTheDriveCannotRun)
{
    EXPECT_EQ(error_with("ipm_1000", "dtp_400"), "no error");
    const std::string path = machine_without_drive();
    EXPECT_EQ(error_with("sim_plant/machines/ipm_1000.yaml", path),
              path + ": drive.pole_pairs is missing: the drive cannot run this machine without it; complete "
                     "it first: pmsim tune FILE -o tuned.yaml");
}

TEST(ScenarioFile, ErrorsOfTheExpectations)
{
    EXPECT_EQ(expectation_error("{metric: angle_error_mean_rad, max: 1, book: x}"),
              "s.yaml:8:14: unknown metric \"angle_error_mean_rad\": wrong unit; did you mean "
              "\"angle_error_mean_deg\"?");
    EXPECT_EQ(expectation_error("{metric: fault, max: 1, book: x}"),
              "s.yaml:8:5: fault is a word: it needs `equals`, and nothing else");
    EXPECT_EQ(expectation_error("{metric: quality_min, book: x}"),
              "s.yaml:8:5: quality_min is a number: it needs `max`, `min` or `max_abs`");
    EXPECT_THAT(expectation_error("{metric: fault, equals: STALLED, book: x}"),
                HasSubstr("s.yaml:8:29: \"STALLED\" is not known here; one of: NONE, OVER_CURRENT"));
    EXPECT_EQ(expectation_error("{metric: quality_min, min: 1}"), "s.yaml:8:5: key \"book\" is missing");
    EXPECT_EQ(expectation_error("{metric: quality_min, min: 2, max: 1, book: x}"),
              "s.yaml:8:5: min is above max: nothing can pass");
    EXPECT_EQ(expectation_error("{metric: quality_min, window_s: [1, 1], min: 1, book: x}"),
              "s.yaml:8:37: the window ends before it begins");
    EXPECT_EQ(expectation_error("{metric: quality_min, window_s: [1, 2], min: 1, book: x}"),
              "s.yaml:8:5: the window lies after the end of the run (duration_s 0.3)");
    EXPECT_EQ(expectation_error("{metric: time_to_speed_s, max: 1, book: x}"),
              "s.yaml:8:5: key \"fraction\" is missing");
    EXPECT_EQ(expectation_error("{metric: quality_min, fraction: 1, min: 1, book: x}"),
              "s.yaml:8:27: quality_min takes no `fraction`");
}

TEST(ScenarioFile, SettingsReachEverything)
{
    const Scenario scenario = load(small_scenario(), {{"flux_bandwidth", "20"},
                                                      {"drive.speed_low", "3"},
                                                      {"inverter.dead_time_s", "0"},
                                                      {"start.theta_e_deg", "90"},
                                                      {"duration_s", "0.5"}});
    EXPECT_EQ(scenario.setup.params->flux_bandwidth, 20000);
    EXPECT_EQ(scenario.setup.params->speed_low, 3000);
    EXPECT_EQ(scenario.setup.plant.inverter.dead_time_s, 0.0);
    EXPECT_EQ(scenario.setup.params->dead_time, 0); // follows the inverter
    EXPECT_NEAR(scenario.theta_e_rad, 1.5707963268, 1e-9);
    EXPECT_EQ(scenario.duration_s, 0.5);
}

TEST(ScenarioFile, SettingsThatAreWrong)
{
    const auto error = [](const char *name, const char *value) {
        return error_of([&] { load(small_scenario(), {{name, value}}); });
    };
    EXPECT_EQ(error("flux_bandwith", "1"),
              "--set flux_bandwith: no such variable, drive parameter or section.key; "
              "did you mean \"flux_bandwidth\"?");
    EXPECT_EQ(error("flux_bandwidth", "abc"),
              "--set flux_bandwidth:1:1: expected a number, found \"abc\"; a unit belongs in the key");
}

TEST(ScenarioFile, AnEventBehindTheEndIsRefused)
{
    EXPECT_EQ(event_error("{t_s: 0.31, enable: true}"),
              "s.yaml:6:5: the event lies after the end of the run (duration_s 0.3)");
    EXPECT_EQ(event_error("{t_s: 0.3, enable: true}"), "no error");
    const std::string late = replaced(small_scenario(), "t_s: 0,", "t_s: 0.25,");
    EXPECT_EQ(error_of([&] { load(late, {{"duration_s", "0.2"}}); }), "no error"); // cut short on purpose
    const std::string never = replaced(small_scenario() + "sweep: {t: [100]}\n", "t_s: 0,", "t_s: $t,");
    EXPECT_EQ(error_of([&] { load(never); }), "no error");
}

TEST(ScenarioFile, BothEndsOfABoundAreGivenOnce)
{
    for (const char *other : {"max: 2", "min: -2"}) {
        EXPECT_EQ(expectation_error(std::string("{metric: quality_min, max_abs: 1, ") + other + ", book: x}"),
                  "s.yaml:8:5: `max_abs` stands for both ends: give it, or `min` and `max`");
    }
}

TEST(ScenarioFile, TheFractionIsOneOfRatedSpeed)
{
    EXPECT_THAT(expectation_error("{metric: time_to_speed_s, fraction: 7, max: 1, book: x}"),
                HasSubstr("s.yaml:8:41: 7 is out of range 0 ... 3"));
}

TEST(ScenarioFile, ASettingNamesTheNearestKey)
{
    const auto error = [](const std::string &name) {
        return error_of([&] { load(small_scenario(), {{name, "1"}}); });
    };
    EXPECT_THAT(error("R_s_ohm"), HasSubstr("did you mean \"electrical.R_s_ohm\"?"));
    EXPECT_THAT(error("L_q0_mH"), HasSubstr("did you mean \"electrical.L_q0_H\"?"));
    EXPECT_THAT(error("flux_bandwith"), HasSubstr("did you mean \"flux_bandwidth\"?"));
    EXPECT_THAT(error("quux"),
                HasSubstr("known: seed, duration_s, start.theta_e_deg, machine, what `pmsim params` lists"));
}

// Every run of every scenario of the project can be read.
TEST(ScenarioFile, TheProjectsScenariosLoad)
{
    for (const auto &entry : fs::directory_iterator("tests/scenario")) {
        if (entry.path().extension() == ".yaml") {
            const ScenarioFile file(entry.path().string());
            for (const pmsim::Run &run : file.runs()) {
                EXPECT_EQ(error_of([&] { file.scenario(run); }), "no error") << entry.path();
            }
        }
    }
}

} // namespace
} // namespace pmsim
