// The circle against the impedance of a machine, in double precision.
#include "injection/saliency_circle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "firmware/math/trig.h"

namespace
{

using Complex = std::complex<double>;

constexpr double kL_dh = 0.28, kL_qh = 0.46, kL_dqh = -0.07; // per unit
constexpr double kFlux = 0.03;

pm_q_t q(double x)
{
    return static_cast<pm_q_t>(std::lround(x * PM_ONE));
}

double real(pm_q_t x)
{
    return static_cast<double>(x) / PM_ONE;
}

pm_angle_t angle(double rad)
{
    return static_cast<pm_angle_t>(static_cast<int64_t>(std::llround(rad / (2 * M_PI) * 4294967296.0)));
}

// Answer to F cos along each axis: Y = (R + j X)^-1 with R = rho X_sa, so that with rho = 0 it is F L^-1.
saliency_circle_t circle(double theta, double rho, double L_dqh = kL_dqh)
{
    saliency_circle_t self;
    saliency_circle_reset(&self);
    const Complex j(0, 1);
    const double R = rho * (kL_dh + kL_qh) / 2;
    const Complex zd = R + j * kL_dh, zq = R + j * kL_qh, zx = j * L_dqh;
    const Complex det = zd * zq - zx * zx;
    for (int n = 0; n < SALIENCY_CIRCLE_AXES; ++n) {
        const double eta = 2 * M_PI * n / SALIENCY_CIRCLE_AXES;
        const double d = std::cos(eta - theta), x = std::sin(eta - theta);
        const Complex i_d = kFlux * (zq * d - zx * x) / det, i_q = kFlux * (zd * x - zx * d) / det;
        const auto turned = [&](double a, double b) {
            return pm_dq_t{q((a * std::cos(theta) - b * std::sin(theta)) / 2),
                           q((a * std::sin(theta) + b * std::cos(theta)) / 2)};
        };
        // the phase counts from a current that lags by a quarter: -j is 1 there
        saliency_circle_add(&self, pm_dir(angle(eta)), turned(-i_d.imag(), -i_q.imag()),
                            turned(i_d.real(), i_q.real()));
    }
    return self;
}

TEST(SaliencyCircle, CentreAndRadiusAreThoseOfTheFormula)
{
    const double D = kL_dh * kL_qh - kL_dqh * kL_dqh;
    const double K = std::hypot((kL_qh - kL_dh) / 2, kL_dqh);
    for (const double theta : {0.0, 0.4, 2.0, 3.0}) {
        const saliency_circle_t self = circle(theta, 0);
        const saliency_fit_t fit = saliency_circle_fit(&self);
        EXPECT_NEAR(real(fit.centre), kFlux * (kL_dh + kL_qh) / 2 / D, 1e-6);
        EXPECT_NEAR(real(fit.radius), kFlux * K / D, 1e-6);
        const double theta_m = std::atan2(-kL_dqh, (kL_qh - kL_dh) / 2);
        const double error = std::remainder(fit.angle / 4294967296.0 * 2 * M_PI - theta - theta_m / 2, M_PI);
        EXPECT_NEAR(error, 0, 4e-5) << theta; // pm_atan2
    }
}

TEST(SaliencyCircle, InductancesOfAnyMachineAtAnyAngle)
{
    for (const double theta : {0.0, 0.4, 2.0, 4.0}) {
        for (const double L_dqh : {-0.07, 0.0, 0.1}) {
            const saliency_circle_t self = circle(theta, 0, L_dqh);
            const saliency_point_t L = saliency_circle_inductances(&self, angle(theta), q(kFlux));
            EXPECT_NEAR(real(L.L_d), kL_dh, 1e-5);
            EXPECT_NEAR(real(L.L_q), kL_qh, 1e-5);
            EXPECT_NEAR(real(L.L_dq), L_dqh, 1e-5);
        }
    }
}

// With resistance of half the reactance the amplitudes alone err by 20 % and more
TEST(SaliencyCircle, WhatIsInPhaseWithTheVoltageDoesNotCount)
{
    for (const double rho : {0.05, 0.2, 0.5}) {
        const saliency_circle_t self = circle(0.7, rho);
        const saliency_point_t L = saliency_circle_inductances(&self, angle(0.7), q(kFlux));
        EXPECT_NEAR(real(L.L_d), kL_dh, 1e-5) << rho;
        EXPECT_NEAR(real(L.L_q), kL_qh, 1e-5) << rho;
        EXPECT_NEAR(real(L.L_dq), kL_dqh, 1e-5) << rho;
    }
    saliency_circle_t half = circle(0.7, 0.5);
    half.g_p = half.g_n = {0, 0};
    const saliency_point_t L = saliency_circle_inductances(&half, angle(0.7), q(kFlux));
    EXPECT_GT(real(L.L_d), 1.2 * kL_dh);
}

TEST(SaliencyCircle, WhatNoMachineShowsGivesNothing)
{
    saliency_circle_t self;
    saliency_circle_reset(&self);
    const auto nothing = [&] {
        const saliency_point_t L = saliency_circle_inductances(&self, 0, q(kFlux));
        const saliency_fit_t fit = saliency_circle_fit(&self);
        return L.L_d == 0 && L.L_q == 0 && L.L_dq == 0 && fit.centre == 0 && fit.radius == 0;
    };
    EXPECT_TRUE(nothing());
    self = circle(0.3, 0);
    EXPECT_FALSE(nothing());
    self.n = {self.p.d, 0};
    EXPECT_TRUE(nothing());
    self = circle(0.3, 0);
    self.g_p.d = -self.p.d;
    EXPECT_TRUE(nothing());
    self = circle(0.3, 0);
    self.p.d = -self.p.d;
    EXPECT_TRUE(nothing());
}

} // namespace
