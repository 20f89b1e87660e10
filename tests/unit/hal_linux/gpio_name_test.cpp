#include <string>

#include <gtest/gtest.h>

extern "C" {
#include "hal/linux/gpio_backend.h"
}

namespace
{

TEST(GpioName, ChipOffsetAndPolarity)
{
    gpio_name_t name;
    char error[200];
    ASSERT_TRUE(gpio_name_parse("gpiochip0:4", &name, error, sizeof error));
    EXPECT_STREQ(name.chip, "gpiochip0");
    EXPECT_EQ(name.offset, 4U);
    EXPECT_FALSE(name.active_low);
    ASSERT_TRUE(gpio_name_parse("/dev/gpiochip12:31!", &name, error, sizeof error));
    EXPECT_STREQ(name.chip, "/dev/gpiochip12");
    EXPECT_EQ(name.offset, 31U);
    EXPECT_TRUE(name.active_low);
}

TEST(GpioName, RefusesEverythingElse)
{
    for (const char *text : {"", ":", "gpiochip0", "gpiochip0:", ":4", "gpiochip0:x", "gpiochip0:4x",
                             "gpiochip0:-1", "gpiochip0:99999", "gpiochip0:4!!"}) {
        gpio_name_t name;
        char error[200] = "";
        EXPECT_FALSE(gpio_name_parse(text, &name, error, sizeof error)) << text;
        EXPECT_NE(std::string(error).find("CHIP:OFFSET"), std::string::npos) << text;
    }
    gpio_name_t name;
    char error[200];
    EXPECT_FALSE(gpio_name_parse((std::string(100, 'c') + ":1").c_str(), &name, error, sizeof error));
}

TEST(GpioLine, OneThatIsNotThereIsRefused)
{
    char error[200] = "";
    EXPECT_EQ(gpio_line_open("no_such_chip:0", GPIO_INPUT, error, sizeof error), nullptr);
    EXPECT_NE(std::string(error).find("no_such_chip"), std::string::npos);
}

} // namespace
