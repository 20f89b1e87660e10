// charge.h: all legs low for 2 ms between calibration and the first pulse, on boards that need it, in every start.
#include <gtest/gtest.h>

#include "tests/unit/drive/direct.h"

namespace
{

using direct::Drive;

Drive on_a_board(uint32_t channels, drive_mode_t mode)
{
    Drive x(direct::params(1));
    const drive_params_t p = direct::params(1);
    drive_init(&x.d, &p, channels);
    x.command.current_mA = 1000;
    x.enable(true, mode);
    return x;
}

TEST(Charge, AllLegsAreLowForTwoMillisecondsBeforeAnythingElseIsDriven)
{
    for (const drive_mode_t mode :
         {DRIVE_MODE_SPEED, DRIVE_MODE_TORQUE, DRIVE_MODE_CURRENT, DRIVE_MODE_IDENTIFY}) {
        Drive x = on_a_board(PM_CHANNELS | PM_BOOTSTRAP, mode);
        int low = 0;
        for (int k = 0; k < 2000 && (low == 0 || x.d.sequence.procedure == PROCEDURE_charge); ++k) {
            std::fill(&x.out.compare[0][0], &x.out.compare[0][0] + 6, uint16_t{77});
            x.step();
            if (x.driven()) {
                ++low;
                ASSERT_EQ(x.out.legs, PM_LEGS_PWM);
                for (const auto &compare : x.out.compare) {
                    ASSERT_EQ(compare[0], 0);
                    ASSERT_EQ(compare[1], 0);
                }
            }
            if (k % 10 == 9) {
                drive_slow(&x.d, &x.slow);
            }
        }
        EXPECT_EQ(low, 20) << mode;
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
        EXPECT_GT(x.d.sequence.procedure, PROCEDURE_NONE);
        EXPECT_NE(x.d.sequence.procedure, PROCEDURE_charge);
    }
}

TEST(Charge, IsPassedOverWhereNothingNeedsIt)
{
    Drive x = on_a_board(PM_CHANNELS, DRIVE_MODE_SPEED);
    for (int ms = 0; ms < 110 && x.d.sequence.procedure != PROCEDURE_initial_pulses; ++ms) {
        x.run_ms(1);
        ASSERT_NE(x.d.sequence.procedure, PROCEDURE_charge);
    }
    EXPECT_EQ(x.d.sequence.procedure, PROCEDURE_initial_pulses);
}

// A rotor that still turns drives a current through the shorted windings.
TEST(Charge, AnOverCurrentIsAFault)
{
    Drive x = on_a_board(PM_CHANNELS | PM_BOOTSTRAP, DRIVE_MODE_SPEED);
    for (int ms = 0; ms < 110 && x.d.sequence.procedure != PROCEDURE_charge; ++ms) {
        x.run_ms(1);
    }
    ASSERT_EQ(x.d.sequence.procedure, PROCEDURE_charge);
    x.step();
    EXPECT_TRUE(x.driven());
    x.in.i_leg[0] = direct::current_code(0.91);
    x.step();
    EXPECT_FALSE(x.driven());
    EXPECT_TRUE(x.out.trip);
    EXPECT_EQ(x.d.fault, DRIVE_FAULT_OVER_CURRENT);
}

} // namespace
