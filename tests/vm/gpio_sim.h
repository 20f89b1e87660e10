// The other side of the lines of a gpio-sim chip, as tests/vm/run provides it.
#ifndef TESTS_VM_GPIO_SIM_H
#define TESTS_VM_GPIO_SIM_H

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>

extern "C" {
#include "hal/linux/gpio_line.h"
}

namespace gpio_sim
{

inline std::string environment(const char *name)
{
    const char *value = std::getenv(name);
    EXPECT_NE(value, nullptr) << name << " is not set: tests/vm/run runs this program";
    return value != nullptr ? value : "";
}

inline std::string file(int line, const char *attribute)
{
    return environment("GPIOSIM_LINES") + "/sim_gpio" + std::to_string(line) + "/" + attribute;
}

// What the chip reads at a pin that nobody drives. A pin that its owner has just let go keeps its level until
// it is pulled again.
inline void pull(int line, bool up)
{
    std::ofstream(file(line, "pull")) << (up ? "pull-up" : "pull-down") << std::flush;
}

inline bool level(int line)
{
    int value = -1;
    std::ifstream(file(line, "value")) >> value;
    EXPECT_TRUE(value == 0 || value == 1) << value;
    return value == 1;
}

inline bool pulled_level(int line, bool up)
{
    pull(line, up);
    return level(line);
}

// The simulated interrupt comes up to a tick of the kernel after the edge; edges within a tick become one.
inline void wait_a_tick()
{
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

inline std::string name(int line, const char *suffix = "")
{
    return environment("GPIOSIM_CHIP") + ":" + std::to_string(line) + suffix;
}

using Line = std::unique_ptr<gpio_line_t, void (*)(gpio_line_t *)>;

inline Line open(const std::string &name, gpio_use_t use)
{
    char error[200] = "";
    Line line(gpio_line_open(name.c_str(), use, error, sizeof error), &gpio_line_close);
    EXPECT_TRUE(line) << error;
    return line;
}

} // namespace gpio_sim

#endif
