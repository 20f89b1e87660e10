#include "tools/pmsim/flux_table.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>

#include "tools/pmsim/csv.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const double same_value = 1e-6;       // of a grid's range: what rounding in a file may add
const double same_angle = 0.01;       // of the step
const double most_periods = 1000;     // of the data in a turn
const double mirror_tolerance = 0.02; // of the largest psi_q

struct Axis {
    std::vector<double> x;
    std::vector<size_t> rows; // where each value stands first
};

Axis axis_of(const Csv &csv, const std::string &name)
{
    const std::vector<double> &values = csv.column(name);
    std::vector<size_t> order(values.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return values[a] < values[b]; });
    const double tolerance = same_value * (values[order.back()] - values[order.front()]);
    Axis axis;
    for (const size_t row : order) {
        if (axis.x.empty() || values[row] > axis.x.back() + tolerance) {
            axis.x.push_back(values[row]);
            axis.rows.push_back(row);
        }
    }
    return axis;
}

size_t place_on(const Axis &axis, double value)
{
    return size_t(std::upper_bound(axis.x.begin(), axis.x.end(), value) - axis.x.begin()) - 1;
}

struct Grid {
    Axis d, q, theta;

    std::string point(size_t index) const
    {
        const size_t angle = index % theta.x.size(), pair = index / theta.x.size();
        std::string text =
            "i_d_A = " + format(d.x[pair / q.x.size()], 9) + ", i_q_A = " + format(q.x[pair % q.x.size()], 9);
        return theta.x.size() > 1 ? text + ", theta_e_deg = " + format(theta.x[angle], 9) : text;
    }

    size_t size() const
    {
        return d.x.size() * q.x.size() * theta.x.size();
    }
};

// Periods in a turn; refuses angles that do not cover one period evenly.
int theta_order(const Csv &csv, const Axis &theta)
{
    const size_t count = theta.x.size();
    if (count == 1) {
        return 1;
    }
    if (std::fabs(theta.x[0]) > same_value) {
        csv.fail(theta.rows[0], "theta_e_deg begins at " + format(theta.x[0]) + ", expected 0");
    }
    const double step = theta.x[1];
    for (size_t n = 2; n < count; ++n) {
        if (std::fabs(theta.x[n] - double(n) * step) > same_angle * step) {
            csv.fail(theta.rows[n], "theta_e_deg is not equally spaced: expected " +
                                        format(double(n) * step) + ", found " + format(theta.x[n]));
        }
    }
    const double periods = 360.0 / (step * double(count)), order = std::round(periods);
    if (order < 1.0 || order > most_periods ||
        std::fabs(periods - order) > same_angle / double(count) * order) {
        csv.fail(theta.rows[count - 1], "theta_e_deg covers " + format(step * double(count)) +
                                            " degrees, of which a turn is no multiple; one period is "
                                            "expected, without its end");
    }
    return int(order);
}

// Row of each point of the grid.
std::vector<size_t> rows_of(const Csv &csv, const Grid &grid)
{
    std::vector<std::pair<size_t, size_t>> points; // index in the grid, row
    for (size_t row = 0; row < csv.rows(); ++row) {
        size_t index = place_on(grid.d, csv.column("i_d_A")[row]) * grid.q.x.size() +
                       place_on(grid.q, csv.column("i_q_A")[row]);
        index *= grid.theta.x.size();
        if (grid.theta.x.size() > 1) {
            index += place_on(grid.theta, csv.column("theta_e_deg")[row]);
        }
        points.emplace_back(index, row);
    }
    std::sort(points.begin(), points.end());
    std::vector<size_t> rows;
    for (const auto &[index, row] : points) {
        if (index < rows.size()) {
            csv.fail(row, "the point " + grid.point(index) + " stands here a second time; first at line " +
                              std::to_string(csv.line(rows[index])));
        }
        if (index > rows.size()) {
            csv.fail(row, "before this row the point " + grid.point(rows.size()) + " is missing");
        }
        rows.push_back(row);
    }
    if (rows.size() < grid.size()) {
        csv.fail(rows.back(), "after this row the point " + grid.point(rows.size()) + " is missing");
    }
    return rows;
}

// Volt-seconds and webers are the same: the unit that the head of the file has.
std::string flux_unit(const std::string &path)
{
    std::ifstream in(path, std::ios::binary);
    std::string head(1000, ' ');
    in.read(head.data(), std::streamsize(head.size()));
    return head.find("psi_d_Wb") != std::string::npos ? "_Wb" : "_Vs";
}

// psi_0(-i_q, -theta) = psi_0(i_q, theta); 60 or 180 degrees of data are half a period, after which it
// changes its sign.
double mirrored_psi_0(const FluxTable &table, size_t self, size_t image, size_t angle, bool below,
                      bool own_image)
{
    const double sign = table.theta_order % 2 == 0 && angle > 0 ? -1.0 : 1.0;
    const double mirrored = sign * table.psi_0_Wb[image];
    return below ? mirrored : own_image ? 0.5 * (table.psi_0_Wb[self] + mirrored) : table.psi_0_Wb[self];
}

} // namespace

map_table_data_t FluxTable::data() const
{
    return {int(i_d_A.size()), int(i_q_A.size()), count_theta,     theta_order,
            i_d_A.data(),      i_q_A.data(),      psi_d_Wb.data(), psi_q_Wb.data()};
}

size_t FluxTable::index(size_t i, size_t j, size_t angle) const
{
    return (i * i_q_A.size() + j) * size_t(count_theta) + angle;
}

FluxTable read_flux_table(const std::string &path)
{
    const std::string unit = flux_unit(path);
    const Csv csv = Csv::from_file(path, {{"i_d_A", "i_q_A", "psi_d" + unit, "psi_q" + unit},
                                          {"theta_e_deg", "torque_Nm", "psi_0" + unit}});
    Grid grid{axis_of(csv, "i_d_A"), axis_of(csv, "i_q_A"), {{0.0}, {0}}};
    if (csv.has("theta_e_deg")) {
        grid.theta = axis_of(csv, "theta_e_deg");
    }
    FluxTable table;
    table.i_d_A = grid.d.x;
    table.i_q_A = grid.q.x;
    table.count_theta = int(grid.theta.x.size());
    table.theta_order = theta_order(csv, grid.theta);
    const std::vector<size_t> rows = rows_of(csv, grid);
    const auto sorted = [&](const std::string &name) {
        std::vector<double> values;
        for (size_t k = 0; csv.has(name) && k < rows.size(); ++k) {
            values.push_back(csv.column(name)[rows[k]]);
        }
        return values;
    };
    table.psi_d_Wb = sorted("psi_d" + unit);
    table.psi_q_Wb = sorted("psi_q" + unit);
    table.torque_Nm = sorted("torque_Nm");
    if (table.count_theta > 1) { // its mean over a turn is nothing
        table.psi_0_Wb = sorted("psi_0" + unit);
    }
    for (const size_t row : rows) {
        table.lines.push_back(csv.line(row));
    }
    return table;
}

FluxTable mirror_flux_table(const FluxTable &table, const std::string &path)
{
    const size_t half = table.i_q_A.size(), angles = size_t(table.count_theta);
    if (table.i_q_A[0] != 0.0) {
        throw InputError(Place{path, table.lines[0], 0},
                         "mirror_q needs a table that begins at i_q_A = 0, not at " + format(table.i_q_A[0]));
    }
    double largest = 0.0;
    for (const double psi : table.psi_q_Wb) {
        largest = std::max(largest, std::fabs(psi));
    }
    FluxTable full;
    full.i_d_A = table.i_d_A;
    full.count_theta = table.count_theta;
    full.theta_order = table.theta_order;
    for (size_t j = 1; j < half; ++j) {
        full.i_q_A.push_back(-table.i_q_A[half - j]);
    }
    full.i_q_A.insert(full.i_q_A.end(), table.i_q_A.begin(), table.i_q_A.end());
    for (size_t i = 0; i < table.i_d_A.size(); ++i) {
        for (size_t j = 0; j < full.i_q_A.size(); ++j) {
            for (size_t n = 0; n < angles; ++n) {
                const bool below = j + 1 < half;
                const size_t image =
                    table.index(i, below ? half - 1 - j : j + 1 - half, (angles - n) % angles);
                const size_t self = below ? image : table.index(i, j + 1 - half, n);
                double psi_d = table.psi_d_Wb[self], psi_q = (below ? -1.0 : 1.0) * table.psi_q_Wb[self];
                if (j + 1 == half) { // its own image: only the symmetrical part
                    const double odd = psi_q + table.psi_q_Wb[image];
                    if (std::fabs(odd) > mirror_tolerance * largest) {
                        throw InputError(
                            Place{path, table.lines[self], 0},
                            "psi_q at i_q_A = 0 is not symmetrical: this table has no mirror image");
                    }
                    psi_d = 0.5 * (psi_d + table.psi_d_Wb[image]);
                    psi_q -= 0.5 * odd;
                }
                full.psi_d_Wb.push_back(psi_d);
                full.psi_q_Wb.push_back(psi_q);
                if (!table.psi_0_Wb.empty()) {
                    full.psi_0_Wb.push_back(mirrored_psi_0(table, self, image, n, below, j + 1 == half));
                }
                full.lines.push_back(table.lines[self]);
            }
        }
    }
    return full;
}

} // namespace pmsim
