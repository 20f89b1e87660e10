#include "tools/pmsim/yaml_reader.h"

#include <fstream>

#include <gmock/gmock.h>

#include "tests/unit/pmsim/support.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

using testing::HasSubstr;
using testing::StartsWith;

Value parse(const std::string &text, const Variables *variables = nullptr)
{
    return Value::from_text(text, "f.yaml", variables);
}

double number(const std::string &text, const Variables &variables = {})
{
    return Map(parse("a: " + text, &variables)).at("a").number(-1000, 1000);
}

TEST(YamlReader, SyntaxErrorNamesThePlace)
{
    EXPECT_THAT(error_of([] { parse("a: 1\nb: [1, 2\n"); }), StartsWith("f.yaml:3:1: "));
}

TEST(YamlReader, MissingFile)
{
    EXPECT_EQ(error_of([] { Value::from_file("no/such.yaml"); }),
              "no/such.yaml: cannot be read: No such file or directory");
    EXPECT_EQ(error_of([] { Value::from_file("tests"); }), "tests: cannot be read: it is a folder");
    const std::string empty = testing::TempDir() + "empty.yaml";
    std::ofstream(empty).close();
    EXPECT_EQ(error_of([&] { Value::from_file(empty); }), empty + ": is empty");
}

TEST(YamlReader, ASecondDocumentIsNotPassedOver)
{
    EXPECT_EQ(error_of([] { parse("a: 1\n---\nb: 2\n"); }),
              "f.yaml:3:1: a second document begins here; one is read");
    EXPECT_EQ(error_of([] { parse("---\na: 1\n...\n"); }), "no error");
}

TEST(YamlReader, UnknownKeyNamesThePlaceAndTheNearest)
{
    const auto open = [] { Map(parse("a: 1\ndead_tiem_s: 2"), {"a", "dead_time_s"}); };
    EXPECT_EQ(error_of(open), "f.yaml:2:1: unknown key \"dead_tiem_s\"; did you mean \"dead_time_s\"?");
}

TEST(YamlReader, UnknownKeyNearNothingListsTheKnown)
{
    const auto open = [] { Map(parse("  xyz: 1"), {"alpha", "beta_s"}); };
    EXPECT_EQ(error_of(open), "f.yaml:1:3: unknown key \"xyz\"; known: alpha, beta_s");
}

TEST(YamlReader, WrongUnitIsSaid)
{
    for (const char *key : {"R_s_mohm", "R_s", "R_s_H"}) {
        const auto open = [key] { Map(parse(std::string(key) + ": 1"), {"R_s_ohm", "L_H"}); };
        EXPECT_EQ(error_of(open), "f.yaml:1:1: unknown key \"" + std::string(key) +
                                      "\": wrong unit; did you mean \"R_s_ohm\"?");
    }
}

TEST(YamlReader, DuplicateKey)
{
    EXPECT_EQ(error_of([] { Map(parse("a: 1\nb: 2\na: 3")); }),
              "f.yaml:3:1: key \"a\" stands here a second time; first at line 1");
}

TEST(YamlReader, MissingKeyNamesTheMapping)
{
    EXPECT_EQ(error_of([] {
                  const Map outer(parse("a: 1\nb:\n  c: 2"));
                  Map(outer.at("b")).at("d");
              }),
              "f.yaml:3:3: key \"d\" is missing");
}

TEST(YamlReader, MissingValue)
{
    EXPECT_THAT(error_of([] { Map(parse("a:\n")).at("a").number(0, 1); }), HasSubstr("a value is missing"));
    EXPECT_EQ(error_of([] { Map(parse("a: 1\nb:\nc: 2\n")).at("b"); }),
              "f.yaml:2:1: key \"b\": a value is missing");
}

TEST(YamlReader, MappingExpected)
{
    EXPECT_THAT(error_of([] { Map(parse("- 1\n- 2")); }), HasSubstr("f.yaml:1:1: expected keys with values"));
}

TEST(YamlReader, Numbers)
{
    EXPECT_EQ(number("12.5"), 12.5);
    EXPECT_EQ(number("-2.0e-3"), -0.002);
    EXPECT_EQ(number("7"), 7.0);
}

TEST(YamlReader, NumbersThatAreNone)
{
    for (const char *text : {"abc", "1.5 ohm", "6ohm", "1,5", "0x10", "\"\"", "1..2", "--1"}) {
        EXPECT_THAT(error_of([text] { number(text); }), StartsWith("f.yaml:1:4: expected a number")) << text;
    }
    for (const char *text : {"nan", "inf", "-inf", "1e999"}) {
        EXPECT_THAT(error_of([text] { number(text); }), HasSubstr("f.yaml:1:4: ")) << text;
        EXPECT_THAT(error_of([text] { number(text); }), HasSubstr("not a finite number")) << text;
    }
    EXPECT_THAT(error_of([] { number(".nan"); }), StartsWith("f.yaml:1:4: expected a number"));
}

TEST(YamlReader, NumberOutOfRange)
{
    EXPECT_EQ(error_of([] { number("1000.5"); }), "f.yaml:1:4: 1000.5 is out of range -1000 ... 1000");
    EXPECT_EQ(number("1000"), 1000.0);
}

TEST(YamlReader, WholeNumbersAndFlags)
{
    const Map map(parse("a: 3\nb: 3.5\nc: true\nd: yes"));
    EXPECT_EQ(map.at("a").integer(0, 10), 3);
    EXPECT_EQ(error_of([&] { map.at("b").integer(0, 10); }),
              "f.yaml:2:4: expected a whole number, found 3.5");
    EXPECT_TRUE(map.at("c").flag());
    EXPECT_EQ(error_of([&] { map.at("d").flag(); }), "f.yaml:4:4: expected true or false, found \"yes\"");
}

TEST(YamlReader, WordsFromAList)
{
    const Map map(parse("mode: sped"));
    EXPECT_EQ(error_of([&] {
                  map.at("mode").word({"speed", "torque"});
              }),
              "f.yaml:1:7: \"sped\" is not known here; one of: speed, torque; did you mean \"speed\"?");
}

TEST(YamlReader, VariablesAndProducts)
{
    const Variables variables = {{"load", "0.5"}, {"direction", "-1"}, {"word", "abc"}};
    EXPECT_EQ(number("$load", variables), 0.5);
    EXPECT_EQ(number("-$load", variables), -0.5);
    EXPECT_EQ(number("4.0*$load*$direction", variables), -2.0);
    EXPECT_EQ(number("$direction * 3", variables), -3.0);
    EXPECT_EQ(number("12*$load + 180*$direction + 0.5", variables), -173.5);
    EXPECT_EQ(number("1e+2", variables), 100.0);
    EXPECT_THAT(error_of([&] { number("2 + ", variables); }), HasSubstr("expected a number"));
    EXPECT_THAT(error_of([&] { number("2 + $word", variables); }), HasSubstr("$word is \"abc\""));
    EXPECT_EQ(error_of([&] { number("$laod", variables); }),
              "f.yaml:1:4: there is no variable \"$laod\"; did you mean \"load\"?");
    EXPECT_EQ(
        error_of([&] { number("2*$word", variables); }),
        "f.yaml:1:4: expected a number, found \"2*$word\" ($word is \"abc\"); a unit belongs in the key");
    EXPECT_THAT(error_of([&] { number("2*", variables); }), HasSubstr("expected a number"));
    EXPECT_EQ(error_of([&] { number("4000*$load", variables); }),
              "f.yaml:1:4: 4000*$load = 2000 is out of range -1000 ... 1000");
}

TEST(Text, NearestIsNotFarFetched)
{
    EXPECT_EQ(nearest("flux_bandwith", {"flux_bandwidth", "flux_gain"}), "flux_bandwidth");
    EXPECT_EQ(nearest("zzzzzz", {"flux_bandwidth", "flux_gain"}), std::nullopt);
    EXPECT_EQ(nearest("v_source_kV", {"v_full_scale_V", "v_source_V"}), "v_source_V");
}

} // namespace
} // namespace pmsim
