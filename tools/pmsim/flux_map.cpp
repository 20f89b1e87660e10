#include "tools/pmsim/flux_map.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "tools/pmsim/flux_formula.h"
#include "tools/pmsim/flux_table.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const double reciprocity_default = 0.05;
const double magnet_least = 0.02;         // of the largest flux: less is none
const double magnet_off_deg = 10.0;       // from the d axis
const double torque_most = 2.0;           // times what currents and fluxes make, either way
const double speed_least = 2.0;           // rad/s: from here to 1000 times that a scale is believed
const double worth_saying = 1e-3;         // deviations of a table, relative
const double formula_worth_saying = 1e-8; // of a formula from its map
const double i_least_A = 1e-3, i_most_A = 1e5;

enum class Form { table, fluxes, currents };

Form form_of(const Map &map)
{
    const bool table = map.has("table"), fluxes = map.has("psi_d_Vs") || map.has("psi_q_Vs"),
               currents = map.has("i_d_A") || map.has("i_q_A");
    if (int(table) + int(fluxes) + int(currents) != 1) {
        map.value().fail("expected one of: table; psi_d_Vs and psi_q_Vs; i_d_A and i_q_A");
    }
    return table ? Form::table : fluxes ? Form::fluxes : Form::currents;
}

std::vector<std::string> known_keys(Form form)
{
    switch (form) {
    case Form::table:
        return {"table", "mirror_q", "reciprocity_max"};
    case Form::fluxes:
        return {"psi_d_Vs", "psi_q_Vs", "i_max_A", "constants", "reciprocity_max"};
    case Form::currents:
        break;
    }
    return {"i_d_A", "i_q_A", "i_max_A", "constants", "reciprocity_max"};
}

std::string percent(double part)
{
    return format(100.0 * part, 3) + " %";
}

// Refuses what is too far from reciprocal, and says what was changed to make it so.
std::string check_reciprocity(const Map &map, const Place &place, const map_table_report_t &report)
{
    const auto given = map.find("reciprocity_max");
    const double most = given ? given->number(0.0, 1.0) : reciprocity_default;
    const std::string found = "not reciprocal: the cross inductances differ by " +
                              percent(report.reciprocity) + " of the self-inductance (rms)";
    if (report.reciprocity > most) {
        throw InputError(place, found + ", more than reciprocity_max = " + percent(most));
    }
    return report.reciprocity > worth_saying
               ? found + "; made so by moving fluxes by up to " + format(1e3 * report.moved_Wb, 3) + " mVs"
               : "";
}

// Row where a flux falls as its own current rises, which no machine does; 0: none.
int falling_line(const FluxTable &t)
{
    for (size_t i = 0; i < t.i_d_A.size(); ++i) {
        for (size_t j = 0; j < t.i_q_A.size(); ++j) {
            for (size_t n = 0; n < size_t(t.count_theta); ++n) {
                const size_t here = t.index(i, j, n);
                if ((i > 0 && t.psi_d_Wb[here] <= t.psi_d_Wb[t.index(i - 1, j, n)]) ||
                    (j > 0 && t.psi_q_Wb[here] <= t.psi_q_Wb[t.index(i, j - 1, n)])) {
                    return t.lines[here];
                }
            }
        }
    }
    return 0;
}

dq_t flux_without_current_Wb(const map_table_t *table)
{
    const int angles = 360;
    dq_t sum{0.0, 0.0};
    for (int k = 0; k < angles; ++k) {
        map_point_t point;
        map_table_eval(table, dq_t{0.0, 0.0}, 6.28318530717958647693 * k / angles, &point);
        sum.d += point.psi_Wb.d / angles;
        sum.q += point.psi_Wb.q / angles;
    }
    return sum;
}

double largest(const std::vector<double> &values)
{
    double most = 0.0;
    for (const double value : values) {
        most = std::max(most, std::fabs(value));
    }
    return most;
}

// By least squares over all points; 0 where currents and fluxes make no torque.
double torque_ratio(const FluxTable &t)
{
    double both = 0.0, square = 0.0;
    for (size_t k = 0; k < t.torque_Nm.size(); ++k) {
        const size_t pair = k / size_t(t.count_theta);
        const double i_d_A = t.i_d_A[pair / t.i_q_A.size()], i_q_A = t.i_q_A[pair % t.i_q_A.size()];
        const double cross_Nm = 1.5 * (t.psi_d_Wb[k] * i_q_A - t.psi_q_Wb[k] * i_d_A);
        both += t.torque_Nm[k] * cross_Nm;
        square += cross_Nm * cross_Nm;
    }
    return square > 0.0 ? both / square : 0.0;
}

FluxTableFacts facts_of(const FluxTable &t, const std::string &file)
{
    FluxTableFacts facts;
    facts.file = file;
    facts.most_Wb = std::max(largest(t.psi_d_Wb), largest(t.psi_q_Wb));
    facts.most_A = std::max(largest(t.i_d_A), largest(t.i_q_A));
    facts.torque_ratio = torque_ratio(t);
    return facts;
}

std::string magnet_warning(const FluxTableFacts &facts)
{
    const dq_t psi = facts.magnet_Wb;
    if (std::hypot(psi.d, psi.q) < magnet_least * facts.most_Wb) {
        return ""; // a reluctance machine
    }
    const double deg = std::atan2(psi.q, psi.d) * 180.0 / 3.14159265358979323846;
    if (std::fabs(deg) < magnet_off_deg) {
        return "";
    }
    const std::string found = "at zero current psi_d = " + format(psi.d, 3) +
                              " Vs and psi_q = " + format(psi.q, 3) + " Vs: the magnets ";
    const std::string expected = "; expected is +d, with q 90 degrees ahead";
    if (std::fabs(deg) > 135.0) {
        return found + "point along -d" + expected;
    }
    return (std::fabs(deg) > 45.0 ? found + "lie on the q axis"
                                  : found + "lie " + format(deg, 3) + " degrees off the d axis") +
           expected;
}

std::string scale_warning(const FluxTableFacts &facts, double R_s_ohm, int pole_pairs)
{
    const double torque = facts.torque_ratio / pole_pairs;
    if (torque < 0.0) {
        return "torque_Nm has the other sign than 1.5 P (psi_d i_q - psi_q i_d)";
    }
    if (torque > 0.0 && !(torque > 1.0 / torque_most && torque < torque_most)) {
        return "torque_Nm is " + format(torque, 3) +
               " times 1.5 P (psi_d i_q - psi_q i_d): are currents, fluxes or pole_pairs off in scale?";
    }
    const double speed = R_s_ohm * facts.most_A / facts.most_Wb;
    if (!(speed >= speed_least && speed <= 1000.0 * speed_least)) {
        return "with R_s_ohm the EMF is as large as the drop of " + format(facts.most_A, 3) + " A at " +
               format(speed, 2) + " rad/s (usual: 10 to 500): are fluxes or currents off by 1000 in scale?";
    }
    return "";
}

std::string table_path(const Value &value)
{
    return (std::filesystem::path(value.file()).parent_path() / value.text()).string();
}

FluxMap read_table(const Map &map)
{
    const std::string path = table_path(map.at("table"));
    const auto mirror = map.find("mirror_q");
    const FluxTable given = read_flux_table(path);
    const FluxTable table = mirror && mirror->flag() ? mirror_flux_table(given, path) : given;
    const map_table_data_t data = table.data();
    FluxMap flux;
    const char *error = nullptr;
    flux.table.reset(map_table_create(&data, &flux.report, &error));
    const Place all{path, 0, 0};
    if (!flux.table) {
        throw InputError(Place{path, falling_line(table), 0}, error);
    }
    if (!table.psi_0_Wb.empty() && !map_zero_add(flux.table.get(), &data, table.psi_0_Wb.data(), &error)) {
        throw InputError(all, error);
    }
    flux.facts = facts_of(given, path);
    flux.facts.magnet_Wb = flux_without_current_Wb(flux.table.get());
    flux.note = check_reciprocity(map, all, flux.report);
    flux.low_A = {table.i_d_A.front(), table.i_q_A.front()};
    flux.high_A = {table.i_d_A.back(), table.i_q_A.back()};
    if (flux.low_A.d > 0.0 || flux.high_A.d < 0.0 || flux.low_A.q > 0.0 || flux.high_A.q < 0.0) {
        throw InputError(all, "zero current is not within the table");
    }
    if (flux.report.neglected_Wb > worth_saying * largest(table.psi_q_Wb)) {
        flux.note += (flux.note.empty() ? "" : "; ") +
                     std::string("harmonics of the angle left out: up to ") +
                     format(1e3 * flux.report.neglected_Wb, 3) + " mVs";
    }
    if (!flux.note.empty()) {
        flux.note = to_string(all) + ": " + flux.note;
    }
    return flux;
}

FluxMap read_formulas(const Map &map, Form form)
{
    const bool inverse = form == Form::currents;
    const Value first = map.at(inverse ? "i_d_A" : "psi_d_Vs"),
                second = map.at(inverse ? "i_q_A" : "psi_q_Vs");
    const double i_max_A = map.at("i_max_A").number(i_least_A, i_most_A);
    const auto constants = map.find("constants");
    const Constants values = constants ? read_constants(*constants) : Constants();
    const std::array<std::string, 2> variables =
        inverse ? std::array<std::string, 2>{"psi_d", "psi_q"} : std::array<std::string, 2>{"i_d", "i_q"};
    const Expression of_d(first, variables, values), of_q(second, variables, values);
    FluxFormulaMap made = map_of_formula(
        inverse ? flux_by_inversion(of_d, of_q, i_max_A) : flux_of_current(of_d, of_q), i_max_A);
    FluxMap flux;
    flux.report = made.report;
    flux.note = check_reciprocity(map, first.place(), made.report);
    if (!made.map) {
        first.fail(made.error);
    }
    flux.table = std::move(made.map);
    flux.low_A = {-i_max_A, -i_max_A};
    flux.high_A = {i_max_A, i_max_A};
    if (flux.note.empty() && made.deviation > formula_worth_saying) {
        flux.note = "the map follows the formulas to " + format(made.deviation, 2) + " of their largest flux";
    }
    if (!flux.note.empty()) {
        flux.note = to_string(first.place()) + ": " + flux.note;
    }
    return flux;
}

} // namespace

FluxMap read_flux_map(const Value &value)
{
    std::vector<std::string> all;
    for (const Form form : {Form::table, Form::fluxes, Form::currents}) {
        const std::vector<std::string> keys = known_keys(form);
        all.insert(all.end(), keys.begin(), keys.end());
    }
    const Form form = form_of(Map(value, all));
    const Map map(value, known_keys(form));
    FluxMap flux = form == Form::table ? read_table(map) : read_formulas(map, form);
    flux.psi_m_Wb = flux_without_current_Wb(flux.table.get()).d;
    return flux;
}

std::string flux_table_warning(const FluxMap &map, double R_s_ohm, int pole_pairs)
{
    if (map.facts.file.empty()) {
        return "";
    }
    const std::string magnet = magnet_warning(map.facts);
    const std::string scale = scale_warning(map.facts, R_s_ohm, pole_pairs);
    const std::string both = magnet + (magnet.empty() || scale.empty() ? "" : "; ") + scale;
    return both.empty() ? "" : map.facts.file + ": " + both;
}

} // namespace pmsim
