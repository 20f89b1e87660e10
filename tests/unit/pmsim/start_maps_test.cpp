// Position and pole of rotors at rest, found by every method on finite-element maps of real machines. Their data are not part of
// the project (tests/data/machines); the machine of tests/scenario/start_bridges.yaml is shaped after one of them.
#include "tools/pmsim/runner.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/temporary_file.h"
#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{
namespace
{

namespace fs = std::filesystem;

const char kScenario[] = "tests/data/scenarios/start_maps.yaml";
constexpr double kAngle_deg = 5;

// Of tests/data/machines, with the table where it is; empty: there is none.
std::string machine_with_data(const std::string &name, const std::string &table)
{
    const char *given = std::getenv("PMDRIVE_DATA");
    const fs::path data = fs::absolute(given != nullptr ? given : "../shared/data") / table;
    if (!fs::exists(data)) {
        return "";
    }
    std::ifstream file("tests/data/machines/" + name);
    std::stringstream text;
    text << file.rdbuf();
    std::string machine = text.str();
    const std::string there = "../../../../shared/data/" + table;
    const size_t at = machine.find(there);
    EXPECT_NE(at, std::string::npos) << name;
    return machine.replace(at, there.size(), data.string());
}

// A machine file that lasts as long as it.
class Machine
{
  public:
    Machine(const std::string &name, const std::string &text) : file_(name)
    {
        std::ofstream(file_.path()) << text;
    }

    std::string path() const
    {
        return file_.path();
    }

  private:
    tests::TemporaryFile file_;
};

double value_of(const Scenario &scenario, const RunResult &result, const std::string &metric)
{
    for (size_t n = 0; n < scenario.expect.size(); ++n) {
        if (scenario.expect[n].metric == metric) {
            return result.outcomes[n].value.number;
        }
    }
    ADD_FAILURE() << metric;
    return std::nan("");
}

// L_d falls with demagnetising current, on which side of zero ever the current lies: ten methods, seven angles.
TEST(StartMaps, ThorIsFoundByEveryMethod)
{
    const std::string text = machine_with_data("thor_pmsyrm.yaml", "thor_pmsyrm_fea_pm.csv");
    if (text.empty()) {
        GTEST_SKIP() << "no data of real machines: set PMDRIVE_DATA to their folder";
    }
    const Machine machine("thor.yaml", text);
    const ScenarioFile file(kScenario, {{"machine", machine.path()}});
    EXPECT_EQ(file.runs().size(), 70U);
    for (const pmsim::Run &run : file.runs()) {
        const Scenario scenario = file.scenario(run);
        const RunResult result = run_scenario(scenario);
        for (const Outcome &outcome : result.outcomes) {
            EXPECT_TRUE(outcome.pass) << run.name << ' ' << outcome.value.number;
        }
    }
}

// Twin: told the opposite, each finds the opposite pole, with a good margin.
TEST(StartMaps, ThorToldTheOppositeIsTheOtherPole)
{
    const std::string text = machine_with_data("thor_pmsyrm.yaml", "thor_pmsyrm_fea_pm.csv");
    if (text.empty()) {
        GTEST_SKIP() << "no data of real machines: set PMDRIVE_DATA to their folder";
    }
    const Machine machine("thor.yaml", text);
    const ScenarioFile file(kScenario, {{"machine", machine.path()}, {"L_d_falls", "0"}, {"angle", "120"}});
    EXPECT_EQ(file.runs().size(), 10U);
    for (const pmsim::Run &run : file.runs()) {
        const Scenario scenario = file.scenario(run);
        const double error = value_of(scenario, run_scenario(scenario), "found_angle_error_deg");
        EXPECT_GE(std::fabs(error), 180 - kAngle_deg) << run.name;
    }
}

// The table ends at i_d = 0: which end of the axis is the magnet's is not in it, the axis is.
TEST(StartMaps, TheAxisOfPm270IsFound)
{
    const std::string text = machine_with_data("pm270l8.yaml", "pm270l8_ipm_fea.csv");
    if (text.empty()) {
        GTEST_SKIP() << "no data of real machines: set PMDRIVE_DATA to their folder";
    }
    const Machine machine("pm270l8.yaml", text);
    for (const char *method : {"dual pulses", "secondary current", "three-phase HF"}) {
        const ScenarioFile file(kScenario,
                                {{"machine", machine.path()}, {"case", method}, {"drive.v_injection", "60"}});
        for (const pmsim::Run &run : file.runs()) {
            const Scenario scenario = file.scenario(run);
            const double error = value_of(scenario, run_scenario(scenario), "found_angle_error_deg");
            EXPECT_LE(std::fabs(std::remainder(error, 180)), kAngle_deg) << run.name;
        }
    }
}

} // namespace
} // namespace pmsim
