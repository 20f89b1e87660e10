#include "tools/pmsim/methods.h"

#include <algorithm>
#include <bitset>
#include <filesystem>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "firmware/params/parameters.h"
#include "tools/pmsim/drive_parameters.h"

namespace pmsim
{
namespace
{

TEST(Methods, EveryRowOfTheBookOnce)
{
    ASSERT_EQ(methods().size(), 152U);
    int row = 0;
    for (const Method &method : methods()) {
        EXPECT_EQ(method.row, ++row);
        EXPECT_FALSE(method.section.empty() || method.name.empty()) << row;
    }
}

TEST(Methods, WhatIsImplementedHasItsParameterAndItsScenario)
{
    for (const Method &method : methods()) {
        if (!method.implemented) {
            EXPECT_EQ(method.parameter + method.scenario, "") << method.row;
            continue;
        }
        EXPECT_TRUE(method.parameter.empty() || method.parameter == "none" ||
                    find_parameter(method.parameter))
            << method.row;
        const bool is_test = method.scenario.find('/') != std::string::npos;
        const std::string proof = is_test ? "tests/unit/" + method.scenario + "_test.cpp"
                                          : "tests/scenario/" + method.scenario + ".yaml";
        EXPECT_TRUE(std::filesystem::exists(proof)) << method.row;
    }
}

// Each of the book's classes has a method, or says that the book has none; methods of two are those that inject under predictive
// control and the pulses that start blocks too.
TEST(Methods, EveryMethodHasItsClass)
{
    std::set<int> of_two;
    for (const Method &method : methods()) {
        const auto count = std::bitset<32>(method.classes).count();
        EXPECT_GE(count, 1U) << method.row;
        EXPECT_LE(count, 2U) << method.row;
        if (count == 2U) {
            of_two.insert(method.row);
        }
    }
    EXPECT_EQ(of_two, (std::set<int>{93, 99, 147}));
    for (const MethodClass &one : method_classes()) {
        const auto has = std::count_if(methods().begin(), methods().end(), [&one](const Method &method) {
            return (method.classes & one.mask) != 0;
        });
        EXPECT_EQ(has == 0, one.help.find("no method in the book") != std::string::npos) << one.word;
    }
}

// By sections: chapter 2 is of the fundamental model, 4.3 and 4.4 of persistent carriers, 9.3 to 9.6 of transient ones, 12 of modern control.
TEST(Methods, ClassesAreThoseOfTheBooksChapters)
{
    const std::map<std::string, std::string> of_chapter = {
        {"2.", "fundamental"}, {"4.3", "persistent"}, {"4.4", "persistent"},
        {"6.3", "persistent"}, {"9.4", "transient"},  {"9.5", "transient"},
        {"10.3", "terminal"},  {"11.4", "third"},     {"12.", "modern"}};
    for (const Method &method : methods()) {
        for (const auto &[chapter, word] : of_chapter) {
            if (method.section.rfind(chapter, 0) == 0) {
                const auto &all = method_classes();
                const auto one = std::find_if(all.begin(), all.end(),
                                              [&w = word](const MethodClass &c) { return c.word == w; });
                ASSERT_NE(one, all.end());
                EXPECT_NE(method.classes & one->mask, 0U) << method.row;
            }
        }
    }
}

} // namespace
} // namespace pmsim
