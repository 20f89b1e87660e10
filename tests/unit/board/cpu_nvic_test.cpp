#include "sim_plant/board/nvic.h"

#include <gtest/gtest.h>

namespace
{

constexpr int low = EXCEPTION_IRQ0 + 18, high = EXCEPTION_IRQ0 + 20, third = EXCEPTION_IRQ0 + 100;

struct Nvic : ::testing::Test {
    nvic_t nvic{};
    nvic_masks_t masks{};

    void SetUp() override
    {
        nvic_reset(&nvic);
        for (const int line : {low, high, third}) {
            nvic_enable(&nvic, line, true);
        }
        nvic_set_priority(&nvic, low, 0x80);
        nvic_set_priority(&nvic, high, 0x40);
        nvic_set_priority(&nvic, third, 0xC0);
    }

    int next()
    {
        return nvic_next(&nvic, nvic_execution_priority(&nvic, &masks));
    }
};

TEST_F(Nvic, IdleTakesNothing)
{
    EXPECT_EQ(next(), 0);
    EXPECT_EQ(nvic_execution_priority(&nvic, &masks), NVIC_IDLE);
}

TEST_F(Nvic, TheMostUrgentPendingComesFirst)
{
    nvic_pend(&nvic, third, 0);
    nvic_pend(&nvic, low, 0);
    EXPECT_EQ(next(), low);
    nvic_pend(&nvic, high, 0);
    EXPECT_EQ(next(), high);
    nvic_pend(&nvic, EXCEPTION_NMI, 0);
    EXPECT_EQ(next(), EXCEPTION_NMI);
}

TEST_F(Nvic, AmongEqualsTheLowestNumber)
{
    nvic_set_priority(&nvic, high, 0x80);
    nvic_pend(&nvic, high, 0);
    nvic_pend(&nvic, low, 0);
    EXPECT_EQ(next(), low);
}

TEST_F(Nvic, OnlyMoreUrgentPreempts)
{
    nvic_pend(&nvic, low, 0);
    nvic_activate(&nvic, low);
    EXPECT_FALSE(nvic_pending(&nvic, low));
    nvic_pend(&nvic, low, 0);
    nvic_pend(&nvic, third, 0);
    EXPECT_EQ(next(), 0);
    nvic_pend(&nvic, high, 0);
    EXPECT_EQ(next(), high);
}

TEST_F(Nvic, MasksHoldBack)
{
    nvic_pend(&nvic, low, 0);
    masks.basepri = 0x80;
    EXPECT_EQ(next(), 0);
    masks.basepri = 0x90;
    EXPECT_EQ(next(), low);
    masks.primask = true;
    EXPECT_EQ(next(), 0);
    nvic_pend(&nvic, EXCEPTION_HARD_FAULT, 0);
    EXPECT_EQ(next(), EXCEPTION_HARD_FAULT);
    masks.faultmask = true;
    EXPECT_EQ(next(), 0);
    nvic_pend(&nvic, EXCEPTION_NMI, 0);
    EXPECT_EQ(next(), EXCEPTION_NMI);
}

TEST_F(Nvic, DisabledStaysPending)
{
    nvic_enable(&nvic, low, false);
    nvic_pend(&nvic, low, 0);
    EXPECT_EQ(next(), 0);
    nvic_enable(&nvic, low, true);
    EXPECT_EQ(next(), low);
    nvic_unpend(&nvic, low);
    EXPECT_EQ(next(), 0);
}

TEST_F(Nvic, GroupsPreemptAndSubPrioritiesOrder)
{
    nvic_set_group(&nvic, 6); /* one bit of group priority: 0x40 and 0x70 are one group */
    nvic_set_priority(&nvic, low, 0x70);
    nvic_pend(&nvic, low, 0);
    nvic_activate(&nvic, low);
    nvic_pend(&nvic, high, 0);
    EXPECT_EQ(next(), 0);
    nvic_deactivate(&nvic, low, 0);
    nvic_pend(&nvic, low, 0);
    EXPECT_EQ(next(), high);
}

TEST_F(Nvic, OnlyFourBitsOfPriorityExist)
{
    nvic_set_priority(&nvic, low, 0x8F);
    EXPECT_EQ(nvic.priority[low], 0x80);
}

TEST_F(Nvic, AHighLinePendsAgainAfterReturn)
{
    nvic_set_level(&nvic, low, true, 5);
    EXPECT_EQ(nvic.pended_at[low], 5U);
    nvic_activate(&nvic, low);
    EXPECT_EQ(next(), 0);
    nvic_deactivate(&nvic, low, 9);
    EXPECT_EQ(next(), low);
    EXPECT_EQ(nvic.pended_at[low], 9U);
    nvic_unpend(&nvic, low);
    EXPECT_EQ(next(), low) << "the line is still high";
    nvic_activate(&nvic, low);
    nvic_set_level(&nvic, low, false, 10);
    nvic_deactivate(&nvic, low, 11);
    EXPECT_EQ(next(), 0);
}

TEST_F(Nvic, APulseIsRemembered)
{
    nvic_set_level(&nvic, low, true, 0);
    nvic_set_level(&nvic, low, false, 1);
    EXPECT_EQ(next(), low);
}

TEST_F(Nvic, ResetKeepsLinesAndForgetsTheRest)
{
    nvic_set_level(&nvic, high, true, 0);
    nvic_pend(&nvic, low, 0);
    nvic_activate(&nvic, low);
    nvic_reset(&nvic);
    EXPECT_TRUE(nvic_pending(&nvic, high));
    EXPECT_FALSE(nvic_active(&nvic, low));
    EXPECT_FALSE(nvic_enabled(&nvic, high));
    EXPECT_EQ(next(), 0);
}

} // namespace
