// Prediction of freewheeling against its formula, and against the switching plant.
#include "bldc/freewheeling.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/sim_plant/six_step.h"

namespace
{

// METHODS-ADDENDUM.md B (c), row 116.
constexpr double kFormula = 1e-3;  // of fixed point
constexpr double kPlant = 0.03;    // with ten periods or more in a freewheel,
constexpr double kPeriods = 1;     // else
constexpr double kSweep = 0.05;    // rows 118 to 120
constexpr double kCurrent = 0.011; // of the inverse

constexpr double kBase_V = 40, kBase_A = 40, kPi = 3.141592653589793;

int32_t fixed(double x)
{
    return static_cast<int32_t>(std::llround(std::ldexp(x, PM_Q_BITS)));
}

double real(int32_t x)
{
    return std::ldexp(static_cast<double>(x), -PM_Q_BITS);
}

struct Case {
    double R_ohm, L_H, emf_Vs; // 2 E / omega
    double base_rad_s;

    freewheeling_config_t config() const
    {
        const double Z = kBase_V / kBase_A;
        return {fixed(R_ohm / Z), fixed(L_H * base_rad_s / Z), fixed(emf_Vs * base_rad_s / kBase_V)};
    }
    freewheeling_in_t in(pattern_id_t pattern, uint32_t sector, double u, double omega,
                         double v_dc_V = 24) const
    {
        return {pattern, sector, fixed(u), fixed(v_dc_V / kBase_V), fixed(omega / base_rad_s)};
    }
    double x_V(bool chopped, double u, double omega, double v_dc_V = 24) const
    {
        return (chopped ? u : 2 - u) * v_dc_V + emf_Vs * omega;
    }
    double angle_rad(double x, double omega, double i_A) const
    {
        return omega * L_H / R_ohm * std::log1p(3 * R_ohm * i_A / x);
    }
};

constexpr Case kFan = {0.4, 0.5e-3, 2 * 7.5e-3 * 0.822467, 1256.6};
constexpr Case kHs = {0.025, 25e-6, 1.5 * 1.25e-3, 8377.6};

double angle(const Case &c, const freewheeling_in_t &in, double i_A)
{
    const freewheeling_config_t config = c.config();
    return real(freewheeling_angle(&config, &in, fixed(i_A / kBase_A)));
}

TEST(Freewheeling, IsThatOfTheFormula)
{
    for (const Case &c : {kFan, kHs}) {
        for (const double share : {0.1, 0.5, 1.0}) {
            for (const double u : {0.1, 0.5, 1.0}) {
                for (const double i_A : {1.0, 5.0, 20.0}) {
                    const double omega = share * c.base_rad_s;
                    // the leg that has come is the high one in odd sectors
                    const double chopped = c.angle_rad(c.x_V(true, u, omega), omega, i_A);
                    const double held = c.angle_rad(c.x_V(false, u, omega), omega, i_A);
                    if (0.4 * 3 * i_A > 2 * c.x_V(true, u, omega)) {
                        continue; // beyond the range
                    }
                    EXPECT_NEAR(angle(c, c.in(PATTERN_H_PWM_L_ON, 1, u, omega), i_A), chopped,
                                kFormula * chopped);
                    EXPECT_NEAR(angle(c, c.in(PATTERN_H_PWM_L_ON, 2, u, omega), i_A), held, kFormula * held);
                    EXPECT_NEAR(angle(c, c.in(PATTERN_H_ON_L_PWM, 1, u, omega), i_A), held, kFormula * held);
                    EXPECT_NEAR(angle(c, c.in(PATTERN_H_ON_L_PWM, 2, u, omega), i_A), chopped,
                                kFormula * chopped);
                    EXPECT_NEAR(angle(c, c.in(PATTERN_PWM_ON, 3, u, omega), i_A), chopped,
                                kFormula * chopped);
                    EXPECT_NEAR(angle(c, c.in(PATTERN_ON_PWM, 4, u, omega), i_A), held, kFormula * held);
                    const double both = c.angle_rad(24 + c.emf_Vs * omega, omega, i_A);
                    EXPECT_NEAR(angle(c, c.in(PATTERN_H_PWM_L_PWM, 0, u, omega), i_A), both, kFormula * both);
                }
            }
        }
    }
}

// METHODS.md 10.5.3 to 10.5.5 in fixed point; against the plant below.
TEST(Freewheeling, FollowsResistanceInductanceLinkAndDuty)
{
    for (const double factor : {0.5, 0.8, 1.25, 1.5}) {
        Case c = kFan;
        c.R_ohm *= factor;
        c.L_H *= factor;
        const double by_machine = c.angle_rad(c.x_V(true, 0.5, 600), 600, 4);
        EXPECT_NEAR(angle(c, c.in(PATTERN_PWM_ON, 0, 0.5, 600), 4), by_machine, kFormula * by_machine);
        const double by_link = kFan.angle_rad(kFan.x_V(true, 0.5, 600, 24 * factor), 600, 4);
        EXPECT_NEAR(angle(kFan, kFan.in(PATTERN_PWM_ON, 0, 0.5, 600, 24 * factor), 4), by_link,
                    kFormula * by_link);
        const double by_duty = kFan.angle_rad(kFan.x_V(true, 0.6 * factor, 600), 600, 4);
        EXPECT_NEAR(angle(kFan, kFan.in(PATTERN_PWM_ON, 0, 0.6 * factor, 600), 4), by_duty,
                    kFormula * by_duty);
    }
}

TEST(Freewheeling, CurrentOfAnAngleIsItsInverse)
{
    for (const double share : {0.2, 0.5, 1.0}) {
        const freewheeling_config_t config = kFan.config();
        const freewheeling_in_t in = kFan.in(PATTERN_PWM_ON, 0, 0.4, share * kFan.base_rad_s);
        for (const double rad : {0.05, 0.2, 0.3}) {
            const double i = real(freewheeling_current(&config, &in, fixed(rad)));
            if (kFan.R_ohm * rad / (share * kFan.base_rad_s * kFan.L_H) <= 1) {
                EXPECT_NEAR(real(freewheeling_angle(&config, &in, fixed(i))), rad, kCurrent * rad);
            }
        }
    }
}

TEST(Freewheeling, LowSpeedAllowsAnyCurrent)
{
    const freewheeling_config_t config = kFan.config();
    const freewheeling_in_t in = kFan.in(PATTERN_PWM_ON, 0, 0.4, 1);
    EXPECT_GT(real(freewheeling_current(&config, &in, fixed(0.3))), 1); // full scale
    EXPECT_EQ(freewheeling_angle(&config, &in, 0), 0);
}

constexpr pattern_id_t of(validation::Pattern pattern)
{
    return static_cast<pattern_id_t>(pattern); // in the same order
}

struct Freewheel {
    double i_A, lasted_s;
    uint32_t sector;
};

// Of the plant, from its next commutation until the current of the leg that goes is zero.
Freewheel next(validation::SixStep &drive)
{
    constexpr int parts = 40;
    while (!drive.run()) {
    }
    const int out = drive.sector.open;
    const double sign = drive.sector.upper_has_come() ? 1 : -1;
    plant_truth_t t = drive.plant.truth();
    Freewheel f{sign * t.i_A[out], 0, static_cast<uint32_t>(drive.sector.number)};
    const double start_s = t.t_s, part_s = drive.plant.period_s() / parts;
    for (int n = 1; sign * t.i_A[out] > 1e-9 && n < 4000 * parts; n++) {
        if (n % parts == 0) {
            drive.run();
            t = drive.plant.truth();
        } else {
            t = drive.plant.at(n % parts * part_s);
        }
        f.lasted_s = t.t_s - start_s - part_s / 2;
    }
    return f;
}

struct Worst {
    double relative = 0, periods = 0, swapped = 1e9, fewest = 1e9;
};

Worst against_plant(plant_config_t config, const Case &c, double f_pwm_Hz, double omega, double i_A)
{
    config.inverter.f_pwm_Hz = f_pwm_Hz;
    Worst w;
    for (const validation::Pattern pattern : validation::patterns) {
        const double u = validation::duty_for(config, validation::Pattern::h_pwm_l_on, omega, i_A);
        validation::SixStep drive(config, pattern, validation::duty_for(config, pattern, omega, i_A), omega);
        drive.run_sectors(1 + static_cast<int>(6 * c.L_H / c.R_ohm * omega / (60 * validation::deg)));
        for (int n = 0; n < 2; n++) {
            const Freewheel f = next(drive);
            const auto predicted_s = [&](pattern_id_t id) {
                return angle(c, c.in(id, f.sector, u, drive.omega_e), f.i_A) / drive.omega_e;
            };
            const double own_s = predicted_s(of(pattern));
            w.relative = std::max(w.relative, std::abs(f.lasted_s / own_s - 1));
            w.periods = std::max(w.periods, std::abs(f.lasted_s - own_s) * f_pwm_Hz);
            w.fewest = std::min(w.fewest, f.lasted_s * f_pwm_Hz);
            if (pattern == validation::Pattern::pwm_on || pattern == validation::Pattern::on_pwm) {
                const pattern_id_t other = of(pattern) == PATTERN_PWM_ON ? PATTERN_ON_PWM : PATTERN_PWM_ON;
                w.swapped = std::min(w.swapped, std::abs(f.lasted_s / predicted_s(other) - 1));
            }
        }
    }
    return w;
}

TEST(Freewheeling, IsThatOfThePlantInAllPatterns)
{
    for (const double omega : {60.0, 100.0}) {
        const Worst w = against_plant(validation::bldc_fan(), kFan, 100e3, omega, 5);
        EXPECT_GE(w.fewest, 10);
        EXPECT_LE(w.relative, kPlant);
        // Twin: the pattern that holds the other leg
        EXPECT_GE(w.swapped, 0.5);
    }
    const Worst hs = against_plant(validation::bldc_hs(), kHs, 500e3, 100, 15);
    EXPECT_GE(hs.fewest, 10);
    EXPECT_LE(hs.relative, kPlant);
}

TEST(Freewheeling, IsWithinAPeriodOfThePlantWhereThereAreFew)
{
    for (const double omega : {100.0, 400.0, 1000.0}) {
        EXPECT_LE(against_plant(validation::bldc_fan(), kFan, 20e3, omega, 5).periods, kPeriods);
    }
    EXPECT_LE(against_plant(validation::bldc_hs(), kHs, 40e3, 2000, 15).periods, kPeriods);
}

// One point of a sweep: the plant's angle against the prediction in fixed point, and against one that does not know what was
// changed. BLDC-FAN with 100 kHz, the mean of both directions of the current.
struct Point {
    double share_off = 0, twin_off = 0; // relative
    double angle_rad = 0;
};

Point point(double R, double L, double v_dc_V, double u, validation::Pattern pattern, Case twin,
            double twin_v_dc_V, double twin_u)
{
    constexpr double omega = 80;
    plant_config_t config = validation::bldc_fan();
    config.machine.R_s_ohm = R;
    config.machine.L_d0_H = config.machine.L_q0_H = L;
    config.dclink.v_source_V = v_dc_V;
    config.inverter.f_pwm_Hz = 100e3;
    Case c = kFan;
    c.R_ohm = R;
    c.L_H = L;
    validation::SixStep drive(config, pattern, u, omega);
    drive.run_sectors(2 + static_cast<int>(6 * L / R * omega / 1.047));
    Point p;
    for (int n = 0; n < 2; ++n) {
        const Freewheel f = next(drive);
        const double measured = f.lasted_s * drive.omega_e;
        const double own = angle(c, c.in(of(pattern), f.sector, u, drive.omega_e, v_dc_V), f.i_A);
        const double other =
            angle(twin, twin.in(of(pattern), f.sector, twin_u, drive.omega_e, twin_v_dc_V), f.i_A);
        EXPECT_GE(f.lasted_s * 100e3, 7) << "chops of the carrier";
        p.share_off = std::max(p.share_off, std::abs(measured / own - 1));
        p.twin_off = std::max(p.twin_off, std::abs(measured / other - 1));
        p.angle_rad += measured / 2 / f.i_A;
    }
    return p;
}

// Duty of about 4 A at that speed.
double duty_of(double R, double v_dc_V)
{
    return (kFan.emf_Vs * 80 + 2 * R * 4) / v_dc_V;
}

// Rows 118 to 120, against the plant, in both modes.
TEST(Freewheeling, OfThePlantFollowsResistance)
{
    for (const validation::Pattern pattern : {validation::Pattern::pwm_on, validation::Pattern::on_pwm}) {
        double before = 1e9;
        for (const double factor : {0.5, 1.0, 1.5, 2.0}) {
            const double R = kFan.R_ohm * factor;
            Case twin = kFan;
            twin.R_ohm = 0.1 * R;
            const double u = duty_of(2 * kFan.R_ohm, 24); // the same voltage: more resistance, less current
            const Point p = point(R, kFan.L_H, 24, u, pattern, twin, 24, u);
            EXPECT_LE(p.share_off, kSweep) << factor;
            EXPECT_LT(p.angle_rad, before) << factor; // of an ampere
            before = p.angle_rad;
            if (factor == 2.0) {
                EXPECT_GE(p.twin_off, kSweep);
            }
        }
    }
}

TEST(Freewheeling, OfThePlantFollowsInductance)
{
    for (const validation::Pattern pattern : {validation::Pattern::pwm_on, validation::Pattern::on_pwm}) {
        for (const double factor : {0.7, 1.0, 1.5, 2.0}) {
            const double L = kFan.L_H * factor, u = duty_of(kFan.R_ohm, 24);
            const Point p = point(kFan.R_ohm, L, 24, u, pattern, kFan, 24, u);
            EXPECT_LE(p.share_off, kSweep) << factor;
            EXPECT_GE(p.twin_off, std::abs(factor - 1) - kSweep * factor) << factor; // in proportion
        }
    }
}

TEST(Freewheeling, OfThePlantFollowsTheLinkVoltage)
{
    for (const validation::Pattern pattern : {validation::Pattern::pwm_on, validation::Pattern::on_pwm}) {
        double before = 1e9;
        for (const double v_dc_V : {12.0, 18.0, 24.0, 36.0}) {
            const double u = 0.25;
            const Point p = point(kFan.R_ohm, kFan.L_H, v_dc_V, u, pattern, kFan, 24, u);
            EXPECT_LE(p.share_off, kSweep) << v_dc_V;
            EXPECT_LT(p.angle_rad, before) << v_dc_V;
            before = p.angle_rad;
            if (v_dc_V != 24) {
                EXPECT_GE(p.twin_off, 2 * kSweep) << v_dc_V;
            }
        }
    }
}

// More duty, a shorter freewheeling where the leg that has come is chopped, a longer one where it is not.
TEST(Freewheeling, OfThePlantFollowsTheDuty)
{
    for (const validation::Pattern pattern : {validation::Pattern::pwm_on, validation::Pattern::on_pwm}) {
        const bool first = pattern == validation::Pattern::pwm_on;
        double before = first ? 1e9 : 0;
        for (const double u : {0.15, 0.3, 0.5, 0.7, 0.9}) {
            const Point p = point(kFan.R_ohm, kFan.L_H, 24, u, pattern, kFan, 24, first ? 1.5 * u : u - 0.5);
            EXPECT_LE(p.share_off, kSweep) << u;
            EXPECT_GE(p.twin_off, 2 * kSweep) << u;
            EXPECT_TRUE(first ? p.angle_rad < before : true) << u;
            before = p.angle_rad;
        }
    }
}

// Current that has just decayed at `rad` behind a commutation into a leg that is not chopped, while the machine brakes: of the phase that
// goes, backwards in small steps, with its EMF e and v = u v_dc less the other two's in
//   3 L di/dt = 3 R |i| + v - 2 e (trapezoid), v - 3 e (sine);   v = mean EMF of the line less 2 R |i|
double braking_A(const Case &c, bool sine, double omega, double rad)
{
    const int steps = 20000;
    double least = 0, most = 100;
    while (most - least > 1e-6) {
        const double i_A = (least + most) / 2;
        double i = i_A;
        for (int n = 0; n < steps && i > 0; ++n) {
            const double theta = rad * n / steps, emf_V = c.emf_Vs * omega;
            const double e_V =
                sine ? 2 * emf_V * std::sin(kPi * 5 / 6 + theta) : emf_V * (1 - 6 / kPi * theta);
            const double mean_V = sine ? emf_V / 1.5 * 3 * std::sqrt(3.0) / kPi : emf_V;
            const double fall_V = mean_V - 2 * c.R_ohm * i_A - e_V + 3 * c.R_ohm * i;
            i -= fall_V / (3 * c.L_H) * rad / steps / omega;
        }
        (i > 0 ? most : least) = i_A;
    }
    return least;
}

// Of a sine less, by what its line has on average above its EMF at the commutation.
TEST(Freewheeling, BrakingCurrentIsThatOfTheFallingEmf)
{
    for (const bool sine : {false, true}) {
        const Case &c = sine ? kHs : kFan;
        const freewheeling_config_t config = c.config();
        for (const double share : {0.2, 0.5, 1.0}) {
            const double omega = share * c.base_rad_s;
            for (const double rad : {0.2, 0.35, 0.5}) {
                const freewheeling_in_t in = c.in(PATTERN_H_PWM_L_ON, 2, 0.5, omega);
                const double i_A = kBase_A * real(freewheeling_braking(&config, &in, fixed(rad)));
                const double exact_A = braking_A(c, sine, omega, rad);
                EXPECT_LT(i_A, exact_A * 1.11) << share << ' ' << rad;
                EXPECT_GT(i_A, exact_A * (sine ? 0.6 : 0.9)) << share << ' ' << rad;
            }
        }
    }
}

// Where the leg that has come is chopped the link helps, twice as much as where both are, and all the more below its voltage.
TEST(Freewheeling, BrakingCurrentByThePattern)
{
    const freewheeling_config_t config = kFan.config();
    const auto braking = [&](pattern_id_t pattern, uint32_t sector, double omega) {
        const freewheeling_in_t in = kFan.in(pattern, sector, 0.5, omega);
        return real(freewheeling_braking(&config, &in, fixed(0.3)));
    };
    const double held = braking(PATTERN_H_PWM_L_ON, 2, 600);
    const double more = kBase_A * (braking(PATTERN_H_PWM_L_PWM, 0, 600) - held);
    const double left_V = 24 - kFan.emf_Vs * 600;
    EXPECT_NEAR(more, 0.3 * left_V / (3 * 600 * kFan.L_H), 0.01);
    EXPECT_NEAR(kBase_A * (braking(PATTERN_H_PWM_L_ON, 1, 600) - held), 2 * more, 0.01);
    EXPECT_EQ(braking(PATTERN_H_ON_L_PWM, 1, 600), held);
    EXPECT_EQ(braking(PATTERN_PWM_ON, 0, 600), braking(PATTERN_H_PWM_L_ON, 1, 600));
    EXPECT_EQ(braking(PATTERN_ON_PWM, 0, 600), held);
    EXPECT_EQ(braking(PATTERN_PWM_ON, 0, 2500), braking(PATTERN_ON_PWM, 0, 2500)) << "an EMF above the link";
}

// The series of the header to its last term, in fixed point.
TEST(Freewheeling, SeriesAreThoseOfTheHeader)
{
    constexpr double kSeries = 2e-5;
    const freewheeling_config_t config = kFan.config();
    const double omega = 0.3 * kFan.base_rad_s;
    const freewheeling_in_t in = kFan.in(PATTERN_PWM_ON, 0, 0.3, omega);
    const double x = kFan.x_V(true, 0.3, omega), R = kFan.R_ohm, L = kFan.L_H;
    const double i = 2 * x / (3 * R); // the most: w = 1/2
    const double w = 3 * R * i / (2 * x + 3 * R * i), w_2 = w * w;
    const double angle_rad = 2 * omega * L * w / R * (1 + w_2 * (1.0 / 3 + w_2 * (1.0 / 5 + w_2 / 7)));
    EXPECT_NEAR(angle(kFan, in, i), angle_rad, kSeries * angle_rad);
    for (const double e : {0.3, 0.6, 0.99}) {
        const double rad = e * omega * L / R;
        const double back_A = x * rad / (3 * omega * L) * (1 + e / 2 + e * e / 6 + e * e * e / 24);
        EXPECT_NEAR(real(freewheeling_current(&config, &in, fixed(rad))) * kBase_A, back_A, kSeries * back_A);
    }
}

} // namespace
