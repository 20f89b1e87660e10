// mechanics.h: load laws, elastic shaft and given speeds against closed forms, with an integrator of the
// test's own; friction, load and given speeds once more through the plant, which has to find their instants.
#include "sim_plant/mechanics.h"

#include "rig.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace
{

// Runge-Kutta of fourth order with 1000 steps or more in every time constant: 1e-12 a step.
constexpr double runge_kutta = 1e-9;
// Closed forms against the plant's integrator of 1e-6 local error whose steps are short for the electrical
// side.
constexpr double closed_form = 1e-6;
// Input and losses are integrated with the motion; what is left is the order of the integrator.
constexpr double balance = 1e-6;

plant_mech_t one_mass(double J_kgm2)
{
    plant_mech_t p{};
    p.J_kgm2 = J_kgm2;
    return p;
}

plant_mech_t two_masses()
{
    plant_mech_t p = one_mass(0.01);
    p.J_load_kgm2 = 0.03;
    p.k_shaft_Nm = 200.0;
    return p;
}

// Integrates the rates; the instants at which the motion changes its kind are found by bisection.
struct Shaft {
    enum { SPEED, ANGLE, LOAD_SPEED, TWIST, WORK, LOSS, STATES };
    using State = std::array<double, STATES>;

    mechanics_t mech{};
    State x{};
    double t = 0.0;
    int events = 0;
    std::function<double(double)> torque = [](double) { return 0.0; };

    explicit Shaft(const plant_mech_t &p)
    {
        mechanics_init(&mech, &p);
    }

    static mechanics_motion_t motion(const State &s)
    {
        return {s[SPEED], s[ANGLE], s[LOAD_SPEED], s[TWIST]};
    }

    double excess(const State &s, double at) const
    {
        mechanics_motion_t m = motion(s);
        return mechanics_excess(&mech, &m, torque(at));
    }

    void settle()
    {
        mechanics_motion_t m = motion(x);
        x[SPEED] = mechanics_settle(&mech, &m, torque(t));
    }

    State rate(const State &s, double at) const
    {
        const plant_mech_t &p = mech.parameters;
        mechanics_motion_t m = motion(s);
        mechanics_motion_rate_t r;
        mechanics_rates(&mech, &m, torque(at), &r);
        bool two = p.J_load_kgm2 > 0.0;
        double w = s[SPEED], w_load = two ? s[LOAD_SPEED] : w, slip = w - w_load;
        double load = p.load_Nms * w_load + p.load_Nms2 * w_load * std::fabs(w_load) + mech.load_Nm;
        double loss =
            p.B_Nms * w * w + p.T_coulomb_Nm * std::fabs(w) + p.d_shaft_Nms * slip * slip + load * w_load;
        return {r.omega_mech_rad_s2, w, r.omega_load_rad_s2, r.twist_rad_s, torque(at) * w, loss};
    }

    State step(double h) const
    {
        auto along = [this](const State &k, double f) {
            State s = x;
            for (size_t n = 0; n < STATES; n++) {
                s[n] += f * k[n];
            }
            return s;
        };
        State k1 = rate(x, t), k2 = rate(along(k1, h / 2), t + h / 2);
        State k3 = rate(along(k2, h / 2), t + h / 2), k4 = rate(along(k3, h), t + h);
        State k;
        for (size_t n = 0; n < STATES; n++) {
            k[n] = (k1[n] + 2 * k2[n] + 2 * k3[n] + k4[n]) / 6;
        }
        return along(k, h);
    }

    void run(double duration, double h_max = 1e-5)
    {
        settle();
        for (double end = t + duration; t < end - 1e-12;) {
            double h = std::fmin(h_max, end - t);
            bool event = excess(step(h), t + h) > 0.0;
            for (double early = 0.0; event && h - early > 1e-15;) {
                double mid = 0.5 * (early + h);
                (excess(step(mid), t + mid) > 0.0 ? h : early) = mid;
            }
            x = step(h);
            t += h;
            if (event) {
                events++;
                settle();
            }
            if (events > 1000) {
                throw std::runtime_error("the motion chatters");
            }
        }
    }
};

TEST(Shaft, RingsAtTheResonanceOfTheTwoMasses)
{
    plant_mech_t p = two_masses();
    p.d_shaft_Nms = 0.05;
    Shaft shaft(p);
    shaft.x[Shaft::TWIST] = 0.1;
    double inverse = 1.0 / p.J_kgm2 + 1.0 / p.J_load_kgm2;
    double decay = 0.5 * p.d_shaft_Nms * inverse;
    double omega = std::sqrt(p.k_shaft_Nm * inverse - decay * decay);
    for (int k = 1; k <= 300; k++) { // 8 periods, decay to 0.37
        shaft.run(1e-3);
        double t = 1e-3 * k;
        double ring = std::cos(omega * t) + decay / omega * std::sin(omega * t);
        EXPECT_NEAR(shaft.x[Shaft::TWIST], 0.1 * std::exp(-decay * t) * ring, 0.1 * runge_kutta);
    }
    double momentum = p.J_kgm2 * shaft.x[Shaft::SPEED] + p.J_load_kgm2 * shaft.x[Shaft::LOAD_SPEED];
    EXPECT_NEAR(momentum, 0.0, 1e-12);
}

TEST(Shaft, GivenRotorLeavesTheLoadFree)
{
    plant_mech_t p = two_masses();
    double omega = std::sqrt(p.k_shaft_Nm / p.J_load_kgm2);
    Shaft imposed(p);
    mechanics_impose(&imposed.mech, 10.0);
    imposed.torque = [](double) { return 100.0; };
    p.locked = true;
    Shaft locked(p);
    locked.mech.load_Nm = 5.0;
    for (int k = 1; k <= 100; k++) {
        double t = 1e-3 * k;
        locked.run(1e-3);
        EXPECT_EQ(locked.x[Shaft::SPEED], 0.0);
        EXPECT_NEAR(locked.x[Shaft::TWIST], 5.0 / p.k_shaft_Nm * (1.0 - std::cos(omega * t)), runge_kutta);
        imposed.run(1e-3);
        EXPECT_EQ(imposed.x[Shaft::SPEED], 10.0);
        EXPECT_NEAR(imposed.x[Shaft::TWIST], 10.0 / omega * std::sin(omega * t), runge_kutta);
    }
}

TEST(Shaft, AccountsForAllEnergy)
{
    plant_mech_t p = two_masses();
    p.B_Nms = 0.01;
    p.T_coulomb_Nm = 0.8;
    p.d_shaft_Nms = 0.05;
    p.load_Nms = 0.02;
    p.load_Nms2 = 1e-3;
    Shaft shaft(p);
    shaft.mech.load_Nm = 1.0;
    shaft.torque = [](double t) { return 2.0 + 6.0 * std::sin(11.0 * t); };
    int rests = 0;
    for (int k = 0; k < 2000; k++) {
        shaft.run(1e-3, 1e-4);
        rests += shaft.mech.stuck;
    }
    EXPECT_GT(rests, 10) << "sticking must be part of the run";
    mechanics_motion_t end = Shaft::motion(shaft.x);
    double stored = 0.5 * (p.J_kgm2 * std::pow(end.omega_mech_rad_s, 2) +
                           p.J_load_kgm2 * std::pow(end.omega_load_rad_s, 2) +
                           p.k_shaft_Nm * end.twist_rad * end.twist_rad);
    EXPECT_GT(shaft.x[Shaft::WORK], 10.0);
    EXPECT_NEAR(shaft.x[Shaft::WORK], shaft.x[Shaft::LOSS] + stored, balance * shaft.x[Shaft::WORK]);
}

TEST(Load, FanStopsByTheSquareOfItsSpeed)
{
    plant_mech_t p = one_mass(0.01);
    p.load_Nms2 = 1e-3;
    for (double start : {100.0, -100.0}) {
        Shaft shaft(p);
        shaft.x[Shaft::SPEED] = start;
        shaft.run(0.3);
        double omega = start / (1.0 + p.load_Nms2 * std::fabs(start) * 0.3 / p.J_kgm2);
        EXPECT_NEAR(shaft.x[Shaft::SPEED], omega, 100.0 * runge_kutta);
    }
}

// Pump against a static head on the second mass: end speed from the balance of torques, by the quadratic
// formula.
TEST(Load, PumpSettlesWhereTheTorquesBalance)
{
    plant_mech_t p = two_masses();
    p.B_Nms = 0.01;
    p.d_shaft_Nms = 1.0;
    p.load_Nms = 0.1;
    p.load_Nms2 = 4e-3;
    Shaft shaft(p);
    shaft.mech.load_Nm = 1.0;
    shaft.torque = [](double) { return 8.0; };
    shaft.run(6.0, 1e-4); // time constant 0.1 s
    double linear = p.B_Nms + p.load_Nms;
    double omega = (std::sqrt(linear * linear + 4 * p.load_Nms2 * (8.0 - 1.0)) - linear) / (2 * p.load_Nms2);
    EXPECT_NEAR(shaft.x[Shaft::SPEED], omega, runge_kutta);
    EXPECT_NEAR(shaft.x[Shaft::LOAD_SPEED], omega, runge_kutta);
    EXPECT_NEAR(shaft.x[Shaft::TWIST], (8.0 - p.B_Nms * omega) / p.k_shaft_Nm, runge_kutta);
}

// Reciprocating compressor: mean torque, and two harmonics of the angle.
plant_mech_t compressor()
{
    plant_mech_t p = one_mass(0.01);
    p.load_angle[0] = {1, 1.5, 0.3};
    p.load_angle[3] = {2, 0.4, -1.0};
    return p;
}

TEST(Load, CompressorTorqueByTheAngle)
{
    Shaft shaft(compressor());
    shaft.mech.load_Nm = 2.0;
    shaft.settle();
    double mean = 0.0, c1 = 0.0, s1 = 0.0, c2 = 0.0, s2 = 0.0;
    for (int k = 0; k < 36; k++) {
        double theta = 2 * rig::pi * k / 36;
        shaft.x[Shaft::ANGLE] = theta;
        double load = -0.01 * shaft.rate(shaft.x, 0.0)[Shaft::SPEED];
        mean += load / 36;
        c1 += load * std::cos(theta) / 18;
        s1 += load * std::sin(theta) / 18;
        c2 += load * std::cos(2 * theta) / 18;
        s2 += load * std::sin(2 * theta) / 18;
    }
    EXPECT_NEAR(mean, 2.0, 1e-12);
    EXPECT_NEAR(c1, 1.5 * std::cos(0.3), 1e-12);
    EXPECT_NEAR(s1, -1.5 * std::sin(0.3), 1e-12);
    EXPECT_NEAR(c2, 0.4 * std::cos(-1.0), 1e-12);
    EXPECT_NEAR(s2, -0.4 * std::sin(-1.0), 1e-12);
}

// With the mean torque from the motor, kinetic energy and the work against the harmonics add up at every
// angle.
TEST(Load, CompressorSwingsTheSpeedByItsWork)
{
    Shaft shaft(compressor());
    shaft.mech.load_Nm = 2.0;
    shaft.torque = [](double) { return 2.0; };
    shaft.x[Shaft::SPEED] = 40.0;
    auto work = [](double theta) { return 1.5 * std::sin(theta + 0.3) + 0.2 * std::sin(2 * theta - 1.0); };
    double slowest = 40.0;
    for (int k = 0; k < 200; k++) {
        shaft.run(1e-3);
        double kinetic = 0.5 * 0.01 * 40.0 * 40.0 - work(shaft.x[Shaft::ANGLE]) + work(0.0);
        EXPECT_NEAR(0.5 * 0.01 * std::pow(shaft.x[Shaft::SPEED], 2), kinetic, 8.0 * runge_kutta);
        slowest = std::fmin(slowest, shaft.x[Shaft::SPEED]);
    }
    EXPECT_LT(slowest, 39.0);
}

TEST(Load, CompressorOnAShaftFollowsTheAngleOfTheLoad)
{
    plant_mech_t p = two_masses();
    p.load_angle[1] = {2, 1.0, 0.5};
    Shaft shaft(p);
    shaft.settle();
    shaft.x[Shaft::ANGLE] = 1.0;
    shaft.x[Shaft::TWIST] = 0.4;
    Shaft::State rate = shaft.rate(shaft.x, 0.0);
    EXPECT_NEAR(rate[Shaft::LOAD_SPEED] * 0.03, 200.0 * 0.4 - std::cos(2 * (1.0 - 0.4) + 0.5), 1e-12);
    EXPECT_NEAR(rate[Shaft::SPEED] * 0.01, -200.0 * 0.4, 1e-12);
}

TEST(Load, HoistPullsAtStandstillUnlessFrictionHoldsIt)
{
    for (double direction : {1.0, -1.0, 0.0}) {
        Shaft free(one_mass(0.01));
        free.mech.load_Nm = 3.0;
        free.x[Shaft::SPEED] = direction;
        free.settle();
        EXPECT_NEAR(free.rate(free.x, 0.0)[Shaft::SPEED], -300.0, 1e-9) << "whichever way it moves";
    }
    plant_mech_t p = two_masses();
    p.T_coulomb_Nm = 4.0;
    p.d_shaft_Nms = 1.0; // the load swings to 5 Nm before it hangs still, less with damping
    Shaft held(p);
    held.mech.load_Nm = 3.0;
    held.torque = [](double) { return 1.5; };
    held.run(2.0, 1e-4);
    EXPECT_EQ(held.x[Shaft::ANGLE], 0.0);
    EXPECT_NEAR(held.x[Shaft::TWIST], 3.0 / p.k_shaft_Nm, runge_kutta);
    for (double sign : {1.0, -1.0}) { // lifts with load and friction, lets down with their difference
        held.torque = [sign](double) { return 3.0 + sign * 3.999; };
        EXPECT_LT(held.excess(held.x, held.t), 0.0);
        held.torque = [sign](double) { return 3.0 + sign * 4.001; };
        EXPECT_GT(held.excess(held.x, held.t), 0.0);
        Shaft moving = held;
        moving.settle();
        EXPECT_FALSE(moving.mech.stuck);
        EXPECT_NEAR(moving.rate(moving.x, held.t)[Shaft::SPEED], sign * 0.001 / p.J_kgm2, 1e-6);
    }
}

TEST(Load, RotorSticksBySpringOfTheShaftUntilItExceedsFriction)
{
    plant_mech_t p = two_masses();
    p.T_coulomb_Nm = 4.0;
    double omega = std::sqrt(p.k_shaft_Nm / p.J_load_kgm2);
    Shaft held(p), torn(p);
    held.x[Shaft::TWIST] = 0.0199; // 3.98 Nm at most
    held.run(0.2);
    EXPECT_EQ(held.x[Shaft::ANGLE], 0.0);
    EXPECT_NEAR(held.x[Shaft::TWIST], 0.0199 * std::cos(omega * 0.2), runge_kutta);
    torn.x[Shaft::LOAD_SPEED] = -2.0; // twists until 4 Nm are reached, asin(4 omega / (2 k)) / omega
    double breaks_s = std::asin(4.0 * omega / (2.0 * p.k_shaft_Nm)) / omega;
    torn.run(breaks_s - 1e-5, 1e-6);
    EXPECT_EQ(torn.x[Shaft::ANGLE], 0.0);
    EXPECT_TRUE(torn.mech.stuck);
    torn.run(2e-5, 1e-6);
    EXPECT_FALSE(torn.mech.stuck);
    EXPECT_LT(torn.x[Shaft::SPEED], 0.0);
}

TEST(Load, FrictionHoldsWhereTheAngleLetsIt)
{
    plant_mech_t p = one_mass(0.01);
    p.T_coulomb_Nm = 1.0;
    p.load_angle[0] = {3, 2.0, 0.0};
    for (int k = 0; k < 90; k++) {
        Shaft shaft(p);
        shaft.x[Shaft::ANGLE] = 0.01 + 0.07 * k;
        shaft.settle();
        EXPECT_EQ(shaft.mech.stuck, std::fabs(2.0 * std::cos(3 * shaft.x[Shaft::ANGLE])) < 1.0) << k;
    }
    // Let go where the load is steepest it slides until friction has taken what the load gave.
    Shaft shaft(p);
    shaft.run(1.0, 1e-4);
    double end = shaft.x[Shaft::ANGLE];
    EXPECT_EQ(shaft.x[Shaft::SPEED], 0.0);
    EXPECT_TRUE(shaft.mech.stuck);
    EXPECT_LT(end, -0.5);
    EXPECT_NEAR(-2.0 / 3.0 * std::sin(3 * end), p.T_coulomb_Nm * -end, runge_kutta);
}

TEST(GivenSpeed, RampsLinearlyAgainstAnyTorque)
{
    Shaft shaft(compressor());
    shaft.mech.load_Nm = 5.0;
    shaft.torque = [](double t) { return 100.0 * std::sin(300.0 * t); };
    mechanics_impose(&shaft.mech, 10.0);
    shaft.mech.imposed_rate_rad_s2 = -50.0;
    for (int k = 1; k <= 40; k++) { // through zero; settled anew in every part
        shaft.run(0.01, 1e-3);
        EXPECT_NEAR(shaft.x[Shaft::SPEED], 10.0 - 0.5 * k, 1e-12);
    }
    EXPECT_NEAR(shaft.x[Shaft::ANGLE], 10.0 * 0.4 - 25.0 * 0.16, 1e-12);
    EXPECT_EQ(mechanics_rate(&shaft.mech, -10.0, 3.0), -50.0);
    shaft.mech.imposed_rate_rad_s2 = 0.0;
    shaft.run(0.1, 1e-3);
    EXPECT_NEAR(shaft.x[Shaft::SPEED], -10.0, 1e-12);
    mechanics_impose(&shaft.mech, 10.0); // as at the start
    shaft.mech.imposed_rate_rad_s2 = 20.0;
    shaft.run(0.1, 1e-3);
    EXPECT_NEAR(shaft.x[Shaft::SPEED], 12.0, 1e-12);
    shaft.mech.imposed = false;
    shaft.torque = [](double) { return 0.0; };
    shaft.settle();
    EXPECT_NEAR(shaft.x[Shaft::SPEED], 12.0, 1e-12);
    double theta = shaft.x[Shaft::ANGLE];
    double load = 5.0 + 1.5 * std::cos(theta + 0.3) + 0.4 * std::cos(2 * theta - 1.0);
    EXPECT_NEAR(shaft.rate(shaft.x, 0.0)[Shaft::SPEED], -load / 0.01, 1e-9);
}

TEST(GivenSpeed, CanBeGivenAnewDuringARamp)
{
    Shaft shaft(one_mass(0.01));
    mechanics_impose(&shaft.mech, 10.0);
    shaft.mech.imposed_rate_rad_s2 = 100.0;
    shaft.run(0.01);
    mechanics_impose(&shaft.mech, 10.0);
    shaft.run(0.01);
    EXPECT_NEAR(shaft.x[Shaft::SPEED], 11.0, 1e-12);
}

TEST(GivenSpeed, ReturnsAfterALock)
{
    for (double rate : {0.0, 100.0}) {
        Shaft shaft(one_mass(0.01));
        mechanics_impose(&shaft.mech, 10.0);
        shaft.mech.imposed_rate_rad_s2 = rate;
        shaft.settle();
        shaft.mech.parameters.locked = true;
        shaft.run(0.01);
        EXPECT_EQ(shaft.x[Shaft::SPEED], 0.0);
        shaft.mech.parameters.locked = false;
        shaft.run(0.01);
        EXPECT_NEAR(shaft.x[Shaft::SPEED], 10.0 + 0.01 * rate, 1e-12);
    }
}

TEST(GivenSpeed, FrictionTurnsWithItBeforeTheRelease)
{
    plant_mech_t p = one_mass(0.01);
    p.T_coulomb_Nm = 0.5;
    Shaft shaft(p);
    shaft.x[Shaft::SPEED] = 10.0;
    shaft.run(0.01);
    mechanics_impose(&shaft.mech, -10.0);
    shaft.run(0.01);
    shaft.mech.imposed = false;
    shaft.run(0.1);
    EXPECT_NEAR(shaft.x[Shaft::SPEED], -10.0 + 0.5 / 0.01 * 0.1, 1e-9);
}

TEST(PlainShaft, IsOneMassWhoseLoadNoAngleMoves)
{
    plant_mech_t plain = one_mass(0.01);
    plain.B_Nms = 0.02;
    plain.T_coulomb_Nm = 0.5;
    plain.load_angle[1] = {2, 0.0, 1.0};
    Shaft shaft(plain);
    EXPECT_TRUE(mechanics_plain(&shaft.mech));
    shaft.mech.load_Nm = 1.5;
    for (double omega : {-30.0, 0.0, 30.0}) {
        shaft.x[Shaft::SPEED] = omega;
        shaft.mech.slide = 0.0;
        shaft.settle();
        double sign = omega != 0.0 ? std::copysign(1.0, omega) : -1.0; // the load pulls it backwards
        double rate = (-1.5 - 0.5 * sign - 0.02 * omega) / 0.01;
        EXPECT_NEAR(mechanics_rate(&shaft.mech, omega, 0.0), rate, 1e-10);
        EXPECT_EQ(shaft.rate(shaft.x, 0.0)[Shaft::SPEED], mechanics_rate(&shaft.mech, omega, 0.0));
    }
    plant_mech_t fan = plain;
    fan.load_Nms = 0.1;
    fan.load_Nms2 = 0.03;
    for (double omega : {3.0, -3.0}) {
        Shaft turning(fan);
        ASSERT_TRUE(mechanics_plain(&turning.mech));
        turning.x[Shaft::SPEED] = omega;
        mechanics_motion_t motion = Shaft::motion(turning.x);
        mechanics_settle(&turning.mech, &motion, 0.0);
        double friction = turning.mech.slide * fan.T_coulomb_Nm;
        double rate = (0.7 - friction - (0.02 + 0.1) * omega - 0.03 * omega * std::fabs(omega)) / 0.01;
        EXPECT_NEAR(mechanics_rate(&turning.mech, omega, 0.7), rate, 1e-10);
        const double step = 1e-6; // of time: how the rate moves, by its difference
        double ahead = mechanics_rate(&turning.mech, omega + 5.0 * step, 0.7 + 2.0 * step);
        double behind = mechanics_rate(&turning.mech, omega - 5.0 * step, 0.7 - 2.0 * step);
        EXPECT_NEAR(mechanics_bend(&turning.mech, omega, 5.0, 2.0), (ahead - behind) / (2.0 * step), 1e-3);
    }
    plant_mech_t fan_on_a_shaft = two_masses();
    fan_on_a_shaft.load_Nms2 = 0.03;
    for (const plant_mech_t &p : {compressor(), two_masses(), fan_on_a_shaft}) {
        Shaft other(p);
        EXPECT_FALSE(mechanics_plain(&other.mech));
    }
}

// A machine without magnet takes no part: only the load moves the rotor.
plant_config_t idle_machine()
{
    plant_config_t c = rig::ipm_1000();
    c.machine.psi_m_Wb = 0.0;
    c.mech = one_mass(0.01);
    return c;
}

TEST(Mechanics, RunsDownAgainstViscousFriction)
{
    plant_config_t config = idle_machine();
    config.mech.B_Nms = 0.05; // time constant 0.2 s
    rig::Plant plant(config);
    plant_set_speed(plant, 100.0);
    plant.run(rig::all_off());
    plant_free_speed(plant);
    plant.run(rig::all_off(), 3000);
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(t.omega_mech_rad_s, 100.0 * std::exp(-0.3 / 0.2), closed_form * 100.0);
    double turned = 100.0 * 1e-4 + 100.0 * 0.2 * (1.0 - std::exp(-0.3 / 0.2));
    EXPECT_NEAR(t.theta_e_rad, 3 * turned, closed_form * 3 * turned);
}

TEST(Mechanics, LoadOpposesPositiveRotation)
{
    rig::Plant plant(idle_machine());
    plant_set_load(plant, 2.0);
    plant.run(rig::all_off(), 1000);
    EXPECT_NEAR(plant.truth().omega_mech_rad_s, -2.0 / 0.01 * 0.1, closed_form * 20.0);
}

TEST(Mechanics, DryFrictionHoldsTheRotorExactly)
{
    plant_config_t config = idle_machine();
    config.mech.T_coulomb_Nm = 0.5;
    rig::Plant plant(config, 0.7);
    for (double load : {0.49, -0.499, 0.5}) {
        plant_set_load(plant, load);
        plant.run(rig::all_off(), 1000);
        EXPECT_EQ(plant.truth().omega_mech_rad_s, 0.0);
        EXPECT_EQ(plant.truth().theta_e_rad, 0.7);
    }
    plant_set_load(plant, 0.6); // breaks away: 0.1 N m are left to accelerate
    plant.run(rig::all_off(), 1000);
    EXPECT_NEAR(plant.truth().omega_mech_rad_s, -0.1 / 0.01 * 0.1, closed_form);
}

TEST(Mechanics, DryFrictionStopsTheRotorInFiniteTimeAndForGood)
{
    plant_config_t config = idle_machine();
    config.mech.T_coulomb_Nm = 0.5;
    rig::Plant plant(config);
    plant_set_speed(plant, 10.0);
    plant.run(rig::all_off());
    plant_free_speed(plant);
    plant.run(rig::all_off(), 1999); // stops after J omega / T = 0.2 s
    EXPECT_GT(plant.truth().omega_mech_rad_s, 0.0);
    plant.run(rig::all_off(), 2);
    EXPECT_EQ(plant.truth().omega_mech_rad_s, 0.0);
    double theta = plant.truth().theta_e_rad;
    EXPECT_NEAR(theta, 3 * (10.0 * 1e-4 + 0.5 * 10.0 * 0.2), 1e-5);
    plant.run(rig::all_off(), 1000);
    EXPECT_EQ(plant.truth().theta_e_rad, theta);
}

TEST(Mechanics, DryFrictionTurnsWithTheSpeed)
{
    plant_config_t config = idle_machine();
    config.mech.T_coulomb_Nm = 0.5;
    rig::Plant plant(config);
    plant_set_speed(plant, 10.0);
    plant.run(rig::all_off());
    plant_free_speed(plant);
    plant_set_load(plant, 1.5); // 200 rad/s^2 against, 10 rad/s: 0.05 s; then 100 rad/s^2 backwards
    plant.run(rig::all_off(), 1500);
    EXPECT_NEAR(plant.truth().omega_mech_rad_s, -100.0 * 0.1, 1e-5);
}

// The torque pulses of a PWM-fed motor at the edge of breaking away: no chatter, no creep backwards.
TEST(Mechanics, StickingUnderPulsatingTorque)
{
    plant_config_t config = rig::ipm_1000_real();
    config.mech.T_coulomb_Nm = 1.0;
    rig::Plant plant(config, -rig::pi / 2); // current along phase A is q current
    rig::CurrentControl control(config);
    double theta = plant.truth().theta_e_rad;
    for (int k = 0; k < 1000; k++) {
        plant.run(control.step(plant.truth(), 0.0, 0.9));
    }
    EXPECT_EQ(plant.truth().theta_e_rad, theta) << "0.9 A make less than the friction torque";
    for (int k = 0; k < 3000; k++) {
        plant.run(control.step(plant.truth(), 0.0, 2.0));
    }
    EXPECT_GT(plant.truth().omega_mech_rad_s, 10.0);
}

TEST(Mechanics, LockedRotorRestsAndImposedSpeedHolds)
{
    plant_config_t config = rig::ipm_1000_real();
    config.mech.locked = true;
    rig::Plant plant(config, 1.0);
    plant_set_load(plant, 5.0);
    plant.run(rig::pwm(0.5, 0.6, 0.5), 100);
    EXPECT_EQ(plant.truth().theta_e_rad, 1.0);
    EXPECT_GT(std::fabs(plant.truth().torque_Nm), 0.1);
    plant_set_locked(plant, false);
    plant_set_speed(plant, -20.0);
    plant.run(rig::pwm(0.5, 0.6, 0.5), 100);
    EXPECT_EQ(plant.truth().omega_mech_rad_s, -20.0);
    EXPECT_NEAR(plant.truth().theta_e_rad, 1.0 - 20.0 * 3 * 0.01, 1e-12);
}

// Both masses start at rest and the load pulls on the second: the common fall and the ringing add up.
TEST(Mechanics, TwoMassesInThePlant)
{
    plant_config_t config = idle_machine();
    config.mech = two_masses();
    rig::Plant plant(config);
    plant_set_load(plant, 2.0);
    double sum = 0.01 + 0.03, omega = std::sqrt(200.0 * (1.0 / 0.01 + 1.0 / 0.03));
    for (int k = 1; k <= 20; k++) {
        plant.run(rig::all_off(), 50);
        double t = 5e-3 * k;
        double slip = 2.0 / (0.03 * omega) * std::sin(omega * t); // of the rotor against the load
        plant_truth_t truth = plant.truth();
        EXPECT_NEAR(truth.omega_mech_rad_s, -2.0 / sum * t + 0.03 / sum * slip, 10 * closed_form);
        EXPECT_NEAR(truth.omega_load_rad_s, -2.0 / sum * t - 0.01 / sum * slip, 10 * closed_form);
    }
}

TEST(Mechanics, ImposedRampInThePlant)
{
    rig::Plant plant(rig::ipm_1000());
    const double v_leg_V[PLANT_LEGS] = {20.0, -10.0, -10.0};
    plant_set_speed(plant, 10.0);
    plant_run_voltages(plant, v_leg_V, 1000.0, 0.0102); // over many parts of the plant's own
    EXPECT_NEAR(plant.truth().omega_mech_rad_s, 20.2, 1e-12);
    EXPECT_NEAR(plant.truth().theta_e_rad, 3 * (10.0 * 0.0102 + 500.0 * 0.0102 * 0.0102), 1e-12);
    plant_run_voltages(plant, v_leg_V, 0.0, 0.01);
    EXPECT_NEAR(plant.truth().omega_mech_rad_s, 20.2, 1e-12) << "holds";
    plant_set_speed(plant, 10.0);
    plant_run_voltages(plant, v_leg_V, -1000.0, 0.005);
    EXPECT_NEAR(plant.truth().omega_mech_rad_s, 5.0, 1e-12) << "starts where it is told to";
}

// Between two errors of the integrator, one that feeds an oscillation is the worse: an undamped shaft between
// two free masses keeps its amplitude, whatever method takes the steps.
TEST(Mechanics, UndampedShaftKeepsItsAmplitude)
{
    plant_config_t config = rig::spm_400_linear();
    config.machine = {0.05, 1e-3, 1e-3, 0.0, 1e-5, 1};
    config.mech.J_kgm2 = 1e-4;
    config.mech.B_Nms = 0.0;
    config.mech.J_load_kgm2 = 1e-3;
    config.mech.k_shaft_Nm = 1e4; // 10500 rad/s
    rig::Plant plant(config);
    plant_set_load(plant, 100.0);
    plant.run(rig::pwm(0.5, 0.5, 0.5));
    plant_set_load(plant, 0.0);
    double early = 0.0, late = 0.0;
    for (int k = 0; k < 5000; k++) {
        plant.run(rig::pwm(0.5, 0.5, 0.5));
        plant_truth_t t = plant.truth();
        double twisting = std::fabs(t.omega_mech_rad_s - t.omega_load_rad_s);
        early = k < 500 ? std::fmax(early, twisting) : early;
        late = k >= 4500 ? std::fmax(late, twisting) : late;
    }
    EXPECT_GT(early, 5.0);
    EXPECT_NEAR(late, early, 0.03 * early); // 800 oscillations
}

} // namespace
