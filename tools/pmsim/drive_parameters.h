// The drive's parameters by name, in SI, as scenario and machine files give them.
//
// The table is the firmware's own (firmware/params/parameters.def); a value becomes the decimal integer that
// the firmware stores. Refused: unknown names, values outside the table's range, values that fall between two
// steps by more than 1 % of themselves (they would be stored as something else).
// Tests: tests/unit/pmsim/drive_parameters_test.cpp.
#ifndef PMSIM_DRIVE_PARAMETERS_H
#define PMSIM_DRIVE_PARAMETERS_H

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware/params/types.h"
#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{

// A set of values, at first the defaults. Who reads or writes a parameter by its name includes
// firmware/params/parameters.h; all others need not know which there are, and a new one does not concern them.
class Parameters
{
  public:
    Parameters();
    Parameters(const Parameters &other);
    Parameters &operator=(const Parameters &other);
    ~Parameters();

    const drive_params_t *get() const
    {
        return values_.get();
    }
    const drive_params_t &operator*() const
    {
        return *values_;
    }
    drive_params_t &operator*()
    {
        return *values_;
    }
    const drive_params_t *operator->() const
    {
        return values_.get();
    }
    drive_params_t *operator->()
    {
        return values_.get();
    }

  private:
    std::unique_ptr<drive_params_t> values_;
};

const std::vector<std::string> &parameter_names();
std::optional<drive_param_id_t> find_parameter(const std::string &name);
double parameter_si(drive_param_id_t id, int32_t raw);
double parameter_si(const drive_params_t &params, drive_param_id_t id);

// What the values of a parameter that is a choice mean; none of others.
struct ParameterChoice {
    int value;
    const char *meaning;
};
std::vector<ParameterChoice> parameter_choices(drive_param_id_t id);

// For values pmsim derives itself, e.g. from the inverter; rounded and clamped to the range.
void set_parameter_si(drive_params_t &params, drive_param_id_t id, double si);

void read_parameter(drive_params_t &params, const std::string &name, const Value &value);

// Parameters that follow from the board's data in the file (f_pwm, dead_time, full scales) are not expected
// in `drive:`; f_pwm and timer_counts are refused there, since firmware and timer cannot disagree on them.
bool belongs_to_inverter(const std::string &name);

} // namespace pmsim

#endif
