// Polarity by which way a torque turns the rotor, as the drive runs it behind pulses that have found no pole: on a machine
// that does not saturate, with what hinders or moves its rotor.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/plants.h"
#include "tests/unit/drive/direct.h"
#include "tests/unit/drive/start.h"

namespace
{

using bench::kDegree;
using start::Start;

constexpr int kAngles = 12;
constexpr double kRated_Nm = 1.5 * 3 * 0.12 * 4;

// (L_q - L_d) i > psi_m from 1.3 A on.
plant_config_t weak_magnets()
{
    plant_config_t c = plants::ipm_1000();
    c.machine.c_A_Wb5 = 0;
    c.machine.L_d0_H = 40e-3;
    c.machine.L_q0_H = 130e-3;
    c.machine.psi_m_Wb = 0.12;
    c.inverter.c_leg_F = 0.5e-9;
    c.mech.T_coulomb_Nm = 0.02;
    return c;
}

drive_params_t told()
{
    drive_params_t p = direct::params(1);
    p.L_d = p.L_dh_rated = 40000000;
    p.L_q = p.L_q_rated = p.L_qh_rated = 130000000;
    p.L_dqh_rated = 0;
    p.cross_half = 0;
    p.psi_m = 120000000;
    p.speed_bandwidth = 2000;
    p.leg_capacitance = 500;
    return p;
}

double angle(int k)
{
    return (360.0 * k / kAngles + 7) * kDegree;
}

int reason(Start &x)
{
    const drive_refusal_t &refusal = drive_status(&x.drive())->refusal;
    return refusal.procedure == PROCEDURE_torque_polarity ? int(refusal.reason) : int(PM_RUNNING);
}

TEST(TorquePolarity, BehindABrakeTheCurrentGrowsUntilTheRotorTurns)
{
    plant_config_t braked = weak_magnets();
    braked.mech.T_coulomb_Nm = 0.6 * kRated_Nm;
    for (int k = 0; k < kAngles; ++k) {
        Start x(braked, told(), angle(k));
        x.run_past(PROCEDURE_torque_polarity);
        EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_NONE) << k;
        EXPECT_LE(std::abs(x.error_rad()), 20 * kDegree) << k;
    }
}

// Cross-saturation turns what injection sees by up to 6 degrees while there is current: a rotor that has not quite turned far
// enough seems to have, in every pulse, until the current has gone.
TEST(TorquePolarity, WhatCrossSaturationShowsEndsNoPulse)
{
    plant_config_t braked = weak_magnets();
    braked.machine.c_A_Wb5 = 120;
    for (const double brake : {0.4, 0.45, 0.5, 0.55}) {
        braked.mech.T_coulomb_Nm = brake * kRated_Nm;
        for (int k = 0; k < kAngles; ++k) {
            Start x(braked, told(), angle(k));
            x.run_past(PROCEDURE_torque_polarity);
            EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_NONE) << brake << ' ' << k;
            EXPECT_LE(std::abs(x.error_rad()), 20 * kDegree) << brake << ' ' << k;
        }
    }
}

TEST(TorquePolarity, AHeldRotorIsRefusedNotGuessed)
{
    for (int k = 0; k < kAngles; ++k) {
        plant_config_t held = weak_magnets();
        held.mech.locked = true;
        held.sensor.seed = static_cast<uint64_t>(k) + 1;
        drive_params_t p = told();
        p.J /= k % 2 == 0 ? 1 : 100; // so light a rotor has the smallest steps
        Start x(held, p, angle(k));
        x.run_to(PROCEDURE_torque_polarity);
        EXPECT_LE(x.run([](const drive_t &d) { return d.fault != DRIVE_FAULT_NONE; }), 9000)
            << "periods of 0.1 ms";
        EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_POSITION_NOT_FOUND) << k;
        EXPECT_EQ(reason(x), PM_FAILED_NOT_TURNING) << k;
    }
}

// A weight that falls with the free rotor: the pole is found, shown by the EMF, or the rotor is aligned.
TEST(TorquePolarity, ALoadThatTurnsTheRotorIsNotTakenForThePole)
{
    for (const double load : {-0.9, -0.3, 0.3, 0.9}) {
        int found = 0;
        for (int k = 0; k < kAngles; ++k) {
            Start x(weak_magnets(), told(), angle(k));
            plant_set_load(x.plant(), load * kRated_Nm);
            x.run_past(PROCEDURE_torque_polarity);
            EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_NONE) << load << ' ' << k;
            if (reason(x) == PM_RUNNING) {
                EXPECT_LE(std::abs(x.error_rad()), 60 * kDegree) << load << ' ' << k;
                ++found;
            } else {
                EXPECT_EQ(reason(x), PM_FAILED_TURNED) << load << ' ' << k;
                EXPECT_EQ(x.drive().sequence.procedure, PROCEDURE_align) << load << ' ' << k;
            }
        }
        EXPECT_GE(found, kAngles / 2) << load;
    }
}

// A load that depends on the angle, as of a compressor, has a rotor without friction swing about where it would rest, as a pendulum:
// what it does by itself is not taken for what a torque did. It is found, shown by the EMF, aligned, or a fault.
TEST(TorquePolarity, ARotorThatSwingsIsNotTakenForThePole)
{
    int found = 0;
    for (const double J_kgm2 : {1e-2, 1e-3, 3e-4}) {
        for (int k = 0; k < kAngles; ++k) {
            plant_config_t swinging = weak_magnets();
            swinging.mech.J_kgm2 = J_kgm2;
            swinging.mech.T_coulomb_Nm = 0;
            swinging.mech.load_angle[0] = {1, 0.3 * kRated_Nm, 20 * kDegree};
            drive_params_t p = told();
            p.J = static_cast<int32_t>(std::lround(J_kgm2 * 1e9));
            Start x(swinging, p, angle(k));
            x.run_past(PROCEDURE_torque_polarity);
            if (drive_status(&x.drive())->fault == DRIVE_FAULT_NONE && reason(x) == PM_RUNNING) {
                EXPECT_LE(std::abs(x.error_rad()), 30 * kDegree) << J_kgm2 << ' ' << k;
                ++found;
            }
        }
    }
    EXPECT_GE(found, 3 * kAngles - 6);
}

// Half of speed_trip within a pulse: not the rotor, but a loop that runs away.
TEST(TorquePolarity, ALoopThatRunsAwayIsRefused)
{
    for (const double omega : {0.6, -0.6}) {
        Start x(weak_magnets(), told(), 190 * kDegree);
        x.run([](const drive_t &d) {
            return d.sequence.procedure == PROCEDURE_torque_polarity && d.beside.torque_polarity.part != 0U;
        });
        ASSERT_EQ(x.drive().sequence.procedure, PROCEDURE_torque_polarity);
        x.drive().position.pll.omega = bench::fixed(omega, 28);
        EXPECT_EQ(procedure_torque_polarity_slow(&x.drive()), PM_FAILED_SALIENCY);
    }
}

// A frame that the EMF turns round meanwhile has the pole.
TEST(TorquePolarity, WhatTheEmfHasShownStands)
{
    Start x(weak_magnets(), told(), 190 * kDegree);
    x.run([](const drive_t &d) {
        return d.sequence.procedure == PROCEDURE_torque_polarity && d.beside.torque_polarity.part != 0U;
    });
    ASSERT_EQ(x.drive().sequence.procedure, PROCEDURE_torque_polarity);
    x.drive().position.slip.count = 1;
    const pm_angle_t theta = x.drive().position.pll.theta;
    x.run_past(PROCEDURE_torque_polarity);
    EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_NONE);
    EXPECT_LE(std::abs(pm_angle_diff(x.drive().position.pll.theta, theta)), int32_t(PM_TURN(1.0 / 12)));
}

// One that it agrees with before the first pulse, is north without any.
TEST(TorquePolarity, WhatTheEmfAgreesWithIsNorth)
{
    Start x(weak_magnets(), told(), 10 * kDegree);
    x.run_to(PROCEDURE_torque_polarity);
    ASSERT_EQ(x.drive().sequence.procedure, PROCEDURE_torque_polarity);
    x.drive().position.slip.agrees_ms = SLIP_MS;
    const pm_angle_t theta = x.drive().position.pll.theta;
    EXPECT_LE(x.run_past(PROCEDURE_torque_polarity), 200) << "periods of 0.1 ms";
    EXPECT_EQ(drive_status(&x.drive())->fault, DRIVE_FAULT_NONE);
    EXPECT_LE(std::abs(pm_angle_diff(x.drive().position.pll.theta, theta)), int32_t(PM_TURN(1.0 / 12)));
}

} // namespace
