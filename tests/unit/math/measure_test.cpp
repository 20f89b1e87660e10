// Needs, their words, and the states of the legs in one word.
#include <gtest/gtest.h>

#include <string>

extern "C" {
#include "firmware/math/legs.h"
#include "firmware/math/measure.h"

const char *need_text_of_image(uint32_t missing); // pm_need_text() where only the neutral voltage is carried
}

namespace
{

TEST(Measure, AMissingChannelIsNamed)
{
    EXPECT_STREQ(pm_need_text(NEEDS_NEUTRAL), "needs the neutral voltage: not on this board");
    EXPECT_STREQ(pm_need_text(NEEDS_ONE_SWITCH), "needs PWM on one switch of a leg: not on this board");
    EXPECT_STREQ(pm_need_text(0), "");
    int named = 0;
    for (int bit = 0; bit < 32; ++bit) {
        const std::string text = pm_need_text(1U << bit);
        EXPECT_EQ(text.empty(), (PM_ALL >> bit & 1U) == 0U) << bit;
        named += text.empty() ? 0 : 1;
    }
    EXPECT_EQ(named, 12); // the names of measure.h, each with a bit of its own
}

TEST(Measure, TheFirstOfSeveralIsNamed)
{
    EXPECT_STREQ(pm_need_text(NEEDS_CAPTURES | NEEDS_TERMINALS), pm_need_text(NEEDS_TERMINALS));
}

// A board may have what its image does not carry.
TEST(Measure, AnImageNamesOnlyTheChannelsThatItCarries)
{
    EXPECT_STREQ(need_text_of_image(NEEDS_NEUTRAL), pm_need_text(NEEDS_NEUTRAL));
    EXPECT_STREQ(need_text_of_image(NEEDS_NEUTRAL | NEEDS_DC_CURRENT), pm_need_text(NEEDS_NEUTRAL));
    EXPECT_STREQ(need_text_of_image(NEEDS_DC_CURRENT), "is not in this image");
    EXPECT_STREQ(need_text_of_image(NEEDS_COMMUTATE), "is not in this image");
    EXPECT_STREQ(need_text_of_image(0), "");
}

TEST(Legs, StatesOfOneWord)
{
    const pm_leg_t all[] = {PM_LEG_OFF,  PM_LEG_PWM, PM_LEG_UPPER,    PM_LEG_LOWER,
                            PM_LEG_HIGH, PM_LEG_LOW, PM_LEG_INVERTED, PM_LEG_LOWER_INVERTED};
    for (const pm_leg_t a : all) {
        for (const pm_leg_t b : all) {
            for (const pm_leg_t c : all) {
                const uint16_t legs = pm_legs_of(a, b, c);
                EXPECT_EQ(pm_leg(legs, 0), a);
                EXPECT_EQ(pm_leg(legs, 1), b);
                EXPECT_EQ(pm_leg(legs, 2), c);
            }
        }
        EXPECT_EQ(PM_LEGS_ALL(a), pm_legs_of(a, a, a));
    }
}

} // namespace
