#include "tools/pmsim/plant_run.h"

#include <charconv>
#include <cmath>

#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const char load_column[] = "load_Nm";
const char speed_column[] = "omega_mech_rad_s";

struct Limit {
    const char *column;
    double max_abs;
};

// As for the sections of a machine file: against slips, and so that the plant can be solved.
const double max_voltage_V = 1e5;
const Limit limits[] = {{"t_s", 1e6}, {load_column, 1e6}, {speed_column, 1e6}};

std::vector<std::string> leg_columns(const Setup &setup, const char *quantity, const char *unit)
{
    std::vector<std::string> columns;
    columns.reserve(static_cast<size_t>(leg_count(setup.plant)));
    for (int leg = 0; leg < leg_count(setup.plant); ++leg) {
        columns.push_back(quantity + leg_names()[static_cast<size_t>(leg)] + unit);
    }
    return columns;
}

bool floats(unsigned floating, size_t leg)
{
    return (floating >> leg & 1U) != 0U;
}

CsvColumns input_columns(const Setup &setup, unsigned floating)
{
    CsvColumns columns{{"t_s"}, {load_column, speed_column}};
    const std::vector<std::string> legs = leg_columns(setup, "v", "_V");
    for (size_t leg = 0; leg < legs.size(); ++leg) {
        (floats(floating, leg) ? columns.optional : columns.required).push_back(legs[leg]);
    }
    return columns;
}

// Star points.
std::vector<std::string> neutral_columns(const Setup &setup)
{
    if (setup.plant.winding.connection == PLANT_OPEN) {
        return {};
    }
    return leg_count(setup.plant) == 6 ? std::vector<std::string>{"v_neutral_abc_V", "v_neutral_xyz_V"}
                                       : std::vector<std::string>{"v_neutral_V"};
}

void check_limit(const Csv &input, const std::string &column, double max_abs)
{
    const std::vector<double> &values = input.column(column);
    for (size_t row = 0; row < values.size(); ++row) {
        if (!(std::fabs(values[row]) <= max_abs)) {
            input.fail(row, column + " = " + format(values[row]) + " is out of range " + format(-max_abs) +
                                " ... " + format(max_abs));
        }
    }
}

Csv checked(Csv input, const Setup &setup)
{
    for (const Limit &limit : limits) {
        if (input.has(limit.column)) {
            check_limit(input, limit.column, limit.max_abs);
        }
    }
    for (const std::string &leg : leg_columns(setup, "v", "_V")) {
        if (input.has(leg)) {
            check_limit(input, leg, max_voltage_V);
        }
    }
    const std::vector<double> &t_s = input.column("t_s");
    for (size_t row = 1; row < t_s.size(); ++row) {
        if (!(t_s[row] > t_s[row - 1])) {
            input.fail(row, "t_s must ascend: " + format(t_s[row], 17) + " follows " +
                                format(t_s[row - 1], 17) + " of line " + std::to_string(input.line(row - 1)));
        }
    }
    return input;
}

// Shortest text that reads back as the same number.
void append(std::string &text, double value, char separator)
{
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, value);
    text.append(digits, end.ptr).push_back(separator);
}

// Given voltages are compared with other programs, to more digits than a drive sees.
constexpr double fine_tolerance = 1e-9;

class PlantRun
{
  public:
    PlantRun(const PlantFile &file, const Csv &input, unsigned floating)
        : input_(input), map_(file.setup.flux_map.get()), floating_(floating),
          legs_(static_cast<size_t>(leg_count(file.setup.plant))),
          neutrals_(neutral_columns(file.setup).size()), t_s_(input.column("t_s"))
    {
        for (const std::string &leg : leg_columns(file.setup, "v", "_V")) {
            v_V_.push_back(floats(floating, v_V_.size()) ? nullptr : &input.column(leg));
        }
        load_Nm_ = input.has(load_column) ? &input.column(load_column) : nullptr;
        speed_rad_s_ = input.has(speed_column) ? &input.column(speed_column) : nullptr;
        if (speed_rad_s_ != nullptr && file.setup.plant.mech.locked) {
            throw InputError(file.setup.given.at("mechanics.locked"),
                             std::string("the rotor is locked, but ") + input.file() + " has " +
                                 speed_column);
        }
        const char *reason = nullptr;
        plant_config_t config = file.setup.plant;
        if (config.tolerance == 0.0) {
            config.tolerance = fine_tolerance;
        }
        plant_.reset(plant_create(&config, file.theta_e_rad, &reason));
        if (!plant_) {
            refuse_plant(file.setup, reason);
        }
        for (size_t leg = 0; leg < legs_; ++leg) {
            if (floats(floating_, leg)) {
                plant_set_leg_fault(plant_.get(), int(leg), PLANT_WIRE_OPEN);
            }
        }
        write_header(file.setup);
    }

    // State at the row's time, then on to the next row.
    void play(size_t row)
    {
        if (speed_rad_s_ != nullptr) {
            plant_set_speed(plant_.get(), (*speed_rad_s_)[row]);
        }
        double v_V[PLANT_LEGS] = {};
        for (size_t leg = 0; leg < legs_; ++leg) {
            v_V[leg] = v_V_[leg] != nullptr ? (*v_V_[leg])[row] : 0.0;
        }
        if (row == 0) {
            plant_run_voltages(plant_.get(), v_V, 0.0, 0.0); // nothing was applied before
        }
        write(row);
        if (row + 1 == t_s_.size()) {
            return;
        }
        const double duration_s = t_s_[row + 1] - t_s_[row];
        if (load_Nm_ != nullptr) {
            plant_set_load(plant_.get(), (*load_Nm_)[row]);
        }
        const double rate =
            speed_rad_s_ != nullptr ? ((*speed_rad_s_)[row + 1] - (*speed_rad_s_)[row]) / duration_s : 0.0;
        plant_run_voltages(plant_.get(), v_V, rate, duration_s);
    }

    PlantOutput take()
    {
        std::string note;
        if (outside_row_) {
            note = input_.file() + ":" + std::to_string(input_.line(*outside_row_)) +
                   ": the currents leave the data of the flux map here, beyond which it is extrapolated";
        }
        return {std::move(text_), note};
    }

  private:
    struct Deleter {
        void operator()(plant_t *plant) const
        {
            plant_destroy(plant);
        }
    };

    void write_header(const Setup &setup)
    {
        text_ = "t_s";
        for (const std::string &leg : leg_columns(setup, "i", "_A")) {
            text_ += "," + leg;
        }
        text_ += ",theta_e_rad,omega_mech_rad_s,torque_Nm,psi_d_Vs,psi_q_Vs";
        for (const std::string &neutral : neutral_columns(setup)) {
            text_ += "," + neutral;
        }
        const std::vector<std::string> terminals = leg_columns(setup, "v", "_V");
        for (size_t leg = 0; leg < legs_; ++leg) {
            text_ += floats(floating_, leg) ? "," + terminals[leg] : "";
        }
        text_ += "\n";
    }

    void write(size_t row)
    {
        plant_truth_t truth;
        plant_truth(plant_.get(), &truth);
        if (!std::isfinite(truth.psi_d_Wb + truth.psi_q_Wb + truth.omega_mech_rad_s)) {
            input_.fail(row, "the solution is no longer finite");
        }
        if (map_ && !outside_row_ && !within_map(truth)) {
            outside_row_ = row;
        }
        append(text_, t_s_[row], ',');
        for (size_t leg = 0; leg < legs_; ++leg) {
            append(text_, truth.i_A[leg] + 0.0, ','); // not -0
        }
        append(text_, truth.theta_e_rad, ',');
        append(text_, speed_rad_s_ != nullptr ? (*speed_rad_s_)[row] : truth.omega_mech_rad_s, ',');
        append(text_, truth.torque_Nm, ',');
        append(text_, truth.psi_d_Wb, ',');
        append(text_, truth.psi_q_Wb, ',');
        for (size_t set = 0; set < neutrals_; ++set) {
            append(text_, 0.0 - truth.v_zero_V[set], ',');
        }
        for (size_t leg = 0; leg < legs_; ++leg) {
            if (floats(floating_, leg)) {
                append(text_, truth.v_leg_V[leg], ',');
            }
        }
        text_.back() = '\n';
    }

    bool within_map(const plant_truth_t &truth) const
    {
        const double margin = 0.01; // of the grid's width
        const auto within = [&](double i_A, double low_A, double high_A) {
            const double slack_A = margin * (high_A - low_A);
            return i_A >= low_A - slack_A && i_A <= high_A + slack_A;
        };
        return within(truth.i_d_A, map_->low_A.d, map_->high_A.d) &&
               within(truth.i_q_A, map_->low_A.q, map_->high_A.q);
    }

    const Csv &input_;
    const FluxMap *map_; // null: energy form
    std::optional<size_t> outside_row_;
    unsigned floating_; // terminals, bit k for leg k
    size_t legs_, neutrals_;
    const std::vector<double> &t_s_;
    std::vector<const std::vector<double> *> v_V_; // null: floats
    const std::vector<double> *load_Nm_, *speed_rad_s_;
    std::unique_ptr<plant_t, Deleter> plant_;
    std::string text_;
};

} // namespace

unsigned floating_legs(const std::vector<std::string> &names, const Setup &setup)
{
    const size_t legs = static_cast<size_t>(leg_count(setup.plant));
    unsigned floating = 0;
    for (const std::string &name : names) {
        size_t leg = 0;
        while (leg < legs && leg_names()[leg] != name) {
            ++leg;
        }
        if (leg == legs) {
            throw InputError("--float " + name + ": no terminal of this machine; one of: a, b, c" +
                             (legs == 6 ? ", x, y, z" : ""));
        }
        floating |= 1U << leg;
    }
    return floating;
}

Csv load_plant_input(const std::string &path, const Setup &setup, unsigned floating)
{
    return checked(Csv::from_file(path, input_columns(setup, floating)), setup);
}

Csv read_plant_input(const std::string &text, const std::string &name, const Setup &setup, unsigned floating)
{
    return checked(Csv::from_text(text, name, input_columns(setup, floating)), setup);
}

PlantOutput run_plant(const PlantFile &file, const Csv &input, const std::function<void(double)> &progress,
                      unsigned floating)
{
    PlantRun run(file, input, floating);
    for (size_t row = 0; row < input.rows(); ++row) {
        run.play(row);
        if (progress) {
            progress(double(row + 1) / double(input.rows()));
        }
    }
    return run.take();
}

} // namespace pmsim
