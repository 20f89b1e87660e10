#include "tools/pmsim/metrics_special.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pmsim
{
namespace
{

const double nan = std::numeric_limits<double>::quiet_NaN();

// Mean torque, its ripple and the current that makes it, at the sample instants.
class Torque : public Metric
{
  public:
    Torque(const Expectation &e, const Setup &) : ripple_(e.metric == "torque_ripple_rel")
    {
    }

    void add(const Sample &s) override
    {
        const plant_truth_t &t = s.rig.truth;
        torque_Nm_ += t.torque_Nm;
        torque_squares_ += t.torque_Nm * t.torque_Nm;
        current_squares_ += (t.i_A[0] * t.i_A[0] + t.i_A[1] * t.i_A[1] + t.i_A[2] * t.i_A[2]) / 3.0;
        count_ += 1.0;
    }

    MetricValue value() const override
    {
        const double mean_Nm = torque_Nm_ / count_;
        if (!ripple_) {
            return {std::fabs(mean_Nm) / std::sqrt(current_squares_ / count_), ""};
        }
        const double squares = std::max(0.0, torque_squares_ / count_ - mean_Nm * mean_Nm);
        return {std::sqrt(squares) / std::fabs(mean_Nm), ""};
    }

  private:
    bool ripple_;
    double torque_Nm_ = 0.0, torque_squares_ = 0.0, current_squares_ = 0.0, count_ = 0.0;
};

// By the plant's energies: all that happens within the periods is in them.
class Power : public Metric
{
  public:
    Power(const Expectation &e, const Setup &) : efficiency_(e.metric == "efficiency")
    {
    }

    void add(const Sample &s) override
    {
        first_ = started_ ? first_ : s.rig.truth;
        last_ = s.rig.truth;
        started_ = true;
    }

    MetricValue value() const override
    {
        const double time_s = last_.t_s - first_.t_s;
        if (!started_ || time_s <= 0.0) {
            return {nan, ""};
        }
        const double lost_J = last_.e_copper_J - first_.e_copper_J + last_.e_device_J - first_.e_device_J;
        const double shaft_J = last_.e_mech_J - first_.e_mech_J;
        return {efficiency_ ? shaft_J / (shaft_J + lost_J) : lost_J / time_s, ""};
    }

  private:
    bool efficiency_, started_ = false;
    plant_truth_t first_{}, last_{};
};

} // namespace

std::vector<SpecialMetric> power_metrics()
{
    return {
        {{"torque_per_ampere_Nm_A",
          "Nm/A",
          "mean air-gap torque / rms of the phase currents, at the sample instants; whole turns",
          false,
          false,
          {}},
         make_special<Torque>},
        {{"torque_ripple_rel",
          "1",
          "rms of the air-gap torque about its mean / mean, at the sample instants",
          false,
          false,
          {}},
         make_special<Torque>},
        {{"loss_W", "W", "mean loss in windings and inverter, ripple included", false, false, {}},
         make_special<Power>},
        {{"efficiency",
          "1",
          "energy at the shaft / energy at the shaft and losses; driving",
          false,
          false,
          {}},
         make_special<Power>},
    };
}

} // namespace pmsim
