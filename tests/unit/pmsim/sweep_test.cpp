#include <set>

#include <gmock/gmock.h>

#include "tests/unit/pmsim/support.h"
#include "tools/pmsim/scenario_file.h"

namespace pmsim
{
namespace
{

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<pmsim::Run> runs_of(const std::string &text, const Variables &fixed = {})
{
    return expand_runs(Map(Value::from_text(text, "s.yaml")), fixed);
}

TEST(Sweep, NothingIsOneRun)
{
    const std::vector<pmsim::Run> runs = runs_of("title: x");
    ASSERT_EQ(runs.size(), 1U);
    EXPECT_EQ(runs[0].name, "");
}

TEST(Sweep, GridIsEveryCombinationOnceWithBothEnds)
{
    const std::vector<pmsim::Run> runs = runs_of("sweep:\n"
                                                 "  angle: {from: 0, to: 355, step: 5}\n"
                                                 "  direction: [1, -1]\n"
                                                 "  load: [0, 0.5]\n");
    ASSERT_EQ(runs.size(), 72U * 2U * 2U);
    std::set<std::string> names;
    for (const pmsim::Run &run : runs) {
        names.insert(run.name);
    }
    EXPECT_EQ(names.size(), runs.size());
    EXPECT_EQ(runs.front().name, "angle=0 direction=1 load=0");
    EXPECT_EQ(runs.back().name, "angle=355 direction=-1 load=0.5");
}

TEST(Sweep, StepsDoNotDrift)
{
    const std::vector<pmsim::Run> runs = runs_of("sweep: {x: {from: 0, to: 1, step: 0.1}}");
    ASSERT_EQ(runs.size(), 11U);
    EXPECT_EQ(runs[3].variables.at("x"), "0.3");
    EXPECT_EQ(runs[10].variables.at("x"), "1");
}

TEST(Sweep, TwoCasesOfOneNameAreRefused)
{
    EXPECT_EQ(error_of([] { runs_of("cases:\n  - {name: a, R: 1}\n  - {name: a, R: 2}\n"); }),
              "s.yaml:3:5: a second case of the name \"a\"");
    EXPECT_EQ(error_of([] { runs_of("cases:\n  - {R: 1}\n  - {R: 1}\n"); }),
              "s.yaml:3:5: a second case of the name \"R=1\"");
}

TEST(Sweep, AVariableThatIsUsedNowhereIsRefused)
{
    const auto error = [](const std::string &text) {
        return error_of([&] { refuse_unused_variables(Map(Value::from_text(text, "s.yaml"))); });
    };
    EXPECT_EQ(error("sweep: {x: [1, 2]}\nprofile: [{t_s: 0, load_rel: 2*$x}]\n"), "no error");
    EXPECT_EQ(error("cases: [{name: a, R: 1}]\ndrive: {R_s: $R}\n"), "no error");
    EXPECT_EQ(error("sweep: {x: [1, 2]}\nprofile: [{t_s: 0, load_rel: 2*$xy}]\n"),
              "s.yaml:1:9: variable \"x\" is used nowhere: each run is the same");
    EXPECT_EQ(error("cases: [{name: a, R: 1}]\nsweep: {x: [$R]}\nprofile: [{load_rel: $x}]\n"),
              "s.yaml:1:19: variable \"R\" is used nowhere: each run is the same");
}

TEST(Sweep, CasesAreCrossedWithTheGrid)
{
    const std::vector<pmsim::Run> runs = runs_of("cases:\n"
                                                 "  - {name: small, R: 1, L: 2}\n"
                                                 "  - {R: 3, L: 4}\n"
                                                 "sweep: {x: [5, 6]}\n");
    std::vector<std::string> names;
    names.reserve(runs.size());
    for (const pmsim::Run &run : runs) {
        names.push_back(run.name);
    }
    EXPECT_THAT(names, ElementsAre("small x=5", "small x=6", "L=4 R=3 x=5", "L=4 R=3 x=6"));
    EXPECT_EQ(runs[2].variables.at("R"), "3");
}

TEST(Sweep, OneValueCanBeChosen)
{
    const std::string text = "cases: [{name: a, R: 1}, {name: b, R: 2}]\nsweep: {x: [5, 6]}\n";
    EXPECT_EQ(runs_of(text, {{"x", "7"}}).size(), 2U);
    const std::vector<pmsim::Run> one = runs_of(text, {{"x", "5"}, {"case", "b"}});
    ASSERT_EQ(one.size(), 1U);
    EXPECT_EQ(one[0].variables.at("R"), "2");
    EXPECT_THAT(error_of([&] {
                    runs_of(text, {{"case", "c"}});
                }),
                HasSubstr("s.yaml:1:8: there is no case \"c\""));
}

TEST(Sweep, Errors)
{
    const auto error = [](const std::string &text) { return error_of([&] { runs_of(text); }); };
    EXPECT_EQ(error("sweep:\n  x: {from: 0, to: 10, stop: 1}"),
              "s.yaml:2:24: unknown key \"stop\"; did you mean \"step\"?");
    EXPECT_THAT(error("sweep: {x: {from: 5, to: 1, step: 1}}"), HasSubstr("1 is out of range 5"));
    EXPECT_THAT(error("sweep: {x: {from: 0, to: 1, step: 0}}"), HasSubstr("out of range"));
    EXPECT_THAT(error("sweep: {x: []}"), HasSubstr("the list is empty"));
    EXPECT_THAT(error("sweep: {x: {from: 0, to: 1, step: 1.0e-8}}"), HasSubstr("more than 100000"));
    EXPECT_THAT(error("cases: []"), HasSubstr("the list is empty"));
    EXPECT_EQ(error("cases:\n  - {R: 1, L: 2}\n  - {R: 1}"), "s.yaml:3:5: key \"L\" is missing");
    EXPECT_EQ(error("cases:\n  - {R: 1}\n  - {R: 1, L: 2}"),
              "s.yaml:3:5: gives a variable that the first case does not give");
    EXPECT_EQ(error("cases: [{R: 1}]\nsweep: {R: [1, 2]}"),
              "s.yaml:2:9: variable \"R\" is given by cases too");
}

} // namespace
} // namespace pmsim
