// A short after a fault (firmware/drive/fault_short.h): the application keeps the bridge armed while it is held, opens it
// afterwards, and arms nothing for it. IPM-1000 at 1.3 times rated speed on 130 V, EMF 167 V.
#include "tests/unit/app/bench.h"

using app_test::Bench;
using app_test::defaults;

namespace
{

constexpr uint16_t fault_bits = 0x004F, reaction_active = 0x000F, in_fault = 0x0008;
constexpr double fast_rad_s = 136;

class Fast : public Bench
{
  public:
    explicit Fast(int32_t fault_short = 1)
    {
        drive_params_t p = defaults();
        p.fault_short = fault_short;
        p.L_d = 48000000; // 2 psi_m / L_d = 9.83 A, within the 10 A of the converters
        p.i_trip = 9900;
        p.v_injection = 40000;
        plant_set_source(plant(), 130);
        boot(&p);
        send(true);
        for (int ms = 0; ms < 2500; ms += 100) {
            control(0x0F, 3, int32_t(1e3 * fast_rad_s));
            run_ms(100);
        }
        plant_set_speed(plant(), fast_rad_s);
        EXPECT_EQ(loop.app.drive.state, DRIVE_RUNNING);
    }

    void periods(int count)
    {
        for (int n = 0; n < count; ++n) {
            sim_loop_step(&loop);
        }
    }

    bool shorted() const
    {
        bool low = loop.hal.armed && loop.app.out.legs == PM_LEGS_PWM;
        for (const auto &compare : loop.app.out.compare) {
            low = low && compare[0] == 0 && compare[1] == 0;
        }
        return low;
    }
};

// The master falls silent at any instant of a millisecond's ten periods.
TEST(Short, IsHeldUntilTheRotorIsSlowAndThenTheBridgeIsOff)
{
    for (int instant = 0; instant < 10; ++instant) {
        Fast x;
        x.periods(instant);
        app_t *app = &x.loop.app;
        node_host_alarm(app, 0x8130);
        x.periods(1);
        for (int n = 0; n < 1000; ++n) {
            x.periods(1);
            ASSERT_TRUE(x.shorted()) << instant << " " << n;
        }
        EXPECT_EQ(x.fault(), DRIVE_FAULT_REMOTE_LOST);
        EXPECT_EQ(x.statusword() & fault_bits, reaction_active);
        // neither the user's reset nor a new command changes it
        x.control(0x80);
        x.run_ms(2);
        x.control(0x06);
        x.control(0x07);
        x.control(0x0F);
        x.run_ms(20);
        EXPECT_TRUE(x.shorted());
        EXPECT_EQ(x.set(DRIVE_PARAM_i_trip, 9950), SDO_STATE); // the bridge is on
        EXPECT_EQ(x.fault(), DRIVE_FAULT_REMOTE_LOST);
        plant_set_speed(x.plant(), 60); // EMF 74 V
        x.run_ms(60);
        EXPECT_FALSE(x.loop.hal.armed);
        EXPECT_EQ(x.loop.app.out.legs, PM_LEGS_OFF);
        EXPECT_EQ(x.statusword() & fault_bits, in_fault);
        plant_set_speed(x.plant(), fast_rad_s);
        x.run_ms(50);
        EXPECT_FALSE(x.loop.hal.armed);
    }
}

TEST(Short, NotWantedTheBridgeOpens)
{
    Fast x(0);
    node_host_alarm(&x.loop.app, 0x8130);
    x.periods(1);
    EXPECT_FALSE(x.loop.hal.armed);
    EXPECT_EQ(x.loop.app.out.legs, PM_LEGS_OFF);
}

// The hardware wins, and nothing arms the bridge again.
TEST(Short, ABreakOpensIt)
{
    for (int instant = 0; instant < 10; ++instant) {
        Fast x;
        node_host_alarm(&x.loop.app, 0x8130);
        x.periods(30 + instant);
        ASSERT_TRUE(x.shorted());
        sim_break(&x.loop.hal);
        for (int n = 0; n < 500; ++n) {
            ASSERT_FALSE(x.loop.hal.armed) << instant;
            x.periods(1);
            ASSERT_EQ(x.loop.app.out.legs, PM_LEGS_OFF) << instant;
        }
        EXPECT_EQ(x.loop.app.drive.stage, STAGE_OFF);
        EXPECT_EQ(x.fault(), DRIVE_FAULT_REMOTE_LOST);
    }
}

// Outputs that have gone without a break, too.
TEST(Short, LostOutputsEndIt)
{
    Fast x;
    node_host_alarm(&x.loop.app, 0x8130);
    x.periods(30);
    ASSERT_TRUE(x.shorted());
    hal_bridge_off(&x.loop.hal);
    x.run_ms(2);
    EXPECT_EQ(x.loop.app.drive.stage, STAGE_OFF);
    EXPECT_FALSE(x.loop.hal.armed);
}

// A short of a bridge that this application has not armed is none.
TEST(Short, ArmsNothing)
{
    Fast x;
    node_host_alarm(&x.loop.app, 0x8130);
    x.periods(30);
    ASSERT_TRUE(x.shorted());
    x.loop.app.armed = false;
    x.run_ms(1);
    EXPECT_FALSE(x.loop.hal.armed);
    x.run_ms(20);
    EXPECT_FALSE(x.loop.hal.armed);
}

TEST(Short, AControlThatHasStoppedOpensIt)
{
    Fast x;
    node_host_alarm(&x.loop.app, 0x8130);
    x.periods(30);
    ASSERT_TRUE(x.shorted());
    app_monitor(&x.loop.app);
    app_monitor(&x.loop.app);
    EXPECT_FALSE(x.loop.hal.armed);
    app_turn(&x.loop.app);
    EXPECT_EQ(x.loop.app.drive.stage, STAGE_OFF);
}

} // namespace
