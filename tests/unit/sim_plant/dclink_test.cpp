// dclink.h: ripple, chopper and lost supply against closed forms, with an integrator of the test's own;
// charging, blocking source and the balance with the legs through the plant.
#include "sim_plant/dclink.h"

#include "rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace
{

// Runge-Kutta of fourth order with 1000 steps or more in every time constant, relative to 300 V.
constexpr double runge_kutta = 1e-9;
// Closed form against the plant's integrator of 1e-6 local error over five time constants.
constexpr double closed_form = 2e-6;
// The same over seven chopper cycles: the slow approach to the upper threshold turns an error of voltage into
// one of time, which shows six times larger on the steep fall.
constexpr double crossings = 7 * 6 * closed_form;
// Two integrals of one trajectory, both of third order.
constexpr double balance = 1e-5;

constexpr double C = 500e-6, R = 2.0; // 1 ms

plant_dclink_t rc_link()
{
    plant_dclink_t p{};
    p.v_source_V = 300.0;
    p.r_source_ohm = R;
    p.c_F = C;
    return p;
}

// The braking motor of these tests pushes 5 A into a link of 300 V; the resistor takes it down to 100 V.
plant_dclink_t chopper_link()
{
    plant_dclink_t p = rc_link();
    p.source_blocks = true;
    p.r_chopper_ohm = 20.0;
    p.v_chopper_on_V = 380.0;
    p.v_chopper_off_V = 360.0;
    return p;
}

// Integrates the link under a constant current of the legs; toggles of the chopper are found by bisection.
struct Link {
    dclink_t link{};
    double v, i_dc = 0.0, t = 0.0;
    double burnt_J = 0.0, toggled_s = 0.0;
    int toggles = 0;

    explicit Link(const plant_dclink_t &p) : v(p.v_source_V)
    {
        dclink_init(&link, &p);
    }

    double rate(double at_V, double at_s) const
    {
        return dclink_rate(&link, at_V, i_dc, at_s);
    }

    double step(double h, double *burnt = nullptr) const
    {
        double k1 = rate(v, t), k2 = rate(v + h / 2 * k1, t + h / 2);
        double k3 = rate(v + h / 2 * k2, t + h / 2), k4 = rate(v + h * k3, t + h);
        double end = v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        if (burnt != nullptr) { // Simpson, with the middle of the cubic through both ends
            double mid = (v + end) / 2 + h / 8 * (k1 - rate(end, t + h));
            auto heat = [this](double at_V) { return at_V * dclink_chopper_A(&link, at_V); };
            *burnt += h / 6 * (heat(v) + 4 * heat(mid) + heat(end));
        }
        return end;
    }

    void run(double duration, double h_max = 1e-6)
    {
        for (double end_s = t + duration; t < end_s - 1e-13;) {
            double h = std::fmin(h_max, end_s - t);
            bool toggle = dclink_excess(&link, step(h)) > 0.0;
            for (double early = 0.0; toggle && h - early > 1e-16;) {
                double mid = 0.5 * (early + h);
                (dclink_excess(&link, step(mid)) > 0.0 ? h : early) = mid;
            }
            v = step(h, &burnt_J);
            t += h;
            toggled_s = toggle ? t : toggled_s;
            toggles += toggle;
            if (toggles > 1000) {
                throw std::runtime_error("the chopper chatters");
            }
            dclink_settle(&link, v);
        }
    }
};

TEST(Link, RippleOfTheSourcePassesTheLowPass)
{
    plant_dclink_t p = rc_link();
    p.ripple_V = 30.0;
    p.ripple_Hz = 300.0;
    Link link(p);
    EXPECT_FALSE(dclink_plain(&link.link));
    link.i_dc = 4.0;
    link.run(25e-3); // the start is forgotten to 1e-11
    double omega = 2 * rig::pi * p.ripple_Hz;
    double amplitude = 30.0 / std::sqrt(1.0 + std::pow(omega * R * C, 2)); // 14.1 V
    double lag = std::atan(omega * R * C);                                 // 62 degrees
    for (int k = 0; k < 50; k++) {
        link.run(0.1e-3);
        double v = 300.0 - R * 4.0 + amplitude * std::sin(omega * link.t - lag);
        EXPECT_NEAR(link.v, v, 300.0 * runge_kutta);
        double source = (300.0 + 30.0 * std::sin(omega * link.t) - v) / R;
        EXPECT_NEAR(dclink_source_A(&link.link, link.v, link.t), source, 300.0 * runge_kutta);
    }
}

// Rise by the constant current, fall towards 100 V with R_chopper C: every instant has a closed form.
TEST(Link, ChopperBurnsTheBrakingEnergyInCycles)
{
    plant_dclink_t p = chopper_link();
    Link link(p);
    link.i_dc = -5.0;
    double tau = p.r_chopper_ohm * C, end_V = 5.0 * p.r_chopper_ohm;
    double start_s = C * 80.0 / 5.0, rise_s = C * 20.0 / 5.0;
    double fall_s = tau * std::log((380.0 - end_V) / (360.0 - end_V));
    link.run(start_s - 1e-6);
    EXPECT_FALSE(link.link.chopping);
    EXPECT_EQ(link.burnt_J, 0.0);
    double expected_s = start_s;
    for (int k = 0; k < 21; k++) { // on at even ones
        link.run(expected_s + 1e-6 - link.t);
        ASSERT_EQ(link.toggles, k + 1);
        EXPECT_NEAR(link.toggled_s, expected_s, runge_kutta * expected_s);
        EXPECT_EQ(link.link.chopping, k % 2 == 0);
        expected_s += k % 2 == 0 ? fall_s : rise_s;
    }
    // a fall burns the integral of v^2 / R_chopper with v = end + drop exp(-t / tau)
    double drop = 380.0 - end_V, left = 360.0 - end_V;
    double heat_J =
        (end_V * end_V * fall_s + 2 * end_V * tau * (drop - left) + tau / 2 * (drop * drop - left * left)) /
        p.r_chopper_ohm;
    double burnt_before = link.burnt_J;
    link.run(fall_s + rise_s);
    EXPECT_NEAR(link.burnt_J - burnt_before, heat_J, 10 * runge_kutta * heat_J);
}

TEST(Link, ChopperHasHysteresis)
{
    dclink_t link;
    plant_dclink_t p = chopper_link();
    dclink_init(&link, &p);
    EXPECT_FALSE(dclink_plain(&link));
    struct {
        double v;
        bool on;
    } path[] = {{300, false},  {370, false},   {379.9, false}, {380.1, true},  {400, true},   {370, true},
                {360.1, true}, {359.9, false}, {370, false},   {379.9, false}, {380.1, true}, {0, false}};
    for (auto point : path) {
        EXPECT_EQ(dclink_excess(&link, point.v) > 0.0, link.chopping != point.on) << point.v;
        dclink_settle(&link, point.v);
        EXPECT_EQ(link.chopping, point.on) << point.v;
        EXPECT_EQ(dclink_chopper_A(&link, point.v), point.on ? point.v / 20.0 : 0.0);
        EXPECT_LT(dclink_excess(&link, point.v), 0.0) << "settled";
    }
    EXPECT_NEAR(dclink_excess(&link, 380.0 * 1.01), 0.01, 1e-12) << "relative to the threshold";
}

TEST(Link, NothingToWatchWithoutRippleAndChopper)
{
    plant_dclink_t p = rc_link();
    Link link(p);
    EXPECT_TRUE(dclink_plain(&link.link));
    EXPECT_LT(dclink_excess(&link.link, 1e6), 0.0);
    dclink_settle(&link.link, 1e6);
    EXPECT_EQ(dclink_chopper_A(&link.link, 1e6), 0.0);
    EXPECT_EQ(dclink_rate(&link.link, 290.0, 1.0, 0.0), dclink_rate(&link.link, 290.0, 1.0, 0.123));
    EXPECT_NEAR(dclink_rate(&link.link, 290.0, 1.0, 0.0), (10.0 / R - 1.0) / C, 1e-9);
}

TEST(Link, LostSupplyRunsOnItsCapacitor)
{
    plant_dclink_t p = rc_link();
    p.ripple_V = 30.0;
    p.ripple_Hz = 300.0;
    Link link(p);
    link.link.connected = false;
    link.i_dc = 3.0;
    link.run(20e-3);
    EXPECT_NEAR(link.v, 300.0 - 3.0 * 20e-3 / C, 300.0 * runge_kutta) << "the charge drawn";
    EXPECT_EQ(dclink_source_A(&link.link, link.v, link.t), 0.0);
    link.run(40e-3); // would take it to -60 V
    EXPECT_GT(link.v, -1e-2) << "one step of 6 mV beyond zero at most";
    EXPECT_LE(link.v, 0.0);
    EXPECT_EQ(link.rate(link.v, link.t), 0.0);
    link.link.connected = true;
    link.i_dc = 0.0;
    link.run(30e-3);
    double omega = 2 * rig::pi * p.ripple_Hz;
    double ripple = 30.0 / std::sqrt(1.0 + std::pow(omega * R * C, 2)) *
                    std::sin(omega * link.t - std::atan(omega * R * C));
    EXPECT_NEAR(link.v, 300.0 + ripple, 300.0 * runge_kutta) << "comes back";
}

// A rectifier with ripple charges at the crests only and gives nothing in between.
TEST(Link, BlockingSourceWithRippleHoldsTheCrest)
{
    plant_dclink_t p = rc_link();
    p.ripple_V = 30.0;
    p.ripple_Hz = 300.0;
    p.source_blocks = true;
    Link link(p);
    for (int k = 0; k < 200; k++) {
        double before = link.v;
        link.run(0.1e-3);
        EXPECT_GE(link.v, before);
        EXPECT_GE(dclink_source_A(&link.link, link.v, link.t), 0.0);
    }
    EXPECT_GT(link.v, 325.0);
    EXPECT_LT(link.v, 330.0);
}

TEST(Link, StiffLinkIsTheSourceWhateverElseIsSet)
{
    plant_dclink_t p = chopper_link();
    p.c_F = 0.0;
    p.ripple_V = 30.0;
    p.ripple_Hz = 300.0;
    Link link(p);
    link.i_dc = 1e3;
    EXPECT_TRUE(dclink_plain(&link.link));
    EXPECT_EQ(link.rate(300.0, 0.0), 0.0);
    EXPECT_EQ(dclink_source_A(&link.link, 300.0, 0.0), 0.0);
}

plant_config_t with_link()
{
    plant_config_t c = rig::ipm_1000();
    c.dclink = rc_link();
    return c;
}

TEST(DcLink, FollowsAStepOfTheSource)
{
    rig::Plant plant(with_link());
    EXPECT_EQ(plant.truth().v_dc_V, 300.0);
    plant_set_source(plant, 200.0);
    for (int k = 1; k <= 50; k++) {
        plant.run(rig::all_off());
        EXPECT_NEAR(plant.truth().v_dc_V, 200.0 + 100.0 * std::exp(-0.1 * k), closed_form * 300.0);
    }
}

TEST(DcLink, IsStiffWithoutCapacitor)
{
    rig::Plant plant(rig::ipm_1000());
    plant_set_source(plant, 200.0);
    EXPECT_EQ(plant.truth().v_dc_V, 200.0);
    plant.run(rig::pwm(0.6, 0.5, 0.4), 10);
    EXPECT_EQ(plant.truth().v_dc_V, 200.0);
}

TEST(DcLink, BlockingSourceTakesNothingBack)
{
    plant_config_t config = with_link();
    config.dclink.source_blocks = true;
    rig::Plant plant(config);
    plant_set_source(plant, 200.0);
    plant.run(rig::all_off(), 100);
    EXPECT_EQ(plant.truth().v_dc_V, 300.0);
    plant_set_source(plant, 310.0);
    plant.run(rig::all_off(), 100);
    EXPECT_NEAR(plant.truth().v_dc_V, 310.0 - 10.0 * std::exp(-10.0), closed_form * 300.0);
}

// A braking motor lifts a link that nothing discharges by exactly what the legs give back.
TEST(DcLink, RisesByTheEnergyOfABrakingMotor)
{
    plant_config_t config = rig::ipm_1000_real();
    config.dclink.c_F = 2e-3;
    config.dclink.source_blocks = true;
    rig::Plant plant(config);
    plant_set_speed(plant, 100.0);
    rig::CurrentControl control(config);
    for (int k = 0; k < 200; k++) {
        plant.run(control.step(plant.truth(), 0.0, -1.5));
    }
    plant_truth_t a = plant.truth();
    ASSERT_GT(a.v_dc_V, 300.0);
    for (int k = 0; k < 1000; k++) {
        plant.run(control.step(plant.truth(), 0.0, -1.5));
    }
    plant_truth_t b = plant.truth();
    double stored_J = 0.5 * 2e-3 * (b.v_dc_V * b.v_dc_V - a.v_dc_V * a.v_dc_V);
    EXPECT_GT(stored_J, 1.0);
    EXPECT_NEAR(stored_J, a.e_in_J - b.e_in_J, balance * stored_J);
}

TEST(DcLink, SagsUnderLoadByItsResistance)
{
    plant_config_t config = rig::ipm_1000_real();
    rig::Plant plant(config);
    plant_set_speed(plant, 100.0);
    rig::CurrentControl control(config);
    for (int k = 0; k < 500; k++) {
        plant.run(control.step(plant.truth(), 0.0, 4.0));
    }
    plant_truth_t a = plant.truth();
    double charge = 0.0; // of the source, from its own voltage drop, trapezoidal over the periods
    double before_V = a.v_dc_V;
    for (int k = 0; k < 1000; k++) {
        plant.run(control.step(plant.truth(), 0.0, 4.0));
        double now_V = plant.truth().v_dc_V;
        charge += 1e-4 * (300.0 - 0.5 * (before_V + now_V)) / config.dclink.r_source_ohm;
        before_V = now_V;
    }
    plant_truth_t b = plant.truth();
    // power of the legs at nearly constant voltage is what the source delivers; ripple is the rest
    EXPECT_NEAR(charge * 0.5 * (a.v_dc_V + b.v_dc_V), b.e_in_J - a.e_in_J, 0.01 * (b.e_in_J - a.e_in_J));
}

TEST(DcLink, EmptiesToZeroAndNotBelow)
{
    plant_config_t config = rig::ipm_1000_real();
    config.dclink = rc_link();
    config.dclink.v_source_V = 30.0;
    config.dclink.r_source_ohm = 1.0;
    config.dclink.c_F = 20e-6;
    config.dclink.source_blocks = true;
    rig::Plant plant(config);
    plant.run(rig::pwm(1, 0, 0), 50);
    plant_set_source(plant, 0.0);
    for (int k = 0; k < 200; k++) {
        plant.run(rig::pwm(1, 0, 0));
        ASSERT_GE(plant.truth().v_dc_V, -1e-3);
    }
    EXPECT_NEAR(plant.truth().v_dc_V, 0.0, 1e-3);
}

// The capacitor loses in charge what the legs draw; their energy says how much that was.
TEST(DcLink, LostSupplyFeedsTheMotorFromTheCapacitor)
{
    plant_config_t config = rig::ipm_1000_real();
    rig::Plant plant(config);
    plant.run(rig::pwm(0.6, 0.5, 0.4), 20);
    plant_truth_t a = plant.truth();
    plant_set_supply(plant, false);
    plant.run(rig::pwm(0.6, 0.5, 0.4), 300);
    plant_truth_t b = plant.truth();
    double taken_J = 0.5 * config.dclink.c_F * (a.v_dc_V * a.v_dc_V - b.v_dc_V * b.v_dc_V);
    EXPECT_LT(b.v_dc_V, 290.0);
    EXPECT_NEAR(taken_J, b.e_in_J - a.e_in_J, balance * taken_J);
}

// The cycles of the chopper as above, with the plant's integrator finding the thresholds: no motor takes
// part.
TEST(DcLink, ChopperCyclesInThePlant)
{
    plant_config_t config = with_link();
    config.dclink = chopper_link();
    config.dclink.v_source_V = 385.0; // feeds the resistor through R: 350 V on, 385 V off
    rig::Plant plant(config);
    double on_tau = C / (1.0 / R + 1.0 / 20.0), on_end = 385.0 * 20.0 / (20.0 + R);
    double fall_s = on_tau * std::log((380.0 - on_end) / (360.0 - on_end));
    double first_fall_s = on_tau * std::log((385.0 - on_end) / (360.0 - on_end));
    double rise_s = R * C * std::log((385.0 - 360.0) / (385.0 - 380.0));
    for (int k = 1; k <= 200; k++) {
        plant.run(rig::all_off());
        double t = 1e-4 * k, v = 0.0;
        if (t < first_fall_s) {
            v = on_end + (385.0 - on_end) * std::exp(-t / on_tau);
        } else if (t = std::fmod(t - first_fall_s, rise_s + fall_s); t < rise_s) {
            v = 385.0 - 25.0 * std::exp(-t / (R * C));
        } else {
            v = on_end + (380.0 - on_end) * std::exp(-(t - rise_s) / on_tau);
        }
        EXPECT_NEAR(plant.truth().v_dc_V, v, crossings * 385.0) << k;
    }
}

TEST(DcLink, RippleInThePlant)
{
    plant_config_t config = with_link();
    config.dclink.ripple_V = 30.0;
    config.dclink.ripple_Hz = 300.0;
    rig::Plant plant(config);
    plant.run(rig::all_off(), 200);
    double omega = 2 * rig::pi * 300.0;
    double amplitude = 30.0 / std::sqrt(1.0 + std::pow(omega * R * C, 2));
    for (int k = 201; k <= 250; k++) {
        plant.run(rig::all_off());
        double v = 300.0 + amplitude * std::sin(omega * 1e-4 * k - std::atan(omega * R * C));
        EXPECT_NEAR(plant.truth().v_dc_V, v, closed_form * 300.0);
    }
}

} // namespace
