#include "tools/pmsim/drive_parameters.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware/params/parameters.h"
#include "tools/pmsim/text.h"

namespace pmsim
{

Parameters::Parameters() : values_(std::make_unique<drive_params_t>())
{
    drive_params_default(values_.get());
}

Parameters::Parameters(const Parameters &other) : values_(std::make_unique<drive_params_t>(*other.values_))
{
}

Parameters &Parameters::operator=(const Parameters &other)
{
    *values_ = *other.values_;
    return *this;
}

Parameters::~Parameters() = default;

static const double max_rounding = 0.01; // of the value

const std::vector<std::string> &parameter_names()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> list;
        for (const drive_param_info_t &info : drive_param_table) {
            list.emplace_back(info.name);
        }
        return list;
    }();
    return names;
}

std::optional<drive_param_id_t> find_parameter(const std::string &name)
{
    for (int id = 0; id < DRIVE_PARAM_COUNT; ++id) {
        if (name == drive_param_table[id].name) {
            return static_cast<drive_param_id_t>(id);
        }
    }
    return std::nullopt;
}

// Division for negative exponents: 10^n is exact, 10^-n is not, and bounds are compared with literals.
double parameter_si(drive_param_id_t id, int32_t raw)
{
    const int32_t exponent = drive_param_exp10[id];
    const double scale = std::pow(10.0, std::abs(exponent));
    return exponent < 0 ? raw / scale : raw * scale;
}

double parameter_si(const drive_params_t &params, drive_param_id_t id)
{
    return parameter_si(id, drive_param_get(&params, id));
}

static double in_steps(drive_param_id_t id, double si)
{
    const int32_t exponent = drive_param_exp10[id];
    const double scale = std::pow(10.0, std::abs(exponent));
    return exponent < 0 ? si * scale : si / scale;
}

void set_parameter_si(drive_params_t &params, drive_param_id_t id, double si)
{
    const drive_param_info_t &info = drive_param_table[id];
    const double raw = std::clamp(std::round(in_steps(id, si)), double(info.min), double(info.max));
    drive_param_set(&params, id, static_cast<int32_t>(raw));
}

bool belongs_to_inverter(const std::string &name)
{
    return name == "f_pwm" || name == "timer_counts";
}

std::vector<ParameterChoice> parameter_choices(drive_param_id_t id)
{
    static const struct {
        drive_param_id_t id;
        ParameterChoice choice;
    } values[] = {
#define PM_VALUE(name, value, meaning) {DRIVE_PARAM_##name, {value, meaning}},
#include "tools/pmsim/parameter_values.def"
#undef PM_VALUE
    };
    std::vector<ParameterChoice> found;
    for (const auto &value : values) {
        if (value.id == id) {
            found.push_back(value.choice);
        }
    }
    return found;
}

// ": 0 fields; 1 blocks" of a parameter that is a choice.
static std::string choices(drive_param_id_t id)
{
    std::vector<std::string> found;
    for (const ParameterChoice &choice : parameter_choices(id)) {
        found.push_back(std::to_string(choice.value) + " " + choice.meaning);
    }
    return found.empty() ? "" : ": " + join(found, "; ");
}

void read_parameter(drive_params_t &params, const std::string &name, const Value &value)
{
    const auto id = find_parameter(name);
    if (!id) {
        value.fail(unknown("drive parameter", name, parameter_names()));
    }
    if (belongs_to_inverter(name)) {
        value.fail("\"" + name + "\" follows from the inverter: set inverter." +
                   (name == "f_pwm" ? "f_pwm_Hz" : "timer_counts"));
    }
    const drive_param_info_t &info = drive_param_table[*id];
    const std::string name_of_unit = drive_param_text[*id].unit;
    const std::string unit = name_of_unit == "1" ? "" : " " + name_of_unit;
    const double si = value.number(std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max());
    const double raw = std::round(in_steps(*id, si));
    if (raw < info.min || raw > info.max) {
        value.fail(name + " = " + format(si) + unit + " is out of range " +
                   format(parameter_si(*id, info.min)) + " ... " + format(parameter_si(*id, info.max)) +
                   unit + choices(*id));
    }
    if (std::fabs(raw - in_steps(*id, si)) > max_rounding * std::fabs(in_steps(*id, si))) {
        value.fail(name + " = " + format(si) + unit + " cannot be stored: the step is " +
                   format(parameter_si(*id, 1)) + unit);
    }
    drive_param_set(&params, *id, static_cast<int32_t>(raw));
}

} // namespace pmsim
