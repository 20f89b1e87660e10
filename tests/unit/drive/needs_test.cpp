// What a method needs and the board has not; currents that a period could not measure.
//
// The lists are those of the firmware, but for their last word: here each observer needs the neutral voltage, each
// low-speed source a second sample, each regulator legs that are held and each procedure the terminal voltages
// (CMakeLists.txt), so that the way from a row to the refusal is the firmware's own.
#include <gtest/gtest.h>

#include "tests/unit/drive/direct.h"

namespace
{

drive_result_t configured(int32_t observer, uint32_t channels)
{
    drive_params_t p = direct::params();
    p.observer = observer;
    drive_config_t config = {};
    return drive_configure(&config, &p, channels);
}

TEST(Needs, AnObserverIsRefusedByTheChannelThatIsMissing)
{
    for (int32_t id = 0; id < OBSERVER_COUNT; ++id) {
        const drive_result_t with = configured(id, PM_ALL);
        if (with.param != DRIVE_PARAM_COUNT) {
            continue; // not for this machine
        }
        EXPECT_TRUE(with.ok) << id;
        const drive_result_t without = configured(id, PM_ALL & ~NEEDS_NEUTRAL);
        EXPECT_FALSE(without.ok) << id;
        EXPECT_EQ(without.param, DRIVE_PARAM_observer) << id;
        EXPECT_STREQ(without.reason, "needs the neutral voltage: not on this board") << id;
    }
    EXPECT_TRUE(configured(OBSERVER_active_flux, PM_ALL).ok);
}

TEST(Needs, EveryListRefusesByItsOwnParameter)
{
    struct {
        uint32_t missing;
        drive_param_id_t blamed;
        const char *reason;
    } const rows[] = {
        {NEEDS_SECOND_SAMPLE, DRIVE_PARAM_injection,
         "needs a second sample in the period: not on this board"},
        {NEEDS_HELD, DRIVE_PARAM_regulator, "needs legs held high or low: not on this board"},
        {NEEDS_TERMINALS, DRIVE_PARAM_start_method, "needs the terminal voltages: not on this board"},
    };
    for (const auto &row : rows) {
        const drive_result_t result = configured(OBSERVER_active_flux, PM_ALL & ~row.missing);
        EXPECT_FALSE(result.ok);
        EXPECT_EQ(result.param, row.blamed);
        EXPECT_STREQ(result.reason, row.reason);
    }
}

TEST(Needs, ARefusedDriveStaysOff)
{
    const drive_params_t p = direct::params();
    drive_t drive = {};
    EXPECT_FALSE(drive_init(&drive, &p, 0).ok);
    EXPECT_EQ(drive.fault, DRIVE_FAULT_PARAMETERS);
}

// i_a + i_b + i_c = 0: whichever is missing follows from the others, whatever its converter says.
class CurrentMask : public ::testing::Test
{
  protected:
    static constexpr double kPu[3] = {0.25, -0.125, -0.125};
    static constexpr int32_t kTolerance = 3; // of Q28: offsets of the calibration cancel exactly here

    void SetUp() override
    {
        ASSERT_EQ(x.d.fault, DRIVE_FAULT_NONE);
        for (pm_q_t &zero : x.d.zero) {
            zero = PM_ONE; // mid-scale
        }
        for (int leg = 0; leg < 3; ++leg) {
            x.in.i_leg[leg] = direct::current_code(kPu[leg]);
        }
    }

    void expect_currents() const
    {
        const double one = 268435456.0;
        EXPECT_NEAR(x.d.i_abc.a, kPu[0] * one, kTolerance);
        EXPECT_NEAR(x.d.i_abc.b, kPu[1] * one, kTolerance);
        EXPECT_NEAR(x.d.i_abc.c, kPu[2] * one, kTolerance);
        EXPECT_NEAR(x.d.i_ab.alpha, 0.25 * one, kTolerance);
        EXPECT_NEAR(x.d.i_ab.beta, 0.0, kTolerance);
    }

    direct::Drive x;
};

TEST_F(CurrentMask, AllValid)
{
    drive_step(&x.d, &x.in, &x.out);
    expect_currents();
}

TEST_F(CurrentMask, TheMissingOneFollowsFromTheOthers)
{
    for (uint16_t leg = 0; leg < 3; ++leg) {
        drive_in_t in = x.in;
        in.i_leg[leg] = 0xFFFF;
        drive_step(&x.d, &in, &x.out);
        EXPECT_GT(std::abs(x.d.i_ab.alpha - 67108864) + std::abs(x.d.i_ab.beta), 1000000)
            << leg; // not marked
        in.more.missing = static_cast<uint16_t>(1U << leg);
        drive_step(&x.d, &in, &x.out);
        expect_currents();
    }
}

TEST_F(CurrentMask, AHiddenOneFollowsFromTheOthersForTwoPeriods)
{
    for (uint16_t leg = 0; leg < 3; ++leg) {
        drive_in_t in = x.in;
        in.i_leg[leg] = 0x8000;
        x.d.modulator.hidden = MODULATOR_NEXT << leg;
        for (int period = 0; period < 2; ++period) {
            drive_step(&x.d, &in, &x.out);
            expect_currents();
            EXPECT_EQ(x.d.completed, x.d.period);
        }
        drive_step(&x.d, &in, &x.out);
        EXPECT_NE(x.d.completed, x.d.period);
        EXPECT_GT(std::abs(x.d.i_ab.alpha - 67108864) + std::abs(x.d.i_ab.beta), 1000000) << leg;
    }
}

TEST_F(CurrentMask, WithFewerThanTwoTheLastStand)
{
    drive_step(&x.d, &x.in, &x.out);
    for (const uint16_t missing : {uint16_t(3), uint16_t(5), uint16_t(6), uint16_t(7)}) {
        drive_in_t in = x.in;
        for (uint16_t leg = 0; leg < 3; ++leg) {
            in.i_leg[leg] = (missing >> leg & 1) != 0 ? 0 : in.i_leg[leg];
        }
        in.more.missing = missing;
        drive_step(&x.d, &in, &x.out);
        expect_currents();
    }
}

} // namespace
