#include "tools/pmsim/machine_file.h"

#include <array>
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>

#include "firmware/params/parameters.h"
#include "tests/unit/pmsim/support.h"

extern "C" {
#include "tools/pmsim/rig.h"
}

namespace pmsim
{
namespace
{

namespace fs = std::filesystem;
using testing::HasSubstr;

// Catalogue rounding: the parameters in a machine file have three or four digits.
const double rounding = 0.01;

std::vector<std::string> machine_files()
{
    std::vector<std::string> files;
    for (const auto &entry : fs::directory_iterator("sim_plant/machines")) {
        files.push_back(entry.path().string());
    }
    return files;
}

// Those that the firmware can run.
std::vector<std::string> drive_files()
{
    std::vector<std::string> files;
    for (const std::string &file : machine_files()) {
        if (load_machine_file(file).given.count("drive.R_s") != 0) {
            files.push_back(file);
        }
    }
    return files;
}

// The energy form of METHODS 0.2 E1, written out here once more: currents of a flux, fluxes of a current.
struct Core {
    explicit Core(const plant_machine_t &m)
        : L_d0(m.L_d0_H), L_q0(m.L_q0_H), c(m.c_A_Wb5), psi_m(m.psi_m_Wb),
          i_f(psi_m / L_d0 + c * std::pow(psi_m, 5))
    {
    }

    std::array<double, 2> current(double psi_d, double psi_q) const
    {
        const double s = c * std::pow(psi_d * psi_d + psi_q * psi_q, 2);
        return {psi_d * (1 / L_d0 + s) - i_f, psi_q * (1 / L_q0 + s)};
    }

    // d i / d psi, by differences
    std::array<double, 4> stiffness(double d, double q) const
    {
        const double h = 1e-6 * psi_m;
        const auto dp = current(d + h, q), dm = current(d - h, q);
        const auto qp = current(d, q + h), qm = current(d, q - h);
        return {(dp[0] - dm[0]) / (2 * h), (qp[0] - qm[0]) / (2 * h), (dp[1] - dm[1]) / (2 * h),
                (qp[1] - qm[1]) / (2 * h)};
    }

    std::array<double, 2> flux(double i_d, double i_q) const
    {
        double d = psi_m, q = 0.0;
        for (int k = 0; k < 50; ++k) {
            const auto i = current(d, q);
            const auto g = stiffness(d, q);
            const double D = g[0] * g[3] - g[1] * g[2];
            d -= (g[3] * (i[0] - i_d) - g[1] * (i[1] - i_q)) / D;
            q -= (g[0] * (i[1] - i_q) - g[2] * (i[0] - i_d)) / D;
        }
        return {d, q};
    }

    double L_d0, L_q0, c, psi_m, i_f;
};

struct Incremental {
    double L_d, L_q, L_dq, L_q_apparent;
};

Incremental inductances(const Core &core, double i_d, double i_q)
{
    const auto psi = core.flux(i_d, i_q);
    const auto g = core.stiffness(psi[0], psi[1]);
    const double D = g[0] * g[3] - g[1] * g[2];
    return {g[3] / D, g[0] / D, -g[1] / D, psi[1] / i_q};
}

class MachineFiles : public testing::TestWithParam<std::string>
{
};

// Torque of all sets at i_d = 0.
double rated_torque_Nm(const pmsim::Setup &setup)
{
    const double i_A = setup.rated.i_rated_A;
    const double psi_d = Core(setup.plant.machine).flux(0.0, i_A)[0];
    return setup.plant.winding.sets * 1.5 * setup.plant.machine.pole_pairs * psi_d * i_A;
}

TEST_P(MachineFiles, LoadsAndIsAcceptedByThePlant)
{
    const pmsim::Setup setup = load_machine_file(GetParam());
    const char *error = nullptr;
    plant_t *plant = plant_create(&setup.plant, 0.0, &error);
    EXPECT_NE(plant, nullptr) << error;
    plant_destroy(plant);
}

TEST_P(MachineFiles, RatedTorqueBelongsToRatedCurrent)
{
    const pmsim::Setup setup = load_machine_file(GetParam());
    const double torque_Nm = rated_torque_Nm(setup);
    EXPECT_NEAR(torque_Nm, setup.rated.torque_rated_Nm, rounding * torque_Nm);
}

class DriveFiles : public MachineFiles
{
};

TEST_P(DriveFiles, AreAcceptedByTheDrive)
{
    const pmsim::Setup setup = load_machine_file(GetParam());
    char error[200] = "";
    rig_t *rig = rig_create(&setup.plant, 0.0, setup.params.get(), false, error, sizeof error);
    EXPECT_NE(rig, nullptr) << error;
    rig_destroy(rig);
}

// The voltage suffices for rated speed and torque, with what the drive keeps back.
TEST_P(DriveFiles, RatedPointLiesWithinTheVoltage)
{
    const pmsim::Setup setup = load_machine_file(GetParam());
    const Core core(setup.plant.machine);
    const double i_A = setup.rated.i_rated_A;
    const auto psi = core.flux(0.0, i_A);
    const double omega = setup.rated.speed_rated_rad_s * setup.plant.machine.pole_pairs;
    const double v_V = std::hypot(-omega * psi[1], omega * psi[0] + setup.plant.machine.R_s_ohm * i_A);
    EXPECT_LT(v_V, 0.95 * setup.rated.v_dc_V / std::sqrt(3.0));
}

TEST_P(DriveFiles, DriveParametersDescribeTheMachine)
{
    const pmsim::Setup setup = load_machine_file(GetParam());
    const plant_machine_t &m = setup.plant.machine;
    const auto si = [&setup](drive_param_id_t id) { return parameter_si(*setup.params, id); };
    const Core core(m);
    const Incremental zero = inductances(core, 0.0, 1e-6);
    EXPECT_EQ(setup.params->pole_pairs, m.pole_pairs);
    EXPECT_NEAR(si(DRIVE_PARAM_psi_m), m.psi_m_Wb, rounding * m.psi_m_Wb);
    const plant_winding_t &winding = setup.plant.winding;
    const int switches = winding.connection == PLANT_OPEN ? 2 : 1;
    EXPECT_NEAR(si(DRIVE_PARAM_R_s), m.R_s_ohm + switches * setup.plant.inverter.r_on_ohm,
                rounding * m.R_s_ohm);
    EXPECT_NEAR(si(DRIVE_PARAM_J), setup.plant.mech.J_kgm2, rounding * setup.plant.mech.J_kgm2);
    EXPECT_NEAR(si(DRIVE_PARAM_M_d), winding.M_d_H,
                rounding * winding.M_d_H); // of two sets, which are one machine of L + M
    EXPECT_NEAR(si(DRIVE_PARAM_M_q), winding.M_q_H, rounding * winding.M_q_H);
    EXPECT_NEAR(si(DRIVE_PARAM_L_d), zero.L_d + winding.M_d_H, rounding * zero.L_d);
    EXPECT_NEAR(si(DRIVE_PARAM_L_q), zero.L_q + winding.M_q_H, rounding * zero.L_q);
    EXPECT_NEAR(si(DRIVE_PARAM_i_rated), setup.rated.i_rated_A, rounding * setup.rated.i_rated_A);
    EXPECT_NEAR(si(DRIVE_PARAM_v_dc_nominal), setup.rated.v_dc_V, rounding * setup.rated.v_dc_V);
}

// On the drive's own MTPA curve: i_d = h - sqrt(h^2 + i_q^2), h = psi_m / (2 (L_q - L_d)).
double mtpa_i_d(const drive_params_t &p, double i_q)
{
    const double dL = parameter_si(p, DRIVE_PARAM_L_q) - parameter_si(p, DRIVE_PARAM_L_d);
    if (dL <= 0.0) {
        return 0.0;
    }
    const double h = parameter_si(p, DRIVE_PARAM_psi_m) / (2.0 * dL);
    return h - std::hypot(h, i_q);
}

TEST_P(DriveFiles, RatedInductancesAreThoseOfTheCore)
{
    const pmsim::Setup setup = load_machine_file(GetParam());
    const auto si = [&setup](drive_param_id_t id) { return parameter_si(*setup.params, id); };
    const Core core(setup.plant.machine);
    const double i_q = setup.rated.i_rated_A;
    const Incremental rated = inductances(core, mtpa_i_d(*setup.params, i_q), i_q);
    const double M_d = setup.plant.winding.M_d_H, M_q = setup.plant.winding.M_q_H;
    EXPECT_NEAR(si(DRIVE_PARAM_L_q_rated), rated.L_q_apparent + M_q, rounding * rated.L_q);
    EXPECT_NEAR(si(DRIVE_PARAM_L_dh_rated), rated.L_d + M_d, rounding * rated.L_d);
    EXPECT_NEAR(si(DRIVE_PARAM_L_qh_rated), rated.L_q + M_q, rounding * rated.L_q);
    EXPECT_NEAR(si(DRIVE_PARAM_L_dqh_rated), rated.L_dq, 0.005 * rated.L_q);
    const Incremental half = inductances(core, mtpa_i_d(*setup.params, 0.5 * i_q), 0.5 * i_q);
    EXPECT_NEAR(si(DRIVE_PARAM_cross_half), half.L_dq / half.L_q, 0.002);
}

std::string test_name(const testing::TestParamInfo<std::string> &info)
{
    return fs::path(info.param).stem().string();
}

INSTANTIATE_TEST_SUITE_P(All, MachineFiles, testing::ValuesIn(machine_files()), test_name);
INSTANTIATE_TEST_SUITE_P(All, DriveFiles, testing::ValuesIn(drive_files()), test_name);

// parameters.def says that its defaults are this machine.
TEST(MachineFile, Ipm1000IsTheFirmwaresDefault)
{
    const pmsim::Setup setup = load_machine_file("sim_plant/machines/ipm_1000.yaml");
    for (int i = 0; i < DRIVE_PARAM_COUNT; ++i) {
        const auto id = static_cast<drive_param_id_t>(i);
        // derived from the converter; of the inverter, not of the machine
        if (id != DRIVE_PARAM_i_noise && id != DRIVE_PARAM_leg_capacitance) {
            EXPECT_EQ(drive_param_get(setup.params.get(), id), drive_param_table[i].def)
                << drive_param_table[i].name;
        }
    }
}

std::string machine_text()
{
    return "name: small\n"
           "electrical: {R_s_ohm: 1, L_d0_H: 1.0e-3, L_q0_H: 1.0e-3, c_A_Wb5: 0, psi_m_Wb: 0.01, pole_pairs: "
           "4}\n"
           "mechanics: {J_kgm2: 1.0e-5, B_Nms: 0, T_coulomb_Nm: 0}\n"
           "rated: {i_rated_A: 5, speed_rated_rad_s: 100, torque_rated_Nm: 0.3, v_dc_V: 24}\n"
           "sensor: {offset_A: [0, 0, 0]}\n"
           "drive:\n"
           "  pole_pairs: 4\n";
}

std::string machine_error(const std::string &from, const std::string &to)
{
    return error_of([&] { read_machine(Value::from_text(replaced(machine_text(), from, to), "m.yaml")); });
}

TEST(MachineFile, ErrorsNameThePlace)
{
    EXPECT_EQ(machine_error("R_s_ohm: 1", "R_s_mohm: 1"),
              "m.yaml:2:14: unknown key \"R_s_mohm\": wrong unit; did you mean \"R_s_ohm\"?");
    EXPECT_EQ(machine_error("R_s_ohm: 1, ", ""), "m.yaml:2:13: key \"R_s_ohm\" is missing");
    EXPECT_EQ(machine_error("mechanics:", "mechanic:"),
              "m.yaml:3:1: unknown key \"mechanic\"; did you mean \"mechanics\"?");
    EXPECT_THAT(machine_error("R_s_ohm: 1,", "R_s_ohm: -1,"), HasSubstr("m.yaml:2:23: -1 is out of range"));
    EXPECT_THAT(machine_error("R_s_ohm: 1,", "R_s_ohm: .inf,"), HasSubstr("m.yaml:2:23: "));
    EXPECT_EQ(machine_error("[0, 0, 0]", "[0, 0]"), "m.yaml:5:20: expected one value per leg: [a, b, c]");
    EXPECT_EQ(machine_error("offset_A: [0, 0, 0]", "bits: 12.5"),
              "m.yaml:5:16: expected a whole number, found 12.5");
    EXPECT_EQ(machine_error("  pole_pairs: 4", "  pole_pair: 4"),
              "m.yaml:7:3: unknown key \"pole_pair\"; did you mean \"pole_pairs\"?");
    EXPECT_EQ(
        machine_error("small", "small"),
        "m.yaml:7:3: key \"R_s\" is missing; complete it first: pmsim tune FILE -o tuned.yaml"); // of drive:
}

// A machine of which each value is within its limits; `changes` are settings that together make it stiff.
std::string stiffness_error(const Settings &changes)
{
    Setup setup = load_machine_file("sim_plant/machines/ipm_1000.yaml");
    apply_settings(setup, changes);
    try {
        check_time_constants(setup);
    } catch (const InputError &error) {
        return error.what();
    }
    return "";
}

TEST(MachineFile, TimeConstantsTooShortToIntegrateAreRefused)
{
    EXPECT_THAT(stiffness_error({{"winding.L_eddy_d_H", "1e-8"}, {"winding.R_eddy_ohm", "20"}}),
                HasSubstr("winding.L_eddy_d_H with R_eddy_ohm: a time constant of 5e-10 s"));
    EXPECT_THAT(stiffness_error({{"mechanics.J_kgm2", "1e-9"}, {"mechanics.B_Nms", "10"}}),
                HasSubstr("mechanics.J_kgm2 with B_Nms: a time constant of 1e-10 s"));
    EXPECT_THAT(stiffness_error({{"dclink.c_F", "1e-9"}, {"dclink.r_source_ohm", "0.1"}}),
                HasSubstr("dclink.c_F with r_source_ohm: a time constant of 1e-10 s"));
    // Twice as long as what is refused.
    EXPECT_EQ(stiffness_error({{"winding.L_eddy_d_H", "1e-8"}, {"winding.R_eddy_ohm", "5"}}), "");
    EXPECT_EQ(stiffness_error({{"dclink.c_F", "1e-8"}, {"dclink.r_source_ohm", "0.2"}}), "");
}

TEST(MachineFile, BoardParametersFollowTheBoardUnlessGiven)
{
    pmsim::Setup setup = load_machine_file("sim_plant/machines/ipm_1000.yaml");
    const auto set = [&setup](const char *section, const char *key, const char *value) {
        read_setting(setup, section, key, Value::from_text(value, "t"));
    };
    set("inverter", "dead_time_s", "1.0e-6");
    EXPECT_EQ(setup.params->dead_time, 1000);
    set("drive", "dead_time", "3.0e-6");
    set("inverter", "dead_time_s", "0.5e-6");
    EXPECT_EQ(setup.params->dead_time, 3000);
    set("rated", "v_dc_V", "200");
    EXPECT_EQ(setup.plant.dclink.v_source_V, 200.0);
    EXPECT_EQ(setup.params->v_dc_nominal, 200000);
}

} // namespace
} // namespace pmsim
