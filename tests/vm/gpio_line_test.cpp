// Lines of a real chip of the kernel; built over libgpiod 1.x and 2.x.
#include "tests/vm/gpio_sim.h"

namespace
{

using gpio_sim::level;
using gpio_sim::name;
using gpio_sim::open;
using gpio_sim::pull;
using gpio_sim::pulled_level;
using gpio_sim::wait_a_tick;

TEST(GpioLine, InputFollowsThePin)
{
    const auto line = open(name(0), GPIO_INPUT);
    const auto low = open(name(1, "!"), GPIO_INPUT);
    for (const bool up : {true, false, true}) {
        pull(0, up);
        pull(1, up);
        EXPECT_EQ(gpio_line_get(line.get()), up ? 1 : 0);
        EXPECT_EQ(gpio_line_get(low.get()), up ? 0 : 1);
    }
}

TEST(GpioLine, OutputDrivesThePin)
{
    pull(2, false);
    pull(3, true);
    const auto line = open(name(2), GPIO_OUTPUT_ON);
    const auto low = open(name(3, "!"), GPIO_OUTPUT_ON);
    EXPECT_TRUE(level(2)); // from the first moment
    EXPECT_FALSE(level(3));
    for (const bool on : {false, true, false}) {
        EXPECT_TRUE(gpio_line_set(line.get(), on));
        EXPECT_TRUE(gpio_line_set(low.get(), on));
        EXPECT_EQ(level(2), on);
        EXPECT_EQ(level(3), !on);
        EXPECT_EQ(gpio_line_get(line.get()), on ? 1 : 0);
        EXPECT_EQ(gpio_line_get(low.get()), on ? 1 : 0);
    }
}

TEST(GpioLine, OutputOffAtFirst)
{
    pull(2, true);
    pull(3, false);
    const auto line = open(name(2), GPIO_OUTPUT_OFF);
    const auto low = open(name(3, "!"), GPIO_OUTPUT_OFF);
    EXPECT_FALSE(level(2));
    EXPECT_TRUE(level(3));
}

TEST(GpioLine, OpenDrainOnlyPullsLow)
{
    pull(4, true);
    const auto line = open(name(4, "!"), GPIO_OPEN_DRAIN);
    EXPECT_TRUE(pulled_level(4, true));
    EXPECT_FALSE(pulled_level(4, false)); // somebody else pulls
    EXPECT_EQ(gpio_line_get(line.get()), 1);
    EXPECT_TRUE(gpio_line_set(line.get(), true));
    EXPECT_FALSE(pulled_level(4, true));
    EXPECT_TRUE(gpio_line_set(line.get(), false));
    EXPECT_TRUE(pulled_level(4, true));
    EXPECT_FALSE(pulled_level(4, false));
}

TEST(GpioLine, EdgesOfBothDirectionsAreKept)
{
    pull(5, false);
    const auto line = open(name(5), GPIO_EDGES);
    EXPECT_EQ(gpio_line_edges(line.get()), 0);
    pull(5, true);
    wait_a_tick();
    EXPECT_EQ(gpio_line_edges(line.get()), 1);
    EXPECT_EQ(gpio_line_get(line.get()), 1);
    EXPECT_EQ(gpio_line_edges(line.get()), 0);
    for (const bool up : {false, true, false}) { // a pulse between two looks
        pull(5, up);
        wait_a_tick();
    }
    EXPECT_EQ(gpio_line_edges(line.get()), 3);
    EXPECT_EQ(gpio_line_get(line.get()), 0);
}

TEST(GpioLine, APulseTooShortForItsLevelIsAnEdge)
{
    pull(5, false);
    const auto line = open(name(5), GPIO_EDGES);
    pull(5, true);
    pull(5, false);
    wait_a_tick();
    EXPECT_EQ(gpio_line_get(line.get()), 0);
    EXPECT_GE(gpio_line_edges(line.get()), 1);
}

TEST(GpioLine, EdgesOfAnActiveLowLine)
{
    pull(5, true);
    const auto line = open(name(5, "!"), GPIO_EDGES);
    pull(5, false);
    wait_a_tick();
    EXPECT_EQ(gpio_line_edges(line.get()), 1);
    EXPECT_EQ(gpio_line_get(line.get()), 1);
}

// More than the kernel keeps: some are lost, but it never looks as if there had been none.
TEST(GpioLine, AStormOfEdges)
{
    pull(5, false);
    const auto line = open(name(5), GPIO_EDGES);
    constexpr int count = 40;
    for (int n = 0; n < count; ++n) {
        pull(5, n % 2 == 0);
        wait_a_tick();
    }
    const int edges = gpio_line_edges(line.get());
    EXPECT_GE(edges, 16);
    EXPECT_LT(edges, count);
    EXPECT_EQ(gpio_line_edges(line.get()), 0);
    pull(5, true);
    wait_a_tick();
    EXPECT_EQ(gpio_line_edges(line.get()), 1);
}

TEST(GpioLine, ALineInUseIsRefusedUntilItIsClosed)
{
    char error[200] = "";
    auto line = open(name(6), GPIO_OUTPUT_OFF);
    EXPECT_EQ(gpio_line_open(name(6).c_str(), GPIO_INPUT, error, sizeof error), nullptr);
    EXPECT_NE(std::string(error).find(name(6)), std::string::npos) << error;
    EXPECT_NE(std::string(error).find("busy"), std::string::npos) << error;
    line.reset();
    EXPECT_TRUE(open(name(6), GPIO_INPUT));
}

TEST(GpioLine, AnOffsetBeyondTheChipIsRefused)
{
    for (const char *offset : {":8", ":4095"}) {
        char error[200] = "";
        const std::string wrong = gpio_sim::environment("GPIOSIM_CHIP") + offset;
        EXPECT_EQ(gpio_line_open(wrong.c_str(), GPIO_INPUT, error, sizeof error), nullptr);
        EXPECT_NE(std::string(error).find(wrong), std::string::npos) << error;
    }
}

TEST(GpioLine, ChipByItsPath)
{
    pull(0, true);
    const auto line = open("/dev/" + name(0), GPIO_INPUT);
    EXPECT_EQ(gpio_line_get(line.get()), 1);
}

} // namespace
