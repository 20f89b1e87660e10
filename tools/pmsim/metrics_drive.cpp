#include "tools/pmsim/metrics_special.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "tools/pmsim/names.h"

namespace pmsim
{
namespace
{

const double nan = std::numeric_limits<double>::quiet_NaN();

class FinalState : public Metric
{
  public:
    FinalState(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        state_ = s.rig.state;
    }

    MetricValue value() const override
    {
        return {double(state_), name_of(state_names(), state_)};
    }

  private:
    int state_ = RIG_OFF;
};

// Everything about the first fault of the window, and what the bridge does after it.
class Faults : public Metric
{
  public:
    Faults(const Expectation &e, const Setup &) : kind_(e.metric), t0_s_(e.t0_s)
    {
    }

    void add(const Sample &s) override
    {
        const bool starts = s.rig.fault != 0 && s.rig.fault != last_fault_;
        count_ += starts ? 1.0 : 0.0;
        lost_ += starts && is_lost(s.rig.fault) ? 1.0 : 0.0;
        if (starts && first_ == 0) {
            first_ = s.rig.fault;
            delay_s_ = s.rig.truth.t_s - t0_s_;
        }
        if (first_ != 0) {
            latency_ += s.rig.driven && !off_seen_ ? 1.0 : 0.0;
            off_seen_ = off_seen_ || !s.rig.driven;
            driven_ += s.rig.driven ? 1.0 : 0.0;
            restarts_ += at_work(s.rig.state) && !at_work(last_state_) && off_seen_ ? 1.0 : 0.0;
        }
        last_fault_ = s.rig.fault;
        last_state_ = s.rig.state;
    }

    MetricValue value() const override
    {
        const double after_fault = first_ == 0 ? nan : 0.0; // NaN unless there was one
        if (kind_ == "fault") {
            return {double(first_), name_of(fault_names(), first_)};
        }
        if (kind_ == "fault_delay_s") {
            return {delay_s_, ""};
        }
        if (kind_ == "fault_latency_periods") {
            return {after_fault + latency_, ""};
        }
        if (kind_ == "driven_after_fault_periods") {
            return {after_fault + driven_, ""};
        }
        if (kind_ == "restarts") {
            return {after_fault + restarts_, ""};
        }
        return {kind_ == "position_lost_count" ? lost_ : count_, ""};
    }

  private:
    static bool is_lost(int fault)
    {
        return name_of(fault_names(), fault) == "POSITION_LOST";
    }

    static bool at_work(int state)
    {
        return state != RIG_OFF && state != RIG_FAULT;
    }

    std::string kind_;
    double t0_s_, delay_s_ = nan;
    int first_ = 0, last_fault_ = 0, last_state_ = RIG_OFF;
    bool off_seen_ = false;
    double count_ = 0.0, lost_ = 0.0, latency_ = 0.0, driven_ = 0.0, restarts_ = 0.0;
};

// Time for which something holds: by the metric's name a limit flag, the bridge or the imposed vector.
class TimeOf : public Metric
{
  public:
    TimeOf(const Expectation &e, const Setup &setup) : period_s_(1.0 / setup.plant.inverter.f_pwm_Hz)
    {
        if (e.metric == "driven_s") {
            holds_ = [](const rig_sample_t &rig) { return rig.driven; };
        } else if (e.metric == "open_loop_s") {
            holds_ = [](const rig_sample_t &rig) { return rig.driven && rig.dragged; };
        } else {
            const std::vector<std::string> &names = limit_names();
            uint32_t mask = 0;
            for (size_t bit = 0; bit < names.size(); ++bit) {
                mask |= e.metric == "limit_" + names[bit] + "_s" ? 1U << bit : 0U;
            }
            holds_ = [mask](const rig_sample_t &rig) { return (rig.limits & mask) != 0U; };
        }
    }

    void add(const Sample &s) override
    {
        time_s_ += holds_(s.rig) ? period_s_ : 0.0;
    }

    MetricValue value() const override
    {
        return {time_s_, ""};
    }

  private:
    std::function<bool(const rig_sample_t &)> holds_;
    double period_s_, time_s_ = 0.0;
};

// The plant's own honesty: what goes in, minus losses, mechanical work and stored field energy.
class EnergyResidual : public Metric
{
  public:
    EnergyResidual(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        if (!started_) {
            first_ = s.rig.truth;
            started_ = true;
        }
        last_ = s.rig.truth;
    }

    MetricValue value() const override
    {
        const double in = last_.e_in_J - first_.e_in_J;
        const double copper = last_.e_copper_J - first_.e_copper_J;
        const double device = last_.e_device_J - first_.e_device_J;
        const double mech = last_.e_mech_J - first_.e_mech_J;
        const double field = last_.e_field_J - first_.e_field_J;
        const double scale =
            std::fabs(in) + std::fabs(copper) + std::fabs(device) + std::fabs(mech) + std::fabs(field);
        return {scale > 0.0 ? std::fabs(in - copper - device - mech - field) / scale : nan, ""};
    }

  private:
    bool started_ = false;
    plant_truth_t first_{}, last_{};
};

} // namespace

std::vector<SpecialMetric> drive_metrics()
{
    std::vector<SpecialMetric> list = {
        {{"state_final", "", "state at the end of the window", true, false, state_names()},
         make_special<FinalState>},
        {{"fault", "", "first fault of the window, or NONE", true, false, fault_names()},
         make_special<Faults>},
        {{"fault_count", "1", "faults that occurred", false, false, {}}, make_special<Faults>},
        {{"position_lost_count", "1", "faults POSITION_LOST that occurred", false, false, {}},
         make_special<Faults>},
        {{"fault_delay_s", "s", "window start to the first fault", false, false, {}}, make_special<Faults>},
        {{"fault_latency_periods",
          "1",
          "control periods with the bridge still on after detection",
          false,
          false,
          {}},
         make_special<Faults>},
        {{"driven_after_fault_periods",
          "1",
          "control periods with the bridge on, any time after the fault",
          false,
          false,
          {}},
         make_special<Faults>},
        {{"driven_s", "s", "time with the bridge on", false, false, {}}, make_special<TimeOf>},
        {{"open_loop_s", "s", "time in which the current vector is imposed", false, false, {}},
         make_special<TimeOf>},
        {{"restarts", "1", "starts after the first fault of the window", false, false, {}},
         make_special<Faults>},
        {{"energy_residual_rel",
          "1",
          "energy the plant loses or invents / energy exchanged",
          false,
          false,
          {}},
         make_special<EnergyResidual>},
    };
    for (const std::string &name : limit_names()) {
        const std::string help = "time for which the limit flag is up";
        list.push_back({{"limit_" + name + "_s", "s", help, false, false, {}}, make_special<TimeOf>});
    }
    return list;
}

} // namespace pmsim
