// two_sets.h, second_bridge.h: two sets of windings as one machine and its difference, against double precision and an R, L - M
// circuit; and the drive with them on the plant of DTP-400.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "firmware/drive/drive_parts.h"
#include "firmware/drive/second_bridge.h"
#include "hal/sim/sim_loop.h"
#include "tests/contract/bench.h"
#include "tests/unit/math/samples.h"
#include "tools/pmsim/machine_file.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::kJ;
using bench::kPi;
using bench::real;

const Complex kOn = std::polar(1.0, kPi / 6); // the second set lies so far on
// Products and halves round towards one side, to 2^-28.
constexpr double kLsb = 8 / double(PM_ONE);
constexpr double kTorque_Nm = 5.71; // rated, of both sets at 5.2 A

pmsim::Setup machine()
{
    pmsim::Setup setup = pmsim::load_machine_file("sim_plant/machines/dtp_400.yaml");
    pmsim::derive_board_parameters(setup);
    return setup;
}

drive_params_t params()
{
    static const drive_params_t p = *machine().params;
    return p;
}

double value(pm_num_t x)
{
    return std::ldexp(x.m, x.e);
}

drive_config_t configured(const drive_params_t &p)
{
    drive_config_t c = {};
    const drive_result_t result = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_TRUE(result.ok) << drive_param_table[result.param].name << ": " << result.reason;
    return c;
}

// Legs that lose nothing.
drive_params_t ideal()
{
    drive_params_t p = params();
    p.dead_time = p.device_drop = p.leg_capacitance = 0;
    return p;
}

// Amplitude-invariant, of what stands at 0, 120, 240 degrees.
Complex clarke(const std::array<double, 3> &x)
{
    const Complex turn = std::polar(1.0, 2 * kPi / 3);
    return 2.0 / 3 * (x[0] + x[1] * turn + x[2] * turn * turn);
}

struct Sets {
    drive_config_t c;
    two_sets_t self = {};
    modulator_t modulator = {};
    bridges_t out = {};
    pm_q_t v_dc;

    explicit Sets(const drive_params_t &p, double v_dc_pu = 2.0 / 3)
        : c(configured(p)), v_dc(fixed(v_dc_pu, 28))
    {
        two_sets_reset(&self, &c.two_sets);
        modulator_slow(&modulator, &c.modulator, v_dc, {}, {});
        EXPECT_EQ(c.modulator.ripple, 0);
    }

    void step(Complex v, Complex i, double ahead_rad = 0, double omega_pu = 0)
    {
        const two_sets_in_t in = {
            bench::ab(v),
            bench::ab(i / 4.0),
            {0, 0},
            {fixed(std::cos(ahead_rad), 30), fixed(std::sin(ahead_rad), 30)},
            fixed(omega_pu, 28),
            v_dc,
            0,
        };
        two_sets_step(&self, &c.two_sets, &modulator, &c.modulator, &in, &out);
    }

    // In the axes of the machine.
    Complex legs(int bridge) const
    {
        std::array<double, 3> v = {};
        for (size_t n = 0; n < v.size(); ++n) {
            v[n] = out.bridge[bridge].on[n] / double(c.modulator.counts) * real(v_dc);
        }
        return clarke(v) * (bridge == 0 ? 1.0 : kOn);
    }

    double count() const // of all legs, the largest vector
    {
        return 4.0 / 3 * real(v_dc) / c.modulator.counts;
    }

    // What the regulator of z is about to answer, in the axes of the machine.
    Complex answer(double ahead_rad, double omega_pu) const
    {
        synchronous_pi_t regulator = self.regulator;
        const Complex frame = std::polar(1.0, ahead_rad);
        regulator_in_t in = {};
        in.i = bench::dq(bench::complex(self.z) / frame);
        in.omega = fixed(omega_pu, 28);
        in.v_max = v_dc / 8;
        regulator_out_t u = {};
        synchronous_pi_step(&regulator, &c.two_sets.regulator, &in, &u);
        return Complex{real(u.v.d, PM_WIDE_BITS), real(u.v.q, PM_WIDE_BITS)} * frame;
    }
};

TEST(TwoSets, MeanAndHalfDifferenceAreThoseOfTheCurrents)
{
    samples::Random random;
    Sets x(params());
    for (int n = 0; n < 5000; ++n) {
        uint16_t code[PM_LEGS];
        std::array<double, 3> leg = {};
        for (size_t k = 0; k < leg.size(); ++k) {
            x.self.zero[k] = fixed(random.within(0.97, 1.03), 28);
            code[k] = static_cast<uint16_t>(random.within(6000, 59000));
            leg[k] = code[k] / 32768.0 - real(x.self.zero[k]);
        }
        const Complex i_1 = std::polar(random.within(0, 0.8), random.within(-4, 4)), i_2 = clarke(leg) * kOn;
        const Complex mean = bench::complex(two_sets_measure(&x.self, code, bench::ab(i_1)));
        ASSERT_LT(std::abs(mean - (i_1 + i_2) / 2.0), kLsb) << n;
        ASSERT_LT(std::abs(bench::complex(x.self.z) - (i_1 - i_2) / 2.0), kLsb) << n;
        ASSERT_NEAR(real(x.self.i.b), leg[1], kLsb);
    }
}

// Each set in its own frame: v + v_z, and v - v_z 30 degrees back.
TEST(TwoSets, TheLegsGiveEachSetItsVoltage)
{
    samples::Random random;
    for (int n = 0; n < 2000; ++n) {
        Sets x(ideal());
        const Complex v = std::polar(random.within(0, 0.25), random.within(-4, 4));
        const double ahead = random.within(-4, 4), omega = random.within(-0.6, 0.6);
        x.self.z = bench::ab(std::polar(random.within(0, 0.05), random.within(-4, 4)));
        const Complex v_z = x.answer(ahead, omega);
        x.step(v, 0, ahead, omega);
        EXPECT_LT(std::abs(x.legs(0) - (v + v_z)), x.count()) << n;
        EXPECT_LT(std::abs(x.legs(1) - (v - v_z)), x.count()) << n;
        EXPECT_LT(std::abs(bench::complex(x.out.v) - v), 4 * kLsb) << n;
    }
}

// Dead time of a leg whose current is beyond the zone: T_dt / T_s of the counts, with the sign of the set's own current.
TEST(TwoSets, EachLegIsCompensatedByItsOwnCurrent)
{
    samples::Random random;
    drive_params_t lossy = ideal();
    lossy.dead_time = params().dead_time;
    Sets with(lossy), without(ideal());
    const double lost = lossy.dead_time * 1e-9 * lossy.f_pwm * with.c.modulator.counts;
    ASSERT_GT(lost, 50);
    int opposite = 0;
    for (int n = 0; n < 500; ++n) {
        const Complex i_1 = std::polar(0.4, random.within(-4, 4)),
                      i_2 = std::polar(0.4, random.within(-4, 4));
        for (Sets *x : {&with, &without}) {
            two_sets_reset(&x->self, &x->c.two_sets);
            x->self.z = bench::ab((i_1 - i_2) / 2.0);
            x->step(std::polar(0.1, 0.3), (i_1 + i_2) / 2.0);
        }
        for (int bridge = 0; bridge < 2; ++bridge) {
            for (int leg = 0; leg < 3; ++leg) {
                const Complex own = bridge == 0 ? i_1 : i_2 / kOn;
                const double i = (own * std::polar(1.0, -leg * 2 * kPi / 3)).real();
                const double mean =
                    ((i_1 + i_2) / 2.0 / (bridge == 0 ? 1.0 : kOn) * std::polar(1.0, -leg * 2 * kPi / 3))
                        .real();
                if (std::fabs(i) > 0.1) {
                    const int more = with.out.bridge[bridge].on[leg] - without.out.bridge[bridge].on[leg];
                    EXPECT_NEAR(more, std::copysign(lost, i), 2) << n << ' ' << bridge << ' ' << leg;
                    opposite += mean * i < 0 ? 1 : 0;
                }
            }
        }
    }
    EXPECT_GT(opposite, 300); // the mean would have said otherwise
}

TEST(TwoSets, WhatActsIsTheMeanOfBothAlsoWhereOneIsShortened)
{
    samples::Random random;
    int one = 0, both = 0;
    for (int n = 0; n < 2000; ++n) {
        Sets x(ideal());
        const Complex v = std::polar(random.within(0.3, 0.5), random.within(-4, 4));
        x.self.z = bench::ab(std::polar(0.5, random.within(-4, 4))); // its voltage is at its limit
        const Complex v_z = x.answer(0, 0);
        ASSERT_NEAR(std::abs(v_z), real(x.v_dc) / 8, 1e-3);
        x.step(v, 0);
        EXPECT_LT(std::abs(bench::complex(x.out.v) - (x.legs(0) + x.legs(1)) / 2.0), x.count()) << n;
        const bool first = std::abs(x.legs(0) - (v + v_z)) > 2 * x.count(),
                   second = std::abs(x.legs(1) - (v - v_z)) > 2 * x.count();
        one += first != second ? 1 : 0;
        both += first && second ? 1 : 0;
        if (first || second) {
            EXPECT_NE(x.modulator.limited, 0) << n;
            EXPECT_GT(std::abs(bench::complex(x.out.v) - v), x.count() / 2) << n;
        }
    }
    EXPECT_GT(one, 200);
    EXPECT_GT(both, 20);
}

// R and L - M of half the difference, told and true, with what drives it: z' = (v_z - e - R z) / (L - M). The voltage of step k acts
// over the period that follows the coming one.
struct Difference {
    static constexpr double kL_H = 3.8e-3, kM_H = 0.9e-3;
    Sets x;
    double T_s = 1e-4, R, L, a, b; // per-unit of voltage and current, seconds
    Complex z = 0, acting = 0;

    static drive_params_t told()
    {
        drive_params_t p = ideal();
        p.L_d = p.L_q = p.L_q_rated = p.L_dh_rated = p.L_qh_rated = static_cast<int32_t>(kL_H * 1e9);
        p.L_dqh_rated = 0;
        p.cross_half = 0;
        p.M_d = p.M_q = static_cast<int32_t>(kM_H * 1e9);
        return p;
    }

    Difference() : x(told())
    {
        const double base_ohm = value(x.c.base.v) / value(x.c.base.i);
        R = params().R_s * 1e-6 / base_ohm;
        L = (kL_H - 2 * kM_H) / base_ohm;
        a = std::exp(-R * T_s / L);
        b = (1 - a) / R;
    }

    void period(Complex e, double ahead_rad = 0, double omega_rad_s = 0)
    {
        x.self.z = bench::ab(z);
        x.step(0, 0, ahead_rad, omega_rad_s / value(x.c.base.omega));
        z = a * z + b * (acting - e);
        acting = (bench::complex(x.out.bridge[0].v) - bench::complex(x.out.bridge[1].v) * kOn) / 2.0;
    }
};

// z e^{-j phi} of a disturbance e^{j w t} in the frame, phi = omega t: with K = -(kp + ki / (q - 1)) + j omega L, q = e^{j w T},
//   (q e^{j omega T} - a - b K e^{-j omega T} / q) Z = -b E
Complex answer(const Difference &d, double omega, double w)
{
    const double bandwidth = 2 * kPi * params().current_bandwidth * 1e-3;
    const Complex q = std::polar(1.0, w * d.T_s), turn = std::polar(1.0, omega * d.T_s);
    const Complex K = -(bandwidth * d.L + bandwidth * d.R * d.T_s / (q - 1.0)) + kJ * omega * d.L;
    return -d.b / (q * turn - d.a - d.b * K / turn / q);
}

TEST(TwoSets, ADisturbanceOfSixTimesTheSpeedIsSeenByItsFormula)
{
    constexpr double kE = 0.01, kTolerance = 0.01;
    for (const double omega : {50.0, 209.0, -209.0}) {
        for (const double order : {6.0, -6.0}) {
            Difference d;
            const double w = order * omega;
            const Complex expected = kE * answer(d, omega, w);
            double worst = 0;
            for (int k = 0; k < 3000; ++k) {
                // the frame is that of the middle of where the voltage acts; the disturbance, of where it is measured
                const double phi = omega * k * d.T_s;
                if (k > 2500) {
                    const Complex at = expected * std::polar(1.0, phi + w * k * d.T_s);
                    worst = std::max(worst, std::abs(d.z - at));
                }
                d.period(kE * std::polar(1.0, phi + w * k * d.T_s), phi, omega);
            }
            EXPECT_LT(worst, kTolerance * std::abs(expected)) << omega << ' ' << order;
            // less than the winding alone lets flow
            EXPECT_LT(std::abs(expected), kE / std::abs(d.R + kJ * (w + omega) * d.L))
                << omega << ' ' << order;
        }
    }
}

TEST(TwoSets, AStepDiesOut)
{
    for (const double omega : {0.0, 209.0, -209.0}) {
        Difference d;
        const Complex e = {0.02, -0.01};
        double most = 0;
        for (int k = 0; k < 400; ++k) {
            const double phi = omega * k * d.T_s;
            d.period(e * std::polar(1.0, phi), phi, omega);
            most = std::max(most, std::abs(d.z));
            if (k >= 200) { // 11 times L / R
                EXPECT_LT(std::abs(d.z), 1e-4) << omega << ' ' << k;
            }
        }
        EXPECT_GT(most, 1e-3);
        EXPECT_LT(most, std::abs(e) / d.R / 3);
    }
}

// Beyond an eighth of v_dc the rest flows, and the integrals have not run on when it ends.
TEST(TwoSets, ItsVoltageIsAnEighthOfTheLinkAndNoMore)
{
    Difference d;
    const double most = real(d.x.v_dc) / 8, e = most + 0.02;
    for (int k = 0; k < 1000; ++k) {
        d.period(e);
    }
    EXPECT_NE(d.x.modulator.limited, 0); // and says so
    EXPECT_NEAR(std::abs(d.z), (e - most) / d.R, 0.01 * (e - most) / d.R);
    for (int k = 0; k < 200; ++k) {
        d.period(0);
    }
    EXPECT_LT(std::abs(d.z), 1e-3);
}

// The machine of the difference has L - M, told by L_d + M_d and M_d, and no magnet.
TEST(TwoSets, TheRegulatorIsThatOfTheDifference)
{
    const drive_params_t p = params();
    drive_params_t alone = p;
    alone.winding = WINDING_STAR;
    alone.L_d -= 2 * p.M_d;
    alone.L_q -= 2 * p.M_q;
    const drive_config_t c = configured(p), of = configured(alone);
    EXPECT_EQ(c.two_sets.regulator.d.kp, of.regulator.synchronous_pi.d.kp);
    EXPECT_EQ(c.two_sets.regulator.q.kp, of.regulator.synchronous_pi.q.kp);
    EXPECT_EQ(c.two_sets.regulator.d.ki, of.regulator.synchronous_pi.d.ki);
    EXPECT_EQ(c.two_sets.regulator.L_q, of.regulator.synchronous_pi.L_q);
    EXPECT_EQ(c.two_sets.regulator.psi_m, 0);
    drive_params_t one = p;
    one.winding = WINDING_STAR;
    EXPECT_EQ(c.regulator.synchronous_pi.d.kp, configured(one).regulator.synchronous_pi.d.kp);
}

TEST(TwoSets, IsRefusedByParameterAndReason)
{
    static const char one[] = "knows one bridge: winding 0";
    struct Row {
        std::function<void(drive_params_t &)> change;
        drive_param_id_t blamed;
        const char *reason;
    };
    std::vector<Row> rows = {
        {[](drive_params_t &p) { p.M_d = (p.L_d + 1) / 2; }, DRIVE_PARAM_M_d,
         "half of L_d or more: L_d is that of both sets, with M_d in it"},
        {[](drive_params_t &p) { p.M_q = (p.L_q + 1) / 2; }, DRIVE_PARAM_M_q,
         "half of L_q or more: L_q is that of both sets, with M_q in it"},
        {[](drive_params_t &p) { p.start_method = 1; }, DRIVE_PARAM_start_method,
         "pulses know one bridge: take 0, 2 or 3"},
        {[](drive_params_t &p) { p.flying_start = 1; }, DRIVE_PARAM_flying_start, one},
        {[](drive_params_t &p) { p.commutation = 1; }, DRIVE_PARAM_commutation, one},
        {[](drive_params_t &p) { p.t_settle = 500; }, DRIVE_PARAM_t_settle,
         "two bridges need shunts in the lines"},
    };
    for (int32_t id = 0; id < REGULATOR_COUNT; ++id) {
        if ((regulator_traits(static_cast<regulator_id_t>(id)) & REGULATOR_SWITCHES) != 0U) {
            rows.push_back({[id](drive_params_t &p) { p.regulator = id; }, DRIVE_PARAM_regulator, one});
        }
    }
    ASSERT_GT(rows.size(), 8U);
    for (const Row &row : rows) {
        drive_params_t p = params();
        row.change(p);
        drive_config_t c = {};
        const drive_result_t result = drive_configure(&c, &p, PM_CHANNELS);
        EXPECT_FALSE(result.ok) << row.reason;
        EXPECT_EQ(result.param, row.blamed) << row.reason;
        EXPECT_STREQ(result.reason, row.reason);
    }
    for (const int32_t start : {0, 2, 3}) {
        drive_params_t p = params();
        p.start_method = start;
        p.M_d = p.M_q = 2 * (p.L_d / 5);
        EXPECT_EQ(configured(p).start, SEQUENCE_align);
    }
}

TEST(TwoSets, IsRefusedWithoutABridgeOrItsCurrents)
{
    struct {
        uint32_t missing;
        const char *reason;
    } const rows[] = {
        {NEEDS_BRIDGES, "needs a second bridge: not on this board"},
        {NEEDS_SECOND_SET, "needs the currents of a second bridge: not on this board"},
    };
    for (const auto &row : rows) {
        drive_params_t p = params();
        drive_config_t c = {};
        const drive_result_t result = drive_configure(&c, &p, PM_CHANNELS & ~row.missing);
        EXPECT_FALSE(result.ok);
        EXPECT_EQ(result.param, DRIVE_PARAM_winding);
        EXPECT_STREQ(result.reason, row.reason);
        p.winding = WINDING_STAR;
        EXPECT_TRUE(drive_configure(&c, &p, PM_CHANNELS & ~row.missing).ok) << row.reason;
    }
}

// 3 p psi i in place of 3/2 p psi i: base of the torque, and the inertia that speed control sees.
TEST(TwoSets, TorqueIsThatOfBothSets)
{
    drive_params_t p = params();
    const drive_config_t two = configured(p);
    p.winding = WINDING_STAR;
    const drive_config_t one = configured(p);
    EXPECT_NEAR(value(two.base.torque), 2 * value(one.base.torque), 1e-6 * value(one.base.torque));
    EXPECT_NEAR(two.speed.pi.kp, 0.5 * one.speed.pi.kp, 2);
    EXPECT_NEAR(two.speed.i_per_slope, 0.5 * one.speed.i_per_slope, 2);
}

// The drive on the switching plant.
struct Loop {
    pmsim::Setup setup = machine();
    drive_params_t p;
    const char *error = nullptr;
    std::unique_ptr<plant_t, void (*)(plant_t *)> plant;
    sim_loop_t loop = {};
    uint16_t driven = 0; // stages in which the second bridge was driven, a bit each

    explicit Loop(const std::function<void(Loop &)> &change = [](Loop &) {})
        : p(params()), plant(nullptr, &plant_destroy)
    {
        change(*this);
        plant.reset(plant_create(&setup.plant, 1.0, &error));
        EXPECT_NE(plant, nullptr) << error;
        const drive_result_t result = sim_loop_init(&loop, plant.get(), &p);
        EXPECT_TRUE(result.ok) << result.reason << ' ' << result.param;
    }

    drive_t &drive()
    {
        return loop.app.drive;
    }

    void command(drive_mode_t mode, int32_t current_mA = 0, int32_t torque_uNm = 0, int32_t speed_mrad_s = 0)
    {
        drive_command_t c = {};
        c.enable = true;
        c.mode = mode;
        c.current_mA = current_mA;
        c.torque_uNm = torque_uNm;
        c.speed_mrad_s = speed_mrad_s;
        drive_command(&drive(), &c);
    }

    void run(int periods)
    {
        for (int k = 0; k < periods; ++k) {
            sim_loop_step(&loop);
            if (loop.app.out.second_legs != PM_LEGS_OFF) {
                driven = static_cast<uint16_t>(driven | 1U << drive().stage);
            }
        }
    }

    // Calibrated, and with a vector of 3 A.
    void hold()
    {
        command(DRIVE_MODE_CURRENT, 3000);
        for (int k = 0; k < 10000 && drive().state != DRIVE_RUNNING; ++k) {
            run(1);
        }
        run(300);
        EXPECT_EQ(drive().state, DRIVE_RUNNING);
        EXPECT_EQ(loop.app.out.second_legs, PM_LEGS_PWM);
    }

    drive_fault_t fault()
    {
        return drive_status(&drive())->fault;
    }

    plant_truth_t truth()
    {
        plant_truth_t t;
        plant_truth(plant.get(), &t);
        return t;
    }

    // From the period with the fault on both bridges are open, and the currents of all six legs cease.
    void expect_open(drive_fault_t expected)
    {
        for (int k = 0; k < 100 && fault() == DRIVE_FAULT_NONE; ++k) {
            run(1);
        }
        EXPECT_EQ(fault(), expected);
        run(1);
        EXPECT_EQ(loop.app.out.legs, PM_LEGS_OFF);
        EXPECT_EQ(loop.app.out.second_legs, PM_LEGS_OFF);
        run(100);
        for (const double i_A : truth().i_A) {
            EXPECT_NEAR(i_A, 0, 0.02);
        }
    }
};

TEST(TwoSetsDrive, BothSetsCarryTheVector)
{
    Loop x;
    x.hold();
    const plant_truth_t t = x.truth();
    const Complex i_1 = clarke({t.i_A[0], t.i_A[1], t.i_A[2]}),
                  i_2 = clarke({t.i_A[3], t.i_A[4], t.i_A[5]}) * kOn;
    EXPECT_NEAR(std::abs(i_1), 3, 0.1);
    EXPECT_LT(std::abs(i_1 - i_2), 0.1);
    EXPECT_EQ(x.driven, 1U << STAGE_OPEN_LOOP); // no procedure, and not the calibration
}

TEST(TwoSetsDrive, AnOverCurrentOfTheSecondSetOpensAllLegs)
{
    for (const int leg : {3, 4, 5}) {
        for (const double sign : {1.0, -1.0}) {
            Loop x;
            x.hold();
            plant_sensor(x.plant.get())->offset_A[leg] =
                sign * 12.5; // i_trip is 9 A, of a leg with up to 3 A either way
            x.run(1);
            x.expect_open(DRIVE_FAULT_OVER_CURRENT);
        }
    }
}

// 0.1 of full scale, longer than 2 ms.
TEST(TwoSetsDrive, ASensorOfTheSecondSetThatErrsIsAFault)
{
    for (const int leg : {3, 4}) { // with 2.6 A; the other has none
        Loop x;
        x.hold();
        plant_sensor(x.plant.get())->gain_error[leg] = -1;
        x.expect_open(DRIVE_FAULT_SENSOR_SUM);
    }
    for (const int leg : {3, 4, 5}) {
        Loop x;
        x.hold();
        plant_sensor(x.plant.get())->offset_A[leg] = leg == 4 ? -1.5 : 1.5;
        x.expect_open(DRIVE_FAULT_SENSOR_SUM);
    }
    Loop x;
    x.hold();
    plant_sensor(x.plant.get())->offset_A[5] = 0.5;
    x.run(300);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
}

TEST(TwoSetsDrive, CalibrationTakesOffsetsOfTheSecondSetOutOrRefusesThem)
{
    for (const int leg : {3, 4, 5}) {
        Loop x([leg](Loop &l) { l.setup.plant.sensor.offset_A[leg] = -0.25; });
        x.hold();
        EXPECT_NEAR((real(x.drive().two_sets.zero[leg - 3]) - 1) * 10, -0.25, 0.003);
        Loop far([leg](Loop &l) { l.setup.plant.sensor.offset_A[leg] = 0.4; }); // offset_max is 0.3
        far.command(DRIVE_MODE_CURRENT, 3000);
        far.run(3000);
        EXPECT_EQ(far.fault(), DRIVE_FAULT_SENSOR_OFFSET);
        EXPECT_EQ(far.driven, 0);
    }
}

TEST(TwoSetsDrive, AStarPointOfTheSecondSetIsCalibratedToo)
{
    const auto channel = [](double offset_V) {
        return [offset_V](Loop &l) {
            l.setup.plant.sensor.v_zero_full_scale_V = 15;
            l.setup.plant.sensor.v_zero_offset_V = offset_V;
            l.p.neutral_full_scale = 15000;
        };
    };
    Loop x(channel(0.3));
    x.hold();
    EXPECT_NEAR((real(x.drive().two_sets.neutral.zero) - 1) * 15, -0.3, 0.02);
    EXPECT_NEAR((real(x.drive().neutral.zero) - 1) * 15, -0.3, 0.02);
    Loop far(channel(5));
    far.command(DRIVE_MODE_CURRENT, 3000);
    far.run(3000);
    EXPECT_EQ(far.fault(), DRIVE_FAULT_SENSOR_OFFSET);
}

TEST(TwoSetsDrive, IsNotIdentified)
{
    Loop x;
    x.command(DRIVE_MODE_IDENTIFY, 2000);
    x.run(3000);
    EXPECT_EQ(x.drive().state, DRIVE_OFF);
    EXPECT_EQ(x.driven, 0);
    x.command(DRIVE_MODE_CURRENT, 2000);
    x.run(3000);
    EXPECT_NE(x.drive().state, DRIVE_OFF);
}

// What a procedure does with the legs of the first bridge the second does not follow; a short circuit it does.
TEST(TwoSetsDrive, WithoutControlTheSecondSetIsOpenButForAShortCircuit)
{
    Loop x;
    x.hold();
    struct {
        uint8_t winding;
        drive_stage_t stage;
        uint16_t first, second;
    } const rows[] = {
        {WINDING_TWO_SETS, STAGE_PROCEDURE, PM_LEGS_PWM, PM_LEGS_OFF},
        {WINDING_TWO_SETS, STAGE_OFF, PM_LEGS_OFF, PM_LEGS_OFF},
        {WINDING_TWO_SETS, STAGE_SHORT, PM_LEGS_PWM, PM_LEGS_PWM},
        {WINDING_OPEN, STAGE_PROCEDURE, PM_LEGS_PWM, PM_LEGS_PWM},
        {WINDING_OPEN, STAGE_OFF, PM_LEGS_OFF, PM_LEGS_OFF},
    };
    for (const auto &row : rows) {
        x.drive().config.winding = row.winding;
        x.drive().stage = row.stage;
        drive_out_t out = {};
        out.legs = row.first;
        std::fill(out.second, out.second + DRIVE_LEGS, uint16_t{77});
        x.drive().two_sets.regulator.d.integral = x.drive().two_sets.regulator.q.integral = 1000000;
        second_bridge_without(&x.drive(), &out);
        EXPECT_EQ(out.second_legs, row.second) << int{row.winding} << ' ' << row.stage;
        EXPECT_TRUE(std::all_of(out.second, out.second + DRIVE_LEGS, [](uint16_t on) { return on == 0; }));
        EXPECT_EQ(x.drive().two_sets.regulator.d.integral, 0);
        EXPECT_EQ(x.drive().two_sets.regulator.q.integral, 0);
    }
}

// A fault at 300 rad/s, whose EMF is above the link, ties both sets to the rail: each carries the current of the shorted machine,
// and what they do not have in common is small.
TEST(TwoSetsDrive, FaultShortTiesBothSetsToTheRail)
{
    Loop x([](Loop &l) {
        l.setup.plant.sensor.i_full_scale_A = 60;
        l.p.i_full_scale = 60000;
        l.p.i_trip = 50000;
        l.p.fault_short = 1;
    });
    x.hold();
    plant_set_source(x.plant.get(), 25);
    x.run(300);
    plant_set_speed(x.plant.get(), 60);
    x.drive().pll.omega = PM_Q(300.0 / 360);
    drive_trip(&x.drive(), DRIVE_FAULT_TEMPERATURE_SENSOR);
    ASSERT_EQ(x.drive().stage, STAGE_SHORT);
    for (int k = 0; k < 500; ++k) {
        x.run(1);
        ASSERT_EQ(x.drive().stage, STAGE_SHORT) << k;
        ASSERT_EQ(x.loop.app.out.legs, PM_LEGS_PWM);
        ASSERT_EQ(x.loop.app.out.second_legs, PM_LEGS_PWM);
        for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
            ASSERT_EQ(x.loop.app.out.compare[leg][0], 0);
            ASSERT_EQ(x.loop.app.out.second[leg], 0);
        }
    }
    const plant_truth_t t = x.truth();
    const Complex i_1 = clarke({t.i_A[0], t.i_A[1], t.i_A[2]}),
                  i_2 = clarke({t.i_A[3], t.i_A[4], t.i_A[5]}) * kOn;
    const double R = 1.106, X_d = 300 * 3.66e-3, X_q = 300 * 3.93e-3, e = 300 * 0.0734;
    EXPECT_NEAR(std::abs(i_1 + i_2) / 2, e * std::hypot(R, X_q) / (R * R + X_d * X_q), 1.5);
    EXPECT_LT(std::abs(i_1 - i_2), 0.1 * std::abs(i_1));
    plant_set_speed(x.plant.get(), 0);
    x.run(1000);
    EXPECT_EQ(x.loop.app.out.legs, PM_LEGS_OFF);
    EXPECT_EQ(x.loop.app.out.second_legs, PM_LEGS_OFF);
}

// In torque mode, on a dynamometer: what is asked for is what both sets give, and what the bus calls rated.
TEST(TwoSetsDrive, TheTorqueOfBothSetsIsWhatIsAskedFor)
{
    Loop x([](Loop &l) {
        l.p.flux_bandwidth = 20000;
        l.p.speed_low = 1300;
        l.p.speed_high = 6000;
        l.p.acceleration = 30000;
    });
    x.command(DRIVE_MODE_TORQUE, 0, 500000);
    for (int k = 0; k < 30000 && x.drive().stage != STAGE_VECTOR; ++k) {
        x.run(1);
    }
    x.run(3000);
    plant_set_speed(x.plant.get(), x.truth().omega_mech_rad_s);
    for (const double share : {0.2, 0.8}) {
        x.command(DRIVE_MODE_TORQUE, 0, static_cast<int32_t>(share * kTorque_Nm * 1e6));
        x.run(3000);
        double mean = 0;
        constexpr int kPeriods = 2000;
        for (int k = 0; k < kPeriods; ++k) {
            x.run(1);
            mean += x.truth().torque_Nm / kPeriods;
        }
        EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
        EXPECT_NEAR(mean, share * kTorque_Nm, 0.02 * share * kTorque_Nm) << share;
    }
    EXPECT_EQ(x.driven, 1U << STAGE_OPEN_LOOP | 1U << STAGE_VECTOR);
}

} // namespace
