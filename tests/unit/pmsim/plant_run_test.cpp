// `pmsim plant` against formulas: the rows mean what the documentation says.
#include "tools/pmsim/plant_run.h"

#include <cmath>

#include <gmock/gmock.h>

#include "tests/unit/pmsim/support.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

using testing::StartsWith;

// The solver is told 1e-10 a step; a few hundred steps add up.
const double tolerance = 1e-7;
const double pi = 3.14159265358979324;

const char linear[] =
    "name: linear\n"
    "electrical: {R_s_ohm: 2, L_d0_H: 4.0e-3, L_q0_H: 6.0e-3, psi_m_Wb: 0.05, pole_pairs: 3}\n"
    "mechanics: {J_kgm2: 1.0e-3}\n"
    "solver: {tolerance: 1.0e-10}\n";

PlantFile plant(const std::string &text, const Settings &settings = {})
{
    return read_plant_file(Value::from_text(text, "m.yaml"), settings);
}

Csv run(const PlantFile &file, const std::string &input)
{
    const Csv in = read_plant_input(input, "in.csv", file.setup);
    const std::string out = run_plant(file, in).csv;
    const std::string header = out.substr(0, out.find('\n'));
    return Csv::from_text(out, "out.csv", {split(header, ','), {}});
}

std::string input_error(const std::string &input, const std::string &machine = linear)
{
    return error_of([&] { run(plant(machine), input); });
}

TEST(PlantRun, VoltageHoldsFromEachRow)
{
    const PlantFile file = plant(std::string(linear) + "# held\n", {{"mechanics.locked", "true"}});
    const Csv out = run(file, "t_s,va_V,vb_V,vc_V\n5,3,0,0\n5.001,3,0,0\n5.004,0,0,0\n5.005,9,9,9\n");
    // two thirds of va act on the d-axis, which stands on phase A
    const double tau_s = 4e-3 / 2.0, i_end_A = 2.0 / 2.0;
    const double i4_A = i_end_A * (1.0 - std::exp(-4e-3 / tau_s));
    const std::vector<double> &ia = out.column("ia_A");
    EXPECT_EQ(out.column("t_s")[3], 5.005);
    EXPECT_EQ(ia[0], 0.0);
    EXPECT_NEAR(ia[1], i_end_A * (1.0 - std::exp(-1e-3 / tau_s)), tolerance);
    EXPECT_NEAR(ia[2], i4_A, tolerance);
    EXPECT_NEAR(ia[3], i4_A * std::exp(-1e-3 / tau_s), tolerance);
    EXPECT_NEAR(out.column("ib_A")[2], -0.5 * i4_A, tolerance);
    EXPECT_NEAR(out.column("psi_d_Vs")[2], 0.05 + 4e-3 * i4_A, 4e-3 * tolerance);
    EXPECT_EQ(out.column("omega_mech_rad_s")[3], 0.0);
}

TEST(PlantRun, ImposedSpeedIsLinearBetweenRows)
{
    const PlantFile file = plant(linear, {{"start.theta_e_deg", "30"}});
    const Csv out =
        run(file, "t_s,va_V,vb_V,vc_V,omega_mech_rad_s\n0,0,0,0,10\n0.1,0,0,0,30\n0.2,0,0,0,-30\n");
    const std::vector<double> &theta = out.column("theta_e_rad");
    EXPECT_NEAR(theta[0], pi / 6, 1e-12);
    EXPECT_NEAR(theta[1], pi / 6 + 3.0 * 0.1 * 20.0, tolerance);
    EXPECT_NEAR(theta[2], pi / 6 + 3.0 * 0.1 * 20.0, tolerance);
    EXPECT_EQ(out.column("omega_mech_rad_s")[0], 10.0);
    EXPECT_EQ(out.column("omega_mech_rad_s")[2], -30.0);
}

// Shorted terminals at constant speed: i_d = -w^2 L_q psi / (R^2 + w^2 L_d L_q), i_q = -w R psi / (...).
TEST(PlantRun, ShortCircuitAtConstantSpeed)
{
    const Csv out = run(plant(linear), "t_s,va_V,vb_V,vc_V,omega_mech_rad_s\n0,0,0,0,100\n0.1,0,0,0,100\n");
    const double w = 300.0, R = 2.0, L_d = 4e-3, L_q = 6e-3, psi = 0.05;
    const double D = R * R + w * w * L_d * L_q;
    const double i_d = -w * w * L_q * psi / D, i_q = -w * R * psi / D;
    const double theta = out.column("theta_e_rad")[1];
    EXPECT_NEAR(out.column("ia_A")[1], i_d * std::cos(theta) - i_q * std::sin(theta), 10 * tolerance);
    EXPECT_NEAR(out.column("psi_d_Vs")[1], psi + L_d * i_d, tolerance);
    EXPECT_NEAR(out.column("psi_q_Vs")[1], L_q * i_q, tolerance);
    const double torque_Nm = 1.5 * 3 * (psi * i_q + (L_d - L_q) * i_d * i_q);
    EXPECT_NEAR(out.column("torque_Nm")[1], torque_Nm, 10 * tolerance);
}

// A machine with next to no magnets: only the load moves it.
TEST(PlantRun, LoadHoldsFromEachRow)
{
    const PlantFile file = plant(linear, {{"electrical.psi_m_Wb", "1e-5"}, {"electrical.R_s_ohm", "1000"}});
    const Csv out = run(file, "load_Nm,t_s,va_V,vb_V,vc_V\n0.5,0,0,0,0\n-1,0.01,0,0,0\n7,0.03,0,0,0\n");
    EXPECT_NEAR(out.column("omega_mech_rad_s")[1], -5.0, tolerance);
    EXPECT_NEAR(out.column("omega_mech_rad_s")[2], 15.0, tolerance);
}

TEST(PlantRun, SixLegsHaveSixColumns)
{
    const std::string rows = "t_s,va_V,vb_V,vc_V,vx_V,vy_V,vz_V\n0,1,0,0,0,0,0\n1e-4,0,0,0,0,0,0\n";
    const Csv two = run(plant(std::string(linear) + "winding: {sets: 2}\n"), rows);
    EXPECT_GT(two.column("ia_A")[1], 0.0);
    EXPECT_NEAR(two.column("ix_A")[1], 0.0, tolerance); // nothing is applied to it, and it is not coupled
    const Csv open = run(plant(std::string(linear) + "winding: {connection: open, L_0_H: 1.0e-3}\n"), rows);
    EXPECT_NEAR(open.column("ix_A")[1], -open.column("ia_A")[1], tolerance); // the same phase
    EXPECT_EQ(input_error("t_s,va_V,vb_V,vc_V\n0,0,0,0\n", std::string(linear) + "winding: {sets: 2}\n"),
              "in.csv:1: column \"vx_V\" is missing");
    EXPECT_THAT(input_error(rows), StartsWith("in.csv:1: unknown column \"vx_V\""));
}

TEST(PlantRun, TakesMachineFilesAndWhatIsLaidOverThem)
{
    const PlantFile bare = load_plant_file("sim_plant/machines/bldc_fan.yaml");
    EXPECT_EQ(bare.setup.name, "BLDC-FAN");
    EXPECT_EQ(bare.theta_e_rad, 0.0);
    const PlantFile laid = plant("machine: sim_plant/machines/dtp_400.yaml\n"
                                 "electrical: {c_A_Wb5: 0}\n"
                                 "start: {theta_e_deg: 90}\n",
                                 {{"mechanics.locked", "true"}});
    EXPECT_EQ(laid.setup.name, "DTP-400");
    EXPECT_EQ(laid.setup.plant.machine.c_A_Wb5, 0.0);
    EXPECT_TRUE(laid.setup.plant.mech.locked);
    EXPECT_NEAR(laid.theta_e_rad, pi / 2, 1e-12);
    const PlantFile swept = plant("machine: sim_plant/machines/ipm_1000.yaml\n"
                                  "start: {theta_e_deg: $angle}\n"
                                  "sweep: {angle: [90, 180], R: [1, 2]}\n"
                                  "electrical: {R_s_ohm: $R}\n",
                                  {{"R", "3"}}); // the first run, but for what is set
    EXPECT_NEAR(swept.theta_e_rad, pi / 2, 1e-12);
    EXPECT_EQ(swept.setup.plant.machine.R_s_ohm, 3.0);
    const PlantFile scenario = load_plant_file("tests/scenario/mismatch.yaml"); // with $variables
    EXPECT_EQ(scenario.setup.name, "IPM-1000");
}

Csv run_floating(const PlantFile &file, const std::string &input, const std::vector<std::string> &names)
{
    const unsigned floating = floating_legs(names, file.setup);
    const Csv in = read_plant_input(input, "in.csv", file.setup, floating);
    const std::string out = run_plant(file, in, nullptr, floating).csv;
    return Csv::from_text(out, "out.csv", {split(out.substr(0, out.find('\n')), ','), {}});
}

// a and b in series, c off, rotor at 0: psi_a = L_d i, psi_b = -(L_d + L_q) i/2, psi_c = (L_q - L_d) i/2, so
// that v = 2 R i + (3 L_d + L_q)/2 di/dt; the star point is at v - R i - L_d di/dt, c above it by dpsi_c/dt.
TEST(PlantRun, FloatingTerminalShowsTheSaliency)
{
    const PlantFile file = plant(linear, {{"mechanics.locked", "true"}});
    const Csv out = run_floating(file, "t_s,va_V,vb_V\n0,6,0\n0.0005,6,0\n0.004,6,0\n0.005,6,0\n", {"c"});
    const double v_V = 6.0, R = 2.0, L_d = 4e-3, L_q = 6e-3, L = 1.5 * L_d + 0.5 * L_q;
    for (size_t row = 0; row < out.rows(); ++row) {
        const double i_A = v_V / (2.0 * R) * -std::expm1(-out.column("t_s")[row] * 2.0 * R / L);
        const double di_A_s = (v_V - 2.0 * R * i_A) / L;
        EXPECT_NEAR(out.column("ia_A")[row], i_A, tolerance) << row;
        EXPECT_NEAR(out.column("ib_A")[row], -i_A, tolerance) << row;
        EXPECT_NEAR(out.column("ic_A")[row], 0.0, 1e-10) << row;
        const double neutral_V = v_V - R * i_A - L_d * di_A_s;
        EXPECT_NEAR(out.column("vc_V")[row], neutral_V + 0.5 * (L_q - L_d) * di_A_s, 10.0 * tolerance) << row;
        EXPECT_NEAR(out.column("v_neutral_V")[row], 0.0, 1e-12) << row; // no zero sequence
    }
}

// With and without a terminal off: 3 omega psi_3 sin(3 theta) against the mean of the terminals.
TEST(PlantRun, NeutralShowsTheThirdHarmonic)
{
    const PlantFile file = plant(std::string(linear) + "winding: {emf: [{order: 3, psi_Wb: 0.004}]}\n");
    const std::string rows = "0,1,0,0,100\n0.001,1,0,0,100\n0.002,1,0,0,100\n0.0035,1,0,0,100\n";
    for (const std::vector<std::string> &names : {std::vector<std::string>{}, {"c"}, {"a", "b", "c"}}) {
        const Csv out = run_floating(file, "t_s,va_V,vb_V,vc_V,omega_mech_rad_s\n" + rows, names);
        for (size_t row = 0; row < out.rows(); ++row) {
            const double theta = 300.0 * out.column("t_s")[row];
            EXPECT_NEAR(out.column("v_neutral_V")[row], 3.0 * 300.0 * 0.004 * std::sin(3.0 * theta), 1e-6)
                << names.size() << row;
        }
    }
}

TEST(PlantRun, NeutralsOfTwoSetsAndNoneOfAnOpenWinding)
{
    const auto header = [](const std::string &extra) {
        const PlantFile file = plant(std::string(linear) + extra);
        const Csv in =
            read_plant_input("t_s,va_V,vb_V,vc_V,vx_V,vy_V,vz_V\n0,0,0,0,0,0,0\n", "in.csv", file.setup);
        const std::string out = run_plant(file, in).csv;
        return out.substr(0, out.find('\n'));
    };
    EXPECT_THAT(header("winding: {sets: 2}\n"),
                testing::EndsWith(",psi_q_Vs,v_neutral_abc_V,v_neutral_xyz_V"));
    EXPECT_THAT(header("winding: {connection: open, L_0_H: 1.0e-3}\n"), testing::EndsWith(",psi_q_Vs"));
}

TEST(PlantRun, ErrorsOfTheFile)
{
    const auto error = [](const std::string &text, const Settings &settings = {}) {
        return error_of([&] { plant(text, settings); });
    };
    EXPECT_EQ(error("machine: none.yaml\n"), "m.yaml:1:10: there is no machine file none.yaml");
    EXPECT_EQ(error("machine: none.yaml\nstrat: 1\n"),
              "m.yaml:2:1: unknown key \"strat\"; did you mean \"start\"?");
    EXPECT_THAT(error("nam: x\n"), StartsWith("m.yaml:1:1: unknown key \"nam\""));
    EXPECT_THAT(error(linear, {{"mechanics.lokced", "true"}}), StartsWith("--set mechanics.lokced: no such"));
    EXPECT_EQ(error_of([] { load_plant_file("none.yaml"); }),
              "none.yaml: cannot be read: No such file or directory");
}

TEST(PlantRun, ErrorsOfTheInput)
{
    EXPECT_EQ(input_error("t_s,va_V,vb_V,vc_V\n0,0,0,0\n0,0,0,0\n"),
              "in.csv:3: t_s must ascend: 0 follows 0 of line 2");
    EXPECT_EQ(input_error("t_s,va_V,vb_V,vc_V\n1,0,0,0\n\n0.5,0,0,0\n"),
              "in.csv:4: t_s must ascend: 0.5 follows 1 of line 2");
    EXPECT_EQ(input_error("t_s,va_V,vb_V,vc_V\n0,0,1e6,0\n"),
              "in.csv:2: vb_V = 1e+06 is out of range -100000 ... 100000");
    EXPECT_EQ(input_error("t_s,va_V,vb_V,vc_V,omega_mech_rpm\n0,0,0,0,0\n"),
              "in.csv:1: unknown column \"omega_mech_rpm\": wrong unit; did you mean \"omega_mech_rad_s\"?");
    EXPECT_EQ(input_error("t_s,va_V,vb_V,vc_V\n0,0,0,0\n1,0,0,nan\n"),
              "in.csv:3: \"nan\" for vc_V is not a finite number");
    EXPECT_EQ(input_error("t_s,va_V,vb_V,vc_V,omega_mech_rad_s\n0,0,0,0,0\n",
                          replaced(linear, "J_kgm2: 1.0e-3", "J_kgm2: 1.0e-3, locked: true")),
              "m.yaml:3:37: the rotor is locked, but in.csv has omega_mech_rad_s");
}

TEST(PlantRun, WhatThePlantRefusesNamesTheKey)
{
    const std::string rows = "t_s,va_V,vb_V,vc_V\n0,0,0,0\n";
    EXPECT_THAT(
        input_error(rows, std::string(linear) + "inverter: {f_pwm_Hz: 100.0e+3, dead_time_s: 1.0e-5}\n"),
        StartsWith("m.yaml:5:45: inverter.dead_time_s must be"));
    EXPECT_THAT(input_error(rows, std::string(linear) + "dclink: {r_source_ohm: 0}\n"),
                StartsWith("m.yaml:5:24: dclink.r_source_ohm must be"));
}

} // namespace
} // namespace pmsim
