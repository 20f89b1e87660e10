#include "tools/pmsim/metrics_special.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

namespace pmsim
{
namespace
{

using Complex = std::complex<double>;

const double nan = std::numeric_limits<double>::quiet_NaN();
const double to_deg = 57.29577951308232;

Complex applied(const Sample &s)
{
    return {s.rig.truth.v_mean_alpha_V, s.rig.truth.v_mean_beta_V};
}

// Mean in the rotor's frame: at constant speed the fundamental, harmonics cancel over whole turns.
class VoltageFundamental : public Metric
{
  public:
    VoltageFundamental(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        sum_ += applied(s) * std::polar(1.0, -s.rig.truth.theta_e_rad);
        link_V_ += s.rig.truth.v_dc_V;
    }

    MetricValue value() const override
    {
        return {link_V_ > 0.0 ? std::abs(sum_) / (link_V_ / std::sqrt(3.0)) : nan, ""};
    }

  private:
    Complex sum_ = 0.0;
    double link_V_ = 0.0;
};

// What the drive commands with a sample acts over the next period and is seen as the mean at its end.
class VoltageAngleError : public Metric
{
  public:
    VoltageAngleError(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        const Complex command = acted_;
        acted_ = acts_;
        acts_ = {s.rig.v_alpha_V, s.rig.v_beta_V};
        if (count_++ >= 2 && command != 0.0 && has_position(s)) {
            const double error = std::fabs(std::arg(applied(s) / command)) * to_deg;
            worst_ = std::isnan(worst_) ? error : std::max(worst_, error);
        }
    }

    MetricValue value() const override
    {
        return {worst_, ""};
    }

  private:
    Complex acts_ = 0.0, acted_ = 0.0;
    int count_ = 0;
    double worst_ = nan;
};

} // namespace

std::vector<SpecialMetric> voltage_metrics()
{
    return {
        {{"voltage_fundamental_rel",
          "1",
          "amplitude of the voltage's fundamental / (v_dc / sqrt(3)); whole turns at constant speed",
          false,
          false,
          {}},
         make_special<VoltageFundamental>},
        {{"voltage_angle_error_max_deg",
          "deg",
          "largest angle between a period's mean voltage and the command",
          false,
          false,
          {}},
         make_special<VoltageAngleError>},
    };
}

} // namespace pmsim
