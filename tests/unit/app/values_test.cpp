// What the dictionary shows of the drive, against the per-unit number times its base in SI units. IPM-1000's defaults:
// 10 A, 450 V, 540 rad/s electrical, 3 pole pairs.
#include <cmath>
#include <cstdint>
#include <string>

#include "firmware/app/app_parts.h"
#include "tests/contract/bench.h"
#include "tests/unit/app/bench.h"

using app_test::Bench;
using app_test::defaults;

namespace
{

constexpr double kI_A = 10, kV_V = 450, kOmega = 540, kPairs = 3;
constexpr double kPsi_Wb = kV_V / kOmega, kTorque_Nm = 1.5 * kPairs * kPsi_Wb * kI_A;
constexpr double kRounding = 0.5 + 1e-3;

pm_q_t q(double x)
{
    return bench::fixed(x, PM_Q_BITS);
}

class Values : public testing::Test
{
  protected:
    void SetUp() override
    {
        const drive_params_t p = defaults();
        x.boot(&p);
        x.run_ms(5);
    }

    app_t &app()
    {
        return x.loop.app;
    }

    drive_t &drive()
    {
        return app().drive;
    }

    int32_t value(uint16_t slot)
    {
        int32_t shown = INT32_MIN;
        EXPECT_TRUE(app_value(&app(), slot, &shown)) << slot;
        return shown;
    }

    void expect(uint16_t slot, double si, const char *what)
    {
        EXPECT_NEAR(value(slot), si, kRounding + 1e-7 * std::abs(si)) << what;
    }

    Bench x;
};

TEST_F(Values, SignalsAreInTheirUnits)
{
    drive_t &d = drive();
    d.status.i = {q(0.11), q(-0.12)};
    d.i_ref = {q(-0.13), q(0.14)};
    d.i_abc = {q(0.15), q(-0.16), q(0.17)};
    d.pll.omega = q(-0.21);
    d.status.omega_ref = q(0.22);
    d.status.v_dc = q(0.63);
    d.status.v = {q(0.31), q(-0.32)};
    d.status.quality = q(0.81);
    d.status.weight = q(0.42);
    d.status.theta = 0x87654321U;
    app().slow.temperature_dC = -123;
    expect(OD_LIVE_I_D, 0.11 * kI_A * 1e3, "i_d");
    expect(OD_LIVE_I_Q, -0.12 * kI_A * 1e3, "i_q");
    expect(OD_LIVE_I_D_REF, -0.13 * kI_A * 1e3, "i_d_ref");
    expect(OD_LIVE_I_Q_REF, 0.14 * kI_A * 1e3, "i_q_ref");
    expect(OD_LIVE_I_A, 0.15 * kI_A * 1e3, "i_a");
    expect(OD_LIVE_I_B, -0.16 * kI_A * 1e3, "i_b");
    expect(OD_LIVE_I_C, 0.17 * kI_A * 1e3, "i_c");
    expect(OD_LIVE_OMEGA_E, -0.21 * kOmega * 1e3, "omega_e");
    expect(OD_LIVE_VELOCITY_ACTUAL, -0.21 * kOmega / kPairs * 1e3, "velocity");
    expect(OD_LIVE_VELOCITY_DEMAND, 0.22 * kOmega / kPairs * 1e3, "demand");
    expect(OD_LIVE_DC_LINK_VOLTAGE, 0.63 * kV_V * 1e3, "v_dc");
    expect(OD_LIVE_V_ALPHA, 0.31 * kV_V * 1e3, "v_alpha");
    expect(OD_LIVE_V_BETA, -0.32 * kV_V * 1e3, "v_beta");
    expect(OD_LIVE_QUALITY, 810, "quality");
    expect(OD_LIVE_WEIGHT, 420, "weight");
    EXPECT_EQ(uint32_t(value(OD_LIVE_THETA)), 0x87654321U);
    EXPECT_EQ(value(OD_LIVE_TEMPERATURE), -123);
}

TEST_F(Values, FaultRecordIsInItsUnits)
{
    drive_fault_record_t &r = drive().record;
    r.fault = DRIVE_FAULT_STALL;
    r.i = {q(0.25), q(-0.35), q(0.45)};
    r.v_dc = q(0.71);
    r.omega = q(-0.33);
    r.theta = 0x12345678U;
    r.temperature_dC = 777;
    r.period = 123456789U;
    r.refusal = {PROCEDURE_initial_pulses, PM_FAILED_POLARITY};
    EXPECT_EQ(value(OD_LIVE_FAULT_RECORD_REFUSED_BY), PROCEDURE_initial_pulses);
    EXPECT_EQ(value(OD_LIVE_FAULT_RECORD_REFUSED_BECAUSE), PM_FAILED_POLARITY);
    EXPECT_EQ(value(OD_LIVE_FAULT_RECORD_CODE), DRIVE_FAULT_STALL);
    expect(OD_LIVE_FAULT_RECORD_I_A, 0.25 * kI_A * 1e3, "i_a");
    expect(OD_LIVE_FAULT_RECORD_I_B, -0.35 * kI_A * 1e3, "i_b");
    expect(OD_LIVE_FAULT_RECORD_I_C, 0.45 * kI_A * 1e3, "i_c");
    expect(OD_LIVE_FAULT_RECORD_V_DC, 0.71 * kV_V * 1e3, "v_dc");
    expect(OD_LIVE_FAULT_RECORD_OMEGA_E, -0.33 * kOmega * 1e3, "omega_e");
    EXPECT_EQ(value(OD_LIVE_FAULT_RECORD_THETA), 0x12345678);
    EXPECT_EQ(value(OD_LIVE_FAULT_RECORD_TEMPERATURE), 777);
    EXPECT_EQ(value(OD_LIVE_FAULT_RECORD_PERIOD), 123456789);
}

TEST_F(Values, StateAndFault)
{
    drive().state = DRIVE_STOPPING;
    drive().status.limits = DRIVE_LIMIT_SPEED;
    app().dropped = 7;
    EXPECT_EQ(value(OD_LIVE_DRIVE_STATE), DRIVE_STOPPING);
    EXPECT_EQ(value(OD_LIVE_DRIVE_FAULT), DRIVE_FAULT_NONE);
    EXPECT_EQ(value(OD_LIVE_DRIVE_LIMITS), int32_t(DRIVE_LIMIT_SPEED));
    EXPECT_EQ(value(OD_LIVE_STORED_DROPPED), 7);
    EXPECT_EQ(value(OD_LIVE_PARAMETERS_READY), APP_READY);
    EXPECT_EQ(value(OD_LIVE_PARAMETER_BATCH), 0);
    app().batch = true;
    EXPECT_EQ(value(OD_LIVE_PARAMETER_BATCH), 1);
    drive().fault = DRIVE_FAULT_OVER_SPEED;
    EXPECT_EQ(value(OD_LIVE_DRIVE_STATE), DRIVE_FAULT);
    EXPECT_EQ(value(OD_LIVE_DRIVE_FAULT), DRIVE_FAULT_OVER_SPEED);
}

// T = 3/2 p (psi_m + (L_d - L_q) i_d) i_q, in thousandths of 3/2 p psi_m i_rated.
TEST_F(Values, TorqueAndCurrentAreOfTheRatedOnes)
{
    const drive_params_t p = defaults();
    const double psi = p.psi_m * 1e-9, i_rated = p.i_rated * 1e-3;
    const double rated = 1.5 * kPairs * psi * i_rated;
    EXPECT_EQ(value(OD_LIVE_RATED_CURRENT), p.i_rated);
    expect(OD_LIVE_RATED_TORQUE, rated * 1e3, "rated torque");
    for (const double i_q : {0.3, -0.2}) {
        for (const double i_d : {0.0, -0.2}) {
            drive().status.i = {q(i_d), q(i_q)};
            const double torque = 1.5 * kPairs * (psi + (p.L_d - p.L_q) * 1e-9 * i_d * kI_A) * i_q * kI_A;
            expect(OD_LIVE_TORQUE_ACTUAL, torque / rated * 1e3, "torque");
            expect(OD_LIVE_CURRENT_ACTUAL, i_q * kI_A / i_rated * 1e3, "current");
        }
    }
    EXPECT_NEAR(app_torque_uNm(&app(), 250), 0.25 * rated * 1e6, 2);
    drive().status.i = {q(-2), q(7.5)}; // beyond 16 bits
    EXPECT_EQ(value(OD_LIVE_TORQUE_ACTUAL), INT16_MAX);
    drive().status.i = {q(-2), q(-7.5)};
    EXPECT_EQ(value(OD_LIVE_TORQUE_ACTUAL), INT16_MIN);
}

TEST_F(Values, IdentifiedOnesAreInTheirUnits)
{
    commissioning_report_t &report = drive().commissioning_report;
    commissioning_result_t &r = report.result;
    r.R = q(0.13);
    r.lost = q(0.011);
    r.move = q(0.003);
    r.L_d = q(0.5);
    r.L_q = q(0.9);
    r.L_q_rated = q(0.85);
    r.L_dq_rated = q(-0.05);
    r.psi_m = q(0.28);
    r.J = q(0.02);
    r.viscous = q(0.003);
    r.coulomb = q(0.004);
    report.state = COMMISSIONING_DONE;
    report.progress = 57;
    report.reason = 3;
    app().routines = 5;
    const double L_H = kPsi_Wb / kI_A;
    expect(OD_LIVE_IDENTIFICATION_R_S, 0.13 * kV_V / kI_A * 1e6, "R_s");
    expect(OD_LIVE_IDENTIFICATION_DEAD_VOLTAGE, 0.011 * kV_V * 1e3, "dead voltage");
    expect(OD_LIVE_IDENTIFICATION_L_D, 0.5 * L_H * 1e9, "L_d");
    expect(OD_LIVE_IDENTIFICATION_L_Q, 0.9 * L_H * 1e9, "L_q");
    expect(OD_LIVE_IDENTIFICATION_L_Q_RATED, 0.85 * L_H * 1e9, "L_q_rated");
    expect(OD_LIVE_IDENTIFICATION_L_DH_RATED, 0.5 * L_H * 1e9, "L_dh_rated");
    expect(OD_LIVE_IDENTIFICATION_L_DQH_RATED, -0.05 * L_H * 1e9, "L_dqh_rated");
    expect(OD_LIVE_IDENTIFICATION_PSI_M, 0.28 * kPsi_Wb * 1e9, "psi_m");
    // the acceleration is taken over 1024 calls of 1 ms
    expect(OD_LIVE_IDENTIFICATION_J, 0.02 * kTorque_Nm * 1.024 / (kOmega / kPairs) * 1e9, "J");
    expect(OD_LIVE_IDENTIFICATION_FRICTION, 0.003 * kTorque_Nm / (kOmega / kPairs) * 1e9, "friction");
    expect(OD_LIVE_IDENTIFICATION_COULOMB, 0.004 * kTorque_Nm * 1e6, "coulomb");
    // commissioning.h: L_q + 4 (L_q_rated - L_q) (i / i_rated)^2; the cross inductance grows with the current
    expect(OD_LIVE_IDENTIFICATION_L_QH_RATED, (0.9 - 4 * 0.05) * L_H * 1e9, "L_qh_rated");
    EXPECT_NEAR(value(OD_LIVE_IDENTIFICATION_CROSS_HALF), -0.05 / 2 / (0.9 - 0.05) * 1e6, 1);
    const drive_params_t p = defaults();
    expect(OD_LIVE_IDENTIFICATION_LEG_CAPACITANCE,
           0.003 * kI_A * p.dead_time * 1e-9 / (p.v_dc_nominal * 1e-3) * 1e12, "leg capacitance");
    EXPECT_EQ(value(OD_LIVE_IDENTIFICATION_STATE), COMMISSIONING_DONE);
    EXPECT_EQ(value(OD_LIVE_IDENTIFICATION_PROGRESS), 57);
    EXPECT_EQ(value(OD_LIVE_IDENTIFICATION_REASON), 3);
    EXPECT_EQ(value(OD_LIVE_IDENTIFICATION_COMMAND), 5);
    EXPECT_TRUE(app_identify_put(&app(), OD_LIVE_IDENTIFICATION_COMMAND, 9));
    EXPECT_EQ(value(OD_LIVE_IDENTIFICATION_COMMAND), 9);
    EXPECT_EQ(value(OD_LIVE_IDENTIFICATION_STATE), COMMISSIONING_IDLE);
    EXPECT_EQ(value(OD_LIVE_IDENTIFICATION_PROGRESS), 0);
    EXPECT_EQ(value(OD_LIVE_IDENTIFICATION_REASON), COMMISSIONING_NO_REASON);
    EXPECT_FALSE(app_identify_put(&app(), OD_LIVE_IDENTIFICATION_STATE, 1));
}

TEST_F(Values, IdentificationFillsInWhatWasLeftOpen)
{
    const drive_params_t p = defaults();
    drive_command_t command = {};
    app().routines = 6;
    app_identify_command(&app(), &command);
    EXPECT_EQ(command.mode, DRIVE_MODE_IDENTIFY);
    EXPECT_EQ(command.routines, 6);
    EXPECT_EQ(command.current_mA, p.i_rated);
    EXPECT_NEAR(command.speed_mrad_s, 0.3 * p.speed_max, 3);
    command.current_mA = 1234;
    command.speed_mrad_s = -4321;
    app_identify_command(&app(), &command);
    EXPECT_EQ(command.current_mA, 1234);
    EXPECT_EQ(command.speed_mrad_s, -4321);
}

// A sample of the trace is sample * scale / 32768, with a range of twice the base.
TEST_F(Values, TracedSignalsHaveTheScaleOfTheirUnit)
{
    const struct {
        uint16_t slot;
        double base;
    } cases[] = {{OD_LIVE_I_Q, kI_A},
                 {OD_LIVE_OMEGA_E, kOmega},
                 {OD_LIVE_VELOCITY_ACTUAL, kOmega / kPairs},
                 {OD_LIVE_DC_LINK_VOLTAGE, kV_V},
                 {OD_LIVE_QUALITY, 1}};
    for (const auto &at : cases) {
        for (uint32_t row = 0; row < od_count; ++row) {
            const od_entry_t &entry = od_table[row];
            if (entry.kind == OD_LIVE && entry.slot == at.slot) {
                trace_signal_t signal = {};
                ASSERT_TRUE(trace_host_find(&app(), entry.index, entry.sub, &signal));
                EXPECT_NEAR(signal.scale, 2 * at.base * 1e3, kRounding) << at.slot;
                EXPECT_FALSE(signal.angle);
            }
        }
    }
}

TEST_F(Values, FactsForTheDriveProfile)
{
    drive_t &d = drive();
    const drive_params_t p = defaults();
    const auto facts = [&] { return app_drive_facts(&app()); };
    d.pll.omega = q(-0.5);
    EXPECT_NEAR(facts().velocity, -0.5 * kOmega / kPairs * 1e3, kRounding);
    EXPECT_TRUE(facts().ready);
    EXPECT_TRUE(facts().off);
    EXPECT_FALSE(facts().following);
    for (const double share : {-0.01, 0.01}) { // below and above each limit
        d.status.v_dc = q(p.v_dc_min * 1e-3 * (1 + share) / kV_V);
        EXPECT_EQ(facts().voltage, share > 0);
        d.status.v_dc = q(p.v_dc_max * 1e-3 * (1 + share) / kV_V);
        EXPECT_EQ(facts().voltage, share < 0);
    }
    d.state = DRIVE_RUNNING;
    EXPECT_FALSE(facts().off);
    EXPECT_TRUE(facts().following);
    for (const uint32_t flag : {DRIVE_LIMIT_CURRENT, DRIVE_LIMIT_SPEED, DRIVE_LIMIT_VOLTAGE}) {
        d.status.limits = flag;
        EXPECT_TRUE(facts().limited);
        EXPECT_FALSE(facts().warning);
    }
    for (const uint32_t flag : {DRIVE_LIMIT_TEMPERATURE, DRIVE_LIMIT_DC_VOLTAGE}) {
        d.status.limits = flag;
        EXPECT_FALSE(facts().limited);
        EXPECT_TRUE(facts().warning);
    }
    d.fault = DRIVE_FAULT_STALL;
    EXPECT_TRUE(facts().fault);
    EXPECT_TRUE(facts().off);
    EXPECT_FALSE(facts().following);
}

} // namespace
