#include "tools/pmsim/csv.h"

#include <gmock/gmock.h>

#include "tests/unit/pmsim/support.h"

namespace pmsim
{
namespace
{

using testing::ElementsAre;
using testing::HasSubstr;

Csv read(const std::string &text)
{
    return Csv::from_text(text, "t.csv", {{"t_s", "va_V"}, {"load_Nm"}});
}

std::string error_in(const std::string &text)
{
    return error_of([&] { read(text); });
}

TEST(Csv, ColumnsInAnyOrder)
{
    const Csv csv = read("va_V,t_s\n1.5,0\n-2e-3,1\n");
    EXPECT_EQ(csv.rows(), 2U);
    EXPECT_THAT(csv.column("t_s"), ElementsAre(0.0, 1.0));
    EXPECT_THAT(csv.column("va_V"), ElementsAre(1.5, -2e-3));
    EXPECT_FALSE(csv.has("load_Nm"));
    EXPECT_TRUE(read("t_s,load_Nm,va_V\n0,1,2\n").has("load_Nm"));
}

// What spreadsheets and other tools write.
TEST(Csv, ToleratesOtherLineEndsBlanksAndComments)
{
    const Csv csv = read("\xef\xbb\xbf# made elsewhere\r\n t_s , va_V \r\n\r\n0 , +1\r\n# half\r\n1,2");
    EXPECT_THAT(csv.column("va_V"), ElementsAre(1.0, 2.0));
    EXPECT_EQ(csv.line(0), 4);
    EXPECT_EQ(csv.line(1), 6);
}

TEST(Csv, ErrorsOfTheHeader)
{
    EXPECT_EQ(error_in("t_s,va_mV\n0,0\n"),
              "t.csv:1: unknown column \"va_mV\": wrong unit; did you mean \"va_V\"?");
    EXPECT_EQ(error_in("t_ms,va_V\n0,0\n"),
              "t.csv:1: unknown column \"t_ms\": wrong unit; did you mean \"t_s\"?");
    EXPECT_EQ(error_in("# x\nt_s\n0\n"), "t.csv:2: column \"va_V\" is missing");
    EXPECT_EQ(error_in("t_s,va_V,t_s\n0,0,0\n"), "t.csv:1: column \"t_s\" stands here a second time");
    EXPECT_EQ(error_in("t_s,va_V,\n0,0,\n"), "t.csv:1: unknown column \"\"; known: t_s, va_V, load_Nm");
    EXPECT_EQ(error_in("t_s;va_V\n0;0\n"), "t.csv:1: columns are separated by commas, not by semicolons");
    EXPECT_THAT(error_in("0,0\n1,1\n"), HasSubstr("t.csv:1: unknown column \"0\""));
    EXPECT_EQ(error_in(""), "t.csv: there is no header line");
    EXPECT_EQ(error_in("t_s,va_V\n"), "t.csv: there are no rows");
}

TEST(Csv, ErrorsOfTheRows)
{
    EXPECT_EQ(error_in("t_s,va_V\n0,0\n1\n"), "t.csv:3: expected 2 values, found 1");
    EXPECT_EQ(error_in("t_s,va_V\n0,0,0\n"), "t.csv:2: expected 2 values, found 3");
    EXPECT_EQ(error_in("t_s,va_V\n0,\n"), "t.csv:2: expected a number for va_V, found \"\"");
    EXPECT_EQ(error_in("t_s,va_V\n0,1 V\n"), "t.csv:2: expected a number for va_V, found \"1 V\"");
    EXPECT_EQ(error_in("t_s,va_V\n0,+-1\n"), "t.csv:2: expected a number for va_V, found \"+-1\"");
    EXPECT_EQ(error_in("t_s,va_V\n0,nan\n"), "t.csv:2: \"nan\" for va_V is not a finite number");
    EXPECT_EQ(error_in("t_s,va_V\n0,-inf\n"), "t.csv:2: \"-inf\" for va_V is not a finite number");
    EXPECT_EQ(error_in("t_s,va_V\n0,1e999\n"), "t.csv:2: \"1e999\" for va_V is not a finite number");
    EXPECT_EQ(error_in(std::string("t_s,va_V\n0,") + '\x1b' + "[2J\n"),
              "t.csv:2: expected a number for va_V, found \"\\u001b[2J\"");
}

TEST(Csv, FilesThatCannotBeRead)
{
    const auto error = [](const char *path) {
        return error_of([&] { Csv::from_file(path, {{"t_s"}, {}}); });
    };
    EXPECT_EQ(error("no_such.csv"), "no_such.csv: cannot be read, or is empty");
    EXPECT_EQ(error("tests"), "tests: cannot be read, or is empty");
}

TEST(Csv, FailNamesTheLineOfTheRow)
{
    const Csv csv = read("t_s,va_V\n\n0,0\n");
    EXPECT_EQ(error_of([&] { csv.fail(0, "too much"); }), "t.csv:3: too much");
}

} // namespace
} // namespace pmsim
