// Sections of the complete plant: winding, legs, load and sensor, and what is refused.
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>

#include "tests/unit/pmsim/support.h"
#include "tools/pmsim/machine_file.h"

namespace pmsim
{
namespace
{

using testing::HasSubstr;
using testing::StartsWith;

const double pi = 3.14159265358979324;

// All that a machine file must say.
const char least[] =
    "name: m\n"
    "electrical: {R_s_ohm: 1, L_d0_H: 1.0e-3, L_q0_H: 1.0e-3, psi_m_Wb: 0.01, pole_pairs: 4}\n"
    "mechanics: {J_kgm2: 1.0e-5}\n";

pmsim::Setup machine(const std::string &more = "")
{
    return read_machine(Value::from_text(least + more, "m.yaml"));
}

std::string error_with(const std::string &more)
{
    return error_of([&] { machine(more); });
}

std::string drive_error(const pmsim::Setup &setup)
{
    return error_of([&] { require_drive(setup); });
}

TEST(WindingSection, LeastMachineIsAPlainStar)
{
    const plant_config_t plant = machine().plant;
    EXPECT_EQ(plant.winding.sets, 1);
    EXPECT_EQ(plant.winding.connection, PLANT_STAR);
    EXPECT_EQ(leg_count(plant), 3);
    EXPECT_EQ(plant.machine.c_A_Wb5, 0.0);
    EXPECT_EQ(plant.mech.B_Nms, 0.0);
    EXPECT_EQ(plant.winding.emf[0].order, 0);
}

TEST(WindingSection, ValuesReachThePlant)
{
    const plant_config_t plant =
        machine("winding:\n"
                "  emf: [{order: 5, psi_Wb: 2.0e-4, phase_deg: 180}, {order: 3, psi_Wb: 3.0e-4}]\n"
                "  cogging: [{order: 6, T_Nm: -0.01, phase_deg: 90}]\n"
                "  saliency: [{order: -4, L_H: 1.0e-5}]\n"
                "  zero_saliency: [{order: 5, L_H: 2.0e-5, phase_deg: -90}]\n"
                "  dR_ohm: [0.1, 0, -0.2]\n"
                "  dM_H: [0, 1.0e-6, 0]\n"
                "  emf_shift_deg: [0, 0, 90]\n"
                "inverter: {turn_off_s: 1.0e-7, c_leg_F: 2.0e-9}\n"
                "sensor: {shunt: low_side, neutral_divider_error: [0.02], divider_error: [0.01, 0, 0],\n"
                "  comparator_reference: half_link, comparator_offset_V: [0, 0, -0.1], "
                "comparator_blanking_s: 2.0e-6,\n"
                "  i_dc_full_scale_A: 20, i_dc_filter_s: 1.0e-4}\n"
                "dclink: {ripple_V: 3, ripple_Hz: 300}\n")
            .plant;
    EXPECT_EQ(plant.winding.emf[0].order, 5);
    EXPECT_EQ(plant.winding.emf[0].amplitude, 2.0e-4);
    EXPECT_NEAR(plant.winding.emf[0].phase_rad, pi, 1e-15);
    EXPECT_EQ(plant.winding.emf[1].order, 3);
    EXPECT_EQ(plant.winding.emf[2].order, 0);
    EXPECT_EQ(plant.winding.cogging[0].amplitude, -0.01);
    EXPECT_EQ(plant.winding.saliency[0].order, -4);
    EXPECT_EQ(plant.winding.zero_saliency[0].order, 5);
    EXPECT_EQ(plant.winding.zero_saliency[0].amplitude, 2.0e-5);
    EXPECT_NEAR(plant.winding.zero_saliency[0].phase_rad, -pi / 2, 1e-15);
    EXPECT_EQ(plant.winding.dR_ohm[2], -0.2);
    EXPECT_EQ(plant.winding.dM_H[0][1], 1.0e-6);
    EXPECT_NEAR(plant.winding.emf_shift_rad[2], pi / 2, 1e-15);
    EXPECT_EQ(plant.inverter.turn_off_s, 1.0e-7);
    EXPECT_EQ(plant.sensor.shunt, PLANT_LOW_SIDE);
    EXPECT_EQ(plant.sensor.comparator_reference, PLANT_REFERENCE_HALF_LINK);
    EXPECT_EQ(plant.sensor.comparator_offset_V[2], -0.1);
    EXPECT_EQ(plant.sensor.comparator_blanking_s, 2.0e-6);
    EXPECT_EQ(plant.sensor.i_dc_full_scale_A, 20.0);
    EXPECT_EQ(plant.sensor.i_dc_filter_s, 1.0e-4);
    EXPECT_EQ(plant.sensor.divider_error[0], 0.01);
    EXPECT_EQ(plant.sensor.divider_error[PLANT_LEGS], 0.02);
    EXPECT_EQ(plant.dclink.ripple_Hz, 300.0);
}

// METHODS-ADDENDUM.md E2.
TEST(WindingSection, RefusesOrdersThatThreeEqualPhasesCannotHave)
{
    const auto error = [](const char *list, const char *order) {
        return error_with(std::string("winding: {") + list + ": [{order: " + order + ", L_H: 1.0e-5}]}\n");
    };
    for (const char *order : {"2", "5", "8", "11", "-1", "-4", "-7", "-10", "998"}) {
        EXPECT_EQ(error("saliency", order), "no error") << order;
        EXPECT_EQ(error("zero_saliency", order), "no error") << order;
    }
    EXPECT_EQ(
        error("saliency", "4"),
        "m.yaml:4:30: 4 is no order of a winding of three equal phases: it can have 2, 5, 8, 11 ... and "
        "-1, -4, -7, -10 ...; did you mean -4?");
    EXPECT_EQ(
        error("zero_saliency", "6"),
        "m.yaml:4:35: 6 is no order of a winding of three equal phases: it can have 2, 5, 8, 11 ... and "
        "-1, -4, -7, -10 ...");
    EXPECT_THAT(error("saliency", "-2"), HasSubstr("did you mean 2?"));
    EXPECT_THAT(error("saliency", "0"), HasSubstr("0 is no order"));
    EXPECT_THAT(error("saliency", "-1000"), HasSubstr("out of range"));
}

// A list is as long as the machine has phases or legs, wherever `sets` stands in the file.
TEST(WindingSection, ListsFollowTheMachine)
{
    const pmsim::Setup two = machine("winding: {dL_H: [0, 0, 0, 0, 0, 1.0e-5], sets: 2}\n"
                                     "sensor: {offset_A: [1, 2, 3, 4, 5, 6]}\n");
    EXPECT_EQ(leg_count(two.plant), 6);
    EXPECT_EQ(two.plant.winding.dL_H[5], 1.0e-5);
    EXPECT_EQ(two.plant.sensor.offset_A[5], 6.0);
    const pmsim::Setup open = machine("winding: {connection: open, L_0_H: 1.0e-4, dL_H: [0, 0, 0]}\n"
                                      "sensor: {offset_A: [1, 2, 3, 4, 5, 6]}\n");
    EXPECT_EQ(leg_count(open.plant), 6);
    EXPECT_EQ(error_with("winding: {sets: 2, dL_H: [0, 0, 0]}\n"),
              "m.yaml:4:26: expected one value per phase: [a, b, c, x, y, z]");
    EXPECT_EQ(error_with("winding: {sets: 2, dM_H: [0]}\n"),
              "m.yaml:4:26: expected one value per pair: [ab, bc, ca, xy, yz, zx]");
    EXPECT_EQ(error_with("winding: {sets: 2}\nsensor: {gain_error: [0, 0, 0]}\n"),
              "m.yaml:5:22: expected one value per leg: [a, b, c, x, y, z]");
    EXPECT_EQ(error_with("sensor: {gain_error: [0, 0, 0, 0, 0, 0]}\n"),
              "m.yaml:4:22: expected one value per leg: [a, b, c]");
}

// EMF over angle: -d psi_A / d theta against the trapezoid itself, drawn by hand. What lies beyond order 31
// rounds the corners off, by 2 %.
TEST(WindingSection, TrapezoidIsOne)
{
    const pmsim::Setup setup = machine("winding: {trapezoid_flat_deg: 120}\n");
    const double psi_m = setup.plant.machine.psi_m_Wb;
    const double height = psi_m * pi / 4.0 * (pi / 6.0) / std::sin(pi / 6.0); // its fundamental is psi_m
    for (int deg = 0; deg < 360; ++deg) {
        const double x = deg < 180 ? deg : 360.0 - deg;
        const double shape = std::fmin(std::fmin(x, 180.0 - x) / 30.0, 1.0);
        const double expected = (deg < 180 ? 1.0 : -1.0) * height * shape;
        double emf = psi_m * std::sin(deg * pi / 180.0);
        for (const plant_harmonic_t &h : setup.plant.winding.emf) {
            emf += h.order * h.amplitude * std::sin(h.order * deg * pi / 180.0 + h.phase_rad);
        }
        EXPECT_NEAR(emf, expected, 0.021 * height) << deg;
    }
    EXPECT_EQ(setup.plant.winding.emf[0].order, 3);
    EXPECT_EQ(setup.plant.winding.emf[14].order, 31);
    EXPECT_EQ(setup.plant.winding.emf[15].order, 0);
}

// Its harmonics are fractions of psi_m, whenever that is set; a list of harmonics takes its place.
TEST(WindingSection, TrapezoidFollowsTheMagnets)
{
    pmsim::Setup setup = machine("winding: {trapezoid_flat_deg: 120}\n");
    const double before = setup.plant.winding.emf[0].amplitude;
    read_setting(setup, "electrical", "psi_m_Wb", Value::from_text("0.02", "t"));
    EXPECT_NEAR(setup.plant.winding.emf[0].amplitude, 2.0 * before, 1e-12 * before);
    read_setting(setup, "winding", "emf", Value::from_text("[]", "t"));
    read_setting(setup, "electrical", "psi_m_Wb", Value::from_text("0.01", "t"));
    EXPECT_EQ(setup.plant.winding.emf[0].order, 0);
    EXPECT_EQ(error_with("winding: {emf: [], trapezoid_flat_deg: 120}\n"),
              "m.yaml:4:20: a trapezoid is a list of harmonics: it cannot stand beside emf");
}

TEST(WindingSection, SquareAndTriangleAreTheLimits)
{
    const pmsim::Setup square = machine("winding: {trapezoid_flat_deg: 180}\n"); // EMF of order n: 1/n
    EXPECT_NEAR(3.0 * square.plant.winding.emf[0].amplitude, 0.01 / 3.0, 1e-15);
    const pmsim::Setup triangle = machine("winding: {trapezoid_flat_deg: 0}\n"); // -1/9, 1/25
    EXPECT_NEAR(3.0 * triangle.plant.winding.emf[0].amplitude, -0.01 / 9.0, 1e-15);
    EXPECT_NEAR(5.0 * triangle.plant.winding.emf[1].amplitude, 0.01 / 25.0, 1e-15);
}

TEST(WindingSection, ErrorsNameThePlace)
{
    EXPECT_EQ(error_with("winding: {emf: [{order: 3, psi_mWb: 1}]}\n"),
              "m.yaml:4:28: unknown key \"psi_mWb\": wrong unit; did you mean \"psi_Wb\"?");
    EXPECT_EQ(error_with("winding: {emf: [{order: 3}]}\n"), "m.yaml:4:17: key \"psi_Wb\" is missing");
    EXPECT_EQ(error_with("winding: {emf: [{order: 1, psi_Wb: 0}]}\n"),
              "m.yaml:4:25: 1 is out of range 2 ... 999");
    EXPECT_EQ(error_with("winding: {emf: [{order: 3, psi_Wb: 0}, {order: 3, psi_Wb: 1}]}\n"),
              "m.yaml:4:48: order 3 stands here a second time");
    EXPECT_EQ(error_with("winding: {connection: delta}\n"),
              "m.yaml:4:23: \"delta\" is not known here; one of: star, open");
    EXPECT_EQ(error_with("winding: {sets: 3}\n"), "m.yaml:4:17: 3 is out of range 1 ... 2");
    EXPECT_EQ(error_with("windings: {sets: 2}\n"),
              "m.yaml:4:1: unknown key \"windings\"; did you mean \"winding\"?");
    EXPECT_EQ(error_with("winding: {R_eddy_mohm: 2}\n"),
              "m.yaml:4:11: unknown key \"R_eddy_mohm\": wrong unit; did you mean \"R_eddy_ohm\"?");
    EXPECT_THAT(error_with("sensor: {shunt: inline}\n"), StartsWith("m.yaml:4:17: \"inline\" is not known"));
    EXPECT_EQ(error_with("sensor: {comparator_reference: link}\n"),
              "m.yaml:4:32: \"link\" is not known here; one of: mean, half_link, neutral");
    std::string many = "winding: {cogging: [{order: 1, T_Nm: 0}";
    for (int n = 2; n <= 17; ++n) {
        many += ", {order: " + std::to_string(n) + ", T_Nm: 0}";
    }
    EXPECT_EQ(error_with(many + "]}\n"), "m.yaml:4:20: at most 16 harmonics");
}

// As a table would: in place of L_d0, L_q0, c and psi_m.
const char mapped[] =
    "name: m\n"
    "flux_map: {psi_d_Vs: \"0.1 + L_d*i_d\", psi_q_Vs: \"0.006*i_q\", i_max_A: 10, constants: {L_d: 0.004}}\n"
    "electrical: {R_s_ohm: 1, pole_pairs: 4}\n"
    "mechanics: {J_kgm2: 1.0e-5}\n";

TEST(FluxMapSection, TakesThePlaceOfTheEnergyForm)
{
    const pmsim::Setup setup = read_machine(
        Value::from_text(std::string(mapped) + "winding: {trapezoid_flat_deg: 180}\n", "m.yaml"));
    map_point_t point;
    map_table_eval(setup.plant.map, dq_t{2.0, 3.0}, 0.0, &point);
    EXPECT_NEAR(point.psi_Wb.d, 0.108, 1e-9);
    EXPECT_NEAR(point.psi_Wb.q, 0.018, 1e-9);
    EXPECT_NEAR(setup.plant.winding.emf[0].amplitude, 0.1 / 9.0, 1e-9); // of the map's magnets
    const pmsim::Setup copy = setup;
    EXPECT_EQ(copy.plant.map, setup.flux_map->table.get()); // shared, so that it outlives either
}

TEST(FluxMapSection, OneOrTheOther)
{
    const auto error = [](const std::string &from, const std::string &to) {
        return error_of([&] { read_machine(Value::from_text(replaced(mapped, from, to), "m.yaml")); });
    };
    EXPECT_EQ(error("R_s_ohm: 1,", "R_s_ohm: 1, psi_m_Wb: 0.1,"),
              "m.yaml:3:36: the flux map stands for psi_m_Wb: give one or the other");
    EXPECT_EQ(error("flux_map: {psi_d_Vs", "# {psi_d_Vs"), "m.yaml:3:13: key \"L_d0_H\" is missing");
    EXPECT_EQ(
        error("flux_map: {psi_d_Vs: \"0.1 + L_d*i_d\", psi_q_Vs: \"0.006*i_q\", i_max_A: 10, constants: "
              "{L_d: 0.004}}",
              "flux_map: {table: none.csv}"),
        "none.csv: cannot be read, or is empty");
}

// Finite-element data of real machines, where they lie beside the project.
TEST(FluxMapSection, RealMachinesLoad)
{
    const std::pair<const char *, double> machines[] = {{"thor_pmsyrm", 0.1334},
                                                        {"pm270l8", 0.1618}}; // psi_m
    for (const auto &[name, psi_m_Wb] : machines) {
        if (!std::filesystem::exists("../shared/data/README.md")) {
            GTEST_SKIP() << "no ../shared/data: " << name << " is not tested";
        }
        const pmsim::Setup setup = load_machine_file(std::string("tests/data/machines/") + name + ".yaml");
        const double moved_Wb = setup.flux_map->report.moved_Wb; // to make the data reciprocal
        EXPECT_NEAR(setup.flux_map->psi_m_Wb, psi_m_Wb, moved_Wb + 1e-4) << name;
        const char *error = nullptr;
        plant_t *plant = plant_create(&setup.plant, 0.0, &error);
        EXPECT_NE(plant, nullptr) << name << ": " << error;
        plant_destroy(plant);
    }
}

TEST(WindingSection, TheDriveNeedsMore)
{
    EXPECT_EQ(drive_error(machine()), "m.yaml: rated.i_rated_A is missing: the drive cannot run this machine "
                                      "without it; complete it first: pmsim tune FILE -o tuned.yaml");
    EXPECT_EQ(drive_error(machine("rated: {i_rated_A: 5, speed_rated_rad_s: 100, torque_rated_Nm: 0.3, "
                                  "v_dc_V: 24}\n")),
              "m.yaml: drive.pole_pairs is missing: the drive cannot run this machine without it; complete "
              "it first: pmsim tune FILE -o tuned.yaml");
    EXPECT_EQ(drive_error(machine("sensor: {shunt: single_shunt}\n")),
              "m.yaml: the drive cannot measure with a single shunt yet");
    for (const char *name : {"ipm_1000", "dtp_400", "ow_400"}) {
        EXPECT_EQ(drive_error(load_machine_file(std::string("sim_plant/machines/") + name + ".yaml")),
                  "no error");
    }
    EXPECT_EQ(
        error_with("rated: {i_rated_A: 5}\n"),
        "m.yaml:4:8: key \"speed_rated_rad_s\" is missing; complete it first: pmsim tune FILE -o tuned.yaml");
}

// Messages of the plant in the words of the file, at the key if the file has it.
TEST(WindingSection, ThePlantsMessagesNameTheKey)
{
    const pmsim::Setup setup = machine("inverter: {dead_time_s: 1.0e-5}\n");
    const auto refusal = [&](const char *reason) { return error_of([&] { refuse_plant(setup, reason); }); };
    EXPECT_EQ(refusal("inverter.dead_time_s must be less than half a PWM period"),
              "m.yaml:4:25: inverter.dead_time_s must be less than half a PWM period");
    EXPECT_EQ(refusal("mech.J_kgm2 must be positive"), "m.yaml:3:21: mechanics.J_kgm2 must be positive");
    EXPECT_EQ(refusal("machine.L_d0_H must be positive"), "m.yaml:2:34: electrical.L_d0_H must be positive");
    EXPECT_EQ(refusal("tolerance must be small"), "m.yaml: solver.tolerance must be small");
    EXPECT_EQ(refusal("winding.emf_shift_rad must be finite"),
              "m.yaml: winding.emf_shift_deg must be finite");
}

} // namespace
} // namespace pmsim
