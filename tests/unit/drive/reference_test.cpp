// Current references of a running drive against the formulas in SI units, and what drive_prepare() leaves to them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tests/unit/drive/direct.h"

namespace
{

using bench::fixed;
using bench::real;
using direct::Drive;

// IPM-1000's defaults, in A, V, rad/s (mechanical).
constexpr double kPsi_Wb = 0.236, kL_d_H = 43e-3, kL_q_H = 75e-3, kPairs = 3;
constexpr double kI_A = 10, kV_V = 450, kOmega = 540 / kPairs;
constexpr double kI_max = 0.5, kSpeed_max = 150 / kOmega;
// Roundings of Q28 and of the root, which is steep where little is left; the wide speed control 2^-22.
constexpr double kCurrent = 2e-6, kWide = 2e-6;
// pm_ratio().
constexpr double kRatio = 0x1p-15;
constexpr double kCarrier_V = 70, kLinear = 0.98 / 1.7320508075688772;

Drive running(drive_mode_t mode)
{
    Drive x;
    x.step(); // measures the DC link
    x.d.command.mode = mode;
    x.d.state = DRIVE_RUNNING;
    x.d.stage = STAGE_VECTOR;
    return x;
}

// tan of the MTPA angle from the torque's derivative: i_d = (psi - sqrt(psi^2 + 4 (L_q - L_d)^2 i_q^2)) / (2 (L_q - L_d)).
double mtpa(double i_q_A)
{
    const double dL = kL_q_H - kL_d_H;
    return (kPsi_Wb - std::hypot(kPsi_Wb, 2 * dL * i_q_A)) / (2 * dL);
}

TEST(Reference, TorqueIsThatOfTheMachine)
{
    for (const double torque_Nm : {1.0, -1.0, 2.5, -2.5}) {
        for (const double i_d : {0.0, -0.1, 0.1, -0.3}) {
            Drive x = running(DRIVE_MODE_TORQUE);
            x.d.command.torque_uNm = static_cast<int32_t>(std::lround(torque_Nm * 1e6));
            reference_take(&x.d);
            x.d.i_ref.d = fixed(i_d, 28);
            reference_vector(&x.d);
            const double psi_a = kPsi_Wb + (kL_d_H - kL_q_H) * i_d * kI_A;
            const double expected = torque_Nm / (1.5 * kPairs * psi_a) / kI_A;
            EXPECT_NEAR(real(x.d.i_ref.q), expected, 1e-6) << torque_Nm << ' ' << i_d;
            EXPECT_EQ(x.d.status.limits & DRIVE_LIMIT_CURRENT, 0U);
        }
    }
}

// The active flux that is reckoned with does not fall below a quarter of the magnet's.
TEST(Reference, WeakenedFluxDoesNotBlowUpTheCurrent)
{
    Drive x = running(DRIVE_MODE_TORQUE);
    x.d.config.i_max = PM_Q(2.0);
    x.d.torque_target = fixed(0.05, 28);
    x.d.i_ref.d = PM_Q(0.9); // psi_a would be negative
    reference_vector(&x.d);
    const double psi = kPsi_Wb / (kV_V / 540);
    EXPECT_NEAR(real(x.d.i_ref.q), 0.05 / (psi / 4), 1e-5);
}

TEST(Reference, CurrentStaysWithinTheCircle)
{
    for (const drive_mode_t mode : {DRIVE_MODE_TORQUE, DRIVE_MODE_SPEED}) {
        for (const double way : {1.0, -1.0}) {
            for (const double i_d : {0.0, -0.2, -0.3, -0.4, 0.3}) {
                Drive x = running(mode);
                x.d.torque_target = fixed(2 * way, 28);
                x.d.omega_target = fixed(0.5 * way, 28);
                x.d.speed.reference = x.d.omega_target;
                x.d.position.pll.omega = fixed(-0.5 * way, 28); // far from it
                x.d.i_ref.d = fixed(i_d, 28);
                reference_vector(&x.d);
                EXPECT_NEAR(real(x.d.i_ref.q), way * std::sqrt(kI_max * kI_max - i_d * i_d), kCurrent)
                    << mode << ' ' << i_d;
                EXPECT_NE(x.d.status.limits & DRIVE_LIMIT_CURRENT, 0U);
            }
        }
    }
}

// Derating narrows the circle's chord, it does not widen it.
TEST(Reference, DeratedCurrentIsTheSmallerLimit)
{
    for (const double way : {1.0, -1.0}) {
        for (const double i_d : {0.0, -0.45}) {
            Drive x = running(DRIVE_MODE_TORQUE);
            x.d.torque_target = fixed(2 * way, 28);
            x.d.temperature_dC = 1000; // half
            x.d.i_ref.d = fixed(i_d, 28);
            reference_vector(&x.d);
            const double most = std::min(kI_max / 2, std::sqrt(kI_max * kI_max - i_d * i_d));
            EXPECT_NEAR(real(x.d.i_ref.q), way * most, kCurrent) << i_d;
        }
    }
}

// With the carrier on, what leaves it a saliency to see; without, and within the circle, as ever.
TEST(Reference, CurrentIsLimitedWhileInjecting)
{
    for (const double way : {1.0, -1.0}) {
        for (const bool inject : {false, true}) {
            for (const double i_d : {0.0, -0.45}) {
                Drive x = running(DRIVE_MODE_TORQUE);
                x.d.config.i_injection = PM_Q(0.3);
                x.d.position.inject = inject;
                x.d.torque_target = fixed(2 * way, 28);
                x.d.i_ref.d = fixed(i_d, 28);
                reference_vector(&x.d);
                const double circle = std::sqrt(kI_max * kI_max - i_d * i_d);
                EXPECT_NEAR(real(x.d.i_ref.q), way * (inject ? std::min(0.3, circle) : circle), kCurrent)
                    << i_d;
                EXPECT_NE(x.d.status.limits & DRIVE_LIMIT_CURRENT, 0U);
            }
        }
    }
}

TEST(Reference, AxesAreThoseOfTheLargestTorquePerAmpere)
{
    const double light = 0.2 / kI_A; // i_d_light
    for (const double torque : {0.02, -0.02, 0.0, 0.1}) {
        for (const double weight : {0.0, 0.5, 1.0}) {
            for (const double sign : {1.0, -1.0}) {
                Drive x = running(DRIVE_MODE_TORQUE);
                x.d.torque_target = fixed(torque, 28);
                x.d.position.weight = fixed(weight, 28);
                x.d.config.i_d_light = fixed(sign * light, 28);
                reference_vector(&x.d);
                const double i_d = mtpa(real(x.d.i_ref.q) * kI_A) / kI_A;
                // the least magnitude at light load; one that magnetises takes MTPA's place
                const double share = light * weight;
                const double expected = sign < 0 && share > 0 ? share : std::min(i_d, -share);
                EXPECT_NEAR(real(x.d.i_ref.d), expected, kCurrent) << torque << ' ' << weight << ' ' << sign;
            }
        }
    }
}

// What is left of an open loop's current and what field weakening asks for are added, down to -i_max.
TEST(Reference, DemagnetisingCurrentIsLimited)
{
    Drive x = running(DRIVE_MODE_TORQUE);
    x.d.i_open = PM_Q(0.16);
    reference_vector(&x.d);
    EXPECT_NEAR(real(x.d.i_ref.d), 0.15, kCurrent);
    EXPECT_NEAR(real(x.d.i_open), 0.15, kCurrent);
    x.d.i_open = 0;
    x.d.field_weakening.i_d = PM_Q(-0.2);
    x.d.config.field_weakening.i_max = PM_Q(0.9);
    x.d.voltage.v = {PM_WIDE(0.0), PM_WIDE(0.0)}; // much room: it goes back
    reference_vector(&x.d);
    EXPECT_GT(x.d.i_ref.d, PM_Q(-0.2));
    EXPECT_LT(x.d.i_ref.d, 0);
    x.d.field_weakening.i_d = PM_Q(-0.8);
    x.d.voltage.v = {PM_WIDE(0.0), PM_WIDE(0.6)}; // 270 V beside 170 V
    reference_vector(&x.d);
    EXPECT_EQ(x.d.i_ref.d, -x.d.config.i_max);
}

// The amplitude of both axes counts, against 95 % of what the modulator gives.
TEST(Reference, FieldWeakeningBeginsBelowTheVoltageLimit)
{
    const double top = 0.95 * kLinear * 300 / kV_V;
    for (const double turn : {0.0, 0.5, 1.1, 1.7}) { // where a current along d gives voltage
        for (const double share : {0.99, 1.01}) {
            Drive x = running(DRIVE_MODE_TORQUE);
            x.d.position.pll.omega = PM_ONE / 2;
            const bench::Complex v = std::polar(share * top, turn);
            x.d.voltage.v = {fixed(v.real(), PM_WIDE_BITS), fixed(v.imag(), PM_WIDE_BITS)};
            for (int ms = 0; ms < 100; ++ms) {
                reference_vector(&x.d);
            }
            EXPECT_EQ(x.d.field_weakening.i_d<0, share> 1) << turn;
        }
    }
}

TEST(Reference, SpeedIsLimitedAndSaid)
{
    for (const double asked : {0.5, -0.5, 0.9, -0.9}) {
        Drive x = running(DRIVE_MODE_SPEED);
        x.d.omega_target = fixed(asked, 28);
        for (int ms = 0; ms < 3000; ++ms) {
            x.d.status.limits = 0;
            x.d.position.pll.omega = x.d.speed.reference;
            reference_vector(&x.d);
        }
        EXPECT_NEAR(real(x.d.speed.reference), std::clamp(asked, -kSpeed_max, kSpeed_max), 1e-6) << asked;
        EXPECT_EQ((x.d.status.limits & DRIVE_LIMIT_SPEED) != 0, std::abs(asked) > kSpeed_max);
    }
}

TEST(Reference, TorqueGivesWayToTheLargestSpeedAndItIsSaid)
{
    for (const double way : {1.0, -1.0}) {
        for (const bool beyond : {false, true}) {
            Drive x = running(DRIVE_MODE_TORQUE);
            x.d.torque_target = fixed(way * 0.05, 28);
            x.d.position.pll.omega = fixed(way * (beyond ? 1.02 : 0.4) * kSpeed_max, 28);
            for (int ms = 0; ms < 300; ++ms) {
                x.d.status.limits = 0;
                reference_vector(&x.d);
            }
            EXPECT_EQ(x.d.i_ref.q == 0, beyond);
            EXPECT_EQ((x.d.status.limits & DRIVE_LIMIT_SPEED) != 0, beyond);
            EXPECT_EQ(x.d.status.limits & DRIVE_LIMIT_CURRENT, 0U);
        }
    }
}

// In any mode a stop is a ramp of the speed to zero.
TEST(Reference, StoppingBrakesWithSpeedControl)
{
    for (const drive_mode_t mode : {DRIVE_MODE_TORQUE, DRIVE_MODE_SPEED}) {
        Drive x = running(mode);
        x.d.torque_target = PM_Q(0.05);
        x.d.omega_target = PM_Q(0.4);
        x.d.position.pll.omega = x.d.speed.reference = PM_Q(0.4);
        reference_vector(&x.d);
        x.d.state = DRIVE_STOPPING;
        const double slope = 200e-3 / kOmega; // 200 rad/s2
        const double before = real(x.d.speed.reference);
        for (int ms = 1; ms <= 100; ++ms) {
            reference_vector(&x.d);
            ASSERT_NEAR(real(x.d.speed.reference), before - ms * slope, 1e-6) << mode;
        }
        EXPECT_LT(x.d.i_ref.q, 0);
    }
}

// In torque mode speed control is kept ready: a stop begins from the present speed and current.
TEST(Reference, TorqueModeSeedsSpeedControl)
{
    Drive x = running(DRIVE_MODE_TORQUE);
    x.d.torque_target = fixed(0.05, 28);
    x.d.position.pll.omega = PM_Q(0.3);
    reference_vector(&x.d);
    EXPECT_EQ(x.d.speed.reference, PM_Q(0.3));
    EXPECT_NEAR(real(x.d.speed.pi.integral, PM_WIDE_BITS), real(x.d.i_ref.q), kWide);
}

TEST(Reference, TestCurrentGoesToItsAxis)
{
    for (const bool d_axis : {true, false}) {
        Drive plain = running(DRIVE_MODE_TORQUE);
        plain.d.torque_target = fixed(0.05, 28);
        plain.d.position.weight = PM_ONE;
        Drive x = plain;
        x.d.config.position.mismatch.id = static_cast<uint8_t>(d_axis ? MISMATCH_D_AXIS : MISMATCH_Q_AXIS);
        x.d.position.window.injected = PM_Q(0.03);
        reference_vector(&plain.d);
        reference_vector(&x.d);
        EXPECT_EQ(x.d.i_ref.d - plain.d.i_ref.d, d_axis ? PM_Q(0.03) : 0);
        EXPECT_EQ(x.d.i_ref.q - plain.d.i_ref.q, d_axis ? 0 : PM_Q(0.03));
        x.d.position.window.injected = PM_Q(3.0); // not beyond the limit
        x.d.i_ref.d = 0;
        reference_vector(&x.d);
        if (!d_axis) {
            EXPECT_NEAR(real(x.d.i_ref.q), kI_max, kCurrent);
        }
    }
}

TEST(Reference, CommandsBeyondTheFormatSaturate)
{
    Drive x;
    const double torque_base = 1.5 * kPairs * (kV_V / 540) * kI_A;
    for (const int32_t way : {1, -1}) {
        x.d.command.speed_mrad_s = way * 90000;
        x.d.command.torque_uNm = way * 2000000;
        x.d.command.current_mA = way * 3000;
        reference_take(&x.d);
        EXPECT_NEAR(real(x.d.omega_target), way * 90 / kOmega, 1e-7);
        EXPECT_NEAR(real(x.d.torque_target), way * 2 / torque_base, 1e-7);
        EXPECT_NEAR(real(x.d.i_target), way * 3 / kI_A, 1e-7);
        x.d.command.speed_mrad_s = way * INT32_MAX;
        x.d.command.torque_uNm = way * INT32_MAX;
        x.d.command.current_mA = way * INT32_MAX;
        reference_take(&x.d);
        const pm_q_t most = way > 0 ? PM_Q(4.0) - 1 : -PM_Q(4.0);
        EXPECT_EQ(x.d.omega_target, most);
        EXPECT_EQ(x.d.torque_target, most);
        EXPECT_EQ(x.d.i_target, most);
    }
}

TEST(Reference, ResetStartsFromSpeedAndCurrent)
{
    Drive x;
    x.d.position.pll.omega = PM_Q(-0.3);
    x.d.position.speed.ready = true;
    x.d.field_weakening.i_d = PM_Q(-0.1);
    x.d.i_open = PM_Q(0.1);
    x.d.i_ref = {PM_Q(0.2), PM_Q(0.2)};
    reference_reset(&x.d, PM_Q(0.25));
    EXPECT_EQ(x.d.speed.reference, PM_Q(-0.3));
    EXPECT_EQ(x.d.speed.pi.integral, PM_WIDE(0.25));
    EXPECT_FALSE(x.d.position.speed.ready);
    EXPECT_EQ(x.d.field_weakening.i_d, 0);
    EXPECT_EQ(x.d.i_open, 0);
    EXPECT_EQ(x.d.i_ref.d, 0);
    EXPECT_EQ(x.d.i_ref.q, PM_Q(0.25));
}

// The carrier takes its amplitude from what control may use, the less the more an observer leads, and leaves half, also of a link
// that sags.
TEST(Prepare, SaggingLinkLeavesHalfToControl)
{
    for (const double v_V : {300.0, 200.0, 150.0, 100.0, 80.0, 65.0}) {
        for (const double weight : {0.0, 0.4, 1.0}) {
            for (const bool carrier : {true, false}) {
                Drive x;
                x.d.stage = STAGE_VECTOR;
                x.d.position.inject = carrier;
                x.d.position.weight = fixed(weight, 28);
                x.d.status.v_dc = fixed(v_V / kV_V, 28);
                drive_prepare(&x.d);
                const double kept = std::min((1 - weight) * kCarrier_V / v_V, 1.0);
                const double left = std::max(kLinear - kept, kLinear / 2);
                EXPECT_NEAR(real(x.d.v_share, 31), carrier ? left : kLinear, kRatio) << v_V << ' ' << weight;
                EXPECT_EQ(x.d.carrier, carrier);
            }
        }
    }
}

TEST(Prepare, NoCarrierOnAnImposedAngle)
{
    Drive x;
    x.d.stage = STAGE_OPEN_LOOP;
    x.d.position.inject = true;
    x.d.status.v_dc = PM_Q(0.6);
    drive_prepare(&x.d);
    EXPECT_FALSE(x.d.carrier);
    EXPECT_NEAR(real(x.d.v_share, 31), kLinear, 1e-7);
}

// The voltage acts from one to two periods after the sample: one and a half on average. On an imposed angle the vector's
// own speed counts, with the estimate the loop's.
TEST(Prepare, FrameIsTurnedToWhereTheVoltageActs)
{
    for (const drive_stage_t stage : {STAGE_VECTOR, STAGE_OPEN_LOOP, STAGE_PROCEDURE}) {
        for (const double omega : {0.5, -0.8}) {
            Drive x;
            x.d.stage = stage;
            x.d.status.v_dc = PM_Q(0.6);
            x.d.omega_open = x.d.omega_ramp = fixed(stage == STAGE_VECTOR ? -omega / 2 : omega, 28);
            x.d.pll.omega = x.d.position.pll.omega = fixed(stage == STAGE_VECTOR ? omega : -omega / 2, 28);
            drive_prepare(&x.d);
            const double turn = omega * 540 * 1e-4; // rad in a period
            EXPECT_NEAR(real(x.d.turn_open, 32) * 2 * bench::kPi, turn, 1e-6) << stage;
            EXPECT_NEAR(real(x.d.ahead.cos, 31), std::cos(1.5 * turn), 1e-5) << stage;
            EXPECT_NEAR(real(x.d.ahead.sin, 31), std::sin(1.5 * turn), 1e-5) << stage;
        }
    }
}

// In open loop the observer is tied to the ramp up to omega_high, and at a speed that is held up to omega_low.
TEST(Prepare, ObserverIsTiedToTheRampAtLowSpeed)
{
    const double low = 21 / kOmega, high = 40 / kOmega;
    for (const double way : {1.0, -1.0}) {
        for (const bool ramps : {true, false}) {
            for (const double omega : {0.0, 0.99 * low, 1.01 * low, 0.99 * high, 1.01 * high}) {
                Drive x;
                x.d.stage = STAGE_OPEN_LOOP;
                x.d.state = DRIVE_RUNNING;
                x.d.command.mode = DRIVE_MODE_SPEED;
                x.d.status.v_dc = PM_Q(0.6);
                x.d.omega_ramp = x.d.omega_open = fixed(way * omega, 28);
                x.d.omega_target = ramps ? fixed(way * 0.5, 28) : x.d.omega_ramp;
                x.d.theta_open = PM_TURN(0.3);
                drive_prepare(&x.d);
                const bool tied = omega < (ramps ? high : low);
                EXPECT_EQ(x.d.forced, tied) << omega << ' ' << ramps;
                if (tied) {
                    EXPECT_EQ(x.d.position.pll.theta, PM_TURN(0.3));
                    EXPECT_EQ(x.d.position.pll.omega, x.d.omega_open);
                }
            }
        }
    }
}

} // namespace
