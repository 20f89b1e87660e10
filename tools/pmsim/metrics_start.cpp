// What the search for the initial position says of itself: how sure it is, how long it takes, why it refuses.
#include "tools/pmsim/metrics_special.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware/math/procedure.h"

namespace pmsim
{
namespace
{

const double nan = std::numeric_limits<double>::quiet_NaN();

// In the order of pm_procedure_t.
std::vector<std::string> refusal_names()
{
    return {"none",       "done",   "timeout",     "saliency",    "polarity", "offset",
            "no_current", "uneven", "implausible", "not_turning", "turned",   "open"};
}

// When the drive begins to run.
class StartMargin : public Metric
{
  public:
    StartMargin(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        if (s.rig.state == RIG_RUNNING && last_state_ != RIG_RUNNING) {
            least_ = std::isnan(least_) ? s.rig.margin : std::min(least_, s.rig.margin);
        }
        last_state_ = s.rig.state;
    }

    MetricValue value() const override
    {
        return {least_, ""};
    }

  private:
    double least_ = nan;
    int last_state_ = RIG_RUNNING;
};

// With the bridge driven before the drive runs.
class StartTime : public Metric
{
  public:
    StartTime(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        if (s.rig.state == RIG_FINDING) {
            first_s_ = std::isnan(first_s_) ? s.rig.truth.t_s : first_s_;
            last_s_ = s.rig.truth.t_s;
        }
    }

    MetricValue value() const override
    {
        return {last_s_ - first_s_, ""};
    }

  private:
    double first_s_ = nan, last_s_ = nan;
};

// The last procedure of a start that has refused.
class StartRefusal : public Metric
{
  public:
    StartRefusal(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        last_ = s.rig.refusal;
    }

    MetricValue value() const override
    {
        const std::vector<std::string> names = refusal_names();
        const auto at = static_cast<size_t>(last_);
        return {double(last_), at < names.size() ? names[at] : "unknown"};
    }

  private:
    int last_ = 0;
};

} // namespace

std::vector<SpecialMetric> start_metrics()
{
    return {
        {{"start_margin_sigma",
          "1",
          "least margin of what a start has found when the drive begins to run, in its own noise",
          false,
          false,
          {}},
         make_special<StartMargin>},
        {{"start_s", "s", "from the end of the calibration until the drive runs", false, false, {}},
         make_special<StartTime>},
        {{"start_refusal", "", "why a procedure of the last start has refused, or none", true, false,
          refusal_names()},
         make_special<StartRefusal>},
    };
}

} // namespace pmsim
