// What a run is judged by: one number or word per metric, gathered period by period.
//
// Estimates are compared with the plant's truth of the same sample instant; angle_error = theta - theta_hat
// (positive: the estimate lags), counted only while the drive has a position (running, stopping).
// `pmsim metrics` prints the table. Tests: tests/unit/pmsim/metrics_test.cpp.
#ifndef PMSIM_METRICS_H
#define PMSIM_METRICS_H

#include <memory>
#include <string>
#include <vector>

#include "tools/pmsim/scenario.h"

extern "C" {
#include "tools/pmsim/rig.h"
}

namespace pmsim
{

// One control period as the metrics and the trace see it.
struct Sample {
    rig_sample_t rig;
    double load_Nm;         // at the shaft, from the profile
    double speed_ref_rad_s; // commanded, before the drive's ramp
    int direction;          // of the command: -1, 0, 1
};

struct MetricValue {
    double number = 0.0; // NaN: nothing to judge in the window
    std::string text;    // for metrics that are words
};

class Metric
{
  public:
    virtual ~Metric() = default;
    virtual void add(const Sample &sample) = 0;
    virtual MetricValue value() const = 0;
};

struct MetricInfo {
    std::string name, unit, help;
    bool is_word = false;
    bool has_fraction = false;      // needs `fraction`
    std::vector<std::string> words; // what `equals` may say
};

const std::vector<MetricInfo> &metric_infos();
const MetricInfo *find_metric(const std::string &name);
std::vector<std::string> metric_names();
std::unique_ptr<Metric> make_metric(const Expectation &expectation, const Setup &setup);

struct Outcome {
    MetricValue value;
    bool pass = false;
    double margin = 0.0; // to the nearest bound, relative to it; negative: failed
};

Outcome judge(const Expectation &expectation, const MetricValue &value);
std::string bound_text(const Expectation &expectation); // "<= 2"

} // namespace pmsim

#endif
