// fault_short.h: which faults are followed by a short, at which speed it begins and ends, and what opens it at once. The
// machine is the linear one of the header, shorted, at a speed that the test says.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <set>

#include "tests/unit/drive/direct.h"

namespace
{

using bench::Complex;
using bench::kPi;
using direct::current_code;
using direct::voltage_code;

constexpr double kR = 6, kLd = 43e-3, kLq = 75e-3, kPsi = 0.236; // the presets
constexpr double kFullScale_A = 12, kTrip = 3 * 180;             // of speed_trip: base of the speed
constexpr double kPeriod_s = 1e-4;
constexpr double kLink_V = 130;

const std::set<int> kBearing = {
    DRIVE_FAULT_OVER_VOLTAGE, DRIVE_FAULT_UNDER_VOLTAGE,      DRIVE_FAULT_POSITION_LOST,
    DRIVE_FAULT_STALL,        DRIVE_FAULT_OVER_SPEED,         DRIVE_FAULT_REMOTE_LOST,
    DRIVE_FAULT_OVERLOAD,     DRIVE_FAULT_TEMPERATURE_SENSOR, DRIVE_FAULT_NO_THIRD_HARMONIC};

drive_params_t params(int32_t fault_short = 1)
{
    drive_params_t p = direct::params();
    p.i_full_scale = 12000;
    p.i_trip = 11000;
    p.fault_short = fault_short;
    return p;
}

// Electrical speed at which the EMF between the lines has this peak
double omega_of(double v_V)
{
    return v_V / (std::sqrt(3.0) * kPsi);
}

// Calibrated, and at a speed with the observer in the lead, as far as a fault looks at it
struct Fast : direct::Drive {
    double omega, theta = 1.0;
    Complex psi = 0.15; // rotor frame
    double noise = 0;

    explicit Fast(double omega_1_s, const drive_params_t &p = params(), double v_V = kLink_V)
        : direct::Drive(p), omega(omega_1_s)
    {
        enable(true);
        run_ms(110);
        in.v_dc = voltage_code(v_V);
        d.state = DRIVE_RUNNING;
        d.stage = STAGE_VECTOR;
        d.sequence.procedure = PROCEDURE_NONE;
        position_reset(&d.position, &d.config.position, &direct::kAtRest, {0, 0}, false);
        d.position.quality = PM_ONE;
        d.pll.omega = d.status.omega_ref = bench::fixed(omega / kTrip, 28);
        d.status.v_dc = bench::fixed(v_V / 450, 28);
        d.fault = DRIVE_FAULT_NONE;
    }

    Complex current() const
    {
        return {(psi.real() - kPsi) / kLd, psi.imag() / kLq};
    }

    // A period of the shorted machine, then its currents in the converters
    void turn()
    {
        const int parts = 50;
        for (int n = 0; n < parts; ++n) {
            psi += kPeriod_s / parts * (-kR * current());
            psi *= std::polar(1.0, -omega * kPeriod_s / parts);
        }
        theta += omega * kPeriod_s;
        const Complex i = current() * std::polar(1.0 / kFullScale_A, theta);
        for (int leg = 0; leg < 3; ++leg) {
            noise = -noise;
            in.i_leg[leg] = current_code((i * std::polar(1.0, -leg * 2 * kPi / 3)).real() + noise);
        }
    }

    void period()
    {
        turn();
        step();
        if (d.period % 10 == 0) {
            drive_slow(&d, &slow);
        }
    }

    bool shorted() const
    {
        return out.legs == PM_LEGS_PWM && out.trip == 0 && out.compare[0][0] == 0 && out.compare[0][1] == 0 &&
               out.compare[1][0] == 0 && out.compare[1][1] == 0 && out.compare[2][0] == 0 &&
               out.compare[2][1] == 0;
    }

    bool open() const
    {
        return out.legs == PM_LEGS_OFF && out.trip == 1;
    }

    // Shorted by a fault that bears it
    void begin()
    {
        drive_trip(&d, DRIVE_FAULT_REMOTE_LOST);
        period();
        ASSERT_TRUE(shorted());
    }

    int periods_held(int most)
    {
        for (int n = 0; n < most; ++n) {
            period();
            if (!shorted()) {
                EXPECT_TRUE(open());
                return n;
            }
        }
        return most;
    }
};

TEST(FaultShort, FollowsTheFaultsThatLeaveTheLowSwitchesUsable)
{
    for (int fault = 1; fault < DRIVE_FAULT_COUNT; ++fault) {
        for (const int32_t wanted : {0, 1}) {
            Fast x(1.3 * omega_of(kLink_V), params(wanted));
            drive_trip(&x.d, static_cast<drive_fault_t>(fault));
            x.period();
            const bool bears = wanted != 0 && kBearing.count(fault) != 0;
            EXPECT_EQ(x.shorted(), bears) << fault;
            EXPECT_EQ(x.open(), !bears) << fault;
            x.run_ms(1);
            EXPECT_EQ(x.fault(), fault); // latched and reported alike
            EXPECT_EQ(x.state(), DRIVE_FAULT);
            EXPECT_EQ(drive_fault_record(&x.d)->fault, fault);
            EXPECT_NEAR(bench::real(drive_fault_record(&x.d)->omega) * kTrip, x.omega, 0.01);
        }
    }
}

// As found by the step, at every angle of the rotor: in that very step, with the values of the moment.
TEST(FaultShort, FollowsAtAnyInstant)
{
    for (int instant = 0; instant < 24; ++instant) {
        Fast x(1.3 * omega_of(kLink_V));
        x.theta = instant * kPi / 12;
        x.in.v_dc = voltage_code(instant % 2 == 0 ? 59.0 : 401.0);
        x.d.pll.omega = bench::fixed(1.3 * omega_of(instant % 2 == 0 ? 60.0 : 401.0) / kTrip, 28);
        x.turn();
        x.step();
        EXPECT_TRUE(x.shorted()) << instant;
        EXPECT_EQ(x.d.fault, instant % 2 == 0 ? DRIVE_FAULT_UNDER_VOLTAGE : DRIVE_FAULT_OVER_VOLTAGE);
        EXPECT_EQ(drive_fault_record(&x.d)->period, x.d.period);
    }
}

TEST(FaultShort, BeginsWhereTheEmfExceedsTheLinkByASixteenth)
{
    for (const double way : {1.0, -1.0}) {
        for (const double v_V : {70.0, 130.0, 200.0}) {
            for (const double off : {-1e-3, 1e-3}) {
                Fast x(way * omega_of(17.0 / 16 * v_V) * (1 + off), params(), v_V);
                drive_trip(&x.d, DRIVE_FAULT_OVER_SPEED);
                x.period();
                EXPECT_EQ(x.shorted(), off > 0) << v_V;
            }
        }
        for (const double off : {-1e-3, 1e-3}) { // a link below v_dc_min counts as v_dc_min, 60 V
            Fast x(way * omega_of(17.0 / 16 * 60) * (1 + off), params(), 30);
            drive_trip(&x.d, DRIVE_FAULT_UNDER_VOLTAGE);
            x.period();
            EXPECT_EQ(x.shorted(), off > 0);
        }
    }
}

// The estimate of a lost position is not believed, that of any other fault is.
TEST(FaultShort, OfALostPositionTheReferenceCounts)
{
    for (const drive_fault_t fault : {DRIVE_FAULT_POSITION_LOST, DRIVE_FAULT_OVERLOAD}) {
        for (const bool by_reference : {false, true}) {
            Fast x(1.3 * omega_of(kLink_V));
            (by_reference ? x.d.pll.omega : x.d.status.omega_ref) = 0;
            drive_trip(&x.d, fault);
            x.period();
            EXPECT_EQ(x.shorted(), by_reference == (fault == DRIVE_FAULT_POSITION_LOST));
        }
    }
}

// Nothing is shorted that was not driven by current control.
TEST(FaultShort, OnlyOutOfCurrentControl)
{
    for (const drive_stage_t stage : {STAGE_OFF, STAGE_PROCEDURE, STAGE_OPEN_LOOP, STAGE_VECTOR}) {
        Fast x(1.3 * omega_of(kLink_V));
        x.d.stage = stage;
        drive_trip(&x.d, DRIVE_FAULT_REMOTE_LOST);
        EXPECT_EQ(x.d.stage, stage >= STAGE_OPEN_LOOP ? STAGE_SHORT : STAGE_OFF);
    }
}

// The rotor slows down by 500 rad/s2 electrical, and the low-pass of L_q / R_s = 12.5 ms lags by 6.25 rad/s; 1 ms later
// it is looked at.
TEST(FaultShort, EndsWhereTheEmfIsASixteenthBelowTheLink)
{
    for (const double way : {1.0, -1.0}) {
        for (const double v_V : {70.0, 130.0, 180.0}) {
            Fast x(way * 1.3 * omega_of(v_V), params(), v_V);
            x.psi = std::polar(0.8 * kPsi, 0.4);
            x.begin();
            int n = 0;
            for (; n < 20000 && !x.open(); ++n) {
                x.omega -= way * 500 * kPeriod_s;
                x.period();
                ASSERT_TRUE(x.shorted() || x.open());
            }
            const double expected = omega_of(15.0 / 16 * v_V) - 500 * (kLq / kR + 1e-3);
            EXPECT_NEAR(way * x.omega, expected, 4) << v_V;
            EXPECT_EQ(x.d.stage, STAGE_OFF);
        }
    }
}

// A rotor that keeps its speed keeps its short, however long, with the flux at the fault in any direction.
TEST(FaultShort, LastsWhileTheRotorIsFast)
{
    for (int k = 0; k < 8; ++k) {
        Fast x((k % 2 == 0 ? 1 : -1) * 1.1 * omega_of(kLink_V));
        x.psi = std::polar(kPsi / 1.1, k * kPi / 4);
        x.begin();
        EXPECT_EQ(x.periods_held(10000), 10000) << k;
    }
}

// An eighth of a turn in a period, more than a turn in a millisecond: a machine with a twelfth of flux,
// inductance and resistance, and so with the same currents.
TEST(FaultShort, FollowsAFastCurrent)
{
    drive_params_t p = params();
    p.speed_max = 1000000;
    p.speed_trip = 1200000; // 3,600 rad/s electrical
    for (int32_t *x :
         {&p.R_s, &p.L_d, &p.L_q, &p.psi_m, &p.L_q_rated, &p.L_dh_rated, &p.L_qh_rated, &p.L_dqh_rated}) {
        *x /= 12;
    }
    p.J /= 100;
    p.v_dc_min = 30000;
    drive_config_t config;
    const drive_result_t made = drive_configure(&config, &p, PM_CHANNELS);
    ASSERT_TRUE(made.ok) << drive_param_table[made.ok ? 0 : made.param].name << " " << made.reason;
    for (const double way : {1.0, -1.0}) {
        Fast x(way * 2400, p, 60); // EMF 82 V
        x.d.pll.omega = bench::fixed(way * 2400 / 3600, 28);
        x.begin();
        x.omega = way * 7400; // 0.12 of a turn
        EXPECT_EQ(x.periods_held(3000), 3000);
        x.omega = way * 1750; // 60 V
        EXPECT_EQ(x.periods_held(3000), 3000);
        x.omega = way * 1600; // 55 V
        EXPECT_LT(x.periods_held(3000), 3000);
    }
}

// Without a current there is no angle, whatever the noise of 1 % of full scale says: after the 2.3 time constants of the
// flux the low-pass forgets the speed that was believed, from 1.3 to 15/16, within ln(1.39) of them.
TEST(FaultShort, ThatWasBegunInErrorEnds)
{
    for (const double noise : {0.0, 0.01}) {
        Fast x(1.3 * omega_of(kLink_V));
        x.begin();
        x.omega = 0;
        x.psi = kPsi;
        x.noise = noise;
        EXPECT_NEAR(x.periods_held(1000), 125 * (std::log(10.0) + std::log(1.3 * 16 / 15)), 20) << noise;
    }
}

// 1.9 psi_m / L_d before a sixth of a turn has passed, without resistance; i_trip may be at the limit.
TEST(FaultShort, StaysBelowTheOverCurrentThatIsDemanded)
{
    drive_params_t p = params();
    p.i_trip = 10977; // 2 psi_m / L_d = 10.9767 A
    double peak = 0;
    for (const double fast : {1.07, 1.3, 1.6}) {
        for (int k = -6; k <= 6; ++k) {
            Fast x(fast * omega_of(kLink_V), p);
            x.psi = std::polar(kPsi / fast, k * kPi / 12); // the voltage at its limit
            x.begin();
            for (int n = 0; n < 500; ++n) {
                x.period();
                peak = std::max(peak, std::abs(x.current()));
                ASSERT_TRUE(x.shorted()) << fast << " " << k;
            }
        }
    }
    EXPECT_GT(peak, 1.3 * kPsi / kLd);
    EXPECT_LT(peak, 2 * kPsi / kLd);
}

TEST(FaultShort, OpensInThePeriodOfAnOverCurrentOrABreakAndStaysOpen)
{
    for (int cause = 0; cause < 7; ++cause) {
        for (const int instant : {0, 3, 50, 777}) {
            Fast x(1.3 * omega_of(kLink_V));
            x.begin();
            ASSERT_EQ(x.periods_held(instant), instant);
            x.turn();
            if (cause == 6) {
                x.in.hw_fault = true;
            } else {
                x.in.i_leg[cause / 2] = current_code((cause % 2 == 0 ? 1 : -1) * 11.05 / 12);
            }
            x.step();
            EXPECT_TRUE(x.open()) << cause;
            x.in.hw_fault = false;
            for (int n = 0; n < 200; ++n) {
                x.period();
                ASSERT_TRUE(x.open()) << cause;
            }
            EXPECT_EQ(x.fault(), DRIVE_FAULT_REMOTE_LOST); // the first stays
        }
    }
}

TEST(FaultShort, OpensWithALaterFaultThatForbidsIt)
{
    for (int later = 1; later < DRIVE_FAULT_COUNT; ++later) {
        Fast x(1.3 * omega_of(kLink_V));
        x.begin();
        drive_trip(&x.d, static_cast<drive_fault_t>(later));
        x.period();
        EXPECT_EQ(x.shorted(), kBearing.count(later) != 0) << later;
        EXPECT_EQ(x.open(), kBearing.count(later) == 0) << later;
        EXPECT_EQ(x.d.fault, DRIVE_FAULT_REMOTE_LOST);
        if (x.open()) { // and none brings it back
            drive_trip(&x.d, DRIVE_FAULT_OVER_SPEED);
            x.period();
            EXPECT_TRUE(x.open()) << later;
        }
    }
    Fast x(1.3 * omega_of(kLink_V));
    x.begin();
    x.slow.temperature_dC = 1099;
    EXPECT_EQ(x.periods_held(50), 50);
    x.slow.temperature_dC = 1100;
    EXPECT_LE(x.periods_held(50), 10);
}

TEST(FaultShort, TheUserNeitherEndsNorRepeatsIt)
{
    Fast x(1.3 * omega_of(kLink_V));
    x.begin();
    for (const bool on : {false, true, false}) {
        x.enable(on);
        EXPECT_FALSE(drive_clear_fault(&x.d));
        EXPECT_EQ(x.periods_held(100), 100);
    }
    x.command.coast = true;
    x.enable(false);
    EXPECT_EQ(x.periods_held(100), 100);
    EXPECT_FALSE(drive_clear_fault(&x.d));
    EXPECT_EQ(x.d.fault, DRIVE_FAULT_REMOTE_LOST);
    x.omega = 0;
    EXPECT_LT(x.periods_held(1000), 1000);
    x.omega = 1.3 * omega_of(kLink_V); // the load drives it on
    x.enable(true);
    EXPECT_FALSE(drive_clear_fault(&x.d));
    for (int n = 0; n < 500; ++n) {
        x.period();
        ASSERT_TRUE(x.open());
    }
    x.enable(false);
    x.period();
    EXPECT_TRUE(drive_clear_fault(&x.d));
    EXPECT_EQ(x.d.fault, DRIVE_FAULT_NONE);
}

TEST(FaultShort, IsRefusedWhereItsCurrentExceedsTheTrip)
{
    for (const int32_t wanted : {0, 1}) {
        for (const int32_t i_trip : {10976, 10977}) { // 2 psi_m / L_d = 10.9767 A
            drive_params_t p = params(wanted);
            p.i_trip = i_trip;
            drive_config_t config;
            const drive_result_t result = drive_configure(&config, &p, PM_CHANNELS);
            const bool refused = wanted != 0 && i_trip == 10976;
            EXPECT_EQ(result.ok, !refused);
            EXPECT_EQ(result.param, refused ? DRIVE_PARAM_fault_short : DRIVE_PARAM_COUNT);
            EXPECT_STREQ(result.reason, refused ? "the short-circuit current exceeds i_trip" : "ok");
            EXPECT_EQ(config.fault_short.k != 0, wanted != 0);
        }
    }
    const drive_params_t p = params();
    drive_config_t config;
    drive_configure(&config, &p, PM_CHANNELS);
    EXPECT_NEAR(std::ldexp(config.fault_short.k, -32), kPeriod_s * kR / kLq, 1e-8);
}

} // namespace
