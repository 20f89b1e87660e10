#include "sim_plant/board/alarms.h"

#include <gtest/gtest.h>

#include <vector>

namespace
{

std::vector<uint64_t> calls;

struct Owner {
    uint64_t id;
};

void note(void *owner, uint64_t cycle)
{
    calls.push_back(static_cast<Owner *>(owner)->id * 1000 + cycle);
}

struct Alarms : ::testing::Test {
    alarms_t alarms{};
    Owner a{1}, b{2}, c{3};

    void SetUp() override
    {
        calls.clear();
        alarms_clear(&alarms);
    }

    void serve(uint64_t now)
    {
        while (alarms_serve(&alarms, now)) {
        }
    }
};

TEST_F(Alarms, EarliestFirst)
{
    alarms_set(&alarms, &a, 30, note);
    alarms_set(&alarms, &b, 10, note);
    alarms_set(&alarms, &c, 20, note);
    EXPECT_EQ(alarms.next, 10U);
    serve(9);
    EXPECT_TRUE(calls.empty());
    serve(25);
    EXPECT_EQ(calls, (std::vector<uint64_t>{2010, 3020}));
    EXPECT_EQ(alarms.next, 30U);
}

TEST_F(Alarms, EqualCyclesInTheOrderOfAsking)
{
    alarms_set(&alarms, &b, 10, note);
    alarms_set(&alarms, &a, 10, note);
    serve(10);
    EXPECT_EQ(calls, (std::vector<uint64_t>{2010, 1010}));
}

TEST_F(Alarms, ALaterCallReplacesAndCancels)
{
    alarms_set(&alarms, &a, 10, note);
    alarms_set(&alarms, &a, 50, note);
    alarms_set(&alarms, &b, 20, note);
    alarms_set(&alarms, &b, UINT64_MAX, note);
    serve(100);
    EXPECT_EQ(calls, (std::vector<uint64_t>{1050}));
    EXPECT_EQ(alarms.next, UINT64_MAX);
}

void again(void *owner, uint64_t cycle)
{
    auto *alarms = static_cast<alarms_t *>(owner);
    calls.push_back(cycle);
    if (cycle < 40) {
        alarms_set(alarms, owner, cycle + 10, again);
    }
}

TEST_F(Alarms, MayBeSetFromWithin)
{
    alarms_set(&alarms, &alarms, 10, again);
    serve(100);
    EXPECT_EQ(calls, (std::vector<uint64_t>{10, 20, 30, 40}));
}

TEST_F(Alarms, ReportsTooMany)
{
    std::vector<Owner> owners(ALARMS_MOST + 1);
    for (size_t i = 0; i < size_t(ALARMS_MOST); i++) {
        EXPECT_TRUE(alarms_set(&alarms, &owners[i], 10, note));
    }
    EXPECT_FALSE(alarms_set(&alarms, &owners[ALARMS_MOST], 10, note));
    EXPECT_TRUE(alarms_set(&alarms, &owners[3], 20, note)) << "replacing needs no room";
}

} // namespace
