#include "tools/pmsim/flux_map.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include <gmock/gmock.h>

#include "tests/support/temporary_file.h"
#include "tests/unit/pmsim/support.h"
#include "tools/pmsim/machine_file.h"

namespace pmsim
{
namespace
{

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

// A smooth formula is followed to this part of its largest flux (flux_formula.h).
const double formula_tolerance = 1e-8;

// IPM-1000 (METHODS 14): currents of a flux by the energy form of METHODS 0.2 E1.
const double L_d0 = 46.3e-3, L_q0 = 76.9e-3, c = 105.0, psi_m = 0.236;

dq_t ipm_current(dq_t psi)
{
    const double s = c * std::pow(psi.d * psi.d + psi.q * psi.q, 2);
    return {psi.d * (1 / L_d0 + s) - psi_m * (1 / L_d0 + c * std::pow(psi_m, 4)), psi.q * (1 / L_q0 + s)};
}

const char ipm_formula[] =
    "i_d_A: \"psi_d/L_d0 + c*psi_d*(psi_d^2 + psi_q^2)^2 - (psi_m/L_d0 + c*psi_m^5)\"\n"
    "i_q_A: \"psi_q/L_q0 + c*psi_q*(psi_d^2 + psi_q^2)^2\"\n"
    "i_max_A: 12\n"
    "constants: {L_d0: 46.3e-3, L_q0: 76.9e-3, c: 105, psi_m: 0.236}\n";

// A saturating pair of formulas: the gradient of a co-energy.
const char tanh_formula[] = "psi_d_Vs: \"0.2 + L*i_d + 0.05*tanh((i_d + 0.2*i_q)/6)\"\n"
                            "psi_q_Vs: \"L*i_q + 0.01*tanh((i_d + 0.2*i_q)/6) + 0.3*atan(i_q/5)\"\n"
                            "i_max_A: 12\n"
                            "constants: {L: 5e-3}\n";

dq_t tanh_flux(double i_d, double i_q)
{
    const double t = std::tanh((i_d + 0.2 * i_q) / 6);
    return {0.2 + 5e-3 * i_d + 0.05 * t, 5e-3 * i_q + 0.01 * t + 0.3 * std::atan(i_q / 5)};
}

FluxMap read(const std::string &text, const std::string &name = "m.yaml")
{
    return read_flux_map(Value::from_text(text, name));
}

map_point_t at(const FluxMap &map, double i_d, double i_q, double theta = 0.0)
{
    map_point_t point;
    map_table_eval(map.table.get(), dq_t{i_d, i_q}, theta, &point);
    return point;
}

class FluxMapTable : public testing::Test
{
  protected:
    FluxMapTable()
    {
        fs::create_directories(folder_);
    }

    // Reads the section with the CSV file beside its machine file.
    FluxMap read_csv(const std::string &csv, const std::string &options = "") const
    {
        std::ofstream(folder_ / "map.csv", std::ios::binary) << csv;
        return read("table: map.csv\n" + options, (folder_ / "m.yaml").string());
    }

    // The refusal, without the folder.
    std::string refusal(const std::string &csv, const std::string &options = "") const
    {
        const std::string message = error_of([&] { read_csv(csv, options); });
        const std::string prefix = (folder_ / "").string();
        return message.compare(0, prefix.size(), prefix) == 0 ? message.substr(prefix.size()) : message;
    }

    const tests::TemporaryFile place_{"flux_map"};
    const fs::path folder_ = place_.path();
};

using Flux = std::function<dq_t(double i_d, double i_q, double theta_rad)>;

std::string row(const Flux &flux, double i_d, double i_q)
{
    const dq_t psi = flux(i_d, i_q, 0.0);
    std::ostringstream out;
    out.precision(15);
    out << i_d << "," << i_q << "," << psi.d << "," << psi.q << "\n";
    return out.str();
}

dq_t linear(double i_d, double i_q, double)
{
    return {0.1 + 0.004 * i_d, 0.006 * i_q};
}

const char header[] = "i_d_A,i_q_A,psi_d_Vs,psi_q_Vs\n";

// 4 x 5 points: lines 2 to 21, i_d = -6 ... 3, i_q = -4 ... 4.
std::string table(const Flux &flux = linear, double i_q_from = -4.0)
{
    std::string csv = header;
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 5; ++j) {
            csv += row(flux, 3.0 * i - 6.0, i_q_from + 2.0 * j);
        }
    }
    return csv;
}

// --- tables ---

TEST_F(FluxMapTable, ReadsALinearMachineExactly)
{
    const FluxMap map = read_csv(table());
    EXPECT_EQ(map.note, "");
    EXPECT_NEAR(map.psi_m_Wb, 0.1, 1e-15);
    EXPECT_EQ(map.low_A.d, -6.0);
    EXPECT_EQ(map.high_A.d, 3.0);
    EXPECT_EQ(map.low_A.q, -4.0);
    EXPECT_EQ(map.high_A.q, 4.0);
    const map_point_t m = at(map, -4.3, 1.7);
    EXPECT_NEAR(m.psi_Wb.d, 0.1 - 4.3 * 0.004, 1e-14);
    EXPECT_NEAR(m.L_q_H, 0.006, 1e-14);
    EXPECT_NEAR(map.report.L_min_H, 0.004, 1e-12);
}

TEST_F(FluxMapTable, TakesRowsAndColumnsInAnyOrderAndWebers)
{
    std::string csv = "torque_Nm,psi_q_Wb,psi_d_Wb,i_q_A,i_d_A\n";
    for (int k = 19; k >= 0; --k) {
        const double i_d = 3.0 * (k / 5) - 6.0, i_q = 2.0 * (k % 5) - 4.0;
        const dq_t psi = linear(i_d, i_q, 0.0);
        csv += "0," + std::to_string(psi.q) + "," + std::to_string(psi.d) + "," + std::to_string(i_q) + "," +
               std::to_string(i_d * (1 + 1e-9 * k)) + "\n";
    }
    const map_point_t m = at(read_csv(csv), -4.3, 1.7);
    EXPECT_NEAR(m.psi_Wb.d, 0.1 - 4.3 * 0.004, 1e-6);
    EXPECT_NEAR(m.psi_Wb.q, 0.006 * 1.7, 1e-6);
}

TEST_F(FluxMapTable, MirrorsTheOtherHalf)
{
    const Flux curved = [](double i_d, double i_q, double) {
        return dq_t{0.1 + 0.004 * i_d - 1e-4 * i_q * i_q, 0.006 * i_q - 2e-4 * i_d * i_q};
    };
    std::string csv = table(curved, 0.0);
    const FluxMap map = read_csv(csv, "mirror_q: true\n");
    EXPECT_EQ(map.low_A.q, -8.0);
    for (double i_q = 0.3; i_q < 8.0; i_q += 0.6) {
        const map_point_t p = at(map, -2.2, i_q), n = at(map, -2.2, -i_q);
        EXPECT_NEAR(p.psi_Wb.d, n.psi_Wb.d, 1e-13);
        EXPECT_NEAR(p.psi_Wb.q, -n.psi_Wb.q, 1e-13);
        EXPECT_NEAR(p.psi_Wb.q, curved(-2.2, i_q, 0.0).q, 1e-12);
    }
    EXPECT_THAT(refusal(table(), "mirror_q: true\n"),
                StartsWith("map.csv:2: mirror_q needs a table that begins"));
    csv = replaced(csv, "-3,0,0.088,0\n",
                   "-3,0,0.088,0.01\n"); // ninth line: -6 has lines 2 to 6, -3 begins at 7
    EXPECT_THAT(refusal(csv, "mirror_q: true\n"),
                StartsWith("map.csv:7: psi_q at i_q_A = 0 is not symmetrical"));
}

// 8 angles of a sixth harmonic: rows by angle fastest
std::string angle_table(double first, double step, int count = 8)
{
    std::string csv = "i_d_A,i_q_A,theta_e_deg,psi_d_Vs,psi_q_Vs\n";
    for (int k = 0; k < 20; ++k) {
        for (int n = 0; n < count; ++n) {
            const double i_d = 3.0 * (k / 5) - 6.0, i_q = 2.0 * (k % 5), deg = first + step * n;
            const double x = 6 * deg * std::acos(-1.0) / 180;
            csv += std::to_string(i_d) + "," + std::to_string(i_q) + "," + std::to_string(deg) + "," +
                   std::to_string(0.1 + 0.004 * i_d + 0.003 * std::cos(x)) + "," +
                   std::to_string(0.006 * i_q + 0.002 * std::sin(2 * x)) + "\n";
        }
    }
    return csv;
}

TEST_F(FluxMapTable, ReadsAngles)
{
    const FluxMap map = read_csv(angle_table(0, 7.5), "mirror_q: true\n");
    for (const double i_q : {-5.0, 0.0, 3.3}) {
        const map_point_t m = at(map, 1.1, i_q, 0.3);
        EXPECT_NEAR(m.psi_Wb.d, 0.1 + 0.0044 + 0.003 * std::cos(1.8), 3e-6); // six digits in the file
        EXPECT_NEAR(m.psi_Wb.q, 0.006 * i_q + 0.002 * std::sin(3.6), 3e-6);
    }
    EXPECT_NEAR(map.psi_m_Wb, 0.1, 3e-6);
    EXPECT_THAT(refusal(angle_table(1, 7.5)), StartsWith("map.csv:2: theta_e_deg begins at 1, expected 0"));
    EXPECT_THAT(refusal(angle_table(0, 7)), StartsWith("map.csv:9: theta_e_deg covers 56 degrees"));
    const std::string uneven = replaced(angle_table(0, 7.5), "37.500000", "37.700000");
    EXPECT_THAT(refusal(uneven),
                StartsWith("map.csv:7: theta_e_deg is not equally spaced: expected 45, found 37.7"));
}

TEST_F(FluxMapTable, RefusalsNameFileAndLine)
{
    const std::string good = table();
    EXPECT_THAT(refusal(""), StartsWith("map.csv: cannot be read, or is empty"));
    EXPECT_THAT(refusal(header), StartsWith("map.csv: there are no rows"));
    EXPECT_THAT(refusal(replaced(good, "psi_d_Vs", "psi_d_mVs")), StartsWith("map.csv:1: "));
    EXPECT_THAT(refusal(replaced(good, "psi_d_Vs", "psi_d_mVs")), HasSubstr("wrong unit"));
    EXPECT_THAT(refusal(replaced(good, "psi_d_Vs", "psi_d_Wb")), HasSubstr("psi_q_Vs"));
    EXPECT_THAT(refusal(replaced(good, ",psi_q_Vs", ",torque_Nm")),
                StartsWith("map.csv:1: column \"psi_q_Vs\""));
    EXPECT_THAT(refusal(good + "1,2,3\n"), StartsWith("map.csv:22: expected 4 values, found 3"));
    EXPECT_THAT(refusal(replaced(good, "-6,0,", "-6,zero,")), StartsWith("map.csv:4: expected a number"));
    EXPECT_THAT(refusal(replaced(good, "-6,0,0.076", "-6,0,nan")), StartsWith("map.csv:4: "));
    EXPECT_THAT(
        refusal(good + row(linear, 3, 4)),
        StartsWith("map.csv:22: the point i_d_A = 3, i_q_A = 4 stands here a second time; first at line 21"));
    EXPECT_THAT(refusal(replaced(good, row(linear, -3, 2), "")),
                StartsWith("map.csv:10: before this row the point i_d_A = -3, i_q_A = 2 is missing"));
    EXPECT_THAT(refusal(replaced(good, row(linear, 3, 4), "")),
                StartsWith("map.csv:20: after this row the point i_d_A = 3, i_q_A = 4 is missing"));
    EXPECT_THAT(refusal(header + row(linear, 0, 0)), StartsWith("map.csv: a flux map needs at least 4"));
    EXPECT_THAT(refusal(replaced(good, "-3,4,0.088", "-3,4,0.01")),
                StartsWith("map.csv:11: the tangent inductance"));
    EXPECT_THAT(refusal(table(linear, 1.0)), StartsWith("map.csv: zero current is not within the table"));
    EXPECT_THAT(error_of([&] { read("table: none.csv"); }), StartsWith("none.csv: cannot be read"));
}

TEST_F(FluxMapTable, ReportsOrRefusesDataThatAreNotReciprocal)
{
    const auto turning = [](double a) {
        return Flux([a](double i_d, double i_q, double) {
            return dq_t{0.1 + 0.005 * i_d - a * i_q, 0.005 * i_q + a * i_d};
        });
    };
    const FluxMap map = read_csv(table(turning(1e-4))); // 2a / L = 4 %
    EXPECT_THAT(map.note, HasSubstr("map.csv: not reciprocal: the cross inductances differ by 4 %"));
    EXPECT_THAT(map.note, HasSubstr("mVs"));
    EXPECT_NEAR(map.report.reciprocity, 0.04, 1e-9);
    EXPECT_THAT(
        refusal(table(turning(2e-4))),
        StartsWith("map.csv: not reciprocal: the cross inductances differ by 8 % of the self-inductance "
                   "(rms), more than reciprocity_max = 5 %"));
    EXPECT_GT(read_csv(table(turning(2e-4)), "reciprocity_max: 0.1\n").report.moved_Wb, 0.0);
    EXPECT_THAT(refusal(table(turning(1e-4)), "reciprocity_max: 0.01\n"), HasSubstr("reciprocity_max = 1 %"));
    EXPECT_THAT(refusal(table(), "reciprocity_max: 2\n"), HasSubstr("m.yaml:2:18: 2 is out of range"));
}

// --- slips of axes and units ---

// From the name of the table on.
std::string without_folder(const std::string &warning)
{
    const size_t name = warning.find("map.csv");
    return name == std::string::npos ? warning : warning.substr(name);
}

// A table over -12 ... 12 A, with a torque column (0: without) of a machine with 3 pole pairs.
std::string machine_table(const Flux &flux, double torque, double by_flux = 1.0, double by_current = 1.0)
{
    std::string csv = torque != 0.0 ? "i_d_A,i_q_A,psi_d_Vs,psi_q_Vs,torque_Nm\n" : header;
    for (int k = 0; k < 25; ++k) {
        const double i_d = 6.0 * (k / 5) - 12.0, i_q = 6.0 * (k % 5) - 12.0;
        const dq_t psi = flux(i_d, i_q, 0.0);
        csv += std::to_string(by_current * i_d) + "," + std::to_string(by_current * i_q) + "," +
               std::to_string(by_flux * psi.d) + "," + std::to_string(by_flux * psi.q);
        csv += (torque != 0.0 ? "," + std::to_string(torque * 1.5 * 3 * (psi.d * i_q - psi.q * i_d)) : "") +
               "\n";
    }
    return csv;
}

TEST_F(FluxMapTable, WarnsOfMagnetsOffTheirAxis)
{
    const auto warning = [this](const Flux &flux) {
        return without_folder(flux_table_warning(read_csv(machine_table(flux, 0.0)), 1.0, 3));
    };
    const auto magnets = [](double d, double q) {
        return Flux([=](double i_d, double i_q, double) { return dq_t{d + 0.004 * i_d, q + 0.006 * i_q}; });
    };
    EXPECT_EQ(warning(magnets(0.1, 0.0)), "");
    EXPECT_EQ(warning(magnets(0.1, 0.01)), ""); // 6 degrees
    EXPECT_EQ(warning(magnets(0.0, 0.0)), "");  // a reluctance machine
    EXPECT_EQ(warning(magnets(0.0, 1e-3)), ""); // of 73 mVs: what a field solver leaves
    EXPECT_EQ(warning(magnets(0.005, 0.1)),
              "map.csv: at zero current psi_d = 0.005 Vs and psi_q = 0.1 Vs: the magnets "
              "lie on the q axis; expected is +d, with q 90 degrees ahead");
    EXPECT_THAT(warning(magnets(0.01, -0.1)), HasSubstr("psi_q = -0.1 Vs: the magnets lie on the q axis"));
    EXPECT_THAT(warning(magnets(-0.1, 0.0)), HasSubstr("map.csv: at zero current psi_d = -0.1 Vs"));
    EXPECT_THAT(warning(magnets(-0.1, 0.0)), HasSubstr("the magnets point along -d"));
    EXPECT_THAT(warning(magnets(0.1, 0.0364)), HasSubstr("the magnets lie 20 degrees off the d axis"));
}

TEST_F(FluxMapTable, WarnsOfAScaleOffByAThousand)
{
    const auto warning = [this](double torque, double by_flux, double by_current) {
        return without_folder(
            flux_table_warning(read_csv(machine_table(linear, torque, by_flux, by_current)), 1.0, 3));
    };
    for (const double torque : {0.0, 1.0}) {
        EXPECT_EQ(warning(torque, 1.0, 1.0), "");
        for (const double by : {1e3, 1e-3}) {
            EXPECT_THAT(warning(torque, by, 1.0), StartsWith("map.csv: ")) << torque << by;
            EXPECT_THAT(warning(torque, by, 1.0), HasSubstr("off")) << torque << by;
            EXPECT_THAT(warning(torque, 1.0, by), HasSubstr("in scale?")) << torque << by;
        }
    }
    EXPECT_THAT(warning(1.0, 1e3, 1.0), HasSubstr("torque_Nm is 0.001 times 1.5 P (psi_d i_q - psi_q i_d)"));
    EXPECT_THAT(warning(0.0, 1e3, 1.0), HasSubstr("off by 1000 in scale?"));
    EXPECT_THAT(warning(-1.0, 1.0, 1.0), HasSubstr("torque_Nm has the other sign"));
    EXPECT_THAT(flux_table_warning(read_csv(machine_table(linear, 1.0)), 1.0, 12), HasSubstr("pole_pairs"));
}

// --- formulas ---

TEST(FluxMapFormula, OfCurrents)
{
    const FluxMap map = read(tanh_formula);
    EXPECT_EQ(map.note, "");
    EXPECT_NEAR(map.psi_m_Wb, 0.2, formula_tolerance);
    EXPECT_EQ(map.high_A.q, 12.0);
    double worst = 0.0;
    for (double i_d = -12.0; i_d <= 12.0; i_d += 0.173) {
        for (double i_q = -12.0; i_q <= 12.0; i_q += 0.181) {
            const dq_t psi = tanh_flux(i_d, i_q), found = at(map, i_d, i_q).psi_Wb;
            worst = std::max({worst, std::fabs(found.d - psi.d), std::fabs(found.q - psi.q)});
        }
    }
    EXPECT_LT(worst, formula_tolerance * tanh_flux(12, 12).q);
    std::printf("formula of currents followed to %.2g Wb\n", worst);
}

TEST(FluxMapFormula, OfFluxesIsTheEnergyForm)
{
    const FluxMap map = read(ipm_formula);
    EXPECT_EQ(map.note, "");
    EXPECT_NEAR(map.psi_m_Wb, psi_m, formula_tolerance * psi_m);
    double worst = 0.0, worst_L = 0.0;
    for (double i_d = -12.0; i_d <= 12.0; i_d += 0.173) {
        for (double i_q = -12.0; i_q <= 12.0; i_q += 0.181) {
            const map_point_t m = at(map, i_d, i_q);
            const dq_t i = ipm_current(m.psi_Wb); // back again: an error of the flux is one of i/L
            worst = std::max({worst, std::fabs(i.d - i_d) * m.L_d_H, std::fabs(i.q - i_q) * m.L_q_H});
            // the tangent is the inverse of that of the formula
            const dq_t p = m.psi_Wb;
            const double p2 = p.d * p.d + p.q * p.q, dd = 1 / L_d0 + c * p2 * (p2 + 4 * p.d * p.d);
            const double qq = 1 / L_q0 + c * p2 * (p2 + 4 * p.q * p.q), dq = 4 * c * p2 * p.d * p.q;
            worst_L = std::max(worst_L, std::fabs(m.L_d_H - qq / (dd * qq - dq * dq)));
        }
    }
    EXPECT_LT(worst, 2 * formula_tolerance * 0.55); // two currents of one flux
    EXPECT_LT(worst_L, 1e-6 * L_d0);
    std::printf("energy form followed to %.2g Wb, L_d to %.2g H\n", worst, worst_L);
}

TEST(FluxMapFormula, FormsAgree)
{
    // one linear machine three ways; the table is in FluxMapTable
    const FluxMap fluxes = read("psi_d_Vs: 0.1 + 0.004*i_d\npsi_q_Vs: 0.006*i_q\ni_max_A: 5\n");
    const FluxMap currents = read("i_d_A: (psi_d - 0.1)/0.004\ni_q_A: psi_q/0.006\ni_max_A: 5\n");
    for (double i = -5.0; i <= 5.0; i += 0.37) {
        const map_point_t a = at(fluxes, i, -0.7 * i), b = at(currents, i, -0.7 * i);
        EXPECT_NEAR(a.psi_Wb.d, 0.1 + 0.004 * i, 1e-13);
        EXPECT_NEAR(b.psi_Wb.d, 0.1 + 0.004 * i, 1e-12);
        EXPECT_NEAR(a.L_d_H, b.L_d_H, 1e-11);
        EXPECT_NEAR(a.coenergy_J, b.coenergy_J, 1e-11);
    }
}

// Worst difference of a map's flux from that of formulas, over a square of currents.
template <class Formula> double worst_Wb(const FluxMap &map, double i_max_A, Formula formula)
{
    double worst = 0.0;
    for (double i_d = -i_max_A; i_d <= i_max_A; i_d += 0.0137 * i_max_A) {
        for (double i_q = -i_max_A; i_q <= i_max_A; i_q += 0.0171 * i_max_A) {
            const dq_t psi = formula(i_d, i_q), found = at(map, i_d, i_q).psi_Wb;
            worst = std::max({worst, std::fabs(found.d - psi.d), std::fabs(found.q - psi.q)});
        }
    }
    return worst;
}

// A step of the inductance at 2 A, which a map with continuous inductance passes within 1e-5 of its range.
TEST(FluxMapFormula, StepsOfTheInductanceAreFollowed)
{
    const FluxMap map = read("psi_d_Vs: 0.1 + 0.004*i_d\n"
                             "psi_q_Vs: \"abs(i_q) < 2 ? 0.006*i_q : 0.002*i_q + sign(i_q)*0.008\"\n"
                             "i_max_A: 8\n");
    const auto formula = [](double i_d, double i_q) {
        return dq_t{0.1 + 0.004 * i_d,
                    std::fabs(i_q) < 2 ? 0.006 * i_q : 0.002 * i_q + std::copysign(0.008, i_q)};
    };
    EXPECT_LT(worst_Wb(map, 8.0, formula), 1e-5 * 0.132);
    for (const double i_q : {-2.001, -1.999, 0.0, 1.999, 2.001}) {
        const double psi = formula(1.0, i_q).q;
        EXPECT_NEAR(at(map, 1.0, i_q).psi_Wb.q, psi, 1e-5 * 0.132);
        EXPECT_NEAR(at(map, 1.0, i_q).L_q_H, std::fabs(i_q) < 2 ? 0.006 : 0.002, 1e-6);
    }
}

// Saturation by |psi_d| and |psi_q|: where the magnets' flux is compensated, at i_d = -i_f and anywhere
// between the nodes of an even grid, the inductance has a kink.
struct Kinked {
    double i_max_A, step; // 60 |psi_d| in i_d is a step of the inductance
};

class FluxMapKinks : public testing::TestWithParam<Kinked>
{
};
INSTANTIATE_TEST_SUITE_P(Ranges, FluxMapKinks,
                         testing::Values(Kinked{28, 0}, Kinked{40, 0}, Kinked{60, 0}, Kinked{40, 60}));

TEST_P(FluxMapKinks, AreFollowed)
{
    const double i_max_A = GetParam().i_max_A, step = GetParam().step;
    const FluxMap map = read(
        "i_d_A: \"(100 + 400*abs(psi_d) + 300*abs(psi_d)*abs(psi_q)^3)*psi_d + step*abs(psi_d) - 17.3\"\n"
        "i_q_A: \"(20 + 150*abs(psi_q) + 300*abs(psi_d)^3*abs(psi_q))*psi_q\"\n"
        "i_max_A: " +
        std::to_string(i_max_A) + "\nconstants: {step: " + std::to_string(step) + "}\n");
    double worst = 0.0, most = 0.0;
    for (double i_d = -i_max_A; i_d <= i_max_A; i_d += 0.0137 * i_max_A) {
        for (double i_q = -i_max_A; i_q <= i_max_A; i_q += 0.0171 * i_max_A) {
            const map_point_t m = at(map, i_d, i_q);
            const double d = m.psi_Wb.d, q = m.psi_Wb.q, D = std::fabs(d), Q = std::fabs(q);
            const double e_d = (100 + 400 * D + 300 * D * Q * Q * Q) * d + step * D - 17.3 - i_d;
            const double e_q = (20 + 150 * Q + 300 * D * D * D * Q) * q - i_q;
            worst = std::max({worst, std::fabs(m.L_d_H * e_d + m.L_dq_H * e_q),
                              std::fabs(m.L_dq_H * e_d + m.L_q_H * e_q)});
            most = std::max({most, D, Q});
        }
    }
    std::printf("%g A: kinks followed to %.2g of the largest flux\n", i_max_A, worst / most);
    EXPECT_LT(worst / most, 1e-5);
}

// One that is not at a constant current is smoothed, and said.
TEST(FluxMapFormula, SlantingKinksAreFittedAndSaid)
{
    const FluxMap map = read("psi_d_Vs: \"0.1 + 0.004*i_d + 0.001*abs(i_d + 0.5*i_q - 1)\"\n"
                             "psi_q_Vs: \"0.006*i_q + 0.0005*abs(i_d + 0.5*i_q - 1)\"\n"
                             "i_max_A: 8\n");
    EXPECT_THAT(map.note,
                HasSubstr("made so by moving fluxes by up to")); // as a difference across it sees it
    const auto formula = [](double i_d, double i_q) {
        const double kink = std::fabs(i_d + 0.5 * i_q - 1);
        return dq_t{0.1 + 0.004 * i_d + 0.001 * kink, 0.006 * i_q + 0.0005 * kink};
    };
    EXPECT_LT(worst_Wb(map, 8.0, formula), 0.001 * 0.125); // spread over two steps of 1/8 A
}

TEST(FluxMapFormula, NotReciprocal)
{
    const std::string text = "i_max_A: 5\npsi_d_Vs: 0.1 + 0.005*i_d - a*i_q\npsi_q_Vs: 0.005*i_q + a*i_d\n";
    const FluxMap map = read(text + "constants: {a: 1e-4}\n");
    EXPECT_THAT(map.note, HasSubstr("m.yaml:2:11: not reciprocal: the cross inductances differ by 4 %"));
    EXPECT_THAT(error_of([&] { read(text + "constants: {a: 2e-4}\n"); }),
                StartsWith("m.yaml:2:11: not reciprocal: the cross inductances differ by 8 %"));
    EXPECT_NO_THROW(read(text + "constants: {a: 2e-4}\nreciprocity_max: 0.1\n"));
}

std::string formula_error(const std::string &psi_d, const std::string &rest = "")
{
    return error_of([&] { read("i_max_A: 5\npsi_q_Vs: 0.006*i_q\npsi_d_Vs: \"" + psi_d + "\"\n" + rest); });
}

TEST(FluxMapFormula, RefusalsNameLineAndColumn)
{
    EXPECT_EQ(formula_error("0.1 + 0.004*i_e"),
              "m.yaml:3:11: unknown name \"i_e\"; did you mean \"i_d\"?, at column 13 of the formula");
    EXPECT_THAT(formula_error("0.1 + psi_d"), HasSubstr("unknown name \"psi_d\""));
    EXPECT_EQ(formula_error("0.1 + 0.004*"),
              "m.yaml:3:11: the formula ends too early, at column 13 of the formula");
    EXPECT_THAT(formula_error("0.1 + (0.004*i_d"),
                HasSubstr("m.yaml:3:11: a parenthesis is missing, at column"));
    EXPECT_THAT(formula_error("0.1 + * i_d"), HasSubstr("\"*\" cannot stand here, at column 7"));
    EXPECT_THAT(formula_error("0.1 + 0.004*i_d)"), HasSubstr("at column 16"));
    EXPECT_THAT(formula_error("i_d = 3"), HasSubstr("\"=\" cannot stand here, at column 5"));
    EXPECT_THAT(formula_error("i_d, i_q"), HasSubstr("m.yaml:3:11: expected one formula, found 2"));
    EXPECT_THAT(formula_error(""), HasSubstr("m.yaml:3:11: "));
    EXPECT_THAT(formula_error("0.004*i_d \xc2\xb5"),
                HasSubstr("a character that no formula has, at column 11"));
    EXPECT_THAT(formula_error(std::string(3000, '1')), HasSubstr("longer than 2000"));
    EXPECT_THAT(formula_error("sqrt(i_d)"), HasSubstr("m.yaml:3:11: the flux is not finite at i_d = -"));
    EXPECT_THAT(formula_error("-0.004*i_d"),
                HasSubstr("m.yaml:3:11: the tangent inductance is not positive"));
    EXPECT_THAT(formula_error("k*i_d", "constants: {k: 4 mH}\n"), StartsWith("m.yaml:4:16: "));
    EXPECT_THAT(formula_error("k*i_d", "constants: {1k: 4}\n"),
                StartsWith("m.yaml:4:13: \"1k\" cannot be the name"));
    EXPECT_THAT(formula_error("k*i_d", "constants: {sin: 4}\n"),
                HasSubstr("cannot be the name of a constant"));
    EXPECT_THAT(formula_error("i_d", "constants: {i_q: 4}\n"), HasSubstr("is a variable here"));
    EXPECT_THAT(error_of([] { read("i_d_A: tanh(psi_d)\ni_q_A: psi_q\ni_max_A: 5\n"); }),
                StartsWith("m.yaml:1:8: no flux was found for i_d = "));
}

TEST(FluxMapFormula, RefusesUnclearSections)
{
    const auto error = [](const std::string &text) { return error_of([&] { read(text); }); };
    EXPECT_THAT(error("reciprocity_max: 0.1\n"), StartsWith("m.yaml:1:1: expected one of: table; psi_d_Vs"));
    EXPECT_THAT(error("table: a.csv\npsi_d_Vs: i_d\n"), StartsWith("m.yaml:1:1: expected one of"));
    EXPECT_THAT(error("table: a.csv\ni_max_A: 4\n"), StartsWith("m.yaml:2:1: unknown key \"i_max_A\""));
    EXPECT_THAT(error("psi_d_Wb: i_d\n"), StartsWith("m.yaml:1:1: unknown key \"psi_d_Wb\": wrong unit"));
    EXPECT_THAT(error("psi_d_Vs: i_d\ni_max_A: 4\n"), HasSubstr("key \"psi_q_Vs\" is missing"));
    EXPECT_THAT(error("psi_d_Vs: i_d\npsi_q_Vs: i_q\n"), HasSubstr("key \"i_max_A\" is missing"));
    EXPECT_THAT(error("psi_d_Vs: i_d\npsi_q_Vs: i_q\ni_max_A: -4\n"),
                StartsWith("m.yaml:3:10: -4 is out of range"));
}

// --- data of real machines ---

TEST(FluxMapData, Thor)
{
    const char *given = std::getenv("PMDRIVE_DATA");
    const fs::path folder = fs::absolute(given != nullptr ? given : "../shared/data");
    if (!fs::exists(folder / "thor_pmsyrm_fea_pm.csv")) {
        GTEST_SKIP() << "no data of real machines: set PMDRIVE_DATA to their folder";
    }
    for (const std::string name : {"thor_pmsyrm_fea_pm.csv", "thor_pmsyrm_fea_pm_theta60.csv"}) {
        const FluxMap map = read("table: " + name + "\nmirror_q: true\n", (folder / "m.yaml").string());
        std::printf("%s\n", map.note.c_str());
        EXPECT_NEAR(map.psi_m_Wb, 0.1334, 1.5e-3); // of the data's README
        EXPECT_NEAR(map.low_A.q, -66.11, 0.01);
        EXPECT_NEAR(map.report.reciprocity, 0.01, 0.004);
        EXPECT_THAT(map.note, HasSubstr("not reciprocal"));
        EXPECT_EQ(flux_table_warning(map, 0.1967, 2), "");
    }
}

TEST(FluxMapData, Pm270IsNotWarnedOf)
{
    const char *given = std::getenv("PMDRIVE_DATA");
    const fs::path folder = fs::absolute(given != nullptr ? given : "../shared/data");
    if (!fs::exists(folder / "pm270l8_ipm_fea.csv")) {
        GTEST_SKIP() << "no data of real machines: set PMDRIVE_DATA to their folder";
    }
    const FluxMap map = read("table: pm270l8_ipm_fea.csv\nmirror_q: true\n", (folder / "m.yaml").string());
    EXPECT_EQ(flux_table_warning(map, 0.02, 4), "");
}

TEST(FluxMapData, NoMachineOfTheTreeIsWarnedOf)
{
    int maps = 0;
    for (const char *folder : {"sim_plant/machines", "tests/data/machines"}) {
        for (const auto &entry : fs::directory_iterator(folder)) {
            try {
                const pmsim::Setup setup = load_machine_file(entry.path().string());
                if (setup.flux_map) {
                    ++maps;
                    EXPECT_EQ(flux_table_warning(*setup.flux_map, setup.plant.machine.R_s_ohm,
                                                 setup.plant.machine.pole_pairs),
                              "")
                        << entry.path();
                }
            } catch (const InputError &error) { // the data of real machines are not in the tree
                EXPECT_THAT(error.what(), HasSubstr("cannot be read")) << entry.path();
            }
        }
    }
    std::printf("%d maps\n", maps);
}

} // namespace
} // namespace pmsim
