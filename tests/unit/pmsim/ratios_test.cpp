// Bounds that METHODS.md states as ratios: methods side by side in the same runs. What each may do by itself stands in
// tests/scenario.
#include "tools/pmsim/runner.h"

#include <algorithm>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{
namespace
{

// METHODS.md 12.2.4 (e), row 139: error of the simplified voltage model over that of the full one.
constexpr double kSimplified = 1.5;
// Below it both are noise of the converter, 20 seeds at rated speed and load: 0.02 to 0.04 degree, ratio 1.1, once 1.6.
constexpr double kNoise_deg = 0.05;
// 12.4.4 (e), row 143: of the Kalman filter of reduced order over that of full order.
constexpr double kReduced = 1.3;

double largest_error(const Scenario &scenario)
{
    const RunResult result = run_scenario(scenario);
    for (size_t n = 0; n < scenario.expect.size(); ++n) {
        if (scenario.expect[n].metric == "angle_error_max_deg") {
            return result.outcomes[n].value.number;
        }
    }
    ADD_FAILURE() << "no position error in " << scenario.title;
    return 0.0;
}

struct Compared {
    std::map<std::string, double> errors; // by the name of the run, without the observer
    double worst = 0.0;
};

// The largest position error of each run of the file with this observer.
Compared largest_errors(const std::string &path, const std::string &observer)
{
    const ScenarioFile file(path, {{"observer", observer}});
    Compared compared;
    for (const Run &run : file.runs()) {
        std::string name = run.name;
        const std::string own = "observer=" + observer;
        const size_t at = name.find(own);
        EXPECT_NE(at, std::string::npos) << name;
        const double error = largest_error(file.scenario(run));
        compared.errors[name.erase(at, own.size())] = error;
        compared.worst = std::max(compared.worst, error);
    }
    return compared;
}

double error_of_case(const std::string &path, const std::string &name)
{
    const ScenarioFile file(path, {{"case", name}});
    EXPECT_EQ(file.runs().size(), 1U) << name;
    return largest_error(file.scenario(file.runs().front()));
}

TEST(Ratios, SimplifiedModelErrsByAtMostOneAndAHalfOfTheVoltageModel)
{
    const char *scenario = "tests/scenario/spm_mras.yaml";
    const Compared voltage = largest_errors(scenario, "9");
    const Compared simplified = largest_errors(scenario, "10");
    ASSERT_EQ(voltage.errors.size(), 12U);
    ASSERT_EQ(simplified.errors.size(), voltage.errors.size());
    for (const auto &[run, error] : simplified.errors) {
        ASSERT_EQ(voltage.errors.count(run), 1U) << run;
        EXPECT_LE(error, std::max(kSimplified * voltage.errors.at(run), kNoise_deg)) << run;
        EXPECT_GT(error, 0.0) << run;
    }
    EXPECT_LE(simplified.worst, 1.1 * voltage.worst);
}

TEST(Ratios, ReducedKalmanFilterErrsByAtMostAThirdMoreThanTheFullOne)
{
    const std::string scenario = "tests/scenario/ekf.yaml";
    for (const std::string speed : {"10 %", "20 %", "100 %"}) {
        const double full = error_of_case(scenario, "full " + speed);
        EXPECT_GT(full, 0.0) << speed;
        EXPECT_LE(error_of_case(scenario, "reduced " + speed), kReduced * full) << speed;
    }
}

} // namespace
} // namespace pmsim
