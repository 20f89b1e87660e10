// third.h, third_integration.h, third_sogi.h, third_pair.h, third_pair_flux.h: the angle that a star point's voltage stands for, by
// METHODS.md 0.2 E3 behind an RC; for the pairs, those of two sets of windings.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "tests/contract/observers.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::kJ;
using bench::real;

constexpr bench::Base kB = bench::kIpmBase;
constexpr double kRc_s = 100e-6;
// Second order in 3 omega T = 0.09: RC and half a period as one lag, the mean of two periods.
constexpr double kExact_deg = 0.1;
constexpr double kSeed_deg = 0.27; // (3 omega T)^2 / 2 of the flux, at 314 rad/s
constexpr double kExpected = 0.2;  // half of third_drift, as preset
const std::vector<observer_id_t> kAll = {OBSERVER_third_integration, OBSERVER_third_sogi,
                                         OBSERVER_third_crossings, OBSERVER_third_pair,
                                         OBSERVER_third_pair_flux};
const std::vector<observer_id_t> kPairs = {OBSERVER_third_pair, OBSERVER_third_pair_flux};

drive_params_t params(observer_id_t id)
{
    drive_params_t p = bench::parameters(bench::kIpmLinear, kB);
    p.observer = id;
    bench::give_second_set(p, id);
    p.neutral_full_scale = 15000;
    p.neutral_filter = 100000;
    p.speed_low = 3200;
    p.speed_high = 4200;
    return p;
}

observer_config_t config(const drive_params_t &p)
{
    drive_config_t c = {};
    const drive_result_t result = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_TRUE(result.ok) << drive_param_table[result.param].name << ": " << result.reason;
    return c.position.observer;
}

// A rotor at constant speed with constant currents in its frame, seen from a position that lags by `error`.
struct Star {
    double omega_rad_s;
    Complex i_A;
    double error_rad = 0;
    Complex beside_V = 0; // turns with the rotor: of unlike phases
    double theta_rad = 0.3;
    double psi_9_Wb = 0;
    Complex offset_V = 0; // of the channel of the first set, and as imaginary part of the second's

    // behind the first set by `behind`
    double v_V(double behind_rad = 0) const
    {
        const double at = theta_rad - behind_rad;
        const Complex flux = bench::kPsi3_Wb - 0.5 * bench::kDL0_H * i_A;
        const Complex e = 3.0 * kJ * omega_rad_s * flux * std::polar(1.0, 3 * at);
        const Complex e_9 = 9.0 * kJ * omega_rad_s * psi_9_Wb * std::polar(1.0, 9 * at);
        return (e / (1.0 + 3.0 * kJ * omega_rad_s * kRc_s)).real() +
               (e_9 / (1.0 + 9.0 * kJ * omega_rad_s * kRc_s)).real() +
               (beside_V * std::polar(1.0, theta_rad)).real();
    }

    obs_in_t seen(obs_more_t *more) const
    {
        obs_in_t in = {};
        in.dir = bench::direction(theta_rad - error_rad);
        in.omega = fixed(omega_rad_s / kB.omega_rad_s, 28);
        in.i_dq = bench::dq(i_A / kB.i_A);
        more->v_zero = fixed((v_V() + offset_V.real()) / kB.v_V, 28);
        more->v_zero_second = fixed((v_V(bench::kSecondSet_rad) + offset_V.imag()) / kB.v_V, 28);
        in.more = more;
        return in;
    }
};

struct Source {
    observer_config_t c;
    observer_t state;
    obs_more_t more = {};

    Source(const drive_params_t &p, const Star &at) : c(config(p))
    {
        std::memset(&state, 0xa5, sizeof state);
        const obs_in_t in = at.seen(&more);
        observer_reset(&state, &c, &in);
    }

    // Mean and largest distance from it, degrees, over the second half.
    struct Seen {
        double mean = 0, most = 0, misfit = 0;
    };

    Seen run(Star &at, int periods)
    {
        std::vector<double> eps;
        Seen s;
        for (int k = 0; k < periods; ++k) {
            at.theta_rad += at.omega_rad_s * kB.period_s;
            const obs_in_t in = at.seen(&more);
            obs_out_t out;
            observer_step(&state, &c, &in, &out);
            if (k % 10 == 9) {
                observer_slow(&state, &c, &in, &out, PM_ONE);
            }
            if (k >= periods / 2) {
                eps.push_back(real(out.eps) / kDegree);
                s.misfit = std::max(s.misfit, std::fabs(real(out.misfit)));
            }
        }
        for (const double e : eps) {
            s.mean += e / static_cast<double>(eps.size());
        }
        for (const double e : eps) {
            s.most = std::max(s.most, std::fabs(e - s.mean));
        }
        return s;
    }
};

// The leak of third_pair_flux.h acts on sums, half a period old: what is left of it, rad.
double lag(observer_id_t id, double omega_rad_s)
{
    constexpr double kG2 = 0.4 * 0.4; // third_drift, as preset
    return id == OBSERVER_third_pair_flux ? omega_rad_s * kB.period_s / 2 * kG2 / (1 + kG2) : 0;
}

// Of an error that stays: what is expected of the flux errs too, and takes a part of it (third_integration.h).
double kept(observer_id_t id)
{
    return id == OBSERVER_third_integration ? 11.0 / 16 / (1 + kExpected * kExpected) + 5.0 / 16 : 1;
}

// That part comes and goes with six times the angle.
double ripple(observer_id_t id)
{
    return id == OBSERVER_third_integration ? 0.6 * kExpected / std::hypot(1, kExpected) : 0;
}

// With the RC and the shift by the load compensated, 5 to 100 % of rated speed, motoring and generating.
TEST(Third, SeesThePosition)
{
    for (const observer_id_t id : kAll) {
        for (const double omega : {15.7, -15.7, 157.0, 314.0, -314.0}) {
            for (const Complex i : {Complex{0, 0}, Complex{0, 4}, Complex{-2, 3}, Complex{1, -4}}) {
                for (const double error : {0.0, 2.0, -2.0}) {
                    Star at{omega, i, error * kDegree};
                    Source source(params(id), at);
                    const auto seen = source.run(at, 10000);
                    const double expected =
                        (std::sin(3 * error * kDegree) / 3 * kept(id) + lag(id, omega)) / kDegree;
                    const double more = ripple(id) * std::fabs(error);
                    EXPECT_NEAR(seen.mean, expected, kExact_deg)
                        << id << ' ' << omega << ' ' << i << ' ' << error;
                    EXPECT_LT(seen.most, kExact_deg + more) << id << ' ' << omega << ' ' << i;
                    EXPECT_LT(seen.misfit, 0.02 + 3 * kDegree * more);
                }
            }
        }
    }
}

// atan(3 omega RC) / 3 is what the position errs by where the RC is not known.
TEST(Third, TheLagOfAnUnknownFilterIsItsLaw)
{
    for (const double omega : {100.0, 314.0}) {
        drive_params_t p = params(OBSERVER_third_sogi);
        p.neutral_filter = 0;
        Star at{omega, 0};
        Source source(p, at);
        EXPECT_NEAR(source.run(at, 4000).mean, -std::atan(3 * omega * kRc_s) / 3 / kDegree, kExact_deg);
    }
}

// The law of 11.6.3 where dL_0 is not told.
TEST(Third, TheShiftByTheLoadIsItsLaw)
{
    for (const observer_id_t id : kAll) {
        for (const Complex i : {Complex{0, 4}, Complex{-1.75, 4}, Complex{1, -3}}) {
            drive_params_t p = params(id);
            p.dL_0 = 0;
            // the position that errs by it shows nothing
            const Complex l = 1.0 - 0.5 * bench::kDL0_H * i / bench::kPsi3_Wb;
            const double shift = -std::arg(l);
            Star at{157, i, shift / 3};
            Source source(p, at);
            EXPECT_NEAR(source.run(at, 40000).mean, 0, 0.1) << id << i;
            EXPECT_GT(std::fabs(shift / 3 / kDegree), 6.0);
        }
    }
}

TEST(Third, AThirdOfATurnIsNotSeen)
{
    for (const observer_id_t id : kAll) {
        for (const double third : {120.0, -120.0}) {
            Star at{157, {0, 2}, third * kDegree};
            Source source(params(id), at);
            EXPECT_NEAR(source.run(at, 2000).mean, 0, kExact_deg) << id;
        }
    }
}

// A sine of the frequency of rotation, 60 % of the third harmonic: gone with the notch, and the third harmonic not turned by it.
TEST(Third, TheNotchTakesOutTheFrequencyOfRotation)
{
    for (const double omega : {31.4, -157.0}) {
        const double beside_V = 0.6 * 3 * std::fabs(omega) * bench::kPsi3_Wb;
        drive_params_t p = params(OBSERVER_third_sogi);
        Star with{omega, 0, 0, beside_V}, without = with;
        Source bare(p, without);
        EXPECT_GT(bare.run(without, 20000).most, 8.0);
        p.third_notch = 300;
        Source notched(p, with);
        const auto seen = notched.run(with, 40000);
        EXPECT_NEAR(seen.mean, 0, kExact_deg);
        EXPECT_LT(seen.most, 0.1);
    }
}

TEST(Third, AMachineWithoutShowsNone)
{
    for (const observer_id_t id : kAll) {
        Star at{157, 0};
        Source source(params(id), at);
        for (int k = 0; k < 4000; ++k) {
            at.theta_rad += at.omega_rad_s * kB.period_s;
            obs_in_t in = at.seen(&source.more);
            source.more.v_zero = source.more.v_zero_second = 0;
            obs_out_t out;
            observer_step(&source.state, &source.c, &in, &out);
        }
        // beside what is expected of the flux
        EXPECT_GT(real(observer_last(&source.state, &source.c).misfit),
                  0.98 - (id == OBSERVER_third_integration ? kExpected : 0));
    }
}

TEST(Third, IsRefusedWithoutAThirdHarmonicAndBelowFourStepsOfIt)
{
    for (const observer_id_t id : kAll) {
        drive_params_t p = params(id);
        drive_config_t c = {};
        p.psi_3 = 0;
        EXPECT_EQ(drive_configure(&c, &p, PM_CHANNELS).param, DRIVE_PARAM_psi_3);
        p = params(id);
        // four steps of 30 V / 4096 over 3 psi_3 and three pole pairs: 0.46 rad/s; 18 times that with 450 V
        p.neutral_full_scale = 450000;
        p.speed_low = 3200;
        const double least = 4 * 900.0 / 4096 / (3 * bench::kPsi3_Wb) / 3;
        p.speed_high = static_cast<int32_t>(1000 * least * 0.98);
        EXPECT_EQ(drive_configure(&c, &p, PM_CHANNELS).param, DRIVE_PARAM_speed_high) << id;
        p.speed_high = static_cast<int32_t>(1000 * least * 1.02);
        EXPECT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok) << id;
        p.psi_3 = 1000; // four steps are more than it has at speed_trip
        p.dL_0 = 0;
        EXPECT_EQ(drive_configure(&c, &p, PM_CHANNELS).param, DRIVE_PARAM_speed_high) << id;
    }
}

// Where another source leads the size is not learnt, and what crossings have told is given up for the position.
TEST(Third, WhatItDoesNotLeadItDoesNotLearn)
{
    for (const pm_q_t weight : {0, PM_ONE / 2, PM_ONE}) {
        Star at{157, {0, 2}, 2 * kDegree};
        Source integration(params(OBSERVER_third_integration), at);
        Source crossings(params(OBSERVER_third_crossings), at);
        for (int k = 0; k < 2000; ++k) {
            at.theta_rad += at.omega_rad_s * kB.period_s;
            for (Source *source : {&integration, &crossings}) {
                obs_in_t in = at.seen(&source->more);
                source->more.v_zero += source->more.v_zero / 5; // a larger third harmonic than told
                obs_out_t out;
                observer_step(&source->state, &source->c, &in, &out);
                if (k % 10 == 9) {
                    observer_slow(&source->state, &source->c, &in, &out, weight);
                }
            }
            if (k > 1000 && k % 10 == 9) {
                EXPECT_EQ(crossings.state.third_crossings.ahead == 0, weight == 0) << k;
            }
        }
        const double share = integration.state.third_integration.share / double(THIRD_Z_ONE);
        if (weight == PM_ONE) {
            EXPECT_GT(share, 1.05);
        } else {
            EXPECT_EQ(share, 1) << weight;
        }
    }
}

// R and L_q do not enter: the same configuration, bit for bit.
TEST(Third, KnowsNeitherResistanceNorInductances)
{
    for (const observer_id_t id : kAll) {
        const observer_config_t told = config(params(id));
        for (const double wrong : {0.5, 1.5}) {
            drive_params_t p = params(id);
            p.R_s = static_cast<int32_t>(p.R_s * wrong);
            p.L_q = p.L_q_rated = p.L_qh_rated = static_cast<int32_t>(p.L_q * (wrong < 1 ? 0.8 : wrong));
            const observer_config_t other = config(p);
            const size_t size =
                id == OBSERVER_third_sogi ? sizeof told.third_sogi : sizeof told.third_integration;
            EXPECT_EQ(std::memcmp(&told.third_sogi, &other.third_sogi, size), 0);
        }
    }
}

// What follows each step, from the first on.
template <typename See> void follow(Source &source, Star &at, int periods, See see)
{
    for (int k = 0; k < periods; ++k) {
        at.theta_rad += at.omega_rad_s * kB.period_s;
        const obs_in_t in = at.seen(&source.more);
        obs_out_t out;
        observer_step(&source.state, &source.c, &in, &out);
        see(out);
    }
}

// What the sums are seeded with is exact to the first order in 3 omega T.
TEST(ThirdPair, TheSeedHasNoTransient)
{
    for (const observer_id_t id : kPairs) {
        for (const double omega : {31.4, -157.0, 314.0}) {
            for (const Complex i : {Complex{0, 0}, Complex{-2, 3}}) {
                Star at{omega, i};
                Source source(params(id), at);
                follow(source, at, 200, [&](const obs_out_t &out) {
                    ASSERT_NEAR((real(out.eps) - lag(id, omega)) / kDegree, 0, kSeed_deg)
                        << id << ' ' << omega;
                    ASSERT_NEAR(real(out.misfit), 0, 0.02) << id << ' ' << omega;
                });
            }
        }
    }
}

// What becomes of the flux psi e^{j order theta}, of which the third is taken for 1: the RC, and the leaky sum.
Complex passes(observer_id_t id, double order, double omega)
{
    const double g = std::copysign(0.4, omega); // third_drift as preset
    const Complex filter = (1.0 + 3.0 * kJ * omega * kRc_s) / (1.0 + order * kJ * omega * kRc_s);
    if (id == OBSERVER_third_pair) {
        return filter * order / 3.0; // the EMF's own
    }
    const double turn = omega * kB.period_s, leak = 3 * g * turn;
    const Complex sum = order * kJ * turn / (1.0 - (1 - leak) * std::polar(1.0, -order * turn));
    return filter * sum * (1.0 - kJ * g) * std::polar(1.0, -1.5 * turn);
}

// (psi_9 / psi_3) sin 12 theta by the EMFs, a third of it by the fluxes, with the other sign.
TEST(ThirdPair, ANinthHarmonicAddsItsLaw)
{
    constexpr double kShare = 0.1, kTolerance = 0.02;
    for (const observer_id_t id : kPairs) {
        for (const double omega : {31.4, 157.0, -157.0}) {
            Star at{omega, 0};
            at.psi_9_Wb = kShare * bench::kPsi3_Wb;
            Source source(params(id), at);
            follow(source, at, 4000,
                   [](const obs_out_t &) {}); // what the seed does not know of it has decayed
            double worst = 0, most = 0;
            follow(source, at, 2000, [&](const obs_out_t &out) {
                const Complex z = passes(id, 3, omega) +
                                  kShare * passes(id, -9, omega) * std::polar(1.0, -12 * at.theta_rad);
                worst = std::max(worst, std::fabs(real(out.eps) - z.imag() / 3));
                most = std::max(most, std::fabs(real(out.eps)));
            });
            const double law = kShare * (id == OBSERVER_third_pair ? 1 : 1.0 / 3);
            EXPECT_LT(worst, kTolerance * law) << id << ' ' << omega;
            EXPECT_NEAR(most, law, 0.15 * law) << id << ' ' << omega;
        }
    }
}

// An offset dv of a channel adds dv to the EMF and dv / w_c to a flux, w_c = 3 g omega.
TEST(ThirdPair, AnOffsetAddsItsLaw)
{
    constexpr double kOffset_V = 0.05, kG = 0.4;
    for (const observer_id_t id : kPairs) {
        for (const double omega : {31.4, -157.0}) {
            for (const Complex of : {Complex{kOffset_V, 0}, Complex{0, -kOffset_V}}) {
                Star at{omega, 0};
                at.offset_V = of;
                Source source(params(id), at);
                const double e = 3 * std::fabs(omega) * bench::kPsi3_Wb;
                const double lift = id == OBSERVER_third_pair ? 1 : std::hypot(1, kG) / kG;
                const double law_deg = kOffset_V * lift * std::hypot(1, 3 * omega * kRc_s) / e / 3 / kDegree;
                const auto seen = source.run(at, 8000);
                EXPECT_NEAR(seen.most, law_deg, 0.02 * law_deg + 0.02) << id << ' ' << omega;
                EXPECT_NEAR(seen.mean, 0, kExact_deg) << id << ' ' << omega;
            }
        }
    }
}

// The flux takes half a period off the filter: told so much more, it is ahead by atan(3 omega T / 2) / 3.
TEST(ThirdPair, TwinWithHalfAPeriodTooMuchIsAheadByIt)
{
    for (const double omega : {100.0, 314.0, -314.0}) {
        drive_params_t p = params(OBSERVER_third_pair_flux);
        p.neutral_filter += 50000;
        Star at{omega, 0};
        Source source(p, at);
        const double turn = std::atan(3 * omega * (kRc_s + kB.period_s / 2)) - std::atan(3 * omega * kRc_s);
        const double expected = turn / 3 + lag(OBSERVER_third_pair_flux, omega);
        EXPECT_NEAR(source.run(at, 4000).mean, expected / kDegree, kExact_deg) << omega;
    }
}

// Then the pair turns the other way: no error is seen, and no third harmonic.
TEST(ThirdPair, TwinWithTheSecondSetTurnedSeesNothing)
{
    constexpr int kTurns = 10, kPeriods = 4000;
    for (const observer_id_t id : kPairs) {
        for (const double error : {0.0, 10.0, -10.0}) {
            for (const bool turned : {false, true}) {
                Star at{2 * bench::kPi * kTurns / (kPeriods * kB.period_s), 0, error * kDegree};
                Source source(params(id), at);
                Complex mean = 0;
                for (int k = 0; k < 2 * kPeriods; ++k) {
                    at.theta_rad += at.omega_rad_s * kB.period_s;
                    const obs_in_t in = at.seen(&source.more);
                    source.more.v_zero_second *= turned ? -1 : 1;
                    obs_out_t out;
                    observer_step(&source.state, &source.c, &in, &out);
                    mean += k < kPeriods ? 0 : bench::complex(out.vector) / double(kPeriods);
                }
                const Complex tells = turned ? 0 : std::polar(1.0, 3 * error * kDegree);
                EXPECT_LT(std::abs(mean - tells), 0.01) << id << ' ' << error << mean;
            }
        }
    }
}

TEST(ThirdPair, IsRefusedWithoutASecondSetAndWithANotch)
{
    for (const observer_id_t id : kPairs) {
        drive_params_t p = params(id);
        drive_config_t c = {};
        p.winding = 0;
        const drive_result_t one = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_EQ(one.param, DRIVE_PARAM_observer);
        EXPECT_STREQ(one.reason, "needs two sets of windings: winding 2");
        p = params(id);
        p.third_notch = 300;
        EXPECT_EQ(drive_configure(&c, &p, PM_CHANNELS).param, DRIVE_PARAM_third_notch);
        p.third_notch = 0;
        for (const uint32_t missing : {NEEDS_SECOND_SET, NEEDS_NEUTRAL}) {
            EXPECT_FALSE(drive_configure(&c, &p, PM_CHANNELS & ~missing).ok) << id << ' ' << missing;
        }
        EXPECT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
    }
}

} // namespace
