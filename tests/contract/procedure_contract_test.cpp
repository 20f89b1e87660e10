// Every procedure of the list, as the drive runs it: what procedures/procedure.h promises of all.
#include <gtest/gtest.h>

#include <string>

#include "tests/unit/drive/direct.h"

namespace
{

using direct::Drive;

enum class Trait { BARE, LEGS, CONTROL, ALONE };

struct Row {
    procedure_id_t id;
    const char *name;
    Trait trait;
};

const Row kRows[] = {
#define PM_METHOD(name, help, traits, needs) {PROCEDURE_##name, #name, Trait::traits},
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
};

// No procedure has more than this: the identification holds its vector, ramps and waits.
constexpr int kLongest_ms = 30000;

class Procedure : public ::testing::TestWithParam<Row>
{
  protected:
    // Parameters of a start whose pulses are this procedure, if it is one.
    static drive_params_t params()
    {
        drive_params_t p = direct::params(1);
        for (p.position_pulses = 0;; ++p.position_pulses) {
            drive_config_t config = {};
            if (!drive_configure(&config, &p, PM_ALL).ok) {
                return direct::params(1);
            }
            if (config.find == GetParam().id) {
                return p;
            }
        }
    }

    // The drive stands calibrated with this procedure at work, whatever sequence it belongs to.
    static Drive begun()
    {
        Drive x(params());
        x.d.zero[0] = x.d.zero[1] = x.d.zero[2] = PM_ONE;
        x.command.current_mA = 1000;
        x.command.speed_mrad_s = 30000;
        x.enable(true, GetParam().trait == Trait::ALONE ? DRIVE_MODE_IDENTIFY : DRIVE_MODE_SPEED);
        x.step();
        reference_take(&x.d);
        procedure_begin(&x.d, GetParam().id);
        drive_prepare(&x.d);
        return x;
    }

    static bool in_place(const Drive &x)
    {
        return x.d.stage == STAGE_PROCEDURE;
    }

    // A period and, each tenth, the millisecond; the result of the latter.
    static pm_procedure_t period(Drive &x, int k)
    {
        x.step();
        if (k % 10 != 9) {
            return PM_RUNNING;
        }
        const pm_procedure_t result = procedure_slow(&x.d);
        drive_prepare(&x.d);
        return result;
    }
};

TEST_P(Procedure, ShowsItsStateAndStage)
{
    const Drive x = begun();
    const drive_state_t expected[] = {DRIVE_CALIBRATING, DRIVE_FINDING, DRIVE_FINDING, DRIVE_RUNNING};
    EXPECT_EQ(x.d.state, expected[static_cast<int>(GetParam().trait)]);
    EXPECT_EQ(in_place(x), GetParam().trait != Trait::CONTROL);
    if (in_place(x)) {
        EXPECT_EQ(x.d.pll.theta, 0U);
        EXPECT_EQ(x.d.pll.omega, 0);
    }
}

// Without a motor: what measures sees it and says so, in bounded time; what measures nothing of it ends.
TEST_P(Procedure, EndsInBoundedTimeAndFailsWithoutACurrent)
{
    Drive x = begun();
    pm_procedure_t result = PM_RUNNING;
    int k = 0;
    for (; result == PM_RUNNING && k < 10 * kLongest_ms; ++k) {
        result = period(x, k);
        ASSERT_EQ(x.d.fault, DRIVE_FAULT_NONE);
    }
    const bool measures = GetParam().trait != Trait::BARE && GetParam().id != PROCEDURE_charge &&
                          GetParam().id != PROCEDURE_align;
    EXPECT_TRUE(measures ? result > PM_DONE && result < PM_PROCEDURE_COUNT : result == PM_DONE) << result;
}

// Sensors at the end of their range
TEST_P(Procedure, CodesOfZeroAreNotASuccessOfCalibration)
{
    if (GetParam().trait != Trait::BARE) {
        return;
    }
    Drive x = begun();
    x.in.i_leg[0] = x.in.i_leg[1] = x.in.i_leg[2] = 0;
    pm_procedure_t result = PM_RUNNING;
    for (int k = 0; result == PM_RUNNING && k < 10 * kLongest_ms; ++k) {
        result = period(x, k);
        ASSERT_FALSE(x.driven());
    }
    EXPECT_EQ(result, PM_FAILED_OFFSET);
}

TEST_P(Procedure, DrivesNothingAfterItsEnd)
{
    for (const pm_procedure_t end : {PM_DONE, PM_FAILED_TIMEOUT}) {
        Drive x = begun();
        if (!in_place(x)) {
            return; // current control goes on, by what the sequence says
        }
        x.run_ms(0);
        x.step();
        x.d.procedure.result = end;
        for (int k = 0; k < 30; ++k) {
            x.step();
            ASSERT_FALSE(x.driven());
        }
    }
}

TEST_P(Procedure, AnAbortAtAnyTimeLeavesTheBridgeOff)
{
    for (int periods = 0; periods < 400; periods += 7) {
        Drive x = begun();
        for (int k = 0; k < periods && period(x, k) == PM_RUNNING; ++k) {
        }
        x.command.coast = true;
        x.enable(false, x.command.mode);
        drive_slow(&x.d, &x.slow);
        EXPECT_EQ(x.d.sequence.procedure, PROCEDURE_NONE);
        EXPECT_EQ(x.state(), DRIVE_OFF);
        for (int k = 0; k < 20; ++k) {
            x.step();
            ASSERT_FALSE(x.driven()) << periods;
        }
        EXPECT_NE(x.d.commissioning_report.state, COMMISSIONING_RUNNING);
    }
}

// Begun again, it finds nothing of the run before.
TEST_P(Procedure, BeginsAnewFromZero)
{
    Drive once = begun();
    Drive twice = begun();
    for (int k = 0; k < 173 && period(twice, k) == PM_RUNNING; ++k) {
    }
    procedure_abort(&twice.d);
    procedure_begin(&twice.d, GetParam().id);
    drive_prepare(&twice.d);
    for (int k = 0; k < 300; ++k) {
        const pm_procedure_t a = period(once, k);
        const pm_procedure_t b = period(twice, k);
        ASSERT_EQ(a, b) << k;
        for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
            ASSERT_EQ(once.out.legs, twice.out.legs) << k;
            if (once.driven() && in_place(once)) { // current control has a past of its own
                ASSERT_EQ(once.out.compare[leg][0], twice.out.compare[leg][0]) << k;
            }
        }
        ASSERT_EQ(once.d.theta_open, twice.d.theta_open) << k;
        if (a != PM_RUNNING) {
            break;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, Procedure, ::testing::ValuesIn(kRows),
                         [](const ::testing::TestParamInfo<Row> &row) {
                             return std::string(row.param.name);
                         });

} // namespace
